//! The inflation that lets a box, drawn with interpolated depth, stand in for its contents.
//!
//! # Derivation
//! A point v of the box has clip coordinates c = M·(v, 1). What is drawn of it may appear at c + e
//! with |e| bounded per coordinate: the contents' and the proxy's own clip error (twice
//! [`ClipError`]), one pixel of window arithmetic and snapping at w, and [`BOX_DEPTH_SLACK`] of depth
//! at w. Then M⁻¹(c + e) = (v + a, 1 + b) with |a| ≤ |M⁻¹|·|e| in the first three rows and |b| likewise
//! in the last, so the point moved by d = (a − b·v) / (1 + b). A box grown by |d| on each axis holds
//! every such point, and being convex in front of the eye it covers every sample of the contents at a
//! depth no greater than theirs.
//!
//! What is drawn of the grown box has moved corners too. Its faces towards the eye are one sheet whose
//! outline, like a hull's (`hull`), goes round the sample's place at a distance that those moves do not
//! reach, so one of their triangles covers it; faces that a move turns to the other side are edge-on and
//! add nothing, for both faces count. The weak place of the proof is depth: a device may evaluate the
//! plane of a triangle anywhere within the pixel, and how far that is off has no bound for a face that is
//! nearly edge-on ([`BOX_DEPTH_SLACK`]). The attack in `tests/it/proxies.rs` found no such case on the
//! reference, which interpolates exactly.

use glam::{DMat4, DVec3, DVec4};
use plainsight_reference::DepthOrder;

use super::clip_box::{before_near, near_error};
use super::clip_error::absolute;
use super::{Aabb, ClipError, Margins};

/// Depth by which the faces of a box proxy stand before its contents: 64 ulps of a depth near 1 (where depth
/// is reversed, of the box's nearest depth), for
/// a device that evaluates a plane in f32 (three roundings of terms that stay below the viewport's
/// size times the slope). It holds for faces that are not nearly edge-on; that is why the rectangle,
/// which has no slope, is the default.
pub const BOX_DEPTH_SLACK: f64 = 64.0 * (f32::EPSILON as f64 / 2.0);
/// Pixels by which a box grows on each side: what moves its contents' corners in the window (see
/// `RECTANGLE_DILATION_PIXELS`, under 2⁻⁴) moves its own as well, and a device evaluates the slope of
/// its faces at places of its own within the pixel; one pixel holds all three.
pub const BOX_DILATION_PIXELS: f64 = 1.0;
/// Rounding of the inverse and of the products with it; a matrix so ill-conditioned that this does
/// not hold gives a box that reaches the near plane, hence a rectangle.
const INVERSE_SLACK: f64 = 2.0;
/// Largest |b| taken: beyond it 1 + b may come near zero.
const MOST_PERSPECTIVE_SHIFT: f64 = 0.5;

/// Grows `aabb` as derived above, rounded outward to f32; `None` where the inverse is not finite, the
/// shift is too large, or the grown box would reach the near plane: ask about the rectangle then.
#[must_use]
pub fn inflated_box(
    aabb: &Aabb,
    clip_from_box: &DMat4,
    error: &ClipError,
    viewport: (u32, u32),
    order: DepthOrder,
) -> Option<Aabb> {
    inflated_box_with(aabb, clip_from_box, error, (viewport, order), &Margins::PROVEN)
}

