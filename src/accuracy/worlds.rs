//! One scene cut in several ways, each once, whatever runs on it.

use std::cell::RefCell;
use std::rc::Rc;
use std::sync::Arc;

use crate::part::{Partition, PartitionKnobs};
use crate::run::{World, difference_to};
use crate::scene::Scene;

/// Cuts a scene.
pub type MakeWorld<'a> = dyn Fn(Scene, PartitionKnobs) -> World + 'a;

/// How it was cut, and what came of it.
type Cut = (PartitionKnobs, Arc<Partition>);

/// A scene that is cut on demand; what was cut is kept.
#[derive(Clone)]
pub struct Worlds<'a> {
    scene: Scene,
    make: &'a MakeWorld<'a>,
    cut: Rc<RefCell<Vec<Cut>>>,
}

impl<'a> Worlds<'a> {
    /// Over `scene`, cut by `make`.
    #[must_use]
    pub fn new(scene: Scene, make: &'a MakeWorld<'a>) -> Self {
        Self { scene, make, cut: Rc::default() }
    }

    /// The scene.
    #[must_use]
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// The same meshes and objects under another description: what is cut serves both.
    pub(super) fn told(&self, scene: Scene) -> Self {
        Self { scene, ..self.clone() }
    }

    /// The scene cut so.
    #[must_use]
    pub fn world(&self, knobs: PartitionKnobs) -> World {
        if let Some((_, partition)) = self.cut.borrow().iter().find(|(cut, _)| *cut == knobs) {
            return World::over(self.scene.clone(), partition.clone());
        }
        let world = (self.make)(self.scene.clone(), knobs);
        self.cut.borrow_mut().push((knobs, world.partition.clone()));
        world
    }

    /// The scene cut as it says itself.
    #[must_use]
    pub(super) fn usual(&self) -> World {
        let leaf_triangles = self.scene.leaf_triangles;
        self.world(PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() })
    }

    /// Samples of the first frame that show another triangle than the uncut scene.
    pub(super) fn cut_pixels(&self, world: &World) -> u64 {
        difference_to(world, &self.world(PartitionKnobs::uncut()))
    }
}
