//! Octree 3, 3b and 3bR of Wortel 2011 (section 3.3): a bucket octree over the middles of boxes. A node
//! takes up to so many objects, the first on the way down with room, from a start depth on; what its box is
//! depends on what hangs at and below it:
//!
//! - **3** (`bounds`): the union of the objects' boxes, grown in updates, shrunk when it is looked at;
//! - **3b** (`extents`): its space with the largest half sides at and below it added, axis by axis;
//! - **3bR** (`radius`): its space with the largest half side of all axes and times added, which no turning
//!   changes: the one that can have checklists.
//!
//! With depth reduction updates start higher, and finding moves things down to the start depth. The
//! thesis's extents are from an object's place to either side of it; here its place is the middle of its
//! box, so that both are the same.

use glam::DVec3;

use super::tree::{Rules, Thing, Tree};
use super::{Entry, Index, MIDDLE_ROUNDING, TreeKnobs};
use crate::math::Aabb;

/// Who fits in a bucket, and where.
#[derive(Clone, Copy, Debug)]
struct Buckets {
    capacity: usize,
    start_depth: u8,
    rounding: f64,
}

impl Buckets {
    fn new(knobs: &TreeKnobs, space: &Aabb) -> Self {
        Self {
            capacity: knobs.capacity.max(1) as usize,
            start_depth: knobs.start_depth.min(knobs.max_depth),
            rounding: space.max_abs().max_element() * MIDDLE_ROUNDING,
        }
    }

    fn below(&self, depth: u8, count: usize, reduction: u8) -> bool {
        depth < self.start_depth.saturating_sub(reduction) || count >= self.capacity
    }
}

/// Octree 3.
#[derive(Clone, Debug)]
struct Bounds(Buckets);

impl Rules for Bounds {
    type Extent = Aabb;
    const NOTHING: Aabb = Aabb::EMPTY;
    const LAZY_EXTENT: bool = true;

    fn names(&self) -> [&'static str; 2] {
        ["bounds-octree", "bounds-quadtree"]
    }

    fn extent(&self, thing: &Thing<'_>) -> Aabb {
        *thing.bounds
    }

    fn owes(&self, _: Aabb, _: Aabb) -> bool {
        // It shrinks when it is looked at.
        false
    }

    fn merged(&self, a: Aabb, b: Aabb) -> Aabb {
        a.union(&b)
    }

    fn volume(&self, _: &Aabb, _: u8, extent: &Aabb) -> Aabb {
        *extent
    }

    fn holds(&self, space: &Aabb, _: u8, thing: &Thing<'_>, _: bool) -> bool {
        space.contains_point(thing.at)
    }

    fn below(&self, depth: u8, count: usize, _: &Thing<'_>, reduction: u8) -> bool {
        self.0.below(depth, count, reduction)
    }
}

/// Octree 3b.
#[derive(Clone, Debug)]
struct Extents(Buckets);

impl Rules for Extents {
    type Extent = DVec3;
    const NOTHING: DVec3 = DVec3::ZERO;

    fn names(&self) -> [&'static str; 2] {
        ["extents-octree", "extents-quadtree"]
    }

    fn extent(&self, thing: &Thing<'_>) -> DVec3 {
        thing.bounds.size() * 0.5
    }

    fn owes(&self, own: DVec3, whole: DVec3) -> bool {
        own.cmpge(whole).any()
    }

    fn merged(&self, a: DVec3, b: DVec3) -> DVec3 {
        a.max(b)
    }

    fn volume(&self, space: &Aabb, _: u8, extent: &DVec3) -> Aabb {
        space
            .grown(*extent + DVec3::splat(self.0.rounding + extent.max_element() * MIDDLE_ROUNDING))
    }

    fn holds(&self, space: &Aabb, _: u8, thing: &Thing<'_>, _: bool) -> bool {
        space.contains_point(thing.at)
    }

    fn below(&self, depth: u8, count: usize, _: &Thing<'_>, reduction: u8) -> bool {
        self.0.below(depth, count, reduction)
    }
}

/// Octree 3bR.
#[derive(Clone, Debug)]
struct Radius(Buckets);

impl Rules for Radius {
    type Extent = f64;
    const NOTHING: f64 = 0.0;

    fn names(&self) -> [&'static str; 2] {
        ["radius-octree", "radius-quadtree"]
    }

    fn extent(&self, thing: &Thing<'_>) -> f64 {
        thing.reach
    }

    fn owes(&self, own: f64, whole: f64) -> bool {
        own >= whole
    }

    fn merged(&self, a: f64, b: f64) -> f64 {
        a.max(b)
    }

    fn volume(&self, space: &Aabb, _: u8, extent: &f64) -> Aabb {
        space.grown(DVec3::splat(extent + self.0.rounding))
    }

    fn holds(&self, space: &Aabb, _: u8, thing: &Thing<'_>, _: bool) -> bool {
        space.contains_point(thing.at)
    }

    fn below(&self, depth: u8, count: usize, _: &Thing<'_>, reduction: u8) -> bool {
        self.0.below(depth, count, reduction)
    }
}

/// Octree 3, or its quadtree. Takes all knobs but the size divisor and checklists.
#[must_use]
pub fn bounds_octree(entries: &[Entry], knobs: TreeKnobs) -> Box<dyn Index> {
    let knobs = TreeKnobs { checklists: false, ..knobs };
    Box::new(Tree::new(entries, knobs, |space| Bounds(Buckets::new(&knobs, space))))
}

/// Octree 3b, or its quadtree. Takes all knobs but the size divisor and checklists.
#[must_use]
pub fn extents_octree(entries: &[Entry], knobs: TreeKnobs) -> Box<dyn Index> {
    let knobs = TreeKnobs { checklists: false, ..knobs };
    Box::new(Tree::new(entries, knobs, |space| Extents(Buckets::new(&knobs, space))))
}

/// Octree 3bR, or its quadtree. Takes all knobs but the size divisor.
#[must_use]
pub fn radius_octree(entries: &[Entry], knobs: TreeKnobs) -> Box<dyn Index> {
    Box::new(Tree::new(entries, knobs, |space| Radius(Buckets::new(&knobs, space))))
}
