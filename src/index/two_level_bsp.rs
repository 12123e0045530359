//! The scene tree of Kovalčík & Sochor 2006, section 3.2: an axis-aligned BSP-like tree over world
//! boxes. Objects are not split; each hangs at the smallest node whose subspace holds it, inner nodes
//! included. The other level, the trees inside objects, is `part`'s.
//!
//! 1. Build: the space is the box of all objects; each node takes the plane that balances its objects
//!    and cuts few (the paper leaves the choice open: candidates are the faces of the boxes), until a
//!    node has [`BspKnobs::leaf_objects`] or none helps.
//! 2. Update: a moved object climbs until a subspace holds it, then sinks as far as one child holds it
//!    whole. What left the space hangs at the root, whose box is then not asked about.
//! 3. Lazy reconstruction (section 3.2: "after several frames the scene subdivision tree is locally
//!    adjusted"): every [`BspKnobs::reconstruction_period`] updates the node that holds the most objects beyond
//!    what it was built with is built anew, it and all below it.
//! 4. Tight boxes (end of section 3.4): a node whose contents have stood still for [`BspKnobs::tighten_after`]
//!    updates offers the tight box of what hangs at and below it, and loses it at once on a change.
//!
//! Cost: build O(n log² n); update O(1) a moved object that stays in its node, else O(depth). It loses
//! where many objects straddle the upper planes: they hang near the root and are looked at in every
//! frame.

use std::borrow::Cow;

use glam::DVec3;

use super::{BspKnobs, Entry, Index, Moves, Node, NodeId, Work, find_by_nodes};
use crate::math::{Aabb, Volume};
use crate::part::ObjectId;

/// A straddling object is looked at whenever its node is, so it weighs as much as this many objects
/// out of balance when planes are compared.
const STRADDLE_WEIGHT: usize = 3;

#[derive(Clone, Debug)]
struct BspNode {
    space: Aabb,
    parent: Option<NodeId>,
    plane: (usize, f64),
    children: Option<[NodeId; 2]>,
    objects: Vec<ObjectId>,
    subtree_objects: u32,
    /// Objects at the node itself when it was built.
    built_with: u32,
    /// The update in which anything at or below the node last changed.
    changed_in: u32,
    /// The box of everything at and below the node, while it stands still.
    tight: Option<Aabb>,
}

/// The scene tree.
#[derive(Clone, Debug)]
pub struct TwoLevelBsp {
    knobs: BspKnobs,
    nodes: Vec<BspNode>,
    bounds: Vec<Aabb>,
    node_of_object: Vec<NodeId>,
    /// Objects at the root that stick out of the space.
    escaped: u32,
    /// Numbers out of use.
    free: Vec<NodeId>,
    /// Nodes in use, parents before children.
    order: Vec<NodeId>,
    rebuilt: Vec<NodeId>,
    /// Updates so far.
    updates: u32,
    /// The last update in which anything moved.
    moved_in: u32,
    /// Whether anything moved since the last reconstruction.
    stale: bool,
    /// Whether the latest update took an object across the root.
    crossed_root: bool,
    work: Work,
}

impl TwoLevelBsp {
    /// Builds the tree over the boxes of frame 0. Without objects it is one empty root.
    #[must_use]
    pub fn new(entries: &[Entry]) -> Self {
        Self::with(entries, BspKnobs::default())
    }

    /// Builds the tree by other knobs.
    #[must_use]
    pub fn with(entries: &[Entry], knobs: BspKnobs) -> Self {
        let bounds: Vec<Aabb> = entries.iter().map(|e| e.bounds).collect();
        let space = bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
        let mut tree = Self {
            knobs,
            nodes: Vec::new(),
            node_of_object: vec![NodeId(0); bounds.len()],
            bounds,
            escaped: 0,
            free: Vec::new(),
            order: Vec::new(),
            rebuilt: Vec::new(),
            updates: 0,
            moved_in: 0,
            stale: false,
            crossed_root: false,
            work: Work::default(),
        };
        let all: Vec<u32> = (0..entries.len() as u32).collect();
        let root = tree.node_for(space, None);
        tree.build(root, &all);
        tree.hang(root, &all);
        tree.renew_order();
        tree
    }

