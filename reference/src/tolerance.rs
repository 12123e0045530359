//! Three-valued truth: what must be visible, what may be, and what is hidden, on a device that need not
//! rasterize as the reference does. Vulkan allows vertices to be snapped to as few as 1/16 pixel and
//! leaves the interpolation of depth inexact; a [`Tolerance`] says how far a device may stand from the
//! raster rules of this crate.
//!
//! At each sample a triangle is *dilated* (it may cover the sample) where the sample is within ε of it,
//! and *eroded* (it surely covers it) where the sample is farther than ε inside all of its edges. Its
//! depth there is within δ = (|∂z/∂x| + |∂z/∂y|)·ε, clamped to the triangle's range, and k ulps. Then a
//! part
//! - **must** be visible if at some sample one of its eroded triangles is, at its farthest, strictly
//!   nearer than every dilated triangle of every other part at its nearest;
//! - is **hidden** if at no sample any of its dilated triangles at its nearest reaches the farthest depth
//!   of the nearest eroded triangle;
//! - **may** be visible otherwise.
//!
//! # Why it is sound
//! A device within the tolerance draws, at a sample, every eroded triangle and no triangle that is not
//! dilated, each at a depth within its bounds. So at a sample that decides for *must* the device's
//! nearest triangle is of that part, and a *hidden* part is strictly behind something everywhere. Both
//! sets only shrink as ε and k grow, because eroded triangles, then, are fewer, dilated ones more, and
//! depths farther apart: widening moves parts into *may* and nowhere else.
//!
//! # At tolerance zero
//! Eroded and dilated are the exact coverage, depths the exact ones: *must* is what the image shows at a
//! sample without a tie, *may* is what only ties decide.
//!
//! One plain loop, as in [`crate::naive`]: it is asked only where a device misses what the exact truth
//! shows.

use crate::draw::Draw;
use crate::image::Viewport;
use crate::order::{DepthOrder, FARTHEST};
use crate::window::{Oriented, SUBPIXELS, Window, WindowVertex, depth, edge, top_left};

/// How far a device's image may stand from the raster rules.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Tolerance {
    /// ε: how far edges may be displaced, pixels, ≥ 0. Also what depth may be off along its slope.
    pub pixels: f64,
    /// How many f32 depths a fragment may be off beyond that.
    pub ulps: u32,
    /// The same for triangles that clipping cuts, where a device makes vertices of its own.
    pub clipped_ulps: u32,
}

impl Tolerance {
    /// None: the raster rules to the bit.
    pub const EXACT: Self = Self { pixels: 0.0, ulps: 0, clipped_ulps: 0 };
}

/// What a device within the tolerance may make of a part.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fate {
    /// It shows, at some sample at least.
    Must,
    /// It may show.
    May,
    /// It does not show.
    Hidden,
}

/// What a device within the tolerance may make of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fates {
    /// By part, in the order in which they were given.
    pub parts: Vec<Fate>,
    /// By sample (row × width + column): the part, if any, that it must show.
    pub decided: Vec<Option<u32>>,
}

/// No part.
const NOBODY: u32 = u32::MAX;
/// Lengths of edges are rounded once, and products with ε once more: four units of 2⁻⁵³ are more than
/// both, so that no eroded sample is taken for surer, and no dilated one for less likely, than it is.
const LENGTH_SLACK: f64 = 4.0 * f64::EPSILON;

/// The nearest that dilated triangles can be at a sample, of two different parts.
#[derive(Clone, Copy)]
struct Rivals {
    first: u32,
    part: u32,
    /// The nearest of any part but `part`.
    second: u32,
}

impl Rivals {
    fn meet(&mut self, part: u32, near: u32) {
        if part == self.part {
            self.first = self.first.min(near);
        } else if near < self.first {
            *self = Self { first: near, part, second: self.first };
        } else {
            self.second = self.second.min(near);
        }
    }

    /// The nearest of the others.
    fn of(&self, part: u32) -> u32 {
        if part == self.part { self.second } else { self.first }
    }
}

/// A triangle at a sample: keys of the depths between which it is there.
struct Fragment {
    sample: usize,
    near: u32,
    far: u32,
    eroded: bool,
}

