//! The promises that every index makes, whatever it is: looked at from outside, through its nodes alone. What
//! a walk of a culler relies on, and no more; what an index promises beyond stands in its own check.
//!
//! 1. Links go both ways: a child's parent is the node that names it; [`Index::top_down`] lists exactly the
//!    nodes that are reached from the root, parents first, under numbers below [`Index::node_count`].
//! 2. Every object hangs at exactly one node, and every node counts what hangs at and below it.
//! 3. The box of a node, and its tight box, hold every object at and below it, however deep.
//! 4. Finding misses nothing that a look at every box finds, and names nothing twice ([`missed`]).
//!
//! Cost: O(nodes + objects).

use glam::DVec3;

use super::{Index, NodeId};
use crate::math::{Aabb, Volume};
use crate::part::ObjectId;

/// How large and deep an index is, for those who ask whether a limit was reached.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shape {
    /// Nodes that are reached from the root.
    pub nodes: u32,
    /// Levels below the root.
    pub depth: u32,
    /// Most objects at one node.
    pub fullest: u32,
    /// Whether things stick out of the root's box.
    pub strays: bool,
}

impl Shape {
    /// The larger of each figure.
    #[must_use]
    pub fn larger(self, other: Self) -> Self {
        Self {
            nodes: self.nodes.max(other.nodes),
            depth: self.depth.max(other.depth),
            fullest: self.fullest.max(other.fullest),
            strays: self.strays || other.strays,
        }
    }
}

/// Whether every promise of any index holds, with the objects in these boxes.
///
/// # Errors
/// The first broken promise, in words.
pub fn promises(index: &dyn Index, boxes: &[Aabb]) -> Result<Shape, String> {
    let order = index.top_down();
    let count = index.node_count() as usize;
    let mut depth = vec![None; count];
    let mut seen = vec![0_u32; boxes.len()];
    let mut shape = Shape { nodes: order.len() as u32, ..Shape::default() };
    if order.first() != Some(&NodeId(0)) {
        return Err("the root is not the first node".to_owned());
    }
    depth[0] = Some(0);
    let mut children = Vec::new();
    for &node in order.iter() {
        let Some(own) = depth.get(node.0 as usize).copied().flatten() else {
            return Err(format!("node {} is listed and not reached", node.0));
        };
        shape.depth = shape.depth.max(own);
        children.clear();
        let before = index.children(node, DVec3::ZERO, &mut children);
        if before > children.len() {
            return Err(format!("node {} has {before} children before its objects", node.0));
        }
        for child in &children {
            if index.parent(*child) != Some(node) {
                return Err(format!("node {} does not know its parent {}", child.0, node.0));
            }
            match depth.get_mut(child.0 as usize) {
                Some(place @ None) => *place = Some(own + 1),
                _ => return Err(format!("node {} is reached twice, or numbered beyond", child.0)),
            }
        }
        let objects = index.node(node).objects;
        shape.fullest = shape.fullest.max(objects.len() as u32);
        objects.iter().for_each(|object| seen[object.0 as usize] += 1);
    }
    let reached = depth.iter().flatten().count();
    if reached != order.len() {
        return Err(format!("{reached} nodes are reached and {} listed", order.len()));
    }
    super::each_once(&seen)?;
    shape.strays = index.node(NodeId(0)).query_box.is_none();
    hold_contents(index, boxes, &order)?;
    Ok(shape)
}

/// Whether counts and boxes are those of what hangs at and below each node.
fn hold_contents(index: &dyn Index, boxes: &[Aabb], order: &[NodeId]) -> Result<(), String> {
    let count = index.node_count() as usize;
    let mut below = vec![(0_u32, Aabb::EMPTY); count];
    for &node in order.iter().rev() {
        let this = index.node(node);
        let (mut objects, mut contents) = below[node.0 as usize];
        objects += this.objects.len() as u32;
        for object in this.objects {
            contents = contents.union(&boxes[object.0 as usize]);
        }
        if this.subtree_objects != objects {
            let said = this.subtree_objects;
            return Err(format!("node {} counts {said} objects and has {objects}", node.0));
        }
        for (what, aabb) in [("box", this.query_box), ("tight box", this.tight_box)] {
            if aabb.is_some_and(|aabb| !contents.is_empty() && !aabb.contains(&contents)) {
                return Err(format!("the {what} of node {} does not hold its contents", node.0));
            }
        }
        if let Some(parent) = index.parent(node) {
            let (sum, whole) = &mut below[parent.0 as usize];
            *sum += objects;
            *whole = whole.union(&contents);
        }
    }
    Ok(())
}

/// Whether [`Index::find`] names all objects whose boxes meet the volume, and none twice.
///
/// # Errors
/// The first object that is missed or named twice.
pub fn missed(index: &mut dyn Index, boxes: &[Aabb], volume: &Volume) -> Result<(), String> {
    let mut found = Vec::new();
    index.find(boxes, volume, &mut found);
    let mut times = vec![0_u8; boxes.len()];
    for object in found {
        let times = &mut times[object.0 as usize];
        *times = times.saturating_add(1);
    }
    let wrong = |(&times, aabb): (&u8, &Aabb)| times > 1 || (times == 0 && volume.touches(aabb));
    match times.iter().zip(boxes).position(wrong) {
        None => Ok(()),
        Some(object) if times[object] > 1 => {
            Err(format!("{:?} is found twice", ObjectId(object as u32)))
        }
        Some(object) => Err(format!("object {object} meets the view and is not found")),
    }
}
