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
//! `full-trusting` is the same with longer waits, believes a group that shows of all its parts, and
//! finds what shows among its nodes by halving: where questions are dear, as on the paper's device, it
//! trades parts and round trips for them.
//!
//! Departures: the paper's rule that questions with overlapping rectangles wait for one another is not
//! kept: what was visible last time is drawn before anything is asked, so the buffer is nearly whole,
//! and a wrong "visible" costs less than a round trip. Objects without a tree are nodes of their own.
//! It loses against `vfc` where little is hidden (`full-adaptive` does not).

use std::marker::PhantomData;

use super::layers::{FIRST_LAYER, next_layer};
use super::opened::{NO_PARENT, OpenedNodes};
use super::postponement::scatter;
use super::scenery::{Appearance, NodeHistory};
use super::{
    Culler, CullerSetup, Item, Pen, Postponement, Scenery, SceneryKnobs, Situation, View, group,
};
use crate::index::NodeId;
use crate::math::Aabb;
use crate::oracle::{OracleError, Proxy};

/// The rules of history that can be got wrong, as they are right. [`Sound`] keeps them all; others exist to
/// see that the bench notices. They are types, so that the culler pays nothing.
pub trait HistoryRules {
    /// A part whose question is postponed counts as visible meanwhile.
    const POSTPONED_SHOWS: bool = true;
    /// "Hidden" ends a row of "visible" answers.
    const HIDDEN_ENDS_STREAK: bool = true;
    /// What a node's old answer was is nothing to the nodes below it.
    const CHILDREN_STAND_ALONE: bool = true;
}

/// All rules kept.
#[derive(Clone, Copy, Debug)]
pub struct Sound;

impl HistoryRules for Sound {}

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
    /// Nodes that nothing is known of which the first batch asks about, at least 1; later batches ask about as
    /// many as parts are drawn.
    pub first_layer: usize,
    /// Whether to take tightened boxes.
    pub tighten: bool,
}

/// What becomes of nodes of which a question about several says that one shows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AfterGroup {
    /// Each is asked about alone.
    #[default]
    AskAgain,
    /// Parts are drawn; nodes are asked about by halves, the second only if the first does not explain
    /// what shows. So failing costs few questions, if more round trips, and groups are made larger.
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
            first_layer: FIRST_LAYER,
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
/// What trusting makes of the chance that a node comes into view, in making up groups: a failure costs
/// parts that were not hidden for sure anyway, and halving. In the bunnies this asks 4 % less than a
/// tenth and draws 4 % more.
const TRUSTING_DOUBT: f64 = 0.03;

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

impl NodeHistory for History {
    fn inherit(&mut self, below: &Self) {
        self.visible_after = self.visible_after.max(below.visible_after);
    }
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
}

/// Candidates in one question.
#[derive(Default)]
struct Group {
    nodes: Vec<Candidate>,
    /// Something shows in `nodes` or in these.
    rest: Vec<Candidate>,
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
    /// What is left of groups that show.
    groups: Vec<Group>,
    due: Vec<Due>,
    stack: Vec<(Item, usize)>,
    drawn_parts: usize,
    proxies: Vec<Proxy>,
}

impl Frame {
    /// Whether there is nothing left to ask about.
    fn settled(&self) -> bool {
        self.candidates.is_empty() && self.groups.is_empty() && self.due.is_empty()
    }
}

/// The paper's culler.
pub struct Full<R = Sound> {
    scenery: Scenery,
    knobs: FullKnobs,
    history: Vec<History>,
    frame: Frame,
    rules: PhantomData<R>,
}

impl Full {
    /// Over the index and partition of `setup`.
    ///
    /// # Panics
    /// If no question may be in flight, or none may stand in one, or a part has no box, or a layer no node.
    #[must_use]
    pub fn new(setup: CullerSetup, knobs: FullKnobs) -> Self {
        Self::by_rules(setup, knobs)
    }
}

