//! Table 1 and Figures 6 to 9 of Kovalčík & Sochor 2006, made from traces and set beside the paper's
//! own figures.

use serde_json::json;

use super::chart::{Chart, Series};
use super::columns::{Column, Columns, wrapped};
use super::memory::{CSV_HEAD, MemoryFigures, memory_table};
use crate::oracle::CostModel;
use crate::run::{FrameTrace, Trace};

/// A row of the paper's Table 1: averages per frame.
#[derive(Clone, Copy, Debug)]
pub struct Published {
    /// The scene as it is called here.
    pub scene: &'static str,
    /// The culler as it is called here.
    pub culler: &'static str,
    /// Milliseconds a frame on a Radeon 9500.
    pub ms: f64,
    /// Object parts drawn.
    pub parts: f64,
    /// Occlusion queries.
    pub queries: f64,
}

const fn published(
    scene: &'static str,
    culler: &'static str,
    [ms, parts, queries]: [f64; 3],
) -> Published {
    Published { scene, culler, ms, parts, queries }
}

/// Kovalčík & Sochor 2006, Table 1.
pub const TABLE_1: [Published; 6] = [
    published("powerplant", "full", [788.0, 522.0, 216.0]),
    published("powerplant", "simple", [1194.0, 504.0, 616.0]),
    published("powerplant", "vfc", [5942.0, 1678.0, 0.0]),
    published("bunnies", "full", [826.0, 6260.0, 2173.0]),
    published("bunnies", "simple", [3168.0, 2584.0, 14408.0]),
    published("bunnies", "vfc", [3836.0, 22344.0, 0.0]),
];

fn paper(scene: &str, culler: &str) -> Option<Published> {
    TABLE_1.into_iter().find(|row| row.scene == scene && row.culler == culler)
}

/// The lanes of one scene with one leaf size, all on the same frames and one oracle.
pub struct Comparison<'a> {
    /// The scene's name.
    pub scene: &'a str,
    /// The scene with what sets it apart, for headings and file names.
    pub label: &'a str,
    /// One trace a culler.
    pub traces: &'a [Trace],
    /// The model of the column of virtual time.
    pub model: &'a CostModel,
}

/// The mean of a figure over the frames of a trace.
fn mean(trace: &Trace, figure: impl Fn(&FrameTrace) -> f64) -> f64 {
    trace.frames.iter().map(figure).sum::<f64>() / trace.frames.len().max(1) as f64
}

fn wall_ms(frame: &FrameTrace) -> f64 {
    frame.wall_ns as f64 / 1e6
}

