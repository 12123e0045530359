//! The audit of a frame: every promise that a culler makes on its way, held against the frame and its truth,
//! whether or not the picture would show that one was broken. Most mistakes are seen here long before
//! something that shows is missing: a node that is forgotten mostly hides nothing.
//!
//! 1. **Nothing is dropped.** From the root down, a node that holds anything was walked into, or was said to
//!    be hidden, or can be on no sample; a part that was walked into was drawn.
//! 2. **Hidden is hidden.** Nothing below a node of which an answer said "hidden" shows, drawn or not: what
//!    was drawn before the question was no more than the frame has.
//! 3. **Errors are passed up.** The error of a node of the index is no less than that of anything below it.
//! 4. **Errors hold.** Clip coordinates of drawn positions, in f32 as renderers take them, are within the
//!    object's bounds of those of exact arithmetic, axis by axis.
//! 5. **Bounds hold what shows.** Of every node of which something shows, the rectangle and what would be
//!    asked about cover the outermost samples and the nearest one, and are nowhere farther.
//!
//! Not every frame is held to the last two: the fifth costs a look at every sample. It must not know the checks.

use glam::DVec3;

use super::{FrameState, Truth, World};
use crate::cull::Item;
use crate::cull::{Appearance, Journal, Scenery, View};
use crate::index::NodeId;
use crate::math::{HULL_SUBPIXELS, PixelRectangle};
use crate::oracle::Proxy;
use crate::part::{ObjectId, PartId};

/// One frame in so many is held to its bounds.
const BOUNDS_ONE_IN: u32 = 2;
/// Positions of a mesh that are held to the errors of their clip coordinates, about.
const POSITIONS: usize = 8;
/// Boxes by which parts are asked about in turn, from bound to bound.
const BOXES: [usize; 3] = [1, 4, 16];

/// What a culler did in a frame.
pub(super) struct Deeds<'a> {
    pub(super) scenery: &'a Scenery,
    pub(super) journal: &'a Journal,
    pub(super) drawn: &'a [PartId],
}

/// Whether the frame is one of those that are held to their bounds.
pub(super) fn looks_closely(state: &FrameState) -> bool {
    state.moment.frame % BOUNDS_ONE_IN == 1
}

/// Holds every promise against a frame.
///
/// # Errors
/// The first broken promise, in words.
pub(super) fn audit(
    world: &World,
    state: &FrameState,
    truth: &Truth,
    deeds: &Deeds<'_>,
) -> Result<(), String> {
    let audit = Audit::new(world, state, truth, deeds);
    audit.nothing_is_dropped()?;
    audit.hidden_is_hidden()?;
    audit.errors_are_passed_up()?;
    if looks_closely(state) {
        audit.errors_hold(&state.matrices)?;
        audit.bounds_hold()?;
    }
    Ok(())
}

/// Samples of something that shows: the outermost in eight directions, and the nearest.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Column, row and depth, by direction.
    outermost: [(u32, u32, f32); DIRECTIONS.len()],
    nearest: (u32, u32, f32),
}

/// Across and down.
const DIRECTIONS: [[i64; 2]; 8] =
    [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, 1], [1, -1], [-1, -1]];

impl Seen {
    fn one(sample: (u32, u32, f32)) -> Self {
        Self { outermost: [sample; DIRECTIONS.len()], nearest: sample }
    }

    fn merge(&mut self, other: &Self) {
        for (direction, (own, theirs)) in
            DIRECTIONS.iter().zip(self.outermost.iter_mut().zip(&other.outermost))
        {
            let along = |&(x, y, _): &(u32, u32, f32)| {
                direction[0] * i64::from(x) + direction[1] * i64::from(y)
            };
            if along(theirs) > along(own) {
                *own = *theirs;
            }
        }
        if other.nearest.2 < self.nearest.2 {
            self.nearest = other.nearest;
        }
    }

    fn samples(&self) -> impl Iterator<Item = (u32, u32, f32)> {
        self.outermost.into_iter().chain([self.nearest])
    }
}

fn merged(into: &mut Option<Seen>, other: &Seen) {
    match into {
        Some(seen) => seen.merge(other),
        None => *into = Some(*other),
    }
}

/// Whether an error is no less than another that it is to hold; one that is no number holds all.
fn covers_error(has: f64, needs: f64) -> bool {
    has >= needs || has.is_nan()
}

