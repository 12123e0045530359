//! Where the clusters of an instance are on the screen: for sixteen clusters at once, pixels that hold
//! all their vertices and a depth that none of them is nearer than.
//!
//! # Why the bounds hold
//! Let u = 2⁻²⁴. A clip coordinate is computed with four roundings of terms that add up to at most
//! S = |m₀|·X + |m₄|·Y + |m₈|·Z + |m₁₂| for coordinates up to X, Y, Z, so it is within γ₄·S of the
//! exact one (Higham 2002, *Accuracy and Stability of Numerical Algorithms*, §3.1), be it a vertex of
//! the cluster or a corner of its box, which is computed alike. [`ROUNDINGS`]·u·S covers both together
//! twice over, and the roundings of S itself with them. The exact clip coordinates of a vertex lie among those of the corners, and so does any
//! quotient of two of them while the divisor is positive (it is monotone along every segment). What
//! the divisions, the scaling and the snapping add is in [`Projection::clusters`].

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16};

use super::inlined;
use super::level::LANES;
use crate::image::Viewport;
use crate::order::DepthOrder;

/// Roundings of clip coordinates, of a vertex and a corner together (4 + 4), doubled.
const ROUNDINGS: f32 = 16.0;
/// The unit roundoff of f32.
const UNIT: f32 = 1.0 / 16_777_216.0;
/// A cluster is outside where all its clip coordinates are beyond a plane by this many times the error
/// of one: new vertices of clipped triangles err by at most γ₁₈ of the largest coordinate more (three
/// roundings for each of six planes), and 16 · 4 is above 4 + 18 twice over.
const OUTSIDE: f32 = 4.0;
/// Clip coordinates below this and sums of two of them overflow nowhere; an instance with larger ones
/// (or with a matrix that is not finite) is wide altogether.
const LARGEST: f32 = (1_u128 << 125) as f32;
/// Largest side of a cluster that takes the narrow path. Differences of sub-pixels up to 120·256 and
/// samples up to seven columns beyond keep an edge value within 2·(127·256)² < 2³¹.
pub(crate) const NARROW_PIXELS: i32 = 120;

/// Where a cluster is in one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Place {
    /// It covers no sample.
    Outside,
    /// No vertex is clipped, and all lie on the pixels from `min` to `max`, at most [`NARROW_PIXELS`]
    /// apart; the bits of no depth are below `near`.
    Narrow { min: [i16; 2], max: [i16; 2], near: u32 },
    /// Anything else.
    Wide,
}

/// Sixteen clusters, each with the matrix of its instance, by component.
pub(crate) struct Batch {
    pub(crate) matrix: [[f32; LANES]; 16],
    /// Lowest x, y, z, highest x, y, z.
    pub(crate) boxes: [[f32; LANES]; 6],
}

impl Batch {
    pub(crate) fn new() -> Self {
        Self { matrix: [[0.0; LANES]; 16], boxes: [[0.0; LANES]; 6] }
    }
}

/// From clip space to pixels.
pub(crate) struct Projection {
    half: [f32; 2],
    last: [f32; 2],
    order: DepthOrder,
    /// Whether w takes part in the distance to the near plane (z + w when reversed, z when not), and in
    /// that to the far one (−z, w − z): a factor of 1 or 0, exact either way.
    planes: [f32; 2],
}

impl Projection {
    pub(crate) fn new(viewport: Viewport, order: DepthOrder) -> Self {
        let last = [viewport.width as f32, viewport.height as f32];
        let planes = match order {
            DepthOrder::Forward => [0.0, 1.0],
            DepthOrder::Reversed => [1.0, 0.0],
        };
        Self { half: [last[0] * 0.5, last[1] * 0.5], last, order, planes }
    }

