//! Line charts of figures per frame, as SVG and as PNG: the same marks drawn twice, so that the two
//! never differ. It knows figures and names, nothing of scenes.

use font8x8::legacy::BASIC_LEGACY;
use tiny_skia::{Color, Paint, PathBuilder, Pixmap, Rect, Stroke, Transform};

/// Pixels of a chart.
const WIDTH: f32 = 900.0;
/// Pixels of a chart.
const HEIGHT: f32 = 420.0;
/// Room for the scale on the left, the title above, the legend on the right, the frames below.
const LEFT: f32 = 84.0;
/// See `LEFT`.
const TOP: f32 = 44.0;
/// See `LEFT`.
const RIGHT: f32 = 150.0;
/// See `LEFT`.
const BOTTOM: f32 = 48.0;
/// Side of a letter.
const LETTER: f32 = 8.0;
/// Colours of the series, told apart also by those who do not see red and green (Okabe & Ito 2008).
const COLORS: [[u8; 3]; 7] = [
    [0, 114, 178],
    [213, 94, 0],
    [0, 158, 115],
    [204, 121, 167],
    [86, 180, 233],
    [230, 159, 0],
    [80, 80, 80],
];
const INK: [u8; 3] = [40, 40, 40];
const GRID: [u8; 3] = [222, 222, 222];

/// One line of a chart.
#[derive(Clone, Debug)]
pub struct Series {
    /// What the legend says.
    pub name: String,
    /// One figure a frame, finite and ≥ 0.
    pub values: Vec<f64>,
}

/// A chart over the frames of a run.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What stands above it.
    pub title: String,
    /// What is counted, with its unit.
    pub unit: String,
    /// The lines; those beyond the seventh begin the colours again.
    pub series: Vec<Series>,
    /// Whether the scale is logarithmic; figures of zero then stand at the bottom.
    pub logarithmic: bool,
}

enum Mark {
    Line {
        points: Vec<[f32; 2]>,
        color: [u8; 3],
        width: f32,
    },
    /// `align`: 0 begins at the point, 1 ends there, ½ is in the middle.
    Text {
        at: [f32; 2],
        align: f32,
        text: String,
        color: [u8; 3],
    },
}

impl Chart {
    /// The range of the scale, and the values at which it has lines.
    fn scale(&self) -> (f64, f64, Vec<f64>) {
        let values = || self.series.iter().flat_map(|s| s.values.iter().copied());
        let most = values().fold(0.0_f64, f64::max).max(f64::MIN_POSITIVE);
        if self.logarithmic {
            let least = values().filter(|&v| v > 0.0).fold(most, f64::min);
            let (low, high) = (libm::log10(least).floor(), libm::log10(most).ceil());
            let high = if high > low { high } else { low + 1.0 };
            let lines = (0..=(high - low) as i32).map(|i| libm::pow(10.0, low + f64::from(i)));
            return (low, high, lines.collect());
        }
        let decade = libm::pow(10.0, libm::log10(most).floor());
        let fits = |step: &f64| most / step <= 6.0;
        let steps = [0.2, 0.5, 1.0, 2.0].map(|step| step * decade);
        let step = steps.into_iter().find(fits).unwrap_or(decade * 2.0);
        let count = (most / step).ceil();
        (0.0, count * step, (0..=count as u32).map(|i| f64::from(i) * step).collect())
    }

    fn marks(&self) -> Vec<Mark> {
        let (low, high, lines) = self.scale();
        let frames = self.series.iter().map(|s| s.values.len()).max().unwrap_or(0);
        let (wide, tall) = (WIDTH - LEFT - RIGHT, HEIGHT - TOP - BOTTOM);
        let x = |frame: usize| LEFT + wide * frame as f32 / (frames.max(2) - 1) as f32;
        let y = |value: f64| {
            let value = if self.logarithmic { libm::log10(value.max(1e-300)) } else { value };
            TOP + tall * (1.0 - ((value - low) / (high - low)).clamp(0.0, 1.0)) as f32
        };
        let text = |at, align, text: String, color| Mark::Text { at, align, text, color };
        let mut marks = vec![text([LEFT, 18.0], 0.0, self.title.clone(), INK)];
        marks.push(text([LEFT, 34.0], 0.0, self.unit.clone(), INK));
        for value in lines {
            let at = y(value);
            let points = vec![[LEFT, at], [LEFT + wide, at]];
            marks.push(Mark::Line { points, color: GRID, width: 1.0 });
            marks.push(text([LEFT - 6.0, at + 4.0], 1.0, short(value), INK));
        }
        for i in 0..=5 {
            let frame = frames.saturating_sub(1) * i / 5;
            let at = [x(frame), HEIGHT - BOTTOM + 16.0];
            marks.push(text(at, 0.5, frame.to_string(), INK));
        }
        let middle = [LEFT + wide * 0.5, HEIGHT - 10.0];
        marks.push(text(middle, 0.5, "frame".to_owned(), INK));
        for (number, series) in self.series.iter().enumerate() {
            let color = COLORS[number % COLORS.len()];
            let points = series.values.iter().enumerate().map(|(i, &v)| [x(i), y(v)]).collect();
            marks.push(Mark::Line { points, color, width: 1.6 });
            let at = TOP + 14.0 * number as f32 + 8.0;
            let from = LEFT + wide + 10.0;
            let points = vec![[from, at - 3.0], [from + 14.0, at - 3.0]];
            marks.push(Mark::Line { points, color, width: 3.0 });
            marks.push(text([from + 20.0, at], 0.0, series.name.clone(), INK));
        }
        marks
    }

