//! `lazy-grid`, an index of this project's own for hundreds of thousands of moving objects: grids of 1, 2,
//! 4 … cells along a side, one over the other, so that no node is made or freed. Its parts are known:
//! loose cells (Ulrich 2000; Octree 4 of Wortel 2011), objects left in large cells until somebody looks
//! (depth reduction, section 3.5.1 there) and looked at in updates only when they may have left
//! (checklists, section 3.5.2). What it does otherwise:
//!
//! 1. **Borders with slack.** A cell keeps an object while its middle is within a quarter of a cell
//!    of the cell ([`SLACK`]). One that is looked at and is in the outer half of that goes to the cell that
//!    its middle is in, where every border is a quarter of a cell away again: nobody is looked at in frame
//!    after frame for being near a border.
//! 2. **Back up in one go.** It goes [`CLIMB`] levels up, to where it need not be looked at for long;
//!    finding brings it down where that is needed. So what is far from the view comes to lie in ever larger
//!    cells, and a scene may grow beyond the view at little cost.
//! 3. **Boxes of single objects** are looked at in cells that the volume meets partly: what is found is
//!    exactly what a look at every box finds.
//! 4. **Flat memory**: 13 bytes an object, one list of numbers a cell, and the boxes stay where they are.
//!
//! Cost: an update O(objects that are due), each O(1); finding O(cells met + objects in those met partly).
//! It loses where no bounds on steps are known: then everything that moves is due in every frame; and where
//! objects are large beside the space.

use std::borrow::Cow;

use glam::DVec3;

use super::checklist::{Checklists, Due};
use super::{
    Entry, GridKnobs, Index, MIDDLE_ROUNDING, Moves, Node, NodeId, Work, each_once, rounded_up,
    space_of_middles,
};
use crate::math::{Aabb, Planes, Volume};
use crate::part::ObjectId;

/// Beyond a cell, of the length of a cell along the longest side of the space, an object may wander.
const SLACK: f64 = 0.25;
/// Of the same length, the largest half side of an object that may lie in it.
const LARGEST: f64 = 0.5;
/// Levels that an object goes up when it leaves its cell.
const CLIMB: u8 = 2;
/// Levels above the deepest that it could be at, where an object is at first.
const FIRST: u8 = 3;
/// Objects that are due whose memory is read ahead of the decisions, so that the reads overlap.
const READ_AHEAD: usize = 32;

/// One grid.
#[derive(Clone, Copy, Debug)]
struct Level {
    /// Cells along each axis are two to the power of this.
    bits: [u32; 3],
    /// Number of its first cell among all.
    first: u32,
    /// Sides of a cell.
    size: DVec3,
    /// How far beyond its cell a middle may be.
    slack: f64,
    /// How far beyond that a box may reach.
    reach: f64,
}

#[derive(Clone, Debug, Default)]
struct Cell {
    objects: Vec<ObjectId>,
    level: u8,
}

/// What is known of an object.
#[derive(Clone, Copy, Debug)]
struct Home {
    cell: u32,
    /// The farthest its middle moves in a frame.
    step: f32,
    due: Due,
}

/// A cell that is gone through, and the planes that what is in it may be beyond.
#[derive(Clone, Copy, Debug)]
struct Visit {
    cell: u32,
    planes: Planes,
}

/// The grids.
#[derive(Clone, Debug)]
pub struct LazyGrid {
    space: Aabb,
    levels: Vec<Level>,
    cells: Vec<Cell>,
    /// By cell, objects in it and in the cells within it, of all deeper levels.
    counts: Vec<u32>,
    homes: Vec<Home>,
    /// The deepest level that the object may be at, by its size.
    deepest: Vec<u8>,
    lists: Checklists,
    /// Objects in the first cell that are beyond its slack, ascending.
    strays: Vec<ObjectId>,
    rebuilt: Vec<NodeId>,
    work: Work,
}

