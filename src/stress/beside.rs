//! Indexes beside a run: told of the same moves as the culler's own, in a world that is run anyway, and held
//! to every promise that an index makes and to a look at every box. A lost object is seen at once, whether or
//! not it shows. So are bounds on steps and sides that a scene gave of its objects and does not keep to, and
//! boxes that differ between the two ways to make them.

use glam::DVec3;

use super::Choice;
use super::knobs::index_knobs;
use crate::index::{Entry, INDEXES, Index, NodeId, Shape, missed, promises};
use crate::math::{Aabb, Volume};
use crate::part::ObjectId;
use crate::run::{Boxes, FrameRecord, World};

/// Indexes beside a world, of which it picks the first.
const BESIDE: usize = 3;
/// How far apart they are in the register, so that they are of other kinds.
const APART: usize = 7;
/// Frames that boxes alone go on beside a large world, which is drawn for a few only.
const LARGE_FRAMES: u32 = 24;
/// Indexes of these.
const LARGE_INDEXES: usize = 4;

/// One index, with what was seen of it.
struct Member {
    name: &'static str,
    index: Box<dyn Index>,
    /// By number, whether the node was in use.
    used: Vec<bool>,
}

impl Member {
    fn new(name: &'static str, index: Box<dyn Index>) -> Self {
        Self { name, index, used: Vec::new() }
    }

    /// Holds it to its promises, and to a look at every box for each volume.
    fn hold(&mut self, boxes: &[Aabb], volumes: &[Volume]) -> Result<Shape, String> {
        let name = self.name;
        let said = |promise: String| format!("{name} beside: {promise}");
        let mut shape = Shape::default();
        self.index.check(boxes).map_err(said)?;
        for volume in volumes {
            missed(self.index.as_mut(), boxes, volume).map_err(said)?;
            self.index.check(boxes).map_err(said)?;
            shape = promises(self.index.as_ref(), boxes).map_err(said)?;
        }
        self.rebuilt_is_told().map_err(said)?;
        Ok(shape)
    }

    /// A number that comes into use is named as made anew: what was remembered of it is void.
    fn rebuilt_is_told(&mut self) -> Result<(), String> {
        let mut used = vec![false; self.index.node_count() as usize];
        for &NodeId(node) in self.index.top_down().iter() {
            used[node as usize] = true;
        }
        let before = std::mem::replace(&mut self.used, used);
        if before.is_empty() {
            return Ok(());
        }
        let was = |node: usize| before.get(node).copied().unwrap_or(false);
        let news = self.used.iter().enumerate().filter(|&(node, &now)| now && !was(node));
        let rebuilt = self.index.rebuilt();
        for (node, _) in news {
            if !rebuilt.contains(&NodeId(node as u32)) {
                return Err(format!("node {node} is new, and nobody was told"));
            }
        }
        Ok(())
    }
}

/// The indexes beside one world.
pub(super) struct Beside {
    members: Vec<Member>,
    entries: Vec<Entry>,
    boxes: Boxes,
    /// Middles in the frame before.
    middles: Vec<DVec3>,
    /// The largest so far.
    pub(super) shape: Shape,
}

impl Beside {
    pub(super) fn new(choice: &Choice, world: &World, entries: Vec<Entry>) -> Self {
        let first = INDEXES.iter().position(|kind| kind.name == choice.beside.name);
        let member = |number: usize| {
            let kind = INDEXES[(first.unwrap_or(0) + number * APART) % INDEXES.len()];
            let knobs = index_knobs(choice.seed, &format!("index knobs beside {number}"));
            Member::new(kind.name, (kind.with)(&entries, &knobs))
        };
        let members = (0..BESIDE).map(member).collect();
        let boxes = Boxes::first(world);
        Self { members, entries, boxes, middles: Vec::new(), shape: Shape::default() }
    }

