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

/// Planes of a volume that are still to be asked about: those that a box around is not wholly inside of
/// (plane masks: Assarsson & Möller 2000, *Optimized view frustum culling algorithms for bounding boxes*).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Planes(u8);

impl Planes {
    /// All six.
    pub const ALL: Self = Self((1 << PLANES) - 1);

    /// Whether there are none: a box inside is inside the volume.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }
}

/// Six half-spaces. A point p is inside where `normal · p + offset ≥ 0` for all. Plane by plane beside one
/// another, so that all are asked at once: what a branch for each would cost is more than their sums.
#[derive(Clone, Copy, Debug)]
pub struct Volume {
    /// Normals by axis, parted by sign: of a box, one of the two parts meets the higher coordinate.
    positive: [[f64; PLANES]; 3],
    negative: [[f64; PLANES]; 3],
    offset: [f64; PLANES],
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
        let planes: [DVec4; PLANES] = [w + x, w - x, w + y, w - y, near, far];
        let by_axis = |part: fn(f64, f64) -> f64| {
            std::array::from_fn(|axis| planes.map(|plane| part(plane[axis], 0.0)))
        };
        Self {
            positive: by_axis(f64::max),
            negative: by_axis(f64::min),
            offset: planes.map(|plane| plane.w),
        }
    }

    /// By plane, the sum for the corner that takes `high` where the normal is positive.
    #[inline]
    fn sums(&self, high: DVec3, low: DVec3) -> [f64; PLANES] {
        let term = |axis: usize, lane: usize| {
            self.positive[axis][lane] * high[axis] + self.negative[axis][lane] * low[axis]
        };
        std::array::from_fn(|lane| {
            term(0, lane) + term(1, lane) + term(2, lane) + self.offset[lane]
        })
    }

    /// The planes that the box is wholly beyond.
    #[inline]
    fn beyond(&self, aabb: &Aabb) -> u8 {
        bits(self.sums(aabb.max, aabb.min).map(|sum| sum < 0.0))
    }

    /// What a box has of it. The empty box is outside; one with a side that is not a number meets it
    /// partly.
    #[must_use]
    pub fn meets(&self, aabb: &Aabb) -> Meets {
        match self.straddled(aabb, Planes::ALL) {
            None => Meets::Outside,
            Some(planes) if planes.is_empty() => Meets::Inside,
            Some(_) => Meets::Partly,
        }
    }

    /// Of some planes, those that a box is not wholly inside of; `None` where it is beyond one of them.
    #[must_use]
    pub fn straddled(&self, aabb: &Aabb, planes: Planes) -> Option<Planes> {
        if is_empty(aabb) || self.beyond(aabb) & planes.0 != 0 {
            return None;
        }
        // A sum that is not a number decides nothing.
        let inside = bits(self.sums(aabb.min, aabb.max).map(|sum| sum >= 0.0));
        Some(Planes(planes.0 & !inside))
    }

    /// Whether a box is not wholly beyond one of the planes.
    #[must_use]
    pub fn touches(&self, aabb: &Aabb) -> bool {
        self.touches_planes(aabb, Planes::ALL)
    }

    /// The same of some planes.
    #[inline]
    #[must_use]
    pub fn touches_planes(&self, aabb: &Aabb, planes: Planes) -> bool {
        !is_empty(aabb) & (self.beyond(aabb) & planes.0 == 0)
    }
}

/// Bit by lane.
fn bits(lanes: [bool; PLANES]) -> u8 {
    (0..).zip(lanes).fold(0, |bits, (lane, set)| bits | u8::from(set) << lane)
}

/// Whether a box certainly holds nothing; what is not a number says nothing.
fn is_empty(aabb: &Aabb) -> bool {
    aabb.min.cmpgt(aabb.max).any()
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
            prop_assert_eq!(volume.touches(&inner), volume.meets(&inner) != Meets::Outside);
            // To ask about what the outer one straddles is to ask about all.
            if let Some(planes) = volume.straddled(&outer, Planes::ALL) {
                let all = volume.straddled(&inner, Planes::ALL);
                prop_assert_eq!(volume.straddled(&inner, planes), all);
                prop_assert_eq!(volume.touches_planes(&inner, planes), volume.touches(&inner));
            }
        }
    }
}
