//! Every culler × index × oracle × proxy holds on every scene, and draws no less than it must.

use plainsight::cull::{CULLERS, ProxyKind};
use plainsight::index::{INDEXES, IndexKind};
use plainsight::oracle::{CostModel, Questions};
use plainsight::run::FrameTrace;
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use crate::common::{ORACLES, SCENES, gate, world};

/// Every culler meets every index on two of the scenes at least, with either proxy; on all of them over the
/// first two indexes, but for the cullers to which a device is slow.
#[test]
fn every_member_holds_on_every_scene() {
    for (number, scene) in SCENES.into_iter().enumerate() {
        let (long, short) = (world(scene, 3, 0.02, 4), world(scene, 3, 0.02, 2));
        for (rank, &culler) in CULLERS.iter().enumerate() {
            let meets = |(place, _): &(usize, _)| *place < 2 || (number + rank + place) % 5 < 2;
            for (_, (index, oracle, proxy)) in pairings().into_iter().filter(meets) {
                // A round trip to a device takes its time, and these make thousands in a frame: on two of
                // the scenes; the hard ones are gone through on the real device all the same.
                let slow = ["simple", "full-waits"].contains(&culler.name) && on_device(oracle);
                if slow && (number + rank) % 5 >= 2 {
                    continue;
                }
                let world = if slow { &short } else { &long };
                let (_, gate) = gate(world, culler, index, oracle, proxy);
                let name = format!("{scene} {} {} {oracle} {proxy:?}", culler.name, index.name);
                assert!(gate.held(), "{name}: {:?}", gate.failures());
                assert!(gate.excess.visible() > 0, "{name}: nothing to see");
            }
        }
    }
}

fn on_device(oracle: &str) -> bool {
    Questions::of(oracle).is_some()
}

/// Every index, oracle and proxy, each with what it bears upon: real devices over the first index
/// alone, boxes only where they are asked about, hulls on the simulated one. With the place of the index.
fn pairings() -> Vec<(usize, (IndexKind, &'static str, ProxyKind))> {
    let mut pairings = Vec::new();
    for (place, &index) in INDEXES.iter().enumerate() {
        for oracle in ORACLES.into_iter().filter(|&oracle| place == 0 || oracle == "sim") {
            pairings.push((place, (index, oracle, ProxyKind::Rectangle)));
            if ["sim", "hardware"].contains(&oracle) {
                pairings.push((place, (index, oracle, ProxyKind::Box)));
            }
            if (place, oracle) == (0, "sim") {
                pairings.push((place, (index, oracle, ProxyKind::Hull)));
            }
        }
    }
    pairings
}

/// What the paper's figures show, as an order, on a path sampled as finely as the paper's: `simple` asks
/// more than `full`, `vfc` nothing; `full` draws no more than `vfc`, `draw-all` everything. And what
/// `full-trusting` is for: it asks less and draws more.
#[test]
fn cullers_spend_in_the_papers_order() {
    for scene in ["bunnies", "city", "rooms"] {
        let world = world(scene, 1, 0.1, 32);
        let run = |name: &str| {
            let culler = *CULLERS.iter().find(|c| c.name == name).unwrap();
            let (_, gate) = gate(&world, culler, INDEXES[0], "sim", ProxyKind::Rectangle);
            assert!(gate.held(), "{scene} {name}: {:?}", gate.failures());
            (gate.excess.drawn(), gate.counts.total().queries)
        };
        let (full, simple, vfc, all) = (run("full"), run("simple"), run("vfc"), run("draw-all"));
        assert!(simple.1 > full.1 && full.1 > 0, "{scene}: {simple:?} {full:?}");
        let thrifty = run("full-trusting");
        assert!(thrifty.1 < full.1 && full.0 < thrifty.0, "{scene}: {full:?} {thrifty:?}");
        assert!(thrifty.0 < vfc.0, "{scene}: {thrifty:?} {vfc:?}");
        assert_eq!((vfc.1, all.1), (0, 0));
        assert!(full.0 < vfc.0 && vfc.0 <= all.0, "{scene}: {full:?} {vfc:?} {all:?}");
        assert_eq!(all.0, u64::from(world.partition.part_count()) * 32);
    }
}

/// proptest chooses the seed and the knobs only; the failing case is its own replay line.
#[test]
fn random_soups_hold() {
    let mut runner =
        TestRunner::new(Config { cases: 24, failure_persistence: None, ..Config::default() });
    let knobs = (any::<u32>(), 0.002_f64..0.03, 0..CULLERS.len(), 0..INDEXES.len(), 0..3_usize);
    runner
        .run(&knobs, |(seed, scale, culler, index, proxy)| {
            let world = world("soup", u64::from(seed), scale, 3);
            let (proxy, flag) = [
                (ProxyKind::Rectangle, "rectangle"),
                (ProxyKind::Hull, "hull"),
                (ProxyKind::Box, "box"),
            ][proxy];
            let (culler, index) = (CULLERS[culler], INDEXES[index]);
            let (_, gate) = gate(&world, culler, index, "sim", proxy);
            let replay = format!(
                "plainsight replay --scene soup --seed {seed} --scale {scale} --frames 3 --viewport 321x243 --leaf 256 --culler {} --index {} --proxy {}",
                culler.name, index.name, flag
            );
            prop_assert!(gate.held(), "{:?}\nreplay: {replay}", gate.failures());
            Ok(())
        })
        .unwrap();
}

/// The promise of `full-adaptive`: by the model that it weighs by, no frame costs more than frustum
/// culling and three in a hundred, in any scene.
#[test]
fn the_adaptive_culler_never_costs_much_more_than_frustum_culling() {
    const MOST: f64 = 1.03;
    let model = CostModel::lavapipe();
    for scene in SCENES {
        let world = world(scene, 1, 0.1, 12);
        let costs = |name: &str| {
            let culler = *CULLERS.iter().find(|c| c.name == name).unwrap();
            let (trace, _) = gate(&world, culler, INDEXES[0], "sim", ProxyKind::Rectangle);
            let cost = |frame: &FrameTrace| model.frame_total_ns(frame.amounts()) as f64;
            trace.frames.iter().map(cost).collect::<Vec<f64>>()
        };
        for (frame, (ours, vfc)) in costs("full-adaptive").iter().zip(costs("vfc")).enumerate() {
            assert!(ours / vfc <= MOST, "{scene} frame {frame}: {ours} ns against {vfc} ns");
        }
    }
}
