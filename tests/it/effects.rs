//! A scene pays for the effects that it declares, and for no others.

use plainsight::accuracy::{Worlds, effects};
use plainsight::effect::EFFECTS;
use plainsight::oracle::CostModel;
use plainsight::part::{ObjectId, PartitionKnobs};
use plainsight::run::{FrameState, FrameWork, Moment, World};
use plainsight::scene::Scene;
use plainsight::scene::generate::{Knobs, build};

fn swarm(seed: u64) -> Scene {
    build("swarm", &Knobs { seed: Some(seed), scale: Some(0.3), ..Knobs::default() }).unwrap()
}

/// Counters of what is not declared stay at zero in every frame, and those of what is do not; with
/// nothing declared nothing is made anew and no index is told of anything.
#[test]
fn what_is_not_declared_is_not_evaluated() {
    let mut seen = [[0_u32; 2]; 2];
    for seed in 0..60 {
        let world = World::new(swarm(seed), PartitionKnobs::default());
        let mut work = FrameWork::default();
        for moment in Moment::all(&world, 4) {
            work = work + FrameState::at(&world, moment).work;
        }
        for (kind, seen) in EFFECTS.iter().zip(&mut seen) {
            let declared = (kind.declared)(&world.scene);
            seen[usize::from(declared)] += 1;
            assert_eq!((kind.work)(&work.effects) > 0, declared, "seed {seed}: {}", kind.name);
        }
        if EFFECTS.iter().all(|kind| !(kind.declared)(&world.scene)) {
            assert_eq!((work, world.moving_count()), (FrameWork::default(), 0), "seed {seed}");
        }
    }
    assert!(seen.iter().flatten().all(|&scenes| scenes >= 10), "{seen:?}");
}

/// What is kept of objects at rest is what would be computed anew, to the bit.
#[test]
fn objects_at_rest_are_where_they_would_be() {
    for seed in 0..20 {
        let world = World::new(swarm(seed), PartitionKnobs::default());
        for moment in Moment::all(&world, 3) {
            let state = FrameState::at(&world, moment);
            for (id, object) in (0..).zip(&state.objects) {
                let placed = world.world_from_object(ObjectId(id), moment.frame);
                let bounds = world.partition.mesh(ObjectId(id)).bounds.transformed(&placed);
                assert_eq!(object.bounds, bounds, "seed {seed} {moment} object {id}");
                assert_eq!(object.clip_from_object, state.clip_from_world * placed);
                let eye = placed.inverse().transform_point3(state.camera.eye);
                // A flat object has no inverse: NaN is not itself.
                assert_eq!(
                    object.eye.to_array().map(f64::to_bits),
                    eye.to_array().map(f64::to_bits)
                );
            }
        }
    }
}

/// The table: the scene as it is, without each effect, without all.
#[test]
fn each_effect_has_its_price() {
    let scene = build("hard/teleports", &Knobs { frames: Some(6), ..Knobs::default() }).unwrap();
    let points =
        effects(&Worlds::new(scene, &World::new), &CostModel::lavapipe(), 1, &mut || true).unwrap();
    let said: Vec<&[&str]> = points.iter().map(|point| point.effects.as_slice()).collect();
    assert_eq!(said, [&["motion", "teleport"][..], &["teleport"], &["motion"], &[]]);
    for point in &points {
        for (kind, &count) in EFFECTS.iter().zip(&point.evaluations) {
            assert_eq!(count > 0, point.effects.contains(&kind.name), "{point:?}");
        }
        assert!(point.run.failures.is_empty() && point.run.wrong_pixels == 0);
    }
    let still = points.last().unwrap();
    assert_eq!((still.boxes, still.moves), (0, 0));
    assert!(points[0].boxes > 0 && points[0].moves > 0);
}
