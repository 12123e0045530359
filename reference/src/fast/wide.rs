//! Triangles of any size, already clipped and snapped, block by block.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f64x8, i32x8, i64x8, mask64x8};

use super::narrow::{depth_words, nearest};
use super::painter::Painter;
use crate::image::{BLOCK, BLOCKS, REGION, Region, Viewport};
use crate::order::{DepthOrder, Order};
use crate::window::{Oriented, SUBPIXELS, edge, top_left};

/// A triangle that covers at least the box of a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wide {
    pub(crate) triangle: Oriented,
    /// Draw index plus one.
    pub(crate) id: u32,
    /// First and last columns and rows whose centres are within the bounding box and the image.
    pub(crate) min: [i16; 2],
    pub(crate) max: [i16; 2],
}

/// An edge value beyond ±this has the same sign all over a block: from one sample of a block to another
/// it changes by at most 7·(2²⁴ + 2²⁴) < 2²⁸, sub-pixel bits dropped.
const SATURATED: i64 = 1 << 29;
/// The plane of a triangle's depth, evaluated in f64, is within this much times its scale of the exact
/// one: each of its terms takes at most five roundings and the two sums four, so 9·2⁻⁵³ of the sum of
/// the terms' sizes, and the written depth before its rounding to f32 is within 5·2⁻⁵³; 2⁻⁴⁹ is 16·2⁻⁵³.
const PLANE_ERROR: f64 = 1.0 / (1_u64 << 49) as f64;

impl Wide {
    /// `None` where the box holds no sample of the image.
    pub(crate) fn new(triangle: Oriented, id: u32, viewport: Viewport) -> Option<Self> {
        let half = SUBPIXELS as i32 / 2;
        let span = |a: i32, b: i32, c: i32, side: u32| {
            // First and last centre (column·256 + 128) within the box: ceiling and floor.
            let first = (a.min(b).min(c) - half + 255) >> 8;
            let last = (a.max(b).max(c) - half) >> 8;
            (first.max(0), last.min(side as i32 - 1))
        };
        let [a, b, c] = triangle.v;
        let (x0, x1) = span(a.x, b.x, c.x, viewport.width);
        let (y0, y1) = span(a.y, b.y, c.y, viewport.height);
        // Viewports end before 2¹⁵.
        let pixel = |x: i32, y: i32| [x as i16, y as i16];
        (x0 <= x1 && y0 <= y1).then(|| Self {
            triangle,
            id,
            min: pixel(x0, y0),
            max: pixel(x1, y1),
        })
    }

    /// The key of a depth that no fragment is nearer than.
    pub(crate) fn near(&self, order: DepthOrder) -> u32 {
        (nearest(order, three!(i => self.triangle.v[i].z)) >> 32) as u32
    }
}

/// One edge against samples, counted from the first sample of a region.
#[derive(Clone, Copy)]
pub(crate) struct Edge {
    /// ⌊(e − bias) / 256⌋, of the same sign as e − bias: the samples' steps are whole multiples of 256.
    value: i64,
    /// Its change from a column to the next, and from a row to the next.
    right: i64,
    down: i64,
    /// The edge value itself, unbiased; exact.
    exact: f64,
}

impl Edge {
    fn new(triangle: &Oriented, i: usize, origin: [i32; 2]) -> Self {
        let (a, b) = (triangle.v[(i + 1) % 3], triangle.v[(i + 2) % 3]);
        let [x, y] = origin.map(|pixel| i64::from(pixel) * SUBPIXELS + SUBPIXELS / 2);
        let exact = edge(a, b, x, y);
        let biased = exact - i64::from(!top_left(a, b));
        Self {
            value: biased >> 8,
            right: i64::from(a.y) - i64::from(b.y),
            down: i64::from(b.x) - i64::from(a.x),
            exact: exact as f64,
        }
    }

    pub(crate) fn at(&self, [x, y]: [i64; 2]) -> i64 {
        self.value + self.right * x + self.down * y
    }

