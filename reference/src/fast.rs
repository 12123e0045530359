//! The renderer that runs use: equal to `naive` bit for bit, parallel over draws, then over bands of
//! rows.
//!
//! # Why it is exact
//! 1. Set-up shares the transform, clipping, snapping and orientation with `naive`; each vertex is
//!    transformed once, which gives the same bits as three times.
//! 2. A triangle whose bounding box holds no sample covers none.
//! 3. Edge values are integers; stepping adds exact differences.
//! 4. A fragment is skipped before its depth is known only where the nearest vertex is strictly behind
//!    the stored depth. The f64 sum of non-negative terms errs by under 4·2⁻⁵³ relative, and rounding
//!    to f32 is monotone with the nearest vertex's depth as one of its values, so a fragment's depth is
//!    never below it.
//! 5. The image is a minimum over words, so neither order nor threads matter; a band has one owner.

use rayon::prelude::*;

use crate::clip::ClipVertex;
use crate::draw::Draw;
use crate::image::{Image, Viewport};
use crate::window::{Oriented, SUBPIXELS, Window, depth, edge, top_left};

/// Triangles set up before they are rasterized: bounds the memory to about 32 MiB.
const CHUNK_TRIANGLES: usize = 1 << 18;
/// Bands a thread, so that an uneven picture still keeps all threads busy.
const BANDS_PER_THREAD: usize = 4;
/// Triangles under which threads cost more than they save.
const SERIAL_TRIANGLES: usize = 512;

/// A triangle that covers at least the box of a sample.
#[derive(Clone, Copy, Debug)]
struct Ready {
    triangle: Oriented,
    id: u32,
    /// Inclusive columns and rows whose centres are within the bounding box and the image.
    columns: [i32; 2],
    rows: [i32; 2],
}

