//! Effects: what may change a scene from frame to frame, one per file. An effect is built only when
//! the scene declares it and is a pure function of (scene, t). It must not know indexes or oracles.

mod articulated;
mod motion;
mod path;
mod teleport;

use std::ops::Add;
use std::sync::Arc;

use crate::scene::{Path, Placement, Scene};

use articulated::{ArticulatedEffect, LimbOf};
use motion::MotionEffect;
use path::STEP_SLACK;
use teleport::TeleportEffect;

/// How often effects were evaluated: 0 for one that the scene does not declare.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Placements along paths.
    pub motion: u64,
    /// Placements of limbs.
    pub articulated: u64,
    /// Offsets of jumpers.
    pub teleport: u64,
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            motion: self.motion + other.motion,
            articulated: self.articulated + other.articulated,
            teleport: self.teleport + other.teleport,
        }
    }
}

/// A member of the family.
#[derive(Clone, Copy, Debug)]
pub struct EffectKind {
    /// Its name in scene files and reports.
    pub name: &'static str,
    /// One line for people.
    pub summary: &'static str,
    /// Whether a scene declares it.
    pub declared: fn(&Scene) -> bool,
    /// Takes it out of a scene.
    pub take_out: fn(&mut Scene),
    /// How often it was evaluated.
    pub work: fn(&Work) -> u64,
}

/// Every effect there is.
pub const EFFECTS: &[EffectKind] = &[
    EffectKind {
        name: "motion",
        summary: "objects on straight lines between walls, or round circuits and laps",
        declared: |scene| scene.effects.motion.is_some(),
        take_out: |scene| scene.effects.motion = None,
        work: |work| work.motion,
    },
    EffectKind {
        name: "articulated",
        summary: "figures of several objects whose limbs swing as they go",
        declared: |scene| scene.effects.articulated.is_some(),
        take_out: |scene| scene.effects.articulated = None,
        work: |work| work.articulated,
    },
    EffectKind {
        name: "teleport",
        summary: "objects that jump from place to place",
        declared: |scene| scene.effects.teleport.is_some(),
        take_out: |scene| scene.effects.teleport = None,
        work: |work| work.teleport,
    },
];

/// A scene with the effects that it declares.
#[derive(Debug)]
pub struct World {
    scene: Arc<Scene>,
    motion: Option<MotionEffect>,
    articulated: Option<ArticulatedEffect>,
    teleport: Option<TeleportEffect>,
    /// Objects that some effect moves, ascending.
    moving: Vec<u32>,
}

/// How an object goes.
enum Way<'a> {
    None,
    Path(&'a Path),
    Limb(LimbOf<'a>),
}

impl World {
    /// Builds the declared effects; one that is not declared is not built and costs nothing.
    #[must_use]
    pub fn new(scene: &Arc<Scene>) -> Self {
        let motion = scene.effects.motion.as_ref().map(MotionEffect::new);
        let articulated = scene.effects.articulated.as_ref().map(ArticulatedEffect::new);
        let teleport = scene.effects.teleport.as_ref().map(TeleportEffect::new);
        let mut moving: Vec<u32> = Vec::new();
        moving.extend(motion.iter().flat_map(|motion| motion.moving()));
        moving.extend(articulated.iter().flat_map(|articulated| articulated.moving()));
        moving.extend(teleport.iter().flat_map(|teleport| teleport.jumping()));
        moving.sort_unstable();
        moving.dedup();
        Self { scene: Arc::clone(scene), motion, articulated, teleport, moving }
    }

    /// How an object goes, apart from jumps. One that has a path is nobody's limb.
    fn way(&self, object: u32) -> Way<'_> {
        let path = self.motion.as_ref().and_then(|motion| motion.path(object));
        let limb = || self.articulated.as_ref().and_then(|articulated| articulated.limb(object));
        path.map(Way::Path).or_else(|| limb().map(Way::Limb)).unwrap_or(Way::None)
    }

    /// Where an object stands at frame `t`; `work` is told of every effect that was evaluated for it.
    ///
    /// # Panics
    /// For an object that does not exist.
    #[must_use]
    pub fn placement(&self, object: u32, t: u32, work: &mut Work) -> Placement {
        let rest = self.scene.objects[object as usize].placement;
        if self.moving.binary_search(&object).is_err() {
            return rest;
        }
        let placement = match self.way(object) {
            Way::None => rest,
            Way::Path(path) => {
                work.motion += 1;
                MotionEffect::placement(path, rest, t)
            }
            Way::Limb(limb) => {
                work.articulated += 1;
                limb.placement(rest, t)
            }
        };
        let Some(teleport) = &self.teleport else { return placement };
        work.teleport += 1;
        let translation = placement.translation + teleport.offset(object, t);
        Placement { translation, ..placement }
    }

    /// Ids of the objects that some effect moves, ascending.
    #[must_use]
    pub fn moving(&self) -> &[u32] {
        &self.moving
    }

    /// Whether an object may have gone farther from frame `t` − 1 to `t` than its step bound.
    #[must_use]
    pub fn jumped(&self, object: u32, t: u32) -> bool {
        self.teleport.as_ref().is_some_and(|teleport| teleport.jumped(object, t))
    }

    /// The farthest a point of the object moves in one frame without a jump, world units, for one that is
    /// `offset` from its origin; 0 for an object that stands still.
    #[must_use]
    pub fn step_bound(&self, object: u32, offset: f64) -> f64 {
        STEP_SLACK
            * match self.way(object) {
                Way::None => 0.0,
                Way::Path(path) => path::step_bound(path, offset),
                Way::Limb(limb) => limb.step_bound(offset),
            }
    }

    /// Whether the object ever turns.
    #[must_use]
    pub fn turns(&self, object: u32) -> bool {
        match self.way(object) {
            Way::None => false,
            Way::Path(path) => path::turns(path),
            Way::Limb(limb) => limb.turns(),
        }
    }

    /// The largest coordinate, by its absolute value, that the object's origin ever has.
    #[must_use]
    pub fn extent(&self, object: u32) -> f64 {
        let rest = self.scene.objects[object as usize].placement.translation.abs().max_element();
        let moved = match self.way(object) {
            Way::None => 0.0,
            Way::Path(path) => path::extent(path),
            Way::Limb(limb) => limb.extent(),
        };
        rest.max(moved) + self.teleport.as_ref().map_or(0.0, |teleport| teleport.extent(object))
    }
}