    /// Places of sixteen clusters.
    ///
    /// Every comparison is written so that a coordinate that is no number ends in [`Place::Wide`].
    #[inline(always)]
    pub(crate) fn clusters<S: Simd>(&self, s: S, batch: &Batch) -> [Place; LANES] {
        let load = inlined(
            #[inline(always)]
            |i: usize| f32x16::load_array_ref(s, &batch.boxes[i]),
        );
        let m = inlined(
            #[inline(always)]
            |i: usize| f32x16::load_array_ref(s, &batch.matrix[i]),
        );
        let reach = three!(axis => load(axis).abs().max(load(axis + 3).abs()));
        let error = inlined(
            #[inline(always)]
            |row: usize| {
                let [x, y, z] = three!(axis => m(4 * axis + row).abs() * reach[axis]);
                let sum = ((x + y) + z) + m(12 + row).abs();
                // Even a sum of denormals has a margin.
                let error = sum * (ROUNDINGS * UNIT) + f32::MIN_POSITIVE;
                sum.simd_lt(LARGEST).select(error, f32x16::splat(s, f32::INFINITY))
            },
        );
        let (ex, ey, ez, ew) = (error(0), error(1), error(2), error(3));
        let mut seen = Extremes::new(s);
        // The eight corners, each coordinate in the written order.
        for corner in 0..8_usize {
            let clip = inlined(
                #[inline(always)]
                |row: usize| {
                    let [x, y, z] = three!(axis => {
                        m(4 * axis + row) * load(axis + 3 * (corner >> axis & 1))
                    });
                    ((x + y) + z) + m(12 + row)
                },
            );
            seen.add([clip(0), clip(1), clip(2), clip(3)], self.planes);
        }
        let zero = f32x16::splat(s, 0.0);
        let (e_near, e_far) = (ew * self.planes[0] + ez, ew * self.planes[1] + ez);
        // Distances to the six planes over the corners: all beyond one of them?
        let beyond = inlined(
            #[inline(always)]
            |highest: f32x16<S>, error: f32x16<S>| highest.simd_lt(error * -OUTSIDE),
        );
        let outside = beyond(seen.high_near, e_near)
            | beyond(seen.high_far, e_far)
            | beyond(seen.high_left, ex + ew)
            | beyond(seen.high_right, ex + ew)
            | beyond(seen.high_bottom, ey + ew)
            | beyond(seen.high_top, ey + ew);
        // No vertex before near or behind far, and all before the eye.
        let least_w = seen.low_w - ew;
        let whole =
            least_w.simd_gt(zero) & seen.low_near.simd_ge(e_near) & seen.low_far.simd_ge(e_far);
        // A quotient a/w of a vertex differs from the exact one by at most (Ea + |a/w|·Ew) / w, the
        // corner's likewise (both are in the errors); then come at most eight roundings of numbers up
        // to the quotient (reciprocal, product, scaling, and the corner's division), and for columns
        // and rows one of the offset and half a sub-pixel.
        let spread = inlined(
            #[inline(always)]
            |most: f32x16<S>, error: f32x16<S>| (most * ew + error) / least_w + most * (8.0 * UNIT),
        );
        let most = inlined(
            #[inline(always)]
            |low: f32x16<S>, high: f32x16<S>| low.abs().max(high.abs()),
        );
        let span = inlined(
            #[inline(always)]
            |low: f32x16<S>, high: f32x16<S>, error: f32x16<S>, half: f32, flip: f32| {
                let spread = spread(most(low, high), error) * (2.0 * half)
                    + (6.0 * UNIT * half + 1.0 / 256.0);
                let (a, b) = (low * (half * flip) + half, high * (half * flip) + half);
                ((a.min(b) - spread).floor(), (a.max(b) + spread).floor())
            },
        );
        let (x0, x1) = span(seen.low_x, seen.high_x, ex, self.half[0], 1.0);
        let (y0, y1) = span(seen.low_y, seen.high_y, ey, self.half[1], -1.0);
        let aside =
            x1.simd_lt(0.0) | y1.simd_lt(0.0) | x0.simd_ge(self.last[0]) | y0.simd_ge(self.last[1]);
        let limit = (NARROW_PIXELS - 1) as f32;
        let narrow = (x1 - x0).simd_le(limit) & (y1 - y0).simd_le(limit) & whole;
        let [nearest, farthest] = self.order.range();
        let near = (seen.low_depth - spread(most(seen.low_depth, seen.high_depth), ez) * 2.0)
            .max(f32x16::splat(s, nearest))
            .min(f32x16::splat(s, farthest))
            // Turns −0 into +0.
            + 0.0;
        let all = u64::MAX >> (64 - LANES);
        let narrow = narrow.to_bitmask() & all;
        let outside = (outside.to_bitmask() | narrow & aside.to_bitmask()) & all;
        places(self.order, outside, narrow, [x0, y0, x1, y1], near)
    }
}