/// Whether a triangle of the fan from the first corner holds a place: what of a hull is drawn. Its corners are
/// rounded, so that it need not be convex to the last sub-pixel.
fn fan_holds(corners: &[[i32; 2]], at: [i32; 2]) -> bool {
    let side = |from: [i32; 2], to: [i32; 2]| {
        let wide = |i: usize, end: [i32; 2]| i64::from(end[i]) - i64::from(from[i]);
        wide(0, to) * wide(1, at) - wide(0, at) * wide(1, to)
    };
    corners.windows(2).skip(1).any(|pair| {
        let round = [(corners[0], pair[0]), (pair[0], pair[1]), (pair[1], corners[0])];
        let sides = round.map(|(from, to)| side(from, to));
        sides.iter().all(|side| *side >= 0) || sides.iter().all(|side| *side <= 0)
    })
}

/// Whether a proxy is at that sample and no farther.
fn covers(proxy: &Proxy, (x, y, stored): (u32, u32, f32)) -> bool {
    match proxy {
        Proxy::Rectangle { min, max, depth } => {
            (min[0]..max[0]).contains(&x) && (min[1]..max[1]).contains(&y) && *depth <= stored
        }
        Proxy::Hull { hull, depth, .. } => {
            let middle = [x, y].map(|at| at as i32 * HULL_SUBPIXELS + HULL_SUBPIXELS / 2);
            fan_holds(hull.corners(), middle) && *depth <= stored
        }
        // What it covers is known to renderers alone.
        Proxy::Box { .. } => true,
    }
}

struct Audit<'a> {
    world: &'a World,
    truth: &'a Truth,
    deeds: &'a Deeds<'a>,
    view: View<'a>,
    /// By slot.
    opened: Vec<bool>,
    hidden: Vec<bool>,
    /// By part.
    drawn: Vec<bool>,
}

impl<'a> Audit<'a> {
    fn new(
        world: &'a World,
        state: &'a FrameState,
        truth: &'a Truth,
        deeds: &'a Deeds<'a>,
    ) -> Self {
        let Deeds { scenery, journal, drawn: parts } = deeds;
        let slots = scenery.slot_count();
        let (mut opened, mut hidden) = (vec![false; slots], vec![false; slots]);
        journal.opened.iter().for_each(|&item| opened[scenery.slot(item)] = true);
        for question in journal.questions.iter().filter(|q| q.visible == Some(false)) {
            question.items.iter().for_each(|&item| hidden[scenery.slot(item)] = true);
        }
        let mut drawn = vec![false; world.partition.part_count() as usize];
        parts.iter().for_each(|part| drawn[part.0 as usize] = true);
        Self { world, truth, deeds, view: state.view(world), opened, hidden, drawn }
    }

    fn scenery(&self) -> &Scenery {
        self.deeds.scenery
    }

    /// The parts at and below a node of an object.
    fn parts(&self, object: ObjectId, node: u32) -> std::ops::Range<usize> {
        let first = self.world.partition.first_part(object).0;
        let (low, high) = match &self.world.partition.mesh(object).tree {
            Some(tree) => {
                let node = &tree.nodes[node as usize];
                (node.first_part, node.end_part)
            }
            None => (0, 1),
        };
        (first + low) as usize..(first + high) as usize
    }

    fn nothing_is_dropped(&self) -> Result<(), String> {
        let (scenery, index) = (self.scenery(), self.scenery().index());
        let mut stack = vec![Item::Scene(NodeId(0))];
        let mut children = Vec::new();
        while let Some(item) = stack.pop() {
            let slot = scenery.slot(item);
            if !self.opened[slot] {
                if self.hidden[slot]
                    || matches!(scenery.appearance(&self.view, item), Appearance::Nowhere)
                {
                    continue;
                }
                return Err(format!("{item:?} is in view, and neither walked into nor hidden"));
            }
            match item {
                Item::Scene(node) => {
                    children.clear();
                    index.children(node, self.view.camera.eye, &mut children);
                    stack.extend(children.iter().map(|&child| Item::Scene(child)));
                    for &object in index.node(node).objects {
                        let item = Item::Object(object, 0);
                        if scenery.treeless_items() || !scenery.is_part(item) {
                            stack.push(item);
                        } else if !self.view.object_outside_frustum(object.0) {
                            self.is_drawn(item)?;
                        }
                    }
                }
                Item::Object(..) if scenery.is_part(item) => self.is_drawn(item)?,
                Item::Object(object, node) => {
                    let tree = self.world.partition.mesh(object).tree.as_ref();
                    let below = tree.and_then(|tree| tree.nodes[node as usize].children);
                    stack.extend(below.into_iter().flatten().map(|c| Item::Object(object, c)));
                }
            }
        }
        Ok(())
    }

