//! Same seed, same trace: twice, on one thread or several, in debug and release, on either oracle.

use plainsight::cull::{CULLERS, ProxyKind};
use plainsight::index::INDEXES;
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
