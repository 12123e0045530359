//! A box seen in clip space: whether it is outside the frustum, and the rectangle and nearest depth
//! that nothing inside it can exceed.
//!
//! # Why the rectangle is conservative
//! Let every clip coordinate of the contents be within [`ClipError`] of the exact one. With w ≥
//! `w_min` > 0 over the box, x/w moves by at most (eₓ + |x/w|·e_w) / (w_min − e_w). The exact x/w of a
//! point in a convex box is bounded by those of its corners. Window arithmetic (reciprocal, product,
//! scale, offset: four f32 roundings within the guard band of 2¹⁵ pixels) adds under 2⁻⁷ pixel, and
//! snapping 2⁻⁹; both are far below [`RECTANGLE_DILATION_PIXELS`]. A triangle whose corners each moved
//! by at most δ lies within δ of the exact one, and a sample is covered only if its place, the middle
//! of its pixel, is in the triangle: so the rectangle is made of the pixels whose middles lie within
//! the dilated bounds, bounds included, and no other sample can be covered.
//! Depth at a sample is a convex combination of vertex depths and monotonically rounded, so it is
//! never below the smallest vertex depth.
//! Drawn, the rectangle is two triangles of one depth whose corners are corners of pixels. These snap to
//! where they are, half a pixel from every sample, so that it covers its samples and no others. A device
//! that interpolates depth by differences finds that depth exactly; one that adds three products of it
//! in f32 may be off by what [`FLAT_DEPTH_STEP`](super::FLAT_DEPTH_STEP) says, of which the half of
//! [`DEPTH_ROUNDING`] that the contents do not need covers three units of eight.

use glam::{DMat4, DVec4};
use plainsight_reference::DepthOrder;

use super::{Aabb, ClipError, Margins};
use crate::math::clip_error::absolute;

/// Dilation of a projected box beyond its transform bound, for window arithmetic (2⁻⁷ pixel) and for
/// snapping: 2⁻⁹ pixel in the reference, 2⁻⁵ at most on a device, for which Vulkan asks no fewer than
/// 4 sub-pixel bits. Together they are under 2⁻⁴; this is twice that.
pub const RECTANGLE_DILATION_PIXELS: f64 = 0.125;
/// What z·(1/w) may lose: reciprocal and product, one f32 rounding each of a value up to 1 in size, and one
/// for the final rounding of an interpolated depth, doubled for the order of the bound itself. Reversed
/// depths are mostly far below 1 and rounded that much finer: there it is a share of the nearest depth,
/// which is the largest in size.
pub const DEPTH_ROUNDING: f64 = 6.0 * (f32::EPSILON as f64 / 2.0);
/// Rounding of a corner's own transform in f64: four products and three additions, doubled.
const CORNER_GAMMA: f64 = 8.0 * (f64::EPSILON / 2.0);

/// A half-open rectangle of whole pixels, never empty, row 0 on top.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PixelRectangle {
    /// First column and row.
    pub min: [u32; 2],
    /// One beyond the last column and row.
    pub max: [u32; 2],
}

impl PixelRectangle {
    /// Whether the two share a pixel.
    #[must_use]
    pub fn overlaps(&self, other: &Self) -> bool {
        (0..2).all(|i| self.min[i] < other.max[i] && other.min[i] < self.max[i])
    }
}

/// Where the contents of a box can appear.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Projection {
    /// On no sample at all.
    Nowhere,
    /// It reaches the near plane or the smallest w, holds the eye or is not finite: to be taken for
    /// visible.
    Unbounded,
    /// Within the rectangle and nowhere nearer than the depth, which lies between the planes.
    Within {
        /// Pixels that can be touched.
        rectangle: PixelRectangle,
        /// Nearest depth, rounded down.
        depth: f32,
    },
}

/// A side of the frustum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FrustumPlane {
    /// x = −w.
    Left,
    /// x = w.
    Right,
    /// y = −w.
    Bottom,
    /// y = w.
    Top,
    /// z = 0; z = −w where depth is reversed.
    Near,
    /// z = w; z = 0 where depth is reversed.
    Far,
}

