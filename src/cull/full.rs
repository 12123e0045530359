//! `full`, the method of Kovalčík & Sochor 2006 (section 3), arranged so that a frame needs few round
//! trips. `full-waits` keeps the paper's waiting rule to the letter.
//!
//! 1. The walk (Algorithms 2 and 4): front to back through both levels. A node takes the
//!    `FirstVisibilityTest` (Algorithm 3): outside the frustum; certainly visible; visible last time,
//!    so drawn at once; invisible last time, so a *candidate*.
//! 2. One batch: everything drawn so far, then questions about all candidates, in the order of the
//!    walk, then about those drawn nodes whose next question is due by the postponement curve
//!    (Figure 3). A due node was drawn and nobody waits: its answer counts from the next frame on.
//! 3. Candidates that show are walked in turn, and make the next batch; at most
//!    [`FullKnobs::most_in_flight`] questions a batch. Of nodes that nothing is known of, as in a first
//!    frame or after a turn, the nearest are asked about first, as many as parts are drawn: they hide
//!    the others, which would be asked about in vain.
//! 4. An inner node was visible if anything below it was (Bittner et al. 2004, *pull-up*), so visible
//!    inner nodes need no question; the paper asks about them too.
//! 5. Candidates that have long been hidden are asked about together (`group`).
//! 6. Tightened boxes (section 3.4) where contents stand still; lazy reconstruction is the index's.
//!    Parts are asked about by some boxes each, which together are tighter than one.
//!
//! `full-trusting` is the same with longer waits, and believes a group that shows of all its members:
//! where questions are dear, as on the paper's device, it trades parts for them.
//!
//! Departures: the paper's rule that questions with overlapping rectangles wait for one another is not
//! kept: what was visible last time is drawn before anything is asked, so the buffer is nearly whole,
//! and a wrong "visible" costs less than a round trip. Objects without a tree are nodes of their own.
//! It loses against `vfc` where little is hidden (`full-adaptive` does not).

use super::layers::next_layer;
use super::opened::{NO_PARENT, OpenedNodes};
use super::postponement::scatter;
use super::scenery::Appearance;
use super::{Culler, CullerSetup, Item, Pen, Postponement, Scenery, SceneryKnobs, View, group};
use crate::index::NodeId;
use crate::oracle::{OracleError, Proxy};

/// What can be tuned.
#[derive(Clone, Debug)]
pub struct FullKnobs {
    /// Name for reports.
    pub name: &'static str,
    /// Most questions in one batch, at least 1.
    pub most_in_flight: usize,
    /// How recent answers postpone questions.
    pub postponement: Postponement,
    /// Most nodes in one question; 1 asks about each alone.
    pub most_together: usize,
    /// What to do with the nodes of a group that shows.
    pub after_group: AfterGroup,
    /// Most boxes by which a part is asked about, at least 1.
    pub most_boxes: usize,
    /// Whether to take tightened boxes.
    pub tighten: bool,
}

/// What becomes of nodes of which a question about several says that one shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterGroup {
    /// Each is asked about alone.
    #[default]
    AskAgain,
    /// Parts are drawn; nodes are asked about alone. So failing costs little, and groups are made larger.
    Trust,
}

impl Default for FullKnobs {
    fn default() -> Self {
        Self {
            name: "full",
            most_in_flight: 1024,
            postponement: Postponement::default(),
            most_together: 16,
            after_group: AfterGroup::default(),
            most_boxes: MOST_BOXES,
            tighten: true,
        }
    }
}

impl FullKnobs {
    /// Of `full-trusting`.
    #[must_use]
    pub fn trusting() -> Self {
        Self {
            name: "full-trusting",
            postponement: Postponement::Seldom,
            after_group: AfterGroup::Trust,
            ..Self::default()
        }
    }
}

