//! Boxes, clip-space boxes with their error bounds, outward rounding and deterministic trigonometry.
//! Everything here is plain arithmetic in `f64` and must not know scenes.

mod aabb;
mod clip_box;
mod clip_error;
mod inflate;
mod trig;

pub use aabb::{Aabb, TRANSFORM_MARGIN};
pub use clip_box::{
    ClipBox, DEPTH_ROUNDING, FrustumPlane, PixelRectangle, Projection, RECTANGLE_DILATION_PIXELS,
};
pub use clip_error::{CLIP_ERROR_GAMMA, ClipError, rounded_clip_matrix};
pub use inflate::{BOX_DEPTH_SLACK, inflated_box};
pub use trig::{cos, sin, tan};
