//! Steps of a frame by themselves, timed: its picture by a renderer that is not exact (one thread, every
//! triangle), and its state, which is what effects cost.

use std::time::Instant;

use plainsight_reference::Image;
use plainsight_reference::approximate::{self, Interpolation};

use super::{FrameState, FrameWork, Moment, World};
use crate::oracle::part_draw;
use crate::part::PartId;

/// The arithmetic of a renderer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Arithmetic {
    /// How depth comes from that of the corners.
    pub interpolation: Interpolation,
    /// Whether vertices are transformed in f64.
    pub double_transform: bool,
}

/// What rendering a frame took.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Rendering {
    /// Samples of triangles at which a depth was computed.
    pub fragments: u64,
    /// Wall time in nanoseconds. Never compared.
    pub wall_ns: u64,
}

/// Clears `image` and renders every part of the frame into it.
pub fn render_approximately(
    world: &World,
    state: &FrameState,
    arithmetic: Arithmetic,
    image: &mut Image,
) -> Rendering {
    let start = Instant::now();
    image.clear();
    let mut fragments = 0;
    for part in (0..world.partition.part_count()).map(PartId) {
        let draw = part_draw(&world.partition, part, &state.matrices);
        let (object, _) = world.partition.locate(part);
        let matrix = state.objects[object.0 as usize].clip_from_object.to_cols_array();
        let matrix = arithmetic.double_transform.then_some(matrix);
        fragments += approximate::draw(image, &draw, arithmetic.interpolation, matrix);
    }
    Rendering { fragments, wall_ns: start.elapsed().as_nanos() as u64 }
}

/// What the state of all frames takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StatePrice {
    /// What effects did, over all frames and views.
    pub work: FrameWork,
    /// Wall nanoseconds for all of them: the least, the median, the most of the rounds. Never compared.
    pub wall_ns: [u64; 3],
}

/// The state of frames `0..frames`, `rounds` times, at least once.
#[must_use]
pub fn price_states(world: &World, frames: u32, rounds: u32) -> StatePrice {
    let mut price = StatePrice::default();
    let mut walls: Vec<u64> = (0..rounds.max(1))
        .map(|_| {
            price.work = FrameWork::default();
            let start = Instant::now();
            for moment in Moment::all(world, frames) {
                price.work = price.work + FrameState::at(world, moment).work;
            }
            start.elapsed().as_nanos() as u64
        })
        .collect();
    walls.sort_unstable();
    price.wall_ns = [walls[0], walls[(walls.len() - 1) / 2], walls[walls.len() - 1]];
    price
}