    /// An empty leaf, under a number out of use where there is one.
    fn node_for(&mut self, space: Aabb, parent: Option<NodeId>) -> NodeId {
        let node = BspNode {
            space,
            parent,
            plane: (0, 0.0),
            children: None,
            objects: Vec::new(),
            subtree_objects: 0,
            built_with: 0,
            changed_in: self.updates,
            tight: None,
        };
        if let Some(number) = self.free.pop() {
            self.nodes[number.0 as usize] = node;
            return number;
        }
        self.nodes.push(node);
        NodeId(self.nodes.len() as u32 - 1)
    }

    /// The child of the root that `node` is in; `None` for the root itself.
    fn below_root(&self, node: NodeId) -> Option<NodeId> {
        let mut below = node;
        let mut parent = self.nodes[node.0 as usize].parent?;
        while let Some(above) = self.nodes[parent.0 as usize].parent {
            (below, parent) = (parent, above);
        }
        Some(below)
    }

    /// Parts the leaf `node`, which is to hold `inside`.
    fn build(&mut self, node: NodeId, inside: &[u32]) {
        if inside.len() <= self.knobs.leaf_objects as usize {
            return;
        }
        let Some((axis, at)) = self.choose(inside) else { return };
        let pick = |keep: &dyn Fn(&Aabb) -> bool| -> Vec<u32> {
            inside.iter().copied().filter(|&o| keep(&self.bounds[o as usize])).collect()
        };
        let low = pick(&|b| b.max[axis] <= at);
        let high = pick(&|b| b.max[axis] > at && b.min[axis] >= at);
        let space = self.nodes[node.0 as usize].space;
        let (mut low_space, mut high_space) = (space, space);
        low_space.max[axis] = at;
        high_space.min[axis] = at;
        let children = [low_space, high_space].map(|space| self.node_for(space, Some(node)));
        let this = &mut self.nodes[node.0 as usize];
        this.plane = (axis, at);
        this.children = Some(children);
        self.build(children[0], &low);
        self.build(children[1], &high);
    }

    /// Hangs `objects`, which hang nowhere, at their homes at and below `node`.
    fn hang(&mut self, node: NodeId, objects: &[u32]) {
        for &object in objects {
            let home = self.home(node, &self.bounds[object as usize]);
            self.link(ObjectId(object), home);
        }
        let mut stack = vec![node];
        while let Some(node) = stack.pop() {
            let this = &mut self.nodes[node.0 as usize];
            this.built_with = this.objects.len() as u32;
            stack.extend(this.children.iter().flatten());
        }
    }

    fn renew_order(&mut self) {
        self.order.clear();
        let mut stack = vec![NodeId(0)];
        while let Some(node) = stack.pop() {
            self.order.push(node);
            stack.extend(self.nodes[node.0 as usize].children.iter().flatten());
        }
    }

