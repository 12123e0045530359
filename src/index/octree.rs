//! Octree 1 and Octree 2 of Wortel 2011 (sections 3.1 and 3.2): every object hangs at the smallest node
//! whose box holds it. In the first a node's box is its space, so what straddles a middle plane stays high;
//! in the second boxes are larger by a share of their size, overlap, and let objects deeper. The first is
//! the second with nothing added.
//!
//! An object that has moved sinks as soon as a child holds it. Climbing, spaces are asked and not the
//! larger boxes, so that it can sink deeper again.
//!
//! From the thesis's future work: depth reduction, by a smaller greatest depth in updates, and leaves with
//! one object looked at by its box. Checklists do not fit: what may sink has no distance from a border.

use super::tree::{Rules, Thing, Tree};
use super::{Entry, Index, TreeKnobs};
use crate::math::Aabb;

/// By the smallest box that holds an object.
#[derive(Clone, Debug)]
struct Fit {
    names: [&'static str; 2],
    /// Of the size of a space, what is added on either side.
    added: f64,
    max_depth: u8,
}

impl Fit {
    fn box_of(&self, space: &Aabb) -> Aabb {
        space.grown(space.size() * self.added)
    }
}

impl Rules for Fit {
    type Extent = ();
    const NOTHING: () = ();
    const SINKS: bool = true;

    fn names(&self) -> [&'static str; 2] {
        self.names
    }

    fn extent(&self, _: &Thing<'_>) {}

    fn owes(&self, (): (), (): ()) -> bool {
        false
    }

    fn merged(&self, (): (), (): ()) {}

    fn volume(&self, space: &Aabb, _: u8, (): &()) -> Aabb {
        self.box_of(space)
    }

    fn holds(&self, space: &Aabb, _: u8, thing: &Thing<'_>, above: bool) -> bool {
        if above { space.contains(thing.bounds) } else { self.box_of(space).contains(thing.bounds) }
    }

    fn below(&self, depth: u8, _: usize, _: &Thing<'_>, reduction: u8) -> bool {
        depth < self.max_depth.saturating_sub(reduction)
    }
}

/// Octree 1, or its quadtree. Takes the split, the greatest depth, the reduction and leaf boxes.
#[must_use]
pub fn octree(entries: &[Entry], knobs: TreeKnobs) -> Box<dyn Index> {
    build(["octree", "quadtree"], entries, TreeKnobs { size_divisor: f64::INFINITY, ..knobs })
}

/// Octree 2, or its quadtree. Takes the size divisor too.
#[must_use]
pub fn overlapping_octree(entries: &[Entry], knobs: TreeKnobs) -> Box<dyn Index> {
    build(["overlapping-octree", "overlapping-quadtree"], entries, knobs)
}

fn build(names: [&'static str; 2], entries: &[Entry], knobs: TreeKnobs) -> Box<dyn Index> {
    let TreeKnobs { size_divisor, max_depth, .. } = knobs;
    let added = if size_divisor > 0.0 { 1.0 / size_divisor } else { 0.0 };
    let knobs = TreeKnobs { checklists: false, ..knobs };
    Box::new(Tree::new(entries, knobs, |_| Fit { names, added, max_depth }))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::super::Split;
    use super::*;
    use crate::math::Volume;
    use crate::part::ObjectId;

    /// What straddles the middle hangs at the root of the one and below that of the other.
    #[test]
    fn overlap_lets_straddlers_sink() {
        let cube = |at: f64, half: f64| {
            let bounds = Aabb::new(DVec3::splat(at - half), DVec3::splat(at + half));
            Entry { bounds, step_bound: 0.0, reach: half }
        };
        let entries = [cube(0.0, 8.0), cube(0.1, 0.5), cube(7.0, 0.5)];
        let knobs = TreeKnobs { max_depth: 3, ..TreeKnobs::usual(Split::Octants, 3) };
        let at_root = |index: &dyn Index| index.node(super::super::NodeId(0)).objects.to_vec();
        let plain = octree(&entries, knobs);
        assert_eq!(at_root(plain.as_ref()), [ObjectId(0), ObjectId(1)]);
        let mut overlapping = overlapping_octree(&entries, knobs);
        assert_eq!(at_root(overlapping.as_ref()), [ObjectId(0)]);
        // The straddler's node is not far: 4 levels of 16, 8, 4 and 2 units, each half as much on a side.
        let view = glam::DMat4::IDENTITY;
        let volume = Volume::new(&view, plainsight_reference::DepthOrder::Forward);
        let (boxes, mut found) = (entries.map(|entry| entry.bounds), Vec::new());
        overlapping.find(&boxes, &volume, &mut found);
        assert_eq!(found, [ObjectId(0), ObjectId(1)]);
    }
}
