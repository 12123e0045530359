//! Clusters of small triangles: transformed, snapped, rejected and covered many to a vector.
//!
//! Everything is relative to the first of the pixels that hold the cluster. There are at most
//! [`NARROW_PIXELS`](super::bound::NARROW_PIXELS) of them on a side, so a snapped vertex fits two
//! 15-bit halves of a word, and edge values fit i32 (see there).

use fearless_simd::prelude::*;
use fearless_simd::{Simd, f32x16, f64x8, i16x32, i32x8, i32x16, i64x8, mask64x8, u32x16};

use super::level::LANES;
use super::mesh::{CLUSTER_VERTICES, View};
use super::{Instance, inlined, lookup};
use crate::draw::Faces;
use crate::image::{BLOCK, BLOCKS, REGION, Region};
use crate::order::{DepthOrder, FARTHEST, MAGNITUDE, Order};

/// Triangles of a full cluster, rounded up to vectors, and one vector more to write beyond the end.
const SLOTS: usize = 6 * LANES;

/// Room that one thread uses for one cluster after the other.
pub(crate) struct Room {
    /// Snapped vertices: column in the low half, row in the high one.
    snapped: [u32; CLUSTER_VERTICES],
    depth: [f32; CLUSTER_VERTICES],
    /// Snapped corners of the triangles.
    corners: [[u32; SLOTS]; 3],
    /// Snapped corners of the triangles whose box holds a sample, and the triangles' numbers.
    kept: [[u32; SLOTS]; 4],
    set_up: SetUp,
}

/// Sixteen triangles ready for samples. Vertices 1 and 2 are exchanged where `turned` says so.
struct SetUp {
    /// Edge values at the first sample of the box.
    edges: [[i32; LANES]; 3],
    /// What an edge that does not own its samples loses: 1 or 0.
    bias: [[i32; LANES]; 3],
    /// Change of the edge values from a column to the next, and from a row to the next.
    right: [[i32; LANES]; 3],
    down: [[i32; LANES]; 3],
    /// First and last column and row of the box.
    first: [[i32; LANES]; 2],
    last: [[i32; LANES]; 2],
    turned: u64,
    /// Lanes whose box is at most two columns by two rows, and is covered: at its first sample, sixteen
    /// bits further at the sample to the right, then at those below.
    tiny: u64,
    /// Lanes with a larger box.
    larger: u64,
}

impl Room {
    pub(crate) fn new() -> Self {
        let none = [0; LANES];
        Self {
            snapped: [0; CLUSTER_VERTICES],
            depth: [0.0; CLUSTER_VERTICES],
            corners: [[0; SLOTS]; 3],
            kept: [[0; SLOTS]; 4],
            set_up: SetUp {
                edges: [none; 3],
                bias: [none; 3],
                right: [none; 3],
                down: [none; 3],
                first: [none; 2],
                last: [none; 2],
                turned: 0,
                tiny: 0,
                larger: 0,
            },
        }
    }
}

/// One cluster to draw into one region.
pub(crate) struct Job<'a> {
    pub(crate) instance: &'a Instance<'a>,
    pub(crate) view: View<'a>,
    pub(crate) vertices: usize,
    pub(crate) triangles: usize,
    /// Half the image's columns and rows.
    pub(crate) half: [f32; 2],
    /// First of the pixels that hold the cluster.
    pub(crate) min: [i32; 2],
}

/// Draws a cluster whose place is narrow.
#[inline(always)]
pub(crate) fn draw<S: Simd, O: Order>(
    s: S,
    order: O,
    job: &Job<'_>,
    region: &mut Region<'_>,
    room: &mut Room,
) {
    job.transform(s, order, room);
    let count = job.triangles;
    lookup::corners(s, &room.snapped, job.view.corners, &mut room.corners);
    // The region's pixels from the cluster's first one.
    let low = [0, 1].map(|axis| (region.origin[axis] - job.min[axis]).max(0));
    let high = [0, 1].map(|axis| {
        (region.origin[axis] + region.size[axis] - 1 - job.min[axis]).min(i32::from(i16::MAX))
    });
    let kept = keep(s, room, count, low, high);
    let mut written = false;
    for from in (0..kept).step_by(LANES) {
        let lanes = u64::MAX >> (64 - (kept - from).min(LANES));
        set_up(s, room, from, lanes, job.instance.faces, low, high);
        written |= job.samples((s, order), region, room, from);
    }
    if written {
        let at = |pixel: i32, axis: usize| {
            (pixel - region.origin[axis]).clamp(0, REGION as i32 - 1) as usize / BLOCK
        };
        let end = |axis: usize| job.min[axis] + super::bound::NARROW_PIXELS;
        for row in at(job.min[1], 1)..=at(end(1), 1) {
            region.stale[row * BLOCKS + at(job.min[0], 0)..=row * BLOCKS + at(end(0), 0)]
                .fill(true);
        }
    }
}

