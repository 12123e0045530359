//! Sweeps over worlds picked by seeds: every culler holds, situations are reached, and the way there
//! (shards, lines, replay) loses nothing.

use std::path::Path;

use plainsight::cli::{EXIT_FAILED, EXIT_HELD, Streams, main};
use plainsight::cull::{CULLERS, Culler, CullerKind, CullerSetup, DrawAll, Pen, ProxyKind, View};
use plainsight::fault::{Harm, faults, first_failure};
use plainsight::index::INDEXES;
use plainsight::oracle::{Oracle, OracleError, Questions, Stage};
use plainsight::part::{ObjectId, PartId, PartitionKnobs};
use plainsight::run::World;
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::{Scene, to_toml};
use plainsight::stress::{Choice, Outcome, REPEATED_ONE_IN, Shrunk, Tally, judged, shrink, size};
use rayon::prelude::*;

use crate::common::{gates, gpu, hardware_of};

/// Seeds of the sweep that runs with every test. With fewer some situation is not reached.
const SEEDS: u64 = 400;
/// On a real device.
const SEEDS_ON_A_DEVICE: u64 = 12;

fn none(_: &Stage, _: Questions) -> Result<Box<dyn Oracle>, OracleError> {
    unreachable!("no real device is named")
}

fn world(seed: u64) -> Outcome {
    judged(&Choice::of(seed, CULLERS, &[]), &none).unwrap()
}

#[test]
fn every_culler_holds_in_every_world() {
    let outcomes: Vec<Outcome> = (0..SEEDS).into_par_iter().map(world).collect();
    let mut tally = Tally::default();
    outcomes.iter().for_each(|outcome| tally.add(outcome));
    let said = tally.failures.iter().map(|o| format!("{}: {} {:?}", o.seed, o.options, o.failures));
    assert_eq!(tally.failed, 0, "{}", said.collect::<Vec<_>>().join("\n"));
    // What goes wrong once is not run twice.
    let twice = |seed: &u64| Choice::of(*seed, CULLERS, &[]).misbehaviour().is_none();
    let twice = (0..SEEDS).step_by(REPEATED_ONE_IN as usize).filter(twice).count();
    assert_eq!(tally.repeated, twice as u64);
    let never: Vec<String> = tally.never_reached().iter().map(ToString::to_string).collect();
    assert!(never.is_empty(), "never reached: {}", never.join(", "));
}

/// A seed is its world: run again, alone or in another order, it leaves the same line.
#[test]
fn a_seed_is_a_whole_world() {
    for seed in [3, 60, 77] {
        assert_eq!(world(seed), world(seed));
    }
}

#[test]
fn worlds_hold_on_a_real_device() {
    let real = |stage: &Stage, questions: Questions| Ok(hardware_of(gpu(), stage, questions));
    for seed in 0..SEEDS_ON_A_DEVICE {
        let choice = Choice::of(seed, CULLERS, &Questions::ALL);
        let outcome = judged(&choice, &real).unwrap();
        assert!(outcome.failures.is_empty(), "{choice}: {:?}", outcome.failures);
    }
}

/// Draws everything but, from frame 2 on, what moves.
struct Forgets;

impl Culler for Forgets {
    fn name(&self) -> &str {
        "forgets"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let moved = |part: PartId| {
            let (object, _): (ObjectId, u32) = view.partition.locate(part);
            view.moves.has(object)
        };
        let parts = (0..view.partition.part_count()).map(PartId);
        parts.filter(|&part| view.frame < 2 || !moved(part)).for_each(|part| pen.draw(part));
        Ok(())
    }
}

/// The command line with these cullers: exit code, results, talk.
fn plainsight(args: &[&str], cullers: &[CullerKind]) -> (u8, String, String) {
    let (mut out, mut talk) = (Vec::new(), Vec::new());
    let streams = Streams { out: &mut out, talk: &mut talk, width: None };
    let args = ["plainsight"].iter().chain(args).map(Into::into);
    let code = main(args, cullers, streams);
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (code, text(out), text(talk))
}

