//! Octree 4 of Wortel 2011 (section 3.4), the loose octree of Ulrich 2000 (*Loose octrees*, Game
//! Programming Gems): an object's middle says in which node it hangs and its largest half side how deep,
//! so that it changes nodes only where its middle crosses a border. A node's box is its space with a
//! share of its longest side added all round; an object goes to the deepest level whose share is not less
//! than its half side.
//!
//! An object alone in a leaf may hang higher than it belongs: no nodes are made for it alone, and the leaf
//! is looked at by its box. With depth reduction updates leave things higher, and finding moves them down
//! where a node is partly seen.
//!
//! From the thesis's future work: node sizes that shrink by another ratio than a half from level to level,
//! and boxes that grow by the largest object at and below the node instead of the level's share.

use glam::DVec3;

use super::tree::{Rules, Thing, Tree};
use super::{Entry, Index, MIDDLE_ROUNDING, TreeKnobs};
use crate::math::Aabb;

/// What Octree 4 can be told beside [`TreeKnobs`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LooseKnobs {
    /// What is added to a node's space, of what is added a level above; above 0, at most 1. A half keeps it
    /// a share of the node.
    pub shrink: f64,
    /// Whether the largest object at and below a node is added to it, instead of the level's share.
    pub largest: bool,
}

impl Default for LooseKnobs {
    fn default() -> Self {
        Self { shrink: 0.5, largest: false }
    }
}

/// By the middle of a box and its largest half side.
#[derive(Clone, Debug)]
struct Loose {
    names: [&'static str; 2],
    /// By depth, what is added.
    added: Vec<f64>,
    largest: bool,
    rounding: f64,
}

impl Loose {
    fn goal(&self, reach: f64) -> usize {
        self.added.iter().rposition(|&added| reach <= added).unwrap_or(0)
    }
}

impl Rules for Loose {
    /// The largest half side at and below.
    type Extent = f64;
    const NOTHING: f64 = 0.0;
    const STOPS_AT_NEW: bool = true;

    fn names(&self) -> [&'static str; 2] {
        self.names
    }

    fn extent(&self, thing: &Thing<'_>) -> f64 {
        if self.largest { thing.reach } else { 0.0 }
    }

    fn owes(&self, own: f64, whole: f64) -> bool {
        self.largest && own >= whole
    }

    fn merged(&self, a: f64, b: f64) -> f64 {
        a.max(b)
    }

    fn volume(&self, space: &Aabb, depth: u8, extent: &f64) -> Aabb {
        let added = if self.largest { *extent } else { self.added[usize::from(depth)] };
        space.grown(DVec3::splat(added + self.rounding))
    }

    fn holds(&self, space: &Aabb, depth: u8, thing: &Thing<'_>, _: bool) -> bool {
        thing.reach <= self.added[usize::from(depth)] && space.contains_point(thing.at)
    }

    fn below(&self, depth: u8, _: usize, thing: &Thing<'_>, reduction: u8) -> bool {
        usize::from(depth) + usize::from(reduction) < self.goal(thing.reach)
    }
}

/// Octree 4, or its quadtree. Takes all knobs but the capacity and the start depth.
#[must_use]
pub fn loose_octree(entries: &[Entry], knobs: TreeKnobs, loose: LooseKnobs) -> Box<dyn Index> {
    let knobs = TreeKnobs { leaf_boxes: true, ..knobs };
    Box::new(Tree::new(entries, knobs, |space| {
        let sides = match knobs.split {
            super::Split::Octants => space.size(),
            super::Split::Quadrants => space.size() * DVec3::new(1.0, 0.0, 1.0),
        };
        let mut added = vec![sides.max_element() / knobs.size_divisor];
        for depth in 0..usize::from(knobs.max_depth) {
            added.push(added[depth] * loose.shrink);
        }
        let far = space.max_abs().max_element() + added[0];
        Loose {
            names: ["loose-octree", "loose-quadtree"],
            added,
            largest: loose.largest,
            rounding: far * MIDDLE_ROUNDING,
        }
    }))
}
