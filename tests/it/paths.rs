//! What effects say of how far and how their objects go, held against their paths sampled 64 times a frame:
//! bounds on steps, on sides, on coordinates, and whether an object turns. In every hard scene and in
//! hundreds of worlds of the swarm; and for each kind of motion half of a bound would not do.

use std::sync::Arc;

use glam::{DQuat, DVec3};
use plainsight::effect;
use plainsight::index::Entry;
use plainsight::math::Aabb;
use plainsight::part::{ObjectId, PartitionKnobs};
use plainsight::run::World;
use plainsight::scene::generate::{HARD, Knobs, build};
use plainsight::scene::{Path, Scene};
use rayon::prelude::*;

/// Samples of a path between two frames.
const SAMPLES: u32 = 64;
/// Frames of a hard scene that are sampled.
const FRAMES: u32 = 24;
/// Seeds of the swarm.
const SEEDS: u64 = 300;
/// Rounding of a sampled place, of the largest number that it is made of: what `BOUND_SLACK` of a world's
/// entries is made for; a thousand f64 roundings.
const ROUNDING: f64 = 1.0 / (1_u64 << 43) as f64;

/// The scene whose frame t is this one's t + `late`, for every path in it; jumps stay where they are.
fn later(scene: &Scene, late: f64) -> Arc<Scene> {
    let mut scene = scene.clone();
    for (object, path) in scene.effects.motion.iter_mut().flat_map(|motion| &mut motion.movers) {
        let placement = &mut scene.objects[*object as usize].placement;
        match path {
            Path::Reflect { velocity, spin, .. } => {
                placement.translation += *velocity * late;
                placement.rotation = DQuat::from_rotation_y(*spin * late) * placement.rotation;
            }
            Path::Circuit { speed, start, .. } | Path::Lap { speed, start, .. } => {
                *start += *speed * late;
            }
        }
    }
    for figure in scene.effects.articulated.iter_mut().flat_map(|all| &mut all.figures) {
        figure.phase += figure.pace * late;
        match &mut figure.path {
            Path::Reflect { velocity, spin, .. } => {
                assert_eq!(*spin, 0.0, "a body that spins has no phase to put off");
                figure.start += *velocity * late;
            }
            Path::Circuit { speed, start, .. } | Path::Lap { speed, start, .. } => {
                *start += *speed * late;
            }
        }
    }
    Arc::new(scene)
}

/// How an object goes, for the tally.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    Straight,
    Spinning,
    SpinningInPlace,
    SpinningFast,
    Circuit,
    Limb,
    PacedLimb,
    SwingingOnStraight,
}

const KINDS: [Kind; 8] = [
    Kind::Straight,
    Kind::Spinning,
    Kind::SpinningInPlace,
    Kind::SpinningFast,
    Kind::Circuit,
    Kind::Limb,
    Kind::PacedLimb,
    Kind::SwingingOnStraight,
];

/// The most that was made of each bound, by kind: of a point's step, of the middle's, of the reach.
#[derive(Clone, Copy, Debug, Default)]
struct Used {
    objects: u32,
    point: f64,
    middle: f64,
    reach: f64,
}

fn kinds(scene: &Scene, object: u32) -> Vec<Kind> {
    let mut kinds = Vec::new();
    let motion = scene.effects.motion.iter().flat_map(|motion| &motion.movers);
    match motion.into_iter().find(|(mover, _)| *mover == object) {
        Some((_, Path::Reflect { velocity, spin, .. })) => {
            kinds.push(if *spin == 0.0 { Kind::Straight } else { Kind::Spinning });
            if *spin != 0.0 && *velocity == DVec3::ZERO {
                kinds.push(Kind::SpinningInPlace);
            }
            if spin.abs() > 0.4 {
                kinds.push(Kind::SpinningFast);
            }
        }
        Some((_, Path::Circuit { .. })) => kinds.push(Kind::Circuit),
        _ => {}
    }
    for figure in scene.effects.articulated.iter().flat_map(|all| &all.figures) {
        let Some(limb) = figure.limbs.iter().find(|limb| limb.object == object) else { continue };
        let swings = limb.joints.iter().any(|joint| joint.swing != 0.0);
        kinds.push(Kind::Limb);
        if swings && figure.pace > 1.0 {
            kinds.push(Kind::PacedLimb);
        }
        if swings && matches!(figure.path, Path::Reflect { .. }) {
            kinds.push(Kind::SwingingOnStraight);
        }
    }
    kinds
}