const FORGETS: CullerKind = CullerKind {
    name: "forgets",
    summary: "",
    asks: false,
    make: |_: CullerSetup| Box::new(Forgets),
};

/// A failing sweep says the seed, its options and a line that fails again; the world is shrunk to a file
/// that fails as well, with a picture of what is missing.
#[test]
fn a_failure_is_shrunk_to_a_file_that_fails() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().to_str().unwrap();
    let (code, out, _) = plainsight(&["stress", "--seeds", "0..40", "--shrink", path], &[FORGETS]);
    assert_eq!(code, EXIT_FAILED, "{out}");
    let line = |start: &str| {
        let found = out.lines().map(str::trim).find(|line| line.starts_with(start));
        found.unwrap_or_else(|| panic!("no '{start}' in {out}")).to_owned()
    };
    let seed: u64 = line("FAILED: seed ")[13..].split(':').next().unwrap().parse().unwrap();
    let again = line("replay: plainsight stress");
    let words: Vec<&str> = again.split(' ').skip(2).collect();
    assert_eq!(plainsight(&words, &[FORGETS]).0, EXIT_FAILED, "{again}");
    let files: Vec<_> =
        ["toml", "png"].map(|kind| folder.path().join(format!("seed-{seed}.{kind}"))).into();
    assert!(files.iter().all(|file| file.is_file()), "{files:?}");
    let replay = line("replay: plainsight run");
    let words: Vec<&str> = replay.split(' ').skip(2).collect();
    let (code, said, talk) = plainsight(&words, &[FORGETS]);
    assert_eq!(code, EXIT_FAILED, "{replay}: {said} {talk}");
    let small = plainsight::scene::file::load(&files[0], &Knobs::default()).unwrap();
    let (objects, frames, triangles) = size(&small);
    assert!(objects <= 2 && frames == 3 && triangles <= 2, "{:?}", size(&small));
    let picture = image::open(&files[1]).unwrap().to_rgb8();
    assert!(picture.pixels().any(|pixel| pixel.0 == [235, 30, 30]), "nothing is red");
    // A culler that holds leaves the file as it is.
    let whole =
        CullerKind { name: "forgets", make: |setup| Box::new(DrawAll::new(setup)), ..FORGETS };
    assert_eq!(plainsight(&words, &[whole]).0, EXIT_HELD);
}

/// Lines of two shards add up to the sweep's.
#[test]
fn shards_add_up() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_owned();
    let sweep = |shard: &str, out: &str| {
        let args = ["stress", "--seeds", "7..47", "--shard", shard, "--out", out];
        assert_eq!(plainsight(&args, CULLERS).0, EXIT_HELD);
    };
    let [first, second, whole] = ["a", "b", "all"].map(file);
    sweep("0/2", &first);
    sweep("1/2", &second);
    sweep("0/1", &whole);
    let merged = |files: &[&str]| {
        let args: Vec<&str> = ["stress", "--merge"].iter().chain(files).copied().collect();
        plainsight(&args, CULLERS)
    };
    let (code, out, _) = merged(&[&first, &second]);
    assert_eq!((code, out), {
        let (code, out, _) = merged(&[&whole]);
        (code, out)
    });
    let lines = |path: &str| std::fs::read_to_string(Path::new(path)).unwrap().lines().count();
    assert_eq!((lines(&first), lines(&second), lines(&whole)), (20, 20, 40));
}

/// A scene of about so many objects and frames.
fn large(objects: usize, frames: u32) -> Scene {
    let of = |seed| {
        let scale = Some(objects as f64 / 60.0);
        let knobs = Knobs { seed: Some(seed), scale, frames: Some(frames), ..Knobs::default() };
        build("swarm", &knobs).unwrap()
    };
    let fits = |scene: &Scene| {
        (objects..objects * 3 / 2).contains(&scene.objects.len()) && scene.effects.motion.is_some()
    };
    (0..).map(of).find(fits).unwrap()
}

