//! The tree over the parts of one mesh: an axis-aligned BSP, nodes in depth-first order, so that a
//! node's children stand after it and leaves appear in the order of their part numbers.

use crate::math::Aabb;

/// A node of an object tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObjectNode {
    /// Tight box, in the object's space, of every position below the node.
    pub bounds: Aabb,
    /// Depth-first numbers of the two children, lower side of the plane first; `None` for a leaf.
    pub children: Option<[u32; 2]>,
    /// Axis (0, 1, 2) and place of the splitting plane; meaningless in a leaf.
    pub plane: (u8, f32),
    /// First of the parts below the node; in a leaf, its part.
    pub first_part: u32,
    /// One beyond the last of the parts below the node.
    pub end_part: u32,
}

/// An object's own tree; node 0 is the root.
#[derive(Clone, Debug)]
pub struct ObjectTree {
    /// Nodes in depth-first order, at least three.
    pub nodes: Vec<ObjectNode>,
}