#[inline(always)]
fn places<S: Simd>(
    order: DepthOrder,
    outside: u64,
    narrow: u64,
    [x0, y0, x1, y1]: [f32x16<S>; 4],
    near: f32x16<S>,
) -> [Place; LANES] {
    let (x0, y0) = (x0.to_array(), y0.to_array());
    let (x1, y1) = (x1.to_array(), y1.to_array());
    let near = near.to_array();
    let mut places = [Place::Wide; LANES];
    for (i, place) in places.iter_mut().enumerate() {
        if outside >> i & 1 == 1 {
            *place = Place::Outside;
        } else if narrow >> i & 1 == 1 {
            // Between −120 and 16,504: neither outside nor wide.
            let (min, max) = ([x0[i] as i16, y0[i] as i16], [x1[i] as i16, y1[i] as i16]);
            *place = Place::Narrow { min, max, near: order.key(near[i]) };
        }
    }
    places
}

/// Extremes over the corners of sixteen boxes.
struct Extremes<S: Simd> {
    low_x: f32x16<S>,
    high_x: f32x16<S>,
    low_y: f32x16<S>,
    high_y: f32x16<S>,
    low_depth: f32x16<S>,
    high_depth: f32x16<S>,
    /// Distances to the near plane, z or w + z.
    low_near: f32x16<S>,
    high_near: f32x16<S>,
    low_w: f32x16<S>,
    /// Distances to the far plane, w − z or −z.
    low_far: f32x16<S>,
    high_far: f32x16<S>,
    /// w + x, w − x, w + y, w − y.
    high_left: f32x16<S>,
    high_right: f32x16<S>,
    high_bottom: f32x16<S>,
    high_top: f32x16<S>,
}

impl<S: Simd> Extremes<S> {
    #[inline(always)]
    fn new(s: S) -> Self {
        let (low, high) = (f32x16::splat(s, f32::INFINITY), f32x16::splat(s, f32::NEG_INFINITY));
        Self {
            low_x: low,
            high_x: high,
            low_y: low,
            high_y: high,
            low_depth: low,
            high_depth: high,
            low_near: low,
            high_near: high,
            low_w: low,
            low_far: low,
            high_far: high,
            high_left: high,
            high_right: high,
            high_bottom: high,
            high_top: high,
        }
    }

    #[inline(always)]
    fn add(&mut self, [x, y, z, w]: [f32x16<S>; 4], planes: [f32; 2]) {
        let keep = inlined(
            #[inline(always)]
            |low: &mut f32x16<S>, high: &mut f32x16<S>, value: f32x16<S>| {
                *low = low.min(value);
                *high = high.max(value);
            },
        );
        keep(&mut self.low_x, &mut self.high_x, x / w);
        keep(&mut self.low_y, &mut self.high_y, y / w);
        keep(&mut self.low_depth, &mut self.high_depth, z / w);
        keep(&mut self.low_near, &mut self.high_near, w * planes[0] + z);
        keep(&mut self.low_far, &mut self.high_far, w * planes[1] - z);
        self.low_w = self.low_w.min(w);
        self.high_left = self.high_left.max(w + x);
        self.high_right = self.high_right.max(w - x);
        self.high_bottom = self.high_bottom.max(w + y);
        self.high_top = self.high_top.max(w - y);
    }
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::draw::transform;
    use crate::window::Window;

