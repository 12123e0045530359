//! The points of `accuracy` as a table and as a chart, and the renderers beside the reference.

use super::columns::{Column, Columns};
use super::scatter::{Dot, Scatter};
use crate::accuracy::{EffectPoint, Point, RendererPoint, front};
use crate::effect::EFFECTS;

/// Settings that take nothing from the truth, in the chart's legend.
const SOUND: &str = "takes nothing";
/// Pairs of knobs that do.
const PAIRS: &str = "pairs";

fn column(name: &'static str, cells: Vec<String>) -> Column {
    Column { head: (name, 1), cells }
}

fn of<T>(points: &[T], name: &'static str, cell: impl Fn(&T) -> String) -> Column {
    column(name, points.iter().map(cell).collect())
}

fn walls(wall_ns: [u64; 3], frames: u32) -> String {
    let [least, median, most] = wall_ns.map(|ns| ns as f64 / f64::from(frames.max(1)) / 1e6);
    format!("{median:.2} ({least:.2}-{most:.2})")
}

fn error(depth: f64) -> String {
    if depth == 0.0 { "0".to_owned() } else { format!("{depth:.0e}") }
}

/// The points of a scene, a row each, in blocks no wider than `width`. A star stands before what nothing beats.
#[must_use]
pub fn accuracy_table(points: &[Point], width: Option<usize>) -> String {
    let best = front(points);
    let name = |point: &Point| {
        let star = if best.contains(&point) { '*' } else { ' ' };
        format!("{star} {} {}", point.knob, point.value)
    };
    let frames = |point: &Point| f64::from(point.frames.max(1));
    let groups = vec![
        vec![
            of(points, "wrong px", |p| p.wrong_pixels.to_string()),
            of(points, "missed", |p| p.missed_parts.to_string()),
            of(points, "depth", |p| error(p.depth_error)),
            of(points, "late", |p| p.late.to_string()),
            of(points, "in vain", |p| p.excess_parts.to_string()),
        ],
        vec![
            of(points, "questions", |p| p.queries.to_string()),
            of(points, "trips", |p| p.trips.to_string()),
            of(points, "triangles", |p| p.triangles.to_string()),
        ],
        vec![
            of(points, "virtual ms", |p| format!("{:.3}", p.virtual_ns as f64 / frames(p) / 1e6)),
            of(points, "wall ms (least-most)", |p| walls(p.wall_ns, p.frames)),
        ],
    ];
    let names = points.iter().map(name).collect();
    Columns { head: ("setting".to_owned(), 20), names, groups }.text(width)
}

/// The renderers, a row each.
#[must_use]
pub fn renderer_table(points: &[RendererPoint], width: Option<usize>) -> String {
    let names = points
        .iter()
        .map(|point| format!("  {}, vertices in {}", point.interpolation, point.transform))
        .collect();
    let groups = vec![
        vec![
            of(points, "wrong px", |p| p.wrong_pixels.to_string()),
            of(points, "other depth", |p| p.other_depths.to_string()),
            of(points, "of", |p| p.samples.to_string()),
            of(points, "missed", |p| p.missed_parts.to_string()),
            of(points, "depth", |p| error(p.depth_error)),
        ],
        vec![
            of(points, "fragments", |p| p.fragments.to_string()),
            of(points, "wall ms (least-most)", |p| walls(p.wall_ns, p.frames)),
        ],
    ];
    Columns { head: ("renderer".to_owned(), 20), names, groups }.text(width)
}

/// What effects cost, a row for each choice of them.
#[must_use]
pub fn effect_table(points: &[EffectPoint], width: Option<usize>) -> String {
    let name = |point: &EffectPoint| match point.effects.as_slice() {
        [] => "  none".to_owned(),
        some => format!("  {}", some.join(", ")),
    };
    let evaluated = (0..EFFECTS.len())
        .map(|i| of(points, EFFECTS[i].name, |p: &EffectPoint| p.evaluations[i].to_string()));
    let frames = |point: &EffectPoint| f64::from(point.frames.max(1));
    let groups = vec![
        evaluated.collect(),
        vec![
            of(points, "boxes", |p| p.boxes.to_string()),
            of(points, "moves", |p| p.moves.to_string()),
            of(points, "state us", |p| {
                format!("{:.2}", p.state_wall_ns[1] as f64 / frames(p) / 1e3)
            }),
        ],
        vec![
            of(points, "questions", |p| p.run.queries.to_string()),
            of(points, "in vain", |p| p.run.excess_parts.to_string()),
            of(points, "virtual ms", |p| {
                format!("{:.3}", p.run.virtual_ns as f64 / frames(p) / 1e6)
            }),
            of(points, "wall ms (least-most)", |p| walls(p.run.wall_ns, p.frames)),
        ],
    ];
    let names = points.iter().map(name).collect();
    Columns { head: ("effects".to_owned(), 20), names, groups }.text(width)
}

/// Virtual time across, wrong pixels in a million upwards.
#[must_use]
pub fn accuracy_chart(points: &[Point]) -> Scatter {
    let best = front(points);
    let dot = |point: &Point| Dot {
        group: match () {
            () if point.sound => SOUND.to_owned(),
            () if point.knob.contains(" x ") => PAIRS.to_owned(),
            () => point.knob.clone(),
        },
        name: format!("{} {}", point.knob, point.value).trim().to_owned(),
        takes: point.virtual_ns as f64 / f64::from(point.frames.max(1)) / 1e6,
        loses: 1e6 * point.wrong_pixels as f64 / point.samples.max(1) as f64,
        front: best.contains(&point),
    };
    Scatter {
        title: format!(
            "{}: what accuracy costs in time",
            points.first().map_or("", |point| point.scene.as_str())
        ),
        takes: "virtual milliseconds a frame".to_owned(),
        loses: "wrong pixels in a million".to_owned(),
        dots: points.iter().map(dot).collect(),
    }
}