impl<R: HistoryRules> Full<R> {
    /// The same by other rules.
    ///
    /// # Panics
    /// As [`Full::new`].
    #[must_use]
    pub fn by_rules(setup: CullerSetup, knobs: FullKnobs) -> Self {
        assert!(knobs.most_in_flight > 0, "at least one question must be in flight");
        assert!(knobs.most_together > 0, "a question is about at least one node");
        assert!(knobs.most_boxes > 0, "a part is asked about by at least one box");
        assert!(knobs.first_layer > 0, "a layer has at least one node");
        let scenery_knobs = SceneryKnobs { tighten: knobs.tighten, treeless_items: true };
        let scenery = Scenery::new(setup, scenery_knobs);
        let (history, frame, rules) = (Vec::new(), Frame::default(), PhantomData);
        Self { scenery, knobs, history, frame, rules }
    }

    /// Walks down from what is on the stack; draws what counts as visible, gathers the rest.
    fn walk(&mut self, view: &View<'_>, pen: &mut Pen<'_>) {
        while let Some((item, parent)) = self.frame.stack.pop() {
            let (proxy, depth) = match self.scenery.appearance(view, item) {
                Appearance::Nowhere => continue,
                Appearance::Certain => {
                    let boxed = self.scenery.clip_box(view, item).is_some();
                    let why = if boxed { Situation::Unprojectable } else { Situation::SticksOut };
                    pen.reached(why);
                    self.open(view, pen, item, parent, true);
                    continue;
                }
                Appearance::Ask { proxy, depth, .. } => (proxy, depth),
            };
            let history = self.history[self.scenery.slot(item)];
            let visible_last_time = view.frame > 0 && history.visible_after == view.frame;
            if !visible_last_time {
                if !R::CHILDREN_STAND_ALONE && self.was_hidden(view, parent) {
                    continue;
                }
                let chance = self.chance_hidden(view, item);
                let candidate = Candidate { item, proxy, depth, parent, chance };
                self.frame.candidates.push(candidate);
            } else if self.scenery.is_part(item) && view.frame >= history.ask_from {
                let place = self.open(view, pen, item, parent, false);
                self.frame.due.push(Due { item, proxy, place });
            } else if R::POSTPONED_SHOWS || !self.scenery.is_part(item) {
                if self.scenery.is_part(item) {
                    pen.reached(Situation::DrawnOnTrust);
                }
                self.open(view, pen, item, parent, true);
            }
        }
    }

    /// Whether the node at that place was found hidden in the frame before; for broken rules.
    fn was_hidden(&self, view: &View<'_>, place: usize) -> bool {
        let item = self.frame.opened.iter().nth(place).map(|opened| opened.item);
        let history = item.map(|item| self.history[self.scenery.slot(item)]);
        history.is_some_and(|history| view.frame > 0 && history.hidden_after == view.frame)
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
            streak: if R::HIDDEN_ENDS_STREAK { 0 } else { history.streak },
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
        let mut groups = self.next_groups(pen);
        self.frame.groups = groups.split_off(self.knobs.most_in_flight.min(groups.len()));
        for group in &groups {
            self.frame.proxies.clear();
            for candidate in &group.nodes {
                self.push_proxies(view, candidate.item, candidate.proxy);
            }
            pen.ask_about(group.nodes.iter().map(|node| node.item), &self.frame.proxies);
        }
        let room = self.knobs.most_in_flight - groups.len();
        let later = self.frame.due.split_off(room.min(self.frame.due.len()));
        if !(self.frame.groups.is_empty() && later.is_empty()) {
            pen.reached(Situation::BatchFull);
        }
        let due = std::mem::replace(&mut self.frame.due, later);
        for part in &due {
            self.frame.proxies.clear();
            self.push_proxies(view, part.item, part.proxy);
            pen.ask_about([part.item], &self.frame.proxies);
        }
        let mut answers = Vec::new();
        pen.round_trip(&mut answers)?;
        let (first, second) = answers.split_at(groups.len());
        for (part, answer) in due.iter().zip(second) {
            if answer.visible {
                self.seen(view, part.item);
                self.frame.opened.show(part.place);
            } else {
                pen.reached(Situation::PostponedHidden);
                self.hidden(view, part.item);
            }
        }
        for (Group { nodes, rest }, answer) in groups.into_iter().zip(first) {
            if answer.visible {
                self.some_show(view, pen, nodes);
                if !rest.is_empty() {
                    self.frame.groups.push(Group { nodes: rest, ..Group::default() });
                }
            } else {
                nodes.iter().for_each(|node| self.hidden(view, node.item));
                self.some_show(view, pen, rest);
            }
        }
        Ok(())
    }

