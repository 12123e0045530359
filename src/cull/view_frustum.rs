//! `vfc`, the paper's "VFC only": frustum culling over the same two levels, no questions. What it
//! draws is the ceiling of what occlusion culling can save.

use super::{Culler, CullerSetup, Item, Pen, Scenery, SceneryKnobs, View};
use crate::index::NodeId;
use crate::math::Aabb;
use crate::oracle::OracleError;

/// View-frustum culling.
pub struct ViewFrustum {
    scenery: Scenery,
}

impl ViewFrustum {
    /// Over the index and partition of `setup`.
    #[must_use]
    pub fn new(setup: CullerSetup) -> Self {
        Self { scenery: Scenery::new(setup, SceneryKnobs::default()) }
    }
}

impl Culler for ViewFrustum {
    fn name(&self) -> &str {
        "vfc"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame::<()>(view, &mut Vec::new());
        self.scenery.note_update(pen);
        let mut stack = vec![Item::Scene(NodeId(0))];
        let mut next = Vec::new();
        while let Some(item) = stack.pop() {
            if !self.scenery.outside(view, item) {
                self.scenery.expand(view, item, pen, &mut next);
                stack.extend(next.drain(..).rev());
            }
        }
        Ok(())
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        self.scenery.check(boxes)
    }

    fn scenery(&self, _: u32) -> Option<&Scenery> {
        Some(&self.scenery)
    }
}