impl Job<'_> {
    /// The written transform and window rule, sixteen vertices at a time.
    #[inline(always)]
    fn transform<S: Simd, O: Order>(&self, s: S, _: O, room: &mut Room) {
        let m = &self.instance.clip_from_object;
        let [near, far] = O::ORDER.range();
        let [half_x, half_y] = self.half;
        for at in (0..self.vertices).step_by(LANES) {
            let [x, y, z]: [f32x16<S>; 3] = three!(axis => {
                u32x16::from_slice(s, &self.view.positions[axis][at..at + LANES]).bitcast()
            });
            let clip = inlined(
                #[inline(always)]
                |row: usize| ((x * m[row] + y * m[4 + row]) + z * m[8 + row]) + m[12 + row],
            );
            let r = f32x16::splat(s, 1.0) / clip(3);
            let column = (clip(0) * r) * half_x + half_x;
            let row = (clip(1) * r) * -half_y + half_y;
            let depth = (clip(2) * r).max(near).min(far) + 0.0;
            let snap = inlined(
                #[inline(always)]
                |value: f32x16<S>, min: i32| -> i32x16<S> {
                    (value * 256.0).round_ties_even().to_int::<i32x16<S>>() - min * 256
                },
            );
            let packed = snap(column, self.min[0]) | (snap(row, self.min[1]) << 16);
            packed.bitcast::<u32x16<S>>().store_slice(&mut room.snapped[at..at + LANES]);
            depth.store_slice(&mut room.depth[at..at + LANES]);
        }
    }

    /// The stored id of a triangle of the cluster.
    #[inline(always)]
    fn id(&self, triangle: usize) -> u32 {
        // Instance::new has seen that the sum fits.
        self.instance.first_draw + self.view.ranks[triangle] + 1
    }

    /// Depths of a triangle's corners, turned as its edges are.
    #[inline(always)]
    fn depths(&self, room: &Room, triangle: usize, turned: bool) -> [f32; 3] {
        let [a, b, c] = self.view.triangle(triangle);
        let [a, b, c] = if turned { [a, c, b] } else { [a, b, c] };
        [room.depth[a], room.depth[b], room.depth[c]]
    }

    /// Draws the triangles that [`set_up`] has prepared. Whether any sample was reached.
    #[inline(always)]
    fn samples<S: Simd, O: Order>(
        &self,
        (s, order): (S, O),
        region: &mut Region<'_>,
        room: &mut Room,
        from: usize,
    ) -> bool {
        let set_up = &room.set_up;
        let mut samples = set_up.tiny;
        while samples != 0 {
            let bit = samples.trailing_zeros() as usize;
            samples &= samples - 1;
            self.sample::<O>(region, room, from, bit % LANES, bit / LANES);
        }
        let mut lanes = set_up.larger;
        while lanes != 0 {
            let lane = lanes.trailing_zeros() as usize % LANES;
            lanes &= lanes - 1;
            let triangle = room.kept[3][from + lane] as usize;
            let z = self.depths(room, triangle, set_up.turned >> lane & 1 == 1);
            self.larger((s, order), region, set_up, lane, z, self.id(triangle));
        }
        set_up.tiny | set_up.larger != 0
    }

    /// One covered sample: the box's first (0), the one to its right (1), or those below (2, 3).
    #[inline(always)]
    fn sample<O: Order>(
        &self,
        region: &mut Region<'_>,
        room: &Room,
        from: usize,
        lane: usize,
        which: usize,
    ) {
        let set_up = &room.set_up;
        let triangle = room.kept[3][from + lane] as usize;
        let z = self.depths(room, triangle, set_up.turned >> lane & 1 == 1);
        let (right, down) = (which as i32 & 1, which as i32 >> 1);
        let column = set_up.first[0][lane] + right + self.min[0] - region.origin[0];
        let row = set_up.first[1][lane] + down + self.min[1] - region.origin[1];
        let stored = &mut region.words[row as usize * REGION + column as usize];
        if nearest(O::ORDER, z) <= *stored {
            let e = three!(i => {
                set_up.edges[i][lane] + right * set_up.right[i][lane] + down * set_up.down[i][lane]
            });
            let area = f64::from(e[0] + e[1] + e[2]);
            let [e0, e1, e2] = three!(i => f64::from(e[i]));
            let [z0, z1, z2] = three!(i => f64::from(z[i]));
            let depth = (((e0 * z0 + e1 * z1) + e2 * z2) / area) as f32;
            let word = i64::from(O::ORDER.key(depth)) << 32 | i64::from(self.id(triangle));
            *stored = (*stored).min(word);
        }
    }

    /// One triangle, eight columns of a row at a time.
    #[inline(always)]
    fn larger<S: Simd, O: Order>(
        &self,
        (s, order): (S, O),
        region: &mut Region<'_>,
        set_up: &SetUp,
        lane: usize,
        z: [f32; 3],
        id: u32,
    ) {
        let local = inlined(
            #[inline(always)]
            |axis: usize, pixel: i32| (pixel + self.min[axis] - region.origin[axis]) as usize,
        );
        let (x0, x1) = (local(0, set_up.first[0][lane]), local(0, set_up.last[0][lane]));
        let (y0, y1) = (local(1, set_up.first[1][lane]), local(1, set_up.last[1][lane]));
        let right = three!(i => set_up.right[i][lane]);
        let down = three!(i => set_up.down[i][lane]);
        let bias = three!(i => set_up.bias[i][lane]);
        let at = three!(i => set_up.edges[i][lane]);
        let area = f64::from(at[0] + at[1] + at[2]);
        let nearest = i64x8::splat(s, nearest(O::ORDER, z));
        let z = three!(i => f64::from(z[i]));
        let lane32 = i32x8::load_array(s, [0, 1, 2, 3, 4, 5, 6, 7]);
        let lane64 = f64x8::load_array(s, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
        let along32 = three!(i => lane32 * right[i] - bias[i]);
        let along64 = three!(i => lane64 * f64::from(right[i]));
        for column in (x0..x1 + 1).step_by(8) {
            // Eight columns within the region; those before the box are outside the triangle.
            let start = column.min(REGION - 8);
            let shift = start as i32 - x0 as i32;
            let mut e = three!(i => at[i] + right[i] * shift);
            for row in y0..y1 + 1 {
                let inside = (along32[0] + e[0]) | (along32[1] + e[1]) | (along32[2] + e[2]);
                let place = row * REGION + start;
                let words = &mut region.words[place..place + 8];
                let stored = i64x8::from_slice(s, words);
                // One branch a row: whether a row is covered and whether it is hidden are both hard to
                // predict.
                let covered = inside.simd_ge(0).to_bitmask();
                let reached = covered & nearest.simd_le(stored).to_bitmask();
                if reached != 0 {
                    let e = three!(i => along64[i] + f64::from(e[i]));
                    let word = depth_words(s, order, e, z, area, id);
                    let lower = mask64x8::from_bitmask(s, reached).select(word.min(stored), stored);
                    lower.store_slice(words);
                }
                e = [e[0] + down[0], e[1] + down[1], e[2] + down[2]];
            }
        }
    }
}

