//! Same seed, same trace: twice, on one thread or several, in debug and release, on either oracle.

use std::cell::Cell;

use plainsight::check::judge;
use plainsight::cull::{CULLERS, Culler, Pen, ProxyKind, View};
use plainsight::index::INDEXES;
use plainsight::oracle::OracleError;
use plainsight::part::PartId;
use plainsight::scene::generate::{Knobs, build};
use plainsight_reference::fast::{Options, SimdLevel};

use crate::common::{SCENES, gate, world};

fn hash(scene: &str, oracle: &str, threads: usize) -> u64 {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| {
        let world = world(scene, 5, 0.02, 4);
        gate(&world, CULLERS[0], INDEXES[0], oracle, ProxyKind::Rectangle).0.hash()
    })
}

#[test]
fn threads_and_repetition_leave_the_same_hash() {
    for scene in SCENES {
        for oracle in ["sim", "hardware"] {
            let first = hash(scene, oracle, 1);
            for threads in [1, 2, 3] {
                assert_eq!(
                    hash(scene, oracle, threads),
                    first,
                    "{scene} {oracle} {threads} threads"
                );
            }
        }
        assert_ne!(hash(scene, "sim", 1), {
            let other = world(scene, 6, 0.02, 4);
            gate(&other, CULLERS[0], INDEXES[0], "sim", ProxyKind::Rectangle).0.hash()
        });
    }
}

/// The same numbers in every build profile: `tests/release.sh` holds the release build to this snapshot.
#[test]
fn hashes_are_the_same_in_every_profile() {
    let lines: Vec<String> =
        SCENES.iter().map(|scene| format!("{scene} {:016x}", hash(scene, "sim", 2))).collect();
    insta::assert_snapshot!(lines.join("\n"));
}

/// Vector instructions and what the renderer leaves out move no bit of a trace.
#[test]
fn simd_levels_leave_the_same_hash() {
    for scene in SCENES {
        let first = hash(scene, "sim", 2);
        for level in SimdLevel::available() {
            for skip_hidden in [true, false] {
                let world = world(scene, 5, 0.02, 4).rendered(Options { level, skip_hidden });
                let (trace, _) = gate(&world, CULLERS[0], INDEXES[0], "sim", ProxyKind::Rectangle);
                assert_eq!(trace.hash(), first, "{scene} {level} {skip_hidden}");
            }
        }
    }
}

/// Draws everything, the `moved` part last.
struct Moody {
    moved: Option<u32>,
}

impl Culler for Moody {
    fn name(&self) -> &str {
        "moody"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let all = 0..view.partition.part_count();
        let others = all.filter(|part| Some(*part) != self.moved);
        others.chain(self.moved).for_each(|part| pen.draw(PartId(part)));
        Ok(())
    }
}

/// A culler that draws in another order the second time is told by the first event that differs.
#[test]
fn the_first_event_that_differs_is_named() {
    let knobs = Knobs { scale: Some(0.02), frames: Some(2), ..Knobs::default() };
    let scene = build("rooms", &knobs).unwrap();
    // Asked for its name, for the run, and for the repetition.
    let made = Cell::new(0);
    let verdict = judge(scene, |_| {
        made.set(made.get() + 1);
        Box::new(Moody { moved: (made.get() > 2).then_some(5) })
    })
    .unwrap();
    let failures = verdict.gate.failures();
    let [line] = failures.as_slice() else { panic!("{failures:?}") };
    assert!(
        line.ends_with("when run again: event 5 was draw of part 5, and then draw of part 6"),
        "{line}"
    );
}