    /// Goes on to a frame, in its first view, and looks at it from every view.
    ///
    /// # Errors
    /// The first broken promise, in words.
    pub(super) fn frame(&mut self, record: &FrameRecord<'_>) -> Result<(), String> {
        let state = record.state;
        if state.moment.view == 0 {
            if state.moment.frame > 0 {
                self.boxes.advance(record.world);
                // Told of what boxes alone know of, or of all moves, in turn.
                for (number, member) in self.members.iter_mut().enumerate() {
                    let alone = number % 2 == 0;
                    member.index.update(if alone { self.boxes.moves() } else { state.moves() });
                }
            }
            self.same_boxes(record)?;
            self.within_bounds(record)?;
        }
        let volume = Volume::new(&state.clip_from_world, record.world.scene.depth);
        for member in &mut self.members {
            let shape = member.hold(&state.boxes, &[volume])?;
            self.shape = self.shape.larger(shape);
        }
        Ok(())
    }

    /// Boxes made alone are those of the whole frame, and every move is told of.
    fn same_boxes(&self, record: &FrameRecord<'_>) -> Result<(), String> {
        let (state, alone) = (record.state, self.boxes.moves());
        if let Some(object) = (0..state.boxes.len()).find(|&o| alone.boxes[o] != state.boxes[o]) {
            return Err(format!("object {object} has another box where boxes are made alone"));
        }
        if let Some(id) = alone.moved.iter().find(|id| !state.moves().has(**id)) {
            return Err(format!("object {} moved, and cullers are not told", id.0));
        }
        let jumps = |id: &&ObjectId| state.jumped.binary_search(id).is_ok();
        match alone.moved.iter().find(|id| jumps(id) != alone.jumped.binary_search(id).is_ok()) {
            Some(id) => Err(format!("object {} jumped, or not, by who tells", id.0)),
            None => Ok(()),
        }
    }

    /// Nothing steps farther than its bound without a jump, nor has a longer side than its reach.
    fn within_bounds(&mut self, record: &FrameRecord<'_>) -> Result<(), String> {
        let state = record.state;
        let middles: Vec<DVec3> = state.boxes.iter().map(Aabb::center).collect();
        let before = std::mem::replace(&mut self.middles, middles);
        for (number, (bounds, entry)) in state.boxes.iter().zip(&self.entries).enumerate() {
            if bounds.is_empty() {
                continue;
            }
            let id = ObjectId(number as u32);
            if bounds.size().max_element() * 0.5 > entry.reach {
                return Err(format!("object {number} is larger than its reach"));
            }
            let Some(was) = before.get(number).filter(|_| !state.jumped.contains(&id)) else {
                continue;
            };
            let step = was.distance(self.middles[number]);
            if step > entry.step_bound {
                let bound = entry.step_bound;
                return Err(format!("object {number} goes {step} in a frame, bound {bound}"));
            }
        }
        Ok(())
    }
}

/// Has boxes alone go on beside several indexes, as many frames as a large world is too dear to draw.
///
/// # Errors
/// The frame and the first broken promise, in words.
pub(super) fn go_on_alone(choice: &Choice, world: &World) -> Result<(), (u32, String)> {
    let entries = world.entries();
    let first = (choice.seed / super::LARGE_ONE_IN) as usize * LARGE_INDEXES;
    let member = |number: usize| {
        let kind = INDEXES[(first + number) % INDEXES.len()];
        let name = format!("index knobs {number}");
        // One of them as usual.
        let index = match number {
            0 => (kind.build)(&entries),
            _ => (kind.with)(&entries, &index_knobs(choice.seed, &name)),
        };
        Member::new(kind.name, index)
    };
    let mut members: Vec<Member> = (0..LARGE_INDEXES).map(member).collect();
    let mut boxes = Boxes::first(world);
    for frame in 0..LARGE_FRAMES {
        let camera = world.scene.cameras[0].at(world.scene.start + frame);
        let matrix = camera.clip_from_world(world.scene.viewport, world.scene.depth);
        let volume = Volume::new(&matrix, world.scene.depth);
        let moves = boxes.moves();
        for member in &mut members {
            if frame > 0 {
                member.index.update(moves);
            }
            member.hold(moves.boxes, &[volume]).map_err(|promise| (frame, promise))?;
        }
        boxes.advance(world);
    }
    Ok(())
}