    fn is_drawn(&self, item: Item) -> Result<(), String> {
        let Item::Object(object, node) = item else { return Ok(()) };
        match self.drawn[self.parts(object, node)].contains(&false) {
            true => Err(format!("{item:?} was walked into and not drawn")),
            false => Ok(()),
        }
    }

    fn hidden_is_hidden(&self) -> Result<(), String> {
        let mut by_node: Option<Vec<bool>> = None;
        for question in self.deeds.journal.questions.iter().filter(|q| q.visible == Some(false)) {
            for &item in &question.items {
                let shows = match item {
                    Item::Object(object, node) => self.any_shows(object, node),
                    Item::Scene(node) => {
                        by_node.get_or_insert_with(|| self.shows_by_node())[node.0 as usize]
                    }
                };
                if shows {
                    let number = question.query.0;
                    return Err(format!(
                        "question {number} about {item:?} was answered \"hidden\", and it shows"
                    ));
                }
            }
        }
        Ok(())
    }

    fn any_shows(&self, object: ObjectId, node: u32) -> bool {
        self.truth.visible_pixels[self.parts(object, node)].iter().any(|&pixels| pixels > 0)
    }

    /// By node of the index, whether anything at or below it shows.
    fn shows_by_node(&self) -> Vec<bool> {
        let index = self.scenery().index();
        let mut shows = vec![false; index.node_count() as usize];
        for &node in index.top_down().iter().rev() {
            let own = index.node(node).objects.iter().any(|&object| self.any_shows(object, 0));
            shows[node.0 as usize] |= own;
            if let Some(parent) = index.parent(node) {
                shows[parent.0 as usize] |= shows[node.0 as usize];
            }
        }
        shows
    }

    fn errors_are_passed_up(&self) -> Result<(), String> {
        let (scenery, index) = (self.scenery(), self.scenery().index());
        for &node in index.top_down().iter() {
            let has = scenery.node_error(node).bound;
            let no_less =
                |needs: [f64; 4]| has.iter().zip(needs).all(|(has, n)| covers_error(*has, n));
            let objects = index.node(node).objects.iter();
            let own = objects.map(|object| self.view.objects[object.0 as usize].error.bound);
            let at_parent = index.parent(node).map(|parent| scenery.node_error(parent).bound);
            let passed = at_parent.is_none_or(|above| {
                above.iter().zip(has).all(|(above, has)| covers_error(*above, has))
            });
            if !(passed && own.into_iter().all(no_less)) {
                return Err(format!("node {} has less error than what is in it", node.0));
            }
        }
        Ok(())
    }

    fn errors_hold(&self, matrices: &[[f32; 16]]) -> Result<(), String> {
        for (number, (seen, m)) in self.view.objects.iter().zip(matrices).enumerate() {
            let positions = &self.world.partition.mesh(ObjectId(number as u32)).positions;
            let apart = positions.len().div_ceil(POSITIONS).max(1);
            for &[x, y, z] in positions.iter().step_by(apart) {
                let exact =
                    seen.clip_from_object * DVec3::from_array([x, y, z].map(f64::from)).extend(1.0);
                for (axis, (exact, bound)) in
                    exact.to_array().into_iter().zip(seen.error.bound).enumerate()
                {
                    let drawn = ((m[axis] * x + m[4 + axis] * y) + m[8 + axis] * z) + m[12 + axis];
                    // What f64 rounds is in the bound too. A bound that is no number holds everything, and
                    // what overflows is no coordinate.
                    if drawn.is_finite() && (f64::from(drawn) - exact).abs() > bound {
                        return Err(format!(
                            "object {number}: clip coordinate {axis} of ({x}, {y}, {z}) is beyond its error"
                        ));
                    }
                }
            }
        }
        Ok(())
    }