    /// The edge value itself: whole and below 2⁴⁹, so f64 holds it.
    pub(crate) fn exact_at(&self, [x, y]: [i64; 2]) -> f64 {
        self.exact + (SUBPIXELS * (self.right * x + self.down * y)) as f64
    }

    /// The most that the value rises within a block.
    fn rise(&self) -> i64 {
        (BLOCK as i64 - 1) * (self.right.max(0) + self.down.max(0))
    }
}

/// A lower bound of a triangle's depths over a block: its plane, less the plane's error.
struct Plane {
    /// At the nearest sample of the region's first block.
    depth: f64,
    right: f64,
    down: f64,
}

impl Plane {
    /// Differences of depths keep the terms small: the three edge values add up to the area, so
    /// z = z₀ + (e₁·(z₁ − z₀) + e₂·(z₂ − z₀)) / area.
    fn new(triangle: &Oriented, edges: &[Edge; 3]) -> Self {
        let area = triangle.area as f64;
        let [z0, z1, z2] = three!(i => f64::from(triangle.v[i].z));
        let (d1, d2) = (z1 - z0, z2 - z0);
        let step = |along: fn(&Edge) -> f64| {
            let (a, b) = (along(&edges[1]) * d1 / area, along(&edges[2]) * d2 / area);
            (a + b, a.abs() + b.abs())
        };
        let (right, right_size) = step(|edge| (SUBPIXELS * edge.right) as f64);
        let (down, down_size) = step(|edge| (SUBPIXELS * edge.down) as f64);
        let (depth, size) = step(|edge| edge.exact);
        let scale = 1.0 + size + REGION as f64 * (right_size + down_size);
        let last = (BLOCK - 1) as f64;
        Self {
            depth: z0 + depth + last * (right.min(0.0) + down.min(0.0)) - PLANE_ERROR * scale,
            right,
            down,
        }
    }

    /// Whether every fragment in the block is strictly behind `far`. The exact depth is at least the
    /// bound, so where that is not below the f32 after `far`, neither is any depth rounded to f32.
    fn hidden(&self, order: DepthOrder, [x, y]: [i64; 2], far: u32) -> bool {
        let bound = self.depth + self.right * x as f64 + self.down * y as f64;
        bound >= f64::from(order.depth(far + 1))
    }
}

/// Draws one triangle into one region.
#[inline(always)]
pub(crate) fn draw<P: Painter>(painter: P, wide: &Wide, region: &mut Region<'_>) {
    let triangle = &wide.triangle;
    let block = |axis: usize, pixel: i16| {
        (i32::from(pixel) - region.origin[axis]).clamp(0, REGION as i32 - 1) as usize / BLOCK
    };
    let (x0, x1) = (block(0, wide.min[0]), block(0, wide.max[0]));
    let (y0, y1) = (block(1, wide.min[1]), block(1, wide.max[1]));
    let edges = three!(i => Edge::new(triangle, i, region.origin));
    let plane = Plane::new(triangle, &edges);
    let near = wide.near(P::Order::ORDER);
    let rise = three!(i => edges[i].rise());
    for row in y0..=y1 {
        for column in x0..=x1 {
            let place = [(column * BLOCK) as i64, (row * BLOCK) as i64];
            let [a, b, c] = three!(i => edges[i].at(place) + rise[i]);
            if a | b | c < 0 {
                continue;
            }
            let far = region.far[row * BLOCKS + column];
            if near > far || plane.hidden(P::Order::ORDER, place, far) {
                continue;
            }
            if painter.block(wide, region, &edges, [column, row]) {
                painter.renew(region, row * BLOCKS + column);
            }
        }
    }
}

