//! `full-adaptive`: the method of Kovalčík & Sochor 2006 where its conclusion points, "work adaptively
//! according to the performance of the GPU (for example: on different graphic cards the cost of
//! occlusion query is different)". Every step is weighed by a cost model, and by it no frame costs more
//! than frustum culling alone but for [`ALLOWANCE`].
//!
//! 1. Walk both levels front to back (their Algorithms 2 to 4). Inner nodes that were visible last
//!    time are opened; parts that were visible last time *show*; the rest is unknown.
//! 2. Of what shows the nearest are drawn unasked, [`UNASKED`] of the work: they hide most. Where
//!    nothing shows (a first frame, a turn) the nearest part is searched for and drawn, and what nothing
//!    is known of is asked about in layers.
//! 3. The rest of what shows is asked about before it is drawn, then the unknown, one batch each; with
//!    the unknown those drawn parts whose answer may spare work in the next frames. A question costs
//!    what the model says; what it may save is the work behind it times the odds of "hidden", learned
//!    as answers come. Questions that do not pay are not asked, nor is a batch that does not pay for its
//!    round trip and for the wait ([`DRAIN`]); what they were about is drawn.
//! 4. What a batch finds visible is drawn, at most as much as was drawn before it and the nearest of it:
//!    the rest may be hidden by it and is asked about once more. What is drawn together is drawn in the
//!    order of the walk: by their nearest corners, large parts would come before what hides them.
//! 5. Questions in a frame may cost no more than they surely saved in it ([`SURELY_SAVED`]), and the allowance
//!    of what frustum culling would cost (step 4 of the walk adds that up). So the bound holds for
//!    virtual time by construction, and for wall time as far as the model is true.
//!
//! Parts are asked about by their several boxes. It loses to `full` where the model is wrong.

use super::layers::{FIRST_LAYER, next_layer};
use super::opened::{NO_PARENT, OpenedNodes};
use super::scenery::{Appearance, NodeHistory};
use super::{Culler, CullerSetup, Item, Pen, Scenery, SceneryKnobs, Situation, View};
use crate::index::NodeId;
use crate::math::Aabb;
use crate::oracle::{CostModel, OracleError, Proxy};

/// Share of the cost of frustum culling that questions may waste in a frame. On lavapipe they waste two
/// to three times what the model says: see [`DRAIN`].
const ALLOWANCE: f64 = 0.03;
/// Share of the work of what was visible last time that is drawn unasked. In the plant and the bunnies
/// 0.3 to 0.7 draw within 3 % of the same and 0.8 up to 8 % more, in one batch less: lavapipe's threads
/// work together only within one, and it takes no longer.
const UNASKED: f64 = 0.8;
/// Share of the work drawn since the last round trip that waiting for one costs beyond the model's
/// price: the device must finish it first, and has nothing else to do meanwhile. Seen on lavapipe: a
/// frame of 110 ms takes 6 to 13 ms longer for a single round trip with 50 questions.
const DRAIN: f64 = 0.1;
/// Share of what was found hidden that counts as saved when further questions are paid from it. The
/// model knows a mean price; in a near view of the plant leaving out a third of the triangles, all
/// hidden, saved a tenth of the time.
const SURELY_SAVED: f64 = 0.6;
/// Levels of unknown nodes that are gone down between two batches where a node in view was opened, where
/// nothing else is said: a batch costs as much as many questions.
const LEVELS_A_BATCH: u32 = 2;
/// Share of a part's work that asking about several boxes in the place of one may cost: against sixteen
/// boxes a tenth to a quarter of the parts that one box lets pass are hidden (see `part::boxes`).
const TIGHTNESS: f64 = 0.1;
/// Answers that what was learned of a kind of node weighs against what is assumed of it.
const ASSUMED_ANSWERS: f64 = 8.0;
/// What is left of an answer's weight a frame later.
const MEMORY: f64 = 0.75;

