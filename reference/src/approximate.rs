//! Renderers that are not exact, beside which the price of exactness can be read: the plain loop of `naive`
//! with less arithmetic, or with more. Coverage is by the same whole numbers, so that what differs is what
//! the knob does. Not for anything that is compared bit for bit.

use crate::clip::ClipVertex;
use crate::draw::Draw;
use crate::image::Image;
use crate::naive::{Arithmetic, Written, fragments};
use crate::window::{Oriented, SUBPIXELS};

/// How depth at a sample comes from the depths of three corners.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// By the exact edge values, rounded once: the raster rules.
    #[default]
    Exact,
    /// By a plane through the first corner whose two slopes are f64.
    PlaneF64,
    /// The same in f32: what hardware and software rasterizers mostly do.
    PlaneF32,
}

struct Approximate {
    interpolation: Interpolation,
    /// Column-major, where the transform is in f64.
    matrix: Option<[f64; 16]>,
}

impl Arithmetic for Approximate {
    fn corner(&self, draw: &Draw<'_>, vertex: u32) -> ClipVertex {
        let Some(m) = &self.matrix else { return Written.corner(draw, vertex) };
        let [x, y, z] = draw.positions[vertex as usize].map(f64::from);
        [0, 1, 2, 3].map(|row| (m[row] * x + m[4 + row] * y + m[8 + row] * z + m[12 + row]) as f32)
    }

    fn depth(&self, triangle: &Oriented, e: [i64; 3], at: [i64; 2]) -> f32 {
        let v = triangle.v;
        let pixels = |value: i64| value as f64 / SUBPIXELS as f64;
        let from = |corner: usize| {
            [i64::from(v[corner].x), i64::from(v[corner].y)].map(|at| at as f64 / SUBPIXELS as f64)
        };
        let [x, y] = [pixels(at[0]) - from(0)[0], pixels(at[1]) - from(0)[1]];
        let sides = [1, 2].map(|i| [from(i)[0] - from(0)[0], from(i)[1] - from(0)[1]]);
        let depth = match self.interpolation {
            Interpolation::Exact => return Written.depth(triangle, e, at),
            Interpolation::PlaneF64 => {
                let [z0, z1, z2] = v.map(|v| f64::from(v.z));
                let [[x1, y1], [x2, y2]] = sides;
                let area = x1 * y2 - y1 * x2;
                let right = ((z1 - z0) * y2 - (z2 - z0) * y1) / area;
                let down = ((z2 - z0) * x1 - (z1 - z0) * x2) / area;
                (z0 + right * x + down * y) as f32
            }
            Interpolation::PlaneF32 => {
                let [z0, z1, z2] = v.map(|v| v.z);
                let [[x1, y1], [x2, y2]] = sides.map(|side| side.map(|at| at as f32));
                let (x, y) = (x as f32, y as f32);
                let area = x1 * y2 - y1 * x2;
                let right = ((z1 - z0) * y2 - (z2 - z0) * y1) / area;
                let down = ((z2 - z0) * x1 - (z1 - z0) * x2) / area;
                z0 + right * x + down * y
            }
        };
        // A sliver's plane may leave the range of its corners altogether, in f32 even as NaN: what is
        // stored is clamped, as a device clamps it.
        let (low, high) = v.iter().fold((1.0_f32, -1.0_f32), |(l, h), v| (l.min(v.z), h.max(v.z)));
        if depth.is_nan() { low } else { depth.clamp(low, high) + 0.0 }
    }
}

/// Draws into `image`, interpolating so, and returns how many fragments that took. `matrix` is the
/// object-to-clip matrix in f64, column-major, where vertices are to be transformed in f64; else the draw's
/// own is taken.
pub fn draw(
    image: &mut Image,
    draw: &Draw<'_>,
    interpolation: Interpolation,
    matrix: Option<[f64; 16]>,
) -> u64 {
    let (viewport, order) = (image.viewport(), image.order());
    let mut count = 0;
    let arithmetic = Approximate { interpolation, matrix };
    fragments(viewport, order, draw, &arithmetic, |column, row, depth, id| {
        count += 1;
        image.lower(column, row, u64::from(order.key(depth)) << 32 | u64::from(id));
    });
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::window::WindowVertex;
    use crate::{Faces, Viewport, naive};

    const VIEWPORT: Viewport = Viewport { width: 40, height: 30 };
    const IDENTITY: [f32; 16] =
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

    fn images(interpolation: Interpolation, matrix: Option<[f64; 16]>) -> (Image, Image) {
        let positions = [[-0.9, -0.9, 0.1], [0.9, -0.7, 0.95], [0.0, 0.9, 0.3]];
        let sliver = [[-0.9, 0.1, 0.2], [0.9, 0.11, 0.9], [0.9, 0.13, 0.1]];
        let positions = [positions, sliver].concat();
        let draw = Draw {
            positions: &positions,
            triangles: &[[0, 1, 2], [3, 4, 5]],
            ranks: &[0, 1],
            first_draw: 0,
            clip_from_object: IDENTITY,
            faces: Faces::Both,
        };
        let (mut exact, mut other) = (Image::new(VIEWPORT), Image::new(VIEWPORT));
        naive::draw(&mut exact, &draw);
        let fragments = super::draw(&mut other, &draw, interpolation, matrix);
        assert!(fragments > 200, "{fragments}");
        (exact, other)
    }

    /// Exact in the written transform is the plain renderer; planes are near it, the one in f64 nearer.
    #[test]
    fn planes_come_near_and_exact_is_exact() {
        let (exact, same) = images(Interpolation::Exact, None);
        assert!(exact == same);
        let identity = IDENTITY.map(f64::from);
        let (exact, same) = images(Interpolation::Exact, Some(identity));
        assert!(exact == same, "numbers of f32 by the identity are not rounded");
        let worst = |interpolation| {
            let (exact, other) = images(interpolation, None);
            let pairs = exact.depths().into_iter().zip(other.depths());
            pairs.map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
        };
        let (double, single) = (worst(Interpolation::PlaneF64), worst(Interpolation::PlaneF32));
        assert!(
            double <= f64::from(f32::EPSILON) && single > double && single < 1e-3,
            "{double} {single}"
        );
    }

    /// A plane leaves the range of its corners where its triangle is thin; what is stored does not, nor is
    /// it ever −0.
    #[test]
    fn depths_stay_among_those_of_the_corners() {
        let at = |x: i32, y: i32, z: f32| WindowVertex { x, y, z };
        for interpolation in [Interpolation::PlaneF64, Interpolation::PlaneF32] {
            let arithmetic = Approximate { interpolation, matrix: None };
            let of = |v: [WindowVertex; 3], at: [i64; 2]| {
                let triangle = Oriented::new(v, Faces::Both).expect("an area");
                arithmetic.depth(&triangle, [1, 1, 1], at)
            };
            for [low, high] in [[0.2, 0.7], [-0.7, -0.2]] {
                let sloped = [at(0, 0, low), at(25_600, 0, high), at(0, 25_600, low)];
                let middle = of(sloped, [12_800, 128]);
                assert!((middle - (low + high) * 0.5).abs() < 1e-6, "{middle}");
                assert_eq!(of(sloped, [30_000, 128]), high);
                assert_eq!(of(sloped, [-5_000, 128]), low);
            }
            // Less than half of the smallest float below zero.
            let tiny = [at(0, 0, 0.0), at(25_600, 0, f32::from_bits(1)), at(0, 25_600, 0.0)];
            assert_eq!(of(tiny, [-5_000, 128]).to_bits(), 0);
        }
    }
}
