//! What the octrees and quadtrees of Wortel 2011 (chapter 3) share: nodes that halve their space along two
//! or three axes, objects each at one node, updates that climb and sink, depth reduction (section 3.5.1)
//! and object checklists (section 3.5.2). Where an object belongs and what a node's box is are the
//! [`Rules`] of each tree, in a file of its own. It must not know scenes or cameras.
//!
//! 1. Update: of what moved, or of what is due, an object that its node no longer holds climbs until a
//!    space holds it and sinks from there as far as the rules say, `reduction` levels less where depth is
//!    reduced.
//! 2. Finding: top down. A node that is partly inside the volume first moves down what belongs lower; what
//!    hangs at a node that is not outside is found; all below one that is inside is found without a look.
//! 3. Empty leaves are taken out at once.
//! 4. What leaves the space of the root hangs at the root, which then has no box.
//!
//! Cost: an update O(depth) an object that leaves its node; finding O(nodes met).

use std::borrow::Cow;

use glam::DVec3;

use super::checklist::{Checklists, Due};
use super::tree_knobs::{Split, TreeKnobs};
use super::{
    Entry, Index, MIDDLE_ROUNDING, Moves, Node, NodeId, Work, each_once, rounded_up, space_of_boxes,
};
use crate::math::{Aabb, Planes, Volume};
use crate::part::ObjectId;

/// Where an object is, and what is known of it for good.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thing<'a> {
    pub(super) id: ObjectId,
    pub(super) bounds: &'a Aabb,
    /// The middle of the box.
    pub(super) at: DVec3,
    /// The largest half side it ever has.
    pub(super) reach: f64,
}

/// What tells the trees apart.
pub(super) trait Rules {
    /// What a node keeps of the objects at and below it, so that its box holds them.
    type Extent: Copy + PartialEq + std::fmt::Debug;
    /// Of a node with nothing.
    const NOTHING: Self::Extent;
    /// Whether what belongs below its node is moved there whenever it is looked at.
    const SINKS: bool = false;
    /// Whether a node that was made for an object keeps it.
    const STOPS_AT_NEW: bool = false;
    /// Whether an extent shrinks when its node is looked at, instead of at once.
    const LAZY_EXTENT: bool = false;