    struct Dice(u64);

    impl Dice {
        fn between(&mut self, low: f32, high: f32) -> f32 {
            self.0 = self
                .0
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * ((self.0 >> 40) as f32 / (1_u64 << 24) as f32)
        }
    }

    const VIEWPORT: Viewport = Viewport { width: 1000, height: 700 };

    /// A camera at `eye` that looks along −z, with everything far from the origin where `eye` is.
    fn matrix([x, y, z]: [f32; 3]) -> [f32; 16] {
        let (a, b) = (-50.0 / 49.5_f64, -25.0 / 49.5_f64);
        let [x, y, z] = [x, y, z].map(f64::from);
        let columns = [
            [1.2, 0.0, 0.0, 0.0],
            [0.0, 1.6, 0.0, 0.0],
            [0.0, 0.0, a, -1.0],
            [-1.2 * x, -1.6 * y, -a * z + b, z],
        ];
        std::array::from_fn(|i| columns[i / 4][i % 4] as f32)
    }

    /// The same with depth from −1 at the near plane to 0 at the far one.
    fn reversed(mut m: [f32; 16]) -> [f32; 16] {
        (0..4).for_each(|column| m[4 * column + 2] -= m[4 * column + 3]);
        m
    }

    /// Sixteen boxes of a few vertices each, so small that mostly the margins decide, and what the
    /// vertices become.
    fn round(dice: &mut Dice, far: f32, order: DepthOrder) -> (Batch, Vec<Vec<[f32; 4]>>) {
        let mut batch = Batch::new();
        let mut clips = Vec::new();
        for lane in 0..LANES {
            let eye = [0; 3].map(|_| dice.between(-far, far));
            let m = match order {
                DepthOrder::Forward => matrix(eye),
                DepthOrder::Reversed => reversed(matrix(eye)),
            };
            let depth = dice.between(-0.2, 60.0);
            let middle = [
                eye[0] + dice.between(-1.2, 1.2) * depth,
                eye[1] + dice.between(-0.9, 0.9) * depth,
                eye[2] - depth,
            ];
            let size = dice.between(0.0, 0.02);
            let points: Vec<[f32; 3]> =
                (0..5).map(|_| middle.map(|c| c + dice.between(-size, size))).collect();
            for axis in 0..3 {
                let of = points.iter().map(|point| point[axis]);
                batch.boxes[axis][lane] = of.clone().fold(f32::INFINITY, f32::min);
                batch.boxes[axis + 3][lane] = of.fold(f32::NEG_INFINITY, f32::max);
            }
            for (row, element) in batch.matrix.iter_mut().zip(m) {
                row[lane] = element;
            }
            clips.push(points.iter().map(|&point| transform(&m, point)).collect());
        }
        (batch, clips)
    }

    #[test]
    fn bounds_hold_all_vertices() {
        bounds_hold(DepthOrder::Forward);
    }

    #[test]
    fn bounds_hold_all_vertices_reversed() {
        bounds_hold(DepthOrder::Reversed);
    }

