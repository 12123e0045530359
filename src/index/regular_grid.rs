//! A regular grid, the index of Batagelo & Wu 2002 (*Dynamic scene occlusion culling using a regular grid*;
//! Wortel 2011, section 2.2): one level of cells over the space, whose cells are all children of the root.
//! Moving an object is quick; there is no hierarchy to pass over many cells at once. Theirs is used with
//! temporal bounding volumes, which are [`TemporalVolumes`](super::TemporalVolumes)' share.
//!
//! 1. An object hangs at the cell that its middle is in, or at the nearest where it left the space. A
//!    cell's box is that of its objects: grown in updates, made anew when it is looked at. So no object is
//!    in two cells, as in the source, and none is beyond the grid.
//! 2. Finding: every cell with objects is looked at; all of one that meets the volume are found.
//!
//! Cost: an update O(1) an object that moved; finding O(cells). It loses where the view shows a small part of
//! a large space. It must not know scenes or cameras.

use std::borrow::Cow;

use glam::DVec3;

use super::{Entry, GridKnobs, Index, Moves, Node, NodeId, Work, each_once, space_of_middles};
use crate::math::{Aabb, Planes, Volume};
use crate::part::ObjectId;

/// The most cells along all axes together, as a power of two.
const MOST_BITS: u32 = 24;

#[derive(Clone, Copy, Debug)]
struct Home {
    cell: u32,
    /// Place among the cell's objects.
    place: u32,
}

/// The grid. Node 0 is above all cells; cell c is node c + 1.
#[derive(Clone, Debug)]
pub struct RegularGrid {
    min: DVec3,
    /// Sides of a cell; 0 along a flat axis.
    size: DVec3,
    /// Cells along each axis.
    counts: [u32; 3],
    cells: Vec<Vec<ObjectId>>,
    /// By cell: holds the boxes of its objects.
    boxes: Vec<Aabb>,
    /// By cell: whether its box may be larger than it need be.
    loose: Vec<bool>,
    homes: Vec<Home>,
    rebuilt: Vec<NodeId>,
    work: Work,
}

impl RegularGrid {
    /// Over the boxes of frame 0.
    #[must_use]
    pub fn new(entries: &[Entry], knobs: GridKnobs) -> Self {
        let space = space_of_middles(entries);
        // The longest side of a cell is halved until there are enough.
        let (mut size, mut counts, mut bits) = (space.size(), [1_u32; 3], 0);
        while f64::from(1_u32 << bits) * knobs.per_cell < entries.len() as f64
            && size.max_element() > 0.0
            && bits < MOST_BITS
        {
            let axis = size.max_position();
            size[axis] *= 0.5;
            counts[axis] *= 2;
            bits += 1;
        }
        let cells = 1_usize << bits;
        let mut grid = Self {
            min: space.min,
            size,
            counts,
            cells: vec![Vec::new(); cells],
            boxes: vec![Aabb::EMPTY; cells],
            loose: vec![false; cells],
            homes: vec![Home { cell: 0, place: 0 }; entries.len()],
            rebuilt: Vec::new(),
            work: Work::default(),
        };
        for (id, entry) in (0..).map(ObjectId).zip(entries) {
            grid.link(id, grid.cell_at(entry.bounds.center()), &entry.bounds);
        }
        grid.rebuilt.clear();
        grid
    }

    /// The cell that the point is in or nearest to.
    fn cell_at(&self, at: DVec3) -> u32 {
        let place = (at - self.min) / self.size;
        // A side of no length has one cell; casts take what is not a number for 0.
        let along = |axis: usize| (place[axis] as u32).min(self.counts[axis] - 1);
        let [x, y, z] = [0, 1, 2].map(along);
        x + self.counts[0] * (y + self.counts[1] * z)
    }

    fn link(&mut self, id: ObjectId, cell: u32, bounds: &Aabb) {
        let objects = &mut self.cells[cell as usize];
        if objects.is_empty() {
            self.rebuilt.push(NodeId(cell + 1));
        }
        self.homes[id.0 as usize] = Home { cell, place: objects.len() as u32 };
        objects.push(id);
        let whole = &mut self.boxes[cell as usize];
        *whole = whole.union(bounds);
    }

    fn unlink(&mut self, id: ObjectId) {
        let Home { cell, place } = self.homes[id.0 as usize];
        let objects = &mut self.cells[cell as usize];
        objects.swap_remove(place as usize);
        if let Some(&moved) = objects.get(place as usize) {
            self.homes[moved.0 as usize].place = place;
        }
        self.loose[cell as usize] = true;
        if objects.is_empty() {
            self.boxes[cell as usize] = Aabb::EMPTY;
            self.loose[cell as usize] = false;
        }
    }

    /// Of `volume`, what the cell meets, once its box is what its objects need.
    fn look_at(&mut self, cell: usize, boxes: &[Aabb], volume: &Volume) -> Option<Planes> {
        self.work.node_checks += 1;
        let planes = volume.straddled(&self.boxes[cell], Planes::ALL)?;
        if planes.is_empty() || !self.loose[cell] {
            return Some(planes);
        }
        let all = self.cells[cell].iter().map(|id| &boxes[id.0 as usize]);
        self.boxes[cell] = all.fold(Aabb::EMPTY, |all, one| all.union(one));
        self.loose[cell] = false;
        volume.straddled(&self.boxes[cell], Planes::ALL)
    }
}

