//! Depth and draw indices of an image, as one ordered word a sample; its regions and blocks; and
//! questions about it.
//!
//! The samples lie region by region, a region row by row, so that a region fits the second level cache
//! and belongs to one thread at a time. For every block of a region the image keeps an upper bound of
//! its farthest depth (the hierarchy of Greene, Kass & Miller 1993, *Hierarchical Z-buffer
//! visibility*, with three levels: sample, block, region). Depths only fall between two clears, so a
//! bound that is not renewed stays a bound.

/// Pixels of an image; both sides at least 1 and at most [`Viewport::MAX_SIDE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Viewport {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}

impl Viewport {
    /// The longest side: the guard band must reach beyond it on both sides.
    pub const MAX_SIDE: u32 = 16_384;
}

/// Columns and rows of a region: 128 KiB of words.
pub(crate) const REGION: usize = 128;
/// Columns and rows of a block: a row of it is one cache line.
pub(crate) const BLOCK: usize = 8;
/// Blocks along a side of a region.
pub(crate) const BLOCKS: usize = REGION / BLOCK;

use crate::order::{DepthOrder, FARTHEST, Forward, Order, Reversed};

/// A sample without a fragment: the farthest depth and no draw index. Keys of depths order like the
/// numbers, so the smaller word is the nearer fragment, then the lower draw index. Keys reach at most
/// the bits of 1, so words are never negative and may be compared as signed numbers.
const CLEAR: i64 = (FARTHEST as i64) << 32;
/// A sample of a region that lies outside the image: nearer than everything, so it takes no fragment
/// and does not hold the farthest depth of its block back.
const OUTSIDE: i64 = 0;

/// A z-buffer with draw indices.
#[derive(Clone, Debug)]
pub struct Image {
    viewport: Viewport,
    order: DepthOrder,
    words: Vec<i64>,
    /// Per block, the key of a depth that none of its samples lies behind.
    far: Vec<u32>,
    /// Per block, whether `far` may be more than the farthest depth.
    stale: Vec<bool>,
}

/// One region of an image that is being drawn.
pub(crate) struct Region<'a> {
    /// Its first column and row in the image.
    pub(crate) origin: [i32; 2],
    /// Columns and rows of it that lie within the image, at least 1.
    pub(crate) size: [i32; 2],
    pub(crate) words: &'a mut [i64],
    pub(crate) far: &'a mut [u32],
    pub(crate) stale: &'a mut [bool],
}

impl PartialEq for Image {
    fn eq(&self, other: &Self) -> bool {
        (self.viewport, self.order) == (other.viewport, other.order) && self.words == other.words
    }
}

impl Eq for Image {}

impl Image {
    /// A cleared image whose depth runs forward.
    ///
    /// # Panics
    /// For a side of 0 or above [`Viewport::MAX_SIDE`].
    #[must_use]
    pub fn new(viewport: Viewport) -> Self {
        Self::ordered(viewport, DepthOrder::Forward)
    }

    /// A cleared image whose depth runs as told.
    ///
    /// # Panics
    /// For a side of 0 or above [`Viewport::MAX_SIDE`].
    #[must_use]
    pub fn ordered(viewport: Viewport, order: DepthOrder) -> Self {
        let Viewport { width, height } = viewport;
        let legal = 1..=Viewport::MAX_SIDE;
        assert!(legal.contains(&width) && legal.contains(&height), "{width}×{height} pixels");
        let regions = (width as usize).div_ceil(REGION) * (height as usize).div_ceil(REGION);
        let mut image = Self {
            viewport,
            order,
            words: vec![OUTSIDE; regions * REGION * REGION],
            far: vec![0; regions * BLOCKS * BLOCKS],
            stale: vec![false; regions * BLOCKS * BLOCKS],
        };
        image.clear();
        image
    }

    /// Its size.
    #[must_use]
    pub fn viewport(&self) -> Viewport {
        self.viewport
    }

    /// Which way its depth runs.
    #[must_use]
    pub fn order(&self) -> DepthOrder {
        self.order
    }

    /// Forgets every fragment.
    pub fn clear(&mut self) {
        self.regions().for_each(|mut region| region.clear());
    }

