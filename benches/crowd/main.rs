//! How the cost of an index grows with a scene whose size is beyond the view's: `city250k` and `spheres200k`
//! at a tenth of the thesis's size, at its size and at ten times that, with as much near the camera.
//! `cargo bench --bench crowd [-- SCENE …]`. What is found is asserted against a look at every box in every
//! eighth frame, and the operations of a second run to be those of the first, before a time is printed.

#![allow(clippy::disallowed_types, clippy::disallowed_methods, clippy::print_stdout)]

use plainsight::part::PartitionKnobs;
use plainsight::run::World;
use plainsight::scene::generate::{Knobs, build};
use plainsight::survey::{SCENES, Survey, SurveyKnobs, beyond, contenders, survey};

/// Of the thesis's number of objects.
const SCALES: [f64; 3] = [0.1, 1.0, 10.0];
/// Frames of a run.
const FRAMES: u32 = 60;
/// Who is measured.
const NAMES: [&str; 4] = ["4", "4 DR/OCL", "TBV grid", "lazy grid"];

/// Nanoseconds a frame: of updates and finding.
fn mean(survey: &Survey) -> f64 {
    (survey.update_ns + survey.find_ns) as f64 / f64::from(survey.frames)
}

fn main() {
    let named: Vec<String> =
        std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    for tuned in SCENES.iter().filter(|t| named.is_empty() || named.iter().any(|n| n == t.scene)) {
        let mut first: Vec<(f64, f64)> = Vec::new();
        for scale in SCALES {
            let knobs = Knobs { scale: Some(scale), frames: Some(FRAMES), ..Knobs::default() };
            let scene = build(tuned.scene, &knobs).expect("the scene is known");
            let world = World::new(scene, PartitionKnobs::uncut());
            let all = [contenders(tuned, false), beyond(tuned)].concat();
            for (place, name) in NAMES.iter().enumerate() {
                let contender = all.iter().find(|c| c.name == *name).expect("it is listed");
                let run = |check_every| {
                    let knobs = SurveyKnobs { frames: FRAMES, render_every: 0, check_every };
                    survey(&world, contender, &knobs, &mut || true).expect("nobody stops it")
                };
                let (checked, timed) = (run(8), run(0));
                assert_eq!((checked.found, checked.work), (timed.found, timed.work), "{name}");
                let (mean, median) = (mean(&timed) / 1e6, timed.median_ns as f64 / 1e6);
                if first.len() <= place {
                    first.push((mean, median));
                }
                println!(
                    "{:<12} {:>8} objects, {:>5} of {:>5} found a frame, {:>4.1} bytes: {:<9} mean {mean:>7.3} ms ({:>5.1}×), median {median:>7.3} ms ({:>5.1}×)",
                    tuned.scene,
                    timed.objects,
                    timed.found / u64::from(FRAMES),
                    timed.actual / u64::from(FRAMES),
                    timed.heap_bytes as f64 / f64::from(timed.objects),
                    name,
                    mean / first[place].0,
                    median / first[place].1,
                );
            }
        }
    }
}
