//! A view volume as six planes in the world, and what of it a box meets: the frustum test of indexes
//! (p-vertices and n-vertices: Greene 1994, *Detecting intersection of a rectangular solid and a convex
//! polyhedron*). Cullers judge by [`ClipBox`](super::ClipBox), which knows the errors of vertices.
//!
//! A test is a sum of products taken in one order, and every operation of it is monotone: a box inside
//! another never gets the larger sum. So what holds of a node's box holds of the boxes in it **as
//! computed**, to the bit, and a walk of nodes finds at least what a look at every box finds.

use glam::{DMat4, DVec3, DVec4};
use plainsight_reference::DepthOrder;

use super::Aabb;

/// Planes of a volume.
const PLANES: usize = 6;

/// What a box has of a volume.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meets {
    /// It is wholly beyond one of the planes.
    Outside,
    /// It may be partly inside.
    Partly,
    /// It is inside all planes.
    Inside,
}

/// Six half-spaces. A point p is inside where `normal · p + offset ≥ 0` for all.
#[derive(Clone, Copy, Debug)]
pub struct Volume {
    /// By plane: what is positive of the normal's x, y, z, then what is negative, then the offset.
    positive: [[f64; PLANES]; 3],
    negative: [[f64; PLANES]; 3],
    offset: [f64; PLANES],
    /// Holds the volume.
    bounds: Aabb,
}

impl Volume {
    /// The volume that a matrix maps into the clip box. The far plane is the distance limit.
    #[must_use]
    pub fn new(clip_from_world: &DMat4, order: DepthOrder) -> Self {
        let [x, y, z, w] = [0, 1, 2, 3].map(|row| clip_from_world.row(row));
        // Reversed depth is kept negative, from −w (near) to 0.
        let [near, far] = match order {
            DepthOrder::Forward => [z, w - z],
            DepthOrder::Reversed => [z + w, -z],
        };
        let planes = [w + x, w - x, w + y, w - y, near, far];
        let part =
            |axis: usize, keep: &dyn Fn(f64) -> f64| planes.map(|plane: DVec4| keep(plane[axis]));
        let split = |keep: &dyn Fn(f64) -> f64| [0, 1, 2].map(|axis| part(axis, keep));
        Self {
            positive: split(&|n| n.max(0.0)),
            negative: split(&|n| n.min(0.0)),
            offset: planes.map(|plane| plane.w),
            bounds: Self::bounds_of(&clip_from_world.inverse(), order),
        }
    }

    /// The box of the corners, or all space where they are not finite. A hint where to look, widened by
    /// its own size times 2⁻²⁰: inverting the matrix costs digits, and nothing is decided by it alone
    /// that the planes would not decide a hundredth of a unit away.
    fn bounds_of(world_from_clip: &DMat4, order: DepthOrder) -> Aabb {
        let depths = match order {
            DepthOrder::Forward => [0.0, 1.0],
            DepthOrder::Reversed => [-1.0, 0.0],
        };
        let mut bounds = Aabb::EMPTY;
        for corner in 0..8_u8 {
            let sign = |bit: u8| if corner >> bit & 1 == 0 { -1.0 } else { 1.0 };
            let at = DVec4::new(sign(0), sign(1), depths[usize::from(corner >> 2 & 1)], 1.0);
            let point = *world_from_clip * at;
            let point = point.truncate() / point.w;
            if !point.is_finite() || point.abs().max_element() > 1e15 {
                return Aabb::new(DVec3::splat(f64::NEG_INFINITY), DVec3::splat(f64::INFINITY));
            }
            bounds = bounds.union(&Aabb::new(point, point));
        }
        bounds.grown(DVec3::splat(bounds.size().max_element() / (1_u64 << 20) as f64))
    }

    /// A box that holds the volume.
    #[must_use]
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// What a box has of it. The empty box is outside; one with a side that is not a number meets it
    /// partly.
    #[must_use]
    pub fn meets(&self, aabb: &Aabb) -> Meets {
        if aabb.is_empty() && !(aabb.min.is_nan() || aabb.max.is_nan()) {
            return Meets::Outside;
        }
        let (farthest, nearest) = (self.sums(aabb.max, aabb.min), self.sums(aabb.min, aabb.max));
        if farthest.iter().any(|&sum| sum < 0.0) {
            Meets::Outside
        } else if nearest.iter().all(|&sum| sum >= 0.0) {
            Meets::Inside
        } else {
            Meets::Partly
        }
    }