/// What can be tuned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdaptiveKnobs {
    /// Nodes that nothing is known of which the first batch asks about, at least 1; later batches ask about as
    /// many as parts are drawn.
    pub first_layer: usize,
    /// Levels of unknown nodes that are gone down between two batches.
    pub levels_a_batch: u32,
    /// Share of the work of what was visible last time that is drawn unasked, from 0 to 1.
    pub unasked: f64,
    /// Share of the cost of frustum culling that questions may waste in a frame, at least 0.
    pub allowance: f64,
}

impl Default for AdaptiveKnobs {
    fn default() -> Self {
        Self {
            first_layer: FIRST_LAYER,
            levels_a_batch: LEVELS_A_BATCH,
            unasked: UNASKED,
            allowance: ALLOWANCE,
        }
    }
}

/// What is known of a node before it is asked about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Visible last time, or said to show in this frame.
    Shows,
    /// Hidden last time.
    WasHidden,
    /// Neither.
    New,
}

/// The odds of "hidden" for one kind of node.
#[derive(Clone, Copy, Debug)]
struct Odds {
    assumed: f64,
    hidden: f64,
    asked: f64,
}

impl Odds {
    fn new(assumed: f64) -> Self {
        Self { assumed, hidden: 0.0, asked: 0.0 }
    }

    fn learn(&mut self, hidden: bool) {
        self.asked += 1.0;
        self.hidden += f64::from(u8::from(hidden));
    }

    /// A frame later. What is no longer asked about is forgotten, and so asked about again.
    fn forget(&mut self) {
        self.asked *= MEMORY;
        self.hidden *= MEMORY;
    }

    fn hidden(&self) -> f64 {
        (self.assumed * ASSUMED_ANSWERS + self.hidden) / (ASSUMED_ANSWERS + self.asked)
    }
}

/// What is remembered of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct History {
    /// One more than the last frame in which the node was visible; 0 for never.
    visible_after: u32,
    /// One more than the last frame in which it was found hidden; 0 for never.
    hidden_after: u32,
    /// One more than the last frame in which it was asked about; 0 for never.
    asked_after: u32,
}

impl NodeHistory for History {
    fn inherit(&mut self, below: &Self) {
        self.visible_after = self.visible_after.max(below.visible_after);
    }
}

/// A node that was reached and not yet settled.
#[derive(Clone, Copy, Debug)]
struct Pending {
    item: Item,
    proxy: Proxy,
    /// How near it can be.
    depth: f32,
    /// The place in `opened` of the node it was reached from.
    parent: usize,
    kind: Kind,
    /// Its place in the order of the walk.
    turn: u32,
    /// Nanoseconds that drawing what is in the frustum of it would take.
    work_ns: f64,
}

/// A drawn part that nothing was asked about since.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    item: Item,
    proxy: Proxy,
    /// Its own place in `opened`.
    place: usize,
    work_ns: f64,
}

/// What to ask about, a run of the pool, and what that costs, its round trip apart.
#[derive(Clone, Debug)]
struct Question {
    proxies: std::ops::Range<usize>,
    price: f64,
}

/// What a frame spent and saved, in nanoseconds.
#[derive(Clone, Copy, Debug, Default)]
struct Account {
    /// Drawing everything in the frustum.
    everything: f64,
    /// Drawn so far.
    drawn: f64,
    /// Questions and round trips.
    asked: f64,
    /// Found hidden.
    saved: f64,
    /// Drawn before the last round trip.
    drained: f64,
}

impl Account {
    /// What it costs to wait for answers before more is drawn, beside the model's price.
    fn drain(&self) -> f64 {
        DRAIN * (self.drawn - self.drained)
    }

    /// What the next batch may cost.
    fn purse(&self, allowance: f64) -> f64 {
        allowance * self.everything + SURELY_SAVED * self.saved - self.asked
    }
}