    /// Names for reports: of the octree and of the quadtree.
    fn names(&self) -> [&'static str; 2];

    /// What an object adds to the extent of its node.
    fn extent(&self, thing: &Thing<'_>) -> Self::Extent;

    /// Whether a node's extent may be what it is because of the first, of an object. Where it never is,
    /// extents are all the same.
    fn owes(&self, own: Self::Extent, whole: Self::Extent) -> bool;

    /// The extent of both.
    fn merged(&self, a: Self::Extent, b: Self::Extent) -> Self::Extent;

    /// The box of a node at `depth` with that extent.
    fn volume(&self, space: &Aabb, depth: u8, extent: &Self::Extent) -> Aabb;

    /// Whether a node may keep the object, or a node above may take it.
    fn holds(&self, space: &Aabb, depth: u8, thing: &Thing<'_>, above: bool) -> bool;

    /// Whether the object belongs below a node of `depth` that has `count` objects, with levels reduced by
    /// so many; a child must hold it too.
    fn below(&self, depth: u8, count: usize, thing: &Thing<'_>, reduction: u8) -> bool;
}

/// No node.
const NONE: u32 = u32::MAX;

#[derive(Clone, Debug)]
struct TreeNode<E> {
    space: Aabb,
    extent: E,
    /// By octant: bit a is set for the upper half along the a-th axis of the split.
    children: [u32; 8],
    objects: Vec<ObjectId>,
    parent: u32,
    subtree_objects: u32,
    depth: u8,
    /// Whether the extent may be more than the contents need.
    loose: bool,
}

/// Where an object hangs, and all that is known of it: one piece of memory for each object looked at.
#[derive(Clone, Copy, Debug)]
struct Home {
    node: u32,
    /// Place among the node's objects.
    place: u32,
    /// The largest half side that its box ever has.
    reach: f32,
    /// The farthest its middle moves in a frame.
    step: f32,
    due: Due,
}

/// Objects that are due whose memory is read ahead of the decisions, so that the reads overlap.
const READ_AHEAD: usize = 32;

/// A tree by some rules.
#[derive(Clone, Debug)]
pub(super) struct Tree<R: Rules> {
    rules: R,
    knobs: TreeKnobs,
    nodes: Vec<TreeNode<R::Extent>>,
    homes: Vec<Home>,
    lists: Option<Checklists>,
    /// Objects that the root does not hold, ascending.
    strays: Vec<ObjectId>,
    free: Vec<u32>,
    rebuilt: Vec<NodeId>,
    work: Work,
}

/// The space of a quadtree: its own height more above and below, and at least a sixteenth of its longer
/// side. All nodes are as high, so nobody is to be looked at for walking on the ground.
fn headroom(space: &Aabb) -> Aabb {
    let size = space.size();
    space.grown(DVec3::Y * size.y.max(size.max_element() / 16.0))
}

/// How far the middle of a box is from the nearest border of a space; negative outside, NaN for the empty
/// box.
fn inside(space: &Aabb, bounds: &Aabb) -> f64 {
    let at = bounds.center();
    (at - space.min).min(space.max - at).min_element()
}

impl Home {
    fn of(entry: &Entry) -> Self {
        let [reach, step] = [entry.reach, entry.step_bound].map(rounded_up);
        Self { node: NONE, place: 0, reach, step, due: Due::NEVER }
    }
}

impl<R: Rules> Tree<R> {
    /// Over the boxes of frame 0.
    pub(super) fn new(entries: &[Entry], knobs: TreeKnobs, rules: impl FnOnce(&Aabb) -> R) -> Self {
        let space = space_of_boxes(entries);
        let space = match knobs.split {
            Split::Octants => space,
            Split::Quadrants => headroom(&space),
        };
        let mut tree = Self {
            rules: rules(&space),
            knobs,
            nodes: Vec::new(),
            homes: entries.iter().map(Home::of).collect(),
            lists: knobs.checklists.then(|| Checklists::new(knobs.ahead)),
            strays: Vec::new(),
            free: Vec::new(),
            rebuilt: Vec::new(),
            work: Work::default(),
        };
        tree.node_for(space, NONE, 0);
        let boxes: Vec<Aabb> = entries.iter().map(|entry| entry.bounds).collect();
        for id in (0..entries.len() as u32).map(ObjectId) {
            let to = if entries[id.0 as usize].bounds.is_empty() {
                0
            } else {
                tree.sink(0, &boxes, id, knobs.depth_reduction)
            };
            tree.link(id, to, 0, &boxes);
            tree.note_stray(id, &boxes);
            tree.schedule(id, &boxes);
        }
        tree.work = Work::default();
        tree.rebuilt.clear();
        tree
    }

    fn thing<'a>(&self, boxes: &'a [Aabb], id: ObjectId) -> Thing<'a> {
        let bounds = &boxes[id.0 as usize];
        let reach = f64::from(self.homes[id.0 as usize].reach);
        Thing { id, bounds, at: bounds.center(), reach }
    }

    /// An empty leaf, under a number out of use where there is one.
    fn node_for(&mut self, space: Aabb, parent: u32, depth: u8) -> u32 {
        let node = TreeNode {
            space,
            extent: R::NOTHING,
            children: [NONE; 8],
            objects: Vec::new(),
            parent,
            subtree_objects: 0,
            depth,
            loose: false,
        };
        let number = match self.free.pop() {
            Some(number) => {
                self.nodes[number as usize] = node;
                number
            }
            None => {
                self.nodes.push(node);
                self.nodes.len() as u32 - 1
            }
        };
        self.rebuilt.push(NodeId(number));
        number
    }

    /// In which octant of the node the point is.
    fn octant(&self, node: u32, at: DVec3) -> usize {
        self.knobs.split.octant(self.nodes[node as usize].space.center(), at)
    }

    fn child_space(&self, node: u32, octant: usize) -> Aabb {
        let space = &self.nodes[node as usize].space;
        self.knobs.split.part(space, space.center(), octant)
    }

    fn is_leaf(&self, node: u32) -> bool {
        self.nodes[node as usize].children == [NONE; 8]
    }

    /// The child of `node`, which has `count` objects, that is to take the object, made where it is not
    /// there, and whether it was made; `None` where the object stays.
    fn child_for(
        &mut self,
        node: u32,
        count: usize,
        thing: &Thing<'_>,
        reduction: u8,
    ) -> Option<(u32, bool)> {
        let depth = self.nodes[node as usize].depth;
        if depth >= self.knobs.max_depth || !self.rules.below(depth, count, thing, reduction) {
            return None;
        }
        let octant = self.octant(node, thing.at);
        let space = self.child_space(node, octant);
        self.work.steps += 1;
        if !self.rules.holds(&space, depth + 1, thing, false) {
            return None;
        }
        let there = self.nodes[node as usize].children[octant];
        if there != NONE {
            return Some((there, false));
        }
        let made = self.node_for(space, node, depth + 1);
        self.nodes[node as usize].children[octant] = made;
        Some((made, true))
    }

    /// The node at or below `from` where the object belongs, given that `from` holds it or is the root.
    fn sink(&mut self, from: u32, boxes: &[Aabb], id: ObjectId, reduction: u8) -> u32 {
        let thing = self.thing(boxes, id);
        let mut at = from;
        let Aabb { min, max } = self.nodes[from as usize].space;
        if thing.at.cmplt(min).any() || thing.at.cmpgt(max).any() {
            return from;
        }
        loop {
            if R::STOPS_AT_NEW {
                self.make_room(at, boxes, id, reduction);
            }
            let count = self.nodes[at as usize].objects.len();
            match self.child_for(at, count, &thing, reduction) {
                None => return at,
                Some((child, true)) if R::STOPS_AT_NEW => return child,
                Some((child, _)) => at = child,
            }
        }
    }

    /// Where one other object is alone in the leaf `node` though it belongs below, it goes a level down.
    fn make_room(&mut self, node: u32, boxes: &[Aabb], id: ObjectId, reduction: u8) {
        if let [other] = *self.nodes[node as usize].objects
            && other != id
            && self.is_leaf(node)
            && !boxes[other.0 as usize].is_empty()
        {
            let thing = self.thing(boxes, other);
            if self.nodes[node as usize].space.contains_point(thing.at)
                && let Some((child, _)) = self.child_for(node, 1, &thing, reduction)
            {
                self.relink(other, child, boxes);
                self.schedule(other, boxes);
            }
        }
    }

    /// Hangs an object that hangs nowhere at `node`, and counts it up to but without `top`'s parent.
    fn link(&mut self, id: ObjectId, node: u32, top: u32, boxes: &[Aabb]) {
        let objects = &mut self.nodes[node as usize].objects;
        let home = &mut self.homes[id.0 as usize];
        (home.node, home.place) = (node, objects.len() as u32);
        objects.push(id);
        self.count(node, top, 1);
        self.grow(node, boxes, id);
    }

    fn count(&mut self, node: u32, top: u32, change: i32) {
        let mut at = node;
        loop {
            let this = &mut self.nodes[at as usize];
            this.subtree_objects = this.subtree_objects.wrapping_add_signed(change);
            if at == top {
                break;
            }
            at = this.parent;
        }
    }

    /// Takes the object into the extents at and above its node.
    fn grow(&mut self, node: u32, boxes: &[Aabb], id: ObjectId) {
        if boxes[id.0 as usize].is_empty() {
            return;
        }
        let own = self.rules.extent(&self.thing(boxes, id));
        let mut at = node;
        while at != NONE {
            let this = &mut self.nodes[at as usize];
            let merged = self.rules.merged(this.extent, own);
            let same = merged == this.extent;
            if same && (this.loose || !R::LAZY_EXTENT) {
                break;
            }
            this.extent = merged;
            // What moved may need less than before.
            this.loose = R::LAZY_EXTENT;
            at = this.parent;
        }
    }

    /// What the contents of a node need, by the extents of its children.
    fn needed(&self, node: u32, boxes: &[Aabb]) -> R::Extent {
        let this = &self.nodes[node as usize];
        let own = this.objects.iter().filter(|id| !boxes[id.0 as usize].is_empty());
        let own = own.map(|&id| self.rules.extent(&self.thing(boxes, id)));
        let below = this.children.iter().filter(|&&child| child != NONE);
        let below = below.map(|&child| self.nodes[child as usize].extent);
        own.chain(below).fold(R::NOTHING, |all, one| self.rules.merged(all, one))
    }

    /// Shrinks extents from `node` upwards as far as they change, now that `own` has gone.
    fn shrink(&mut self, node: u32, own: R::Extent, boxes: &[Aabb]) {
        let mut at = node;
        while at != NONE && self.rules.owes(own, self.nodes[at as usize].extent) {
            let needed = self.needed(at, boxes);
            let this = &mut self.nodes[at as usize];
            // Who has grown and is not looked at yet will be.
            if needed == this.extent || self.rules.merged(needed, this.extent) != this.extent {
                break;
            }
            this.extent = needed;
            at = this.parent;
        }
    }

    /// The lowest node that is above both or one of them.
    fn common(&self, a: u32, b: u32) -> u32 {
        let (mut a, mut b) = (a, b);
        while a != b {
            let deeper = if self.nodes[a as usize].depth >= self.nodes[b as usize].depth {
                &mut a
            } else {
                &mut b
            };
            *deeper = self.nodes[*deeper as usize].parent;
        }
        a
    }

    /// Hangs an object elsewhere, and takes out what is empty then.
    fn relink(&mut self, id: ObjectId, to: u32, boxes: &[Aabb]) {
        let Home { node: from, place, .. } = self.homes[id.0 as usize];
        let common = self.common(from, to);
        self.count(common, common, -1);
        self.link(id, to, common, boxes);
        let objects = &mut self.nodes[from as usize].objects;
        objects.swap_remove(place as usize);
        if let Some(&moved) = objects.get(place as usize) {
            self.homes[moved.0 as usize].place = place;
        }
        if from != common {
            let below = self.child_above(from, common);
            self.count(from, below, -1);
        }
        let mut at = from;
        while at != 0 && self.nodes[at as usize].subtree_objects == 0 {
            let parent = self.nodes[at as usize].parent;
            let mine = self.nodes[parent as usize].children.iter_mut().find(|child| **child == at);
            *mine.expect("a node is its parent's child") = NONE;
            self.free.push(at);
            at = parent;
        }
        if R::LAZY_EXTENT {
            while at != NONE && !self.nodes[at as usize].loose {
                self.nodes[at as usize].loose = true;
                at = self.nodes[at as usize].parent;
            }
        } else if !boxes[id.0 as usize].is_empty() {
            let own = self.rules.extent(&self.thing(boxes, id));
            self.shrink(at, own, boxes);
        }
    }

    /// The node at or above `node` whose parent is `top`.
    fn child_above(&self, node: u32, top: u32) -> u32 {
        let mut at = node;
        while self.nodes[at as usize].parent != top {
            at = self.nodes[at as usize].parent;
        }
        at
    }

    /// Looks at an object that may have left its node.
    fn look_at(&mut self, id: ObjectId, boxes: &[Aabb]) {
        if boxes[id.0 as usize].is_empty() {
            return;
        }
        let thing = self.thing(boxes, id);
        let old = self.homes[id.0 as usize].node;
        let holds = |tree: &Self, node: u32, above| {
            let this = &tree.nodes[node as usize];
            tree.rules.holds(&this.space, this.depth, &thing, above)
        };
        let reduction = self.knobs.depth_reduction;
        let mut at = old;
        if holds(self, old, false) {
            if !(R::SINKS || old == 0) {
                self.work.ok += 1;
                self.grow(old, boxes, id);
                self.schedule(id, boxes);
                return;
            }
        } else {
            while !holds(self, at, true) && self.nodes[at as usize].parent != NONE {
                self.work.steps += 1;
                at = self.nodes[at as usize].parent;
            }
        }
        let to = self.sink(at, boxes, id, reduction);
        if to == old {
            self.work.ok += 1;
            self.grow(old, boxes, id);
        } else {
            self.work.updates += 1;
            self.relink(id, to, boxes);
        }
        if to == 0 || old == 0 {
            self.note_stray(id, boxes);
        }
        self.schedule(id, boxes);
    }

    /// Looks at objects whose turn it is, at most [`READ_AHEAD`]. Most are where they belong.
    fn look_at_due(&mut self, ids: &[ObjectId], boxes: &[Aabb]) {
        let Some(lists) = &mut self.lists else { return };
        let mut distances = [0.0; READ_AHEAD];
        for (distance, &id) in distances.iter_mut().zip(ids) {
            let space = &self.nodes[self.homes[id.0 as usize].node as usize].space;
            *distance = inside(space, &boxes[id.0 as usize]);
        }
        let mut left = [false; READ_AHEAD];
        for ((&id, distance), left) in ids.iter().zip(distances).zip(&mut left) {
            let home = &mut self.homes[id.0 as usize];
            if !lists.is_due(home.due) {
                continue;
            }
            if distance >= 0.0 && home.node != 0 {
                self.work.ok += 1;
                lists.put(id, &mut home.due, distance, f64::from(home.step));
            } else {
                *left = true;
            }
        }
        for (&id, _) in ids.iter().zip(left).filter(|(_, left)| *left) {
            self.look_at(id, boxes);
        }
    }

    /// Keeps the list of what the root does not hold.
    fn note_stray(&mut self, id: ObjectId, boxes: &[Aabb]) {
        let place = self.strays.binary_search(&id);
        match (place, self.is_stray(id, boxes)) {
            (Err(place), true) => self.strays.insert(place, id),
            (Ok(place), false) => {
                self.strays.remove(place);
            }
            _ => {}
        }
    }

    fn is_stray(&self, id: ObjectId, boxes: &[Aabb]) -> bool {
        let thing = self.thing(boxes, id);
        self.homes[id.0 as usize].node == 0
            && !thing.bounds.is_empty()
            && !self.rules.holds(&self.nodes[0].space, 0, &thing, false)
    }

    /// Sets when the object is to be looked at again.
    fn schedule(&mut self, id: ObjectId, boxes: &[Aabb]) {
        let Some(lists) = &mut self.lists else { return };
        let home = &mut self.homes[id.0 as usize];
        let distance = inside(&self.nodes[home.node as usize].space, &boxes[id.0 as usize]);
        let distance = if distance >= 0.0 { distance } else { 0.0 };
        lists.put(id, &mut home.due, distance, f64::from(home.step));
    }

    /// What the objects at a node that belong below it wait for: a level down.
    fn lower(&mut self, node: u32, boxes: &[Aabb]) {
        let mut place = 0;
        while let Some(&id) = self.nodes[node as usize].objects.get(place) {
            let thing = self.thing(boxes, id);
            let inside = self.nodes[node as usize].space.contains_point(thing.at);
            let child = if inside && !thing.bounds.is_empty() {
                self.child_for(node, 0, &thing, 0)
            } else {
                None
            };
            let Some((child, _)) = child else {
                place += 1;
                continue;
            };
            // The object at the end takes its place.
            self.relink(id, child, boxes);
            self.work.lowered += 1;
            if let Some(lists) = &mut self.lists {
                lists.put_next(id, &mut self.homes[id.0 as usize].due);
            }
        }
    }

    /// The box by which a node is looked at; `None` for a root with strays.
    fn volume_of(&self, node: u32) -> Option<Aabb> {
        let this = &self.nodes[node as usize];
        let whole = node != 0 || self.strays.is_empty();
        whole.then(|| self.rules.volume(&this.space, this.depth, &this.extent))
    }

    /// Goes through what meets the volume, and moves down what belongs lower; tells `found` of objects.
    fn walk(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut dyn FnMut(&[ObjectId])) {
        let mut stack = vec![(0, Planes::ALL)];
        while let Some((node, planes)) = stack.pop() {
            let inside = planes.is_empty();
            self.work.node_checks += 1;
            if R::LAZY_EXTENT && !inside && self.nodes[node as usize].loose {
                let needed = self.needed(node, boxes);
                let children = self.nodes[node as usize].children;
                let mut below = children.iter().filter(|&&child| child != NONE);
                let loose = below.any(|&child| self.nodes[child as usize].loose);
                let this = &mut self.nodes[node as usize];
                (this.extent, this.loose) = (needed, loose);
            }
            let this = &self.nodes[node as usize];
            let alone = self.knobs.leaf_boxes && this.objects.len() == 1 && self.is_leaf(node);
            let straddled = if inside {
                Some(planes)
            } else if alone {
                volume.straddled(&boxes[this.objects[0].0 as usize], planes)
            } else {
                self.volume_of(node).map_or(Some(planes), |aabb| volume.straddled(&aabb, planes))
            };
            let Some(planes) = straddled else { continue };
            if !planes.is_empty() && !alone && self.knobs.depth_reduction > 0 {
                self.lower(node, boxes);
            }
            let this = &self.nodes[node as usize];
            found(&this.objects);
            let children = this.children.iter().filter(|&&child| child != NONE);
            stack.extend(children.map(|&child| (child, planes)));
        }
    }

    /// Whether nothing hangs too high, where updates do not leave that to finding.
    fn check_place(&self, number: u32, thing: &Thing<'_>) -> Result<(), String> {
        let node = &self.nodes[number as usize];
        if self.knobs.depth_reduction > 0
            || node.depth >= self.knobs.max_depth
            || !node.space.contains_point(thing.at)
        {
            return Ok(());
        }
        let space = self.child_space(number, self.octant(number, thing.at));
        let sinks = self.rules.below(node.depth, 0, thing, 0)
            && self.rules.holds(&space, node.depth + 1, thing, false);
        let alone = R::STOPS_AT_NEW && node.objects.len() == 1 && self.is_leaf(number);
        if sinks && !alone {
            return Err(format!("object {} belongs below node {number}", thing.id.0));
        }
        Ok(())
    }

    /// Whether the object is looked at before it can leave its node.
    fn check_schedule(&self, id: ObjectId, boxes: &[Aabb]) -> Result<(), String> {
        let (home, bounds) = (&self.homes[id.0 as usize], &boxes[id.0 as usize]);
        let Some(lists) = self.lists.as_ref().filter(|_| !bounds.is_empty()) else {
            return Ok(());
        };
        let space = &self.nodes[home.node as usize].space;
        let far = bounds.max_abs().max(space.max_abs()).max_element();
        let distance = inside(space, bounds);
        lists.check((id, home.due), (distance, f64::from(home.step), far * MIDDLE_ROUNDING))
    }

    fn check_node(&self, number: u32, boxes: &[Aabb], seen: &mut [u32]) -> Result<(), String> {
        let node = &self.nodes[number as usize];
        let mut below = 0;
        for (octant, &child) in node.children.iter().enumerate().filter(|(_, c)| **c != NONE) {
            let this = &self.nodes[child as usize];
            below += this.subtree_objects;
            if this.parent != number || this.depth != node.depth + 1 || this.subtree_objects == 0 {
                return Err(format!("node {child} is not a full child of {number}"));
            }
            if this.space != self.child_space(number, octant) {
                return Err(format!("node {child} is not in octant {octant} of {number}"));
            }
            if this.loose && !node.loose {
                return Err(format!(
                    "node {number} does not know that its child {child} may shrink"
                ));
            }
        }
        if node.subtree_objects != below + node.objects.len() as u32 {
            return Err(format!("node {number} counts {} objects", node.subtree_objects));
        }
        if self.rules.merged(node.extent, self.needed(number, boxes)) != node.extent {
            return Err(format!("node {number} does not know the extent of its contents"));
        }
        let volume = self.rules.volume(&node.space, node.depth, &node.extent);
        for (place, &id) in node.objects.iter().enumerate() {
            seen[id.0 as usize] += 1;
            let home = self.homes[id.0 as usize];
            if (home.node, home.place as usize) != (number, place) {
                return Err(format!("object {} hangs at {number} and elsewhere", id.0));
            }
            let bounds = &boxes[id.0 as usize];
            let thing = self.thing(boxes, id);
            let stray = self.strays.binary_search(&id).is_ok();
            if stray != self.is_stray(id, boxes) {
                return Err(format!("object {} is a stray: {stray}", id.0));
            }
            if bounds.is_empty() || stray {
                continue;
            }
            if !volume.contains(bounds) {
                return Err(format!("object {} sticks out of node {number}", id.0));
            }
            self.check_place(number, &thing)?;
            if number != 0 && !self.rules.holds(&node.space, node.depth, &thing, false) {
                return Err(format!("node {number} should not have object {}", id.0));
            }
        }
        Ok(())
    }
}

impl<R: Rules + Send> Index for Tree<R> {
    fn name(&self) -> &'static str {
        self.rules.names()[usize::from(self.knobs.split == Split::Quadrants)]
    }

    fn update(&mut self, moves: Moves<'_>) {
        self.rebuilt.clear();
        let Some(lists) = &mut self.lists else {
            moves.moved.iter().for_each(|&id| self.look_at(id, moves.boxes));
            return;
        };
        let due = lists.next();
        moves.jumped.iter().for_each(|&id| self.look_at(id, moves.boxes));
        for ids in due.chunks(READ_AHEAD) {
            self.look_at_due(ids, moves.boxes);
        }
        if let Some(lists) = &mut self.lists {
            lists.recycle(due);
        }
    }

    fn refine(&mut self, boxes: &[Aabb], volume: &Volume) {
        if self.knobs.depth_reduction > 0 || R::LAZY_EXTENT {
            self.walk(boxes, volume, &mut |_| {});
        }
    }

    fn find(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>) {
        self.walk(boxes, volume, &mut |objects| found.extend_from_slice(objects));
    }

    fn work(&self) -> Work {
        self.work
    }

    fn heap_bytes(&self) -> usize {
        let objects: usize = self.nodes.iter().map(|node| node.objects.capacity()).sum();
        self.nodes.capacity() * size_of::<TreeNode<R::Extent>>()
            + objects * size_of::<ObjectId>()
            + self.homes.capacity() * size_of::<Home>()
            + (self.strays.capacity() + self.free.capacity() + self.rebuilt.capacity()) * 4
            + self.lists.as_ref().map_or(0, Checklists::heap_bytes)
    }

    fn rebuilt(&self) -> &[NodeId] {
        &self.rebuilt
    }

    fn top_down(&self) -> Cow<'_, [NodeId]> {
        let mut order = Vec::with_capacity(self.nodes.len() - self.free.len());
        let mut stack = vec![0];
        while let Some(node) = stack.pop() {
            order.push(NodeId(node));
            let children = self.nodes[node as usize].children;
            stack.extend(children.into_iter().filter(|&child| child != NONE));
        }
        Cow::Owned(order)
    }

