//! The hard scenes: every culler over every index holds on the simulated device, and on the real one.

use plainsight::cull::{CULLERS, CullerKind, ProxyKind};
use plainsight::index::{INDEXES, IndexKind};
use plainsight::part::PartitionKnobs;
use plainsight::run::World;
use plainsight::scene::generate::{HARD, Knobs, build};

use crate::common::gates;

/// Most frames of a scene here; `run --scene 'hard/*'` goes through all of them. As many as it takes for
/// boxes to be tightened and loosened, things to jump and the index to be built anew twice.
const FRAMES: u32 = 20;
/// The same where each round trip takes its time.
const FEW_FRAMES: u32 = 3;

fn worlds(most: u32) -> impl Iterator<Item = World> {
    HARD.iter().map(move |generator| {
        let frames = Some(generator.frames.min(most));
        let scene = build(generator.name, &Knobs { frames, ..Knobs::default() }).unwrap();
        let leaf_triangles = scene.leaf_triangles;
        World::new(scene, PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() })
    })
}

/// Every culler holds in every scene, and none makes use of the device's tolerance.
fn hold(cullers: &[CullerKind], (oracle, frames): (&str, u32), index: IndexKind, proxy: ProxyKind) {
    let mut failures = Vec::new();
    for world in worlds(frames) {
        for (trace, gate) in gates(&world, cullers, index, oracle, proxy) {
            let forgiven = gate.conservative.may_missed();
            if !gate.held() || forgiven > 0 {
                let (scene, culler) = (&world.scene.name, &trace.lane.culler);
                let why = gate.failures().join("; ");
                failures
                    .push(format!("{scene} {culler} {}: {forgiven} forgiven; {why}", index.name));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

#[test]
fn every_culler_holds_over_every_index() {
    for (place, &index) in INDEXES.iter().enumerate() {
        let frames = if place == 0 { FRAMES } else { FEW_FRAMES };
        hold(CULLERS, ("sim", frames), index, ProxyKind::Rectangle);
    }
}

#[test]
fn every_culler_holds_with_hulls_boxes_and_by_pyramids() {
    hold(CULLERS, ("sim", FEW_FRAMES), INDEXES[0], ProxyKind::Hull);
    hold(CULLERS, ("sim", FEW_FRAMES), INDEXES[0], ProxyKind::Box);
    // A pyramid is built for each round trip: not for those that make thousands.
    let many_trips = ["simple", "full-waits"];
    let few: Vec<CullerKind> =
        CULLERS.iter().filter(|culler| !many_trips.contains(&culler.name)).copied().collect();
    hold(&few, ("hierarchical-z", FEW_FRAMES), INDEXES[0], ProxyKind::Rectangle);
}

#[test]
fn every_culler_holds_on_the_real_device() {
    hold(CULLERS, ("hardware", FEW_FRAMES), INDEXES[0], ProxyKind::Rectangle);
    let full = &CULLERS[..1];
    hold(full, ("hardware", FEW_FRAMES), INDEXES[0], ProxyKind::Hull);
}