/// The corners of a box in the window, rows going down, and how far f32 transforms may move its contents.
pub(super) struct WindowCorners {
    /// Column and row of each, pixels.
    pub(super) corners: [[f64; 2]; 8],
    /// The transform bound on each axis, pixels.
    pub(super) bound: [f64; 2],
    /// Smallest w of anything inside.
    w_min: f64,
}

/// The corners of a box in clip space with the bound on its contents' error.
#[derive(Clone, Copy, Debug)]
pub struct ClipBox {
    corners: [DVec4; 8],
    error: [f64; 4],
    pub(super) order: DepthOrder,
}

impl ClipBox {
    /// Transforms `aabb` by `clip_from_box`, whose z is that of the depth order. `error` is the bound of what
    /// the box contains.
    #[must_use]
    pub fn new(aabb: &Aabb, clip_from_box: &DMat4, error: &ClipError, order: DepthOrder) -> Self {
        let corners = aabb.corners().map(|corner| *clip_from_box * corner.extend(1.0));
        let own = absolute(clip_from_box) * aabb.max_abs().extend(1.0) * CORNER_GAMMA;
        Self { corners, error: std::array::from_fn(|i| error.bound[i] + own[i]), order }
    }

    /// Whether the box, moved outward by its error, lies wholly beyond one of the six planes. Any NaN
    /// makes this false.
    #[must_use]
    pub fn outside_frustum(&self) -> bool {
        self.beyond().is_some()
    }

    /// The first plane that the box, moved outward by its error, lies wholly beyond.
    #[must_use]
    pub fn beyond(&self) -> Option<FrustumPlane> {
        let [ex, ey, ez, ew] = self.error;
        let beyond = |inside: &dyn Fn(&DVec4) -> f64, margin: f64| {
            self.corners.iter().all(|corner| inside(corner) + margin < 0.0)
        };
        match () {
            () if beyond(&|c| c.w + c.x, ex + ew) => Some(FrustumPlane::Left),
            () if beyond(&|c| c.w - c.x, ex + ew) => Some(FrustumPlane::Right),
            () if beyond(&|c| c.w + c.y, ey + ew) => Some(FrustumPlane::Bottom),
            () if beyond(&|c| c.w - c.y, ey + ew) => Some(FrustumPlane::Top),
            () if beyond(&|c| before_near(self.order, c), near_error(self.order, &self.error)) => {
                Some(FrustumPlane::Near)
            }
            () if beyond(&|c| before_far(self.order, c), far_error(self.order, ez, ew)) => {
                Some(FrustumPlane::Far)
            }
            () => None,
        }
    }

    /// Whether every corner is inside all six planes. Exact up to rounding, with no margin: for
    /// estimates of work, never for a verdict. Any NaN makes this false.
    #[must_use]
    pub fn inside_frustum(&self) -> bool {
        let inside = |c: &DVec4| {
            c.x.abs() <= c.w
                && c.y.abs() <= c.w
                && before_near(self.order, c) >= 0.0
                && before_far(self.order, c) >= 0.0
        };
        self.corners.iter().all(inside)
    }

    /// The rectangle and nearest depth of the contents in a viewport of `width` × `height` pixels.
    #[must_use]
    pub fn project(&self, width: u32, height: u32) -> Projection {
        self.project_with(width, height, &Margins::PROVEN)
    }

