//! Axis-aligned boxes in `f64`, closed on every side.

use glam::{DMat4, DVec3};

/// An axis-aligned box, closed: points on its faces are inside. A box with any `min > max` is empty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

/// Outward margin of [`Aabb::transformed`], as a multiple of the sum of absolute terms.
///
/// Each coordinate of a corner is a sum of four terms `m·x` in f64: one rounding per product and
/// three additions, so its error is at most γ₄·Σ|m||x| with γ₄ = 4u/(1−4u), u = 2⁻⁵³. Eight units
/// cover γ₄ together with the rounding of the bound itself and of the final outward step.
pub const TRANSFORM_MARGIN: f64 = 8.0 * (f64::EPSILON / 2.0);

impl Aabb {
    /// The box that holds nothing; the identity of [`Aabb::union`].
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// The box of two corners, which must be ordered for a box that is not empty.
    #[must_use]
    pub const fn new(min: DVec3, max: DVec3) -> Self {
        Self { min, max }
    }

    /// The tight box of `points`, exact. Empty for no points.
    #[must_use]
    pub fn of_points<'a>(points: impl IntoIterator<Item = &'a [f32; 3]>) -> Self {
        points.into_iter().fold(Self::EMPTY, |aabb, p| {
            let p = DVec3::new(f64::from(p[0]), f64::from(p[1]), f64::from(p[2]));
            Self { min: aabb.min.min(p), max: aabb.max.max(p) }
        })
    }

    /// Whether it holds no point at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y && self.min.z <= self.max.z)
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether every point of `other` is inside. The empty box is inside every box.
    #[must_use]
    pub fn contains(&self, other: &Self) -> bool {
        other.is_empty() || (self.min.cmple(other.min).all() && self.max.cmpge(other.max).all())
    }

    /// Whether `point` is inside or on a face.
    #[must_use]
    pub fn contains_point(&self, point: DVec3) -> bool {
        self.min.cmple(point).all() && self.max.cmpge(point).all()
    }

    /// The middle; meaningless for an empty box.
    #[must_use]
    pub fn center(&self) -> DVec3 {
        (self.min + self.max) * 0.5
    }

    /// Edge lengths; negative for an empty box.
    #[must_use]
    pub fn size(&self) -> DVec3 {
        self.max - self.min
    }

    /// The eight corners; bit 0 of the position picks x, bit 1 y, bit 2 z.
    #[must_use]
    pub fn corners(&self) -> [DVec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, lo: f64, hi: f64| if i >> bit & 1 == 0 { lo } else { hi };
            DVec3::new(
                pick(0, self.min.x, self.max.x),
                pick(1, self.min.y, self.max.y),
                pick(2, self.min.z, self.max.z),
            )
        })
    }

    /// The largest absolute coordinate on each axis of any point inside.
    #[must_use]
    pub fn max_abs(&self) -> DVec3 {
        self.min.abs().max(self.max.abs())
    }

    /// The box grown by `margin` on every side.
    #[must_use]
    pub fn grown(&self, margin: DVec3) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }

    /// A box that holds the image of every inside point under the affine `matrix`, rounded outward
    /// by [`TRANSFORM_MARGIN`]. The empty box stays empty.
    #[must_use]
    pub fn transformed(&self, matrix: &DMat4) -> Self {
        if self.is_empty() {
            return Self::EMPTY;
        }
        let mut out = Self::EMPTY;
        for corner in self.corners() {
            let p = matrix.transform_point3(corner);
            out = Self { min: out.min.min(p), max: out.max.max(p) };
        }
        let reach = self.max_abs();
        let magnitude = matrix.x_axis.truncate().abs() * reach.x
            + matrix.y_axis.truncate().abs() * reach.y
            + matrix.z_axis.truncate().abs() * reach.z
            + matrix.w_axis.truncate().abs();
        out.grown(magnitude * TRANSFORM_MARGIN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn aabb(min: [f64; 3], max: [f64; 3]) -> Aabb {
        Aabb::new(DVec3::from_array(min), DVec3::from_array(max))
    }

    #[test]
    fn empty_is_what_holds_no_point() {
        assert!(Aabb::EMPTY.is_empty());
        assert!(!aabb([1.0; 3], [1.0; 3]).is_empty(), "a point is a box");
        for axis in 0..3 {
            let mut max = [2.0; 3];
            max[axis] = 0.5;
            assert!(aabb([1.0; 3], max).is_empty(), "inverted along {axis}");
            max[axis] = f64::NAN;
            assert!(aabb([1.0; 3], max).is_empty(), "not a number along {axis}");
        }
    }

    #[test]
    fn boxes_are_closed() {
        let unit = aabb([0.0; 3], [1.0; 3]);
        assert!(unit.contains(&unit) && unit.contains(&Aabb::EMPTY));
        assert!(Aabb::EMPTY.contains(&Aabb::EMPTY) && !Aabb::EMPTY.contains(&unit));
        for axis in 0..3 {
            for (end, beyond) in [(0.0, -1e-9), (1.0, 1.0 + 1e-9)] {
                let mut point = [0.5; 3];
                point[axis] = end;
                assert!(unit.contains_point(DVec3::from_array(point)), "on a face");
                point[axis] = beyond;
                let beyond = DVec3::from_array(point);
                assert!(!unit.contains_point(beyond), "{beyond}");
                let reaching = unit.union(&Aabb::new(beyond, beyond));
                assert!(!unit.contains(&reaching) && reaching.contains(&unit), "{beyond}");
            }
        }
    }

    #[test]
    fn middle_size_reach_and_corners() {
        let aabb = aabb([-7.0, 2.0, 3.0], [5.0, 4.0, 8.0]);
        assert_eq!(aabb.center(), DVec3::new(-1.0, 3.0, 5.5));
        assert_eq!(aabb.size(), DVec3::new(12.0, 2.0, 5.0));
        assert_eq!(aabb.max_abs(), DVec3::new(7.0, 4.0, 8.0));
        let corners = aabb.corners();
        assert_eq!(corners[0], aabb.min);
        assert_eq!(corners[1], DVec3::new(5.0, 2.0, 3.0), "bit 0 is x");
        assert_eq!(corners[2], DVec3::new(-7.0, 4.0, 3.0), "bit 1 is y");
        assert_eq!(corners[4], DVec3::new(-7.0, 2.0, 8.0), "bit 2 is z");
        assert_eq!(corners[7], aabb.max);
    }

    /// The margin is eight units of 2⁻⁵³ of the sum of absolute terms, on each axis.
    #[test]
    fn a_transformed_box_is_rounded_outward_by_its_margin() {
        assert_eq!(TRANSFORM_MARGIN, 8.0 * libm::pow(2.0, -53.0));
        let matrix = DMat4::from_cols_array_2d(&[
            [0.0, -2.0, 0.0, 0.0],
            [3.0, 0.0, 0.0, 0.0],
            [0.0, 0.0, -5.0, 0.0],
            [7.0, -11.0, 13.0, 1.0],
        ]);
        let moved = aabb([1.0, 2.0, 3.0], [4.0, 6.0, 8.0]).transformed(&matrix);
        let sums = DVec3::new(18.0 + 7.0, 8.0 + 11.0, 40.0 + 13.0) * TRANSFORM_MARGIN;
        assert_eq!(moved.min, DVec3::new(13.0, -19.0, -27.0) - sums);
        assert_eq!(moved.max, DVec3::new(25.0, -13.0, -2.0) + sums);
        assert!(Aabb::EMPTY.transformed(&matrix).is_empty());
    }
}
