//! How far lavapipe and SwiftShader stand from the reference, and that the tolerance each declares holds:
//! what must show shows on it, what is hidden does not, and little is left in between.

use std::sync::Arc;

use plainsight::check::Gate;
use plainsight::cull::{Culler, Pen, View};
use plainsight::oracle::wgpu::Gpu;
use plainsight::oracle::{FrameView, Oracle, OracleError};
use plainsight::part::{PartId, PartitionKnobs};
use plainsight::run::{
    FrameState, Lane, LaneInfo, Moment, Repeat, Truth, World, fates_of_parts, run,
};
use plainsight::scene::generate::{HARD, Knobs, build};
use plainsight_reference::{Fate, Tolerance};

use crate::common::{ADAPTER, SCENES, gpu, hardware, oracle, swiftshader, world};

/// Share of the visible parts that must be *must*: a tolerance under which nearly all is *may* proves
/// nothing.
const LEAST_MUST: f64 = 0.9;

fn worlds() -> impl Iterator<Item = World> {
    let hard = HARD.iter().map(|generator| {
        let scene = build(generator.name, &Knobs { frames: Some(8), ..Knobs::default() }).unwrap();
        let leaf_triangles = scene.leaf_triangles;
        World::new(scene, PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() })
    });
    SCENES.iter().map(|scene| world(scene, 1, 0.05, 8)).chain(hard)
}

/// What a device made of the parts of one frame.
struct Seen {
    state: FrameState,
    /// By part, whether it shows on the device and in the truth.
    shows: Vec<(bool, bool)>,
}

/// The frames that are looked at.
const LOOKED_AT: [u32; 3] = [0, 3, 7];

fn seen(world: &World, device: &mut dyn Oracle, frame: u32) -> Seen {
    let state = FrameState::at(world, Moment { frame, view: 0 });
    let truth = Truth::of(world, &state);
    device.begin_frame(&FrameView { frame, clip_from_object: &state.matrices }).unwrap();
    let parts: Vec<PartId> = (0..world.partition.part_count()).map(PartId).collect();
    let there = device.redraw(&parts).unwrap().unwrap().parts.unwrap();
    let mut on_device = vec![false; parts.len() + 1];
    there.iter().for_each(|&id| on_device[id as usize] = true);
    let here = truth.visible_pixels.iter().map(|&pixels| pixels > 0);
    let shows = on_device[1..].iter().copied().zip(here).collect();
    Seen { state, shows }
}

/// Whether a fate is contradicted by what is seen on the device or exactly.
fn contradicts(fate: Fate, (device, exact): (bool, bool)) -> bool {
    match fate {
        Fate::Must => !(device && exact),
        Fate::Hidden => device || exact,
        Fate::May => false,
    }
}

/// Holds a device to its tolerance in these frames; the share of *must*, and a line a scene.
fn keeps(gpu: &Arc<Gpu>, frames: &[u32]) -> (f64, String) {
    let tolerance = gpu.tolerance();
    let (mut lines, mut wrong) = (Vec::new(), Vec::new());
    let (mut all_visible, mut all_must) = (0, 0);
    for world in worlds() {
        let mut device = hardware(gpu, &world);
        let [mut visible, mut must, mut may, mut ties] = [0_usize; 4];
        for &frame in frames {
            let Seen { state, shows } = seen(&world, device.as_mut(), frame);
            let fates = fates_of_parts(&world, &state, tolerance);
            let exact = fates_of_parts(&world, &state, Tolerance::EXACT);
            for (part, (&fate, &shows)) in fates.parts.iter().zip(&shows).enumerate() {
                if contradicts(fate, shows) {
                    wrong.push(format!(
                        "{} frame {frame} part {part}: {fate:?}, on the device {}, exactly {}",
                        world.scene.name, shows.0, shows.1
                    ));
                }
                visible += usize::from(shows.1);
                must += usize::from(fate == Fate::Must);
                may += usize::from(fate == Fate::May);
                ties += usize::from(exact.parts[part] == Fate::May);
            }
        }
        lines.push(format!(
            "{:<22} {visible:>5} visible, {must:>5} must, {may:>4} may, {ties:>4} of them by ties alone",
            world.scene.name
        ));
        all_visible += visible;
        all_must += must;
    }
    assert!(wrong.is_empty(), "{} of {all_visible}: {}", wrong.len(), wrong.join("\n"));
    (all_must as f64 / all_visible as f64, lines.join("\n"))
}

#[test]
fn the_device_keeps_to_its_tolerance() {
    let (share, lines) = keeps(gpu(), &LOOKED_AT);
    assert!(share >= LEAST_MUST, "{share}");
    insta::assert_snapshot!(lines);
}

