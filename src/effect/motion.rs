//! Motion along declared paths, in closed form, so that any frame can be had without those before.
//! Straight lines between reflecting walls are those of Kovalčík & Sochor 2006, section 4.

use glam::{DQuat, DVec3};

use crate::scene::{Motion, Path, Placement};

/// Rounding of a position: a few f64 operations on numbers no larger than the path's own, so that a
/// bound of speed times this holds for the computed steps too.
const STEP_SLACK: f64 = 1.0 + 1e-9;

/// The declared paths, by object.
#[derive(Debug)]
pub(super) struct MotionEffect {
    moving: Vec<u32>,
    paths: Vec<Path>,
}

impl MotionEffect {
    pub(super) fn new(motion: &Motion) -> Self {
        let mut movers = motion.movers.clone();
        movers.sort_by_key(|&(object, _)| object);
        let (moving, paths) = movers.into_iter().unzip();
        Self { moving, paths }
    }

    pub(super) fn moving(&self) -> &[u32] {
        &self.moving
    }

    fn path(&self, object: u32) -> Option<&Path> {
        self.moving.binary_search(&object).ok().map(|place| &self.paths[place])
    }

    pub(super) fn placement(&self, object: u32, rest: Placement, t: u32) -> Placement {
        match self.path(object) {
            None => rest,
            Some(Path::Reflect { velocity, min, max, spin }) => {
                let free = rest.translation + *velocity * f64::from(t);
                let axis = |i: usize| reflect(free[i], min[i], max[i]);
                let translation = DVec3::new(axis(0), axis(1), axis(2));
                let rotation = DQuat::from_rotation_y(spin * f64::from(t)) * rest.rotation;
                Placement { translation, rotation, ..rest }
            }
            Some(Path::Circuit { corners, speed, start }) => {
                let (translation, heading) = circuit(corners, start + speed * f64::from(t));
                let turn = DQuat::from_rotation_y(libm::atan2(-heading.z, heading.x));
                Placement { translation, rotation: turn * rest.rotation, ..rest }
            }
        }
    }

    /// Of a point that is `offset` from the origin.
    pub(super) fn step_bound(&self, object: u32, offset: f64) -> f64 {
        self.path(object).map_or(0.0, |path| {
            STEP_SLACK
                * match path {
                    // A chord is no longer than its arc, nor than the diameter.
                    Path::Reflect { velocity, spin, .. } => {
                        velocity.length() + offset * spin.abs().min(2.0)
                    }
                    // It may turn right about at a corner.
                    Path::Circuit { speed, .. } => speed.abs() + 2.0 * offset,
                }
        })
    }

    pub(super) fn turns(&self, object: u32) -> bool {
        self.path(object).is_some_and(|path| match path {
            Path::Reflect { spin, .. } => *spin != 0.0,
            Path::Circuit { .. } => true,
        })
    }

    /// The largest coordinate of the path.
    pub(super) fn extent(&self, object: u32) -> f64 {
        let most = |points: &[DVec3]| {
            points.iter().fold(0.0_f64, |most, point| most.max(point.abs().max_element()))
        };
        self.path(object).map_or(0.0, |path| match path {
            Path::Reflect { min, max, .. } => most(&[*min, *max]),
            Path::Circuit { corners, .. } => most(corners),
        })
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

    #[test]
    fn circuit_comes_round() {
        let square = [DVec3::ZERO, DVec3::X, DVec3::new(1.0, 0.0, 1.0), DVec3::Z];
        assert_eq!(circuit(&square, 0.5).0, DVec3::new(0.5, 0.0, 0.0));
        assert_eq!(circuit(&square, 4.5).0, circuit(&square, 0.5).0);
        assert_eq!(circuit(&square, 1.5).1, DVec3::Z);
    }
}
