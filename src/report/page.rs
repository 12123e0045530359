//! One self-contained HTML page of what runs came to: verdicts, tables, charts, frames to scrub through. It
//! loads nothing from anywhere, has all its figures in it as JSON for who wants to read them, and can be
//! used by keyboard and on a phone. It knows names, figures and pictures; nothing of cullers.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use serde_json::json;

use super::drawing::escaped;
use crate::check::Ruling;

/// Names of the figures of a lane's frame, in the order of [`PageLane::frames`].
pub const FRAME_FIGURES: [&str; 6] =
    ["parts drawn", "visible", "in vain", "questions", "round trips", "wall ms"];
/// Layers of pictures by key, with what each shows.
const LAYERS: [(&str, &str); 4] = [
    ("truth", "truth: each visible part in a colour of its own"),
    ("culled", "what the first culler drew"),
    ("difference", "where the two differ: in red"),
    ("top", "from above: shown green, drawn in vain orange, culled grey"),
];

/// A culler beside an oracle, run over a scene.
#[derive(Clone, Debug)]
pub struct PageLane {
    /// The culler's name.
    pub culler: String,
    /// The oracle's, with the device where there is one.
    pub oracle: String,
    /// What the gate says.
    pub ruling: Ruling,
    /// What failed, a line each; empty where all held.
    pub failures: Vec<String>,
    /// The line that replays it.
    pub replay: String,
    /// By frame and view the figures of [`FRAME_FIGURES`].
    pub frames: Vec<[f64; 6]>,
}

/// Pictures of a frame, as PNG files.
#[derive(Clone, Debug)]
pub struct PagePictures {
    /// Truth, what the first lane drew, the difference, the view from above.
    pub layers: [Vec<u8>; 4],
}

/// A scene and all that was run over it.
#[derive(Clone, Debug)]
pub struct PageScene {
    /// Its name.
    pub name: String,
    /// What is in it, a line.
    pub line: String,
    /// Views a frame.
    pub views: u32,
    /// Frame and view of each shot, in order.
    pub shots: Vec<[u32; 2]>,
    /// The lanes.
    pub lanes: Vec<PageLane>,
    /// As many as shots, or none.
    pub pictures: Vec<PagePictures>,
    /// Charts as SVG with their captions.
    pub charts: Vec<(String, String)>,
}

/// A sweep over seeds.
#[derive(Clone, Debug)]
pub struct PageSweep {
    /// What it came to, a line.
    pub line: String,
    /// What the worst of its worlds came to.
    pub ruling: Ruling,
    /// Situations, with how many worlds reached each.
    pub situations: Vec<(String, u64)>,
    /// Worst seeds: why they are here, the seed, what it picked, the line that runs it.
    pub worst: Vec<[String; 4]>,
}

/// What accuracy costs, as `accuracy` left it.
#[derive(Clone, Debug)]
pub struct PageAccuracy {
    /// Charts as SVG, with their names.
    pub charts: Vec<(String, String)>,
    /// The findings, as text.
    pub findings: String,
}

/// The whole page.
#[derive(Clone, Debug)]
pub struct Page {
    /// Its title.
    pub title: String,
    /// What made it: a line of the command.
    pub made_by: String,
    /// The scenes.
    pub scenes: Vec<PageScene>,
    /// The sweep, where one was given.
    pub sweep: Option<PageSweep>,
    /// The figures of `accuracy`, where they were given.
    pub accuracy: Option<PageAccuracy>,
}

impl PageLane {
    fn sum(&self, figure: usize) -> f64 {
        // An empty sum of floats is −0.
        self.frames.iter().map(|frame| frame[figure]).sum::<f64>() + 0.0
    }
}

/// A figure as people read it: whole, or with two decimals.
fn figure(value: f64) -> String {
    if value.fract() == 0.0 { format!("{value:.0}") } else { format!("{value:.2}") }
}

fn word(ruling: Ruling) -> String {
    match ruling {
        Ruling::Held => "<span class=\"held\">held</span>".to_owned(),
        worse => format!("<span class=\"failed\">{}</span>", worse.word().to_uppercase()),
    }
}

fn anchor(name: &str) -> String {
    name.replace(|c: char| !c.is_ascii_alphanumeric(), "-")
}

fn row(tag: &str, cells: &[String]) -> String {
    let cells: Vec<String> = cells.iter().map(|cell| format!("<{tag}>{cell}</{tag}>")).collect();
    format!("<tr>{}</tr>\n", cells.concat())
}

/// JSON that no end tag within can end.
fn in_script(value: &serde_json::Value) -> String {
    value.to_string().replace("</", "<\\/")
}

impl Page {
    /// Lanes that held, and all of them.
    #[must_use]
    pub fn held(&self) -> (usize, usize) {
        let lanes = || self.scenes.iter().flat_map(|scene| &scene.lanes);
        (lanes().filter(|lane| lane.ruling == Ruling::Held).count(), lanes().count())
    }

