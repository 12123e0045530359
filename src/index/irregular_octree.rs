//! The dynamic irregular octree of Shagam & Pfeiffer 2003 (*Dynamic irregular octrees*; Wortel 2011, section
//! 2.2): a node is parted at a point chosen from its objects, and objects go down only while somebody looks.
//!
//! 1. Update: what moved is taken out and hung at the root again, whatever it did.
//! 2. Finding: a node that is partly inside the volume hands down each object that no splitting plane
//!    crosses, one level. A leaf with more objects than its capacity is parted first, at the mean of their
//!    middles.
//! 3. A node below which nothing is left becomes a leaf, so that it may be parted anew, elsewhere. The
//!    sources say only that the tree gets unbalanced over time.
//!
//! Cost: an update O(depth) an object that moved, to count it out; finding O(nodes met + objects handed
//! down), which is everything that moved since, at the root. It loses where most objects move in each
//! frame, and where many straddle the upper planes. It must not know scenes or cameras.

use std::borrow::Cow;

use glam::DVec3;

use super::{Entry, Index, Moves, Node, NodeId, TreeKnobs, Work, each_once, space_of_boxes};
use crate::math::{Aabb, Planes, Volume};
use crate::part::ObjectId;

/// No node.
const NONE: u32 = u32::MAX;

#[derive(Clone, Debug)]
struct IrregularNode {
    space: Aabb,
    /// Where it is parted; `None` for a leaf.
    split: Option<DVec3>,
    /// By octant: bit a is set for the upper part along the a-th axis of the split.
    children: [u32; 8],
    objects: Vec<ObjectId>,
    parent: u32,
    subtree_objects: u32,
    depth: u8,
}

#[derive(Clone, Copy, Debug)]
struct Home {
    node: u32,
    /// Place among the node's objects.
    place: u32,
    /// Whether it sticks out of the space of the root, where it hangs.
    stray: bool,
}

/// The tree.
#[derive(Clone, Debug)]
pub struct IrregularOctree {
    knobs: TreeKnobs,
    nodes: Vec<IrregularNode>,
    homes: Vec<Home>,
    strays: u32,
    free: Vec<u32>,
    rebuilt: Vec<NodeId>,
    work: Work,
}

impl IrregularOctree {
    /// Over the boxes of frame 0, all of them at the root. Takes the split, the capacity and the greatest
    /// depth.
    #[must_use]
    pub fn new(entries: &[Entry], knobs: TreeKnobs) -> Self {
        let space = space_of_boxes(entries);
        let home = |place| Home { node: 0, place, stray: false };
        let mut tree = Self {
            knobs,
            nodes: Vec::new(),
            homes: (0..entries.len() as u32).map(home).collect(),
            strays: 0,
            free: Vec::new(),
            rebuilt: Vec::new(),
            work: Work::default(),
        };
        let root = tree.node_for(space, NONE, 0) as usize;
        tree.nodes[root].objects = (0..entries.len() as u32).map(ObjectId).collect();
        tree.nodes[root].subtree_objects = entries.len() as u32;
        tree.rebuilt.clear();
        tree
    }