impl LazyGrid {
    /// Over the boxes of frame 0.
    #[must_use]
    pub fn new(entries: &[Entry], knobs: GridKnobs) -> Self {
        // What sticks out is the cells' slack.
        let space = space_of_middles(entries);
        let longest = space.size().max_element().max(f64::MIN_POSITIVE);
        let far = space.max_abs().max_element() + longest;
        let (mut levels, mut count): (Vec<Level>, u32) = (Vec::new(), 0);
        loop {
            let depth = levels.len() as u32;
            // Short sides are halved later, so that cells are about cubes.
            let bits = space.size().to_array().map(|side| {
                let late = libm::log2(longest / side.max(longest * 1e-6)).floor() as u32;
                depth.saturating_sub(late)
            });
            let size = DVec3::from_array(std::array::from_fn(|axis| {
                space.size()[axis] / f64::from(1_u32 << bits[axis])
            }));
            let length = longest / f64::from(1_u32 << depth);
            levels.push(Level { bits, first: count, size, slack: length * SLACK, reach: 0.0 });
            let cells = 1_u32 << bits.iter().sum::<u32>();
            count += cells;
            if f64::from(cells) * knobs.per_cell >= entries.len() as f64 || depth >= 9 {
                break;
            }
        }
        let deepest_of = |entry: &Entry| {
            let fits = |level: &Level| entry.reach <= level.slack / SLACK * LARGEST;
            levels.iter().rposition(fits).unwrap_or(0) as u8
        };
        let deepest: Vec<u8> = entries.iter().map(deepest_of).collect();
        for (entry, &deepest) in entries.iter().zip(&deepest).filter(|(e, _)| !e.bounds.is_empty())
        {
            for level in &mut levels[..=usize::from(deepest)] {
                level.reach = level.reach.max(entry.reach);
            }
        }
        for level in &mut levels {
            level.reach += (far + level.reach) * MIDDLE_ROUNDING;
        }
        let mut cells = vec![Cell::default(); count as usize];
        for (depth, level) in levels.iter().enumerate() {
            cells[level.first as usize..].iter_mut().for_each(|cell| cell.level = depth as u8);
        }
        let home =
            |entry: &Entry| Home { cell: 0, step: rounded_up(entry.step_bound), due: Due::NEVER };
        let mut grid = Self {
            space,
            levels,
            cells,
            counts: vec![0; count as usize],
            homes: entries.iter().map(home).collect(),
            deepest,
            lists: Checklists::new(knobs.ahead),
            strays: Vec::new(),
            rebuilt: Vec::new(),
            work: Work::default(),
        };
        for (id, entry) in (0..).map(ObjectId).zip(entries) {
            let level = grid.deepest[id.0 as usize].saturating_sub(FIRST);
            let (cell, distance) = if entry.bounds.is_empty() {
                (0, f64::INFINITY)
            } else {
                grid.place_from(level, entry.bounds.center())
            };
            grid.homes[id.0 as usize].cell = cell;
            grid.cells[cell as usize].objects.push(id);
            grid.count(cell, None);
            grid.note_stray(id, distance);
            grid.schedule(id, distance);
        }
        grid.rebuilt.clear();
        grid
    }

    /// Where a cell is along each axis of its level.
    fn place(&self, cell: u32) -> (&Level, [u32; 3]) {
        let level = &self.levels[usize::from(self.cells[cell as usize].level)];
        let number = cell - level.first;
        let [x, y, _] = level.bits;
        let low = |bits: u32| (1_u32 << bits) - 1;
        (level, [number & low(x), number >> x & low(y), number >> (x + y)])
    }

    fn number(level: &Level, [x, y, z]: [u32; 3]) -> u32 {
        level.first + (x | y << level.bits[0] | z << (level.bits[0] + level.bits[1]))
    }

    /// The cell's box.
    fn space_of(&self, cell: u32) -> Aabb {
        let (level, at) = self.place(cell);
        let low = self.space.min + DVec3::from_array(at.map(f64::from)) * level.size;
        Aabb::new(low, low + level.size)
    }