    fn bounds_hold(order: DepthOrder) {
        let (window, projection) = (Window::new(VIEWPORT, order), Projection::new(VIEWPORT, order));
        let mut dice = Dice(1);
        let (mut narrow, mut outside) = (0, 0);
        for i in 0..40_000 {
            let far = [0.0, 1.0, 100.0, 1e4, 1e6][i % 5];
            let (batch, clips) = round(&mut dice, far, order);
            let places = dispatch!(Level::new(), s => projection.clusters(s, &batch));
            for (place, clips) in places.iter().zip(clips) {
                match *place {
                    Place::Wide => {}
                    Place::Outside => {
                        outside += 1;
                        let beyond = clips.iter().fold(0x3f, |all, &clip| {
                            let [x, y, z, w] = clip;
                            let [near, far] = match order {
                                DepthOrder::Forward => [z, w - z],
                                DepthOrder::Reversed => [w + z, -z],
                            };
                            let out = [near, far, w + x, w - x, w + y, w - y].map(|d| d < 0.0);
                            all & out
                                .iter()
                                .enumerate()
                                .map(|(i, &out)| u32::from(out) << i)
                                .sum::<u32>()
                        });
                        let aside = clips.iter().all(|&clip| window.clipper.outside(clip) == 0);
                        assert!(beyond != 0 || aside, "{far}: {clips:?} is not outside");
                    }
                    Place::Narrow { min, max, near } => {
                        narrow += 1;
                        for clip in clips {
                            assert_eq!(
                                window.clipper.outside(clip),
                                0,
                                "{far}: {clip:?} is clipped"
                            );
                            let vertex = window.vertex(clip);
                            for (axis, at) in [vertex.x, vertex.y].into_iter().enumerate() {
                                let (low, high) = (i32::from(min[axis]), i32::from(max[axis]));
                                assert!((low * 256..(high + 1) * 256).contains(&at), "{far}: {at}");
                            }
                            assert!(near <= order.key(vertex.z), "{far}: nearer than {near:x}");
                        }
                    }
                }
            }
        }
        assert!(narrow > 100_000 && outside > 1000, "{narrow} {outside} prove little");
    }

    /// A matrix by its rows: what x, y, z and w are made of.
    fn of_rows(rows: [[f32; 4]; 4]) -> [f32; 16] {
        std::array::from_fn(|i| rows[i % 4][i / 4])
    }

    /// Where a box under a matrix is, in the last of sixteen lanes.
    fn place(
        viewport: Viewport,
        order: DepthOrder,
        m: [f32; 16],
        [low, high]: [[f32; 3]; 2],
    ) -> Place {
        let mut batch = Batch::new();
        let last = LANES - 1;
        m.into_iter().enumerate().for_each(|(i, element)| batch.matrix[i][last] = element);
        low.into_iter().chain(high).enumerate().for_each(|(i, at)| batch.boxes[i][last] = at);
        dispatch!(Level::new(), s => Projection::new(viewport, order).clusters(s, &batch))[last]
    }

    /// The same for a box that is the point (t, 0, 0).
    fn place_of(viewport: Viewport, order: DepthOrder, rows: [[f32; 4]; 4], t: f32) -> Place {
        place(viewport, order, of_rows(rows), [[t, 0.0, 0.0]; 2])
    }

    const U: f64 = 1.0 / (1_u64 << 24) as f64;
    const ORDERS: [DepthOrder; 2] = [DepthOrder::Forward, DepthOrder::Reversed];
    /// So small that a margin is no hundredth of a pixel.
    const SMALL: Viewport = Viewport { width: 64, height: 64 };

    /// Rows that put the point (t, 0, 0) at a distance of 1 − t from a plane, to the bit, and far from the
    /// others; that distance's terms add up to 1 + t. All eight that the orders have.
    fn planes() -> impl Iterator<Item = (DepthOrder, usize, [[f32; 4]; 4])> {
        ORDERS.into_iter().flat_map(|order| {
            (0..6).map(move |plane| {
                let z = (order.range()[0] + order.range()[1]) * 0.5;
                let mut rows = [[0.0; 4], [0.0; 4], [0.0, 0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]];
                let (row, slope, offset) = match (plane, order) {
                    (0, DepthOrder::Forward) => (2, -1.0, 1.0),
                    (0, DepthOrder::Reversed) => (2, -1.0, 0.0),
                    (1, DepthOrder::Forward) => (2, 1.0, 0.0),
                    (1, DepthOrder::Reversed) => (2, 1.0, -1.0),
                    (2 | 4, _) => (plane / 2 - 1, -1.0, 0.0),
                    _ => (plane / 2 - 1, 1.0, 0.0),
                };
                rows[row] = [slope, 0.0, 0.0, offset];
                (order, plane, rows)
            })
        })
    }

