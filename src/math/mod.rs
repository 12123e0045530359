//! Boxes, clip-space boxes with their error bounds, outward rounding and deterministic trigonometry.
//! Everything here is plain arithmetic in `f64` and must not know scenes.

mod aabb;
mod clip_box;
mod clip_error;
mod hull;
mod inflate;
mod margins;
mod trig;
mod volume;

pub use aabb::{Aabb, TRANSFORM_MARGIN};
pub use clip_box::{
    ClipBox, DEPTH_ROUNDING, FrustumPlane, PixelRectangle, Projection, RECTANGLE_DILATION_PIXELS,
};
pub use clip_error::{CLIP_ERROR_GAMMA, ClipError, rounded_clip_matrix};
pub use hull::{
    FLAT_DEPTH_STEP, HULL_DILATION_PIXELS, HULL_SUBPIXELS, Hull, MOST_HULL_CORNERS, Outline,
};
pub use inflate::{BOX_DEPTH_SLACK, BOX_DILATION_PIXELS, inflated_box, inflated_box_with};
pub use margins::Margins;
pub use trig::{cos, sin, tan};
pub use volume::{Meets, Planes, Volume};
