//! What the figures of a scene say: the front of points that nothing beats, and sentences computed from the
//! points, none of them written beforehand.

use super::knob::{KNOBS, PAIRS};
use super::{Point, RendererPoint};

/// The points that no other beats: none takes less virtual time without losing more pixels. The quickest
/// first, so the last is the most accurate.
#[must_use]
pub fn front(points: &[Point]) -> Vec<&Point> {
    let mut sorted: Vec<&Point> = points.iter().collect();
    sorted.sort_by_key(|point| (point.virtual_ns, point.wrong_pixels));
    let mut front: Vec<&Point> = Vec::new();
    for point in sorted {
        if front.last().is_none_or(|last| point.wrong_pixels < last.wrong_pixels) {
            front.push(point);
        }
    }
    front
}

/// A change in per cent, signed.
fn change(from: u64, to: u64) -> String {
    format!("{:+.1} %", 100.0 * (to as f64 / from.max(1) as f64 - 1.0))
}

fn name(point: &Point) -> String {
    match point.value.as_str() {
        "" => point.knob.clone(),
        value => format!("{} {value}", point.knob),
    }
}

fn milliseconds(point: &Point) -> f64 {
    point.virtual_ns as f64 / f64::from(point.frames.max(1)) / 1e6
}

fn many(count: u64, what: &str) -> String {
    if count == 1 { format!("1 {what}") } else { format!("{count} {what}s") }
}

/// What a point loses, in words.
fn loss(point: &Point) -> String {
    format!(
        "{} of {} ({:.4} %), {} of {} visible parts missed, depth off by up to {:.1e}, a part missing for {} at most",
        many(point.wrong_pixels, "wrong pixel"),
        point.samples,
        100.0 * point.wrong_pixels as f64 / point.samples.max(1) as f64,
        point.missed_parts,
        point.visible_parts,
        point.depth_error,
        many(point.late.into(), "frame")
    )
}

/// Findings about the points of one scene, of which the first is the default, a paragraph each.
///
/// # Panics
/// Without points.
#[must_use]
pub fn findings(points: &[Point], renderers: &[RendererPoint]) -> Vec<String> {
    let default = &points[0];
    let mut said = vec![format!(
        "Nothing turned: {:.3} ms of virtual time a frame, {} questions and {} round trips in {} frames, {} parts drawn in vain beside {} that show.",
        milliseconds(default),
        default.queries,
        default.trips,
        default.frames,
        default.excess_parts,
        default.visible_parts
    )];
    let exact = |point: &&Point| point.wrong_pixels == 0;
    let quickest = |points: &mut dyn Iterator<Item = &'_ Point>| -> Option<Point> {
        points.min_by_key(|point| (point.virtual_ns, point.wrong_pixels)).cloned()
    };
    let (all, right) = (quickest(&mut points.iter()), quickest(&mut points.iter().filter(exact)));
    if let (Some(all), Some(right)) = (&all, &right) {
        said.push(if all.wrong_pixels == 0 {
            format!(
                "Being exact costs nothing here: the quickest of all settings, {}, loses no pixel ({:.3} ms a frame).",
                name(all),
                milliseconds(all)
            )
        } else {
            format!(
                "Being exact costs {}: the quickest setting without a wrong pixel is {} at {:.3} ms a frame, the quickest of all {} at {:.3} ms with {}.",
                change(all.virtual_ns, right.virtual_ns),
                name(right),
                milliseconds(right),
                name(all),
                milliseconds(all),
                loss(all)
            )
        });
    }
    let mut names: Vec<&str> = KNOBS.iter().map(|knob| knob.name).collect();
    names.extend(PAIRS.iter().map(|pair| pair.0));
    names.dedup();
    for knob in names {
        let of: Vec<&Point> = points.iter().filter(|point| point.knob == knob).collect();
        if of.is_empty() {
            continue;
        }
        let mut line = match of.iter().find(|point| point.wrong_pixels > 0) {
            Some(first) => {
                format!("{knob}: the first wrong pixel appears at {}: {}", first.value, loss(first))
            }
            None => format!("{knob}: no value loses a pixel"),
        };
        if let Some(worst) =
            of.iter().max_by_key(|point| point.wrong_pixels).filter(|worst| worst.wrong_pixels > 0)
        {
            line += &format!("; the most are lost at {}, {}", worst.value, worst.wrong_pixels);
        }
        let changes: Vec<String> = of
            .iter()
            .map(|point| {
                format!(
                    "{} {} in time, {} in questions",
                    point.value,
                    change(default.virtual_ns, point.virtual_ns),
                    change(default.queries, point.queries)
                )
            })
            .collect();
        said.push(format!("{line}. Beside nothing turned: {}.", changes.join("; ")));
    }
    let names: Vec<String> = front(points)
        .into_iter()
        .map(|point| {
            format!("{} ({:.3} ms, {} wrong)", name(point), milliseconds(point), point.wrong_pixels)
        })
        .collect();
    said.push(format!(
        "Nothing beats, from the quickest to the most accurate: {}.",
        names.join(", ")
    ));
    said.extend(of_renderers(renderers));
    said
}