/// The adaptive culler.
pub struct Adaptive {
    scenery: Scenery,
    knobs: AdaptiveKnobs,
    model: CostModel,
    history: Vec<History>,
    shows: Odds,
    was_hidden: Odds,
    new: Odds,
    opened: OpenedNodes,
    pending: Vec<Pending>,
    drawn: Vec<Drawn>,
    drawn_parts: usize,
    turns: u32,
    stack: Vec<(Item, usize)>,
    account: Account,
    proxies: Vec<Proxy>,
}

impl Adaptive {
    /// Over the index and partition of `setup`, by its cost model.
    ///
    /// # Panics
    /// If a layer has no node.
    #[must_use]
    pub fn new(setup: CullerSetup, knobs: AdaptiveKnobs) -> Self {
        assert!(knobs.first_layer > 0, "a layer has at least one node");
        let model = setup.cost.clone();
        Self {
            scenery: Scenery::new(setup, SceneryKnobs { tighten: true, treeless_items: true }),
            knobs,
            model,
            history: Vec::new(),
            // What was visible mostly stays so and what was hidden too; of the rest nothing is known.
            shows: Odds::new(0.15),
            was_hidden: Odds::new(0.9),
            new: Odds::new(0.5),
            opened: OpenedNodes::default(),
            pending: Vec::new(),
            drawn: Vec::new(),
            drawn_parts: 0,
            turns: 0,
            stack: Vec::new(),
            account: Account::default(),
            proxies: Vec::new(),
        }
    }

    fn odds(&mut self, kind: Kind) -> &mut Odds {
        match kind {
            Kind::Shows => &mut self.shows,
            Kind::WasHidden => &mut self.was_hidden,
            Kind::New => &mut self.new,
        }
    }

    /// Walks down from what is on the stack: opens what was visible last time, gathers the rest.
    fn walk(&mut self, view: &View<'_>, pen: &mut Pen<'_>) {
        while let Some((item, parent)) = self.stack.pop() {
            let (proxy, depth) = match self.scenery.appearance(view, item) {
                Appearance::Nowhere => continue,
                Appearance::Certain => {
                    self.open_certain(view, pen, item, parent);
                    continue;
                }
                Appearance::Ask { proxy, depth, .. } => (proxy, depth),
            };
            let history = self.history[self.scenery.slot(item)];
            let lately = |after: u32| view.frame > 0 && after == view.frame;
            let is_part = self.scenery.is_part(item);
            // A part that was drawn and never asked about is as good as new.
            let known = !is_part || history.asked_after > history.hidden_after;
            let kind = match history {
                h if lately(h.visible_after) && known => Kind::Shows,
                h if lately(h.hidden_after) => Kind::WasHidden,
                _ => Kind::New,
            };
            if kind == Kind::Shows && !is_part {
                self.open(view, pen, item, parent);
            } else {
                let weight = self.scenery.weight_inside(view, item);
                let work_ns = self.model.drawing_ns(weight.parts, weight.triangles);
                let turn = self.turns;
                self.turns += 1;
                self.pending.push(Pending { item, proxy, depth, parent, kind, turn, work_ns });
            }
        }
    }

    fn open(&mut self, view: &View<'_>, pen: &mut Pen<'_>, item: Item, parent: usize) -> usize {
        self.opened.open(&self.scenery, view, pen, (item, parent), &mut self.stack)
    }

    /// Opens what is visible without a question.
    fn open_certain(&mut self, view: &View<'_>, pen: &mut Pen<'_>, item: Item, parent: usize) {
        let place = self.open(view, pen, item, parent);
        if self.scenery.is_part(item) {
            let weight = self.scenery.weight(item);
            let work_ns = self.model.drawing_ns(weight.parts, weight.triangles);
            self.account.everything += work_ns;
            self.account.drawn += work_ns;
            self.opened.show(place);
        }
    }

    /// Draws a part that may show.
    fn draw(&mut self, view: &View<'_>, pen: &mut Pen<'_>, part: Pending) {
        let Pending { item, proxy, parent, work_ns, .. } = part;
        let place = self.open(view, pen, item, parent);
        self.account.drawn += work_ns;
        self.drawn_parts += 1;
        self.drawn.push(Drawn { item, proxy, place, work_ns });
    }