    /// An empty leaf, under a number out of use where there is one.
    fn node_for(&mut self, space: Aabb, parent: u32, depth: u8) -> u32 {
        let node = IrregularNode {
            space,
            split: None,
            children: [NONE; 8],
            objects: Vec::new(),
            parent,
            subtree_objects: 0,
            depth,
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

    /// The octant that holds the box whole; `None` where a plane through `split` crosses it.
    fn octant(&self, split: DVec3, bounds: &Aabb) -> Option<usize> {
        let mut octant = 0;
        for (bit, &axis) in self.knobs.split.axes().iter().enumerate() {
            if bounds.min[axis] >= split[axis] {
                octant |= 1 << bit;
            } else if bounds.max[axis] > split[axis] {
                return None;
            }
        }
        Some(octant)
    }

    fn child_space(&self, node: u32, split: DVec3, octant: usize) -> Aabb {
        self.knobs.split.part(&self.nodes[node as usize].space, split, octant)
    }

    /// What may go below a node: no empty box, and none that sticks out of the root.
    fn may_sink(&self, id: ObjectId, boxes: &[Aabb]) -> bool {
        !boxes[id.0 as usize].is_empty() && !self.homes[id.0 as usize].stray
    }

    /// Where a leaf is to be parted: at the mean of its objects' middles. `None` where that would hand down
    /// nothing, or everything to one child, without end.
    fn split_for(&self, node: u32, boxes: &[Aabb]) -> Option<DVec3> {
        let this = &self.nodes[node as usize];
        if this.objects.len() <= self.knobs.capacity as usize || this.depth >= self.knobs.max_depth
        {
            return None;
        }
        let able = || this.objects.iter().filter(|&&id| self.may_sink(id, boxes));
        let sum: DVec3 = able().map(|id| boxes[id.0 as usize].center()).sum();
        let split = (sum / able().count().max(1) as f64).clamp(this.space.min, this.space.max);
        let mut shares = [0; 8];
        for octant in able().filter_map(|id| self.octant(split, &boxes[id.0 as usize])) {
            shares[octant] += 1;
        }
        let (down, largest) = (shares.iter().sum::<usize>(), shares.into_iter().max());
        (down > 0 && largest < Some(this.objects.len())).then_some(split)
    }

    /// Hands down what no splitting plane crosses, after parting a leaf that has too many.
    fn lower(&mut self, node: u32, boxes: &[Aabb]) {
        let split = match self.nodes[node as usize].split {
            Some(split) => split,
            None => match self.split_for(node, boxes) {
                Some(split) => split,
                None => return,
            },
        };
        self.nodes[node as usize].split = Some(split);
        let objects = std::mem::take(&mut self.nodes[node as usize].objects);
        let mut kept = Vec::new();
        for id in objects {
            let octant = if self.may_sink(id, boxes) {
                self.octant(split, &boxes[id.0 as usize])
            } else {
                None
            };
            let Some(octant) = octant else {
                self.homes[id.0 as usize].place = kept.len() as u32;
                kept.push(id);
                continue;
            };
            let mut child = self.nodes[node as usize].children[octant];
            if child == NONE {
                let depth = self.nodes[node as usize].depth + 1;
                child = self.node_for(self.child_space(node, split, octant), node, depth);
                self.nodes[node as usize].children[octant] = child;
            }
            let below = &mut self.nodes[child as usize];
            let home = &mut self.homes[id.0 as usize];
            (home.node, home.place) = (child, below.objects.len() as u32);
            below.objects.push(id);
            below.subtree_objects += 1;
            self.work.lowered += 1;
        }
        self.nodes[node as usize].objects = kept;
    }

    /// Makes a node below which nothing is left a leaf.
    fn prune(&mut self, node: u32) {
        let this = &mut self.nodes[node as usize];
        if this.split.is_none() || this.subtree_objects as usize > this.objects.len() {
            return;
        }
        this.split = None;
        let mut stack = std::mem::replace(&mut this.children, [NONE; 8]).to_vec();
        while let Some(child) = stack.pop() {
            if child != NONE {
                stack.extend(self.nodes[child as usize].children);
                self.free.push(child);
            }
        }
    }

    /// Takes an object out and hangs it at the root.
    fn reinsert(&mut self, id: ObjectId, bounds: &Aabb) {
        let Home { node, place, stray } = self.homes[id.0 as usize];
        if node != 0 {
            let objects = &mut self.nodes[node as usize].objects;
            objects.swap_remove(place as usize);
            if let Some(&moved) = objects.get(place as usize) {
                self.homes[moved.0 as usize].place = place;
            }
            let mut at = node;
            while at != 0 {
                self.work.steps += 1;
                self.nodes[at as usize].subtree_objects -= 1;
                at = self.nodes[at as usize].parent;
            }
            let objects = &mut self.nodes[0].objects;
            let home = &mut self.homes[id.0 as usize];
            (home.node, home.place) = (0, objects.len() as u32);
            objects.push(id);
        }
        self.work.updates += 1;
        let sticks_out = !bounds.is_empty() && !self.nodes[0].space.contains(bounds);
        self.strays = self.strays - u32::from(stray) + u32::from(sticks_out);
        self.homes[id.0 as usize].stray = sticks_out;
    }

    fn walk(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut dyn FnMut(&[ObjectId])) {
        let mut stack = vec![(0, Planes::ALL)];
        while let Some((node, planes)) = stack.pop() {
            self.work.node_checks += 1;
            let straddled = match self.query_box(node) {
                Some(space) if !planes.is_empty() => volume.straddled(&space, planes),
                _ => Some(planes),
            };
            let Some(planes) = straddled else { continue };
            self.prune(node);
            if !planes.is_empty() {
                self.lower(node, boxes);
            }
            let this = &self.nodes[node as usize];
            found(&this.objects);
            let full =
                |&child: &u32| child != NONE && self.nodes[child as usize].subtree_objects > 0;
            stack.extend(this.children.into_iter().filter(full).map(|child| (child, planes)));
        }
    }

    fn query_box(&self, node: u32) -> Option<Aabb> {
        (node != 0 || self.strays == 0).then(|| self.nodes[node as usize].space)
    }

    fn check_node(&self, number: u32, boxes: &[Aabb], seen: &mut [u32]) -> Result<(), String> {
        let node = &self.nodes[number as usize];
        let mut below = node.objects.len() as u32;
        for (octant, &child) in node.children.iter().enumerate().filter(|(_, c)| **c != NONE) {
            let this = &self.nodes[child as usize];
            below += this.subtree_objects;
            let space = node.split.map(|split| self.child_space(number, split, octant));
            if this.parent != number || this.depth != node.depth + 1 || space != Some(this.space) {
                return Err(format!("node {child} is not in octant {octant} of {number}"));
            }
        }
        if node.subtree_objects != below {
            return Err(format!("node {number} counts {} objects", node.subtree_objects));
        }
        for (place, &id) in node.objects.iter().enumerate() {
            seen[id.0 as usize] += 1;
            let home = self.homes[id.0 as usize];
            if (home.node, home.place as usize) != (number, place) {
                return Err(format!("object {} hangs at {number} and elsewhere", id.0));
            }
            let bounds = &boxes[id.0 as usize];
            let inside = bounds.is_empty() || node.space.contains(bounds);
            if inside == home.stray || (home.stray && number != 0) {
                return Err(format!("object {} sticks out of node {number}", id.0));
            }
        }
        Ok(())
    }
}

impl Index for IrregularOctree {
    fn name(&self) -> &'static str {
        ["irregular-octree", "irregular-quadtree"]
            [usize::from(self.knobs.split == super::Split::Quadrants)]
    }

    fn update(&mut self, moves: Moves<'_>) {
        self.rebuilt.clear();
        for &id in moves.moved {
            self.reinsert(id, moves.bounds(id));
        }
    }

    fn refine(&mut self, boxes: &[Aabb], volume: &Volume) {
        self.walk(boxes, volume, &mut |_| {});
    }

    /// All objects of the nodes that meet the volume.
    fn find(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>) {
        self.walk(boxes, volume, &mut |objects| found.extend_from_slice(objects));
    }

    fn work(&self) -> Work {
        self.work
    }

    fn heap_bytes(&self) -> usize {
        let objects: usize = self.nodes.iter().map(|node| node.objects.capacity()).sum();
        self.nodes.capacity() * size_of::<IrregularNode>()
            + objects * size_of::<ObjectId>()
            + self.homes.capacity() * size_of::<Home>()
            + (self.free.capacity() + self.rebuilt.capacity()) * 4
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
            query_box: self.query_box(node.0),
            tight_box: None,
            objects: &this.objects,
            subtree_objects: this.subtree_objects,
        }
    }

