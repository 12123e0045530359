//! `pipelined`: `simple` whose questions are on their way in small batches, several at a time, while the
//! traversal goes on: Wimmer & Bittner 2005 (*Hardware occlusion queries made useful*, GPU Gems 2) keep such a
//! queue so that neither side waits for the other. No history: what is asked is asked in every frame.
//!
//! 1. Nodes are taken from the stack, the nearer first. One that must be asked about joins the open batch.
//! 2. A full batch is sent. With [`PipelinedKnobs::most_batches`] on their way the oldest is waited for; the visible nodes in
//!    it are opened and their contents drawn.
//! 3. With nothing left on the stack the open batch is sent, and the oldest waited for.
//!
//! Batches are taken in the order in which they were sent, whatever the order of their arrival: so
//! nothing depends on a device's mood. A node is asked about against less than `simple` has drawn by then, which
//! errs towards visible.

use std::collections::VecDeque;

use super::scenery::Appearance;
use super::{Culler, CullerSetup, Item, Pen, Scenery, SceneryKnobs, Situation, View};
use crate::index::NodeId;
use crate::math::Aabb;
use crate::oracle::OracleError;

/// What can be tuned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PipelinedKnobs {
    /// Questions in a batch, at least 1.
    pub batch: usize,
    /// Batches on their way before the oldest is waited for, at least 1.
    pub most_batches: usize,
}

impl Default for PipelinedKnobs {
    fn default() -> Self {
        Self { batch: 16, most_batches: 4 }
    }
}

/// Occlusion culling with a queue of batches.
pub struct Pipelined {
    scenery: Scenery,
    knobs: PipelinedKnobs,
}

impl Pipelined {
    /// Over the index and partition of `setup`.
    ///
    /// # Panics
    /// If a batch holds no question, or no batch may be on its way.
    #[must_use]
    pub fn new(setup: CullerSetup, knobs: PipelinedKnobs) -> Self {
        assert!(knobs.batch > 0, "a batch holds at least one question");
        assert!(knobs.most_batches > 0, "at least one batch must be on its way");
        Self { scenery: Scenery::new(setup, SceneryKnobs::default()), knobs }
    }
}

impl Culler for Pipelined {
    fn name(&self) -> &str {
        "pipelined"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame::<()>(view, &mut Vec::new());
        self.scenery.note_update(pen);
        let mut stack = vec![Item::Scene(NodeId(0))];
        let (mut next, mut answers) = (Vec::new(), Vec::new());
        let (mut open, mut sent) = (Vec::new(), VecDeque::new());
        loop {
            while sent.len() < self.knobs.most_batches
                && let Some(item) = stack.pop()
            {
                match self.scenery.appearance(view, item) {
                    Appearance::Nowhere => {}
                    Appearance::Certain => {
                        self.scenery.expand(view, item, pen, &mut next);
                        stack.extend(next.drain(..).rev());
                    }
                    Appearance::Ask { proxy, .. } => {
                        pen.ask_about([item], &[proxy]);
                        open.push(item);
                    }
                }
                if open.len() == self.knobs.batch {
                    pen.send()?;
                    sent.push_back(std::mem::take(&mut open));
                }
            }
            if stack.is_empty() && !open.is_empty() {
                pen.send()?;
                sent.push_back(std::mem::take(&mut open));
            }
            if sent.len() == self.knobs.most_batches && !stack.is_empty() {
                pen.reached(Situation::QueueFull);
            }
            let Some(batch) = sent.pop_front() else { break };
            answers.clear();
            pen.receive(&mut answers)?;
            // The first of the batch is opened first: it goes on the stack last.
            for (item, answer) in batch.into_iter().zip(&answers).rev() {
                if answer.visible {
                    self.scenery.expand(view, item, pen, &mut next);
                    stack.extend(next.drain(..).rev());
                }
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