    /// At four times the error of a distance a cluster is not yet outside, beyond it is.
    #[test]
    fn outside_begins_at_its_margin() {
        for (order, plane, rows) in planes() {
            let mut outside = 0;
            for step in 50..80 {
                let t = 1.0 + f64::from(step) * 2.0 * U;
                let expected = t - 1.0 > 4.0 * 16.0 * U * (1.0 + t);
                let place = place_of(SMALL, order, rows, t as f32);
                assert_eq!(
                    place == Place::Outside,
                    expected,
                    "{order:?} {plane} {step}: {place:?}"
                );
                outside += u32::from(expected);
            }
            assert_eq!(outside, 15, "the margin is between steps 64 and 65");
        }
    }

    /// How many of 29 steps from 1 the point is narrow, which is where `expected` says so.
    fn narrow_steps(
        order: DepthOrder,
        rows: [[f32; 4]; 4],
        step: f64,
        expected: impl Fn(f64) -> bool,
    ) -> usize {
        let is_narrow = |&i: &i32| {
            let t = 1.0 + f64::from(i) * step;
            let place = place_of(SMALL, order, rows, t as f32);
            let is = matches!(place, Place::Narrow { .. });
            assert_eq!(is, expected(t), "{order:?} {rows:?} {i}: {place:?}");
            is
        };
        (1..30).filter(is_narrow).count()
    }

    /// At the error of a distance within near and far a cluster is narrow, short of it wide.
    #[test]
    fn narrow_begins_at_its_margin() {
        for (order, _, rows) in planes().filter(|&(_, plane, _)| plane < 2) {
            let narrow = narrow_steps(order, rows, -2.0 * U, |t| 1.0 - t >= 16.0 * U * (1.0 + t));
            assert_eq!(narrow, 14, "the margin is at step 16");
        }
    }

    /// w must be above its error: t − 1 here, beside a depth far below.
    #[test]
    fn before_the_eye_begins_at_its_margin() {
        for order in ORDERS {
            let z = (U / 2.0) as f32 * if order == DepthOrder::Forward { 1.0 } else { -1.0 };
            let rows = [[0.0; 4], [0.0; 4], [0.0, 0.0, 0.0, z], [1.0, 0.0, 0.0, -1.0]];
            let narrow = narrow_steps(order, rows, 2.0 * U, |t| t - 1.0 > 16.0 * U * (1.0 + t));
            assert_eq!(narrow, 13, "the margin is between steps 16 and 17");
        }
    }

    /// Terms that are all zero err as denormals may; terms that may overflow err by anything.
    #[test]
    fn the_smallest_and_the_largest_sums_have_a_margin() {
        let of = |w: f32, z: f32| {
            let rows = [0.0, 0.0, z, w].map(|offset| [0.0, 0.0, 0.0, offset]);
            place_of(SMALL, DepthOrder::Forward, rows, 0.0)
        };
        assert_eq!(of(1.0, 0.0), Place::Wide, "on the near plane");
        let step = f32::MIN_POSITIVE;
        assert_eq!(of(1.0, step), Place::Wide, "less than the error before it");
        // The term's own error there is 2⁻²⁰ of it, eight denormals.
        let farther = step * (1.0 + 2.0_f32.powi(-19));
        assert!(matches!(of(1.0, farther), Place::Narrow { near: 0, .. }), "the error before it");
        let large = (125.0_f32).exp2();
        assert!(matches!(of(large.next_down(), large * 0.5), Place::Narrow { .. }));
        assert_eq!(of(large, large * 0.5), Place::Wide);
    }

    /// What [`Projection::clusters`] says of columns and rows, in f64: how far either way from the exact
    /// column of x/w its bounds lie, where x and w have these errors.
    fn reach([x, w]: [f64; 2], [ex, ew]: [f64; 2], half: f64) -> f64 {
        let most = (x / w).abs();
        let quotient = (most * ew + ex) / (w - ew) + most * 8.0 * U;
        quotient * 2.0 * half + 6.0 * U * half + 1.0 / 256.0
    }

