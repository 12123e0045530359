//! The shared runner: small worlds by name and seed, and the gate over any culler and oracle.

use std::sync::{Arc, OnceLock};

use plainsight::check::Gate;
use plainsight::cull::{CullerKind, CullerSetup, PerView, ProxyKind};
use plainsight::index::IndexKind;
use plainsight::oracle::wgpu::{Gpu, GpuStage, Hardware};
use plainsight::oracle::{Always, CostModel, HierarchicalZ, Oracle, Questions, Sim, Stage};
use plainsight::part::PartitionKnobs;
use plainsight::run::{Lane, LaneInfo, Repeat, Trace, World, run};
use plainsight::scene::Viewport;
use plainsight::scene::generate::{Knobs, build};

/// Scenes of the shared tests; `model` needs a file.
pub(crate) const SCENES: [&str; 5] = ["bunnies", "powerplant", "city", "rooms", "soup"];
/// Oracles of the shared tests.
pub(crate) const ORACLES: [&str; 6] =
    ["sim", "hierarchical-z", "hardware", "pyramid", "read-back", "always"];

/// Names another device to run the tests on, by a part of its name: the snapshots of what lavapipe makes
/// of a scene then fail, and nothing else may.
pub(crate) const ADAPTER: &str = "PLAINSIGHT_ADAPTER";

/// The device, opened once. A test that needs one fails without it.
pub(crate) fn gpu() -> &'static Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    GPU.get_or_init(|| {
        let named = std::env::var(ADAPTER).ok();
        Gpu::open(named.as_deref()).unwrap_or_else(|error| panic!("{error}"))
    })
}

/// The second device, a very different one. `tests/run.sh` fetches it and names both to the loader.
pub(crate) fn swiftshader() -> &'static Arc<Gpu> {
    static GPU: OnceLock<Arc<Gpu>> = OnceLock::new();
    GPU.get_or_init(|| {
        Gpu::open(Some("SwiftShader"))
            .unwrap_or_else(|error| panic!("{error}; tests/run.sh fetches SwiftShader"))
    })
}

/// The hardware oracle of a device.
pub(crate) fn hardware(gpu: &Arc<Gpu>, world: &World) -> Box<dyn Oracle> {
    hardware_of(gpu, &world.stage(), Questions::Queries)
}

/// An oracle of a device that asks so.
pub(crate) fn hardware_of(gpu: &Arc<Gpu>, stage: &Stage, questions: Questions) -> Box<dyn Oracle> {
    let stage = GpuStage::new(gpu, stage).unwrap();
    Box::new(Hardware::new(&stage, questions).unwrap())
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

/// The device and the way of asking that a name stands for; `swiftshader` is `hardware` on that one.
fn device(name: &str) -> Option<(&'static Arc<Gpu>, Questions)> {
    match name {
        "swiftshader" => Some((swiftshader(), Questions::Queries)),
        _ => Questions::of(name).map(|questions| (gpu(), questions)),
    }
}

/// An oracle by name.
pub(crate) fn oracle(name: &str, world: &World) -> Box<dyn Oracle> {
    let stage = world.stage();
    match name {
        "sim" => Box::new(Sim::new(stage)),
        "hierarchical-z" => Box::new(HierarchicalZ::new(stage)),
        "always" => Box::<Always>::default(),
        _ => {
            let (gpu, questions) = device(name).expect("an oracle of that name");
            let stage = GpuStage::new(gpu, &stage).unwrap();
            Box::new(Hardware::new(&stage, questions).unwrap())
        }
    }
}

/// Runs cullers through the gate, side by side: each frame's truth, and what the device keeps of the
/// scene, serve all of them.
pub(crate) fn gates(
    world: &World,
    cullers: &[CullerKind],
    index: IndexKind,
    oracle_name: &str,
    proxy: ProxyKind,
) -> Vec<(Trace, Gate)> {
    let entries = world.entries();
    let device = device(oracle_name);
    let stage = device.map(|(gpu, _)| GpuStage::new(gpu, &world.stage()).unwrap());
    let mut gates: Vec<Gate> = Vec::new();
    gates.resize_with(cullers.len(), Gate::default);
    let mut lanes: Vec<Lane<'_>> = Vec::new();
    for (culler, gate) in cullers.iter().zip(&mut gates) {
        let oracle = match (device, &stage) {
            (Some((_, questions)), Some(stage)) => {
                Box::new(Hardware::new(stage, questions).unwrap())
            }
            _ => oracle(oracle_name, world),
        };
        let make = || {
            PerView::over(world.views(), || {
                (culler.make)(CullerSetup {
                    partition: world.partition.clone(),
                    index: (index.build)(&entries),
                    proxy,
                    cost: CostModel::lavapipe(),
                })
            })
        };
        let replay = format!("scene {} seed {}", world.scene.name, world.scene.seed);
        let info = LaneInfo::of(culler.name, oracle.as_ref(), replay);
        let (culler, observer) = (Box::new(make), gate);
        let audited = device.is_none();
        lanes.push(Lane { info, culler, oracle, observer, with_bound: false, audited });
    }
    let frames = world.scene.frames;
    let traces = run(world, frames, Repeat::first(1), &mut lanes, &mut || true).unwrap();
    drop(lanes);
    traces.into_iter().zip(gates).collect()
}

/// Runs one lane through the gate.
pub(crate) fn gate(
    world: &World,
    culler: CullerKind,
    index: IndexKind,
    oracle_name: &str,
    proxy: ProxyKind,
) -> (Trace, Gate) {
    gates(world, &[culler], index, oracle_name, proxy).pop().expect("one culler makes one lane")
}
