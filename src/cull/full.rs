//! `full`, the method of Kovalčík & Sochor 2006 (section 3), arranged so that a frame needs few round
//! trips. `full-waits` keeps the paper's waiting rule to the letter.
//!
//! 1. The walk (Algorithms 2 and 4): front to back through both levels. A node takes the
//!    `FirstVisibilityTest` (Algorithm 3): outside the frustum; certainly visible; visible last time,
//!    so drawn at once; invisible last time, so a *candidate*.
//! 2. One batch: everything drawn so far, then questions about all candidates, the surest to be hidden
//!    first and among equals the nearer, then about those drawn nodes whose next question is due by the postponement curve (Figure 3). A due
//!    node was drawn and nobody waits: its answer counts from the next frame on.
//! 3. Candidates that show are walked in turn, and make the next batch; at most
//!    [`FullKnobs::most_in_flight`] questions a batch.
//! 4. An inner node was visible if anything below it was (Bittner et al. 2004, *pull-up*), so visible
//!    inner nodes need no question; the paper asks about them too.
//! 5. Candidates that have long been hidden are asked about together (`group`).
//! 6. Tightened boxes (section 3.4) where contents stand still; lazy reconstruction is the index's.
//!
//! Departures: the paper's rule that questions with overlapping rectangles wait for one another is not
//! kept: what was visible last time is drawn before anything is asked, so the buffer is nearly whole,
//! and a wrong "visible" costs less than a round trip. Objects without a tree are nodes of their own.
//! It loses against `vfc` where little is hidden (`full-adaptive` does not); and without history, in a
//! first frame or after a turn, it asks against a buffer that is nearly empty, and so more and in vain.

use super::opened::{NO_PARENT, OpenedNodes};
use super::postponement::scatter;
use super::scenery::Appearance;
use super::{Culler, CullerSetup, Item, Pen, Postponement, Scenery, SceneryKnobs, View, group};
use crate::index::NodeId;
use crate::oracle::{OracleError, Proxy};

/// What can be tuned.
#[derive(Clone, Debug)]
pub struct FullKnobs {
    /// Most questions in one batch, at least 1.
    pub most_in_flight: usize,
    /// How recent answers postpone questions.
    pub postponement: Postponement,
    /// Most nodes in one question; 1 asks about each alone.
    pub most_together: usize,
    /// Whether to take tightened boxes.
    pub tighten: bool,
}

impl Default for FullKnobs {
    fn default() -> Self {
        Self {
            most_in_flight: 1024,
            postponement: Postponement::default(),
            most_together: 16,
            tighten: true,
        }
    }
}

/// What is remembered of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct History {
    /// One more than the last frame in which the node was visible; 0 for never.
    visible_after: u32,
    /// One more than the last frame in which the node was found hidden; 0 for never.
    hidden_after: u32,
    /// Frames in a row in which it was found hidden.
    hidden_frames: u32,
    /// "Visible" answers in a row.
    streak: u8,
    /// The first frame in which to ask again.
    ask_from: u32,
}

/// A node that was invisible last time, to be asked about.
struct Candidate {
    item: Item,
    proxy: Proxy,
    /// The place in `opened` of the node it was reached from.
    parent: usize,
    /// Whether it failed in a group and is to be asked about alone.
    alone: bool,
}

/// A drawn part whose next question is due.
struct Due {
    item: Item,
    proxy: Proxy,
    /// Its own place in `opened`.
    place: usize,
}

/// What one frame has at hand.
#[derive(Default)]
struct Frame {
    opened: OpenedNodes,
    candidates: Vec<Candidate>,
    due: Vec<Due>,
    stack: Vec<(Item, usize)>,
}

/// The paper's culler.
pub struct Full {
    scenery: Scenery,
    knobs: FullKnobs,
    history: Vec<History>,
    frame: Frame,
}

impl Full {
    /// Over the index and partition of `setup`.
    ///
    /// # Panics
    /// If no question may be in flight, or none may stand in one.
    #[must_use]
    pub fn new(setup: CullerSetup, knobs: FullKnobs) -> Self {
        assert!(knobs.most_in_flight > 0, "at least one question must be in flight");
        assert!(knobs.most_together > 0, "a question is about at least one node");
        let scenery_knobs = SceneryKnobs { tighten: knobs.tighten, treeless_items: true };
        let scenery = Scenery::new(setup, scenery_knobs);
        Self { scenery, knobs, history: Vec::new(), frame: Frame::default() }
    }

    /// Walks down from what is on the stack; draws what counts as visible, gathers the rest.
    fn walk(&mut self, view: &View<'_>, pen: &mut Pen<'_>) {
        while let Some((item, parent)) = self.frame.stack.pop() {
            let proxy = match self.scenery.appearance(view, item) {
                Appearance::Nowhere => continue,
                Appearance::Certain => {
                    self.open(view, pen, item, parent, true);
                    continue;
                }
                Appearance::Ask { proxy, .. } => proxy,
            };
            let history = self.history[self.scenery.slot(item)];
            let visible_last_time = view.frame > 0 && history.visible_after == view.frame;
            if !visible_last_time {
                self.frame.candidates.push(Candidate { item, proxy, parent, alone: false });
            } else if self.scenery.is_part(item) && view.frame >= history.ask_from {
                let place = self.open(view, pen, item, parent, false);
                self.frame.due.push(Due { item, proxy, place });
            } else {
                self.open(view, pen, item, parent, true);
            }
        }
    }