    /// The same with other margins than the proven ones.
    #[must_use]
    pub fn project_with(&self, width: u32, height: u32, margins: &Margins) -> Projection {
        if self.outside_frustum() {
            return Projection::Nowhere;
        }
        let Some(window) = self.window(width, height) else { return Projection::Unbounded };
        let axis = |axis: usize, pixels: u32| {
            let (low, high) = window
                .corners
                .iter()
                .map(|corner| corner[axis])
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), at| (l.min(at), h.max(at)));
            let margin = window.bound[axis] + margins.rectangle_pixels;
            // The first and one beyond the last pixel whose middle is within.
            let clamp = |pixel: f64| pixel.clamp(0.0, f64::from(pixels)) as u32;
            (clamp((low - margin - 0.5).ceil()), clamp((high + margin + 0.5).floor()))
        };
        let ((x0, x1), (y0, y1)) = (axis(0, width), axis(1, height));
        if x0 >= x1 || y0 >= y1 {
            return Projection::Nowhere;
        }
        let [_, _, ez, ew] = self.error;
        let [near, far] = self.order.range();
        let nearest = self.corners.iter().fold(f64::from(far), |z, c| z.min(c.z / c.w));
        // How large the depths of contents are, and so what w's error moves them by and roundings cost.
        let size = match self.order {
            DepthOrder::Forward => 1.0,
            DepthOrder::Reversed => -nearest,
        };
        let exact = nearest - (ez + size * ew) / window.w_min;
        let depth = match self.order {
            DepthOrder::Forward => floor_f32(exact - margins.depth),
            DepthOrder::Reversed => floor_f32(exact + margins.depth * exact),
        };
        let rectangle = PixelRectangle { min: [x0, y0], max: [x1, y1] };
        // Adding zero turns −0 into +0.
        Projection::Within { rectangle, depth: depth.clamp(near, far) + 0.0 }
    }

    /// The corners in the window; `None` where the box reaches the near plane or the smallest w, or is not
    /// finite.
    pub(super) fn window(&self, width: u32, height: u32) -> Option<WindowCorners> {
        let [ex, ey, _, ew] = self.error;
        let w_min = self.corners.iter().fold(f64::INFINITY, |w, c| w.min(c.w)) - ew;
        let before = |c: &DVec4| before_near(self.order, c);
        let least = self.corners.iter().fold(f64::INFINITY, |least, c| least.min(before(c)));
        // Written so that NaN falls out here: "cannot project" means visible.
        if !(w_min > 0.0
            && least - near_error(self.order, &self.error) > 0.0
            && self.corners.iter().all(|c| c.is_finite()))
        {
            return None;
        }
        let mut window = WindowCorners { corners: [[0.0; 2]; 8], bound: [0.0; 2], w_min };
        for (axis, (e, pixels, sign)) in [(ex, width, 1.0), (ey, height, -1.0)].iter().enumerate() {
            let half = f64::from(*pixels) * 0.5;
            let mut reach = 0.0_f64;
            for (place, corner) in window.corners.iter_mut().zip(&self.corners) {
                let ratio = corner[axis] / corner.w;
                reach = reach.max(ratio.abs());
                place[axis] = ratio * sign * half + half;
            }
            window.bound[axis] = (e + reach * ew) / w_min * half;
        }
        Some(window)
    }
}

/// How far a corner is inside the near plane, in clip units.
pub(super) fn before_near(order: DepthOrder, corner: &DVec4) -> f64 {
    match order {
        DepthOrder::Forward => corner.z,
        DepthOrder::Reversed => corner.w + corner.z,
    }
}

/// How far a corner is inside the far plane, in clip units.
fn before_far(order: DepthOrder, corner: &DVec4) -> f64 {
    match order {
        DepthOrder::Forward => corner.w - corner.z,
        DepthOrder::Reversed => -corner.z,
    }
}

/// What [`before_near`] may be off by.
pub(super) fn near_error(order: DepthOrder, &[_, _, ez, ew]: &[f64; 4]) -> f64 {
    match order {
        DepthOrder::Forward => ez,
        DepthOrder::Reversed => ez + ew,
    }
}

/// What [`before_far`] may be off by.
fn far_error(order: DepthOrder, ez: f64, ew: f64) -> f64 {
    match order {
        DepthOrder::Forward => ez + ew,
        DepthOrder::Reversed => ez,
    }
}