    /// What each part shows.
    fn seen(&self) -> Vec<Option<Seen>> {
        let partition = &self.world.partition;
        let mut seen: Vec<Option<Seen>> = vec![None; partition.part_count() as usize];
        let image = &self.truth.image;
        let (width, depths) = (image.viewport().width, image.depths());
        let mut near = ObjectId(0);
        let (mut last, mut part) = (None, PartId(0));
        // Neighbouring samples mostly show one triangle.
        for (place, draw) in image.draw_indices().enumerate() {
            let Some(draw) = draw else { continue };
            if last != Some(draw) {
                last = Some(draw);
                part = partition.part_of_draw_near(draw, &mut near);
            }
            let (x, y) = (place as u32 % width, place as u32 / width);
            merged(&mut seen[part.0 as usize], &Seen::one((x, y, depths[place])));
        }
        seen
    }

    fn bounds_hold(&self) -> Result<(), String> {
        let parts = self.seen();
        let index = self.scenery().index();
        let mut nodes: Vec<Option<Seen>> = vec![None; index.node_count() as usize];
        for &node in index.top_down().iter().rev() {
            let mut seen = nodes[node.0 as usize];
            for &object in index.node(node).objects {
                if let Some(other) = self.object_holds(object, 0, &parts)? {
                    merged(&mut seen, &other);
                }
            }
            let Some(seen) = seen else { continue };
            self.holds(Item::Scene(node), &seen)?;
            if let Some(parent) = index.parent(node) {
                merged(&mut nodes[parent.0 as usize], &seen);
            }
        }
        Ok(())
    }

    /// Holds a node of an object and all below it to their bounds; returns what shows of it.
    fn object_holds(
        &self,
        object: ObjectId,
        node: u32,
        parts: &[Option<Seen>],
    ) -> Result<Option<Seen>, String> {
        let range = self.parts(object, node);
        if parts[range.clone()].iter().all(Option::is_none) {
            return Ok(None);
        }
        let mut seen = None;
        let tree = self.world.partition.mesh(object).tree.as_ref();
        match tree.and_then(|tree| tree.nodes[node as usize].children) {
            Some(children) => {
                for child in children {
                    if let Some(other) = self.object_holds(object, child, parts)? {
                        merged(&mut seen, &other);
                    }
                }
            }
            None => seen = parts[range.start],
        }
        if let Some(seen) = &seen {
            // Drawn with its node it is tested by its box in the world.
            if self.view.object_outside_frustum(object.0) {
                return Err(format!("object {} shows, and is outside by its box", object.0));
            }
            self.holds(Item::Object(object, node), seen)?;
        }
        Ok(seen)
    }

    /// Holds one node, of which this shows, to its bounds.
    fn holds(&self, item: Item, seen: &Seen) -> Result<(), String> {
        let scenery = self.scenery();
        let (rectangle, depth, proxy) = match scenery.appearance(&self.view, item) {
            Appearance::Nowhere => {
                return Err(format!("{item:?} shows, and is said to be nowhere"));
            }
            Appearance::Certain => return Ok(()),
            Appearance::Ask { rectangle, depth, proxy } => (rectangle, depth, proxy),
        };
        let PixelRectangle { min, max } = rectangle;
        self.cover((item, "rectangle"), &[Proxy::Rectangle { min, max, depth }], seen)?;
        self.cover((item, "proxy"), &[proxy], seen)?;
        let mut proxies = Vec::new();
        let most = BOXES[(self.view.frame / BOUNDS_ONE_IN) as usize % BOXES.len()];
        scenery.tightest_proxies(&self.view, item, (proxy, most), &mut proxies);
        self.cover((item, "tighter proxies"), &proxies, seen)
    }

    fn cover(
        &self,
        (item, what): (Item, &str),
        proxies: &[Proxy],
        seen: &Seen,
    ) -> Result<(), String> {
        let missed = seen.samples().find(|&sample| !proxies.iter().any(|p| covers(p, sample)));
        if let Some((x, y, depth)) = missed {
            return Err(format!(
                "{item:?} shows at ({x}, {y}), depth {depth}, and its {what} is not there"
            ));
        }
        let boxes = proxies.iter().all(|proxy| matches!(proxy, Proxy::Box { .. }));
        if boxes && !proxies.iter().any(|proxy| proxy.shows(&self.truth.image)) {
            return Err(format!("{item:?} shows, and its {what} does not"));
        }
        Ok(())
    }
}
