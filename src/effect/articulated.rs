//! Articulated motion: figures of several objects, each a limb that swings on joints as the body goes
//! along a path (the pedestrians of Wortel 2011, section 4.2, are such figures). A limb is an object like
//! any other; that they belong together is known here alone.

use glam::{DQuat, DVec3};

use super::path;
use crate::scene::{Articulated, Figure, Joint, Placement};

/// The declared figures, and the limbs by object.
#[derive(Debug)]
pub(super) struct ArticulatedEffect {
    figures: Vec<Figure>,
    moving: Vec<u32>,
    /// By place in `moving`, which figure and which of its limbs.
    limbs: Vec<(u32, u32)>,
}

/// A limb of a figure.
#[derive(Clone, Copy)]
pub(super) struct LimbOf<'a> {
    figure: &'a Figure,
    joints: &'a [Joint],
}

impl ArticulatedEffect {
    pub(super) fn new(articulated: &Articulated) -> Self {
        let figures = articulated.figures.clone();
        let numbered = (0..).zip(&figures);
        let of = |(number, figure): (u32, &Figure)| {
            let limbs = (0..).zip(&figure.limbs);
            limbs.map(move |(limb, this)| (this.object, (number, limb))).collect::<Vec<_>>()
        };
        let mut limbs: Vec<(u32, (u32, u32))> = numbered.flat_map(of).collect();
        limbs.sort_unstable();
        let (moving, limbs) = limbs.into_iter().unzip();
        Self { figures, moving, limbs }
    }

    pub(super) fn moving(&self) -> &[u32] {
        &self.moving
    }

    pub(super) fn limb(&self, object: u32) -> Option<LimbOf<'_>> {
        let (figure, limb) = self.limbs[self.moving.binary_search(&object).ok()?];
        let figure = &self.figures[figure as usize];
        Some(LimbOf { figure, joints: &figure.limbs[limb as usize].joints })
    }
}