/// Shrinks what seeded faults do to a large scene; a line each.
fn shrink_faults(scene: &Scene, most: usize) -> Vec<(String, Shrunk)> {
    let mut found = Vec::new();
    for fault in faults().into_iter().filter(|fault| fault.harm == Harm::Drops) {
        if found.len() == most || fault.broken.alter.is_some() {
            continue;
        }
        let mut fails = |scene: &Scene| {
            let knobs = PartitionKnobs {
                leaf_triangles: scene.leaf_triangles,
                ..PartitionKnobs::default()
            };
            let world = World::new(scene.clone(), knobs);
            let first = first_failure(&world, fault.broken, &mut || true).unwrap();
            first.map(|moment| moment.frame)
        };
        if let Some(shrunk) = shrink(scene, &mut fails) {
            found.push((fault.name.to_owned(), shrunk));
        }
    }
    found
}

#[test]
fn seeded_faults_shrink_to_a_handful() {
    let found = shrink_faults(&large(100, 12), 4);
    assert_eq!(found.len(), 4);
    for (name, shrunk) in found {
        let (objects, frames, triangles) = size(&shrunk.scene);
        assert!(objects < 5 && frames <= 6, "{name}: {objects} {frames} {triangles}");
    }
}

/// By hand: `cargo test --release --test it shrink_at_full_size -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement, not a test"]
#[allow(clippy::print_stderr, clippy::disallowed_types, clippy::disallowed_methods)]
fn shrink_at_full_size() {
    let scene = large(500, 100);
    eprintln!("of {:?}", size(&scene));
    let start = std::time::Instant::now();
    for (name, shrunk) in shrink_faults(&scene, usize::MAX) {
        let seconds = start.elapsed().as_secs_f64();
        eprintln!(
            "{name}: {:?} in {} tries; {seconds:.1} s so far",
            size(&shrunk.scene),
            shrunk.tried
        );
    }
}

/// Where shrunk cases are kept: scene files that stand alone, named after the fault that failed in them.
const CASES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/cases");

/// The scene of a kept case, and its world.
fn case(path: &Path) -> World {
    let scene = plainsight::scene::file::load(path, &Knobs::default())
        .unwrap_or_else(|error| panic!("{error}"));
    let knobs =
        PartitionKnobs { leaf_triangles: scene.leaf_triangles, ..PartitionKnobs::default() };
    World::new(scene, knobs)
}

/// What a sweep once shrunk fails for ever where it failed, and every unbroken culler holds there.
#[test]
fn kept_cases_still_tell_broken_from_sound() {
    let mut paths: Vec<_> =
        std::fs::read_dir(CASES).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    assert!(paths.len() >= 10, "{} cases", paths.len());
    let all = faults();
    paths.par_iter().for_each(|path| {
        let (name, world) = (path.file_stem().unwrap().to_str().unwrap(), case(path));
        let fault = all.iter().find(|fault| fault.name == name);
        let fault = fault.unwrap_or_else(|| panic!("{name} is no fault"));
        let failed = first_failure(&world, fault.broken, &mut || true).unwrap();
        assert!(failed.is_some(), "{name} no longer fails in its case");
        for index in INDEXES {
            for (trace, gate) in gates(&world, CULLERS, *index, "sim", ProxyKind::Rectangle) {
                assert!(gate.held(), "{name}: {}: {:?}", trace.lane.culler, gate.failures());
            }
        }
    });
}

/// Makes the cases anew: `cargo test --release --test it make_cases -- --ignored`.
#[test]
#[ignore = "writes tests/cases"]
fn make_cases() {
    std::fs::create_dir_all(CASES).unwrap();
    for (name, shrunk) in shrink_faults(&large(60, 12), usize::MAX) {
        let (objects, _, triangles) = size(&shrunk.scene);
        // Those that are about many objects are not small.
        if objects <= 8 && triangles <= 200 {
            let scene = Scene { name: name.clone(), ..shrunk.scene };
            std::fs::write(Path::new(CASES).join(format!("{name}.toml")), to_toml(&scene)).unwrap();
        }
    }
}