    /// The regions, row by row.
    pub(crate) fn regions(&mut self) -> impl Iterator<Item = Region<'_>> {
        let (width, height) = (self.viewport.width as usize, self.viewport.height as usize);
        let across = width.div_ceil(REGION);
        let words = self.words.chunks_exact_mut(REGION * REGION);
        let far = self.far.chunks_exact_mut(BLOCKS * BLOCKS);
        let stale = self.stale.chunks_exact_mut(BLOCKS * BLOCKS);
        words.zip(far).zip(stale).enumerate().map(move |(i, ((words, far), stale))| {
            let (x, y) = (i % across * REGION, i / across * REGION);
            let size = [(width - x).min(REGION) as i32, (height - y).min(REGION) as i32];
            Region { origin: [x as i32, y as i32], size, words, far, stale }
        })
    }

    /// How many samples it has.
    #[must_use]
    pub fn sample_count(&self) -> usize {
        self.viewport.width as usize * self.viewport.height as usize
    }

    fn place(&self, column: usize, row: usize) -> usize {
        let across = (self.viewport.width as usize).div_ceil(REGION);
        let region = row / REGION * across + column / REGION;
        (region * REGION + row % REGION) * REGION + column % REGION
    }

    /// Keeps the smaller of the stored word and `word`.
    pub(crate) fn lower(&mut self, column: usize, row: usize, word: u64) {
        let place = self.place(column, row);
        self.words[place] = self.words[place].min(word as i64);
        let (block_row, block) = (place / REGION / BLOCK, place % REGION / BLOCK);
        self.stale[block_row * BLOCKS + block] = true;
    }

    pub(crate) fn word_at(&self, column: usize, row: usize) -> u64 {
        self.words[self.place(column, row)] as u64
    }

    /// The word of a sample (row × width + column): the key of its depth ([`DepthOrder::key`]), then draw
    /// index plus one.
    #[must_use]
    pub fn word(&self, sample: usize) -> u64 {
        let width = self.viewport.width as usize;
        self.word_at(sample % width, sample / width)
    }

    /// All words (see [`Image::word`]), row by row from the top.
    pub fn words(&self) -> impl Iterator<Item = u64> + '_ {
        (0..self.viewport.height as usize)
            .flat_map(|row| self.pieces(row, 0, self.viewport.width as usize))
            .flatten()
            .map(|&word| word as u64)
    }

    /// Columns `from..to` of a row, cut where regions meet.
    fn pieces(&self, row: usize, from: usize, to: usize) -> impl Iterator<Item = &[i64]> {
        (from / REGION..to.div_ceil(REGION)).map(move |region| {
            let first = from.max(region * REGION);
            let last = to.min((region + 1) * REGION);
            let place = self.place(first, row);
            &self.words[place..place + (last - first)]
        })
    }

    /// Depth at a sample (row × width + column).
    #[must_use]
    pub fn depth(&self, sample: usize) -> f32 {
        self.depth_of(self.word(sample))
    }

    /// All depths, row by row.
    #[must_use]
    pub fn depths(&self) -> Vec<f32> {
        match self.order {
            DepthOrder::Forward => self.depths_ordered(Forward),
            DepthOrder::Reversed => self.depths_ordered(Reversed),
        }
    }

    fn depths_ordered<O: Order>(&self, _: O) -> Vec<f32> {
        let mut depths = Vec::with_capacity(self.sample_count());
        // Piece by piece and the order known: an iterator over single words costs twenty times as much.
        for row in 0..self.viewport.height as usize {
            for piece in self.pieces(row, 0, self.viewport.width as usize) {
                depths.extend(piece.iter().map(|&word| O::ORDER.depth((word as u64 >> 32) as u32)));
            }
        }
        depths
    }

    /// Draw index at a sample; `None` where nothing was drawn.
    #[must_use]
    pub fn draw_index(&self, sample: usize) -> Option<u32> {
        draw_index_of(self.word(sample))
    }

    /// All draw indices, row by row.
    pub fn draw_indices(&self) -> impl Iterator<Item = Option<u32>> + '_ {
        self.words().map(draw_index_of)
    }

    /// A hash of size and samples, the same everywhere: FNV-1a over whole words with a rotation, in four
    /// chains, each of every fourth word of a row of a region; one chain would wait for its multiplications.
    #[must_use]
    pub fn hash(&self) -> u64 {
        let step =
            |hash: u64, word: u64| (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(29);
        let size = u64::from(self.viewport.width) << 32 | u64::from(self.viewport.height);
        let mut chains = [0, 1, 2, 3].map(|chain| step(size ^ 0xcbf2_9ce4_8422_2325, chain));
        for row in 0..self.viewport.height as usize {
            for piece in self.pieces(row, 0, self.viewport.width as usize) {
                let (fours, rest) = piece.as_chunks::<4>();
                for four in fours {
                    for (chain, &word) in chains.iter_mut().zip(four) {
                        *chain = step(*chain, word as u64);
                    }
                }
                for (chain, &word) in chains.iter_mut().zip(rest) {
                    *chain = step(*chain, word as u64);
                }
            }
        }
        chains.into_iter().fold(size, step)
    }

    /// How many samples of the half-open rectangle have `depth` ≤ their own. Parts outside the image
    /// count nothing.
    #[must_use]
    pub fn count_rectangle(&self, min: [u32; 2], max: [u32; 2], depth: f32) -> u64 {
        self.near_blocks(min, max, self.order.key(depth))
            .map(|[x0, y0, x1, y1]| {
                let passes = |word: &&i64| depth <= self.depth_of(**word as u64);
                (y0..y1)
                    .flat_map(|row| self.pieces(row, x0, x1))
                    .map(|piece| piece.iter().filter(passes).count() as u64)
                    .sum::<u64>()
            })
            .sum()
    }

    /// Whether [`Image::count_rectangle`] is above zero.
    #[must_use]
    pub fn any_rectangle(&self, min: [u32; 2], max: [u32; 2], depth: f32) -> bool {
        self.near_blocks(min, max, self.order.key(depth)).any(|[x0, y0, x1, y1]| {
            (y0..y1)
                .flat_map(|row| self.pieces(row, x0, x1))
                .any(|piece| piece.iter().any(|&word| depth <= self.depth_of(word as u64)))
        })
    }

    /// The blocks that meet the half-open rectangle and are not wholly nearer than the depth of `near`, a key, each cut to
    /// the rectangle: first column and row, then the ends.
    pub(crate) fn near_blocks(
        &self,
        min: [u32; 2],
        max: [u32; 2],
        near: u32,
    ) -> impl Iterator<Item = [usize; 4]> {
        let Viewport { width, height } = self.viewport;
        let (x0, x1) = (min[0] as usize, max[0].min(width) as usize);
        let (y0, y1) = (min[1] as usize, max[1].min(height) as usize);
        let columns = if x0 < x1 { x0 / BLOCK..x1.div_ceil(BLOCK) } else { 0..0 };
        let rows = if y0 < y1 { y0 / BLOCK..y1.div_ceil(BLOCK) } else { 0..0 };
        rows.flat_map(move |row| columns.clone().map(move |column| (column * BLOCK, row * BLOCK)))
            .filter(move |&(x, y)| near <= self.far[self.block(x, y)])
            .map(move |(x, y)| [x0.max(x), y0.max(y), x1.min(x + BLOCK), y1.min(y + BLOCK)])
    }

    fn depth_of(&self, word: u64) -> f32 {
        self.order.depth((word >> 32) as u32)
    }

    fn block(&self, column: usize, row: usize) -> usize {
        let place = self.place(column, row);
        place / REGION / BLOCK * BLOCKS + place % REGION / BLOCK
    }

    /// Whether each block's bound holds, and is the farthest depth itself where it is not marked stale.
    #[must_use]
    pub fn bounds_hold(&self) -> bool {
        (0..self.far.len()).all(|block| {
            let (row, column) = (block / BLOCKS * BLOCK, block % BLOCKS * BLOCK);
            let place = |i: usize| (row + i / BLOCK) * REGION + column + i % BLOCK;
            let far = (0..BLOCK * BLOCK).map(|i| (self.words[place(i)] >> 32) as u32).max();
            let (far, bound) = (far.unwrap_or(0), self.far[block]);
            far == bound || (far < bound && self.stale[block])
        })
    }
}

