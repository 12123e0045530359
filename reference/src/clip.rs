//! Clipping in clip space, by Sutherland & Hodgman 1974 (*Reentrant polygon clipping*), in f32.

use crate::image::Viewport;
use crate::order::DepthOrder;

/// x, y, z, w.
pub(crate) type ClipVertex = [f32; 4];

/// A triangle cut by six planes has at most nine corners.
pub(crate) const MAX_CORNERS: usize = 9;

fn projects(c: &ClipVertex) -> bool {
    c[3] > 0.0 && (1.0 / c[3]).is_finite()
}

/// A convex polygon in clip space.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Polygon {
    corners: [ClipVertex; MAX_CORNERS],
    len: usize,
}

impl Polygon {
    pub(crate) fn corners(&self) -> &[ClipVertex] {
        &self.corners[..self.len]
    }

    fn push(&mut self, corner: ClipVertex) {
        self.corners[self.len] = corner;
        self.len += 1;
    }
}

/// The guard band of one viewport: |x| ≤ `across`·w and |y| ≤ `down`·w.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Clipper {
    across: f32,
    down: f32,
    order: DepthOrder,
}

/// Pixels from the window's origin to the end of the guard band, less one that the rounding of new
/// vertices (a few f32 ulps of 2¹⁵, that is 2⁻⁷ pixel) may use up.
const GUARD_PIXELS: f32 = 32_767.0;

impl Clipper {
    /// Window = ndc·half + half, so ndc = (guard − half) / half keeps the far side within the guard;
    /// the near side, half further, is within it all the more.
    pub(crate) fn new(viewport: Viewport, order: DepthOrder) -> Self {
        let factor = |pixels: u32| {
            let half = pixels as f32 * 0.5;
            (GUARD_PIXELS - half) / half
        };
        Self { across: factor(viewport.width), down: factor(viewport.height), order }
    }

    /// Distance to plane `plane`, not negative inside.
    fn distance(&self, plane: usize, [x, y, z, w]: ClipVertex) -> f32 {
        match plane {
            0 if self.order == DepthOrder::Forward => z,
            0 => w + z,
            1 if self.order == DepthOrder::Forward => w - z,
            1 => -z,
            2 => self.across * w + x,
            3 => self.across * w - x,
            4 => self.down * w + y,
            _ => self.down * w - y,
        }
    }

    /// A bit for each plane that the vertex is beyond, the lowest for near, and the seventh where it is
    /// not finite or has no reciprocal: [`Clipper::clip`] gives back a triangle whose vertices have none
    /// as it is, and nothing for one whose vertices are all beyond near.
    pub(crate) fn outside(&self, vertex: ClipVertex) -> u8 {
        let finite = vertex.iter().all(|c| c.is_finite());
        let mut bits = u8::from(!(finite && projects(&vertex))) << 6;
        for plane in 0..6 {
            bits |= u8::from(self.distance(plane, vertex) < 0.0) << plane;
        }
        bits
    }

    /// The part of the triangle inside all planes; `None` where nothing is left, or where a coordinate
    /// is not finite, or where a corner's w has no finite reciprocal. The last can be only where the
    /// corner coincides with the eye within rounding (near ≤ z ≤ far and |x|, |y| ≤ k·w leave nothing
    /// but the origin at w = 0), where a triangle has no image.
    pub(crate) fn clip(&self, triangle: [ClipVertex; 3]) -> Option<Polygon> {
        if !triangle.iter().flatten().all(|c| c.is_finite()) {
            return None;
        }
        let mut polygon = Polygon { corners: [[0.0; 4]; MAX_CORNERS], len: 3 };
        polygon.corners[..3].copy_from_slice(&triangle);
        for plane in 0..6 {
            let outside = |c: &ClipVertex| self.distance(plane, *c) < 0.0;
            if polygon.corners().iter().any(outside) {
                polygon = self.cut(plane, &polygon);
            }
        }
        (polygon.len >= 3 && polygon.corners().iter().all(projects)).then_some(polygon)
    }