    /// Draws the node's own part or puts its children on the stack. `shows`: whether a part counts as
    /// visible without a further word.
    fn open(
        &mut self,
        view: &View<'_>,
        pen: &mut Pen<'_>,
        item: Item,
        parent: usize,
        shows: bool,
    ) -> usize {
        let Frame { opened, stack, .. } = &mut self.frame;
        let place = opened.open(&self.scenery, view, pen, (item, parent), stack);
        if shows && self.scenery.is_part(item) {
            self.frame.opened.show(place);
        }
        place
    }

    /// "Visible" from the device.
    fn seen(&mut self, view: &View<'_>, item: Item) {
        let slot = self.scenery.slot(item);
        let history = &mut self.history[slot];
        let wait = self.knobs.postponement.wait(history.streak);
        // Nodes that came into view together are not all asked about in one frame again.
        let spread = if wait > 1 { scatter(slot) % (wait / 2 + 1) } else { 0 };
        history.visible_after = view.frame + 1;
        history.ask_from = view.frame + 1 + wait - spread;
        history.streak = history.streak.saturating_add(1);
        history.hidden_frames = 0;
    }

    /// "Hidden" from the device.
    fn hidden(&mut self, view: &View<'_>, item: Item) {
        let slot = self.scenery.slot(item);
        let history = &mut self.history[slot];
        let again = view.frame > 0 && history.hidden_after == view.frame;
        *history = History {
            hidden_after: view.frame + 1,
            hidden_frames: if again { history.hidden_frames + 1 } else { 1 },
            ..History::default()
        };
    }

    /// The chance that a candidate is hidden, from how long it was.
    fn chance_hidden(&self, view: &View<'_>, item: Item) -> f64 {
        let history = &self.history[self.scenery.slot(item)];
        let lately = view.frame > 0 && history.hidden_after == view.frame;
        group::chance_of_staying_hidden(if lately { history.hidden_frames } else { 0 })
    }

    /// One batch of questions about candidates and due nodes; what shows is walked.
    fn batch(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let mut candidates = std::mem::take(&mut self.frame.candidates);
        let chance: Vec<f64> = candidates
            .iter()
            .map(|c| if c.alone { 0.0 } else { self.chance_hidden(view, c.item) })
            .collect();
        // The surest first, so that they go together; among equals the nearer first.
        let mut order: Vec<usize> = (0..candidates.len()).collect();
        order.sort_by(|&a, &b| chance[b].total_cmp(&chance[a]));
        let chances: Vec<f64> = order.iter().map(|&place| chance[place]).collect();
        let mut ends = group::runs(&chances, self.knobs.most_together);
        ends.truncate(self.knobs.most_in_flight);
        let asked = ends.last().copied().unwrap_or(0);
        let mut start = 0;
        for &end in &ends {
            let proxies: Vec<Proxy> =
                order[start..end].iter().map(|&place| candidates[place].proxy).collect();
            pen.ask_any(&proxies);
            start = end;
        }
        let room = self.knobs.most_in_flight - ends.len();
        let later = self.frame.due.split_off(room.min(self.frame.due.len()));
        let due = std::mem::replace(&mut self.frame.due, later);
        for part in &due {
            pen.ask(&part.proxy);
        }
        let mut answers = Vec::new();
        pen.round_trip(&mut answers)?;
        let mut shows = vec![Fate::Unasked; candidates.len()];
        let mut start = 0;
        for (&end, answer) in ends.iter().zip(&answers) {
            for &place in &order[start..end] {
                shows[place] = match (answer.visible, end - start) {
                    (false, _) => Fate::Hidden,
                    (true, 1) => Fate::Shows,
                    (true, _) => Fate::Again,
                };
            }
            start = end;
        }
        debug_assert_eq!(start, asked);
        for (part, answer) in due.iter().zip(&answers[ends.len()..]) {
            if answer.visible {
                self.seen(view, part.item);
                self.frame.opened.show(part.place);
            } else {
                self.hidden(view, part.item);
            }
        }
        for (candidate, fate) in candidates.drain(..).zip(shows) {
            match fate {
                Fate::Unasked => self.frame.candidates.push(candidate),
                Fate::Again => self.frame.candidates.push(Candidate { alone: true, ..candidate }),
                Fate::Hidden => self.hidden(view, candidate.item),
                Fate::Shows => {
                    self.seen(view, candidate.item);
                    self.open(view, pen, candidate.item, candidate.parent, true);
                    self.walk(view, pen);
                }
            }
        }
        Ok(())
    }

    /// Pulls visibility up: what was opened and shows nothing counts as hidden from the next frame on.
    fn pull_up(&mut self, view: &View<'_>) {
        for opened in self.frame.opened.iter() {
            let slot = self.scenery.slot(opened.item);
            let history = &mut self.history[slot];
            if opened.shows {
                history.visible_after = view.frame + 1;
            } else if self.scenery.is_part(opened.item) {
                // A due part with the answer "hidden".
            } else if view.frame + 1 < history.ask_from {
                // Its own box shows and nothing in it does: it stays open for a while, so that it is
                // not asked about in vain in every other frame.
                history.visible_after = view.frame + 1;
            } else {
                history.hidden_after = view.frame + 1;
                history.hidden_frames = 1;
            }
        }
    }
}

/// What became of a candidate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fate {
    /// There was no room for it.
    Unasked,
    Hidden,
    Shows,
    /// Something in its group shows.
    Again,
}

impl Culler for Full {
    fn name(&self) -> &str {
        "full"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame(view, &mut self.history);
        self.frame = Frame::default();
        self.frame.stack.push((Item::Scene(NodeId(0)), NO_PARENT));
        self.walk(view, pen);
        while !(self.frame.candidates.is_empty() && self.frame.due.is_empty()) {
            self.batch(view, pen)?;
        }
        self.pull_up(view);
        Ok(())
    }

    fn check(&self) -> Result<(), String> {
        self.scenery.check()
    }
}