    /// What is left of groups, and groups of the candidates whose turn it is.
    fn next_groups(&mut self, pen: &mut Pen<'_>) -> Vec<Group> {
        let mut groups = std::mem::take(&mut self.frame.groups);
        let candidates = std::mem::take(&mut self.frame.candidates);
        let new_depth = |c: &Candidate| c.chance.is_none().then_some(c.depth);
        let most = (self.knobs.first_layer, self.frame.drawn_parts);
        let (candidates, later) = next_layer(candidates, most, new_depth);
        if !later.is_empty() {
            pen.reached(Situation::LayerWaits);
        }
        self.frame.candidates = later;
        let unknown = group::chance_of_staying_hidden(0);
        let chances: Vec<f64> = candidates.iter().map(|c| c.chance.unwrap_or(unknown)).collect();
        let (mut candidates, mut start) = (candidates.into_iter(), 0);
        for end in group::runs(&chances, self.knobs.most_together) {
            let nodes = candidates.by_ref().take(end - start).collect();
            if end - start == self.knobs.most_together && end - start > 1 {
                pen.reached(Situation::GroupFull);
            }
            groups.push(Group { nodes, ..Group::default() });
            start = end;
        }
        groups
    }

    /// Walks what shows among `nodes`, of which at least one does, or asks further.
    fn some_show(&mut self, view: &View<'_>, pen: &mut Pen<'_>, mut nodes: Vec<Candidate>) {
        if nodes.len() > 1 {
            pen.reached(Situation::GroupSplit);
            if self.knobs.after_group == AfterGroup::AskAgain {
                let alone = |node| Group { nodes: vec![node], ..Group::default() };
                self.frame.groups.extend(nodes.into_iter().map(alone));
                return;
            }
            let others = nodes.extract_if(.., |node| !self.scenery.is_part(node.item));
            let mut others: Vec<Candidate> = others.collect();
            if !others.is_empty() {
                // Where nothing is taken for what shows, it is in one half or the other.
                let half = if nodes.is_empty() { others.len() / 2 } else { others.len() };
                let rest = others.split_off(half);
                self.frame.groups.push(Group { nodes: others, rest });
            }
        }
        for node in nodes {
            if node.chance.is_some() {
                pen.reached(Situation::HiddenShows);
            }
            self.seen(view, node.item);
            self.open(view, pen, node.item, node.parent, true);
            self.walk(view, pen);
        }
    }

    /// Pulls visibility up: what was opened and shows nothing counts as hidden from the next frame on.
    fn pull_up(&mut self, view: &View<'_>, pen: &mut Pen<'_>) {
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
                pen.reached(Situation::PulledUp);
                history.hidden_after = view.frame + 1;
                history.hidden_frames = 1;
            }
        }
    }
}

impl<R: HistoryRules> Culler for Full<R> {
    fn name(&self) -> &str {
        self.knobs.name
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame(view, &mut self.history);
        self.scenery.note_update(pen);
        self.frame = Frame::default();
        self.frame.stack.push((Item::Scene(NodeId(0)), NO_PARENT));
        self.walk(view, pen);
        while !self.frame.settled() {
            self.batch(view, pen)?;
        }
        self.pull_up(view, pen);
        Ok(())
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        self.scenery.check(boxes)
    }

    fn scenery(&self, _: u32) -> Option<&Scenery> {
        Some(&self.scenery)
    }

    fn recall(&self, view: &View<'_>, item: Item) -> Option<String> {
        let history = self.history.get(self.scenery.slot(item))?;
        (history.visible_after > view.frame && history.ask_from > view.frame + 1).then(|| {
            let (streak, from) = (history.streak, history.ask_from);
            format!("{streak} \"visible\" answers in a row: not asked about before frame {from}")
        })
    }
}
