//! How many fragments of a few triangles would pass, against an image with its bounds.

use crate::draw::Draw;
use crate::image::{BLOCK, Image};
use crate::window::{SUBPIXELS, Window, depth, edge, top_left};

use super::wide::Wide;

/// How many fragments of `draw` have a depth less than or equal to the stored one; equal to
/// [`crate::naive::count`]. Blocks of the image that are wholly nearer than a triangle are left out.
#[must_use]
pub fn count(image: &Image, draw: &Draw<'_>) -> u64 {
    let mut passed = 0;
    each(image, draw, |count| {
        passed += count;
        true
    });
    passed
}

/// Whether [`count`] is above zero; stops at the first block that shows it.
#[must_use]
pub fn any(image: &Image, draw: &Draw<'_>) -> bool {
    let mut found = false;
    each(image, draw, |count| {
        found = count > 0;
        !found
    });
    found
}

/// Calls `enough` with the fragments that pass in one block after the other, until it says `false`.
fn each(image: &Image, draw: &Draw<'_>, mut more: impl FnMut(u64) -> bool) {
    assert_eq!(draw.triangles.len(), draw.ranks.len(), "one rank a triangle");
    let viewport = image.viewport();
    let window = Window::new(viewport, image.order());
    for (i, triangle) in draw.triangles.iter().enumerate() {
        let corners = triangle.map(|vertex| draw.clip_vertex(vertex));
        let Some(polygon) = window.clipper.clip(corners) else { continue };
        for oriented in window.fan(&polygon, draw.faces) {
            let Some(wide) = Wide::new(oriented, draw.stored_id(i), viewport) else { continue };
            let near = wide.near(image.order());
            let low = wide.min.map(|pixel| pixel as u32);
            let end = wide.max.map(|pixel| pixel as u32 + 1);
            for block in image.near_blocks(low, end, near) {
                if !more(passing(image, &wide, block)) {
                    return;
                }
            }
        }
    }
}

/// Fragments of the triangle that pass in one block: first column and row, then the ends.
fn passing(image: &Image, wide: &Wide, [x0, y0, x1, y1]: [usize; 4]) -> u64 {
    debug_assert!(x1 - x0 <= BLOCK && y1 - y0 <= BLOCK, "one block");
    let v = wide.triangle.v;
    let z = v.map(|v| v.z);
    let ends = [0, 1, 2].map(|i| (v[(i + 1) % 3], v[(i + 2) % 3]));
    let bias = ends.map(|(a, b)| i64::from(!top_left(a, b)));
    let center = |pixel: usize| pixel as i64 * SUBPIXELS + SUBPIXELS / 2;
    let mut passed = 0;
    for row in y0..y1 {
        let mut e = ends.map(|(a, b)| edge(a, b, center(x0), center(row)));
        for column in x0..x1 {
            if (0..3).all(|i| e[i] >= bias[i]) {
                let stored = (image.word_at(column, row) >> 32) as u32;
                let depth = depth(e.map(|e| e as f64), z, wide.triangle.area);
                passed += u64::from(image.order().key(depth) <= stored);
            }
            for (e, (a, b)) in e.iter_mut().zip(&ends) {
                *e += SUBPIXELS * (i64::from(a.y) - i64::from(b.y));
            }
        }
    }
    passed
}