impl Comparison<'_> {
    fn find(&self, culler: &str) -> Option<&Trace> {
        self.traces.iter().find(|trace| trace.lane.culler == culler)
    }

    /// Mean wall time of the visible parts drawn alone, in milliseconds, where it was measured.
    fn visible_ms(&self) -> Option<f64> {
        let measured = |t: &&Trace| t.frames.iter().all(|f| f.visible_wall_ns.is_some());
        let trace = self.traces.iter().find(measured).filter(|t| !t.frames.is_empty())?;
        Some(mean(trace, |f| f.visible_wall_ns.unwrap_or(0) as f64 / 1e6))
    }

    /// The model `radeon9500`: a triangle costs what makes `vfc` take the paper's time in this scene;
    /// a batch that is waited for costs what is left of the paper's time for `simple` in the bunnies
    /// once its drawing is taken off in proportion to its parts: (3168 − 3836 · 2584 ÷ 22344) ms ÷
    /// 14408. The rows of `vfc` are thereby met; the others are predictions.
    #[must_use]
    pub fn radeon9500(&self) -> Option<CostModel> {
        let vfc = self.find("vfc")?;
        let triangles = mean(vfc, |f| f.counts.triangles as f64);
        let row = paper(self.scene, "vfc")?;
        Some(CostModel {
            name: "radeon9500".to_owned(),
            source: "Kovalčík & Sochor 2006, Table 1".to_owned(),
            frame_ns: 0.0,
            part_ns: 0.0,
            triangle_ns: row.ms * 1e6 / triangles.max(1.0),
            query_ns: 0.0,
            proxy_ns: 0.0,
            pixel_ns: 0.0,
            trip_ns: (3168.0 - 3836.0 * 2584.0 / 22344.0) * 1e6 / 14408.0,
        })
    }

    /// The table with the ratios below it, for a terminal of `width` columns; `None` is as wide as it
    /// gets.
    #[must_use]
    pub fn table(&self, width: Option<usize>) -> String {
        let memory = |trace: &Trace| {
            let figures = MemoryFigures::of(&trace.frames);
            (trace.lane.culler.clone(), trace.frames.len(), figures)
        };
        let memory = memory_table(&self.traces.iter().map(memory).collect::<Vec<_>>());
        self.columns().text(width) + &memory + &wrapped(&self.ratios(), width)
    }

    fn columns(&self) -> Columns {
        let radeon = self.radeon9500();
        let column = |head: &'static str, least: usize, cell: &dyn Fn(&Trace) -> String| Column {
            head: (head, least),
            cells: self.traces.iter().map(cell).collect(),
        };
        let of = |trace: &Trace, figure: &dyn Fn(Published) -> f64| {
            let row = paper(self.scene, &trace.lane.culler);
            row.map_or_else(|| "-".to_owned(), |row| format!("{:.0}", figure(row)))
        };
        let virtual_ms = |trace: &Trace, model: &CostModel| {
            mean(trace, |f| model.frame_total_ns(f.amounts()) as f64 / 1e6)
        };
        let tenths = |figure: f64| format!("{figure:.1}");
        let modelled = |t: &Trace| {
            radeon.as_ref().map_or("-".to_owned(), |m| format!("{:.0}", virtual_ms(t, m)))
        };
        let triangles = |t: &Trace| format!("{:.0}", mean(t, |f| f.counts.triangles as f64));
        Columns {
            head: (self.label.to_owned(), 16),
            names: self.traces.iter().map(|trace| trace.lane.culler.clone()).collect(),
            groups: vec![
                vec![
                    column("wall ms", 9, &|t| tenths(mean(t, wall_ms))),
                    column("virtual", 9, &|t| tenths(virtual_ms(t, self.model))),
                    column("radeon", 9, &modelled),
                    column("paper", 8, &|t| of(t, &|row| row.ms)),
                ],
                vec![
                    column("parts", 9, &|t| tenths(mean(t, |f| f64::from(f.drawn_parts)))),
                    column("paper", 8, &|t| of(t, &|row| row.parts)),
                ],
                vec![
                    column("queries", 9, &|t| tenths(mean(t, |f| f.counts.queries as f64))),
                    column("paper", 8, &|t| of(t, &|row| row.queries)),
                ],
                vec![
                    column("trips", 7, &|t| tenths(mean(t, |f| f.counts.round_trips as f64))),
                    column("triangles", 11, &triangles),
                ],
            ],
        }
    }

    /// One JSON object a lane: means per frame, beside the paper's where it has the row.
    #[must_use]
    pub fn json_lines(&self) -> Vec<String> {
        let line = |trace: &Trace| {
            let row = paper(self.scene, &trace.lane.culler);
            let virtual_ms = |f: &FrameTrace| self.model.frame_total_ns(f.amounts()) as f64 / 1e6;
            let mut line = json!({
                "schema": super::JSON_SCHEMA,
                "scene": self.scene,
                "label": self.label,
                "culler": trace.lane.culler,
                "oracle": trace.lane.oracle,
                "device": trace.lane.device,
                "frames": trace.frames.len(),
                "wall_ms": mean(trace, wall_ms),
                "visible_wall_ms": self.visible_ms(),
                "cost_model": self.model.name,
                "virtual_ms": mean(trace, virtual_ms),
                "drawn_parts": mean(trace, |f| f64::from(f.drawn_parts)),
                "drawn_triangles": mean(trace, |f| f.counts.triangles as f64),
                "visible_parts": mean(trace, |f| f64::from(f.visible_parts)),
                "visible_triangles": mean(trace, |f| f.visible_triangles as f64),
                "queries": mean(trace, |f| f.counts.queries as f64),
                "proxies": mean(trace, |f| f.counts.proxies as f64),
                "pixels": mean(trace, |f| f.counts.pixels as f64),
                "round_trips": mean(trace, |f| f.counts.round_trips as f64),
                "paper_ms": row.map(|r| r.ms),
                "paper_parts": row.map(|r| r.parts),
                "paper_queries": row.map(|r| r.queries),
                "trace_hash": format!("{:016x}", trace.hash()),
            });
            if let Some(memory) = MemoryFigures::of(&trace.frames) {
                line["memory"] = json!(memory);
            }
            line.to_string()
        };
        self.traces.iter().map(line).collect()
    }

    /// What the paper's claims come down to, beside the paper's own.
    fn ratios(&self) -> String {
        let Some(first) = self.traces.first() else { return String::new() };
        let parts = mean(first, |f| f64::from(f.visible_parts));
        let triangles = mean(first, |f| f.visible_triangles as f64);
        let mut text = format!("visible: {parts:.1} parts of {triangles:.0} triangles a frame\n");
        let Some(vfc) = self.find("vfc") else { return text };
        let ceiling = mean(vfc, |f| f.counts.triangles as f64) / triangles.max(1.0);
        let published = |culler: &str, figure: &dyn Fn(Published) -> f64| {
            Some(figure(paper(self.scene, culler)?))
        };
        if let Some(ms) = self.visible_ms() {
            let ratio = mean(vfc, wall_ms) / ms;
            text += &format!(
                "the visible parts drawn alone: {ms:.1} ms; vfc ÷ that: {ratio:.2}, fraction {:.2} of the ceiling {ceiling:.2}; no culler can draw less\n",
                ratio / ceiling
            );
        }
        for trace in self.traces.iter().filter(|t| t.lane.culler != "vfc") {
            let name = &trace.lane.culler;
            let ratio = mean(vfc, wall_ms) / mean(trace, wall_ms);
            let theirs = published("vfc", &|r| r.ms).zip(published(name, &|r| r.ms));
            let (worst, frame) = worst_frame(trace, vfc, wall_ms);
            let modelled = |f: &FrameTrace| self.model.frame_total_ns(f.amounts()) as f64;
            let (worst_virtual, _) = worst_frame(trace, vfc, modelled);
            text += &format!(
                "vfc ÷ {name}: {ratio:.2} in wall time{}; ceiling {ceiling:.2}, fraction {:.2}; worst frame {worst:.2} of vfc (frame {frame}), virtual {worst_virtual:.2}\n",
                theirs.map_or(String::new(), |(a, b)| format!(" (paper {:.1})", a / b)),
                ratio / ceiling,
            );
        }
        if let Some(simple) = self.find("simple") {
            let figures = |t: &Trace| {
                (mean(t, |f| f.counts.queries as f64), mean(t, |f| f64::from(f.drawn_parts)))
            };
            let (asked, drawn) = figures(simple);
            for trace in
                self.traces.iter().filter(|t| !["vfc", "simple"].contains(&&*t.lane.culler))
            {
                let (queries, parts) = figures(trace);
                let theirs = paper(self.scene, "simple").zip(paper(self.scene, &trace.lane.culler));
                let said = |ours: f64, of: &dyn Fn(Published, Published) -> f64| {
                    let theirs = theirs.map(|(s, f)| format!(" (paper {:.2})", of(s, f)));
                    // One that asks nothing has no ratio.
                    let ours = if ours.is_finite() { format!("{ours:.2}") } else { "-".to_owned() };
                    format!("{ours}{}", theirs.unwrap_or_default())
                };
                text += &format!(
                    "simple ÷ {0} in queries: {1}; {0} ÷ simple in parts: {2}\n",
                    trace.lane.culler,
                    said(asked / queries, &|s, f| s.queries / f.queries),
                    said(parts / drawn, &|s, f| f.parts / s.parts),
                );
            }
        }
        text
    }

    /// The stems of the file names of [`Comparison::charts`].
    pub const CHARTS: [&'static str; 4] = ["time", "fps", "parts", "queries"];

    /// Figures 6 to 9, by the stems of their file names.
    #[must_use]
    pub fn charts(&self) -> [(&'static str, Chart); 4] {
        let chart = |title: &str, unit: &str, figure: &dyn Fn(&FrameTrace) -> f64| {
            let series = self.traces.iter().map(|trace| Series {
                name: trace.lane.culler.clone(),
                values: trace.frames.iter().map(figure).collect(),
            });
            Chart {
                title: format!("{}: {title}", self.label),
                unit: unit.to_owned(),
                series: series.collect(),
                logarithmic: true,
            }
        };
        let mut parts =
            chart("object parts drawn (Figure 8)", "parts", &|f| f64::from(f.drawn_parts));
        if let Some(first) = self.traces.first() {
            let values = first.frames.iter().map(|f| f64::from(f.visible_parts)).collect();
            parts.series.push(Series { name: "visible".to_owned(), values });
        }
        let [time, fps, drawn, queries] = Self::CHARTS;
        [
            (time, chart("rendering time (Figure 6)", "ms", &wall_ms)),
            (fps, chart("rendering speed (Figure 7)", "frames a second", &|f| 1e3 / wall_ms(f))),
            (drawn, parts),
            (
                queries,
                chart("occlusion queries (Figure 9)", "queries", &|f| f.counts.queries as f64),
            ),
        ]
    }

    /// Every frame of every lane as comma-separated lines, with a head.
    #[must_use]
    pub fn csv(&self) -> String {
        let limited = self.traces.iter().any(|t| t.frames.iter().any(|f| f.memory.is_some()));
        let mut text = String::from(
            "scene,culler,frame,wall_ms,virtual_ms,parts,triangles,visible_parts,visible_triangles,queries,proxies,pixels,round_trips",
        );
        text += if limited { CSV_HEAD } else { "" };
        text.push('\n');
        for trace in self.traces {
            for f in &trace.frames {
                text += &format!(
                    "{},{},{},{:.3},{:.3},{},{},{},{},{},{},{},{}{}\n",
                    self.label,
                    trace.lane.culler,
                    f.moment.frame,
                    wall_ms(f),
                    self.model.frame_total_ns(f.amounts()) as f64 / 1e6,
                    f.drawn_parts,
                    f.counts.triangles,
                    f.visible_parts,
                    f.visible_triangles,
                    f.counts.queries,
                    f.counts.proxies,
                    f.counts.pixels,
                    f.counts.round_trips,
                    f.memory.as_ref().map_or_else(String::new, MemoryFigures::csv)
                );
            }
        }
        text
    }
}

/// The largest ratio of a figure to that of the same frame of `base`, and the frame.
fn worst_frame(trace: &Trace, base: &Trace, figure: impl Fn(&FrameTrace) -> f64) -> (f64, u32) {
    let ratio =
        |(a, b): (&FrameTrace, &FrameTrace)| (figure(a) / figure(b).max(1e-9), a.moment.frame);
    trace
        .frames
        .iter()
        .zip(&base.frames)
        .map(ratio)
        .fold((0.0, 0), |worst, this| if this.0 > worst.0 { this } else { worst })
}