    /// Builds the subtree anew whose root has gained the most objects of its own; the smaller number
    /// among equals.
    fn reconstruct(&mut self) {
        let gained = |&node: &NodeId| {
            let this = &self.nodes[node.0 as usize];
            (this.objects.len() as u32).saturating_sub(this.built_with)
        };
        let worst = self.order.iter().copied().max_by_key(|n| (gained(n), std::cmp::Reverse(*n)));
        let Some(worst) = worst.filter(|node| gained(node) >= self.knobs.worth_reconstruction)
        else {
            return;
        };
        self.touch(worst);
        let mut objects = Vec::new();
        let mut stack = vec![worst];
        while let Some(node) = stack.pop() {
            objects.extend(self.nodes[node.0 as usize].objects.iter().map(|o| o.0));
            stack.extend(self.nodes[node.0 as usize].children.iter().flatten());
            if node != worst {
                self.free.push(node);
            }
        }
        objects.sort_unstable();
        // Lowest numbers are used first, whatever the history.
        self.free.sort_unstable_by(|a, b| b.cmp(a));
        for &object in &objects {
            self.unlink(ObjectId(object));
        }
        let this = &mut self.nodes[worst.0 as usize];
        this.children = None;
        if worst == NodeId(0) {
            // The root may grow to where things now are.
            this.space = self.bounds.iter().fold(this.space, |space, b| space.union(b));
            self.rebuilt.push(worst);
        }
        self.build(worst, &objects);
        self.hang(worst, &objects);
        self.renew_order();
        let mut stack: Vec<NodeId> =
            self.nodes[worst.0 as usize].children.into_iter().flatten().collect();
        while let Some(node) = stack.pop() {
            self.rebuilt.push(node);
            stack.extend(self.nodes[node.0 as usize].children.iter().flatten());
        }
    }

    /// Says of a node and all above it that they changed in this update.
    fn touch(&mut self, node: NodeId) {
        let mut at = Some(node);
        while let Some(node) = at {
            let this = &mut self.nodes[node.0 as usize];
            if this.changed_in == self.updates && this.tight.is_none() {
                break;
            }
            this.changed_in = self.updates;
            this.tight = None;
            at = this.parent;
        }
    }

    /// Gives tight boxes to the nodes that have stood still long enough.
    fn tighten(&mut self) {
        if self.updates > self.moved_in + self.knobs.tighten_after {
            return;
        }
        for place in (0..self.order.len()).rev() {
            let this = &self.nodes[self.order[place].0 as usize];
            if this.tight.is_some() || this.changed_in + self.knobs.tighten_after > self.updates {
                continue;
            }
            let own = this.objects.iter().map(|o| self.bounds[o.0 as usize]);
            let below = this.children.iter().flatten().map(|c| {
                self.nodes[c.0 as usize].tight.expect("below what stands still nothing changed")
            });
            let tight = own.chain(below).fold(Aabb::EMPTY, |all, b| all.union(&b));
            self.nodes[self.order[place].0 as usize].tight = Some(tight);
        }
    }

    /// The plane with the least of imbalance + weighted straddlers, over the upper faces of the
    /// boxes; `None` where none leaves an object whole on each side.
    fn choose(&self, inside: &[u32]) -> Option<(usize, f64)> {
        let mut best: Option<(usize, usize, f64)> = None;
        for axis in 0..3 {
            let sorted = |value: &dyn Fn(&Aabb) -> f64| {
                let mut values: Vec<f64> =
                    inside.iter().map(|&o| value(&self.bounds[o as usize])).collect();
                values.sort_unstable_by(f64::total_cmp);
                values
            };
            let (mins, maxs) = (sorted(&|b| b.min[axis]), sorted(&|b| b.max[axis]));
            for &at in &maxs {
                let low = maxs.partition_point(|&max| max <= at);
                let high = inside.len() - mins.partition_point(|&min| min < at);
                // A flat box in the plane would count on both sides; it goes below.
                let Some(straddling) = inside.len().checked_sub(low + high) else { continue };
                let cost = low.abs_diff(high) + STRADDLE_WEIGHT * straddling;
                if low > 0 && high > 0 && best.is_none_or(|(least, ..)| cost < least) {
                    best = Some((cost, axis, at));
                }
            }
        }
        best.map(|(_, axis, at)| (axis, at))
    }

