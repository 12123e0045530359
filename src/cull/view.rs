//! What a culler sees of one view of a frame.

use glam::{DMat4, DVec3};

use crate::index::Moves;
use crate::math::{Aabb, ClipBox, ClipError};
use crate::part::Partition;
use crate::scene::{Camera, DepthOrder, Viewport};

/// One object in one frame.
#[derive(Clone, Copy, Debug)]
pub struct ObjectView {
    /// World box, rounded outward.
    pub bounds: Aabb,
    /// Clip from the object's space, composed in f64 and not rounded.
    pub clip_from_object: DMat4,
    /// The eye in the object's space; NaN where the placement cannot be inverted.
    pub eye: DVec3,
    /// How far the drawn vertices' clip coordinates may be from the exact ones.
    pub error: ClipError,
}

/// One view of a frame as a culler sees it. Coordinates are f64, right-handed, y up.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Frame number, from 0.
    pub frame: u32,
    /// Which of the frame's views, from 0; see [`PerView`](super::PerView).
    pub view: u32,
    /// Pixels.
    pub viewport: Viewport,
    /// Which way depth runs.
    pub depth: DepthOrder,
    /// The camera in the world.
    pub camera: Camera,
    /// Clip from world.
    pub clip_from_world: DMat4,
    /// Every object, by id.
    pub objects: &'a [ObjectView],
    /// Where they are, and whose placement differs from the frame before; none in frame 0.
    pub moves: Moves<'a>,
    /// The parts.
    pub partition: &'a Partition,
}

impl View<'_> {
    /// Whether nothing of the object can be inside the frustum. Conservative.
    #[must_use]
    pub fn object_outside_frustum(&self, object: u32) -> bool {
        let view = &self.objects[object as usize];
        ClipBox::new(&view.bounds, &self.clip_from_world, &view.error, self.depth).outside_frustum()
    }
}
