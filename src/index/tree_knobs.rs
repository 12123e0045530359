//! What the octrees and quadtrees of Wortel 2011 can be told.

use glam::DVec3;

use crate::math::Aabb;

/// Along which axes a node's space is halved.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Split {
    /// All three: an octree.
    Octants,
    /// x and z: a quadtree over the ground, every node as high as the root.
    Quadrants,
}

impl Split {
    /// Axes, from 0.
    pub(super) const fn axes(self) -> &'static [usize] {
        match self {
            Self::Octants => &[0, 1, 2],
            Self::Quadrants => &[0, 2],
        }
    }

    /// In which octant around `point` another one is: bit a is set for the upper half along the a-th axis.
    #[inline]
    pub(super) fn octant(self, point: DVec3, at: DVec3) -> usize {
        let bit = |(bit, &axis): (usize, &usize)| usize::from(at[axis] >= point[axis]) << bit;
        self.axes().iter().enumerate().map(bit).sum()
    }

    /// The part of a space that is in an octant around a point of it.
    #[inline]
    pub(super) fn part(self, space: &Aabb, point: DVec3, octant: usize) -> Aabb {
        let mut part = *space;
        for (bit, &axis) in self.axes().iter().enumerate() {
            let end = if octant >> bit & 1 == 1 { &mut part.min } else { &mut part.max };
            end[axis] = point[axis];
        }
        part
    }
}

/// What the trees can be told. Each takes what it knows; the rest is for others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TreeKnobs {
    /// Octree or quadtree.
    pub split: Split,
    /// The deepest level that has nodes, from 0 for the root, at most [`TreeKnobs::DEEPEST`].
    pub max_depth: u8,
    /// How much larger than its space a node's box is: by the size of the space divided by this, on either
    /// side. Infinite for not at all.
    pub size_divisor: f64,
    /// Most objects at a node above the deepest level, at least 1.
    pub capacity: u32,
    /// The first level whose nodes have objects.
    pub start_depth: u8,
    /// Levels less that an update moves things down; finding does the rest.
    pub depth_reduction: u8,
    /// Whether objects are looked at only when they may have left their node.
    pub checklists: bool,
    /// Updates ahead that checklists foresee, at least 3; who need not be looked at for longer is looked at
    /// then.
    pub ahead: u32,
    /// Whether a leaf with one object is looked at by the object's box.
    pub leaf_boxes: bool,
}

impl TreeKnobs {
    /// The deepest level of all.
    pub const DEEPEST: u8 = 20;
    /// Updates ahead that checklists foresee where nothing else is said.
    pub const AHEAD: u32 = 256;

    /// For so many objects: about two to a node at the deepest level, were they spread evenly.
    #[must_use]
    pub fn usual(split: Split, objects: usize) -> Self {
        let share = |depth: &u8| objects >> (u32::from(*depth) * split.axes().len() as u32) <= 2;
        let max_depth = (1..Self::DEEPEST).find(share).unwrap_or(Self::DEEPEST);
        Self {
            split,
            max_depth,
            size_divisor: 2.0,
            capacity: 4,
            start_depth: 1,
            depth_reduction: 0,
            checklists: false,
            ahead: Self::AHEAD,
            leaf_boxes: false,
        }
    }

    /// The same with depth reduction by so many levels, and checklists.
    #[must_use]
    pub fn reduced(self, depth_reduction: u8) -> Self {
        Self { depth_reduction, checklists: true, ..self }
    }
}
