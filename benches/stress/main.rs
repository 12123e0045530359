//! How many small worlds a core runs and judges in a second: those of the first seeds that have 45 to 55
//! objects of 12 to 300 triangles in parts of up to 64, 10 frames of 160 × 120 and one view, whatever else
//! they pick, on the oracles that need no device and on a real one. `cargo bench --bench stress`. That every world holds is
//! asserted before anything is timed.

#![allow(clippy::disallowed_types, clippy::disallowed_methods, clippy::print_stdout)]

use std::time::Instant;

use plainsight::cull::CULLERS;
use plainsight::oracle::Questions;
use plainsight::oracle::wgpu::{Gpu, GpuStage, Hardware};
use plainsight::scene::Viewport;
use plainsight::stress::{Choice, MakeReal, judged};

/// Runs, of which the median counts.
const RUNS: usize = 5;

/// The first `count` choices of that size.
fn small(count: usize, real: &[Questions]) -> Vec<Choice> {
    let is_small = |choice: &Choice| {
        let usual = Viewport { width: 160, height: 120 };
        let knobs = (choice.frames, choice.partition.leaf_triangles);
        choice.viewport == usual && knobs == (10, 64) && {
            let scene = choice.scene().expect("every seed has a scene");
            (45..=55).contains(&scene.objects.len()) && scene.cameras.len() == 1
        }
    };
    (0..).map(|seed| Choice::of(seed, CULLERS, real)).filter(is_small).take(count).collect()
}

fn measure(what: &str, choices: &[Choice], make: &MakeReal<'_>) {
    let all = || {
        choices.iter().fold((0, 0), |(triangles, queries), choice| {
            let outcome = judged(choice, make).expect("the device stays");
            assert!(outcome.failures.is_empty(), "seed {}: {:?}", choice.seed, outcome.failures);
            (triangles + outcome.drawn, queries + outcome.queries)
        })
    };
    let (drawn, queries) = all();
    let mut times: Vec<f64> = (0..RUNS)
        .map(|_| {
            let start = Instant::now();
            assert_eq!(all(), (drawn, queries), "a seed is a world");
            start.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_unstable_by(f64::total_cmp);
    let rate = |time: f64| choices.len() as f64 / time;
    println!(
        "{what:<10} {:>4} worlds, {drawn} parts drawn, {queries} questions: {:>6.1} worlds a second ({:.1} to {:.1})",
        choices.len(),
        rate(times[RUNS / 2]),
        rate(times[RUNS - 1]),
        rate(times[0]),
    );
}

fn main() {
    // A core is one thread, and the worlds run on it as they do in a sweep: from within the pool.
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread starts");
    one.install(|| {
        measure("sim", &small(100, &[]), &|_, _| unreachable!("no real device is named"));
        let gpu = match Gpu::open(None) {
            Ok(gpu) => gpu,
            Err(error) => return println!("no device: {error}"),
        };
        println!("{}", gpu.name());
        measure("hardware", &small(20, &Questions::ALL), &|stage, questions| {
            let stage = GpuStage::new(&gpu, stage)?;
            Ok(Box::new(Hardware::new(&stage, questions)?))
        });
    });
}
