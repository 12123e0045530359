//! How far the reference's (and a device's) f32 clip coordinates may stand from the exact ones: a
//! running error bound in the sense of Higham, *Accuracy and Stability of Numerical Algorithms*,
//! section 3.3, taken from the coordinates that a box contains.

use glam::{DMat4, DVec3};

/// Unit roundoff of f32.
const F32_ROUNDOFF: f64 = (f32::EPSILON / 2.0) as f64;
/// Unit roundoff of f64.
const F64_ROUNDOFF: f64 = f64::EPSILON / 2.0;
/// Roundings behind one clip coordinate: one for the matrix entry, one for the product and three
/// additions make the five of the transform; clipping against six planes moves a new vertex off its
/// exact edge by the three operations of `out + t·(in − out)`, at most six times over.
const ROUNDINGS: f64 = 5.0 + 6.0 * 3.0;
/// γ₂₃ = n·u / (1 − n·u) for f32 and the [`ROUNDINGS`] above.
///
/// A clip coordinate is Σ mⱼ·vⱼ; each term passes through at most n roundings, so the computed sum
/// differs from the exact one by at most γₙ·Σ|mⱼ||vⱼ|. A vertex made by clipping lies on the segment
/// of two such vertices (an error of t only slides it along the edge), hence under the same sum.
pub const CLIP_ERROR_GAMMA: f64 = ROUNDINGS * F32_ROUNDOFF / (1.0 - ROUNDINGS * F32_ROUNDOFF);
/// Composing two affine or projective matrices in f64 rounds each term at most four times (γ₄), and
/// the second product of view and projection as often again: eight units of the *absolute* product,
/// which stays large where a camera and an object far from the origin cancel.
const COMPOSITION_GAMMA: f64 = 8.0 * F64_ROUNDOFF / (1.0 - 8.0 * F64_ROUNDOFF);
/// A number below 2⁻¹²⁶ may be flushed to zero on a device, and loses bits in f32 itself: a matrix entry
/// by this times the coordinate that it meets, a sum by this alone. 2⁻¹²⁰ covers all of [`ROUNDINGS`].
const UNDERFLOW: f64 = 1.0 / ((1_u128 << 60) as f64 * (1_u128 << 60) as f64);

/// Absolute bounds on the error of the four clip coordinates of anything inside a box.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ClipError {
    /// Bound on |Δx|, |Δy|, |Δz|, |Δw|, in clip units, each ≥ 0.
    pub bound: [f64; 4],
}

impl ClipError {
    /// No error at all; the identity of [`ClipError::max`].
    pub const ZERO: Self = Self { bound: [0.0; 4] };

    /// The bound for contents whose object-space coordinates reach at most `reach` from zero, under
    /// `clip_from_world · world_from_object` rounded to f32. NaN or infinite input gives a bound that
    /// is not finite, and whatever carries it counts as visible.
    #[must_use]
    pub fn of(clip_from_world: &DMat4, world_from_object: &DMat4, reach: DVec3) -> Self {
        let product = *clip_from_world * *world_from_object;
        let magnitude = absolute(clip_from_world) * absolute(world_from_object);
        let reach = reach.extend(1.0);
        let rounded = absolute(&product) * reach;
        let composed = magnitude * reach;
        let bound = std::array::from_fn(|i| {
            CLIP_ERROR_GAMMA * rounded[i]
                + COMPOSITION_GAMMA * composed[i]
                + UNDERFLOW * reach.element_sum()
        });
        Self { bound }
    }

    /// The bound that holds for the contents of both. NaN wins.
    #[must_use]
    pub fn max(&self, other: &Self) -> Self {
        let larger = |a: f64, b: f64| if a >= b || a.is_nan() { a } else { b };
        Self { bound: std::array::from_fn(|i| larger(self.bound[i], other.bound[i])) }
    }
}

/// Absolute value of every entry.
pub(super) fn absolute(matrix: &DMat4) -> DMat4 {
    DMat4::from_cols(
        matrix.x_axis.abs(),
        matrix.y_axis.abs(),
        matrix.z_axis.abs(),
        matrix.w_axis.abs(),
    )
}

