//! The margins of the three proxies as one value, and what each of them is proved to cover.
//!
//! A proxy is *conservative* if every sample at which anything of its box's contents shows passes its
//! question: the proxy covers that sample, at a depth no greater than the contents' there. Between the
//! exact geometry and the samples stand, on the contents' side, the transform in f32 ([`ClipError`]),
//! window arithmetic and snapping, and the rounding of depth; on the proxy's side the same again where
//! it is drawn.
//!
//! | proxy | margin beyond the transform bound | covers | proof |
//! |---|---|---|---|
//! | rectangle | [`RECTANGLE_DILATION_PIXELS`], [`DEPTH_ROUNDING`] | the contents' side; whole pixels are drawn without error | `clip_box` |
//! | hull | [`HULL_DILATION_PIXELS`], [`DEPTH_ROUNDING`] and [`FLAT_DEPTH_STEP`] | both sides | `hull` |
//! | box | [`BOX_DILATION_PIXELS`], [`BOX_DEPTH_SLACK`], the transform bound twice | both sides, of faces that are not nearly edge-on | `inflate` |
//!
//! A transform bound of zero, or a margin of less, is for the tests that attack the proofs: they show
//! that an attack that finds nothing against [`Margins::PROVEN`] finds what the margin is there for.
//!
//! [`ClipError`]: super::ClipError

use super::clip_box::{DEPTH_ROUNDING, RECTANGLE_DILATION_PIXELS};
use super::hull::{FLAT_DEPTH_STEP, HULL_DILATION_PIXELS};
use super::inflate::{BOX_DEPTH_SLACK, BOX_DILATION_PIXELS};

/// What proxies take beyond the transform bound. Pixels and depths, each ≥ 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margins {
    /// Dilation of the rectangle on each side, pixels.
    pub rectangle_pixels: f64,
    /// Dilation of the hull under the max norm, pixels.
    pub hull_pixels: f64,
    /// What the nearest depth of a rectangle or hull is moved towards the eye.
    pub depth: f64,
    /// What a hull's depth is moved further.
    pub flat_depth: f64,
    /// Pixels by which a box grows.
    pub box_pixels: f64,
    /// Depth by which the faces of a box stand before its contents.
    pub box_depth: f64,
}

impl Margins {
    /// Those of the proofs.
    pub const PROVEN: Self = Self {
        rectangle_pixels: RECTANGLE_DILATION_PIXELS,
        hull_pixels: HULL_DILATION_PIXELS,
        depth: DEPTH_ROUNDING,
        flat_depth: FLAT_DEPTH_STEP,
        box_pixels: BOX_DILATION_PIXELS,
        box_depth: BOX_DEPTH_SLACK,
    };
}