/// The fates of `parts`, each of which is one draw. Takes 32 bytes a sample.
///
/// # Panics
/// For 2³² − 1 parts or more, and where ranks and triangles of a draw are not as many.
#[must_use]
pub fn fates(
    viewport: Viewport,
    order: DepthOrder,
    parts: &[Draw<'_>],
    tolerance: Tolerance,
) -> Fates {
    assert!(parts.len() < NOBODY as usize, "{} parts", parts.len());
    let samples = viewport.width as usize * viewport.height as usize;
    let mut nearest = vec![FARTHEST; samples];
    let nobody = Rivals { first: FARTHEST, part: NOBODY, second: FARTHEST };
    let mut rivals = vec![nobody; samples];
    for (part, draw) in (0..).zip(parts) {
        fragments(
            (viewport, order),
            draw,
            tolerance,
            &mut |Fragment { sample, near, far, eroded }| {
                rivals[sample].meet(part, near);
                if eroded {
                    nearest[sample] = nearest[sample].min(far);
                }
            },
        );
    }
    let mut decided = vec![None; samples];
    let fate = |(part, draw): (u32, &Draw<'_>)| {
        let (mut must, mut reaches) = (false, false);
        fragments(
            (viewport, order),
            draw,
            tolerance,
            &mut |Fragment { sample, near, far, eroded }| {
                // The farthest depth loses against a cleared sample.
                reaches |= near < FARTHEST && near <= nearest[sample];
                if eroded && far < rivals[sample].of(part) {
                    must = true;
                    decided[sample] = Some(part);
                }
            },
        );
        match (must, reaches) {
            (true, _) => Fate::Must,
            (false, true) => Fate::May,
            (false, false) => Fate::Hidden,
        }
    };
    let parts = (0..).zip(parts).map(fate).collect();
    Fates { parts, decided }
}

/// Every sample at which a triangle of `draw` may be.
fn fragments(
    (viewport, order): (Viewport, DepthOrder),
    draw: &Draw<'_>,
    tolerance: Tolerance,
    emit: &mut dyn FnMut(Fragment),
) {
    assert_eq!(draw.triangles.len(), draw.ranks.len(), "one rank a triangle");
    let window = Window::new(viewport, order);
    for triangle in draw.triangles {
        let corners = triangle.map(|vertex| draw.clip_vertex(vertex));
        let Some(polygon) = window.clipper.clip(corners) else { continue };
        let clipped = corners.iter().any(|&corner| window.clipper.outside(corner) != 0);
        let ulps = if clipped { tolerance.clipped_ulps } else { tolerance.ulps };
        let here = Allowed { viewport, order, pixels: tolerance.pixels, ulps };
        let vertices: Vec<WindowVertex> =
            polygon.corners().iter().map(|&corner| window.vertex(corner)).collect();
        for pair in vertices[1..].windows(2) {
            let v = [vertices[0], pair[0], pair[1]];
            let area = edge(v[0], v[1], i64::from(v[2].x), i64::from(v[2].y));
            match Oriented::new(v, draw.faces) {
                Some(triangle) => here.triangle(&triangle, emit),
                // Without area on the reference's grid, perhaps not on the device's.
                None if area == 0 && tolerance.pixels > 0.0 => here.line(v, emit),
                None => {}
            }
        }
    }
}

/// What is allowed of one triangle.
struct Allowed {
    viewport: Viewport,
    order: DepthOrder,
    pixels: f64,
    ulps: u32,
}

impl Allowed {
    /// ε in sub-pixels.
    fn reach(&self) -> f64 {
        self.pixels * SUBPIXELS as f64
    }

    /// Samples within ε of the box of `v`, as columns and rows with their middles in sub-pixels.
    fn samples(&self, v: &[WindowVertex; 3]) -> impl Iterator<Item = (usize, [i64; 2])> + use<> {
        let Viewport { width, height } = self.viewport;
        let reach = self.reach().ceil() as i64;
        let range = |at: [i32; 3], side: u32| {
            let low = i64::from(at.into_iter().min().unwrap_or(0)) - reach;
            let high = i64::from(at.into_iter().max().unwrap_or(0)) + reach;
            let middle = SUBPIXELS / 2;
            // The first sample at or beyond `low`, and the last at or before `high`.
            let first = (low - middle).div_euclid(SUBPIXELS)
                + i64::from((low - middle).rem_euclid(SUBPIXELS) > 0);
            let last = (high - middle).div_euclid(SUBPIXELS);
            first.max(0)..(last + 1).min(i64::from(side))
        };
        let (columns, rows) = (range(v.map(|v| v.x), width), range(v.map(|v| v.y), height));
        rows.flat_map(move |row| columns.clone().map(move |column| (column, row))).map(
            move |(column, row)| {
                let sample = row as usize * width as usize + column as usize;
                (sample, [column, row].map(|at| at * SUBPIXELS + SUBPIXELS / 2))
            },
        )
    }

    /// Depths between which the triangle is where the reference has `depth`.
    fn depths(&self, depth: f64, slope: f64, [low, high]: [f32; 2]) -> [u32; 2] {
        let delta = slope * self.pixels;
        let within =
            |depth: f64| self.order.key(depth.clamp(f64::from(low), f64::from(high)) as f32);
        [
            within(depth - delta).saturating_sub(self.ulps),
            (within(depth + delta) + self.ulps).min(FARTHEST),
        ]
    }

    fn triangle(&self, triangle: &Oriented, emit: &mut dyn FnMut(Fragment)) {
        let Oriented { v, area } = *triangle;
        let opposite = |i: usize| (v[(i + 1) % 3], v[(i + 2) % 3]);
        let difference = |i: usize| {
            let (a, b) = opposite(i);
            [f64::from(b.x) - f64::from(a.x), f64::from(b.y) - f64::from(a.y)]
        };
        let z = v.map(|v| v.z);
        let range = extremes(z);
        // Edge value i falls by its Δy and grows by its Δx a sub-pixel.
        let along = |axis: usize| {
            let sum: f64 = (0..3).map(|i| difference(i)[axis] * f64::from(z[i])).sum();
            (sum / area as f64 * SUBPIXELS as f64).abs()
        };
        let slope = along(0) + along(1);
        let exact = self.pixels == 0.0;
        let bound = [0, 1, 2].map(|i| {
            let [x, y] = difference(i);
            self.reach() * (x * x + y * y).sqrt()
        });
        for (sample, [x, y]) in self.samples(&v) {
            let e = [0, 1, 2].map(|i| edge(opposite(i).0, opposite(i).1, x, y));
            let covers =
                |i: usize| e[i] > 0 || (e[i] == 0 && top_left(opposite(i).0, opposite(i).1));
            let within = |i: usize| e[i] as f64 >= -bound[i] * (1.0 + LENGTH_SLACK);
            let surely = |i: usize| e[i] as f64 > bound[i] * (1.0 + LENGTH_SLACK);
            if !(0..3).all(if exact { &covers as &dyn Fn(usize) -> bool } else { &within }) {
                continue;
            }
            let at = e.map(|e| e as f64);
            let (near, far) = if exact {
                let key = self.order.key(depth(at, z, area));
                (key.saturating_sub(self.ulps), (key + self.ulps).min(FARTHEST))
            } else {
                let plane = ((at[0] * f64::from(z[0]) + at[1] * f64::from(z[1]))
                    + at[2] * f64::from(z[2]))
                    / area as f64;
                self.depths(plane, slope, range).into()
            };
            emit(Fragment { sample, near, far, eroded: exact || (0..3).all(surely) });
        }
    }

    /// A triangle without area: it may cover what is within ε of its sides, at any of its depths.
    fn line(&self, v: [WindowVertex; 3], emit: &mut dyn FnMut(Fragment)) {
        let [low, high] = extremes(v.map(|v| v.z)).map(|z| self.order.key(z));
        let (low, far) = (low.saturating_sub(self.ulps), (high + self.ulps).min(FARTHEST));
        for (sample, at) in self.samples(&v) {
            let near_side = |i: usize| {
                distance(v[i], v[(i + 1) % 3], at) <= self.reach() * (1.0 + LENGTH_SLACK)
            };
            if (0..3).any(near_side) {
                emit(Fragment { sample, near: low, far, eroded: false });
            }
        }
    }
}

/// The lowest and the highest of three depths.
fn extremes([a, b, c]: [f32; 3]) -> [f32; 2] {
    [a.min(b).min(c), a.max(b).max(c)]
}

/// From a point to a segment, sub-pixels; a few f64 roundings.
fn distance(a: WindowVertex, b: WindowVertex, [x, y]: [i64; 2]) -> f64 {
    let (ax, ay) = (f64::from(a.x), f64::from(a.y));
    let (dx, dy) = (f64::from(b.x) - ax, f64::from(b.y) - ay);
    let (px, py) = (x as f64 - ax, y as f64 - ay);
    let length = dx * dx + dy * dy;
    let along = if length > 0.0 { ((px * dx + py * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
    let (x, y) = (px - along * dx, py - along * dy);
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::Faces;

    const IDENTITY: [f32; 16] =
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    /// One sample, at the origin of clip space.
    const ONE: Viewport = Viewport { width: 1, height: 1 };

    /// Fates of parts of one triangle each.
    fn of(viewport: Viewport, triangles: &[[[f32; 3]; 3]], tolerance: Tolerance) -> Fates {
        let draws: Vec<Draw<'_>> = triangles
            .iter()
            .zip(0..)
            .map(|(positions, first_draw)| Draw {
                positions,
                triangles: &[[0, 1, 2]],
                ranks: &[0],
                first_draw,
                clip_from_object: IDENTITY,
                faces: Faces::Both,
            })
            .collect();
        fates(viewport, DepthOrder::Forward, &draws, tolerance)
    }

    fn within(pixels: f64) -> Tolerance {
        Tolerance { pixels, ..Tolerance::EXACT }
    }

    /// A triangle whose left side stands `beyond` pixels to the right of the sample, or leans the same
    /// distance off at a slope of 3 to 4; all else is far away.
    fn sides(beyond: f32) -> [[[f32; 3]; 3]; 2] {
        // A pixel of a 1 × 1 viewport is two units; the sample is at the origin, rows go down.
        let at = |x: f32, y: f32| [2.0 * x, -2.0 * y, 0.5];
        let upright = [at(beyond, -40.0), at(beyond, 40.0), at(80.0, 0.0)];
        // The side passes (0.8, 0.6)·beyond along (−0.6, 0.8).
        let (x, y) = (0.8 * beyond, 0.6 * beyond);
        let leaning = [at(x + 30.0, y - 40.0), at(x - 30.0, y + 40.0), at(90.0, 70.0)];
        [upright, leaning]
    }

    #[test]
    fn edges_are_displaced_by_the_tolerance() {
        // A quarter pixel, and a step of the window's grid.
        let (quarter, step) = (0.25_f64, 1.0 / 256.0);
        for (i, triangle) in sides(-0.25).into_iter().enumerate() {
            // The upright side is 20,480 sub-pixels long: less than half of one in its edge values. Snapping
            // moves the leaning side by at most half a step along either axis.
            let slack = if i == 0 { 5e-8 } else { step };
            assert_eq!(of(ONE, &[triangle], within(quarter + slack)).parts, [Fate::May]);
            assert_eq!(of(ONE, &[triangle], within(quarter - slack)).parts, [Fate::Must]);
            assert_eq!(of(ONE, &[triangle], Tolerance::EXACT).parts, [Fate::Must]);
        }
        for (i, triangle) in sides(0.25).into_iter().enumerate() {
            let slack = if i == 0 { 5e-8 } else { step };
            assert_eq!(of(ONE, &[triangle], within(quarter + slack)).parts, [Fate::May]);
            assert_eq!(of(ONE, &[triangle], within(quarter - slack)).parts, [Fate::Hidden]);
            assert_eq!(of(ONE, &[triangle], Tolerance::EXACT).parts, [Fate::Hidden]);
        }
        // Exactly at the bound: inside it does not count as sure, outside it may be covered.
        assert_eq!(of(ONE, &[sides(-0.25)[0]], within(quarter)).parts, [Fate::May]);
        assert_eq!(of(ONE, &[sides(0.25)[0]], within(quarter)).parts, [Fate::May]);
    }

    #[test]
    fn depth_is_off_along_the_slope() {
        // 0.1 a pixel to the right and 0.06 down: a fifth of a pixel is 0.032.
        let plane = |x: f32, y: f32| [x, y, 0.4 + 0.05 * x - 0.03 * y];
        let tilted = [plane(-3.0, -3.0), plane(3.0, -3.0), plane(0.0, 4.0)];
        let flat = |z: f32| [[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]];
        let fates = |z: f32| of(ONE, &[tilted, flat(z)], within(0.2)).parts;
        assert_eq!(fates(0.4325), [Fate::Must, Fate::Hidden], "over the slope");
        assert_eq!(fates(0.4315), [Fate::May, Fate::May], "under it");
        assert_eq!(fates(0.3685), [Fate::May, Fate::May]);
        assert_eq!(fates(0.3675), [Fate::Hidden, Fate::Must]);
    }

    #[test]
    fn depths_are_off_by_ulps() {
        let flat = |z: f32| [[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]];
        let up = |z: f32, ulps: u32| f32::from_bits(z.to_bits() + ulps);
        for pixels in [0.0, 0.1] {
            let tolerance = Tolerance { pixels, ulps: 10, clipped_ulps: 0 };
            let fates = |apart: u32| of(ONE, &[flat(0.5), flat(up(0.5, apart))], tolerance).parts;
            assert_eq!(fates(21), [Fate::Must, Fate::Hidden], "over both");
            assert_eq!(fates(20), [Fate::May, Fate::May], "at both");
        }
    }

    /// A triangle cut by the near plane has its own number.
    #[test]
    fn clipped_triangles_are_off_by_more() {
        let flat = |z: f32| [[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]];
        let cut = [[-9.0, -9.0, 0.5], [9.0, -9.0, 0.5], [0.0, 30.0, -0.1]];
        let fates = |clipped_ulps: u32| {
            of(ONE, &[cut, flat(0.7)], Tolerance { clipped_ulps, ..Tolerance::EXACT }).parts
        };
        assert_eq!(fates(0), [Fate::Must, Fate::Hidden]);
        assert_eq!(fates(1 << 24), [Fate::May, Fate::May]);
    }

    /// Without area a triangle may show what is within the tolerance of its sides, at any of its depths.
    #[test]
    fn a_line_may_show_what_is_near_it() {
        let at = |x: f32, y: f32, z: f32| [2.0 * x, -2.0 * y, z];
        // A quarter pixel to the right of the sample.
        let line = [at(0.25, -1.0, 0.3), at(0.25, 1.0, 0.5), at(0.25, -0.7, 0.2)];
        assert_eq!(of(ONE, &[line], within(0.25)).parts, [Fate::May]);
        assert_eq!(of(ONE, &[line], within(0.25 - 1.0 / 1024.0)).parts, [Fate::Hidden]);
        assert_eq!(of(ONE, &[line], Tolerance::EXACT).parts, [Fate::Hidden]);
        let flat = |z: f32| [[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]];
        let before = |z: f32| of(ONE, &[line, flat(z)], within(0.3)).parts;
        assert_eq!(before(0.21), [Fate::May, Fate::May], "its nearest is before");
        assert_eq!(before(0.19), [Fate::Hidden, Fate::Must], "all of it is behind");
        // Through the sample itself: nothing by the raster rules, perhaps something on a device.
        let through = line.map(|[_, y, z]| [0.0, y, z]);
        assert_eq!(of(ONE, &[through], Tolerance::EXACT).parts, [Fate::Hidden]);
        assert_eq!(of(ONE, &[through], within(1e-6)).parts, [Fate::May]);
    }

    /// The samples that are looked at are those within the tolerance of the triangle's box, and no more.
    #[test]
    fn samples_are_those_near_the_box() {
        let viewport = Viewport { width: 7, height: 5 };
        let at = |x: i32, y: i32| WindowVertex { x, y, z: 0.5 };
        for (from, to) in
            [([128, 128], [128, 128]), ([300, 129], [1100, 640]), ([-900, 383], [5000, 385])]
        {
            for pixels in [0.0, 0.25, 1.0] {
                let allowed = Allowed { viewport, order: DepthOrder::Forward, pixels, ulps: 0 };
                let v = [at(from[0], to[1]), at(to[0], from[1]), at(from[0], from[1])];
                let found: Vec<(usize, [i64; 2])> = allowed.samples(&v).collect();
                let reach = (pixels * 256.0) as i64;
                let near = |at: i64, axis: usize| {
                    (i64::from(from[axis]) - reach..=i64::from(to[axis]) + reach).contains(&at)
                };
                let all =
                    (0..35_usize).map(|i| (i, [i % 7, i / 7].map(|at| at as i64 * 256 + 128)));
                let expected: Vec<_> =
                    all.filter(|(_, [x, y])| near(*x, 0) && near(*y, 1)).collect();
                assert_eq!(found, expected, "{from:?} {to:?} {pixels}");
            }
        }
    }

    /// Depth at the far plane loses against a cleared sample.
    #[test]
    fn the_far_plane_does_not_show() {
        let flat = |z: f32| [[-9.0, -9.0, z], [9.0, -9.0, z], [0.0, 9.0, z]];
        assert_eq!(of(ONE, &[flat(1.0)], Tolerance::EXACT).parts, [Fate::Hidden]);
        assert_eq!(of(ONE, &[flat(1.0_f32.next_down())], Tolerance::EXACT).parts, [Fate::Must]);
    }

    #[test]
    fn distances_to_a_segment() {
        let vertex = |x: i32, y: i32| WindowVertex { x, y, z: 0.0 };
        let (a, b) = (vertex(2, 1), vertex(8, 9));
        for (point, expected) in [
            ([5, 5], 0.0),
            ([1, 8], 5.0),
            ([9, 2], 5.0),
            ([11, 13], 5.0),
            ([-1, -3], 5.0),
            ([8, 9], 0.0),
            ([2, 1], 0.0),
        ] {
            assert!((distance(a, b, point) - expected).abs() < 1e-12, "{point:?}");
            assert!((distance(b, a, point) - expected).abs() < 1e-12, "{point:?}");
        }
        assert_eq!(distance(a, a, [5, 5]), 5.0);
    }
}