    /// The box that holds what is in the cell.
    fn loose_box(&self, cell: u32) -> Aabb {
        let level = &self.levels[usize::from(self.cells[cell as usize].level)];
        self.space_of(cell).grown(DVec3::splat(level.slack + level.reach))
    }

    /// How far a middle is from where the cell's slack ends; negative beyond.
    fn room(&self, cell: u32, at: DVec3) -> f64 {
        let Aabb { min, max } = self.space_of(cell);
        let slack = self.levels[usize::from(self.cells[cell as usize].level)].slack;
        (at - min).min(max - at).min_element() + slack
    }

    /// The cell of a level that the point is in or nearest to.
    fn cell_at(&self, level: u8, at: DVec3) -> u32 {
        let level = &self.levels[usize::from(level)];
        let place = (at - self.space.min) / level.size;
        let along = |axis: usize| {
            let cells = 1_u32 << level.bits[axis];
            // A side of no length has one cell; casts take what is not a number for 0.
            (place[axis] as u32).min(cells - 1)
        };
        Self::number(level, [along(0), along(1), along(2)])
    }

    /// The cell of that level, or of the deepest above that keeps the point, and the room it has there: less
    /// than 0 where none keeps it.
    fn place_from(&self, level: u8, at: DVec3) -> (u32, f64) {
        let mut level = level;
        loop {
            let cell = self.cell_at(level, at);
            let room = self.room(cell, at);
            if room >= 0.0 || level == 0 {
                return (cell, room);
            }
            level -= 1;
        }
    }

    fn parent_of(&self, cell: u32) -> Option<u32> {
        let level = self.cells[cell as usize].level.checked_sub(1)?;
        let (own, place) = self.place(cell);
        let above = &self.levels[usize::from(level)];
        let at = std::array::from_fn(|axis| place[axis] >> (own.bits[axis] - above.bits[axis]));
        Some(Self::number(above, at))
    }

    /// The cells that a cell is parted into: how many along each axis, and the first of them. Of the
    /// deepest level: nothing.
    fn parts(&self, cell: u32) -> Option<(&Level, [u32; 3], [u32; 3])> {
        let below = self.levels.get(usize::from(self.cells[cell as usize].level) + 1)?;
        let (own, place) = self.place(cell);
        let more: [u32; 3] = std::array::from_fn(|axis| below.bits[axis] - own.bits[axis]);
        let first = std::array::from_fn(|axis| place[axis] << more[axis]);
        Some((below, more.map(|bits| 1 << bits), first))
    }

    /// The part of a cell that keeps an object of it, if one does, by the middle of its box. That of an empty
    /// box is not a number, and no part keeps it.
    fn part_for(&self, id: ObjectId, cell: u32, at: DVec3) -> Option<u32> {
        if self.deepest[id.0 as usize] <= self.cells[cell as usize].level {
            return None;
        }
        let (below, parts, first) = self.parts(cell)?;
        let place = (at - self.space.min) / below.size;
        let along =
            |axis: usize| (place[axis] as u32).clamp(first[axis], first[axis] + parts[axis] - 1);
        let part = Self::number(below, [along(0), along(1), along(2)]);
        (self.room(part, at) >= 0.0).then_some(part)
    }

    /// Counts an object into a cell and all above, and out of another.
    fn count(&mut self, to: u32, from: Option<u32>) {
        let (mut to, mut from) = (Some(to), from);
        while to != from {
            let level = |cell: Option<u32>| cell.map(|cell| self.cells[cell as usize].level);
            // The deeper of the two first; they meet at the first cell at the latest.
            if level(to) >= level(from)
                && let Some(cell) = to
            {
                self.count_one(cell);
                to = self.parent_of(cell);
            } else if let Some(cell) = from {
                self.counts[cell as usize] -= 1;
                from = self.parent_of(cell);
            }
        }
    }

