//! World boxes alone, frame after frame: what an index is told, without matrices, images or parts. For
//! scenes of hundreds of thousands of objects, most of which nobody looks at.

use rayon::prelude::*;

use super::World;
use crate::effect;
use crate::index::Moves;
use crate::math::Aabb;
use crate::part::ObjectId;

/// Moving objects that a thread places at a time.
const AT_A_TIME: usize = 4096;

/// Where everything is in a frame, and what moved to get there.
#[derive(Clone, Debug)]
pub struct Boxes {
    frame: u32,
    boxes: Vec<Aabb>,
    moved: Vec<ObjectId>,
    jumped: Vec<ObjectId>,
}

impl Boxes {
    /// In frame 0.
    #[must_use]
    pub fn first(world: &World) -> Self {
        let mut this = Self {
            frame: 0,
            boxes: world.boxes_at_rest().collect(),
            moved: Vec::new(),
            jumped: Vec::new(),
        };
        this.place(world, 0);
        this.moved.clear();
        this
    }

    /// On to the next frame, on all threads; the result does not depend on how many.
    pub fn advance(&mut self, world: &World) {
        self.frame += 1;
        self.place(world, self.frame);
    }

    fn place(&mut self, world: &World, frame: u32) {
        let tick = world.scene.start + frame;
        let boxes = &self.boxes;
        let place = |ids: &[u32]| {
            let mut work = effect::Work::default();
            let mut new = Vec::new();
            for &id in ids {
                let bounds = world.bounds_of(ObjectId(id), tick, &mut work);
                if bounds != boxes[id as usize] {
                    new.push((ObjectId(id), bounds));
                }
            }
            new
        };
        // What one thread does at a time is not worth another thread's attention.
        let new: Vec<Vec<(ObjectId, Aabb)>> = match world.moving() {
            few if few.len() <= AT_A_TIME => vec![place(few)],
            many => many.par_chunks(AT_A_TIME).map(place).collect(),
        };
        self.moved.clear();
        for (id, bounds) in new.into_iter().flatten() {
            self.boxes[id.0 as usize] = bounds;
            self.moved.push(id);
        }
        self.jumped.clear();
        if world.scene.effects.teleport.is_some() {
            let jumps = |id: &&ObjectId| world.jumps(**id, tick);
            self.jumped.extend(self.moved.iter().filter(jumps));
        }
    }

    /// The frame.
    #[must_use]
    pub fn frame(&self) -> u32 {
        self.frame
    }

    /// As an index is told.
    #[must_use]
    pub fn moves(&self) -> Moves<'_> {
        Moves { boxes: &self.boxes, moved: &self.moved, jumped: &self.jumped }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::PartitionKnobs;
    use crate::run::{FrameState, Moment};
    use crate::scene::generate::{Knobs, build};

    /// The same boxes as a whole frame has, and no move left out.
    #[test]
    fn boxes_are_those_of_whole_frames() {
        for (name, scale) in [("city250k", 0.003), ("hard/teleports", 1.0), ("swarm", 1.0)] {
            let knobs = Knobs { scale: Some(scale), seed: Some(6), ..Knobs::default() };
            let world = World::new(build(name, &knobs).unwrap(), PartitionKnobs::default());
            let mut boxes = Boxes::first(&world);
            for frame in 0..12 {
                let state = FrameState::at(&world, Moment { frame, view: 0 });
                let moves = boxes.moves();
                assert_eq!(moves.boxes, state.boxes, "{name} {frame}");
                assert!(moves.moved.iter().all(|id| state.moved.contains(id)), "{name} {frame}");
                let told = |id: &ObjectId| moves.jumped.contains(id) == moves.moved.contains(id);
                assert!(state.jumped.iter().all(told), "{name} {frame}");
                boxes.advance(&world);
            }
        }
    }
}