    /// What the worst of all lanes and worlds came to.
    #[must_use]
    pub fn ruling(&self) -> Ruling {
        let lanes = self.scenes.iter().flat_map(|scene| &scene.lanes).map(|lane| lane.ruling);
        lanes.chain(self.sweep.iter().map(|sweep| sweep.ruling)).max().unwrap_or_default()
    }

    /// The page as a document.
    #[must_use]
    pub fn html(&self) -> String {
        let (held, lanes) = self.held();
        let mut body = String::from("<a class=\"skip\" href=\"#verdicts\">to the verdicts</a>\n");
        body += &format!("<h1>{}</h1>\n", escaped(&self.title));
        body += &format!(
            "<p id=\"verdict\">verdict: {} ({held} of {lanes} lanes held)</p>\n<p class=\"faint\">made by <code>{}</code></p>\n",
            word(self.ruling()),
            escaped(&self.made_by)
        );
        body += &self.navigation();
        body += &self.verdicts();
        for scene in &self.scenes {
            body += &scene.html();
        }
        if let Some(sweep) = &self.sweep {
            body += &sweep.html();
        }
        if let Some(accuracy) = &self.accuracy {
            body += &accuracy.html();
        }
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n<style>\n{}</style>\n</head>\n<body>\n{body}<script>\n{}</script>\n</body>\n</html>\n",
            escaped(&self.title),
            include_str!("page/page.css"),
            include_str!("page/page.js")
        )
    }

    fn navigation(&self) -> String {
        let mut links: Vec<(String, String)> = vec![("verdicts".to_owned(), "verdicts".to_owned())];
        links.extend(self.scenes.iter().map(|scene| (anchor(&scene.name), scene.name.clone())));
        if self.sweep.is_some() {
            links.push(("sweep".to_owned(), "sweep".to_owned()));
        }
        if self.accuracy.is_some() {
            links.push(("accuracy".to_owned(), "accuracy".to_owned()));
        }
        let link =
            |(to, name): (String, String)| format!("<a href=\"#{to}\">{}</a>\n", escaped(&name));
        format!("<nav>{}</nav>\n", links.into_iter().map(link).collect::<String>())
    }

    fn verdicts(&self) -> String {
        let mut rows = String::new();
        for scene in &self.scenes {
            for lane in &scene.lanes {
                let cells = [
                    escaped(&scene.name),
                    escaped(&lane.culler),
                    escaped(&lane.oracle),
                    word(lane.ruling),
                    figure(lane.sum(0)),
                    figure(lane.sum(1)),
                    figure(lane.sum(3)),
                    format!("{:.2}", lane.sum(5) / lane.frames.len().max(1) as f64),
                    format!("<code>{}</code>", escaped(&lane.replay)),
                ];
                rows += &row("td", &cells);
                for failure in &lane.failures {
                    rows += &format!(
                        "<tr><td></td><td class=\"words failed\" colspan=\"8\">{}</td></tr>\n",
                        escaped(failure)
                    );
                }
            }
        }
        let heads = [
            "scene",
            "culler",
            "oracle",
            "verdict",
            "parts drawn",
            "visible",
            "questions",
            "wall ms a frame",
            "replay",
        ]
        .map(str::to_owned);
        format!(
            "<section id=\"verdicts\"><h2>Verdicts</h2><div class=\"wide\"><table class=\"names3\"><thead>{}</thead><tbody>\n{rows}</tbody></table></div></section>\n",
            row("th", &heads)
        )
    }
}

impl PageScene {
    fn data(&self) -> serde_json::Value {
        let shots: Vec<_> =
            self.shots.iter().map(|[frame, view]| json!({"frame": frame, "view": view})).collect();
        let lanes: Vec<_> = self
            .lanes
            .iter()
            .map(|lane| {
                let frames: Vec<Vec<String>> =
                    lane.frames.iter().map(|f| f.iter().map(|&v| figure(v)).collect()).collect();
                json!({"culler": lane.culler, "oracle": lane.oracle, "frames": frames})
            })
            .collect();
        let pictures: Vec<_> = self
            .pictures
            .iter()
            .map(|pictures| {
                let layers = LAYERS.iter().zip(&pictures.layers);
                layers
                    .map(|((key, _), png)| ((*key).to_owned(), json!(STANDARD.encode(png))))
                    .collect::<serde_json::Map<_, _>>()
            })
            .collect();
        json!({
            "scene": self.name,
            "views": self.views,
            "figures": FRAME_FIGURES,
            "shots": shots,
            "lanes": lanes,
            "pictures": pictures,
        })
    }

