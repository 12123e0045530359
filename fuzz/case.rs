//! Bytes to triangles, and both renderers on them. Shared by the fuzz target and the test that replays its
//! corpus. Any bytes are a case, but for fewer than one vertex.

use plainsight_reference::fast::{Instance, Mesh, Options, SimdLevel};
use plainsight_reference::{DepthOrder, Draw, Faces, Image, Viewport, fast, naive};

/// Bytes of a vertex: three coordinates, and the corners of a triangle.
const RECORD: usize = 15;
/// Bytes before the vertices: width, height, flags, and how far the second instance is scaled.
const HEADER: usize = 4;
/// Most vertices: naive must stay quick.
const MOST: usize = 400;

const IDENTITY: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
/// A camera at the origin that looks along −z: w = −z, near 0.5 and far 50.
const CAMERA: [f32; 16] = [
    1.2,
    0.0,
    0.0,
    0.0,
    0.0,
    1.6,
    0.0,
    0.0,
    0.0,
    0.0,
    -50.0 / 49.5,
    -1.0,
    0.0,
    0.0,
    -25.0 / 49.5,
    0.0,
];

/// Draws the case with both renderers and compares depth, ids and counts. The error says where they
/// differ.
pub(crate) fn check(bytes: &[u8]) -> Result<(), String> {
    let Some((&[width, height, flags, scale], rest)) = bytes.split_first_chunk::<HEADER>() else {
        return Ok(());
    };
    let count = (rest.len() / RECORD).min(MOST);
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for record in rest.chunks_exact(RECORD).take(count) {
        let number = |at: usize| {
            let bits = [record[at], record[at + 1], record[at + 2], record[at + 3]];
            let value = f32::from_le_bytes(bits);
            // A scene with others is refused.
            if value.is_finite() { value } else { 0.5 }
        };
        positions.push([number(0), number(4), number(8)]);
        let corner = |at: usize| (usize::from(record[at]) % count) as u32;
        triangles.push([corner(12), corner(13), corner(14)]);
    }
    if count == 0 {
        return Ok(());
    }
    // One region or several, odd or even.
    let side =
        |byte: u8| if flags & 1 == 0 { u32::from(byte % 64) + 1 } else { u32::from(byte) + 1 };
    // Up to sixteen regions: more than the thread that asks draws alone.
    let wider = if flags & 16 == 0 { 1 } else { 4 };
    let viewport = Viewport { width: wider * side(width), height: side(height) };
    let faces = if flags & 2 == 0 { Faces::Both } else { Faces::CounterClockwise };
    let mut first = if flags & 4 == 0 { IDENTITY } else { CAMERA };
    let order = if flags & 8 == 0 { DepthOrder::Forward } else { DepthOrder::Reversed };
    if order == DepthOrder::Reversed {
        // z − w goes from −w to 0.
        (0..4).for_each(|column| first[4 * column + 2] -= first[4 * column + 3]);
    }
    let mut second = first;
    let factor = f32::from(scale) / 64.0;
    second.iter_mut().take(8).for_each(|element| *element *= factor);
    let ranks: Vec<u32> = (0..count as u32).rev().collect();
    let mesh = Mesh::new(&positions, &triangles, &ranks);
    let mut expected = Image::ordered(viewport, order);
    let mut instances = Vec::new();
    for (i, clip_from_object) in [first, second].into_iter().enumerate() {
        let first_draw = (i * count) as u32;
        let draw = Draw {
            positions: &positions,
            triangles: &triangles,
            ranks: &ranks,
            first_draw,
            clip_from_object,
            faces,
        };
        if naive::count(&expected, &draw) != fast::count(&expected, &draw) {
            return Err(format!("instance {i} counts otherwise"));
        }
        naive::draw(&mut expected, &draw);
        instances.push(Instance::new(&mesh, first_draw, clip_from_object, faces));
    }
    for level in SimdLevel::available() {
        for skip_hidden in [true, false] {
            let mut image = Image::ordered(viewport, order);
            fast::draw(&mut image, &instances, Options { level, skip_hidden });
            if image != expected {
                let differs = |&s: &usize| image.word(s) != expected.word(s);
                let sample = (0..image.sample_count()).find(differs).unwrap_or_default();
                return Err(format!(
                    "{level}, skip_hidden {skip_hidden}: sample {sample} of {width} × {height} is {:x}, \
                     naive has {:x}",
                    image.word(sample),
                    expected.word(sample),
                    width = viewport.width,
                    height = viewport.height
                ));
            }
            if !image.bounds_hold() {
                return Err(format!("{level}, skip_hidden {skip_hidden}: bounds"));
            }
        }
    }
    Ok(())
}