    /// Next to the eye w is hardly more than its error, and the divisor is what is left of it.
    #[test]
    fn pixels_reach_farther_next_to_the_eye() {
        // w is a difference of numbers of 1, 40 units of 2⁻²⁴; x is a tenth of it.
        let (t, x) = (1.0 + 40.0 * U, 4.0 * U);
        let z = U / 4.0;
        let rows = [[0.0, x], [0.0, 0.0], [0.0, z], [1.0, -1.0]];
        let rows = rows.map(|[slope, offset]| [slope as f32, 0.0, 0.0, offset as f32]);
        let margin = reach([x, 40.0 * U], [16.0 * U * x, 16.0 * U * (t + 1.0)], 32.0);
        assert!((25.0..28.0).contains(&margin), "{margin}");
        let column = 32.0 + 3.2;
        let place = place_of(SMALL, DepthOrder::Forward, rows, t as f32);
        let Place::Narrow { min, max, .. } = place else { panic!("{place:?}") };
        let expected = [(column - margin).floor(), (column + margin).floor()];
        assert_eq!([min[0], max[0]].map(f64::from), expected);
    }

    /// A pixel more begins where the margin reaches over its edge.
    #[test]
    fn pixels_reach_as_far_as_their_margin() {
        let viewport = Viewport { width: 16_384, height: 16_384 };
        // Where floats of columns are finest, and the largest quotients before them.
        let (half, w) = (8192.0, 2.0);
        let at = |column: f64| (column - half) / half * w;
        for axis in 0..2 {
            // Rows go down.
            let slope = [1.0, -1.0][axis];
            let mut rows = [[0.0; 4], [0.0; 4], [0.0, 0.0, 0.0, 1.0], [0.0, 0.0, 0.0, w as f32]];
            rows[axis][0] = slope;
            let (mut undecided, mut pixels) = (0, [0_u32; 2]);
            for step in 0..100 {
                for (side, edge) in [819.0, 820.0].into_iter().enumerate() {
                    // 0.02 to 0.07 pixels within the pixel, in steps of the floats there.
                    let off = 0.02 + f64::from(step) * 0.000_5;
                    let x = at(if side == 0 { edge + off } else { edge - off }) as f32;
                    let exact = f64::from(x) / w * half + half;
                    let errors = [16.0 * U * f64::from(x).abs(), 16.0 * U * w];
                    let margin = reach([f64::from(x), w], errors, half);
                    let ends = [exact - margin, exact + margin];
                    // The bound's own additions round to 2⁻¹⁴ pixels there.
                    if (ends[side] - edge).abs() < 2.0 / 16_384.0 {
                        undecided += 1;
                        continue;
                    }
                    let place = place_of(viewport, DepthOrder::Forward, rows, x);
                    let Place::Narrow { min, max, .. } = place else { panic!("{place:?}") };
                    let got = [min[axis], max[axis]];
                    assert_eq!(got.map(f64::from), ends.map(f64::floor), "{axis} {x}");
                    pixels[side] += u32::from(got[side] != 819);
                }
            }
            assert!(undecided < 4 && pixels.iter().all(|n| (25..75).contains(n)), "{pixels:?}");
        }
    }

    /// The depth bound lies before the depth by twice the error of a quotient.
    #[test]
    fn depths_are_bound_by_their_margin() {
        for order in ORDERS {
            for depth in [0.125_f64, 0.25, 0.5, 0.75] {
                let depth = depth + f64::from(order.range()[0]);
                let w = 2.0_f64;
                let rows = [
                    [0.0; 4],
                    [0.0; 4],
                    [0.0, 0.0, 0.0, (depth * w) as f32],
                    [0.0, 0.0, 0.0, w as f32],
                ];
                let most = depth.abs();
                let (ez, ew) = (16.0 * U * most * w, 16.0 * U * w);
                let margin = 2.0 * ((most * ew + ez) / (w - ew) + most * 8.0 * U);
                let place = place_of(SMALL, order, rows, 0.0);
                let Place::Narrow { near, .. } = place else { panic!("{place:?}") };
                let off = depth - f64::from(order.depth(near));
                // The difference rounds to half a float there.
                assert!((off - margin).abs() <= most * U, "{order:?} {depth}: {off} {margin}");
            }
        }
    }