    /// Draws the nearest of what shows, up to so much work, in the order of the walk.
    fn draw_nearest(&mut self, view: &View<'_>, pen: &mut Pen<'_>, most_ns: f64) {
        let shows = |pending: &Pending| pending.kind == Kind::Shows;
        self.pending.sort_by(|a, b| shows(b).cmp(&shows(a)).then(a.depth.total_cmp(&b.depth)));
        let (mut sum, mut count) = (0.0, 0);
        while count < self.pending.len() && shows(&self.pending[count]) && sum < most_ns {
            sum += self.pending[count].work_ns;
            count += 1;
        }
        let mut parts: Vec<Pending> = self.pending.drain(..count).collect();
        parts.sort_unstable_by_key(|part| part.turn);
        parts.into_iter().for_each(|part| self.draw(view, pen, part));
    }

    /// Where nothing is drawn yet: goes down to the nearest parts and draws them, up to so much work.
    fn find_nearest(&mut self, view: &View<'_>, pen: &mut Pen<'_>, most_ns: f64) {
        while self.account.drawn < most_ns {
            let depths = self.pending.iter().map(|pending| pending.depth).enumerate();
            let Some((nearest, _)) = depths.min_by(|a, b| a.1.total_cmp(&b.1)) else { return };
            let pending = self.pending.remove(nearest);
            if self.scenery.is_part(pending.item) {
                self.draw(view, pen, pending);
            } else {
                self.open(view, pen, pending.item, pending.parent);
                self.walk(view, pen);
            }
        }
    }

    /// Opens these, and all below them, without a question, the nearest first: what is drawn later than
    /// what it is hidden by costs less. What was pending stays so.
    fn open_all(&mut self, view: &View<'_>, pen: &mut Pen<'_>, mut these: Vec<Pending>) {
        let others = std::mem::take(&mut self.pending);
        these.sort_by(|a, b| b.depth.total_cmp(&a.depth));
        while let Some(pending) = these.pop() {
            if self.scenery.is_part(pending.item) {
                self.draw(view, pen, pending);
            } else {
                self.open(view, pen, pending.item, pending.parent);
                self.walk(view, pen);
                these.extend(self.pending.drain(..).rev());
            }
        }
        self.pending = others;
    }

    /// Puts what to ask about a node into the pool. As many boxes as cost no more than
    /// [`TIGHTNESS`] of the work.
    fn question(&mut self, view: &View<'_>, item: Item, proxy: Proxy, work_ns: f64) -> Question {
        let affordable = TIGHTNESS * work_ns / self.model.proxy_ns.max(f64::MIN_POSITIVE);
        let first = self.proxies.len();
        // The cast saturates; no part has so many boxes.
        let about = (proxy, affordable as usize);
        self.scenery.tightest_proxies(view, item, about, &mut self.proxies);
        let proxies = first..self.proxies.len();
        let run = &self.proxies[proxies.clone()];
        let pixels = run.iter().map(Proxy::pixels).sum();
        let price = self.model.asking_ns(1, run.len() as u64, pixels);
        Question { proxies, price }
    }

    /// The odds that a part drawn unasked is hidden: they grow with the frames since it was asked about
    /// (the paper postpones by its Figure 3; here the odds themselves are learned, and where nothing
    /// ever goes out of sight they fall until questions no longer pay).
    fn odds_of_drawn(&self, view: &View<'_>, item: Item) -> f64 {
        let history = self.history[self.scenery.slot(item)];
        let unasked = view.frame + 1 - history.asked_after.min(view.frame);
        (self.shows.hidden() * f64::from(unasked)).min(1.0)
    }