    /// Nearer octants first. Objects of the node itself straddle its planes, or wait to be handed down: they
    /// may be anywhere among them.
    fn children(&self, node: NodeId, eye: DVec3, out: &mut Vec<NodeId>) -> usize {
        let IrregularNode { split, children, .. } = &self.nodes[node.0 as usize];
        let Some(split) = *split else { return 0 };
        let nearest = self.knobs.split.octant(split, eye);
        let before = out.len();
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
        each_once(&seen)
    }
}

#[cfg(test)]
mod tests {
    use plainsight_reference::DepthOrder;

    use super::super::Split;
    use super::*;

    fn cube(at: f64, half: f64) -> Entry {
        let bounds = Aabb::new(DVec3::splat(at - half), DVec3::splat(at + half));
        Entry { bounds, step_bound: 1.0, reach: half }
    }

    /// Objects stay at the root until somebody looks, and what moved is there again.
    #[test]
    fn objects_go_down_when_looked_at() {
        let entries = [0.1, 0.2, 0.3, 0.9, 0.35].map(|at| cube(at, 0.01));
        let mut boxes = entries.map(|entry| entry.bounds);
        let knobs = TreeKnobs {
            capacity: 2,
            max_depth: TreeKnobs::DEEPEST,
            ..TreeKnobs::usual(Split::Octants, 0)
        };
        let mut tree = IrregularOctree::new(&entries, knobs);
        assert_eq!(tree.node(NodeId(0)).objects.len(), 5);
        // From -1 to 1: all are in it, but the root's box is not inside.
        let clip = glam::DMat4::from_translation(DVec3::new(0.0, 0.0, -0.5));
        let volume = Volume::new(&clip, DepthOrder::Forward);
        tree.refine(&boxes, &volume);
        tree.check(&boxes).unwrap();
        // The mean is 0.37; four are below it, and their mean is 0.2375.
        assert_eq!(tree.node(NodeId(0)).objects, []);
        assert_eq!(tree.nodes[0].split, Some(DVec3::splat(1.85 / 5.0)));
        boxes[3] = cube(0.36, 0.01).bounds;
        let moved = [ObjectId(3)];
        tree.update(Moves { boxes: &boxes, moved: &moved, jumped: &[] });
        assert_eq!(tree.node(NodeId(0)).objects, moved);
        tree.check(&boxes).unwrap();
    }

    /// Objects in one place do not part a node for ever, nor do those that every plane crosses.
    #[test]
    fn what_cannot_be_parted_is_not() {
        for entries in [[cube(0.5, 0.0); 6], [cube(0.5, 0.2); 6]] {
            let knobs = TreeKnobs { capacity: 2, ..TreeKnobs::usual(Split::Octants, 0) };
            let mut tree = IrregularOctree::new(&entries, knobs);
            let boxes = entries.map(|entry| entry.bounds);
            tree.refine(&boxes, &Volume::new(&glam::DMat4::IDENTITY, DepthOrder::Forward));
            assert_eq!(tree.top_down().len(), 1);
        }
    }
}