/// Samples one object over these frames.
fn sampled(
    (world, entry): (&World, Entry),
    late: &[effect::World],
    object: u32,
    frames: u32,
) -> Result<Option<Used>, String> {
    let mesh = world.partition.mesh(ObjectId(object));
    if mesh.bounds.is_empty() {
        return Ok(None);
    }
    let effects = &late[0];
    let linear = world.scene.objects[object as usize].placement.world_from_object();
    let own = mesh.bounds.center();
    // The middle, and the corners.
    let points: Vec<DVec3> = std::iter::once(own).chain(mesh.bounds.corners()).collect();
    let bounds: Vec<f64> = points
        .iter()
        .map(|&point| effects.step_bound(object, linear.transform_vector3(point).length()))
        .collect();
    let mut work = effect::Work::default();
    let mut used = Used { objects: 1, ..Used::default() };
    let mut places = |sample: u32, t: u32| {
        let placement = late[sample as usize].placement(object, t, &mut work);
        let matrix = placement.world_from_object();
        let places: Vec<DVec3> = points.iter().map(|&p| matrix.transform_point3(p)).collect();
        (placement, places, mesh.bounds.transformed(&matrix))
    };
    let (first, _, _) = places(0, 0);
    let mut before: Vec<Vec<DVec3>> = Vec::new();
    for t in 0..frames {
        let at = |sample: u32| format!("object {object} at {t} + {sample}/{SAMPLES}");
        let mut now: Vec<Vec<DVec3>> = Vec::new();
        for sample in 0..SAMPLES {
            let (placement, here, aabb) = places(sample, t);
            let far = here.iter().fold(0.0, |far: f64, p| far.max(p.abs().max_element()));
            let far = far.max(placement.translation.abs().max_element());
            let slack = far * ROUNDING;
            let mut steps = |there: &[DVec3], what: &str| {
                for (number, (from, to)) in there.iter().zip(&here).enumerate() {
                    let (moved, bound) = (from.distance(*to), bounds[number]);
                    if moved > bound + slack {
                        return Err(format!("{}: {what} of {moved}, bound {bound}", at(sample)));
                    }
                    // What is no more than rounding says nothing.
                    if bound > 1e6 * slack {
                        used.point = used.point.max(moved / bound);
                    }
                }
                if there[0].distance(here[0]) > entry.step_bound {
                    let moved = there[0].distance(here[0]);
                    let bound = entry.step_bound;
                    return Err(format!("{}: the middle went {moved}, bound {bound}", at(sample)));
                }
                if entry.step_bound > 1e6 * slack {
                    used.middle = used.middle.max(there[0].distance(here[0]) / entry.step_bound);
                }
                Ok(())
            };
            // From the frame, and from a frame ago, if nothing jumped.
            if let Some(there) = now.first() {
                steps(there, "a step within a frame")?;
            }
            if !effects.jumped(object, t)
                && let Some(there) = before.get(sample as usize)
            {
                steps(there, "a step")?;
            }
            let half = aabb.size().max_element() * 0.5;
            if half > entry.reach {
                return Err(format!("{}: half a side {half}, reach {}", at(sample), entry.reach));
            }
            used.reach = used.reach.max(half / entry.reach);
            let coordinate = placement.translation.abs().max_element();
            let extent = effects.extent(object);
            // Phases of paths that turn back are put off by moving their start past the wall.
            if coordinate > extent + slack {
                return Err(format!(
                    "{}: a coordinate of {coordinate}, extent {extent}",
                    at(sample)
                ));
            }
            let turned = placement.rotation != first.rotation;
            if turned && !effects.turns(object) {
                return Err(format!("{}: it turns, and is said not to", at(sample)));
            }
            now.push(here);
        }
        before = now;
    }
    Ok(Some(used))
}

