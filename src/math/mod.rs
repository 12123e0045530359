//! Boxes, planes, the frustum, projection with its error bounds, outward rounding and deterministic
//! trigonometry. Everything here is plain arithmetic in `f64` and must not know scenes.

mod aabb;
mod frustum;
mod project;
mod trig;

pub use aabb::Aabb;

pub use trig::{cos, sin, tan};
