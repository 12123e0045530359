//! How far lavapipe stands from the reference, and that the tolerance it declares holds: what must show
//! shows on it, what is hidden does not, and little is left in between.

use plainsight::check::Gate;
use plainsight::cull::{Culler, Pen, View};
use plainsight::oracle::{FrameView, OracleError};
use plainsight::part::{PartId, PartitionKnobs};
use plainsight::run::{
    FrameState, Lane, LaneInfo, Moment, Repeat, Truth, World, fates_of_parts, run,
};
use plainsight::scene::generate::{HARD, Knobs, build};
use plainsight_reference::{Fate, Tolerance};

use crate::common::{SCENES, gpu, oracle, world};

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

#[test]
fn the_device_keeps_to_its_tolerance() {
    let tolerance = gpu().tolerance();
    let (mut lines, mut wrong) = (Vec::new(), Vec::new());
    let (mut all_visible, mut all_must) = (0, 0);
    for world in worlds() {
        let mut device = oracle("hardware", &world);
        let [mut visible, mut must, mut may, mut ties] = [0_usize; 4];
        for frame in [0, 3, 7] {
            let state = FrameState::at(&world, Moment { frame, view: 0 });
            let truth = Truth::of(&world, &state);
            device.begin_frame(&FrameView { frame, clip_from_object: &state.matrices }).unwrap();
            let parts: Vec<PartId> = (0..world.partition.part_count()).map(PartId).collect();
            let there = device.redraw(&parts).unwrap().unwrap().parts.unwrap();
            let mut shows = vec![false; parts.len() + 1];
            there.iter().for_each(|&id| shows[id as usize] = true);
            let fates = fates_of_parts(&world, &state, tolerance);
            let exact = fates_of_parts(&world, &state, Tolerance::EXACT);
            for (part, &fate) in fates.parts.iter().enumerate() {
                let here = truth.visible_pixels[part] > 0;
                if (fate == Fate::Must) && !(shows[part + 1] && here)
                    || (fate == Fate::Hidden) && (shows[part + 1] || here)
                {
                    let device = shows[part + 1];
                    wrong.push(format!(
                        "{} frame {frame} part {part}: {fate:?}, on the device {device}, exactly {here}",
                        world.scene.name
                    ));
                }
                visible += usize::from(here);
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
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let share = all_must as f64 / all_visible as f64;
    assert!(share >= LEAST_MUST, "{share}");
    insta::assert_snapshot!(lines.join("\n"));
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
        let lane = Lane { info, culler, oracle, observer: &mut gate, with_bound: false };
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