fn of_renderers(points: &[RendererPoint]) -> Option<String> {
    let exact = points.first()?;
    let line = |point: &RendererPoint| {
        format!(
            "{} with vertices in {}: {} of {} pixels show another triangle ({:.4} %), {} have another depth, off by up to {:.1e}, {} parts are missed, {} in wall time (median)",
            point.interpolation,
            point.transform,
            point.wrong_pixels,
            point.samples,
            100.0 * point.wrong_pixels as f64 / point.samples.max(1) as f64,
            point.other_depths,
            point.depth_error,
            point.missed_parts,
            change(exact.wall_ns[1], point.wall_ns[1])
        )
    };
    let lines: Vec<String> = points[1..].iter().map(line).collect();
    Some(format!(
        "Renderers on one thread beside the exact one in f32, {} fragments each: {}.",
        exact.fragments,
        lines.join("; ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(value: &str, virtual_ns: u64, wrong_pixels: u64) -> Point {
        Point {
            scene: "s".to_owned(),
            knob: "resolution".to_owned(),
            value: value.to_owned(),
            frames: 2,
            samples: 1000,
            missed_parts: wrong_pixels.min(1),
            missed_pixels: wrong_pixels,
            wrong_pixels,
            depth_error: 0.5,
            late: 1,
            excess_parts: 3,
            visible_parts: 10,
            triangles: 100,
            queries: 10,
            query_pixels: 50,
            trips: 2,
            virtual_ns,
            waited_ns: 0,
            cut_pixels: 0,
            wall_ns: [1, 2, 3],
            sound: wrong_pixels == 0,
            verdict: "held".to_owned(),
            failures: Vec::new(),
        }
    }

    /// Against the definition: on the front is what no other point beats.
    #[test]
    fn the_front_is_what_nothing_beats() {
        let points: Vec<Point> = [(5, 0), (3, 2), (4, 2), (3, 4), (1, 9), (6, 0), (2, 2)]
            .map(|(time, wrong)| point("v", time, wrong))
            .to_vec();
        let found: Vec<(u64, u64)> =
            front(&points).iter().map(|p| (p.virtual_ns, p.wrong_pixels)).collect();
        assert_eq!(found, [(1, 9), (2, 2), (5, 0)]);
        for &(time, wrong) in &found {
            let beats = |p: &&Point| {
                p.virtual_ns <= time
                    && p.wrong_pixels <= wrong
                    && (p.virtual_ns, p.wrong_pixels) != (time, wrong)
            };
            assert!(points.iter().find(beats).is_none());
        }
    }

    #[test]
    fn words_follow_the_figures() {
        let mut points =
            vec![point("", 2_000_000, 0), point("1/2", 1_000_000, 7), point("1/4", 900_000, 50)];
        points[0].knob = "default".to_owned();
        let said = findings(&points, &[]).join("\n");
        assert!(said.contains("Being exact costs +122.2 %"), "{said}");
        assert!(
            said.contains("the first wrong pixel appears at 1/2: 7 wrong pixels of 1000"),
            "{said}"
        );
        assert!(said.contains("the most are lost at 1/4, 50"), "{said}");
        points.truncate(1);
        assert!(findings(&points, &[]).join("\n").contains("Being exact costs nothing here"));
    }
}