/// Boxes by which a part is asked about: in the bunnies four let pass an eighth fewer parts than one,
/// and sixteen only a twentieth fewer again for three times the boxes.
const MOST_BOXES: usize = 4;
/// What trusting makes of the chance that a node comes into view, in making up groups: a failure costs a
/// part that was not hidden for sure anyway. In the bunnies a tenth asks 10 % less than one and draws
/// 8 % more.
const TRUSTING_DOUBT: f64 = 0.1;

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
    /// How near it can be.
    depth: f32,
    /// The place in `opened` of the node it was reached from.
    parent: usize,
    /// The chance that it is hidden; `None` where nothing is known of it.
    chance: Option<f64>,
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
    drawn_parts: usize,
    proxies: Vec<Proxy>,
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
    /// If no question may be in flight, or none may stand in one, or a part has no box.
    #[must_use]
    pub fn new(setup: CullerSetup, knobs: FullKnobs) -> Self {
        assert!(knobs.most_in_flight > 0, "at least one question must be in flight");
        assert!(knobs.most_together > 0, "a question is about at least one node");
        assert!(knobs.most_boxes > 0, "a part is asked about by at least one box");
        let scenery_knobs = SceneryKnobs { tighten: knobs.tighten, treeless_items: true };
        let scenery = Scenery::new(setup, scenery_knobs);
        Self { scenery, knobs, history: Vec::new(), frame: Frame::default() }
    }

    /// Walks down from what is on the stack; draws what counts as visible, gathers the rest.
    fn walk(&mut self, view: &View<'_>, pen: &mut Pen<'_>) {
        while let Some((item, parent)) = self.frame.stack.pop() {
            let (proxy, depth) = match self.scenery.appearance(view, item) {
                Appearance::Nowhere => continue,
                Appearance::Certain => {
                    self.open(view, pen, item, parent, true);
                    continue;
                }
                Appearance::Ask { proxy, depth, .. } => (proxy, depth),
            };
            let history = self.history[self.scenery.slot(item)];
            let visible_last_time = view.frame > 0 && history.visible_after == view.frame;
            if !visible_last_time {
                let chance = self.chance_hidden(view, item);
                let candidate = Candidate { item, proxy, depth, parent, chance, alone: false };
                self.frame.candidates.push(candidate);
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
        if self.scenery.is_part(item) {
            self.frame.drawn_parts += 1;
            if shows {
                self.frame.opened.show(place);
            }
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

    /// The chance that a candidate is hidden, from how long it was; `None` if it was not last time.
    fn chance_hidden(&self, view: &View<'_>, item: Item) -> Option<f64> {
        let history = &self.history[self.scenery.slot(item)];
        let lately = view.frame > 0 && history.hidden_after == view.frame;
        let shows = 1.0 - group::chance_of_staying_hidden(history.hidden_frames);
        let doubt = match self.knobs.after_group {
            AfterGroup::AskAgain => 1.0,
            AfterGroup::Trust => TRUSTING_DOUBT,
        };
        lately.then_some(1.0 - doubt * shows)
    }

    /// Asks about a node, by itself or as one of a group.
    fn push_proxies(&mut self, view: &View<'_>, item: Item, proxy: Proxy) {
        let about = (proxy, self.knobs.most_boxes);
        self.scenery.tightest_proxies(view, item, about, &mut self.frame.proxies);
    }

    /// One batch of questions about candidates and due nodes; what shows is walked.
    fn batch(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let candidates = std::mem::take(&mut self.frame.candidates);
        let new_depth = |c: &Candidate| c.chance.is_none().then_some(c.depth);
        let (candidates, later) = next_layer(candidates, self.frame.drawn_parts, new_depth);
        self.frame.candidates = later;
        let chance = |c: &Candidate| {
            let unknown = group::chance_of_staying_hidden(0);
            if c.alone { 0.0 } else { c.chance.unwrap_or(unknown) }
        };
        let chances: Vec<f64> = candidates.iter().map(chance).collect();
        let mut ends = group::runs(&chances, self.knobs.most_together);
        ends.truncate(self.knobs.most_in_flight);
        let mut start = 0;
        for &end in &ends {
            self.frame.proxies.clear();
            for candidate in &candidates[start..end] {
                self.push_proxies(view, candidate.item, candidate.proxy);
            }
            pen.ask_any(&self.frame.proxies);
            start = end;
        }
        let room = self.knobs.most_in_flight - ends.len();
        let later = self.frame.due.split_off(room.min(self.frame.due.len()));
        let due = std::mem::replace(&mut self.frame.due, later);
        for part in &due {
            self.frame.proxies.clear();
            self.push_proxies(view, part.item, part.proxy);
            pen.ask_any(&self.frame.proxies);
        }
        let mut answers = Vec::new();
        pen.round_trip(&mut answers)?;
        let mut fates = vec![Fate::Unasked; candidates.len()];
        let mut start = 0;
        for (&end, answer) in ends.iter().zip(&answers) {
            fates[start..end].fill(match (answer.visible, end - start) {
                (false, _) => Fate::Hidden,
                (true, 1) => Fate::Shows,
                (true, _) => Fate::Again,
            });
            start = end;
        }
        for (part, answer) in due.iter().zip(&answers[ends.len()..]) {
            if answer.visible {
                self.seen(view, part.item);
                self.frame.opened.show(part.place);
            } else {
                self.hidden(view, part.item);
            }
        }
        for (candidate, fate) in candidates.into_iter().zip(fates) {
            let trusted =
                self.knobs.after_group == AfterGroup::Trust && self.scenery.is_part(candidate.item);
            match fate {
                Fate::Unasked => self.frame.candidates.push(candidate),
                Fate::Again if !trusted => {
                    self.frame.candidates.push(Candidate { alone: true, ..candidate });
                }
                Fate::Hidden => self.hidden(view, candidate.item),
                Fate::Shows | Fate::Again => {
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
        self.knobs.name
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
