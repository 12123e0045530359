//! `chc`, coherent hierarchical culling (Bittner, Wimmer, Piringer & Purgathofer 2004), on the same
//! trees as the others.
//!
//! 1. Front to back. A node that was visible and is inner is *opened* without a question; a visible
//!    part is drawn at once and asked about, so that nobody waits; an invisible node is asked about and
//!    waited for.
//! 2. When nothing is left to walk, the answers are taken: what shows is pulled up to its ancestors,
//!    and a node that was invisible and shows is walked.
//!
//! Departure: the original takes an answer as soon as the device has it; here they come when the walk
//! has run dry, so that no decision sees arrival times. It asks about every visible part in every
//! frame, which is what `chc++` and `full` save.

use super::opened::{NO_PARENT, OpenedNodes};
use super::scenery::Appearance;
use super::{Culler, CullerSetup, Item, Pen, Scenery, SceneryKnobs, View};
use crate::index::NodeId;
use crate::math::Aabb;
use crate::oracle::OracleError;

/// A node asked about.
struct Asked {
    item: Item,
    /// Its own place among the opened if it was drawn, that of its parent if it waits.
    place: usize,
    was_visible: bool,
}

/// Coherent hierarchical culling.
pub struct Chc {
    scenery: Scenery,
    /// One more than the last frame in which the node was visible; 0 for never.
    visible_after: Vec<u32>,
    opened: OpenedNodes,
}

impl Chc {
    /// Over the index and partition of `setup`.
    #[must_use]
    pub fn new(setup: CullerSetup) -> Self {
        let scenery = Scenery::new(setup, SceneryKnobs { tighten: true, treeless_items: true });
        Self { scenery, visible_after: Vec::new(), opened: OpenedNodes::default() }
    }
}

impl Culler for Chc {
    fn name(&self) -> &str {
        "chc"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame(view, &mut self.visible_after);
        self.scenery.note_update(pen);
        self.opened.clear();
        let mut stack = vec![(Item::Scene(NodeId(0)), NO_PARENT)];
        let (mut asked, mut answers): (Vec<Asked>, _) = (Vec::new(), Vec::new());
        while !(stack.is_empty() && asked.is_empty()) {
            while let Some((item, parent)) = stack.pop() {
                let is_part = self.scenery.is_part(item);
                match self.scenery.appearance(view, item) {
                    Appearance::Nowhere => {}
                    Appearance::Certain => {
                        let place =
                            self.opened.open(&self.scenery, view, pen, (item, parent), &mut stack);
                        if is_part {
                            self.opened.show(place);
                        }
                    }
                    Appearance::Ask { proxy, .. } => {
                        let visible_after = self.visible_after[self.scenery.slot(item)];
                        let was_visible = view.frame > 0 && visible_after == view.frame;
                        let mut place = parent;
                        if was_visible {
                            place = self.opened.open(
                                &self.scenery,
                                view,
                                pen,
                                (item, parent),
                                &mut stack,
                            );
                        }
                        if is_part || !was_visible {
                            pen.ask_about([item], &[proxy]);
                            asked.push(Asked { item, place, was_visible });
                        }
                    }
                }
            }
            if asked.is_empty() {
                break;
            }
            answers.clear();
            pen.round_trip(&mut answers)?;
            let shown: Vec<Asked> = asked
                .drain(..)
                .zip(&answers)
                .filter_map(|(node, answer)| answer.visible.then_some(node))
                .collect();
            // Pushed the farthest first, so that the nearest is walked first.
            for node in shown.into_iter().rev() {
                if node.was_visible {
                    self.opened.show(node.place);
                } else {
                    let place = self.opened.open(
                        &self.scenery,
                        view,
                        pen,
                        (node.item, node.place),
                        &mut stack,
                    );
                    self.opened.show(place);
                }
            }
        }
        for opened in self.opened.iter().filter(|opened| opened.shows) {
            self.visible_after[self.scenery.slot(opened.item)] = view.frame + 1;
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
