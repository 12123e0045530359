//! The triangles of box and hull proxies, the same for every oracle.

use crate::math::{HULL_SUBPIXELS, Hull, MOST_HULL_CORNERS};
use crate::scene::Viewport;

/// Most triangles of a hull's fan.
pub(super) const MOST_HULL_TRIANGLES: usize = MOST_HULL_CORNERS - 2;

/// The twelve triangles of a box; corner bit 0 is x, bit 1 y, bit 2 z.
pub(super) fn box_triangles(min: [f32; 3], max: [f32; 3]) -> ([[f32; 3]; 8], [[u32; 3]; 12]) {
    let corner =
        |i: usize| std::array::from_fn(|axis| if i >> axis & 1 == 0 { min } else { max }[axis]);
    let faces: [[u32; 4]; 6] =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangle = |i: usize| {
        let [a, b, c, d] = faces[i / 2];
        if i.is_multiple_of(2) { [a, b, c] } else { [a, c, d] }
    };
    (std::array::from_fn(corner), std::array::from_fn(triangle))
}

/// A place in the window, in `steps` to the pixel, in clip space with w = 1.
///
/// Its window position comes back as ndc·(W/2) + W/2 in f32: for sides up to 16384 the rounding of ndc
/// (2⁻²⁵ · W/2) and of the sum (2⁻²⁴ · W) stay under 2⁻⁹ pixel, half a sub-pixel, so snapping restores a
/// place on the grid of 1/256 pixel, and with it the edges of pixels.
fn place_in_clip(viewport: Viewport, [x, y]: [f64; 2], steps: f64) -> [f32; 2] {
    [
        (x * 2.0 / (f64::from(viewport.width) * steps) - 1.0) as f32,
        (1.0 - y * 2.0 / (f64::from(viewport.height) * steps)) as f32,
    ]
}

/// Two triangles over whole pixels at one depth, w = 1: exactly these pixels are covered.
#[cfg(feature = "hardware")]
pub(super) fn rectangle_triangles(
    viewport: Viewport,
    min: [u32; 2],
    max: [u32; 2],
    depth: f32,
) -> [[f32; 4]; 6] {
    let [x0, y0] = place_in_clip(viewport, min.map(f64::from), 1.0);
    let [x1, y1] = place_in_clip(viewport, max.map(f64::from), 1.0);
    let [a, b, c, d] = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]].map(|[x, y]| [x, y, depth, 1.0]);
    [a, b, c, a, c, d]
}

/// Corners of a hull in clip space with w = 1, as many as it has; the others are zero.
pub(super) fn hull_corners(
    viewport: Viewport,
    hull: &Hull,
    depth: f32,
) -> [[f32; 3]; MOST_HULL_CORNERS] {
    let mut corners = [[0.0; 3]; MOST_HULL_CORNERS];
    for (corner, place) in corners.iter_mut().zip(hull.corners()) {
        let [x, y] = place_in_clip(viewport, place.map(f64::from), f64::from(HULL_SUBPIXELS));
        *corner = [x, y, depth];
    }
    corners
}

/// The fan of a hull from its first corner; as many triangles as it has corners, less two.
pub(super) fn hull_fan() -> [[u32; 3]; MOST_HULL_TRIANGLES] {
    std::array::from_fn(|i| [0, i as u32 + 1, i as u32 + 2])
}

/// The triangles of a hull in clip space, one vertex after another.
#[cfg(feature = "hardware")]
pub(super) fn hull_proxy_triangles(
    viewport: Viewport,
    hull: &Hull,
    depth: f32,
) -> impl Iterator<Item = [f32; 4]> {
    let corners = hull_corners(viewport, hull, depth).map(|[x, y, z]| [x, y, z, 1.0]);
    let fan = hull_fan().into_iter().take(hull.corners().len().saturating_sub(2));
    fan.flatten().map(move |corner| corners[corner as usize])
}

/// The triangles of a box in clip space, one vertex after another, transformed in the raster rules'
/// written order.
#[cfg(feature = "hardware")]
pub(super) fn box_proxy_triangles(
    m: &[f32; 16],
    min: [f32; 3],
    max: [f32; 3],
) -> impl Iterator<Item = [f32; 4]> {
    let (corners, triangles) = box_triangles(min, max);
    let clip = corners.map(|[x, y, z]| {
        std::array::from_fn(|row| ((m[row] * x + m[4 + row] * y) + m[8 + row] * z) + m[12 + row])
    });
    triangles.into_iter().flatten().map(move |corner| clip[corner as usize])
}