    /// Whether a box is not wholly beyond one of the planes.
    #[must_use]
    pub fn touches(&self, aabb: &Aabb) -> bool {
        self.meets(aabb) != Meets::Outside
    }

    /// By plane, the sum for the corner that takes `high` where the normal is positive.
    fn sums(&self, high: DVec3, low: DVec3) -> [f64; PLANES] {
        let ([px, py, pz], [nx, ny, nz]) = (&self.positive, &self.negative);
        std::array::from_fn(|i| {
            let x = px[i] * high.x + nx[i] * low.x;
            let y = py[i] * high.y + ny[i] * low.y;
            let z = pz[i] * high.z + nz[i] * low.z;
            x + y + z + self.offset[i]
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn looking_down(order: DepthOrder) -> Volume {
        // Columns and rows −1 to 1, 1 to 11 units ahead along −z.
        let flat = DMat4::from_translation(DVec3::new(0.0, 0.0, -0.1))
            * DMat4::from_scale(DVec3::new(1.0, 1.0, -0.1));
        let turned = match order {
            DepthOrder::Forward => flat,
            // z − w: from −1 at the near plane to 0 at the far one.
            DepthOrder::Reversed => DMat4::from_translation(DVec3::NEG_Z) * flat,
        };
        Volume::new(&turned, order)
    }

    fn cube(at: [f64; 3], half: f64) -> Aabb {
        let at = DVec3::from_array(at);
        Aabb::new(at - half, at + half)
    }

    #[test]
    fn boxes_meet_it_as_they_lie() {
        for order in [DepthOrder::Forward, DepthOrder::Reversed] {
            let volume = looking_down(order);
            assert_eq!(volume.meets(&cube([0.0, 0.0, -5.0], 0.5)), Meets::Inside);
            for at in [[2.0, 0.0, -5.0], [0.0, -2.0, -5.0], [0.0, 0.0, 0.0], [0.0, 0.0, -12.0]] {
                assert_eq!(volume.meets(&cube(at, 0.5)), Meets::Outside, "{order:?} {at:?}");
                assert_eq!(volume.meets(&cube(at, 1.5)), Meets::Partly, "{order:?} {at:?}");
            }
            assert_eq!(volume.meets(&Aabb::EMPTY), Meets::Outside);
            let nan = Aabb::new(DVec3::splat(f64::NAN), DVec3::ONE);
            assert_eq!(volume.meets(&nan), Meets::Partly);
            let all = cube([0.0; 3], f64::INFINITY);
            assert_eq!(volume.meets(&all), Meets::Partly, "all space");
            let bounds = volume.bounds();
            assert!(bounds.contains(&cube([0.0, 0.0, -6.0], 1.0)) && bounds.size().z < 10.1);
        }
    }

    proptest! {
        /// What a box has is said of every box inside it too, to the bit.
        #[test]
        fn a_box_inside_never_has_more(
            numbers in prop::array::uniform16(-10.0..10.0_f64),
            low in prop::array::uniform3(-5.0..5.0_f64),
            size in prop::array::uniform3(0.0..4.0_f64),
            within in prop::array::uniform6(0.0..=1.0_f64),
        ) {
            let volume = Volume::new(&DMat4::from_cols_array(&numbers), DepthOrder::Forward);
            let (low, size) = (DVec3::from_array(low), DVec3::from_array(size));
            let outer = Aabb::new(low, low + size);
            let [a, b, c, d, e, f] = within;
            let cut = |p: DVec3| (low + size * p).clamp(outer.min, outer.max);
            let (p, q) = (cut(DVec3::new(a, b, c)), cut(DVec3::new(d, e, f)));
            let inner = Aabb::new(p.min(q), p.max(q));
            match volume.meets(&outer) {
                Meets::Partly => {}
                certain => prop_assert_eq!(volume.meets(&inner), certain),
            }
            if volume.meets(&inner) != Meets::Outside {
                prop_assert_ne!(volume.meets(&outer), Meets::Outside);
            }
        }
    }
}