/// The same with other margins than the proven ones.
#[must_use]
pub fn inflated_box_with(
    aabb: &Aabb,
    clip_from_box: &DMat4,
    error: &ClipError,
    ((width, height), order): ((u32, u32), DepthOrder),
    margins: &Margins,
) -> Option<Aabb> {
    let corners = aabb.corners().map(|corner| *clip_from_box * corner.extend(1.0));
    let w_max = corners.iter().fold(0.0_f64, |w, c| w.max(c.w));
    // Depth times w, at most.
    let deepest = match order {
        DepthOrder::Forward => w_max,
        DepthOrder::Reversed => corners.iter().fold(0.0_f64, |z, c| z.max(c.z.abs())),
    };
    let pixel = |pixels: u32| 2.0 * margins.box_pixels / f64::from(pixels) * w_max;
    let own = error.bound.map(|bound| 2.0 * bound);
    let moved = DVec4::new(
        own[0] + own[3] + pixel(width),
        own[1] + own[3] + pixel(height),
        own[2] + own[3] + margins.box_depth * deepest,
        own[3],
    );
    let shift = absolute(&clip_from_box.inverse()) * moved * INVERSE_SLACK;
    // Written so that NaN gives up.
    if !(shift.is_finite() && shift.w <= MOST_PERSPECTIVE_SHIFT) {
        return None;
    }
    let margin = (shift.truncate() + aabb.max_abs() * shift.w) / (1.0 - shift.w);
    let grown = aabb.grown(margin);
    let outward = Aabb::new(
        DVec3::from_array(grown.min.to_array().map(|c| f64::from((c as f32).next_down()))),
        DVec3::from_array(grown.max.to_array().map(|c| f64::from((c as f32).next_up()))),
    );
    let clear = |corner: DVec3| {
        let clip = *clip_from_box * corner.extend(1.0);
        before_near(order, &clip) > near_error(order, &moved.to_array()) && clip.w > moved.w
    };
    outward.corners().into_iter().all(clear).then_some(outward)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// x, y and z doubled, fourfold, eightfold; w is 1 everywhere.
    fn scaled() -> DMat4 {
        DMat4::from_scale(DVec3::new(2.0, 4.0, 8.0))
    }

    fn grown(error: [f64; 4], order: DepthOrder) -> Option<Aabb> {
        let (low, high) = match order {
            DepthOrder::Forward => (0.0625, 0.125),
            DepthOrder::Reversed => (-0.0625, -0.03125),
        };
        let aabb = Aabb::new(DVec3::new(-0.25, -0.125, low), DVec3::new(0.125, 0.0625, high));
        inflated_box(&aabb, &scaled(), &ClipError { bound: error }, (64, 32), order)
    }

    /// The derivation by hand, for a matrix whose inverse halves, quarters and takes an eighth.
    #[test]
    fn a_box_grows_by_what_was_derived() {
        assert_eq!(BOX_DEPTH_SLACK, 64.0 * libm::pow(2.0, -24.0));
        let error = [0.001, 0.002, 0.003, 0.004];
        for (order, deepest, reach, low) in [
            (DepthOrder::Forward, 1.0, 0.125, 0.0625),
            (DepthOrder::Reversed, 0.5, 0.0625, -0.0625),
        ] {
            let grown = grown(error, order).expect("it is clear of the plane");
            let pixel = |pixels: f64| 2.0 * BOX_DILATION_PIXELS / pixels;
            let moved = [
                2.0 * (0.001 + 0.004) + pixel(64.0),
                2.0 * (0.002 + 0.004) + pixel(32.0),
                2.0 * (0.003 + 0.004) + BOX_DEPTH_SLACK * deepest,
            ];
            let shift = 2.0 * 0.004 * INVERSE_SLACK;
            let margin = |axis: usize, inverse: f64, reach: f64| {
                (moved[axis] * inverse * INVERSE_SLACK + reach * shift) / (1.0 - shift)
            };
            let expected = [
                -0.25 - margin(0, 0.5, 0.25),
                -0.125 - margin(1, 0.25, 0.125),
                low - margin(2, 0.125, reach),
            ];
            for (axis, (&value, expected)) in grown.min.to_array().iter().zip(expected).enumerate()
            {
                let ulp = f64::from(f32::EPSILON) * expected.abs();
                assert!(value < expected && value > expected - 2.0 * ulp, "{order:?} axis {axis}");
            }
            let highest = 0.125 + margin(0, 0.5, 0.25);
            assert!(grown.max.x > highest && grown.max.x < highest + 1e-6, "{order:?}");
        }
    }

    /// A shift near one half reaches the eye whatever the box: no box then, nor beyond, nor of an error that
    /// is not finite.
    #[test]
    fn too_large_a_shift_gives_no_box() {
        let with = |ew: f64| grown([0.0, 0.0, 0.0, ew], DepthOrder::Forward).is_some();
        assert!(with(0.004) && !with(0.12) && !with(0.13) && !with(1.0));
        assert!(!with(f64::INFINITY) && !with(f64::NAN));
    }
}
