//! Where an object on a declared path is and how it is turned, in closed form, so that any frame can be had
//! without those before; and bounds on how it goes. Straight lines between reflecting walls are those of
//! Kovalčík & Sochor 2006, section 4. What motion and articulated motion share.

use glam::{DQuat, DVec3};

use crate::scene::Path;

/// Rounding of a position: a few f64 operations on numbers no larger than the path's own, so that a
/// bound of speed times this holds for the computed steps too.
pub(super) const STEP_SLACK: f64 = 1.0 + 1e-9;

/// Place and turn about y at frame `t` of an object that starts at `rest`.
pub(super) fn place(path: &Path, rest: DVec3, t: u32) -> (DVec3, DQuat) {
    let facing = |heading: DVec3| DQuat::from_rotation_y(libm::atan2(-heading.z, heading.x));
    match path {
        Path::Reflect { velocity, min, max, spin } => {
            let free = rest + *velocity * f64::from(t);
            let axis = |i: usize| reflect(free[i], min[i], max[i]);
            let translation = DVec3::new(axis(0), axis(1), axis(2));
            (translation, DQuat::from_rotation_y(spin * f64::from(t)))
        }
        Path::Circuit { corners, speed, start } => {
            let (translation, heading) = circuit(corners, start + speed * f64::from(t));
            (translation, facing(heading))
        }
        Path::Lap { center, half, round, speed, start } => {
            let (translation, heading) = lap(*center, *half, *round, start + speed * f64::from(t));
            (translation, facing(heading))
        }
    }
}

/// The farthest that a point moves in a frame which is `offset` from the object's y axis.
pub(super) fn step_bound(path: &Path, offset: f64) -> f64 {
    // A chord is no longer than its arc, nor than the diameter.
    let turning = |radians: f64| offset * radians.abs().min(2.0);
    match path {
        Path::Reflect { velocity, spin, .. } => velocity.length() + turning(*spin),
        // It may turn right about at a corner.
        Path::Circuit { speed, .. } => speed.abs() + 2.0 * offset,
        Path::Lap { speed, half, round, .. } => {
            speed.abs() + turning(speed / corner_radius(*half, *round))
        }
    }
}

/// Whether the object ever turns.
pub(super) fn turns(path: &Path) -> bool {
    match path {
        Path::Reflect { spin, .. } => *spin != 0.0,
        Path::Circuit { .. } | Path::Lap { .. } => true,
    }
}

/// The largest coordinate, by its absolute value, that the path has.
pub(super) fn extent(path: &Path) -> f64 {
    let most = |points: &[DVec3]| {
        points.iter().fold(0.0_f64, |most, point| most.max(point.abs().max_element()))
    };
    match path {
        Path::Reflect { min, max, .. } => most(&[*min, *max]),
        Path::Circuit { corners, .. } => most(corners),
        Path::Lap { center, half: [x, z], .. } => most(&[*center]) + x.max(*z),
    }
}

/// The triangle wave of `value` between two walls; the lower wall where they do not leave room.
fn reflect(value: f64, low: f64, high: f64) -> f64 {
    let room = high - low;
    if room.is_nan() || room <= 0.0 {
        return low;
    }
    let phase = (value - low).rem_euclid(2.0 * room);
    low + if phase <= room { phase } else { 2.0 * room - phase }
}

/// The point `distance` along the closed polygon, and the unit direction there.
fn circuit(corners: &[DVec3], distance: f64) -> (DVec3, DVec3) {
    let sides = || (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]));
    let length: f64 = sides().map(|(a, b)| a.distance(b)).sum();
    let mut left = if length > 0.0 { distance.rem_euclid(length) } else { 0.0 };
    let mut last = (corners.first().copied().unwrap_or(DVec3::ZERO), DVec3::X);
    for (from, to) in sides() {
        let side = from.distance(to);
        if side > 0.0 {
            let heading = (to - from) / side;
            if left <= side {
                return (from + heading * left, heading);
            }
            last = (to, heading);
        }
        left -= side;
    }
    last
}