/// The word that no fragment of a triangle with these depths is below.
#[inline(always)]
pub(crate) fn nearest(order: DepthOrder, z: [f32; 3]) -> i64 {
    let [a, b, c] = three!(i => order.key(z[i]));
    i64::from(a.min(b).min(c)) << 32
}

/// The written depth at eight samples from their exact edge values, as words with `id`.
#[inline(always)]
pub(crate) fn depth_words<S: Simd, O: Order>(
    s: S,
    _: O,
    e: [f64x8<S>; 3],
    z: [f64; 3],
    area: f64,
    id: u32,
) -> i64x8<S> {
    let depth = ((e[0] * z[0] + e[1] * z[1]) + e[2] * z[2]) / area;
    let bits: u32x16<S> = s.narrow_f64x8(depth, depth).bitcast();
    let keys = match O::ORDER {
        DepthOrder::Forward => bits,
        DepthOrder::Reversed => u32x16::splat(s, FARTHEST) - (bits & MAGNITUDE),
    };
    u32x16::splat(s, id).zip_low(keys).bitcast()
}

/// Keeps the triangles whose box holds a sample of the region; how many. Columns and rows at once, as
/// halves of words. `low` and `high` are the region's pixels.
#[inline(always)]
fn keep<S: Simd>(s: S, room: &mut Room, count: usize, low: [i32; 2], high: [i32; 2]) -> usize {
    let halves = inlined(
        #[inline(always)]
        |[x, y]: [i32; 2]| -> i16x32<S> {
            u32x16::splat(s, (x as u32 & 0xffff) | (y as u32) << 16).bitcast()
        },
    );
    let (low, high) = (halves(low), halves(high));
    let number = u32x16::load_array(s, [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
    let mut kept = 0;
    for at in (0..count).step_by(LANES) {
        let corners = three!(i => u32x16::from_slice(s, &room.corners[i][at..at + LANES]));
        let [a, b, c]: [i16x32<S>; 3] = three!(i => corners[i].bitcast());
        // Centres are at 128, 384, …: the first at or after the least, the last at or before the most.
        let first = ((a.min(b).min(c) + 127) >> 8).max(low);
        let last = ((a.max(b).max(c) - 128) >> 8).min(high);
        let signs: i32x16<S> = ((last - first) & i16::MIN).bitcast();
        let holds = signs.simd_eq(0);
        for (list, corner) in room.kept.iter_mut().zip(corners) {
            corner.compress(holds).store_slice(&mut list[kept..kept + LANES]);
        }
        (number + at as u32).compress(holds).store_slice(&mut room.kept[3][kept..kept + LANES]);
        kept += holds.to_bitmask().count_ones() as usize;
    }
    kept
}

/// Orientation, edge values at the first sample of the box, and their steps.
#[inline(always)]
fn set_up<S: Simd>(
    s: S,
    room: &mut Room,
    from: usize,
    lanes: u64,
    faces: Faces,
    low: [i32; 2],
    high: [i32; 2],
) {
    let load = inlined(
        #[inline(always)]
        |i: usize| u32x16::from_slice(s, &room.kept[i][from..from + LANES]),
    );
    let column = inlined(
        #[inline(always)]
        |word: u32x16<S>| (word & 0xffff).bitcast::<i32x16<S>>(),
    );
    let row = inlined(
        #[inline(always)]
        |word: u32x16<S>| (word >> 16).bitcast::<i32x16<S>>(),
    );
    let [x0, x1, x2] = three!(i => column(load(i)));
    let [y0, y1, y2] = three!(i => row(load(i)));
    let signed = (x1 - x0) * (y2 - y0) - (y1 - y0) * (x2 - x0);
    let turned = signed.simd_lt(0);
    let live = match faces {
        Faces::Both => !signed.simd_eq(0),
        Faces::CounterClockwise => turned,
    };
    let live = live.to_bitmask() & lanes;
    let out = &mut room.set_up;
    (out.tiny, out.larger) = (0, 0);
    // Clusters mostly show one face.
    if live == 0 {
        return;
    }
    let area = signed.abs();
    let (x1, x2) = (turned.select(x2, x1), turned.select(x1, x2));
    let (y1, y2) = (turned.select(y2, y1), turned.select(y1, y2));
    let first = inlined(
        #[inline(always)]
        |a: i32x16<S>, b: i32x16<S>, c: i32x16<S>, low: i32| {
            ((a.min(b).min(c) + 127) >> 8).max(low)
        },
    );
    let last = inlined(
        #[inline(always)]
        |a: i32x16<S>, b: i32x16<S>, c: i32x16<S>, high: i32| {
            ((a.max(b).max(c) - 128) >> 8).min(high)
        },
    );
    let (left, top) = (first(x0, x1, x2, low[0]), first(y0, y1, y2, low[1]));
    let (right, bottom) = (last(x0, x1, x2, high[0]), last(y0, y1, y2, high[1]));
    let (px, py) = ((left << 8) + 128, (top << 8) + 128);
    let mut edges = [i32x16::splat(s, 0); 3];
    // Signs of the edge values at the four samples of a tiny box, over all edges.
    let none = i32x16::splat(s, 0);
    let mut outside = [none; 4];
    let ends = [(x1, y1, x2, y2), (x2, y2, x0, y0), (x0, y0, x1, y1)];
    for i in 0..3 {
        let (ax, ay, bx, by) = ends[i];
        let (dx, dy) = (bx - ax, by - ay);
        // The three add up to the area.
        edges[i] = if i < 2 { dx * (py - ay) - dy * (px - ax) } else { area - edges[0] - edges[1] };
        let owns = dy.simd_lt(0) | (dy.simd_eq(0) & dx.simd_gt(0));
        let bias = owns.select(none, i32x16::splat(s, 1));
        let (step_right, step_down) = (-(dy << 8), dx << 8);
        let first = edges[i] - bias;
        let below = first + step_down;
        outside[0] |= first;
        outside[1] |= first + step_right;
        outside[2] |= below;
        outside[3] |= below + step_right;
        edges[i].store_array(&mut out.edges[i]);
        bias.store_array(&mut out.bias[i]);
        step_right.store_array(&mut out.right[i]);
        step_down.store_array(&mut out.down[i]);
    }
    left.store_array(&mut out.first[0]);
    top.store_array(&mut out.first[1]);
    right.store_array(&mut out.last[0]);
    bottom.store_array(&mut out.last[1]);
    let (wide, high) = (right - left, bottom - top);
    let tiny = live & (wide | high).simd_le(1).to_bitmask();
    let (two_wide, two_high) = (wide.simd_gt(0).to_bitmask(), high.simd_gt(0).to_bitmask());
    let covered = inlined(
        #[inline(always)]
        |which: usize| outside[which].simd_ge(0).to_bitmask() & tiny,
    );
    out.turned = turned.to_bitmask();
    out.tiny = covered(0)
        | (covered(1) & two_wide) << LANES
        | (covered(2) & two_high) << (2 * LANES)
        | (covered(3) & two_wide & two_high) << (3 * LANES);
    out.larger = live & !tiny;
}

#[cfg(test)]
mod tests {
    use fearless_simd::{Level, dispatch};

    use super::*;
    use crate::window::{Oriented, WindowVertex, edge, top_left};

    /// No draw index is below it, and that of the nearest corner's depth is.
    #[test]
    fn nearest_is_the_least_word_of_the_nearest_corner() {
        for (order, z) in
            [(DepthOrder::Forward, [0.5, 0.25, 0.75]), (DepthOrder::Reversed, [-0.5, -0.75, -0.25])]
        {
            let least = order.key(z[1]);
            for z in [z, [z[1], z[2], z[0]], [z[2], z[0], z[1]]] {
                assert_eq!(nearest(order, z), i64::from(least) << 32);
            }
        }
    }

    /// Numbers that look random, below `limit`.
    fn dice(state: &mut u64, limit: u64) -> i32 {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        ((*state >> 33) % limit) as i32
    }

    /// Triangles from tiny to as large as a narrow cluster, some without area, with samples on their edges
    /// and corners often.
    fn triangles(state: &mut u64, count: usize) -> Vec<[[i32; 2]; 3]> {
        let triangle = |_| {
            let side = [2, 300, 700, 3000, 30_000][dice(state, 5) as usize];
            let grid = [1, 64, 128][dice(state, 3) as usize];
            let from = [0, 1].map(|_| dice(state, 30_720 - side));
            [0; 3].map(|_| from.map(|at| (at + dice(state, side)) / grid * grid))
        };
        (0..count).map(triangle).collect()
    }

    /// Columns or rows whose centres lie among the three places, within the region.
    fn centres(at: [i32; 3], low: i32, high: i32) -> Vec<i32> {
        let (min, max) = (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]));
        (low..=high).filter(|pixel| (min..=max).contains(&(pixel * 256 + 128))).collect()
    }

    /// What is kept and what is set up, against one triangle and one sample at a time.
    #[test]
    fn sixteen_triangles_are_set_up_like_one() {
        let mut state = 7;
        let (mut kept_in_all, mut tiny_in_all, mut larger_in_all) = (0, 0, 0);
        for round in 0..900 {
            let count = 1 + dice(&mut state, 80) as usize;
            let all = triangles(&mut state, count);
            let faces = [Faces::Both, Faces::CounterClockwise][round % 2];
            let low = [0, 1].map(|_| dice(&mut state, 60));
            let high = [0, 1].map(|axis| low[axis] + dice(&mut state, 128));
            let mut room = Room::new();
            for (i, triangle) in all.iter().enumerate() {
                for (corner, [x, y]) in triangle.iter().enumerate() {
                    room.corners[corner][i] = (x | y << 16) as u32;
                }
            }
            let boxes = |triangle: &[[i32; 2]; 3]| {
                [0, 1].map(|axis| centres(triangle.map(|at| at[axis]), low[axis], high[axis]))
            };
            let kept = dispatch!(Level::new(), s => keep(s, &mut room, count, low, high));
            let holds = |&i: &usize| boxes(&all[i]).iter().all(|pixels| !pixels.is_empty());
            let expected: Vec<usize> = (0..count).filter(holds).collect();
            let numbers = room.kept[3][..kept].iter().map(|&i| i as usize);
            assert_eq!(numbers.collect::<Vec<_>>(), expected, "round {round}");
            kept_in_all += kept;
            for from in (0..kept).step_by(LANES) {
                let lanes = u64::MAX >> (64 - (kept - from).min(LANES));
                dispatch!(Level::new(), s => set_up(s, &mut room, from, lanes, faces, low, high));
                let set_up = &room.set_up;
                for lane in 0..LANES {
                    // Four bits, sixteen apart, and one.
                    let tiny = set_up.tiny >> lane & 0x0001_0001_0001_0001;
                    let larger = set_up.larger >> lane & 1;
                    let Some(&number) = expected.get(from + lane) else {
                        assert_eq!((tiny, larger), (0, 0), "no triangle is in lane {lane}");
                        continue;
                    };
                    let corners = all[number].map(|[x, y]| WindowVertex { x, y, z: 0.5 });
                    let Some(triangle) = Oriented::new(corners, faces) else {
                        assert_eq!((tiny, larger), (0, 0), "no area or no face: {corners:?}");
                        continue;
                    };
                    let [columns, rows] = boxes(&all[number]);
                    let first = [columns[0], rows[0]];
                    let ends = |i: usize| (triangle.v[(i + 1) % 3], triangle.v[(i + 2) % 3]);
                    let value = |i: usize, [x, y]: [i32; 2]| {
                        let (a, b) = ends(i);
                        edge(a, b, i64::from(x) * 256 + 128, i64::from(y) * 256 + 128)
                    };
                    let turned = triangle.v[1] != corners[1];
                    assert_eq!(set_up.turned >> lane & 1 == 1, turned, "{corners:?}");
                    assert_eq!([0, 1].map(|axis| set_up.first[axis][lane]), first);
                    let last = [0, 1].map(|axis| set_up.last[axis][lane]);
                    assert_eq!(
                        last,
                        [first[0] + columns.len() as i32 - 1, first[1] + rows.len() as i32 - 1]
                    );
                    for i in 0..3 {
                        let (a, b) = ends(i);
                        let at = i64::from(set_up.edges[i][lane]);
                        assert_eq!(at, value(i, first), "{corners:?}");
                        assert_eq!(set_up.bias[i][lane], i32::from(!top_left(a, b)), "{corners:?}");
                        let right = value(i, [first[0] + 1, first[1]]) - at;
                        let down = value(i, [first[0], first[1] + 1]) - at;
                        let steps = [set_up.right[i][lane], set_up.down[i][lane]].map(i64::from);
                        assert_eq!(steps, [right, down], "{corners:?}");
                    }
                    let is_tiny = columns.len() <= 2 && rows.len() <= 2;
                    assert_eq!(larger == 1, !is_tiny, "{corners:?}");
                    let covers = |which: i32| {
                        let at = [first[0] + (which & 1), first[1] + (which >> 1)];
                        let inside = (0..3).all(|i| {
                            let (a, b) = ends(i);
                            value(i, at) >= i64::from(!top_left(a, b))
                        });
                        is_tiny && columns.contains(&at[0]) && rows.contains(&at[1]) && inside
                    };
                    for which in 0..4 {
                        let bit = set_up.tiny >> (16 * which + lane as i32) & 1 == 1;
                        assert_eq!(bit, covers(which), "{corners:?} {which}");
                        tiny_in_all += usize::from(bit);
                    }
                    larger_in_all += usize::from(!is_tiny);
                }
            }
        }
        assert!(
            kept_in_all > 5000 && tiny_in_all > 500 && larger_in_all > 2000,
            "{kept_in_all} {tiny_in_all} {larger_in_all} prove little"
        );
    }
}