    /// Whether a tight box is that of the contents, and only there while nothing moves.
    fn check_tight(&self, number: u32, node: &BspNode) -> Result<(), String> {
        let Some(tight) = node.tight else { return Ok(()) };
        if node.changed_in + self.knobs.tighten_after > self.updates {
            return Err(format!("node {number} is tight, but changed in {}", node.changed_in));
        }
        let boxes = node.objects.iter().map(|o| &self.bounds[o.0 as usize]);
        let below = node.children.iter().flatten().map(|c| &self.nodes[c.0 as usize].tight);
        let all_below = below.flatten().count() == node.children.map_or(0, |c| c.len());
        if !(all_below && boxes.clone().all(|b| tight.contains(b))) {
            return Err(format!("node {number} has a tight box that does not hold its contents"));
        }
        Ok(())
    }

    /// The smallest node at or below `from` that holds `bounds`, given that `from` does or is the
    /// root.
    fn home(&self, from: NodeId, bounds: &Aabb) -> NodeId {
        let mut node = from;
        if !self.nodes[from.0 as usize].space.contains(bounds) {
            return from;
        }
        // Inside a node only its plane tells the children apart.
        while let BspNode { children: Some([low, high]), plane: (axis, at), .. } =
            self.nodes[node.0 as usize]
        {
            node = if bounds.max[axis] <= at {
                low
            } else if bounds.min[axis] >= at {
                high
            } else {
                break;
            };
        }
        node
    }

    fn sticks_out(&self, object: ObjectId, node: NodeId) -> bool {
        !self.nodes[node.0 as usize].space.contains(&self.bounds[object.0 as usize])
    }

    fn link(&mut self, object: ObjectId, node: NodeId) {
        self.node_of_object[object.0 as usize] = node;
        self.escaped += u32::from(self.sticks_out(object, node));
        let objects = &mut self.nodes[node.0 as usize].objects;
        // Sorted by id, so that the order does not depend on the history of moves.
        let place = objects.partition_point(|&o| o < object);
        objects.insert(place, object);
        self.count(node, 1);
    }

    fn unlink(&mut self, object: ObjectId) {
        let node = self.node_of_object[object.0 as usize];
        self.escaped -= u32::from(self.sticks_out(object, node));
        let objects = &mut self.nodes[node.0 as usize].objects;
        let place = objects.binary_search(&object).expect("an object hangs where it was linked");
        objects.remove(place);
        self.count(node, -1);
    }

    fn count(&mut self, node: NodeId, change: i32) {
        let mut at = Some(node);
        while let Some(node) = at {
            let node = &mut self.nodes[node.0 as usize];
            node.subtree_objects = node.subtree_objects.wrapping_add_signed(change);
            at = node.parent;
        }
    }
}

