//! The shared runner: small worlds by name and seed, and the gate over any culler and oracle.

use std::sync::{Arc, OnceLock};

use plainsight::check::Gate;
use plainsight::cull::{CULLERS, CullerKind, CullerSetup, ProxyKind};
use plainsight::index::IndexKind;
use plainsight::oracle::wgpu::{Gpu, GpuStage, Hardware};
use plainsight::oracle::{Always, CostModel, HierarchicalZ, Oracle, Questions, Sim};
use plainsight::part::PartitionKnobs;
use plainsight::run::{Lane, LaneInfo, Repeat, Trace, World, run};
use plainsight::scene::Viewport;
use plainsight::scene::generate::{Knobs, build};

/// Scenes of the shared tests; `model` needs a file.
pub(crate) const SCENES: [&str; 5] = ["bunnies", "powerplant", "city", "rooms", "soup"];
/// Oracles of the shared tests.
pub(crate) const ORACLES: [&str; 6] =
    ["sim", "hierarchical-z", "hardware", "pyramid", "read-back", "always"];

/// The device, opened once. A test that needs one fails without it.
pub(crate) fn gpu() -> &'static Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    GPU.get_or_init(|| Gpu::open(None).unwrap_or_else(|error| panic!("{error}")))
}

/// A world small enough for debug builds.
pub(crate) fn world(scene: &str, seed: u64, scale: f64, frames: u32) -> World {
    let knobs = Knobs {
        seed: Some(seed),
        scale: Some(scale),
        frames: Some(frames),
        viewport: Some(Viewport { width: 321, height: 243 }),
        ..Knobs::default()
    };
    let scene = build(scene, &knobs).unwrap();
    let leaf_triangles = leaf_triangles(&scene.name);
    World::new(scene, PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() })
}

/// Most triangles in a part; the plant has far more of them at any size.
pub(crate) fn leaf_triangles(scene: &str) -> u32 {
    if scene == "powerplant" { 4096 } else { 256 }
}

/// An oracle by name.
pub(crate) fn oracle(name: &str, world: &World) -> Box<dyn Oracle> {
    let stage = world.stage();
    match name {
        "sim" => Box::new(Sim::new(stage)),
        "hierarchical-z" => Box::new(HierarchicalZ::new(stage)),
        "always" => Box::<Always>::default(),
        _ => {
            let questions = Questions::of(name).expect("an oracle of that name");
            let stage = GpuStage::new(gpu(), &stage).unwrap();
            Box::new(Hardware::new(&stage, questions).unwrap())
        }
    }
}

/// Runs every culler through the gate, side by side: each frame's truth, and what the device keeps of the
/// scene, serve all of them.
pub(crate) fn gates(
    world: &World,
    index: IndexKind,
    oracle_name: &str,
    proxy: ProxyKind,
) -> Vec<(&'static str, Gate)> {
    let entries = world.entries();
    let questions = Questions::of(oracle_name);
    let stage = questions.map(|_| GpuStage::new(gpu(), &world.stage()).unwrap());
    let mut gates: Vec<(&str, Gate)> =
        CULLERS.iter().map(|culler| (culler.name, Gate::default())).collect();
    let mut lanes: Vec<Lane<'_>> = Vec::new();
    for (culler, (_, gate)) in CULLERS.iter().zip(&mut gates) {
        let oracle = match (questions, &stage) {
            (Some(questions), Some(stage)) => Box::new(Hardware::new(stage, questions).unwrap()),
            _ => oracle(oracle_name, world),
        };
        let make = || {
            (culler.make)(CullerSetup {
                partition: world.partition.clone(),
                index: (index.build)(&entries),
                proxy,
                cost: CostModel::lavapipe(),
            })
        };
        let info = LaneInfo::of(culler.name, oracle.as_ref(), String::new());
        let (culler, observer) = (Box::new(make), gate);
        lanes.push(Lane { info, culler, oracle, observer, with_bound: false });
    }
    run(world, world.scene.frames, Repeat::first(1), &mut lanes, &mut || true).unwrap();
    drop(lanes);
    gates
}

/// Runs one lane through the gate.
pub(crate) fn gate(
    world: &World,
    culler: CullerKind,
    index: IndexKind,
    oracle_name: &str,
    proxy: ProxyKind,
) -> (Trace, Gate) {
    let entries = world.entries();
    let make = || {
        (culler.make)(CullerSetup {
            partition: world.partition.clone(),
            index: (index.build)(&entries),
            proxy,
            cost: CostModel::lavapipe(),
        })
    };
    let oracle = oracle(oracle_name, world);
    let replay = format!("scene {} seed {}", world.scene.name, world.scene.seed);
    let info = LaneInfo::of(culler.name, oracle.as_ref(), replay);
    let mut gate = Gate::default();
    let (culler, observer) = (Box::new(make), &mut gate);
    let lane = Lane { info, culler, oracle, observer, with_bound: false };
    let mut traces =
        run(world, world.scene.frames, Repeat::first(1), &mut [lane], &mut || true).unwrap();
    (traces.pop().unwrap(), gate)
}
