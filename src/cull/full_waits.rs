//! `full-waits`, the algorithm of Kovalčík & Sochor 2006 (section 3, Algorithms 1 to 4) with its
//! waiting rule to the letter. `full` is the same method arranged for few round trips.
//!
//! 1. A list of *active nodes* of both levels, kept in front-to-back order: a visible node is replaced
//!    in place by its nearer child, its objects with trees, its farther child (Algorithm 4).
//! 2. Each pass over the list takes the answers of the pass before, then gives every node the
//!    `FirstVisibilityTest` (Algorithm 3): outside the frustum, certainly visible, invisible last time
//!    (ask), visible so often of late that the question is postponed, or ask.
//! 3. Questions of one pass are asked in parallel if their screen rectangles overlap neither one
//!    another nor a nearer node that still waits; the others stay in the list for the next pass.
//!    (The paper compares with issued queries only. Waiting behind a nearer *waiting* node as well
//!    keeps the farther one from being answered against a buffer that lacks the nearer.)
//! 4. At most [`FullWaitsKnobs::most_in_flight`] questions a pass.
//! 5. Tightened boxes for scene nodes whose contents stand still; lazy reconstruction is the index's.
//!
//! Departure: a node not seen in the frame before counts as invisible then, so history never outlives
//! a gap. Cost: passes × active nodes; a pass is one round trip to the device, and where rectangles
//! overlap much, as in a dense crowd, there are thousands of passes. The paper's device was polled and
//! had no such price.

use super::scenery::{Appearance, NodeHistory};
use super::{Culler, CullerSetup, Item, Pen, Postponement, Scenery, SceneryKnobs, Situation, View};
use crate::index::NodeId;
use crate::math::{Aabb, PixelRectangle};
use crate::oracle::{OracleError, QueryId};

/// What can be tuned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FullWaitsKnobs {
    /// Most questions in one pass, at least 1.
    pub most_in_flight: u32,
    /// How recent answers postpone questions.
    pub postponement: Postponement,
}

impl Default for FullWaitsKnobs {
    fn default() -> Self {
        // lavapipe counts right up to 640 queries a pass and is slow to begin one; see the device.
        Self { most_in_flight: 128, postponement: Postponement::default() }
    }
}

/// What is remembered of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct History {
    /// One more than the last frame in which the node was visible; 0 for never.
    visible_after: u32,
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

/// Where an active node stands.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// Not yet looked at.
    New,
    /// Looked at, may not be asked yet.
    Waiting(PixelRectangle, crate::oracle::Proxy),
    /// Asked.
    Asked(QueryId),
}

/// The paper's culler, to the letter.
pub struct FullWaits {
    scenery: Scenery,
    knobs: FullWaitsKnobs,
    history: Vec<History>,
}

/// Algorithm 3's three outcomes.
enum First {
    Invisible,
    Visible,
    NeedQuery(PixelRectangle, crate::oracle::Proxy),
}

impl FullWaits {
    /// Over the index and partition of `setup`.
    ///
    /// # Panics
    /// If no question may be in flight.
    #[must_use]
    pub fn new(setup: CullerSetup, knobs: FullWaitsKnobs) -> Self {
        assert!(knobs.most_in_flight > 0, "at least one question must be in flight");
        let scenery = Scenery::new(setup, SceneryKnobs { tighten: true, treeless_items: false });
        Self { scenery, knobs, history: Vec::new() }
    }

    /// Algorithm 3.
    fn first_visibility_test(&mut self, view: &View<'_>, item: Item) -> First {
        match self.scenery.appearance(view, item) {
            Appearance::Nowhere => First::Invisible,
            Appearance::Certain => {
                // Nothing was measured, so no streak grows from it.
                self.history[self.scenery.slot(item)].visible_after = view.frame + 1;
                First::Visible
            }
            Appearance::Ask { rectangle, proxy, .. } => {
                let history = &mut self.history[self.scenery.slot(item)];
                let visible_last_time = view.frame > 0 && history.visible_after == view.frame;
                if !visible_last_time {
                    history.streak = 0;
                    return First::NeedQuery(rectangle, proxy);
                }
                if view.frame < history.ask_from {
                    history.visible_after = view.frame + 1;
                    return First::Visible;
                }
                First::NeedQuery(rectangle, proxy)
            }
        }
    }

