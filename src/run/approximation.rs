//! A frame by a renderer that is not exact, timed: one thread, every triangle, beside the exact one.

use std::time::Instant;

use plainsight_reference::Image;
use plainsight_reference::approximate::{self, Interpolation};

use super::{FrameState, World};
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