/// The largest f32 that is not above `value`.
pub(super) fn floor_f32(value: f64) -> f32 {
    let rounded = value as f32;
    if f64::from(rounded) > value { rounded.next_down() } else { rounded }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    const FORWARD: DepthOrder = DepthOrder::Forward;

    /// All corners in one place.
    fn point(clip: [f64; 4], error: [f64; 4], order: DepthOrder) -> ClipBox {
        ClipBox { corners: [DVec4::from_array(clip); 8], error, order }
    }

    #[test]
    fn constants_are_those_of_the_derivation() {
        let power = |exponent: f64| libm::pow(2.0, exponent);
        assert_eq!(RECTANGLE_DILATION_PIXELS, 2.0 * power(-4.0));
        assert_eq!(DEPTH_ROUNDING, 6.0 * power(-24.0));
        assert_eq!(CORNER_GAMMA, 8.0 * power(-53.0));
    }

    /// A box's error is that of its contents and the rounding of its own corners, row by row; of a box whose
    /// corners all have w = 1 too.
    #[test]
    fn the_rounding_of_corners_is_added() {
        let rows = [[2.0, -1.0, 4.0, 8.0], [0.5, 1.0, -2.0, 0.0], [0.0, 0.0, -1.0, 3.0]];
        let aabb = Aabb::new(DVec3::new(-4.0, 1.0, -1.0), DVec3::new(2.0, 16.0, 0.5));
        let [bound, reach] = [[1.0, 2.0, 4.0, 8.0].map(|e| e / 1e6), [4.0, 16.0, 1.0, 1.0]];
        for last in [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, -2.0, 64.0]] {
            let rows = [rows[0], rows[1], rows[2], last];
            let matrix = DMat4::from_cols_array_2d(&rows).transpose();
            let clip = ClipBox::new(&aabb, &matrix, &ClipError { bound }, FORWARD);
            for (place, row) in rows.iter().enumerate() {
                let sum: f64 =
                    row.iter().zip(reach).map(|(entry, reach)| entry.abs() * reach).sum();
                assert_eq!(clip.error[place], bound[place] + sum * CORNER_GAMMA);
            }
        }
    }

    #[test]
    fn rectangles_that_touch_share_no_pixel() {
        let one = PixelRectangle { min: [2, 3], max: [5, 7] };
        assert!(one.overlaps(&one));
        let at = |min: [u32; 2], max: [u32; 2]| {
            let other = PixelRectangle { min, max };
            assert_eq!(one.overlaps(&other), other.overlaps(&one));
            one.overlaps(&other)
        };
        assert!(at([4, 6], [9, 9]) && at([0, 0], [3, 4]) && at([0, 6], [3, 9]));
        assert!(!at([5, 3], [9, 7]) && !at([0, 3], [2, 7]), "side by side");
        assert!(!at([2, 7], [5, 9]) && !at([2, 0], [5, 3]), "one above the other");
        assert!(!at([5, 7], [9, 9]), "corner to corner");
    }

    /// A box is beyond a plane if it is by more than what its error adds there: at the sum it is not.
    /// Errors are powers of two, so that all sums are exact.
    #[test]
    fn every_plane_has_its_errors() {
        let errors = [0.125, 0.25, 0.5, 1.0].map(|e| e / 1024.0);
        let [ex, ey, ez, ew] = errors;
        let least = 1.0 / (1_u64 << 40) as f64;
        let both = [FORWARD, DepthOrder::Reversed];
        for order in both {
            let middle = if order == FORWARD { 0.5 } else { -0.5 };
            let mut sides = vec![
                (FrustumPlane::Left, 0, -1.0, ex + ew),
                (FrustumPlane::Right, 0, 1.0, ex + ew),
                (FrustumPlane::Bottom, 1, -1.0, ey + ew),
                (FrustumPlane::Top, 1, 1.0, ey + ew),
            ];
            sides.extend(match order {
                DepthOrder::Forward => {
                    [(FrustumPlane::Near, 2, 0.0, ez), (FrustumPlane::Far, 2, 1.0, ez + ew)]
                }
                DepthOrder::Reversed => {
                    [(FrustumPlane::Near, 2, -1.0, ez + ew), (FrustumPlane::Far, 2, 0.0, ez)]
                }
            });
            for (plane, axis, at, margin) in sides {
                let out = if axis == 2 && plane == FrustumPlane::Near { -1.0 } else { 1.0 };
                let out = if at < 0.0 { -1.0 } else { out };
                let beyond = |by: f64| {
                    let mut clip = [0.0, 0.0, middle, 1.0];
                    clip[axis] = at + out * by;
                    point(clip, errors, order).beyond()
                };
                assert_eq!(beyond(margin + least), Some(plane), "{order:?} over");
                assert_eq!(beyond(margin), None, "{order:?} {plane:?} at");
                assert_eq!(beyond(margin - least), None, "{order:?} {plane:?} under");
            }
        }
    }

    /// Beside samples on one axis alone: on no sample.
    #[test]
    fn a_box_between_rows_is_nowhere() {
        let thin = |axis: usize| {
            let mut corners = [DVec4::new(-0.5, -0.5, 0.5, 1.0); 8];
            corners[7] = DVec4::new(0.5, 0.5, 0.5, 1.0);
            // Both ends on the line between two pixels of ten.
            corners.iter_mut().for_each(|corner| corner[axis] = 0.2);
            ClipBox { corners, error: [0.0; 4], order: FORWARD }.project(10, 10)
        };
        assert_eq!(thin(0), Projection::Nowhere);
        assert_eq!(thin(1), Projection::Nowhere);
    }

    /// The nearest depth gives way to both errors over the smallest w.
    #[test]
    fn the_nearest_depth_gives_way_to_the_errors() {
        let [ez, ew] = [0.0625, 0.125];
        let clip = [0.0, 0.0, 1.0, 2.0];
        let of = |order: DepthOrder, z: f64| {
            let at = point([clip[0], clip[1], z, clip[3]], [0.0, 0.0, ez, ew], order);
            match at.project_with(5, 5, &Margins { depth: 0.0, ..Margins::PROVEN }) {
                Projection::Within { depth, .. } => f64::from(depth),
                other => panic!("{other:?}"),
            }
        };
        let w_min = 2.0 - ew;
        assert_eq!(of(FORWARD, 1.0), f64::from(floor_f32(0.5 - (ez + ew) / w_min)));
        let reversed = floor_f32(-0.5 - (ez + 0.5 * ew) / w_min);
        assert_eq!(of(DepthOrder::Reversed, -1.0), f64::from(reversed), "a share of w's");
    }

    /// The window is that of the smallest w and of what is wholly inside the near plane, errors included.
    #[test]
    fn what_may_reach_the_eye_has_no_window() {
        let seen = |w: f64, z: f64, error: [f64; 4], order: DepthOrder| {
            point([0.0, 0.0, z, w], error, order).window(8, 8).is_some()
        };
        let w_error = [0.0, 0.0, 0.0, 0.25];
        assert!(seen(0.375, 0.125, w_error, FORWARD));
        assert!(!seen(0.25, 0.125, w_error, FORWARD), "w may be zero");
        assert!(!seen(0.125, 0.125, w_error, FORWARD), "w may be below zero");
        let z_error = [0.0, 0.0, 0.25, 0.0];
        assert!(seen(1.0, 0.375, z_error, FORWARD));
        assert!(!seen(1.0, 0.25, z_error, FORWARD), "it may touch the plane");
        assert!(!seen(1.0, 0.125, z_error, FORWARD), "it may reach beyond");
        let both = [0.0, 0.0, 0.125, 0.125];
        assert!(seen(1.0, -0.625, both, DepthOrder::Reversed));
        assert!(!seen(1.0, -0.75, both, DepthOrder::Reversed));
        assert!(!seen(1.0, -0.875, both, DepthOrder::Reversed));
    }

    /// The transform bound is that of x over w: its own error, and w's times the ratio, over the smallest w.
    #[test]
    fn the_window_moves_by_the_errors() {
        let at = point([1.0, -0.5, 0.5, 2.0], [0.25, 0.125, 0.0, 0.5], FORWARD);
        let window = at.window(8, 4).unwrap();
        assert_eq!(window.corners[0], [6.0, 2.5]);
        assert_eq!(
            window.bound,
            [(0.25 + 0.5 * 0.5) / 1.5 * 4.0, (0.125 + 0.25 * 0.5) / 1.5 * 2.0]
        );
    }

    #[test]
    fn floors_are_the_largest_below() {
        assert_eq!(floor_f32(0.5), 0.5);
        for value in [0.1, -0.1, 1.0 / 3.0, 1.0 - 1e-12] {
            let floor = floor_f32(value);
            assert!(f64::from(floor) <= value && f64::from(floor.next_up()) > value, "{value}");
        }
    }
}
