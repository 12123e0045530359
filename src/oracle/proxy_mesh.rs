//! The triangles of a box proxy, the same for every oracle.

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

/// The same triangles in clip space, one vertex after another, transformed in the raster rules'
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
