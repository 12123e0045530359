//! `chc++` (Mattausch, Bittner & Wimmer 2008), on the same trees as the others.
//!
//! 1. As `chc`, but a visible part is asked about only every few frames, by a random phase so that the
//!    questions spread (section 3.3): it is assumed visible meanwhile.
//! 2. Invisible nodes are queued and asked about in batches, which spares changes of state (section
//!    3.2); nodes that have long been hidden go into one question (section 4.3).
//! 3. A question about an inner node of an object may be about the boxes some levels below it instead,
//!    if together they are little larger (section 4.2).
//!
//! Departures: answers are taken when the walk has run dry, see `chc`; the random phase is a hash of
//! the node's number, so that runs repeat.

use super::opened::{NO_PARENT, OpenedNodes};
use super::postponement::scatter;
use super::scenery::{Appearance, NodeHistory};
use super::{Culler, CullerSetup, Item, Pen, Scenery, SceneryKnobs, Situation, View, group};
use crate::index::NodeId;
use crate::math::Aabb;
use crate::oracle::{OracleError, Proxy};

/// What can be tuned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ChcPlusKnobs {
    /// Frames for which a visible part is assumed visible (the paper's n_av), at least 1.
    pub assumed_visible: u32,
    /// Invisible nodes queued before they are asked about (the paper's b), at least 1.
    pub batch: usize,
    /// Most nodes in one question, at least 1.
    pub most_together: usize,
}

impl Default for ChcPlusKnobs {
    fn default() -> Self {
        Self { assumed_visible: 10, batch: 20, most_together: 16 }
    }
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct History {
    /// One more than the last frame in which the node was visible; 0 for never.
    visible_after: u32,
    /// One more than the last frame in which it was found hidden; 0 for never.
    hidden_after: u32,
    /// Frames in a row in which it was found hidden.
    hidden_frames: u32,
}

impl NodeHistory for History {
    fn inherit(&mut self, below: &Self) {
        self.visible_after = self.visible_after.max(below.visible_after);
    }
}

/// A node to be asked about, or asked.
struct Node {
    item: Item,
    proxies: Vec<Proxy>,
    /// Its own place among the opened if it was drawn, that of its parent if it waits.
    place: usize,
    was_visible: bool,
    chance: f64,
}

/// CHC++.
pub struct ChcPlus {
    scenery: Scenery,
    knobs: ChcPlusKnobs,
    history: Vec<History>,
    opened: OpenedNodes,
    /// Invisible nodes not yet asked about.
    queued: Vec<Node>,
    /// Questions on their way, each about some nodes.
    asked: Vec<Vec<Node>>,
}

impl ChcPlus {
    /// Over the index and partition of `setup`.
    ///
    /// # Panics
    /// If a part is assumed visible for no frame, or no node may be queued or stand in a question.
    #[must_use]
    pub fn new(setup: CullerSetup, knobs: ChcPlusKnobs) -> Self {
        assert!(knobs.assumed_visible > 0, "a part is asked about at most once a frame");
        assert!(knobs.batch > 0, "a batch holds at least one node");
        assert!(knobs.most_together > 0, "a question is about at least one node");
        let scenery = Scenery::new(setup, SceneryKnobs { tighten: true, treeless_items: true });
        Self {
            scenery,
            knobs,
            history: Vec::new(),
            opened: OpenedNodes::default(),
            queued: Vec::new(),
            asked: Vec::new(),
        }
    }

    /// Asks about all that is queued, those together that will hardly show.
    fn ask_queued(&mut self, pen: &mut Pen<'_>) {
        let mut queued = std::mem::take(&mut self.queued);
        queued.sort_by(|a, b| b.chance.total_cmp(&a.chance));
        let chances: Vec<f64> = queued.iter().map(|node| node.chance).collect();
        let mut start = 0;
        let mut rest = queued.into_iter();
        for end in group::runs(&chances, self.knobs.most_together) {
            if end - start == self.knobs.most_together && end - start > 1 {
                pen.reached(Situation::GroupFull);
            }
            let nodes: Vec<Node> = rest.by_ref().take(end - start).collect();
            let proxies: Vec<Proxy> = nodes.iter().flat_map(|n| n.proxies.clone()).collect();
            pen.ask_about(nodes.iter().map(|node| node.item), &proxies);
            self.asked.push(nodes);
            start = end;
        }
    }

