//! The scene tree of Kovalčík & Sochor 2006, section 3.2: an axis-aligned BSP-like tree over world
//! boxes. Objects are not split; each hangs at the smallest node whose subspace holds it, inner nodes
//! included. The other level, the trees inside objects, is `part`'s.
//!
//! 1. Build: the space is the box of all objects; each node takes the plane that balances its objects
//!    and cuts few (the paper leaves the choice open: candidates are the faces of the boxes), until a
//!    node has [`LEAF_OBJECTS`] or none helps.
//! 2. Update: a moved object climbs until a subspace holds it, then sinks as far as one child holds it
//!    whole. The subdivision stays as it was built. What left the space hangs at the root, whose box
//!    is then not asked about.
//!
//! Cost: build O(n log² n); update O(depth) a moved object. It loses where many objects straddle the
//! upper planes: they hang near the root and are looked at in every frame.

use glam::DVec3;

use super::{Entry, Index, Move, Node, NodeId};
use crate::math::Aabb;
use crate::part::ObjectId;

/// A node with no more objects than this is not parted any further.
const LEAF_OBJECTS: usize = 2;
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
}

/// The scene tree.
#[derive(Clone, Debug)]
pub struct TwoLevelBsp {
    nodes: Vec<BspNode>,
    bounds: Vec<Aabb>,
    node_of_object: Vec<NodeId>,
    /// Objects at the root that stick out of the space.
    escaped: u32,
}

impl TwoLevelBsp {
    /// Builds the tree over the boxes of frame 0. Without objects it is one empty root.
    #[must_use]
    pub fn new(entries: &[Entry]) -> Self {
        let bounds: Vec<Aabb> = entries.iter().map(|e| e.bounds).collect();
        let space = bounds.iter().fold(Aabb::EMPTY, |all, b| all.union(b));
        let mut tree = Self {
            nodes: Vec::new(),
            node_of_object: vec![NodeId(0); bounds.len()],
            bounds,
            escaped: 0,
        };
        let all: Vec<u32> = (0..entries.len() as u32).collect();
        tree.build(space, None, &all);
        for object in 0..tree.bounds.len() {
            let id = ObjectId(object as u32);
            let node = tree.home(NodeId(0), &tree.bounds[object]);
            tree.link(id, node);
        }
        tree
    }

    fn build(&mut self, space: Aabb, parent: Option<NodeId>, inside: &[u32]) -> NodeId {
        let node = NodeId(self.nodes.len() as u32);
        self.nodes.push(BspNode {
            space,
            parent,
            plane: (0, 0.0),
            children: None,
            objects: Vec::new(),
            subtree_objects: 0,
        });
        if inside.len() > LEAF_OBJECTS
            && let Some((axis, at)) = self.choose(inside)
        {
            let pick = |keep: &dyn Fn(&Aabb) -> bool| -> Vec<u32> {
                inside.iter().copied().filter(|&o| keep(&self.bounds[o as usize])).collect()
            };
            let low = pick(&|b| b.max[axis] <= at);
            let high = pick(&|b| b.max[axis] > at && b.min[axis] >= at);
            let (mut low_space, mut high_space) = (space, space);
            low_space.max[axis] = at;
            high_space.min[axis] = at;
            let children = [
                self.build(low_space, Some(node), &low),
                self.build(high_space, Some(node), &high),
            ];
            let this = &mut self.nodes[node.0 as usize];
            this.plane = (axis, at);
            this.children = Some(children);
        }
        node
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

    /// The smallest node at or below `from` that holds `bounds`, given that `from` does or is the
    /// root.
    fn home(&self, from: NodeId, bounds: &Aabb) -> NodeId {
        let mut node = from;
        while let Some(children) = self.nodes[node.0 as usize].children {
            let holds = |child: &NodeId| self.nodes[child.0 as usize].space.contains(bounds);
            let Some(&child) = children.iter().find(|child| holds(child)) else { break };
            node = child;
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

    fn update(&mut self, moves: &[Move]) {
        for change in moves {
            let mut node = self.node_of_object[change.object.0 as usize];
            while !self.nodes[node.0 as usize].space.contains(&change.bounds) {
                let Some(parent) = self.nodes[node.0 as usize].parent else { break };
                node = parent;
            }
            let node = self.home(node, &change.bounds);
            // Unlinking needs the old box, to know whether the object had escaped.
            if node != self.node_of_object[change.object.0 as usize] || node == NodeId(0) {
                self.unlink(change.object);
                self.bounds[change.object.0 as usize] = change.bounds;
                self.link(change.object, node);
            } else {
                self.bounds[change.object.0 as usize] = change.bounds;
            }
        }
    }

    fn node_count(&self) -> u32 {
        self.nodes.len() as u32
    }

    fn node(&self, node: NodeId) -> Node<'_> {
        let this = &self.nodes[node.0 as usize];
        let whole = node != NodeId(0) || self.escaped == 0;
        Node {
            query_box: whole.then_some(this.space),
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

    fn check(&self) -> Result<(), String> {
        let mut seen = vec![0_u32; self.bounds.len()];
        let mut escaped = 0;
        for (number, node) in self.nodes.iter().enumerate() {
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
                if c.parent != Some(NodeId(number as u32)) || !node.space.contains(&c.space) {
                    return Err(format!("node {} is not inside its parent {number}", child.0));
                }
            }
            for &object in &node.objects {
                let bounds = &self.bounds[object.0 as usize];
                seen[object.0 as usize] += 1;
                let out = !node.space.contains(bounds);
                escaped += u32::from(out);
                let home = NodeId(number as u32);
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
