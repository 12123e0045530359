//! The ground truth of plainsight: a software z-buffer with written raster rules, exact where rules
//! can be exact. It knows nothing of scenes, indexes or oracles; its interface is slices and numbers.
//!
//! # Conventions, written once
//! - **Matrices** are `[f32; 16]`, column-major, and act on column vectors (p, 1).
//! - **Clip space**: x right, y up, 0 ≤ z ≤ w inside; near is z = 0, far is z = w. A component is
//!   `((m₀·x + m₄·y) + m₈·z) + m₁₂`, each operation f32 and unfused. With *reversed* depth
//!   ([`DepthOrder::Reversed`]) −w ≤ z ≤ 0 is inside, near is z = −w and far z = 0: the z of a device
//!   with a reversed buffer, its sign turned.
//! - **Clipping** order: near, far, left, right, bottom, top of a guard band of ±2¹⁵ pixels. A new
//!   vertex is `out + t·(in − out)` with `t = d_out / (d_out − d_in)`, always from the outside vertex
//!   towards the inside one, so two triangles that share an edge get the same bits. A triangle wholly
//!   inside is not touched; a polygon is fanned from its first vertex.
//! - **Window**: r = 1/w; column (x·r)·(W/2) + W/2; row (y·r)·(−H/2) + H/2, row 0 on top; depth z·r,
//!   clamped to [0, 1] (reversed: [−1, 0]), never −0. Columns and rows are clamped to ±2¹⁵ (which moves nothing but the
//!   vertices of clipped edges too uneven for f32) and snapped to 1/256 pixel, ties to even.
//! - **Coverage**: pixel centres at (column + ½, row + ½), exact integers, top-left rule, both faces.
//!   Zero area after snapping draws nothing.
//! - **Depth** at a sample: (e₀z₀ + e₁z₁ + e₂z₂) / (e₀ + e₁ + e₂) in f64 in that order, eᵢ the exact
//!   edge value opposite vertex i (vertices 1 and 2 exchanged where the area was negative), rounded to
//!   f32 once.
//! - **Nearer wins**, equal depth goes to the lower *draw index*. The image is a minimum over (depth,
//!   draw index), so it does not depend on the order of drawing. An image is cleared to the far plane's
//!   depth, and a fragment exactly there loses against that, as on a device that compares *less*.
//! - A **question** passes at a sample where its depth is less than or equal to the stored one.
//!
//! # Ranges
//! A snapped coordinate lies within ±2²³ (2¹⁵ pixels of 2⁸ sub-pixels), a difference of two within
//! 2²⁴, a product of two differences within 2⁴⁸, an edge value within 2⁴⁹: it fits i64 with room and is
//! exact in f64 (53 bits).

pub mod approximate;
mod clip;
mod draw;
pub mod fast;
mod image;
pub mod naive;
mod order;
mod tolerance;
mod window;

pub use draw::{Draw, Faces};
pub use image::{Image, Viewport};
pub use order::DepthOrder;
pub use tolerance::{Fate, Fates, Tolerance, fates};