impl Index for RegularGrid {
    fn name(&self) -> &'static str {
        "regular-grid"
    }

    fn update(&mut self, moves: Moves<'_>) {
        self.rebuilt.clear();
        for &id in moves.moved {
            let bounds = moves.bounds(id);
            let (from, to) = (self.homes[id.0 as usize].cell, self.cell_at(bounds.center()));
            if from == to {
                self.work.ok += 1;
                let whole = &mut self.boxes[to as usize];
                *whole = whole.union(bounds);
                self.loose[to as usize] = true;
            } else {
                self.work.updates += 1;
                self.unlink(id);
                self.link(id, to, bounds);
            }
        }
    }

    fn refine(&mut self, boxes: &[Aabb], volume: &Volume) {
        for cell in 0..self.cells.len() {
            if !self.cells[cell].is_empty() {
                self.look_at(cell, boxes, volume);
            }
        }
    }

    /// All objects of the cells that meet the volume.
    fn find(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>) {
        for cell in 0..self.cells.len() {
            if !self.cells[cell].is_empty() && self.look_at(cell, boxes, volume).is_some() {
                found.extend_from_slice(&self.cells[cell]);
            }
        }
    }

    fn work(&self) -> Work {
        self.work
    }

    fn heap_bytes(&self) -> usize {
        let objects: usize = self.cells.iter().map(Vec::capacity).sum();
        let a_cell = size_of::<Vec<ObjectId>>() + size_of::<Aabb>() + size_of::<bool>();
        self.cells.len() * a_cell
            + objects * size_of::<ObjectId>()
            + self.homes.capacity() * size_of::<Home>()
            + self.rebuilt.capacity() * size_of::<NodeId>()
    }

    fn rebuilt(&self) -> &[NodeId] {
        &self.rebuilt
    }

    fn top_down(&self) -> Cow<'_, [NodeId]> {
        let mut order = vec![NodeId(0)];
        let full = (1..).zip(&self.cells).filter(|(_, objects)| !objects.is_empty());
        order.extend(full.map(|(node, _)| NodeId(node)));
        Cow::Owned(order)
    }

    fn node_count(&self) -> u32 {
        self.cells.len() as u32 + 1
    }

    fn node(&self, node: NodeId) -> Node<'_> {
        let Some(cell) = node.0.checked_sub(1).map(|cell| cell as usize) else {
            let subtree_objects = self.homes.len() as u32;
            return Node { query_box: None, tight_box: None, objects: &[], subtree_objects };
        };
        let objects = self.cells[cell].as_slice();
        let subtree_objects = objects.len() as u32;
        let query_box = Some(self.boxes[cell]).filter(|aabb| !aabb.is_empty());
        Node { query_box, tight_box: None, objects, subtree_objects }
    }

    /// Nearer boxes first.
    fn children(&self, node: NodeId, eye: DVec3, out: &mut Vec<NodeId>) -> usize {
        if node != NodeId(0) {
            return 0;
        }
        let distance = |node: &NodeId| {
            let Aabb { min, max } = self.boxes[node.0 as usize - 1];
            // Not clamped: the box of a cell with empty boxes alone has no order of its corners.
            eye.distance_squared(eye.max(min).min(max))
        };
        let full = (1..).zip(&self.cells).filter(|(_, objects)| !objects.is_empty());
        let mut order: Vec<(f64, NodeId)> =
            full.map(|(node, _)| NodeId(node)).map(|node| (distance(&node), node)).collect();
        order.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        out.extend(order.iter().map(|&(_, node)| node));
        order.len()
    }

    fn parent(&self, node: NodeId) -> Option<NodeId> {
        (node != NodeId(0)).then_some(NodeId(0))
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        let mut seen = vec![0_u32; boxes.len()];
        for (number, objects) in (0..).zip(&self.cells) {
            for (place, &id) in (0..).zip(objects) {
                seen[id.0 as usize] += 1;
                let home = self.homes[id.0 as usize];
                if (home.cell, home.place) != (number, place) {
                    return Err(format!("object {} lies in cell {number} and elsewhere", id.0));
                }
                let bounds = &boxes[id.0 as usize];
                if self.cell_at(bounds.center()) != number {
                    return Err(format!("object {} does not belong in cell {number}", id.0));
                }
                if !self.boxes[number as usize].contains(bounds) {
                    return Err(format!("object {} sticks out of cell {number}", id.0));
                }
            }
        }
        let slack = (0..).zip(&self.boxes).find(|&(number, whole): &(usize, &Aabb)| {
            // Only a box that is marked may be larger than its objects need.
            let all = self.cells[number].iter().map(|id| &boxes[id.0 as usize]);
            !self.loose[number] && all.fold(Aabb::EMPTY, |all, one| all.union(one)) != *whole
        });
        if let Some((number, _)) = slack {
            return Err(format!("the box of cell {number} is not that of its objects"));
        }
        each_once(&seen)
    }
}