#[test]
fn swiftshader_keeps_to_its_own() {
    let (share, lines) = keeps(swiftshader(), &LOOKED_AT[1..2]);
    insta::assert_snapshot!(format!("{lines}\nmust share {share:.3}"));
}

/// How many parts each tolerance would have come out wrong, and what share of *must* it leaves: what the
/// devices' tolerances were chosen by. By hand: `cargo test --release --test it -- --ignored tolerances
/// --nocapture`; `PLAINSIGHT_ADAPTER=nvidia` measures that device alone.
#[test]
#[ignore = "a measurement, not a test"]
#[allow(clippy::print_stderr)]
fn tolerances_side_by_side() {
    let named = std::env::var_os(ADAPTER).is_some();
    let devices = if named { vec![gpu()] } else { vec![gpu(), swiftshader()] };
    for gpu in devices {
        eprintln!("{}", gpu.name());
        let frames: Vec<(World, Vec<Seen>)> = worlds()
            .map(|world| {
                let mut device = hardware(gpu, &world);
                let frames = LOOKED_AT.map(|frame| seen(&world, device.as_mut(), frame));
                (world, frames.into())
            })
            .collect();
        for sub_pixels in [2048, 1024, 512, 256, 128, 64, 32, 30, 16] {
            for (ulps, clipped_ulps) in
                [(1, 16), (4, 64), (64, 1024), (1024, 65_536), (65_536, 1 << 20)]
            {
                let pixels = 1.0 / f64::from(sub_pixels);
                let tolerance = Tolerance { pixels, ulps, clipped_ulps };
                let (mut wrong, mut must, mut visible) = (0, 0, 0);
                for (world, frames) in &frames {
                    for Seen { state, shows } in frames {
                        let fates = fates_of_parts(world, state, tolerance);
                        let parts = || fates.parts.iter().zip(shows);
                        wrong +=
                            parts().filter(|&(&fate, &shows)| contradicts(fate, shows)).count();
                        must += fates.parts.iter().filter(|&&fate| fate == Fate::Must).count();
                        visible += shows.iter().filter(|shows| shows.1).count();
                    }
                }
                let share = must as f64 / visible as f64;
                eprintln!(
                    "1/{sub_pixels} pixel, {ulps} ulps, {clipped_ulps} clipped: {wrong} wrong of {visible}, must {share:.3}"
                );
            }
        }
    }
}

/// Draws all but one part.
struct Without(PartId);

impl Culler for Without {
    fn name(&self) -> &str {
        "without"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let parts = (0..view.partition.part_count()).map(PartId);
        parts.filter(|part| *part != self.0).for_each(|part| pen.draw(part));
        Ok(())
    }
}

/// A part that must show is missed on either device; one that the device need not show is missed on the
/// exact device alone, and counted on the other.
#[test]
fn only_what_need_not_show_is_forgiven() {
    let scene = build("hard/coplanar", &Knobs { frames: Some(1), ..Knobs::default() }).unwrap();
    let knobs =
        PartitionKnobs { leaf_triangles: scene.leaf_triangles, ..PartitionKnobs::default() };
    let world = World::new(scene, knobs);
    let state = FrameState::first(&world);
    let (truth, fates) =
        (Truth::of(&world, &state), fates_of_parts(&world, &state, gpu().tolerance()));
    let part = |wanted: Fate| {
        let of = |&part: &usize| truth.visible_pixels[part] > 0 && fates.parts[part] == wanted;
        PartId((0..fates.parts.len()).find(of).expect("such a part shows") as u32)
    };
    let judged = |part: PartId, oracle_name: &str| {
        let mut gate = Gate::default();
        let oracle = oracle(oracle_name, &world);
        let info = LaneInfo::of("without", oracle.as_ref(), String::new());
        let culler = Box::new(move || Box::new(Without(part)) as Box<dyn Culler>);
        let lane =
            Lane { info, culler, oracle, observer: &mut gate, with_bound: false, audited: false };
        run(&world, 1, Repeat::NONE, &mut [lane], &mut || true).unwrap();
        let (misses, forgiven) = (gate.conservative.misses().len(), gate.conservative.may_missed());
        (misses, forgiven, gate.image.differences().len())
    };
    let (must, may) = (part(Fate::Must), part(Fate::May));
    assert_eq!(judged(must, "sim"), (1, 0, 1));
    assert_eq!(judged(must, "hardware"), (1, 0, 1));
    assert_eq!(judged(may, "sim"), (1, 0, 1));
    assert_eq!(judged(may, "hardware"), (0, 1, 0));
}
