//! The truth of one frame: the reference's image of every part and what is visible in it.

use plainsight_reference::fast::Instance;
use plainsight_reference::{Draw, Fates, Image, Tolerance, fast, fates, naive};

use super::{Canary, FrameState, World, canary};
use crate::oracle::{part_draw, part_instance};
use crate::part::{ObjectId, PartId, PartitionKnobs};

/// What the reference says of one frame.
pub struct Truth {
    /// Depth and draw indices of everything.
    pub image: Image,
    /// Samples that show each part, by part id.
    pub visible_pixels: Vec<u32>,
    /// How many parts show at least one sample.
    pub visible_parts: u32,
    /// Triangles of those parts: what a culler that knew the truth would draw.
    pub visible_triangles: u64,
    /// Hash of the image.
    pub hash: u64,
}

impl Truth {
    /// Renders every part of the frame.
    #[must_use]
    pub fn of(world: &World, state: &FrameState) -> Self {
        Self::into_room(world, state, world.image(), Vec::new())
    }

    /// The same of another frame of the same world, in the memory of this one.
    #[must_use]
    pub fn next(self, world: &World, state: &FrameState) -> Self {
        Self::into_room(world, state, self.image, self.visible_pixels)
    }

    fn into_room(
        world: &World,
        state: &FrameState,
        mut image: Image,
        visible_pixels: Vec<u32>,
    ) -> Self {
        let all: Vec<PartId> = (0..world.partition.part_count()).map(PartId).collect();
        render(world, state, &all, &mut image);
        if world.canary == Some(Canary::Truth) {
            canary::spoil(&mut image);
        }
        Self::seen_in(world, image, visible_pixels)
    }

    /// What the naive renderer says of the frame, which the fast one must equal bit for bit; slow.
    #[must_use]
    pub fn naive(world: &World, state: &FrameState) -> Self {
        let all: Vec<PartId> = (0..world.partition.part_count()).map(PartId).collect();
        Self::seen_in(world, render_naively(world, state, &all), Vec::new())
    }

    /// Counts what an image of everything shows.
    fn seen_in(world: &World, image: Image, mut visible_pixels: Vec<u32>) -> Self {
        visible_pixels.clear();
        visible_pixels.resize(world.partition.part_count() as usize, 0);
        // Neighbouring samples mostly show one triangle. (`for_each` goes through the image's pieces one by
        // one; a loop over the iterator would ask for the piece at every sample.)
        let (mut last, mut near) = ((u32::MAX, 0), ObjectId(0));
        image.draw_indices().flatten().for_each(|draw| {
            if draw != last.0 {
                let part = world.partition.part_of_draw_near(draw, &mut near);
                last = (draw, part.0 as usize);
            }
            visible_pixels[last.1] += 1;
        });
        let visible = || (0..).zip(&visible_pixels).filter(|&(_, &pixels)| pixels > 0);
        let visible_parts = visible().count() as u32;
        let triangles = |(part, _)| u64::from(world.partition.part(PartId(part)).triangle_count);
        let visible_triangles = visible().map(triangles).sum();
        let hash = image.hash();
        Self { image, visible_pixels, visible_parts, visible_triangles, hash }
    }

    /// The part that a sample shows.
    #[must_use]
    pub fn part_at(&self, world: &World, sample: usize) -> Option<PartId> {
        self.image.draw_index(sample).map(|draw| world.partition.part_of_draw(draw))
    }
}

/// Clears `image` and renders `parts` into it.
pub fn render(world: &World, state: &FrameState, parts: &[PartId], image: &mut Image) {
    let instance = |&part: &PartId| part_instance(&world.partition, part, &state.matrices);
    let instances: Vec<Instance<'_>> = parts.iter().map(instance).collect();
    fast::render(image, &instances, world.render);
}

/// The naive renderer's image of `parts`; slow.
#[must_use]
pub fn render_naively(world: &World, state: &FrameState, parts: &[PartId]) -> Image {
    let mut image = world.image();
    for &part in parts {
        naive::draw(&mut image, &part_draw(&world.partition, part, &state.matrices));
    }
    image
}

/// What a device within `tolerance` may make of each part of the frame, by part id; slow.
#[must_use]
pub fn fates_of_parts(world: &World, state: &FrameState, tolerance: Tolerance) -> Fates {
    let parts = (0..world.partition.part_count()).map(PartId);
    let draws: Vec<Draw<'_>> =
        parts.map(|part| part_draw(&world.partition, part, &state.matrices)).collect();
    fates(world.scene.viewport, world.scene.depth, &draws, tolerance)
}

/// How many triangles cover a sample on average, over the samples that any covers: all of them, near
/// and far, as if nothing hid anything. 0 where nothing is covered.
#[must_use]
pub fn depth_complexity(world: &World, state: &FrameState) -> f64 {
    use rayon::prelude::*;
    let mut image = world.image();
    let parts = 0..world.partition.part_count();
    // Against an empty image every covered sample passes.
    let count = |part| {
        let draw = part_draw(&world.partition, PartId(part), &state.matrices);
        fast::count(&image, &draw)
    };
    let layers: u64 = parts.clone().into_par_iter().map(count).sum();
    let all: Vec<PartId> = parts.map(PartId).collect();
    render(world, state, &all, &mut image);
    let covered = image.draw_indices().flatten().count();
    layers as f64 / covered.max(1) as f64
}

/// Samples of frame 0 at which the cut scene shows another object or source triangle than the uncut
/// one: what the T-junctions along the cuts cost.
#[must_use]
pub fn partition_difference(world: &World) -> u64 {
    let uncut = World::new((*world.scene).clone(), PartitionKnobs::uncut());
    difference_to(world, &uncut.rendered(world.render))
}

/// The same to a world of the same scene that is at hand.
#[must_use]
pub fn difference_to(world: &World, uncut: &World) -> u64 {
    let sources = |world: &World| {
        let truth = Truth::of(world, &FrameState::first(world));
        let source = |draw| world.partition.source_of_draw(draw);
        truth.image.draw_indices().map(|draw| draw.map(source)).collect::<Vec<_>>()
    };
    sources(world).iter().zip(sources(uncut)).filter(|(cut, whole)| **cut != *whole).count() as u64
}