impl Index for TwoLevelBsp {
    fn name(&self) -> &'static str {
        "two-level-bsp"
    }

    fn update(&mut self, moves: Moves<'_>) {
        self.updates += 1;
        self.rebuilt.clear();
        self.crossed_root = false;
        if !moves.moved.is_empty() {
            (self.moved_in, self.stale) = (self.updates, true);
        }
        for &object in moves.moved {
            let bounds = *moves.bounds(object);
            let old = self.node_of_object[object.0 as usize];
            let mut node = old;
            while !self.nodes[node.0 as usize].space.contains(&bounds) {
                let Some(parent) = self.nodes[node.0 as usize].parent else { break };
                self.work.steps += 1;
                node = parent;
            }
            let node = self.home(node, &bounds);
            self.touch(old);
            *if node == old { &mut self.work.ok } else { &mut self.work.updates } += 1;
            // Unlinking needs the old box, to know whether the object had escaped.
            if node != old || node == NodeId(0) {
                self.crossed_root |= match [old, node].map(|node| self.below_root(node)) {
                    [Some(from), Some(to)] => from != to,
                    _ => false,
                };
                self.unlink(object);
                self.bounds[object.0 as usize] = bounds;
                self.link(object, node);
                self.touch(node);
            } else {
                self.bounds[object.0 as usize] = bounds;
            }
        }
        if self.stale && self.updates.is_multiple_of(self.knobs.reconstruction_period) {
            self.stale = false;
            self.reconstruct();
        }
        self.tighten();
    }

    fn find(&mut self, _: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>) {
        let mut work = self.work;
        find_by_nodes(self, volume, &mut work, found);
        self.work = work;
    }

    fn work(&self) -> Work {
        self.work
    }

    fn heap_bytes(&self) -> usize {
        let objects: usize = self.nodes.iter().map(|node| node.objects.capacity()).sum();
        self.nodes.capacity() * size_of::<BspNode>()
            + objects * size_of::<ObjectId>()
            + self.bounds.capacity() * size_of::<Aabb>()
            + (self.node_of_object.capacity() + self.free.capacity() + self.order.capacity())
                * size_of::<NodeId>()
    }

    fn crossed_root(&self) -> bool {
        self.crossed_root
    }

    fn rebuilt(&self) -> &[NodeId] {
        &self.rebuilt
    }

    fn top_down(&self) -> Cow<'_, [NodeId]> {
        Cow::Borrowed(&self.order)
    }

    fn node_count(&self) -> u32 {
        self.nodes.len() as u32
    }

    fn node(&self, node: NodeId) -> Node<'_> {
        let this = &self.nodes[node.0 as usize];
        let whole = node != NodeId(0) || self.escaped == 0;
        Node {
            query_box: whole.then_some(this.space),
            tight_box: this.tight,
            objects: &this.objects,
            subtree_objects: this.subtree_objects,
        }
    }

    fn children(&self, node: NodeId, eye: DVec3, out: &mut Vec<NodeId>) -> usize {
        let this = &self.nodes[node.0 as usize];
        let Some([low, high]) = this.children else { return 0 };
        let (axis, at) = this.plane;
        out.extend(if eye[axis] <= at { [low, high] } else { [high, low] });
        1
    }

    fn parent(&self, node: NodeId) -> Option<NodeId> {
        self.nodes[node.0 as usize].parent
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        if self.bounds != boxes {
            return Err("an object is not where it was said to be".to_owned());
        }
        let mut seen = vec![0_u32; self.bounds.len()];
        let mut escaped = 0;
        if self.order.len() + self.free.len() != self.nodes.len() {
            return Err(format!("{} nodes are in use or free", self.order.len() + self.free.len()));
        }
        for &NodeId(number) in &self.order {
            let node = &self.nodes[number as usize];
            self.check_tight(number, node)?;
            let below: u32 = node
                .children
                .iter()
                .flatten()
                .map(|c| self.nodes[c.0 as usize].subtree_objects)
                .sum();
            if node.subtree_objects != below + node.objects.len() as u32 {
                return Err(format!("node {number} counts {} objects", node.subtree_objects));
            }
            for child in node.children.iter().flatten() {
                let c = &self.nodes[child.0 as usize];
                if c.parent != Some(NodeId(number)) || !node.space.contains(&c.space) {
                    return Err(format!("node {} is not inside its parent {number}", child.0));
                }
            }
            for &object in &node.objects {
                let bounds = &self.bounds[object.0 as usize];
                seen[object.0 as usize] += 1;
                let out = !node.space.contains(bounds);
                escaped += u32::from(out);
                let home = NodeId(number);
                if self.node_of_object[object.0 as usize] != home {
                    return Err(format!("object {} hangs at {number} and elsewhere", object.0));
                }
                if out && number != 0 {
                    return Err(format!("object {} sticks out of node {number}", object.0));
                }
                if self.home(home, bounds) != home {
                    return Err(format!("object {} fits below node {number}", object.0));
                }
            }
        }
        if let Some(object) = seen.iter().position(|&times| times != 1) {
            return Err(format!("object {object} hangs at {} nodes", seen[object]));
        }
        if escaped != self.escaped {
            return Err(format!("{escaped} objects left the space, {} counted", self.escaped));
        }
        Ok(())
    }
}
