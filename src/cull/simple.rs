//! `simple`, the paper's "Simple OC" (section 4): a query for every node in the frustum, one at a
//! time, no history. It draws the least and waits the most.

use super::scenery::Appearance;
use super::{Culler, CullerSetup, Item, Pen, Scenery, SceneryKnobs, View};
use crate::index::NodeId;
use crate::math::Aabb;
use crate::oracle::OracleError;

/// Occlusion culling without any thrift.
pub struct Simple {
    scenery: Scenery,
}

impl Simple {
    /// Over the index and partition of `setup`.
    #[must_use]
    pub fn new(setup: CullerSetup) -> Self {
        Self { scenery: Scenery::new(setup, SceneryKnobs::default()) }
    }
}

impl Culler for Simple {
    fn name(&self) -> &str {
        "simple"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame::<()>(view, &mut Vec::new());
        self.scenery.note_update(pen);
        let mut stack = vec![Item::Scene(NodeId(0))];
        let (mut next, mut answers) = (Vec::new(), Vec::new());
        while let Some(item) = stack.pop() {
            let visible = match self.scenery.appearance(view, item) {
                Appearance::Nowhere => false,
                Appearance::Certain => true,
                Appearance::Ask { proxy, .. } => {
                    pen.ask_about([item], &[proxy]);
                    answers.clear();
                    pen.round_trip(&mut answers)?;
                    answers.iter().all(|answer| answer.visible)
                }
            };
            if visible {
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