/// Draws the triangle into one block; whether it reached any sample.
#[inline(always)]
pub(crate) fn samples<S: Simd, O: Order>(
    (s, order): (S, O),
    wide: &Wide,
    region: &mut Region<'_>,
    edges: &[Edge; 3],
    [column, row]: [usize; 2],
) -> bool {
    let place = [(column * BLOCK) as i64, (row * BLOCK) as i64];
    let lane32 = i32x8::load_array(s, [0, 1, 2, 3, 4, 5, 6, 7]);
    let lane64 = f64x8::load_array(s, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    // Differences of snapped coordinates are within 2²⁴.
    let mut value = three!(i => {
        let first = edges[i].at(place).clamp(-SATURATED, SATURATED) as i32;
        lane32 * edges[i].right as i32 + first
    });
    let down = three!(i => edges[i].down as i32);
    let z = three!(i => wide.triangle.v[i].z);
    let nearest = i64x8::splat(s, nearest(O::ORDER, z));
    let z = three!(i => f64::from(z[i]));
    let area = wide.triangle.area as f64;
    let along = three!(i => lane64 * (SUBPIXELS * edges[i].right) as f64);
    let mut any = false;
    for line in 0..BLOCK {
        let covered = (value[0] | value[1] | value[2]).simd_ge(0).to_bitmask();
        if covered != 0 {
            let start = (row * BLOCK + line) * REGION + column * BLOCK;
            let words = &mut region.words[start..start + BLOCK];
            let stored = i64x8::from_slice(s, words);
            let reached = covered & nearest.simd_le(stored).to_bitmask();
            if reached != 0 {
                let at = [place[0], place[1] + line as i64];
                let e = three!(i => along[i] + edges[i].exact_at(at));
                let word = depth_words(s, order, e, z, area, wide.id);
                let lower = mask64x8::from_bitmask(s, reached).select(word.min(stored), stored);
                lower.store_slice(words);
                any = true;
            }
        }
        value = [value[0] + down[0], value[1] + down[1], value[2] + down[2]];
    }
    any
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use crate::draw::Faces;
    use crate::fast::painter::recorder::{Record, Recorder};
    use crate::image::Image;
    use crate::window::WindowVertex;

    const ORIGIN: [i32; 2] = [128, 256];

    /// Triangles over the region at [`ORIGIN`], in pixels from it, whose planes rise and fall along both axes;
    /// each beginning at each of its corners.
    fn triangles() -> Vec<Oriented> {
        let at = |[x, y, z]: [f32; 3]| WindowVertex {
            x: (x * 256.0) as i32 + ORIGIN[0] * 256,
            y: (y * 256.0) as i32 + ORIGIN[1] * 256,
            z,
        };
        [
            [[-20.0, -10.3, 0.1], [150.7, 5.0, 0.9], [30.0, 160.2, 0.3]],
            [[-20.0, -10.3, 0.9], [150.7, 5.0, 0.1], [30.0, 160.2, 0.5]],
            [[60.1, 140.0, 0.2], [-40.0, -30.0, 0.8], [140.0, 20.0, 0.7]],
            [[-300.0, -70.0, 0.0], [40.0, 900.0, 1.0], [700.0, -60.0, 0.4]],
            [[3.0, 4.0, 0.25], [90.0, 8.0, 0.5], [50.0, 100.0, 0.25]],
            // Blunt: beyond its third corner two edges leave out what is still in its box.
            [[3.0, 4.0, 0.25], [120.0, 110.0, 0.5], [75.0, 40.0, 0.4]],
        ]
        .into_iter()
        .flat_map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]])
        .map(|corners| Oriented::new(corners.map(at), Faces::Both).expect("an area"))
        .collect()
    }

    fn edges(triangle: &Oriented) -> [Edge; 3] {
        three!(i => Edge::new(triangle, i, ORIGIN))
    }

    /// Places of samples in a block, from the region's first one.
    fn samples([column, row]: [i64; 2]) -> impl Iterator<Item = [i64; 2]> {
        (0..64).map(move |i| [column * 8 + i % 8, row * 8 + i / 8])
    }

    #[test]
    fn edges_are_known_at_samples() {
        for triangle in triangles() {
            for (i, edge_of) in edges(&triangle).into_iter().enumerate() {
                let (a, b) = (triangle.v[(i + 1) % 3], triangle.v[(i + 2) % 3]);
                for at in [[0, 0], [1, 0], [0, 1], [127, 5], [64, 127], [-3, 9]] {
                    let center = |axis: usize| (at[axis] + i64::from(ORIGIN[axis])) * 256 + 128;
                    let exact = edge(a, b, center(0), center(1));
                    assert_eq!(edge_of.exact_at(at), exact as f64);
                    assert_eq!(edge_of.at(at), (exact - i64::from(!top_left(a, b))) >> 8);
                }
                for block in [[0, 0], [3, 7], [15, 15]] {
                    let first = edge_of.at([block[0] * 8, block[1] * 8]);
                    let most = samples(block).map(|at| edge_of.at(at)).max();
                    assert_eq!(most, Some(first + edge_of.rise()));
                }
            }
        }
    }

    /// The bound of a block lies below the least of the plane at its samples by the plane's error: not more,
    /// or hidden blocks were drawn, and not less, or blocks were left out that show.
    #[test]
    fn planes_lie_below_their_triangles_by_their_error() {
        let mut within = 0;
        for triangle in triangles() {
            let edges = edges(&triangle);
            let plane = Plane::new(&triangle, &edges);
            let [z0, z1, z2] = triangle.v.map(|v| f64::from(v.z));
            let area = triangle.area as f64;
            let terms = |at: [i64; 2]| {
                [edges[1].exact_at(at) * (z1 - z0) / area, edges[2].exact_at(at) * (z2 - z0) / area]
            };
            // Sizes at the first sample, and of the steps of all 128 columns and rows.
            let size = |[a, b]: [f64; 2]| a.abs() + b.abs();
            let step = |at: [i64; 2]| {
                let ([a, b], [c, d]) = (terms(at), terms([0, 0]));
                size([a - c, b - d])
            };
            let scale = 1.0 + size(terms([0, 0])) + step([128, 0]) + step([0, 128]);
            for block in [[0, 0], [3, 7], [15, 15], [8, 0], [0, 12]] {
                let least = samples(block)
                    .map(|at| z0 + terms(at)[0] + terms(at)[1])
                    .fold(f64::INFINITY, f64::min);
                let [x, y] = block.map(|at| at as f64 * 8.0);
                let bound = plane.depth + plane.right * x + plane.down * y;
                let errors = (least - bound) / (PLANE_ERROR * scale);
                // The test itself rounds in the tenth or so of that.
                assert!((0.7..1.3).contains(&errors), "{triangle:?} {block:?}: {errors}");
                if !(0.001..0.999).contains(&bound) {
                    continue;
                }
                // The last depth that is not behind the bound.
                let order = DepthOrder::Forward;
                let key = order.key(bound as f32);
                let key = key - u32::from(f64::from(order.depth(key)) > bound);
                let hidden = |far: u32| plane.hidden(order, block.map(|at| at * 8), far);
                assert!(hidden(key - 1) && !hidden(key), "{triangle:?} {block:?}");
                within += 1;
            }
        }
        assert!(within >= 36, "{within} blocks of 90 have a bound between the planes");
        assert_eq!(PLANE_ERROR, 16.0 * f64::EPSILON / 2.0);
    }

    /// Strictly behind: beyond the float after the farthest.
    #[test]
    fn a_plane_is_hidden_behind_the_next_depth() {
        for (order, z) in [(DepthOrder::Forward, 0.5_f32), (DepthOrder::Reversed, -0.5)] {
            let flat = |[x, y]: [i32; 2]| WindowVertex { x: x * 256, y: y * 256, z };
            let corners = [[0, 0], [900, 0], [0, 900]].map(flat);
            let triangle = Oriented::new(corners, Faces::Both).expect("an area");
            let plane = Plane::new(&triangle, &edges(&triangle));
            let key = order.key(z);
            assert!(!plane.hidden(order, [8, 16], key), "a tie is not hidden");
            assert!(!plane.hidden(order, [8, 16], key - 1), "its error reaches the next depth");
            assert!(plane.hidden(order, [8, 16], key - 2));
        }
    }

    /// First and last centres within the box, on the image.
    #[test]
    fn boxes_hold_their_centres() {
        let viewport = Viewport { width: 100, height: 50 };
        let of = |x: [i32; 2], y: [i32; 2]| {
            let corners = [[x[0], y[0]], [x[1], y[0]], [x[0], y[1]]];
            let corners = corners.map(|[x, y]| WindowVertex { x, y, z: 0.5 });
            let triangle = Oriented::new(corners, Faces::Both).expect("an area");
            Wide::new(triangle, 1, viewport).map(|wide| (wide.min, wide.max))
        };
        assert_eq!(of([128, 384], [128, 129]), Some(([0, 0], [1, 0])), "at centres");
        assert_eq!(of([129, 383], [128, 200]), None, "between columns");
        assert_eq!(of([128, 200], [129, 383]), None, "between rows");
        assert_eq!(of([129, 384], [127, 384]), Some(([1, 0], [1, 1])));
        assert_eq!(of([-900, 99_999], [-900, 99_999]), Some(([0, 0], [99, 49])));
        assert_eq!(of([-900, -1], [0, 900]), None, "beside the image");
        assert_eq!(of([0, 900], [50 * 256, 60 * 256]), None, "below it");
        assert_eq!(of([99 * 256, 101 * 256], [49 * 256, 50 * 256]), Some(([99, 49], [99, 49])));
    }
    /// A triangle goes to the blocks of its box that no edge leaves out whole and that lie before what is
    /// farthest there, and to no others; those that it reached are renewed.
    #[test]
    fn blocks_are_those_that_the_edges_cross() {
        let viewport = Viewport { width: 256, height: 384 };
        let mut image = Image::new(viewport);
        for triangle in triangles() {
            let wide = Wide::new(triangle, 1, viewport).expect("on the image");
            let edges = edges(&triangle);
            let meets = |block: usize| {
                let place = [block % BLOCKS, block / BLOCKS].map(|at| at as i64);
                let first = [0, 1].map(|axis| place[axis] * 8 + i64::from(ORIGIN[axis]));
                let boxed = (0..2).all(|axis| {
                    first[axis] + 7 >= i64::from(wide.min[axis])
                        && first[axis] <= i64::from(wide.max[axis])
                });
                boxed && edges.iter().all(|edge| samples(place).any(|at| edge.at(at) >= 0))
            };
            let crossed: Vec<usize> = (0..BLOCKS * BLOCKS).filter(|&block| meets(block)).collect();
            let mut record = |far: u32| {
                // The region at ORIGIN, of two by three.
                let mut region = image.regions().nth(5).expect("six regions");
                assert_eq!(region.origin, ORIGIN);
                region.far.fill(far);
                let recorded = RefCell::new(Record::default());
                draw(Recorder(&recorded), &wide, &mut region);
                recorded.into_inner()
            };
            let Record { drawn, renewed } = record(DepthOrder::Forward.key(1.0));
            let all = crossed.iter().map(|&block| (1, block)).collect::<Vec<_>>();
            assert_eq!(drawn, all, "{triangle:?}");
            assert!(crossed.len() > 5, "{}", crossed.len());
            let even = |block: &usize| (block % BLOCKS).is_multiple_of(2);
            assert_eq!(renewed, crossed.into_iter().filter(even).collect::<Vec<_>>());
            let near = wide.near(DepthOrder::Forward);
            if near > 0 {
                assert_eq!(record(near - 1).drawn, [], "all is strictly behind");
            }
        }
        // A flat one, whose plane is near its corners: at its own depth it is drawn, a float before it not.
        let flat = triangles()[9].v.map(|v| WindowVertex { z: 0.5, ..v });
        let wide = Wide::new(Oriented::new(flat, Faces::Both).expect("an area"), 1, viewport);
        let wide = wide.expect("on the image");
        for (far, draws) in [(0.5_f32, true), (0.5_f32.next_down(), false)] {
            let mut region = image.regions().nth(5).expect("six regions");
            region.far.fill(far.to_bits());
            let recorded = RefCell::new(Record::default());
            draw(Recorder(&recorded), &wide, &mut region);
            assert_eq!(!recorded.into_inner().drawn.is_empty(), draws);
        }
    }
}