/// Draws everything into `image`, on as many threads as rayon has.
pub fn draw_all(image: &mut Image, draws: &[Draw<'_>]) {
    let viewport = image.viewport();
    let mut rest = draws;
    while !rest.is_empty() {
        let mut triangles = 0;
        let mut taken = 0;
        while taken < rest.len() && (taken == 0 || triangles < CHUNK_TRIANGLES) {
            triangles += rest[taken].triangles.len();
            taken += 1;
        }
        let (now, later) = rest.split_at(taken);
        rest = later;
        if triangles <= SERIAL_TRIANGLES {
            let mut ready = Vec::new();
            now.iter().for_each(|draw| set_up(viewport, draw, &mut ready));
            paint(image.samples_mut(), viewport, 0, &[ready]);
        } else {
            draw_chunk(image, now);
        }
    }
}

fn draw_chunk(image: &mut Image, draws: &[Draw<'_>]) {
    let viewport = image.viewport();
    let threads = rayon::current_num_threads();
    let grain = draws.len().div_ceil(threads * 8).max(1);
    let ready: Vec<Vec<Ready>> = draws
        .par_chunks(grain)
        .map(|some| {
            let mut ready = Vec::new();
            some.iter().for_each(|draw| set_up(viewport, draw, &mut ready));
            ready
        })
        .collect();
    let rows = (viewport.height as usize).div_ceil(threads * BANDS_PER_THREAD).max(1);
    image
        .samples_mut()
        .par_chunks_mut(rows * viewport.width as usize)
        .enumerate()
        .for_each(|(band, samples)| paint(samples, viewport, (band * rows) as i32, &ready));
}

/// How many fragments of `draw` have a depth less than or equal to the stored one; equal to
/// [`crate::naive::count`].
#[must_use]
pub fn count(image: &Image, draw: &Draw<'_>) -> u64 {
    let mut ready = Vec::new();
    set_up(image.viewport(), draw, &mut ready);
    let mut passed = 0;
    for one in &ready {
        let z = one.triangle.v.map(|v| v.z);
        walk(image.viewport(), one, one.rows, |sample, e| {
            passed += u64::from(depth(e, z, one.triangle.area) <= image.depth(sample));
        });
    }
    passed
}

/// Transforms, clips and snaps; keeps what may cover a sample.
fn set_up(viewport: Viewport, draw: &Draw<'_>, ready: &mut Vec<Ready>) {
    assert_eq!(draw.triangles.len(), draw.ranks.len(), "one rank a triangle");
    let window = Window::new(viewport);
    let clip: Vec<ClipVertex> =
        (0..draw.positions.len()).map(|vertex| draw.clip_vertex(vertex as u32)).collect();
    for (i, triangle) in draw.triangles.iter().enumerate() {
        let corners = triangle.map(|vertex| clip[vertex as usize]);
        // Wholly before the near plane: nothing would be left. NaN fails every comparison.
        if corners.iter().all(|c| c[2] < 0.0) {
            continue;
        }
        if let Some(polygon) = window.clipper.clip(corners) {
            let id = draw.stored_id(i);
            ready.extend(window.fan(&polygon).filter_map(|t| Ready::new(t, id, viewport)));
        }
    }
}

impl Ready {
    fn new(triangle: Oriented, id: u32, viewport: Viewport) -> Option<Self> {
        let half = SUBPIXELS as i32 / 2;
        let span = |a: i32, b: i32, c: i32, side: u32| {
            // First and last centre (column·256 + 128) within the box: ceiling and floor.
            let first = (a.min(b).min(c) - half + 255) >> 8;
            let last = (a.max(b).max(c) - half) >> 8;
            [first.max(0), last.min(side as i32 - 1)]
        };
        let [a, b, c] = triangle.v;
        let columns = span(a.x, b.x, c.x, viewport.width);
        let rows = span(a.y, b.y, c.y, viewport.height);
        (columns[0] <= columns[1] && rows[0] <= rows[1]).then_some(Self {
            triangle,
            id,
            columns,
            rows,
        })
    }
}

/// Rasterizes into a band of whole rows that begins at `first_row`.
fn paint(samples: &mut [u64], viewport: Viewport, first_row: i32, ready: &[Vec<Ready>]) {
    let width = viewport.width as usize;
    let last_row = first_row + (samples.len() / width) as i32 - 1;
    let offset = first_row as usize * width;
    for one in ready.iter().flatten() {
        let rows = [one.rows[0].max(first_row), one.rows[1].min(last_row)];
        if rows[0] > rows[1] {
            continue;
        }
        let z = one.triangle.v.map(|v| v.z);
        let nearest = u64::from(z[0].min(z[1]).min(z[2]).to_bits()) << 32;
        walk(viewport, one, rows, |sample, e| {
            let stored = &mut samples[sample - offset];
            if nearest <= *stored {
                let bits = depth(e, z, one.triangle.area).to_bits();
                *stored = (*stored).min(u64::from(bits) << 32 | u64::from(one.id));
            }
        });
    }
}

/// Calls `emit` with every covered sample of the rows and its edge values.
#[inline]
fn walk(viewport: Viewport, one: &Ready, rows: [i32; 2], mut emit: impl FnMut(usize, [i64; 3])) {
    let v = one.triangle.v;
    let opposite = |i: usize| (v[(i + 1) % 3], v[(i + 2) % 3]);
    let center = |pixel: i32| i64::from(pixel) * SUBPIXELS + SUBPIXELS / 2;
    let (x, y) = (center(one.columns[0]), center(rows[0]));
    // Samples on an edge that does not own them are pushed outside by one unit.
    let bias = [0, 1, 2].map(|i| i64::from(!top_left(opposite(i).0, opposite(i).1)));
    let mut row_start = [0, 1, 2].map(|i| edge(opposite(i).0, opposite(i).1, x, y) - bias[i]);
    let step = |along: &dyn Fn(usize) -> i64| [0, 1, 2].map(|i| along(i) * SUBPIXELS);
    let right = step(&|i| i64::from(opposite(i).0.y) - i64::from(opposite(i).1.y));
    let down = step(&|i| i64::from(opposite(i).1.x) - i64::from(opposite(i).0.x));
    for row in rows[0]..=rows[1] {
        let mut e = row_start;
        let start = row as usize * viewport.width as usize;
        let mut entered = false;
        for column in one.columns[0]..=one.columns[1] {
            if (e[0] | e[1] | e[2]) >= 0 {
                entered = true;
                let exact = [e[0] + bias[0], e[1] + bias[1], e[2] + bias[2]];
                emit(start + column as usize, exact);
            } else if entered {
                // Convex: a row is left once.
                break;
            }
            e = [e[0] + right[0], e[1] + right[1], e[2] + right[2]];
        }
        row_start = [row_start[0] + down[0], row_start[1] + down[1], row_start[2] + down[2]];
    }
}