    /// Picks from `pending` what is to be asked about, the best first, as many as pay and the purse
    /// holds; what is left stays. `None` where they do not pay for a round trip; then all of them
    /// stay pending.
    fn pick(&mut self, view: &View<'_>, pending: Vec<Pending>, due: bool) -> Option<Batch> {
        self.proxies.clear();
        let trip = self.model.trip_ns;
        let mut purse = self.account.purse(self.knobs.allowance) - trip;
        // Nothing is left to draw after a batch about what is drawn.
        let mut gain = -trip - if pending.is_empty() { 0.0 } else { self.account.drain() };
        let mut valued: Vec<(f64, Question, Pending)> = Vec::with_capacity(pending.len());
        for p in pending {
            let question = self.question(view, p.item, p.proxy, p.work_ns);
            let net = self.odds(p.kind).hidden() * p.work_ns - question.price;
            valued.push((net, question, p));
        }
        valued.sort_by(|a, b| b.0.total_cmp(&a.0));
        let mut batch = Batch::default();
        for (net, question, pending) in valued {
            if net <= 0.0 {
                batch.left.push(pending);
            } else if question.price <= purse {
                purse -= question.price;
                gain += net;
                batch.asked.push((question, pending));
            } else {
                batch.later.push(pending);
            }
        }
        for place in 0..if due { self.drawn.len() } else { 0 } {
            let drawn = self.drawn[place];
            let question = self.question(view, drawn.item, drawn.proxy, drawn.work_ns);
            let net = self.odds_of_drawn(view, drawn.item) * drawn.work_ns - question.price;
            if net > 0.0 && question.price <= purse {
                purse -= question.price;
                gain += net;
                batch.due.push((question, drawn));
            }
        }
        if gain > 0.0 {
            return Some(batch);
        }
        self.pending.extend(batch.asked.into_iter().map(|(_, pending)| pending));
        self.pending.append(&mut batch.left);
        self.pending.append(&mut batch.later);
        None
    }

    /// One round trip.
    fn settle(
        &mut self,
        view: &View<'_>,
        pen: &mut Pen<'_>,
        batch: &Batch,
    ) -> Result<(), OracleError> {
        let asked = batch.asked.iter().map(|(question, pending)| (question, pending.item));
        let due = batch.due.iter().map(|(question, drawn)| (question, drawn.item));
        if !batch.later.is_empty() {
            pen.reached(Situation::PurseEmpty);
        }
        for (question, item) in asked.chain(due) {
            pen.ask_about([item], &self.proxies[question.proxies.clone()]);
            self.account.asked += question.price;
        }
        let mut answers = Vec::new();
        pen.round_trip(&mut answers)?;
        self.account.asked += self.model.trip_ns;
        self.account.drained = self.account.drawn;
        let (first, later) = answers.split_at(batch.asked.len());
        for ((_, drawn), answer) in batch.due.iter().zip(later) {
            self.note(view, drawn.item, Kind::Shows, answer.visible);
            if answer.visible {
                self.opened.show(drawn.place);
            }
        }
        if !batch.due.is_empty() {
            // Due were drawn: an answer "hidden" must not be overruled at the end of the frame.
            let due: Vec<usize> = batch.due.iter().map(|(_, drawn)| drawn.place).collect();
            self.drawn.retain(|drawn| due.binary_search(&drawn.place).is_err());
        }
        for ((_, pending), answer) in batch.asked.iter().zip(first) {
            self.note(view, pending.item, pending.kind, answer.visible);
            if !answer.visible {
                self.account.saved += pending.work_ns;
            } else if self.scenery.is_part(pending.item) {
                self.pending.push(Pending { kind: Kind::Shows, ..*pending });
            } else {
                self.open(view, pen, pending.item, pending.parent);
                self.descend(view, pen);
                self.walk(view, pen);
            }
        }
        Ok(())
    }

    /// Goes some levels down through new nodes below one that shows.
    fn descend(&mut self, view: &View<'_>, pen: &mut Pen<'_>) {
        for _ in 0..self.knobs.levels_a_batch {
            for (item, parent) in std::mem::take(&mut self.stack) {
                let history = self.history[self.scenery.slot(item)];
                let known = history.visible_after.max(history.hidden_after) >= view.frame.max(1);
                let stays = self.scenery.is_part(item)
                    || known
                    || !matches!(self.scenery.appearance(view, item), Appearance::Ask { .. });
                if stays {
                    self.stack.push((item, parent));
                } else {
                    self.open(view, pen, item, parent);
                }
            }
        }
    }