impl LimbOf<'_> {
    pub(super) fn placement(&self, rest: Placement, t: u32) -> Placement {
        let Figure { path, start, pace, phase, .. } = self.figure;
        let (mut translation, mut rotation) = path::place(path, *start, t);
        for joint in self.joints {
            translation += rotation * joint.hinge;
            if joint.swing != 0.0 {
                let angle = joint.swing * libm::sin(pace * f64::from(t) + phase + joint.phase);
                rotation *= DQuat::from_rotation_z(angle);
            }
        }
        Placement { translation, rotation: rotation * rest.rotation, ..rest }
    }

    /// How far from the body's axis the hinges reach, and what is beyond them.
    fn arm(&self, offset: f64) -> f64 {
        // Once something swings, what is below it may point anywhere.
        let mut swings = false;
        let hinges = self.joints.iter().map(|joint| {
            let length = if swings {
                joint.hinge.length()
            } else {
                (joint.hinge * DVec3::new(1.0, 0.0, 1.0)).length()
            };
            swings |= joint.swing != 0.0;
            length
        });
        hinges.sum::<f64>() + offset
    }

    /// Of a point that is `offset` from the limb's origin.
    pub(super) fn step_bound(&self, offset: f64) -> f64 {
        let body = path::step_bound(&self.figure.path, self.arm(offset));
        // By joint, what it turns by in a frame at most, times all that hangs on it. The sine's slope is at
        // most 1, and it goes from −1 to 1 at most.
        let pace = self.figure.pace.abs().min(2.0);
        let swings = self.joints.iter().enumerate().map(|(i, joint)| {
            let below: f64 = self.joints[i + 1..].iter().map(|joint| joint.hinge.length()).sum();
            (joint.swing.abs() * pace).min(2.0) * (below + offset)
        });
        body + swings.sum::<f64>()
    }

    pub(super) fn turns(&self) -> bool {
        path::turns(&self.figure.path) || self.joints.iter().any(|joint| joint.swing != 0.0)
    }

    pub(super) fn extent(&self) -> f64 {
        let reach: f64 = self.joints.iter().map(|joint| joint.hinge.length()).sum();
        path::extent(&self.figure.path).max(self.figure.start.abs().max_element()) + reach
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Limb, Path};

    /// An upper and a lower arm on a body that runs straight.
    fn figure(pace: f64, swings: [f64; 2]) -> ArticulatedEffect {
        let hinges = [DVec3::new(0.0, 5.0, 0.0), DVec3::new(3.0, 0.0, 4.0)];
        let joint = |(hinge, swing): (&DVec3, f64)| Joint { hinge: *hinge, swing, phase: 0.4 };
        let joints = hinges.iter().zip(swings).map(joint).collect();
        let path = Path::Reflect {
            velocity: DVec3::Z * 0.25,
            min: DVec3::splat(-1e3),
            max: DVec3::splat(1e3),
            spin: 0.0,
        };
        let limbs = vec![Limb { object: 0, joints }];
        let figures =
            vec![Figure { path, start: DVec3::new(2.0, 0.0, -3.0), pace, phase: 0.1, limbs }];
        ArticulatedEffect::new(&Articulated { figures })
    }

    /// A limb that swings turns, however straight its body goes; a stiff one does not.
    #[test]
    fn what_swings_turns() {
        let turns = |swings: [f64; 2]| figure(0.5, swings).limb(0).unwrap().turns();
        assert!(!turns([0.0, 0.0]));
        assert!(turns([0.3, 0.0]) && turns([0.0, 0.3]) && turns([-0.3, 0.0]));
    }

    /// A step is the body's, and by joint what it turns by times what hangs on it: no more than twice the
    /// swing, and of a turn no more than the diameter.
    #[test]
    fn steps_add_up_over_joints() {
        let step =
            |pace: f64, swings: [f64; 2]| figure(pace, swings).limb(0).unwrap().step_bound(2.0);
        let near = |value: f64, expected: f64| {
            assert!((value - expected).abs() < 1e-12, "{value} is not {expected}");
        };
        near(step(0.5, [0.0, 0.0]), 0.25);
        // The lower joint carries what is 2 away, the upper one also the hinge that is 5 away.
        near(step(0.5, [0.0, 0.4]), 0.25 + 0.2 * 2.0);
        near(step(-0.5, [0.6, 0.4]), 0.25 + 0.3 * (5.0 + 2.0) + 0.2 * 2.0);
        near(step(9.0, [0.6, 0.4]), 0.25 + 1.2 * (5.0 + 2.0) + 0.8 * 2.0);
        near(step(9.0, [1.5, 0.0]), 0.25 + 2.0 * (5.0 + 2.0));
    }

    /// Beside the body's axis the first hinge counts by what is level of it, and what hangs on a joint that
    /// swings by all of it.
    #[test]
    fn arms_reach_from_the_bodys_axis() {
        let arm = |swings: [f64; 2]| figure(0.5, swings).limb(0).unwrap().arm(2.0);
        assert_eq!(arm([0.0, 0.0]), 0.0 + 5.0 + 2.0);
        let mut tall = figure(0.5, [0.5, 0.0]);
        tall.figures[0].limbs[0].joints = [(DVec3::Y * 5.0, 0.5), (DVec3::Y * 3.0, 0.0)]
            .map(|(hinge, swing)| Joint { hinge, swing, phase: 0.0 })
            .into();
        assert_eq!(tall.limb(0).unwrap().arm(2.0), 0.0 + 3.0 + 2.0, "it may swing to the side");
        tall.figures[0].limbs[0].joints = [(DVec3::Y * 5.0, 0.0), (DVec3::Y * 3.0, 0.5)]
            .map(|(hinge, swing)| Joint { hinge, swing, phase: 0.0 })
            .into();
        assert_eq!(tall.limb(0).unwrap().arm(2.0), 0.0 + 0.0 + 2.0, "stiff and upright");
    }

    /// Sampled: bounds hold, and most of each is made use of.
    #[test]
    fn a_swing_uses_its_bound() {
        for (pace, swings, least) in
            [(0.3, [0.8, 0.0], 0.6), (2.9, [0.7, 0.0], 0.6), (1.4, [0.0, 1.0], 0.6)]
        {
            let effect = figure(pace, swings);
            let limb = effect.limb(0).unwrap();
            let bound = limb.step_bound(2.0);
            let tip = |t: u32| {
                let at = limb.placement(Placement::IDENTITY, t);
                at.translation + at.rotation * (DVec3::X * 2.0)
            };
            let steps = (0..2000).map(|t| tip(t).distance(tip(t + 1)));
            let most = steps.fold(0.0, f64::max);
            assert!(most <= bound * path::STEP_SLACK, "{pace}: {most} beyond {bound}");
            assert!(most > bound * least, "{pace}: {most} of {bound}");
        }
    }

    #[test]
    fn an_extent_is_the_paths_and_the_arms() {
        assert_eq!(figure(0.5, [0.0; 2]).limb(0).unwrap().extent(), 1e3 + 5.0 + 5.0);
    }
}