    /// Counts an object into one cell.
    fn count_one(&mut self, cell: u32) {
        let count = &mut self.counts[cell as usize];
        if *count == 0 {
            self.rebuilt.push(NodeId(cell));
        }
        *count += 1;
    }

    /// Takes the object at a place of its cell's list to another cell.
    fn relink(&mut self, id: ObjectId, place: usize, to: u32) {
        let home = &mut self.homes[id.0 as usize];
        let from = std::mem::replace(&mut home.cell, to);
        self.cells[from as usize].objects.swap_remove(place);
        self.cells[to as usize].objects.push(id);
        self.count(to, Some(from));
    }

    fn schedule(&mut self, id: ObjectId, room: f64) {
        let home = &mut self.homes[id.0 as usize];
        self.lists.put(id, &mut home.due, room.max(0.0), f64::from(home.step));
    }

    /// Keeps the list of what is beyond the slack of all cells.
    fn note_stray(&mut self, id: ObjectId, room: f64) {
        match (self.strays.binary_search(&id), room < 0.0) {
            (Err(place), true) => self.strays.insert(place, id),
            (Ok(place), false) => {
                self.strays.remove(place);
            }
            _ => {}
        }
    }

    /// Finds another cell for an object that has left its own, or the inner half of its slack.
    fn move_on(&mut self, id: ObjectId, at: DVec3) {
        let from = self.homes[id.0 as usize].cell;
        let level = self.cells[from as usize].level.saturating_sub(CLIMB);
        let (to, room) = self.place_from(level, at);
        self.work.steps += u64::from(level - self.cells[to as usize].level) + 1;
        if to == from {
            self.work.ok += 1;
        } else {
            self.work.updates += 1;
            let objects = &self.cells[from as usize].objects;
            let place = objects.iter().position(|&other| other == id);
            self.relink(id, place.expect("an object is in the list of its cell"), to);
        }
        if to == 0 || from == 0 {
            self.note_stray(id, room);
        }
        self.schedule(id, room);
    }

    /// Looks at objects whose turn it is, at most [`READ_AHEAD`]. Most are where they belong.
    fn look_at(&mut self, ids: &[ObjectId], boxes: &[Aabb]) {
        let mut middles = [DVec3::ZERO; READ_AHEAD];
        for (at, &id) in middles.iter_mut().zip(ids) {
            *at = boxes[id.0 as usize].center();
        }
        for (&id, at) in ids.iter().zip(middles) {
            let home = self.homes[id.0 as usize];
            if !self.lists.is_due(home.due) {
                continue;
            }
            let slack = self.levels[usize::from(self.cells[home.cell as usize].level)].slack;
            let room = self.room(home.cell, at);
            if room * 2.0 >= slack {
                self.work.ok += 1;
                if home.cell == 0 {
                    // Back from beyond it, perhaps.
                    self.note_stray(id, room);
                }
                self.schedule(id, room);
            } else {
                self.move_on(id, at);
            }
        }
    }

    /// Goes through what meets the volume, level by level, and brings it down; `found` is told of objects that
    /// meet it. All cells of a level are gone through before the next, and all their objects after that: no
    /// step waits for what another reads from memory.
    fn walk(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut dyn FnMut(&[ObjectId])) {
        let mut cells = vec![Visit { cell: 0, planes: Planes::ALL }];
        let (mut objects, mut parts) = (Vec::new(), Vec::new());
        for depth in 0..self.levels.len() {
            self.work.node_checks += cells.len() as u64;
            let whole = depth > 0 || self.strays.is_empty();
            cells.retain_mut(|visit| {
                if visit.planes.is_empty() || !whole {
                    return true;
                }
                let straddled = volume.straddled(&self.loose_box(visit.cell), visit.planes);
                straddled.is_some_and(|planes| {
                    visit.planes = planes;
                    true
                })
            });
            let deepest = depth + 1 == self.levels.len();
            objects.clear();
            for visit in &cells {
                let own = &mut self.cells[visit.cell as usize].objects;
                if visit.planes.is_empty() {
                    found(own);
                } else {
                    objects.extend(own.iter().map(|&id| (id, *visit)));
                    if !deepest {
                        own.clear();
                    }
                }
            }
            for batch in objects.chunks(READ_AHEAD) {
                self.look_closer(batch, boxes, volume, deepest, found);
            }
            parts.clear();
            for visit in &cells {
                self.each_part(visit.cell, 0, &mut |cell| {
                    if self.counts[cell as usize] > 0 {
                        parts.push(Visit { cell, ..*visit });
                    }
                });
            }
            std::mem::swap(&mut cells, &mut parts);
        }
    }

