//! Who moves, jumps and swings. Objects run straight, spin as they run or in place, go round circuits whose
//! corners turn them, or come into view from outside at a steady pace.

use glam::DVec3;

use super::shapes::Shape;
use super::{SPACE, Site, power, within};
use crate::scene::generate::Chosen;
use crate::scene::generate::rim::{SIDES, edge};
use crate::scene::{
    Articulated, CameraPath, Effects, Figure, Joint, Jumps, Limb, Motion, Object, Path, Stream,
    Teleport,
};

/// How an object goes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Gait {
    /// Straight on, never turned.
    Runs,
    /// Straight on, turning a little.
    Rolls,
    /// Straight on, turning by up to half a turn a frame.
    Whirls,
    /// Turning where it stands.
    Spins,
    /// Round a polygon, facing ahead.
    Circuit,
    /// From outside into a view, straight on.
    Enters,
}

const GAITS: &[Gait] =
    &[Gait::Runs, Gait::Rolls, Gait::Whirls, Gait::Spins, Gait::Circuit, Gait::Enters];
/// Fastest turn of what whirls, radians a frame: about half a turn.
const FASTEST_TURN: f64 = 3.2;

/// What moves, of all that there is; what enters a view is put where it begins.
pub(super) fn effects(
    chosen: &Chosen,
    site: Site,
    cameras: &[CameraPath],
    shapes: &[Shape],
    objects: &mut [Object],
) -> Effects {
    let mut motion = Stream::new(chosen.seed, "motion");
    let share = motion.pick(&[0, 0, 1, 8, 16]);
    let fastest = motion.pick(&[0.02, 0.3, 6.0]) * site.size;
    // All kinds side by side, or one alone.
    let gaits = match motion.below(2) {
        0 => GAITS,
        _ => std::slice::from_ref(&GAITS[motion.below(GAITS.len() as u32) as usize]),
    };
    let mut movers = Vec::new();
    for (number, object) in (0..).zip(objects.iter_mut()) {
        if motion.below(16) >= share {
            continue;
        }
        let gait = motion.pick(gaits);
        // Where the origin of its mesh is from its middle.
        let middle = shapes[object.mesh as usize].middle;
        let away = object.placement.world_from_object().transform_vector3(middle) * -1.0;
        let turns = shapes[object.mesh as usize].may_turn();
        let gait = match gait {
            Gait::Runs | Gait::Enters => gait,
            _ if turns => gait,
            _ => Gait::Runs,
        };
        if gait == Gait::Enters {
            let (rest, path) = entering(&mut motion, chosen, cameras, away);
            object.placement.translation = rest;
            movers.push((number, path));
            continue;
        }
        movers.push((number, going(&mut motion, gait, site, (fastest, away))));
    }
    let moves = |id: &u32| movers.binary_search_by_key(id, |(object, _)| *object).is_ok();
    let turns = |id: &u32| shapes[objects[*id as usize].mesh as usize].may_turn();
    let free = (0..objects.len() as u32).filter(|id| !moves(id) && turns(id)).collect::<Vec<_>>();
    let articulated = figures(chosen.seed, site, &free);
    let teleport = jumpers(chosen.seed, objects.len() as u32, site.size);
    Effects { articulated, motion: (!movers.is_empty()).then_some(Motion { movers }), teleport }
}

/// The path of an object in the space whose origin is `away` from its middle.
fn going(
    motion: &mut Stream,
    gait: Gait,
    Site { middle, size }: Site,
    (fastest, away): (f64, DVec3),
) -> Path {
    if gait == Gait::Circuit {
        let corner = |motion: &mut Stream| {
            middle + away + within(motion, DVec3::new(SPACE, SPACE * 0.3, SPACE)) * size
        };
        let corners = (0..2 + motion.below(3)).map(|_| corner(motion)).collect();
        let (speed, start) = (motion.unit() * fastest, motion.unit() * SPACE * size);
        return Path::Circuit { corners, speed, start };
    }
    let reach = DVec3::splat(SPACE * size);
    let (min, max) = (middle + away - reach, middle + away + reach);
    let velocity = match gait {
        Gait::Spins => DVec3::ZERO,
        _ => within(motion, DVec3::splat(fastest)),
    };
    let spin = match gait {
        Gait::Runs => 0.0,
        Gait::Rolls => motion.range(-0.4, 0.4),
        _ => motion.range(0.4, FASTEST_TURN) * motion.pick(&[1.0, -1.0]),
    };
    Path::Reflect { velocity, min, max, spin }
}

