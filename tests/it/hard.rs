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
/// Cullers that make thousands of round trips in a frame.
const MANY_TRIPS: [&str; 2] = ["simple", "full-waits"];
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

/// A very different device: its tolerance is wide, and may be made use of.
#[test]
fn cullers_hold_on_a_second_device() {
    let few: Vec<CullerKind> =
        CULLERS.iter().filter(|culler| ["full", "chc++"].contains(&culler.name)).copied().collect();
    let mut failures = Vec::new();
    let by = |frames: u32, cullers: &[CullerKind], proxy: ProxyKind| -> Vec<_> {
        let of = |world: World| {
            let gates = gates(&world, cullers, INDEXES[0], "swiftshader", proxy);
            (world, gates)
        };
        worlds(frames).map(of).collect()
    };
    let by_rectangles = by(FEW_FRAMES, &few, ProxyKind::Rectangle);
    let by_hulls = by(1, &few[..1], ProxyKind::Hull);
    for (world, gates) in by_rectangles.into_iter().chain(by_hulls) {
        for (trace, gate) in gates {
            if !gate.held() {
                let (scene, culler) = (&world.scene.name, &trace.lane.culler);
                failures.push(format!("{scene} {culler}: {}", gate.failures().join("; ")));
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
}

/// Every culler holds in every scene, and none makes use of the device's tolerance.
fn hold(cullers: &[CullerKind], (oracle, frames): (&str, u32), index: IndexKind, proxy: ProxyKind) {
    hold_on(worlds(frames), cullers, oracle, index, proxy);
}

fn hold_on(
    worlds: impl Iterator<Item = World>,
    cullers: &[CullerKind],
    oracle: &str,
    index: IndexKind,
    proxy: ProxyKind,
) {
    let mut failures = Vec::new();
    for world in worlds {
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

/// The cullers, and those of them that make thousands of round trips in a frame: on a real device each
/// takes its time, and what they ask is asked by the others as well.
fn by_trips() -> (Vec<CullerKind>, Vec<CullerKind>) {
    CULLERS.iter().partition(|culler| !MANY_TRIPS.contains(&culler.name))
}

#[test]
fn every_culler_holds_over_every_index() {
    hold(CULLERS, ("sim", FRAMES), INDEXES[0], ProxyKind::Rectangle);
    hold(CULLERS, ("sim", FEW_FRAMES), INDEXES[1], ProxyKind::Rectangle);
    // A culler each, in turn, and every other scene; every culler meets every index in the sweep of small
    // worlds.
    for (place, &index) in INDEXES.iter().enumerate().skip(2) {
        let culler = [CULLERS[place % CULLERS.len()]];
        let worlds = worlds(FEW_FRAMES).skip(place / 2 % 2).step_by(2);
        hold_on(worlds, &culler, "sim", index, ProxyKind::Rectangle);
    }
}

#[test]
fn every_culler_holds_with_other_proxies_and_by_pyramids() {
    let (few, many) = by_trips();
    for proxy in [ProxyKind::Hull, ProxyKind::Box] {
        hold(&few, ("sim", FEW_FRAMES), INDEXES[0], proxy);
        hold(&many, ("sim", 1), INDEXES[0], proxy);
    }
    // A pyramid is built for each round trip: not for those that make thousands.
    hold(&few, ("hierarchical-z", FEW_FRAMES), INDEXES[0], ProxyKind::Rectangle);
}

#[test]
fn every_culler_holds_on_the_real_device() {
    let (few, many) = by_trips();
    hold(&few, ("hardware", FEW_FRAMES), INDEXES[0], ProxyKind::Rectangle);
    hold(&many, ("hardware", 1), INDEXES[0], ProxyKind::Rectangle);
    hold(&CULLERS[..1], ("hardware", 1), INDEXES[0], ProxyKind::Hull);
}