    /// Looks at objects of cells that the volume meets partly, taken out of them unless they are of the
    /// deepest level: those that a part of their cell keeps go there, the rest back, and `found` is told which
    /// of these meet the volume.
    fn look_closer(
        &mut self,
        batch: &[(ObjectId, Visit)],
        boxes: &[Aabb],
        volume: &Volume,
        deepest: bool,
        found: &mut dyn FnMut(&[ObjectId]),
    ) {
        let mut near = [Aabb::EMPTY; READ_AHEAD];
        for (bounds, (id, _)) in near.iter_mut().zip(batch) {
            *bounds = boxes[id.0 as usize];
        }
        let (mut met, mut count) = ([ObjectId(0); READ_AHEAD], 0);
        for ((id, visit), bounds) in batch.iter().zip(&near) {
            if !deepest {
                if let Some(part) = self.part_for(*id, visit.cell, bounds.center()) {
                    self.lower(*id, part, bounds.center());
                    continue;
                }
                self.cells[visit.cell as usize].objects.push(*id);
            }
            self.work.object_checks += 1;
            met[count] = *id;
            count += usize::from(volume.touches_planes(bounds, visit.planes));
        }
        found(&met[..count]);
    }

    /// Puts an object that hangs nowhere into a part of the cell that it was in.
    fn lower(&mut self, id: ObjectId, part: u32, at: DVec3) {
        self.homes[id.0 as usize].cell = part;
        self.cells[part as usize].objects.push(id);
        // The cell and all above count it already.
        self.count_one(part);
        self.work.lowered += 1;
        self.schedule(id, self.room(part, at));
    }

    /// Calls `each` with the parts of a cell, those first that are on the side of `nearest`: bit a is set for
    /// the upper half along axis a.
    fn each_part(&self, cell: u32, nearest: u32, each: &mut dyn FnMut(u32)) {
        let Some((below, parts, first)) = self.parts(cell) else { return };
        for number in 0..8 {
            let half = [0, 1, 2].map(|axis| (number ^ nearest) >> axis & 1);
            // An axis that is not parted has no upper half; the lower one comes once.
            let whole = (0..3).any(|axis| parts[axis] == 1 && number >> axis & 1 == 1);
            if !whole {
                let at = std::array::from_fn(|axis| first[axis] + half[axis].min(parts[axis] - 1));
                each(Self::number(below, at));
            }
        }
    }
}

