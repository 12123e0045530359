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
