//! From clip space to the window: divide, scale, snap; and the oriented triangle that both renderers
//! rasterize.

use crate::clip::{ClipVertex, Clipper, Polygon};
use crate::draw::Faces;
use crate::image::Viewport;
use crate::order::DepthOrder;

/// Sub-pixels in a pixel.
pub(crate) const SUBPIXELS: i64 = 256;

/// No window coordinate is farther from the origin: the ±2¹⁵ pixels that the integers are sized for.
const BAND_PIXELS: f32 = 32_768.0;

/// A snapped vertex: sub-pixels from the window's top left corner, and depth between the planes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct WindowVertex {
    pub(crate) x: i32,
    pub(crate) y: i32,
    pub(crate) z: f32,
}

/// What turns clip space into window space for one viewport.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Window {
    pub(crate) clipper: Clipper,
    half: [f32; 2],
    /// Depth at the near plane and at the far one.
    range: [f32; 2],
}

impl Window {
    pub(crate) fn new(viewport: Viewport, order: DepthOrder) -> Self {
        let half = [viewport.width as f32 * 0.5, viewport.height as f32 * 0.5];
        Self { clipper: Clipper::new(viewport, order), half, range: order.range() }
    }

    /// The written order, each operation f32 and unfused.
    pub(crate) fn vertex(&self, [x, y, z, w]: ClipVertex) -> WindowVertex {
        let r = 1.0 / w;
        let column = (x * r) * self.half[0] + self.half[0];
        let row = (y * r) * -self.half[1] + self.half[1];
        // Adding zero turns −0 into +0.
        let depth = (z * r).clamp(self.range[0], self.range[1]) + 0.0;
        // A vertex made by clipping lies within the band but for an edge whose ends differ by more than
        // 2²⁴ in size, where f32 interpolation means nothing. The clamp keeps the integers in range,
        // and equal vertices equal, there too.
        let snap = |value: f32| {
            let within = value.clamp(-BAND_PIXELS, BAND_PIXELS);
            (within * SUBPIXELS as f32).round_ties_even() as i32
        };
        WindowVertex { x: snap(column), y: snap(row), z: depth }
    }

    /// The window triangles of a clipped polygon, fanned from its first corner, that show one of the
    /// `faces`.
    pub(crate) fn fan<'a>(
        &'a self,
        polygon: &'a Polygon,
        faces: Faces,
    ) -> impl Iterator<Item = Oriented> + 'a {
        let corners = polygon.corners();
        let first = self.vertex(corners[0]);
        corners[1..].windows(2).filter_map(move |pair| {
            Oriented::new([first, self.vertex(pair[0]), self.vertex(pair[1])], faces)
        })
    }
}

/// A triangle of positive area, vertices 1 and 2 exchanged where it was negative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Oriented {
    pub(crate) v: [WindowVertex; 3],
    /// Twice the area in square sub-pixels, at least 1.
    pub(crate) area: i64,
}

impl Oriented {
    /// With rows going down a positive area is clockwise on the screen.
    pub(crate) fn new([a, b, c]: [WindowVertex; 3], faces: Faces) -> Option<Self> {
        let area = edge(a, b, i64::from(c.x), i64::from(c.y));
        match area {
            0 => None,
            1.. => (faces == Faces::Both).then_some(Self { v: [a, b, c], area }),
            _ => Some(Self { v: [a, c, b], area: -area }),
        }
    }
}

/// The edge function of a → b at (x, y): positive to the right of the direction as seen on a screen
/// with rows going down.
pub(crate) fn edge(a: WindowVertex, b: WindowVertex, x: i64, y: i64) -> i64 {
    let (dx, dy) = (i64::from(b.x) - i64::from(a.x), i64::from(b.y) - i64::from(a.y));
    dx * (y - i64::from(a.y)) - dy * (x - i64::from(a.x))
}

/// Whether samples exactly on a → b belong to the triangle: on a top edge (level, going right) or a
/// left one (going up).
pub(crate) fn top_left(a: WindowVertex, b: WindowVertex) -> bool {
    b.y < a.y || (b.y == a.y && b.x > a.x)
}

/// The written depth at a sample, from exact non-negative edge values.
pub(crate) fn depth([e0, e1, e2]: [f64; 3], z: [f32; 3], area: i64) -> f32 {
    let [z0, z1, z2] = z.map(f64::from);
    (((e0 * z0 + e1 * z1) + e2 * z2) / area as f64) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Depths are never −0, whose bits would be behind everything.
    #[test]
    fn no_depth_is_negative_zero() {
        for order in [DepthOrder::Forward, DepthOrder::Reversed] {
            let window = Window::new(Viewport { width: 8, height: 8 }, order);
            // −0 itself, and what underflows to it.
            for (z, w) in [(-0.0, 1.0), (-f32::MIN_POSITIVE, 1e9)] {
                let vertex = window.vertex([0.25, 0.5, z, w]);
                assert_eq!(vertex.z.to_bits(), 0, "{order:?} {z} {w}");
            }
        }
    }
}