    fn cut(&self, plane: usize, polygon: &Polygon) -> Polygon {
        let mut kept = Polygon { corners: [[0.0; 4]; MAX_CORNERS], len: 0 };
        for (i, &to) in polygon.corners().iter().enumerate() {
            let from = polygon.corners()[(i + polygon.len - 1) % polygon.len];
            let (d_from, d_to) = (self.distance(plane, from), self.distance(plane, to));
            if (d_from < 0.0) != (d_to < 0.0) && kept.len < MAX_CORNERS {
                let (out, inside, d_out, d_in) =
                    if d_from < 0.0 { (from, to, d_from, d_to) } else { (to, from, d_to, d_from) };
                let t = d_out / (d_out - d_in);
                kept.push(std::array::from_fn(|c| out[c] + t * (inside[c] - out[c])));
            }
            if d_to >= 0.0 && kept.len < MAX_CORNERS {
                kept.push(to);
            }
        }
        kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VIEWPORT: Viewport = Viewport { width: 64, height: 32 };
    const ORDERS: [DepthOrder; 2] = [DepthOrder::Forward, DepthOrder::Reversed];

    /// A clipper and, at w = 2, a point on each of its planes with a step outward.
    fn planes(order: DepthOrder) -> (Clipper, [(ClipVertex, ClipVertex); 6]) {
        let clipper = Clipper::new(VIEWPORT, order);
        let [near, far] = order.range().map(|depth| 2.0 * depth);
        let inside = (near + far) * 0.5;
        let (across, down) = (2.0 * clipper.across, 2.0 * clipper.down);
        let planes = [
            ([0.5, 0.5, near, 2.0], [0.0, 0.0, -1.0, 0.0]),
            ([0.5, 0.5, far, 2.0], [0.0, 0.0, 1.0, 0.0]),
            ([-across, 0.5, inside, 2.0], [-1.0, 0.0, 0.0, 0.0]),
            ([across, 0.5, inside, 2.0], [1.0, 0.0, 0.0, 0.0]),
            ([0.5, -down, inside, 2.0], [0.0, -1.0, 0.0, 0.0]),
            ([0.5, down, inside, 2.0], [0.0, 1.0, 0.0, 0.0]),
        ];
        (clipper, planes)
    }

    fn moved(at: ClipVertex, step: ClipVertex, by: f32) -> ClipVertex {
        std::array::from_fn(|c| at[c] + step[c] * by)
    }

    /// On a plane is inside; a step outward is beyond it and beyond no other.
    #[test]
    fn each_plane_is_closed() {
        for order in ORDERS {
            let (clipper, planes) = planes(order);
            for (plane, (on, outward)) in planes.into_iter().enumerate() {
                assert_eq!(clipper.outside(on), 0, "{order:?} plane {plane}: {on:?}");
                assert_eq!(clipper.outside(moved(on, outward, 0.25)), 1 << plane, "{order:?}");
                assert_eq!(clipper.outside(moved(on, outward, -0.25)), 0, "{order:?}");
            }
        }
    }

    /// The band ends a pixel within ±2¹⁵ on the far side, whatever the window's origin.
    #[test]
    fn the_guard_band_is_where_it_is_said() {
        let clipper = Clipper::new(VIEWPORT, DepthOrder::Forward);
        let column = clipper.across * 32.0 + 32.0;
        let row = clipper.down * 16.0 + 16.0;
        assert!(
            (column - 32_767.0).abs() < 0.01 && (row - 32_767.0).abs() < 0.01,
            "{column} {row}"
        );
    }

    /// An edge across a plane is cut at the plane, to the same bits whichever way it goes.
    #[test]
    fn cuts_are_on_the_plane_and_shared() {
        for order in ORDERS {
            let (clipper, planes) = planes(order);
            let middle = [0.5, 0.25, (order.range()[0] + order.range()[1]) * 0.5, 1.0];
            for (plane, (on, outward)) in planes.into_iter().enumerate() {
                // As far beyond the plane as twice the way from the middle: the cut is at a third of it.
                let inside = moved(on, outward, -0.125);
                let out = moved(on, outward, 0.25);
                let there = clipper.clip([inside, out, middle]).expect("a part is left");
                let back = clipper.clip([out, inside, middle]).expect("a part is left");
                let cut = |polygon: &Polygon| {
                    let on_edge = |c: &&ClipVertex| {
                        (0..4).all(|i| (c[i] - on[i]).abs() <= on[i].abs() * 1e-5 + 1e-6)
                    };
                    polygon.corners().iter().find(on_edge).copied()
                };
                let (a, b) = (cut(&there).expect("a cut"), cut(&back).expect("a cut"));
                assert_eq!(a.map(f32::to_bits), b.map(f32::to_bits), "{order:?} plane {plane}");
                assert_eq!(there.corners().len(), 4, "{order:?} plane {plane}");
                let least = there.corners().iter().map(|&c| clipper.distance(plane, c));
                assert!(least.fold(f32::INFINITY, f32::min) > -0.01, "{order:?} plane {plane}");
            }
        }
    }

    /// The new vertex comes from the outside one towards the inside one, each operation rounded once.
    #[test]
    fn a_cut_is_rounded_as_written() {
        let clipper = Clipper::new(VIEWPORT, DepthOrder::Forward);
        let (out, inside) = ([0.3, 0.7, -0.1, 1.3], [0.9, -0.2, 0.6, 2.1]);
        let polygon = clipper.clip([out, inside, [0.1, 0.1, 0.5, 1.0]]).unwrap();
        let t = -0.1_f32 / (-0.1_f32 - 0.6_f32);
        let expected: ClipVertex = std::array::from_fn(|c| out[c] + t * (inside[c] - out[c]));
        assert!(polygon.corners().contains(&expected), "{expected:?} in {polygon:?}");
        // The other way round rounds to other bits.
        let t = 0.6_f32 / (0.6_f32 - -0.1_f32);
        let backward: ClipVertex = std::array::from_fn(|c| inside[c] + t * (out[c] - inside[c]));
        assert_ne!(expected, backward);
    }

    /// Half of an edge, with numbers that f32 holds.
    #[test]
    fn a_cut_in_the_middle_is_exact() {
        let clipper = Clipper::new(VIEWPORT, DepthOrder::Forward);
        let triangle = [[4.0, 2.0, -1.0, 8.0], [8.0, 6.0, 1.0, 16.0], [0.0, 6.0, 1.0, 16.0]];
        let polygon = clipper.clip(triangle).unwrap();
        let expected = [[2.0, 4.0, 0.0, 12.0], [6.0, 4.0, 0.0, 12.0], triangle[1], triangle[2]];
        assert_eq!(polygon.corners().len(), 4);
        for corner in expected {
            assert!(polygon.corners().contains(&corner), "{corner:?} in {polygon:?}");
        }
    }

    #[test]
    fn only_points_before_the_eye_project() {
        let w = |w: f32| projects(&[0.0, 0.0, 0.0, w]);
        assert!(w(1.0) && w(f32::MIN_POSITIVE) && w(f32::MAX));
        assert!(!w(0.0) && !w(-1.0) && !w(1e-45) && !w(f32::NAN));
    }

    /// What has no image has the seventh bit, beside those of the planes that it is beyond.
    #[test]
    fn what_does_not_project_is_outside() {
        let clipper = Clipper::new(VIEWPORT, DepthOrder::Forward);
        assert_eq!(clipper.outside([0.0, 0.0, 0.5, 1.0]), 0);
        assert_eq!(clipper.outside([0.0, 0.0, 0.0, 0.0]), 1 << 6);
        assert_eq!(clipper.outside([0.0, 0.0, 0.0, -1.0]) & 1 << 6, 1 << 6);
        assert_eq!(clipper.outside([f32::NAN, 0.0, 0.5, 1.0]) & 1 << 6, 1 << 6);
        assert_eq!(clipper.outside([0.0, 0.0, f32::INFINITY, 1.0]) & 1 << 6, 1 << 6);
    }

    /// A corner exactly on a plane is inside: the edge from it to an outside one is cut there all the same,
    /// where rounding puts it, and the edge to an inside one is not.
    #[test]
    fn a_corner_on_a_plane_is_inside() {
        let clipper = Clipper::new(VIEWPORT, DepthOrder::Forward);
        let (on, out, inside) =
            ([0.1, 0.7, 0.0, 1.3], [3.3, -0.2, -0.6, 2.1], [0.3, 0.1, 0.5, 1.0]);
        // All of the way from the outside corner, each operation rounded once.
        let at: ClipVertex = std::array::from_fn(|c| out[c] + (on[c] - out[c]));
        assert_ne!(at, on);
        let t = -0.6_f32 / (-0.6_f32 - 0.5_f32);
        let cut: ClipVertex = std::array::from_fn(|c| out[c] + t * (inside[c] - out[c]));
        let corners = |triangle| clipper.clip(triangle).map(|polygon| polygon.corners().to_vec());
        assert_eq!(corners([on, out, inside]), Some(vec![on, at, cut, inside]));
        assert_eq!(corners([on, inside, out]), Some(vec![at, on, inside, cut]));
        assert_eq!(corners([on, inside, [0.2, 0.2, 0.0, 1.0]]).map(|c| c.len()), Some(3));
    }
}