    fn node_count(&self) -> u32 {
        self.nodes.len() as u32
    }

    fn node(&self, node: NodeId) -> Node<'_> {
        let this = &self.nodes[node.0 as usize];
        Node {
            query_box: self.volume_of(node.0),
            tight_box: None,
            objects: &this.objects,
            subtree_objects: this.subtree_objects,
        }
    }

    /// Nearer octants first; an object at the node itself may be anywhere among them.
    fn children(&self, node: NodeId, eye: DVec3, out: &mut Vec<NodeId>) -> usize {
        let nearest = self.octant(node.0, eye);
        let before = out.len();
        let children = self.nodes[node.0 as usize].children;
        let order = (0..children.len()).map(|i| children[nearest ^ i]);
        out.extend(order.filter(|&child| child != NONE).map(NodeId));
        (out.len() - before).div_ceil(2)
    }

    fn parent(&self, node: NodeId) -> Option<NodeId> {
        let parent = self.nodes[node.0 as usize].parent;
        (parent != NONE).then_some(NodeId(parent))
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        let order = self.top_down();
        if order.len() + self.free.len() != self.nodes.len() {
            return Err(format!("{} nodes are in use or free", order.len() + self.free.len()));
        }
        let mut seen = vec![0_u32; boxes.len()];
        order.iter().try_for_each(|node| self.check_node(node.0, boxes, &mut seen))?;
        each_once(&seen)?;
        let strays = self.strays.iter();
        if let Some(id) = strays.clone().find(|id| self.homes[id.0 as usize].node != 0) {
            return Err(format!("object {} is a stray and not at the root", id.0));
        }
        if !strays.is_sorted_by(|a, b| a < b) {
            return Err("the list of strays is not in order".to_owned());
        }
        (0..boxes.len() as u32).try_for_each(|id| self.check_schedule(ObjectId(id), boxes))
    }
}