    fn html(&self) -> String {
        let id = anchor(&self.name);
        let mut text = format!(
            "<section class=\"scene\" id=\"{id}\"><h2>{}</h2>\n<p class=\"faint\">{}</p>\n",
            escaped(&self.name),
            escaped(&self.line)
        );
        text += &format!(
            "<div class=\"scrub\"><button class=\"back\" aria-label=\"frame before\">‹</button><input type=\"range\" min=\"0\" max=\"{}\" value=\"0\" aria-label=\"frame of {}\"><button class=\"on\" aria-label=\"next frame\">›</button><output>frame 0</output></div>\n",
            self.shots.len().saturating_sub(1),
            escaped(&self.name)
        );
        if !self.pictures.is_empty() {
            text += "<div class=\"pictures\">\n";
            for (key, what) in LAYERS {
                text += &format!(
                    "<figure><img data-layer=\"{key}\" alt=\"{what}\"><figcaption>{what}</figcaption></figure>\n"
                );
            }
            text += "</div>\n";
        }
        let mut heads = vec!["culler".to_owned(), "oracle".to_owned()];
        heads.extend(FRAME_FIGURES.map(str::to_owned));
        let mut rows = String::new();
        for (number, lane) in self.lanes.iter().enumerate() {
            let cells = FRAME_FIGURES.map(|_| "<td data-figure></td>").concat();
            rows += &format!(
                "<tr data-lane=\"{number}\"><td>{}</td><td>{}</td>{cells}</tr>\n",
                escaped(&lane.culler),
                escaped(&lane.oracle)
            );
        }
        text += &format!(
            "<h3>This frame</h3><div class=\"wide\"><table class=\"names2\"><thead>{}</thead><tbody>\n{rows}</tbody></table></div>\n",
            row("th", &heads)
        );
        for (caption, svg) in &self.charts {
            text += &format!(
                "<figure class=\"chart\">{svg}<figcaption>{}</figcaption></figure>\n",
                escaped(caption)
            );
        }
        text += &format!(
            "<script type=\"application/json\" class=\"data\">{}</script>\n</section>\n",
            in_script(&self.data())
        );
        text
    }
}

impl PageSweep {
    fn html(&self) -> String {
        let mut text = format!(
            "<section id=\"sweep\"><h2>Sweep over seeds</h2>\n<p>{}: {}</p>\n<h3>Worst seeds</h3>\n<div class=\"wide\"><table><thead>{}</thead><tbody>\n",
            word(self.ruling),
            escaped(&self.line),
            row("th", &["why", "seed", "what it picked", "replay"].map(str::to_owned))
        );
        for [why, seed, picked, replay] in &self.worst {
            text += &format!(
                "<tr><td>{}</td><td>{}</td><td class=\"words\">{}</td><td class=\"words\"><code>{}</code></td></tr>\n",
                escaped(why),
                escaped(seed),
                escaped(picked),
                escaped(replay)
            );
        }
        text += "</tbody></table></div>\n<h3>Situations, with the worlds that reached them</h3>\n<table><tbody>\n";
        for (name, count) in &self.situations {
            text += &row("td", &[escaped(name), count.to_string()]);
        }
        text + "</tbody></table></section>\n"
    }
}

impl PageAccuracy {
    fn html(&self) -> String {
        let mut text =
            String::from("<section id=\"accuracy\"><h2>What accuracy costs in time</h2>\n");
        for (name, svg) in &self.charts {
            text += &format!(
                "<figure class=\"chart\">{svg}<figcaption>{}</figcaption></figure>\n",
                escaped(name)
            );
        }
        text + &format!("<pre>{}</pre></section>\n", escaped(&self.findings))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(failures: &[&str]) -> Page {
        let lane = PageLane {
            culler: "a <b> culler".to_owned(),
            oracle: "sim".to_owned(),
            ruling: if failures.is_empty() { Ruling::Held } else { Ruling::Failed },
            failures: failures.iter().map(|line| (*line).to_owned()).collect(),
            replay: "plainsight replay --x 'a & b'".to_owned(),
            frames: vec![[1.0, 2.0, 0.0, 3.0, 1.0, 0.5], [2.0, 2.0, 0.0, 3.0, 1.0, 0.25]],
        };
        let scene = PageScene {
            name: "hard/</script>".to_owned(),
            line: "two objects".to_owned(),
            views: 1,
            shots: vec![[0, 0], [1, 0]],
            lanes: vec![lane],
            pictures: Vec::new(),
            charts: Vec::new(),
        };
        Page {
            title: "t".to_owned(),
            made_by: "plainsight report".to_owned(),
            scenes: vec![scene],
            sweep: None,
            accuracy: None,
        }
    }

    #[test]
    fn names_end_nothing_and_verdicts_are_said() {
        let html = page(&[]).html();
        assert!(html.contains("1 of 1 lanes held") && html.contains("a &lt;b&gt; culler"));
        assert_eq!(html.matches("</script>").count(), 2, "the data's and the code's own ends");
        assert!(!html.contains("http://") && !html.contains("https://"), "nothing is loaded");
        let failed = page(&["set: frame 0 part 7"]);
        assert!(failed.ruling() == Ruling::Failed && failed.html().contains("set: frame 0 part 7"));
    }
}