impl Region<'_> {
    /// Forgets every fragment.
    pub(crate) fn clear(&mut self) {
        let [width, height] = self.size.map(|side| side as usize);
        for row in self.words.chunks_exact_mut(REGION).take(height) {
            row[..width].fill(CLEAR);
        }
        for (i, far) in self.far.iter_mut().enumerate() {
            let within = i % BLOCKS * BLOCK < width && i / BLOCKS * BLOCK < height;
            *far = if within { FARTHEST } else { 0 };
        }
        self.stale.fill(false);
    }
}

fn draw_index_of(word: u64) -> Option<u32> {
    (word as u32).checked_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two regions by two, none of them whole; depths fall from block to block.
    fn slope() -> Image {
        let mut image = Image::new(Viewport { width: 150, height: 140 });
        for (row, column) in (0..140).flat_map(|row| (0..150).map(move |column| (row, column))) {
            let depth = 1.0 - (row / BLOCK * 19 + column / BLOCK + 1) as f32 / 1024.0;
            image.lower(
                column,
                row,
                u64::from(depth.to_bits()) << 32 | (row * 150 + column) as u64,
            );
        }
        image
    }

    /// Every block's bound as the renderer leaves it: its farthest depth.
    fn bounded(mut image: Image) -> Image {
        for block in 0..image.far.len() {
            let (row, column) = (block / BLOCKS * BLOCK, block % BLOCKS * BLOCK);
            let words = (0..BLOCK).flat_map(|i| {
                let first = (row + i) * REGION + column;
                image.words[first..first + BLOCK].iter()
            });
            image.far[block] = words.map(|word| (word >> 32) as u32).max().unwrap_or(0);
            image.stale[block] = false;
        }
        image
    }

    /// Traces and golden files are compared by it; the numbers are from a few lines of Python.
    #[test]
    fn the_hash_is_the_written_one() {
        assert_eq!(slope().hash(), 13_016_616_300_424_054_292);
        assert_eq!(Image::new(Viewport { width: 3, height: 2 }).hash(), 11_438_543_860_063_376_956);
    }

    /// A bound below the farthest depth does not hold, one above it only where it is marked.
    #[test]
    fn bounds_hold_or_are_found_out() {
        let unmarked = bounded(slope());
        assert!(slope().bounds_hold() && unmarked.bounds_hold());
        for block in (0..unmarked.far.len()).filter(|&block| unmarked.far[block] > 0) {
            let with = |far: u32, stale: bool| {
                let mut image = unmarked.clone();
                (image.far[block], image.stale[block]) = (far, stale);
                image.bounds_hold()
            };
            let far = unmarked.far[block];
            assert!(with(far, true) && with(far + 1, true), "{block}");
            assert!(!with(far + 1, false), "{block} is marked as its farthest");
            assert!(!with(far - 1, true) && !with(far - 1, false), "{block} is farther");
        }
    }

    /// Each block is left out by its own bound, at whatever region it is.
    #[test]
    fn blocks_are_found_by_their_bounds() {
        let image = bounded(slope());
        for (row, column) in [(0, 0), (40, 64), (127, 127), (128, 5), (16, 128), (139, 149)] {
            let block = [column, row].map(|at: u32| at / BLOCK as u32 * BLOCK as u32);
            let end = [block[0] as usize + BLOCK, block[1] as usize + BLOCK];
            let depth = image.depth((row * 150 + column) as usize);
            let count = |depth: f32| {
                image
                    .near_blocks(block, [end[0] as u32, end[1] as u32], depth.to_bits())
                    .collect::<Vec<_>>()
            };
            let whole = [block[0] as usize, block[1] as usize, end[0].min(150), end[1].min(140)];
            assert_eq!(count(depth), [whole], "{row} {column}");
            assert_eq!(count(depth.next_up()).len(), 0, "{row} {column} is nearer than that");
        }
        // Nowhere, and beyond either end.
        assert_eq!(image.near_blocks([9, 9], [9, 20], 0).count(), 0);
        assert_eq!(image.near_blocks([9, 9], [20, 9], 0).count(), 0);
        assert_eq!(image.near_blocks([150, 0], [400, 400], 0).count(), 0);
    }
}