/// Every bound of every moving object of a world holds; what was made of them, by kind.
fn held(scene: Scene, frames: u32) -> [Used; KINDS.len()] {
    let name = format!("{} seed {}", scene.name, scene.seed);
    let late: Vec<effect::World> = (0..SAMPLES)
        .map(|sample| {
            let scene = later(&scene, f64::from(sample) / f64::from(SAMPLES));
            effect::World::new(&scene)
        })
        .collect();
    let world = World::new(scene, PartitionKnobs::uncut());
    let entries = world.entries();
    let mut all = [Used::default(); KINDS.len()];
    for &object in late[0].moving() {
        let used = sampled((&world, entries[object as usize]), &late, object, frames)
            .unwrap_or_else(|what| panic!("{name}: {what}"));
        let Some(used) = used else { continue };
        for kind in kinds(&world.scene, object) {
            merge(&mut all[kind as usize], used);
        }
    }
    all
}

fn merge(all: &mut Used, one: Used) {
    all.objects += one.objects;
    all.point = all.point.max(one.point);
    all.middle = all.middle.max(one.middle);
    all.reach = all.reach.max(one.reach);
}

/// Bounds hold in between frames too, and half of any would not: some object of each kind makes use of more.
#[test]
fn bounds_hold_along_whole_paths() {
    let hard = HARD.par_iter().map(|generator| {
        let frames = generator.frames.min(FRAMES);
        held(build(generator.name, &Knobs::default()).unwrap(), frames)
    });
    let swarm = (0..SEEDS).into_par_iter().map(|seed| {
        let scene = build("swarm", &Knobs { seed: Some(seed), ..Knobs::default() }).unwrap();
        held(scene, 10)
    });
    let all = hard.chain(swarm).reduce(
        || [Used::default(); KINDS.len()],
        |mut all, more| {
            all.iter_mut().zip(more).for_each(|(all, one)| merge(all, one));
            all
        },
    );
    for (kind, used) in KINDS.iter().zip(all) {
        assert!(used.objects >= 30, "{kind:?}: {used:?} proves little");
        assert!(used.point > 0.5 && used.middle > 0.5 && used.reach > 0.5, "{kind:?}: {used:?}");
        assert!(used.point <= 1.0 + 1e-6 && used.middle <= 1.0, "{kind:?}: {used:?}");
    }
    let of = |kind: Kind| all[kind as usize];
    for kind in [Kind::Straight, Kind::SpinningInPlace, Kind::SpinningFast, Kind::Circuit] {
        assert!(of(kind).point > 0.9, "{kind:?}: {:?}", of(kind));
    }
}

/// A box that turns about a place far outside of it: the whole of the turn is in the bound of its middle,
/// and the whole of the arm in that of its sides.
#[test]
fn a_box_on_a_circuit_turns_about_its_origin() {
    let mut scene = build("hard/pivots", &Knobs { frames: Some(30), ..Knobs::default() }).unwrap();
    let movers = &mut scene.effects.motion.as_mut().unwrap().movers;
    let corners = vec![DVec3::ZERO, DVec3::X * 3.0];
    for (_, path) in movers.iter_mut() {
        *path = Path::Circuit { corners: corners.clone(), speed: 0.4, start: 0.3 };
    }
    let all = held(scene.clone(), 30);
    let circuit = all[Kind::Circuit as usize];
    assert!(circuit.middle > 0.9, "it turns right about at both ends: {circuit:?}");
    let world = World::new(scene, PartitionKnobs::uncut());
    let bounds: Vec<Aabb> = world.entries().iter().map(|entry| entry.bounds).collect();
    assert!(bounds.iter().all(|aabb| !aabb.is_empty()));
}
