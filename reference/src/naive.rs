//! The plain renderer: one loop over triangles, one over the samples of the bounding box, everything
//! from scratch at every sample. So simple that it is unlikely to be incorrect; what is faster must
//! equal it bit for bit.

use crate::clip::ClipVertex;
use crate::draw::Draw;
use crate::image::{Image, Viewport};
use crate::order::DepthOrder;
use crate::window::{Oriented, SUBPIXELS, Window, depth, edge, top_left};

/// Draws into `image`.
pub fn draw(image: &mut Image, draw: &Draw<'_>) {
    let viewport = image.viewport();
    let order = image.order();
    fragments(viewport, order, draw, &Written, |column, row, depth, id| {
        image.lower(column, row, u64::from(order.key(depth)) << 32 | u64::from(id));
    });
}

/// How many fragments of `draw` have a depth less than or equal to the stored one; a sample that
/// several triangles cover counts once for each.
#[must_use]
pub fn count(image: &Image, draw: &Draw<'_>) -> u64 {
    let mut passed = 0;
    fragments(image.viewport(), image.order(), draw, &Written, |column, row, depth, _| {
        let stored = (image.word_at(column, row) >> 32) as u32;
        passed += u64::from(image.order().key(depth) <= stored);
    });
    passed
}

/// The arithmetic of a renderer. [`Written`] is that of the raster rules; others exist to show what less or
/// more of it changes.
pub(crate) trait Arithmetic {
    /// Clip coordinates of a vertex.
    fn corner(&self, draw: &Draw<'_>, vertex: u32) -> ClipVertex {
        draw.clip_vertex(vertex)
    }

    /// The depth at a sample (x, y), in sub-pixels, whose edge values are `e`.
    fn depth(&self, triangle: &Oriented, e: [i64; 3], [x, y]: [i64; 2]) -> f32 {
        let _ = (x, y);
        depth(e.map(|e| e as f64), triangle.v.map(|v| v.z), triangle.area)
    }
}

/// The raster rules.
pub(crate) struct Written;

impl Arithmetic for Written {}

pub(crate) fn fragments(
    viewport: Viewport,
    order: DepthOrder,
    draw: &Draw<'_>,
    arithmetic: &impl Arithmetic,
    mut emit: impl FnMut(usize, usize, f32, u32),
) {
    assert_eq!(draw.triangles.len(), draw.ranks.len(), "one rank a triangle");
    let window = Window::new(viewport, order);
    for (i, triangle) in draw.triangles.iter().enumerate() {
        let corners = triangle.map(|vertex| arithmetic.corner(draw, vertex));
        let Some(polygon) = window.clipper.clip(corners) else { continue };
        for triangle in window.fan(&polygon, draw.faces) {
            let v = triangle.v;
            let low = |at: [i32; 3]| {
                (i64::from(at.into_iter().min().unwrap_or(0)) / SUBPIXELS - 1).max(0)
            };
            let high = |at: [i32; 3], side: u32| {
                (i64::from(at.into_iter().max().unwrap_or(0)) / SUBPIXELS + 1)
                    .min(i64::from(side) - 1)
            };
            let (xs, ys) = (v.map(|v| v.x), v.map(|v| v.y));
            for row in low(ys)..=high(ys, viewport.height) {
                for column in low(xs)..=high(xs, viewport.width) {
                    let (x, y) =
                        (column * SUBPIXELS + SUBPIXELS / 2, row * SUBPIXELS + SUBPIXELS / 2);
                    let opposite = |i: usize| (v[(i + 1) % 3], v[(i + 2) % 3]);
                    let e = [0, 1, 2].map(|i| edge(opposite(i).0, opposite(i).1, x, y));
                    let inside = |i: usize| {
                        e[i] > 0 || (e[i] == 0 && top_left(opposite(i).0, opposite(i).1))
                    };
                    if (0..3).all(inside) {
                        let depth = arithmetic.depth(&triangle, e, [x, y]);
                        emit(column as usize, row as usize, depth, draw.stored_id(i));
                    }
                }
            }
        }
    }
}