    fn visit(
        &mut self,
        view: &View<'_>,
        pen: &mut Pen<'_>,
        (item, parent): (Item, usize),
        stack: &mut Vec<(Item, usize)>,
        due: &mut Vec<Node>,
    ) {
        let proxy = match self.scenery.appearance(view, item) {
            Appearance::Nowhere => return,
            Appearance::Certain => None,
            Appearance::Ask { proxy, .. } => Some(proxy),
        };
        let slot = self.scenery.slot(item);
        let history = self.history[slot];
        let was_visible = view.frame > 0 && history.visible_after == view.frame;
        let node = |proxies, place, chance| Node { item, proxies, place, was_visible, chance };
        match proxy {
            Some(proxy) if !was_visible => {
                let lately = view.frame > 0 && history.hidden_after == view.frame;
                let frames = if lately { history.hidden_frames } else { 0 };
                let chance = group::chance_of_staying_hidden(frames);
                let mut proxies = Vec::new();
                self.scenery.tighter_proxies(view, item, proxy, &mut proxies);
                self.queued.push(node(proxies, parent, chance));
                if self.queued.len() >= self.knobs.batch {
                    pen.reached(Situation::BatchFull);
                    self.ask_queued(pen);
                }
            }
            Some(proxy) if self.scenery.is_part(item) => {
                let place = self.opened.open(&self.scenery, view, pen, (item, parent), stack);
                // A hash for the random phase; the node's number decides.
                let phase = scatter(slot) >> 16;
                if (view.frame + phase).is_multiple_of(self.knobs.assumed_visible) {
                    due.push(node(vec![proxy], place, 0.0));
                } else {
                    self.opened.show(place);
                }
            }
            _ => {
                let place = self.opened.open(&self.scenery, view, pen, (item, parent), stack);
                if self.scenery.is_part(item) {
                    self.opened.show(place);
                }
            }
        }
    }

    /// Takes one answer: what shows is walked, groups that show are asked about one by one.
    fn settle(
        &mut self,
        view: &View<'_>,
        pen: &mut Pen<'_>,
        (nodes, visible): (Vec<Node>, bool),
        stack: &mut Vec<(Item, usize)>,
    ) {
        let together = nodes.len() > 1;
        for node in nodes {
            let slot = self.scenery.slot(node.item);
            if visible && together {
                self.queued.push(Node { chance: 0.0, ..node });
            } else if visible && node.was_visible {
                self.opened.show(node.place);
            } else if visible {
                let place =
                    self.opened.open(&self.scenery, view, pen, (node.item, node.place), stack);
                self.opened.show(place);
            } else {
                let history = &mut self.history[slot];
                let again = view.frame > 0 && history.hidden_after == view.frame;
                history.hidden_frames = if again { history.hidden_frames + 1 } else { 1 };
                history.hidden_after = view.frame + 1;
            }
        }
    }
}

impl Culler for ChcPlus {
    fn name(&self) -> &str {
        "chc++"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame(view, &mut self.history);
        self.scenery.note_update(pen);
        self.opened.clear();
        self.queued.clear();
        self.asked.clear();
        let mut stack = vec![(Item::Scene(NodeId(0)), NO_PARENT)];
        let (mut due, mut answers) = (Vec::new(), Vec::new());
        loop {
            while let Some(node) = stack.pop() {
                self.visit(view, pen, node, &mut stack, &mut due);
            }
            self.ask_queued(pen);
            // Nobody waits for these, so they go last.
            for node in due.drain(..) {
                pen.ask_about([node.item], &node.proxies);
                self.asked.push(vec![node]);
            }
            if self.asked.is_empty() {
                break;
            }
            answers.clear();
            pen.round_trip(&mut answers)?;
            for (nodes, answer) in std::mem::take(&mut self.asked).into_iter().zip(&answers).rev() {
                self.settle(view, pen, (nodes, answer.visible), &mut stack);
            }
        }
        for opened in self.opened.iter().filter(|opened| opened.shows) {
            self.history[self.scenery.slot(opened.item)].visible_after = view.frame + 1;
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
