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