/// A straight run whose middle crosses a side of a view in some frame, and where its origin, `away` from its
/// middle, begins.
fn entering(
    motion: &mut Stream,
    chosen: &Chosen,
    cameras: &[CameraPath],
    away: DVec3,
) -> (DVec3, Path) {
    let path = &cameras[motion.below(cameras.len() as u32) as usize];
    let crosses = motion.below(chosen.frames);
    let camera = path.at(crosses);
    let target = path.poses[0].eye.distance(path.poses[0].target);
    let ahead = (target * power(motion, -0.6, 0.1)).clamp(camera.near, camera.far);
    let along = (ahead, motion.range(-0.7, 0.7));
    let (point, inward) = edge(&camera, chosen.viewport, motion.below(SIDES), along);
    let towards = (inward + within(motion, DVec3::splat(0.6))).normalize();
    let velocity = towards * (camera.lens.height_at(ahead) * power(motion, -2.0, -0.2));
    let rest = point + away - velocity * f64::from(crosses);
    // Nothing turns it back for as long as anybody looks.
    let end = rest + velocity * f64::from(4 * chosen.frames);
    (rest, Path::Reflect { velocity, min: rest.min(end), max: rest.max(end), spin: 0.0 })
}

fn jumpers(seed: u64, objects: u32, size: f64) -> Option<Teleport> {
    let mut jump = Stream::new(seed, "teleport");
    let share = jump.pick(&[0, 0, 0, 2, 16]);
    let mut jumpers = Vec::new();
    for number in 0..objects {
        if jump.below(16) < share {
            let offsets =
                (0..1 + jump.below(3)).map(|_| within(&mut jump, DVec3::splat(SPACE)) * size);
            jumpers.push((number, Jumps { offsets: offsets.collect(), period: 1 + jump.below(4) }));
        }
    }
    (!jumpers.is_empty()).then_some(Teleport { jumpers })
}

/// Figures of two to five of the objects that do not move by themselves, in one world of four.
fn figures(seed: u64, Site { middle, size }: Site, mut free: &[u32]) -> Option<Articulated> {
    let mut stream = Stream::new(seed, "figures");
    if stream.below(4) > 0 {
        return None;
    }
    // At a walk, or so fast that a swing goes from end to end within a frame.
    let fastest = stream.pick(&[1.0, 3.0]);
    let straight = stream.below(2) == 0;
    let mut figures = Vec::new();
    while free.len() > 1 && figures.len() < 8 {
        let (taken, rest) = free.split_at((2 + stream.below(4) as usize).min(free.len()));
        free = rest;
        let half =
            [stream.range(0.2, 0.9), stream.range(0.2, 0.9)].map(|share| share * SPACE * size);
        let path = if straight && stream.below(2) == 0 {
            let reach = DVec3::splat(SPACE * size);
            let velocity = within(&mut stream, DVec3::new(0.3, 0.1, 0.3)) * size;
            Path::Reflect { velocity, min: middle - reach, max: middle + reach, spin: 0.0 }
        } else {
            Path::Lap {
                center: middle + within(&mut stream, DVec3::ONE) * size,
                half,
                round: stream.range(0.01, 1.5) * half[0],
                speed: stream.range(-0.5, 0.5) * size,
                start: stream.unit() * SPACE * size,
            }
        };
        let joint = |stream: &mut Stream| Joint {
            hinge: within(stream, DVec3::ONE) * size,
            swing: stream.pick(&[0.0, 0.3, 1.5]),
            phase: stream.range(0.0, 6.0),
        };
        let limb = |(place, &object): (usize, &u32)| {
            let joints = (0..1 + place % 3).map(|_| joint(&mut stream)).collect();
            Limb { object, joints }
        };
        let limbs = taken.iter().enumerate().map(limb).collect();
        let (pace, phase) = (stream.range(0.0, fastest), stream.range(0.0, 6.0));
        figures.push(Figure { path, start: middle, pace, phase, limbs });
    }
    (!figures.is_empty()).then_some(Articulated { figures })
}