    /// The chart as a standalone SVG document.
    #[must_use]
    pub fn svg(&self) -> String {
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
viewBox=\"0 0 {WIDTH} {HEIGHT}\" font-family=\"monospace\" font-size=\"13\">\n\
<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n"
        );
        let rgb = |[r, g, b]: [u8; 3]| format!("#{r:02x}{g:02x}{b:02x}");
        for mark in self.marks() {
            out += &match mark {
                Mark::Line { points, color, width } => {
                    let points: Vec<String> =
                        points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
                    format!(
                        "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" points=\"{}\"/>\n",
                        rgb(color),
                        points.join(" ")
                    )
                }
                Mark::Text { at: [x, y], align, text, color } => {
                    let anchor = ["start", "middle", "end"][(align * 2.0) as usize];
                    let text = text.replace('&', "&amp;").replace('<', "&lt;");
                    format!(
                        "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\" fill=\"{}\">{text}</text>\n",
                        rgb(color)
                    )
                }
            };
        }
        out + "</svg>\n"
    }

    /// The chart as a picture.
    ///
    /// # Panics
    /// Never: the size is fixed.
    #[must_use]
    pub fn png(&self) -> image::RgbImage {
        let mut map = Pixmap::new(WIDTH as u32, HEIGHT as u32).expect("the size is not zero");
        map.fill(Color::WHITE);
        for mark in self.marks() {
            let (Mark::Line { color: [r, g, b], .. } | Mark::Text { color: [r, g, b], .. }) = mark;
            let mut paint = Paint::default();
            paint.set_color_rgba8(r, g, b, 255);
            match mark {
                Mark::Line { points, width, .. } => {
                    let mut path = PathBuilder::new();
                    for (i, [x, y]) in points.into_iter().enumerate() {
                        if i == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
                    }
                    let stroke = Stroke { width, ..Stroke::default() };
                    if let Some(path) = path.finish() {
                        map.stroke_path(&path, &paint, &stroke, Transform::identity(), None);
                    }
                }
                Mark::Text { at: [x, y], align, text, .. } => {
                    let from = x - align * LETTER * text.chars().count() as f32;
                    for (i, letter) in text.chars().enumerate() {
                        let at = [from.round() + LETTER * i as f32, y.round() - LETTER];
                        write_letter(&mut map, letter, at, &paint);
                    }
                }
            }
        }
        let bytes = map.pixels().iter().flat_map(|p| [p.red(), p.green(), p.blue()]).collect();
        image::RgbImage::from_raw(map.width(), map.height(), bytes).expect("three bytes a pixel")
    }
}

/// One letter, as a square for each of its 8 × 8 dots.
fn write_letter(map: &mut Pixmap, letter: char, [x, y]: [f32; 2], paint: &Paint<'_>) {
    let rows = BASIC_LEGACY.get(letter as usize).copied().unwrap_or([0; 8]);
    for (row, dots) in rows.into_iter().enumerate() {
        for column in (0..8).filter(|column| dots >> column & 1 == 1) {
            let dot = Rect::from_xywh(x + column as f32, y + row as f32, 1.0, 1.0);
            if let Some(dot) = dot {
                map.fill_rect(dot, paint, Transform::identity(), None);
            }
        }
    }
}

/// A figure in few letters.
fn short(value: f64) -> String {
    let plain = |value: f64| {
        let text = format!("{value:.2}");
        text.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    if value >= 1e6 {
        format!("{}M", plain(value / 1e6))
    } else if value >= 1e4 {
        format!("{}k", plain(value / 1e3))
    } else if value >= 0.01 || value == 0.0 {
        plain(value)
    } else {
        format!("{value:.0e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(values: Vec<f64>, logarithmic: bool) -> Chart {
        let series = vec![Series { name: "a < b".to_owned(), values }];
        Chart { title: "t".to_owned(), unit: "ms".to_owned(), series, logarithmic }
    }

    #[test]
    fn the_scale_holds_every_figure() {
        for values in [vec![], vec![0.0], vec![3.0, 7.2], vec![0.004, 9e6]] {
            for logarithmic in [false, true] {
                let chart = chart(values.clone(), logarithmic);
                let (low, high, lines) = chart.scale();
                assert!(high > low && lines.len() >= 2 && lines.len() <= 20, "{values:?}");
                let most = values.iter().copied().fold(0.0, f64::max);
                let top = if logarithmic { libm::pow(10.0, high) } else { high };
                assert!(top >= most * 0.999, "{values:?} {high}");
            }
        }
    }

    #[test]
    fn names_are_escaped_and_both_forms_have_the_marks() {
        let chart = chart(vec![1.0, 2.0, 4.0], false);
        assert!(chart.svg().contains("a &lt; b"));
        let blue = COLORS[0];
        assert!(chart.png().pixels().any(|p| p.0 == blue));
    }
}
