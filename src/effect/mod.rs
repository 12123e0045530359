//! Effects: what may change a scene from frame to frame, one per file. An effect is built only when
//! the scene declares it and is a pure function of (scene, t). It must not know indexes or oracles.

mod motion;

use std::sync::Arc;

use crate::scene::{Placement, Scene};

use motion::MotionEffect;

/// A scene with the effects that it declares.
#[derive(Debug)]
pub struct World {
    scene: Arc<Scene>,
    motion: Option<MotionEffect>,
}

impl World {
    /// Builds the declared effects; one that is not declared is not built and costs nothing.
    #[must_use]
    pub fn new(scene: &Arc<Scene>) -> Self {
        let motion = scene.effects.motion.as_ref().map(MotionEffect::new);
        Self { scene: Arc::clone(scene), motion }
    }

    /// Where an object stands at frame `t`.
    ///
    /// # Panics
    /// For an object that does not exist.
    #[must_use]
    pub fn placement(&self, object: u32, t: u32) -> Placement {
        let rest = self.scene.objects[object as usize].placement;
        self.motion.as_ref().map_or(rest, |motion| motion.placement(object, rest, t))
    }

    /// Ids of the objects that some effect moves, ascending.
    #[must_use]
    pub fn moving(&self) -> &[u32] {
        self.motion.as_ref().map_or(&[], MotionEffect::moving)
    }

    /// The farthest an object's origin moves in one frame, world units; 0 for one that stands still.
    #[must_use]
    pub fn step_bound(&self, object: u32) -> f64 {
        self.motion.as_ref().map_or(0.0, |motion| motion.step_bound(object))
    }
}
