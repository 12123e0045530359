//! The hard scenes: every culler over every index holds on the simulated device, and on the real one.

use plainsight::cull::ProxyKind;
use plainsight::index::INDEXES;
use plainsight::part::PartitionKnobs;
use plainsight::run::World;
use plainsight::scene::generate::{HARD, Knobs, build};

use crate::common::gates;

/// Frames of the long scenes here; `run --scene 'hard/*'` goes through all of them.
const FRAMES: u32 = 8;
/// The same on the real device, where each round trip takes its time.
const DEVICE_FRAMES: u32 = 3;

fn worlds(most: u32) -> impl Iterator<Item = World> {
    HARD.iter().map(move |generator| {
        let frames = Some(generator.frames.min(most));
        let scene = build(generator.name, &Knobs { frames, ..Knobs::default() }).unwrap();
        let leaf_triangles = scene.leaf_triangles;
        World::new(scene, PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() })
    })
}

fn hold((oracle, frames): (&str, u32), indexes: usize, proxies: &[ProxyKind]) {
    let mut failures = Vec::new();
    for world in worlds(frames) {
        for index in &INDEXES[..indexes] {
            for &proxy in proxies {
                for (culler, gate) in gates(&world, *index, oracle, proxy) {
                    if !gate.held() {
                        let (scene, index) = (&world.scene.name, index.name);
                        let why = gate.failures().join("; ");
                        failures.push(format!("{scene} {culler} {index} {proxy:?}: {why}"));
                    }
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_culler_holds_on_the_simulated_device() {
    hold(("sim", FRAMES), INDEXES.len(), &[ProxyKind::Rectangle]);
    hold(("sim", FRAMES), 1, &[ProxyKind::Box]);
    hold(("hierarchical-z", DEVICE_FRAMES), 1, &[ProxyKind::Rectangle]);
}

#[test]
fn every_culler_holds_on_the_real_device() {
    hold(("hardware", DEVICE_FRAMES), 1, &[ProxyKind::Rectangle]);
}