impl Index for LazyGrid {
    fn name(&self) -> &'static str {
        "lazy-grid"
    }

    fn update(&mut self, moves: Moves<'_>) {
        self.rebuilt.clear();
        let due = self.lists.next();
        for &id in moves.jumped {
            let bounds = moves.bounds(id);
            if !bounds.is_empty() {
                self.move_on(id, bounds.center());
            }
        }
        for ids in due.chunks(READ_AHEAD) {
            self.look_at(ids, moves.boxes);
        }
        self.lists.recycle(due);
    }

    fn refine(&mut self, boxes: &[Aabb], volume: &Volume) {
        let before = self.work;
        self.walk(boxes, volume, &mut |_| {});
        self.work.object_checks = before.object_checks;
    }

    /// Exactly what meets the volume.
    fn find(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>) {
        self.walk(boxes, volume, &mut |objects| found.extend_from_slice(objects));
    }

    fn work(&self) -> Work {
        self.work
    }

    fn heap_bytes(&self) -> usize {
        let objects: usize = self.cells.iter().map(|cell| cell.objects.capacity()).sum();
        self.cells.capacity() * size_of::<Cell>()
            + (objects + self.strays.capacity() + self.rebuilt.capacity()) * size_of::<ObjectId>()
            + self.homes.capacity() * size_of::<Home>()
            + self.counts.capacity() * size_of::<u32>()
            + self.deepest.capacity()
            + self.lists.heap_bytes()
    }

    fn rebuilt(&self) -> &[NodeId] {
        &self.rebuilt
    }

    fn top_down(&self) -> Cow<'_, [NodeId]> {
        let mut order = Vec::new();
        let mut stack = vec![0];
        while let Some(cell) = stack.pop() {
            order.push(NodeId(cell));
            self.each_part(cell, 0, &mut |part| {
                if self.counts[part as usize] > 0 {
                    stack.push(part);
                }
            });
        }
        Cow::Owned(order)
    }

    fn node_count(&self) -> u32 {
        self.cells.len() as u32
    }

    fn node(&self, node: NodeId) -> Node<'_> {
        let this = &self.cells[node.0 as usize];
        let whole = node.0 != 0 || self.strays.is_empty();
        Node {
            query_box: whole.then(|| self.loose_box(node.0)),
            tight_box: None,
            objects: &this.objects,
            subtree_objects: self.counts[node.0 as usize],
        }
    }

    /// Nearer parts first; an object of the cell itself may be anywhere among them.
    fn children(&self, node: NodeId, eye: DVec3, out: &mut Vec<NodeId>) -> usize {
        let middle = self.space_of(node.0).center();
        let nearest = (0..3).map(|axis| u32::from(eye[axis] >= middle[axis]) << axis).sum();
        let before = out.len();
        self.each_part(node.0, nearest, &mut |part| {
            if self.counts[part as usize] > 0 {
                out.push(NodeId(part));
            }
        });
        (out.len() - before).div_ceil(2)
    }

    fn parent(&self, node: NodeId) -> Option<NodeId> {
        self.parent_of(node.0).map(NodeId)
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        let mut seen = vec![0_u32; boxes.len()];
        for (number, cell) in (0..).zip(&self.cells) {
            let mut below = cell.objects.len() as u32;
            self.each_part(number, 0, &mut |part| below += self.counts[part as usize]);
            let count = self.counts[number as usize];
            if count != below {
                return Err(format!("cell {number} counts {count} objects"));
            }
            for &id in &cell.objects {
                seen[id.0 as usize] += 1;
                if self.homes[id.0 as usize].cell != number {
                    return Err(format!("object {} lies in {number} and elsewhere", id.0));
                }
                let stray = number == 0 && self.strays.binary_search(&id).is_ok();
                if !stray && !self.loose_box(number).contains(&boxes[id.0 as usize]) {
                    return Err(format!("object {} sticks out of cell {number}", id.0));
                }
                if cell.level > self.deepest[id.0 as usize] {
                    return Err(format!("object {} is too large for cell {number}", id.0));
                }
            }
        }
        each_once(&seen)?;
        for id in (0..boxes.len() as u32).map(ObjectId) {
            let (home, bounds) = (self.homes[id.0 as usize], &boxes[id.0 as usize]);
            if bounds.is_empty() {
                continue;
            }
            let room = self.room(home.cell, bounds.center());
            let stray = self.strays.binary_search(&id).is_ok();
            if stray && home.cell != 0 {
                return Err(format!("object {} is a stray and not in the first cell", id.0));
            }
            if home.cell == 0 && stray != (room < 0.0) {
                return Err(format!("object {} is a stray: {stray}", id.0));
            }
            let far = bounds.max_abs().max(self.space.max_abs()).max_element();
            let known = (room, f64::from(home.step), far * MIDDLE_ROUNDING);
            self.lists.check((id, home.due), known)?;
        }
        Ok(())
    }
}