    fn remember(&mut self, view: &View<'_>, item: Item, visible: bool) {
        let history = &mut self.history[self.scenery.slot(item)];
        if visible {
            let wait = self.knobs.postponement.wait(history.streak);
            history.visible_after = view.frame + 1;
            history.ask_from = view.frame + 1 + wait;
            history.streak = history.streak.saturating_add(1);
        } else {
            *history = History::default();
        }
    }

    /// One pass over the active nodes: settles what was answered, looks at what is new, asks what may
    /// be asked. Returns the list for the next pass and whether anything was asked.
    fn pass(
        &mut self,
        view: &View<'_>,
        pen: &mut Pen<'_>,
        active: Vec<(Item, State)>,
        visible: &dyn Fn(QueryId) -> bool,
    ) -> (Vec<(Item, State)>, bool) {
        let mut stack = active;
        stack.reverse();
        let (mut kept, mut next) = (Vec::new(), Vec::new());
        let mut taken: Vec<PixelRectangle> = Vec::new();
        let mut asked = 0;
        while let Some((item, state)) = stack.pop() {
            let (rectangle, proxy) = match state {
                State::Asked(query) => {
                    let visible = visible(query);
                    self.remember(view, item, visible);
                    if visible {
                        self.expand(view, pen, item, &mut next, &mut stack);
                    }
                    continue;
                }
                State::Waiting(rectangle, proxy) => (rectangle, proxy),
                State::New => match self.first_visibility_test(view, item) {
                    First::Invisible => continue,
                    First::Visible => {
                        self.expand(view, pen, item, &mut next, &mut stack);
                        continue;
                    }
                    First::NeedQuery(rectangle, proxy) => (rectangle, proxy),
                },
            };
            if asked == self.knobs.most_in_flight {
                pen.reached(Situation::BatchFull);
            }
            let free = asked < self.knobs.most_in_flight
                && !taken.iter().any(|other| other.overlaps(&rectangle));
            taken.push(rectangle);
            kept.push((
                item,
                if free {
                    asked += 1;
                    State::Asked(pen.ask_about([item], &[proxy]))
                } else {
                    State::Waiting(rectangle, proxy)
                },
            ));
        }
        (kept, asked > 0)
    }

    fn expand(
        &self,
        view: &View<'_>,
        pen: &mut Pen<'_>,
        item: Item,
        next: &mut Vec<Item>,
        stack: &mut Vec<(Item, State)>,
    ) {
        self.scenery.expand(view, item, pen, next);
        stack.extend(next.drain(..).rev().map(|item| (item, State::New)));
    }
}

impl Culler for FullWaits {
    fn name(&self) -> &str {
        "full-waits"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.scenery.begin_frame(view, &mut self.history);
        self.scenery.note_update(pen);
        let mut active = vec![(Item::Scene(NodeId(0)), State::New)];
        let mut answers = Vec::new();
        while !active.is_empty() {
            // Answers come in asking order, so a query's number finds its place.
            let first = answers.first().map_or(0, |a: &crate::oracle::Answer| a.query.0);
            let visible = |query: QueryId| answers[(query.0 - first) as usize].visible;
            let (kept, asked) = self.pass(view, pen, active, &visible);
            assert!(asked || kept.is_empty(), "the nearest waiting node can always be asked");
            active = kept;
            answers.clear();
            if asked {
                pen.round_trip(&mut answers)?;
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

    fn recall(&self, view: &View<'_>, item: Item) -> Option<String> {
        let history = self.history.get(self.scenery.slot(item))?;
        (history.visible_after > view.frame && history.ask_from > view.frame + 1).then(|| {
            let (streak, from) = (history.streak, history.ask_from);
            format!("{streak} \"visible\" answers in a row: not asked about before frame {from}")
        })
    }
}