/// The object-to-clip matrix as the truth and the devices take it: composed in f64, each entry
/// rounded to f32 once, column-major.
#[must_use]
pub fn rounded_clip_matrix(clip_from_object: &DMat4) -> [f32; 16] {
    clip_from_object.to_cols_array().map(|entry| entry as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn power(exponent: i32) -> f64 {
        libm::pow(2.0, f64::from(exponent))
    }

    #[test]
    fn constants_are_those_of_the_derivation() {
        let gamma = |n: f64, u: f64| n * u / (1.0 - n * u);
        assert_eq!(ROUNDINGS, 23.0);
        assert_eq!(CLIP_ERROR_GAMMA, gamma(23.0, power(-24)));
        assert_eq!(COMPOSITION_GAMMA, gamma(8.0, power(-53)));
        assert_eq!(UNDERFLOW, power(-120));
    }

    /// Each of the three terms alone, on every coordinate.
    #[test]
    fn the_bound_is_the_sum_of_its_terms() {
        let reach = DVec3::new(2.0, 3.0, 5.0);
        let nothing = ClipError::of(&DMat4::ZERO, &DMat4::ZERO, reach);
        assert_eq!(nothing.bound, [11.0 * UNDERFLOW; 4], "what is flushed: 2 + 3 + 5 + 1");
        // Row i of the one is (i, −i, 0, 0) and both upper rows of the other are (7, 11, 13, 17): the
        // product cancels to nothing, the absolute one is 2i (7·2 + 11·3 + 13·5 + 17).
        let rows = [1.0, 2.0, 3.0, 4.0];
        let clip = DMat4::from_cols_array_2d(&[rows, rows.map(|row| -row), [0.0; 4], [0.0; 4]]);
        let world = DMat4::from_cols_array_2d(
            &[7.0, 11.0, 13.0, 17.0].map(|entry| [entry, entry, 0.0, 0.0]),
        );
        let cancelled = ClipError::of(&clip, &world, reach).bound;
        assert_eq!(cancelled, rows.map(|i| COMPOSITION_GAMMA * (2.0 * i * 129.0)));
        // The product as it is, by far the largest: with one column of the first, nothing cancels.
        let clip = DMat4::from_cols_array_2d(&[rows, [0.0; 4], [0.0; 4], [0.0; 4]]);
        let whole = ClipError::of(&clip, &world, reach).bound;
        assert_eq!(
            whole,
            rows.map(|i| CLIP_ERROR_GAMMA * (i * 129.0) + COMPOSITION_GAMMA * (i * 129.0))
        );
    }

    #[test]
    fn the_larger_bound_holds_for_both() {
        let (a, b) =
            (ClipError { bound: [1.0, 4.0, 2.0, 0.0] }, ClipError { bound: [3.0, 2.0, 2.0, 5.0] });
        let both = ClipError { bound: [3.0, 4.0, 2.0, 5.0] };
        assert_eq!((a.max(&b), b.max(&a)), (both, both));
        assert_eq!(a.max(&ClipError::ZERO), a);
        let nan = ClipError { bound: [f64::NAN; 4] };
        assert!(nan.max(&a).bound.iter().all(|bound| bound.is_nan()), "NaN wins");
        assert!(a.max(&nan).bound.iter().all(|bound| bound.is_nan()), "NaN wins");
    }

    /// A huge mesh under a tiny scale: entries of the matrix are subnormal, or zero on a device that
    /// flushes them, while the products are not small at all.
    #[test]
    fn tiny_entries_times_huge_coordinates_stay_within_the_bound() {
        for scale in [1.0e-37, 3.0e-39, 7.0e-41, 2.0e-44] {
            let world = DMat4::from_scale(DVec3::splat(scale));
            let reach = DVec3::splat(3.0e38);
            let bound = ClipError::of(&DMat4::IDENTITY, &world, reach).bound[0];
            let (exact, entry) = (scale * reach.x, scale as f32);
            let flushed = if entry.is_normal() { entry } else { 0.0 };
            for entry in [entry, flushed] {
                let error = (f64::from(entry * 3.0e38_f32) - exact).abs();
                assert!(error <= bound, "{scale}: {error} beyond {bound}");
            }
        }
    }
}