    /// Remembers an answer.
    fn note(&mut self, view: &View<'_>, item: Item, kind: Kind, visible: bool) {
        self.odds(kind).learn(!visible);
        let slot = self.scenery.slot(item);
        let history = &mut self.history[slot];
        history.asked_after = view.frame + 1;
        if !visible {
            history.hidden_after = view.frame + 1;
        }
    }

    /// Batch after batch until nothing is pending.
    fn batches(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        while !(self.pending.is_empty() && self.drawn.is_empty()) {
            let pending = std::mem::take(&mut self.pending);
            let (showing, unknown): (Vec<Pending>, Vec<Pending>) =
                pending.into_iter().partition(|pending| pending.kind == Kind::Shows);
            if !showing.is_empty() {
                match self.pick(view, showing, false) {
                    Some(mut batch) => {
                        let left = std::mem::take(&mut batch.left);
                        self.open_all(view, pen, left);
                        self.settle(view, pen, &batch)?;
                        self.pending.append(&mut batch.later);
                    }
                    None => self.draw_nearest(view, pen, f64::INFINITY),
                }
                self.draw_nearest(view, pen, self.account.drawn);
                self.pending.extend(unknown);
                continue;
            }
            let new_depth = |p: &Pending| (p.kind == Kind::New).then_some(p.depth);
            let most = (self.knobs.first_layer, self.drawn_parts);
            let (layer, mut farther) = next_layer(unknown, most, new_depth);
            if !farther.is_empty() {
                pen.reached(Situation::LayerWaits);
            }
            let Some(mut batch) = self.pick(view, layer, true) else {
                let these = std::mem::take(&mut self.pending);
                self.open_all(view, pen, these);
                self.pending.append(&mut farther);
                if self.pending.is_empty() {
                    break;
                }
                continue;
            };
            self.pending.append(&mut farther);
            let asked = self.account.drawn;
            self.settle(view, pen, &batch)?;
            self.draw_nearest(view, pen, asked);
            self.pending.append(&mut batch.later);
            // What is not worth a question is opened behind what is known.
            self.open_all(view, pen, batch.left);
        }
        Ok(())
    }
}

/// What goes to the device together.
#[derive(Default)]
struct Batch {
    asked: Vec<(Question, Pending)>,
    /// Drawn parts, ascending by their places.
    due: Vec<(Question, Drawn)>,
    /// What is not worth a question.
    left: Vec<Pending>,
    /// What there was no purse for; what is found hidden fills it.
    later: Vec<Pending>,
}

impl Culler for Adaptive {
    fn name(&self) -> &str {
        "full-adaptive"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame(view, &mut self.history);
        self.scenery.note_update(pen);
        for odds in [&mut self.shows, &mut self.was_hidden, &mut self.new] {
            odds.forget();
        }
        self.opened.clear();
        self.pending.clear();
        self.drawn.clear();
        self.drawn_parts = 0;
        self.turns = 0;
        self.account = Account { everything: self.model.frame_ns, ..Account::default() };
        self.stack.push((Item::Scene(NodeId(0)), NO_PARENT));
        self.walk(view, pen);
        self.account.everything += self.pending.iter().map(|p| p.work_ns).sum::<f64>();
        let showing = self.pending.iter().filter(|p| p.kind == Kind::Shows);
        let showing: f64 = showing.map(|p| p.work_ns).sum();
        self.draw_nearest(view, pen, showing * self.knobs.unasked);
        // As much work as a round trip costs, so that the first batch has something to ask against.
        self.find_nearest(view, pen, self.model.trip_ns);
        self.batches(view, pen)?;
        for drawn in std::mem::take(&mut self.drawn) {
            self.opened.show(drawn.place);
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