/// The radius that the corners have: what is asked for, where the sides leave room.
fn corner_radius([x, z]: [f64; 2], round: f64) -> f64 {
    round.min(x).min(z)
}

/// The point `distance` along a rectangle with round corners, and the unit direction there. It begins at
/// the low end of the low-z side, towards x.
fn lap(center: DVec3, half: [f64; 2], round: f64, distance: f64) -> (DVec3, DVec3) {
    let radius = corner_radius(half, round);
    let arc = radius * std::f64::consts::FRAC_PI_2;
    let straight = half.map(|side| 2.0 * (side - radius));
    let quarters = [0, 1, 0, 1].map(|axis| straight[axis] + arc);
    let mut left = distance.rem_euclid(quarters.iter().sum());
    let along = [DVec3::X, DVec3::Z, DVec3::NEG_X, DVec3::NEG_Z];
    let mut quarter = 0;
    while quarter < 3 && left > quarters[quarter] {
        left -= quarters[quarter];
        quarter += 1;
    }
    let (ahead, inward) = (along[quarter], along[(quarter + 1) % 4]);
    let (length, width) = (half[quarter % 2], half[(quarter + 1) % 2]);
    if left <= straight[quarter % 2] {
        let at = center + ahead * (left - (length - radius)) - inward * width;
        return (at, ahead);
    }
    let angle = (left - straight[quarter % 2]) / radius;
    let (sin, cos) = (libm::sin(angle), libm::cos(angle));
    let middle = center + ahead * (length - radius) - inward * (width - radius);
    (middle + (ahead * sin - inward * cos) * radius, ahead * cos + inward * sin)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reflect_stays_between_walls_and_turns_at_them() {
        assert_eq!(reflect(5.0, 0.0, 4.0), 3.0);
        assert_eq!(reflect(-1.0, 0.0, 4.0), 1.0);
        assert_eq!(reflect(9.0, 0.0, 4.0), 1.0);
        assert_eq!(reflect(7.0, 2.0, 2.0), 2.0);
    }

    fn reflect_path(velocity: DVec3, spin: f64) -> Path {
        Path::Reflect { velocity, min: DVec3::new(-7.0, 1.0, 2.0), max: DVec3::splat(5.0), spin }
    }

    fn circuit_path(corners: &[DVec3], speed: f64) -> Path {
        Path::Circuit { corners: corners.to_vec(), speed, start: 0.25 }
    }

    fn lap_path(round: f64, speed: f64) -> Path {
        Path::Lap { center: DVec3::new(-3.0, 8.0, 1.0), half: [4.0, 6.0], round, speed, start: 0.0 }
    }

    /// A step is the way and the turn: of a turn the arc, or the diameter where that is less; at a corner
    /// the whole diameter.
    #[test]
    fn steps_are_the_way_and_the_turn() {
        let run = DVec3::new(3.0, 4.0, 12.0);
        assert_eq!(step_bound(&reflect_path(run, 0.0), 10.0), 13.0);
        assert_eq!(step_bound(&reflect_path(run, -0.5), 10.0), 13.0 + 5.0);
        assert_eq!(step_bound(&reflect_path(DVec3::ZERO, 1.5), 10.0), 15.0, "in place");
        assert_eq!(step_bound(&reflect_path(DVec3::ZERO, -3.0), 10.0), 20.0, "the diameter");
        assert_eq!(step_bound(&circuit_path(&[DVec3::ZERO, DVec3::X], -0.5), 10.0), 20.5);
        assert_eq!(step_bound(&lap_path(2.0, -1.0), 10.0), 1.0 + 5.0, "by the corner's radius");
        assert_eq!(
            step_bound(&lap_path(9.0, 1.0), 10.0),
            1.0 + 2.5,
            "no rounder than there is room"
        );
        assert_eq!(step_bound(&lap_path(0.125, 1.0), 10.0), 1.0 + 20.0);
    }

    /// There and back on a line: at each end the object turns right about, and half of the bound's turn
    /// would not do. A point beside the path goes twice its distance.
    #[test]
    fn corners_take_all_of_the_turn() {
        let path = circuit_path(&[DVec3::ZERO, DVec3::X * 4.0], 0.5);
        let at = |t: u32, arm: DVec3| {
            let (origin, turn) = place(&path, DVec3::ZERO, t);
            origin + turn * arm
        };
        for arm in [DVec3::X * 3.0, DVec3::Z * 3.0, DVec3::new(2.0, 9.0, -1.0)] {
            let offset = arm.with_y(0.0).length();
            let steps = (0..40).map(|t| at(t, arm).distance(at(t + 1, arm)));
            let most = steps.fold(0.0, f64::max);
            assert!(most <= step_bound(&path, offset) * STEP_SLACK, "{arm}: {most}");
            assert!(most > 0.5 + offset, "{arm}: {most}");
        }
    }

    #[test]
    fn what_turns_is_told() {
        assert!(!turns(&reflect_path(DVec3::ONE, 0.0)));
        assert!(turns(&reflect_path(DVec3::ZERO, 1e-9)) && turns(&reflect_path(DVec3::ZERO, -1.0)));
        assert!(turns(&circuit_path(&[DVec3::ZERO, DVec3::X], 0.0)) && turns(&lap_path(1.0, 0.0)));
    }

    #[test]
    fn extents_are_the_farthest_coordinates() {
        assert_eq!(extent(&reflect_path(DVec3::ONE, 0.0)), 7.0);
        let corners = [DVec3::new(1.0, 2.0, 3.0), DVec3::new(0.0, -9.0, 4.0)];
        assert_eq!(extent(&circuit_path(&corners, 1.0)), 9.0);
        assert_eq!(extent(&lap_path(1.0, 1.0)), 8.0 + 6.0);
    }

    #[test]
    fn circuit_comes_round() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.0, 1.0), DVec3::Z];
        assert_eq!(circuit(&square, 0.5).0, DVec3::new(0.5, 0.0, 0.0));
        assert_eq!(circuit(&square, 4.5).0, circuit(&square, 0.5).0);
        assert_eq!(circuit(&square, 1.5).1, DVec3::Z);
    }

    /// Round it in small steps: no step is longer than it may be, the way is closed and the corners are
    /// round, on both kinds of side.
    #[test]
    fn lap_is_a_round_rectangle() {
        let (center, half, round) = (DVec3::new(10.0, 1.0, -5.0), [4.0, 2.0], 1.0);
        let length = 2.0 * (6.0 + 2.0) + std::f64::consts::TAU;
        let steps = 10_000;
        let step = length / f64::from(steps);
        let mut before = lap(center, half, round, 0.0);
        for i in 1..=steps {
            let now = lap(center, half, round, step * f64::from(i));
            let (moved, turned) = (before.0.distance(now.0), before.1.angle_between(now.1));
            assert!(moved <= step * STEP_SLACK && moved >= step * 0.999, "{i}: {moved}");
            assert!(turned <= step / round + 1e-7, "{i}: {turned}");
            let from = (now.0 - center).abs();
            assert!(from.x <= 4.0 + 1e-9 && from.z <= 2.0 + 1e-9 && from.y == 0.0, "{i}: {from}");
            assert!(from.x > 4.0 - 1e-3 || from.z > 2.0 - 1e-3 || (from.x > 3.0 && from.z > 1.0));
            before = now;
        }
        assert!(before.0.distance(lap(center, half, round, 0.0).0) < 1e-9);
        // More round than there is room for: half a circle at each end.
        assert_eq!(lap(DVec3::ZERO, [4.0, 2.0], 9.0, 0.0).0, DVec3::new(-2.0, 0.0, -2.0));
    }
}