    /// 120 pixels are narrow, 121 are not, nor is a cluster beyond either end outside by a pixel too early.
    #[test]
    fn narrow_ends_at_its_pixels() {
        let viewport = Viewport { width: 1024, height: 1024 };
        let rows = [
            [1.0, 0.0, 0.0, 0.0],
            [0.0, -1.0, 0.0, 0.0],
            [0.0, 0.0, 0.0, 0.5],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let at = |pixel: f32| (pixel - 512.0) / 512.0;
        for axis in 0..2 {
            let of = |from: f32, to: f32| {
                let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
                (low[axis], high[axis]) = (at(from), at(to));
                place(viewport, DepthOrder::Forward, of_rows(rows), [low, high])
            };
            let narrow = of(100.5, 219.5);
            assert!(
                matches!(narrow, Place::Narrow { min, max, .. } if (min[axis], max[axis]) == (100, 219)),
                "{narrow:?}"
            );
            assert_eq!(of(100.5, 220.5), Place::Wide);
            // Within a pixel of the image's edge it may touch it; a pixel beyond it does not.
            assert!(matches!(of(-20.5, 0.0), Place::Narrow { .. }));
            assert_eq!(of(-20.5, -0.5), Place::Outside);
            assert!(matches!(of(1024.0, 1044.5), Place::Narrow { .. }));
            assert_eq!(of(1024.5, 1044.5), Place::Outside);
        }
    }

    /// Beyond one plane, two or three.
    #[test]
    fn beyond_any_plane_is_outside() {
        for order in ORDERS {
            let [near, far] = order.range();
            for (i, z) in [near - 1.0, (near + far) * 0.5, far + 1.0].into_iter().enumerate() {
                for (x, y) in
                    (0..9).map(|at| ((at % 3 - 1) as f32 * 3.0, (at / 3 - 1) as f32 * 3.0))
                {
                    let rows = [x, y, z, 1.0].map(|offset| [0.0, 0.0, 0.0, offset]);
                    let expected = i != 1 || x != 0.0 || y != 0.0;
                    let place = place_of(SMALL, order, rows, 0.0);
                    assert_eq!(place == Place::Outside, expected, "{x} {y} {z}: {place:?}");
                }
            }
        }
    }

    /// Where the errors of clip coordinates are pixels, pixels decide before the planes do: at two
    /// errors beyond the edge instead of four.
    #[test]
    fn aside_is_outside() {
        // x and y are differences of numbers of 2¹⁴ and so err by 1/32 of w, which is two pixels.
        let offset = 16_384.0_f32;
        let rows = [
            [1.0, 0.0, 0.0, -offset],
            [0.0, 1.0, 0.0, -offset],
            [0.0, 0.0, 0.0, 0.5],
            [0.0, 0.0, 0.0, 1.0],
        ];
        let of = |x: f32, y: f32| {
            let point = [offset + x, offset + y, 0.0];
            place(SMALL, DepthOrder::Forward, of_rows(rows), [point; 2])
        };
        let near_edge = 1.0 + 1.5 / 32.0;
        let aside = 1.0 + 3.0 / 32.0;
        for x in [-1.0, 0.0, 1.0] {
            for y in [-1.0, 0.0, 1.0] {
                let within = of(x * near_edge, y * near_edge);
                assert!(matches!(within, Place::Narrow { .. }), "{x} {y}: {within:?}");
                let expected = x != 0.0 || y != 0.0;
                assert_eq!(of(x * aside, y * aside) == Place::Outside, expected, "{x} {y}");
            }
        }
    }
}
