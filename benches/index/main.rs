//! How quickly indexes take over moves: every object of a scene moves in every frame, updates alone
//! are timed. `cargo bench --bench index [-- OBJECTS …]` (default 300, the paper's bunnies, and
//! 10,000). Invariants are checked after every update before anything is timed.

#![allow(clippy::disallowed_types, clippy::disallowed_methods, clippy::print_stdout)]

use std::time::Instant;

use glam::DVec3;
use plainsight::index::{Entry, INDEXES, Moves};
use plainsight::math::Aabb;
use plainsight::part::ObjectId;
use plainsight::scene::Stream;

/// Frames of a run.
const FRAMES: usize = 200;
/// Runs, of which the median counts.
const RUNS: usize = 7;

/// Boxes of half-side up to 1 on straight lines in a box of mean density one, mirrored at its walls.
fn frames(count: u32) -> Vec<Vec<Aabb>> {
    let side = 0.9 * f64::from(count).cbrt();
    let mut stream = Stream::new(1, "motion");
    let mut point =
        |reach: f64| DVec3::from_array(std::array::from_fn(|_| stream.range(-reach, reach)));
    let objects: Vec<[DVec3; 3]> =
        (0..count).map(|_| [point(side), point(0.08), point(1.0).abs()]).collect();
    let wave = |value: f64| {
        let phase = (value + side).rem_euclid(4.0 * side);
        if phase <= 2.0 * side { phase - side } else { 3.0 * side - phase }
    };
    let at = |frame: usize, [from, step, half]: [DVec3; 3]| {
        let free = from + step * frame as f64;
        let center = DVec3::new(wave(free.x), wave(free.y), wave(free.z));
        Aabb::new(center - half, center + half)
    };
    let frame = |frame| objects.iter().map(|&object| at(frame, object)).collect();
    (0..FRAMES).map(frame).collect()
}

fn main() {
    let named: Vec<u32> = std::env::args().filter_map(|word| word.parse().ok()).collect();
    let counts = if named.is_empty() { vec![300, 10_000] } else { named };
    println!("{:<16} {:>9} {:>16} {:>16}", "index", "objects", "ns an object", "us a frame");
    for count in counts {
        let frames = frames(count);
        let moved: Vec<ObjectId> = (0..count).map(ObjectId).collect();
        let moves = |boxes| Moves { boxes, moved: &moved, jumped: &[] };
        // Half sides are up to 1, but for their rounding.
        let entry = |&bounds: &Aabb| Entry { bounds, step_bound: 0.14, reach: 1.0 + 1e-9 };
        let entries: Vec<Entry> = frames[0].iter().map(entry).collect();
        for kind in INDEXES {
            let mut index = (kind.build)(&entries);
            for boxes in &frames[1..] {
                index.update(moves(boxes));
                index.check(boxes).expect("an index keeps its promises");
            }
            let mut times: Vec<f64> = (0..RUNS)
                .map(|_| {
                    let mut index = (kind.build)(&entries);
                    let start = Instant::now();
                    frames[1..].iter().for_each(|boxes| index.update(moves(boxes)));
                    start.elapsed().as_secs_f64()
                })
                .collect();
            times.sort_unstable_by(f64::total_cmp);
            let frame = times[RUNS / 2] / (FRAMES - 1) as f64;
            let object = frame / f64::from(count);
            println!("{:<16} {count:>9} {:>16.1} {:>16.1}", kind.name, object * 1e9, frame * 1e6);
        }
    }
}
