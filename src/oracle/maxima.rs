//! Maxima of a depth image on this side: rectangles are answered by tiles of 8 × 8 samples and blocks
//! of 64 × 64, sample by sample only where those leave it open. What `wgpu/pyramid.wgsl` is on the
//! device, for images that were read back (Greene, Kass & Miller 1993, section 3.2, with three levels).
//! It must not know devices.

use super::hierarchical_z::farther;

/// Samples along a tile, and tiles along a block.
const SIDE: usize = 8;

/// Farthest depths of tiles and blocks of an image.
#[derive(Debug, Default)]
pub(super) struct DepthMaxima {
    width: usize,
    height: usize,
    tiles: Vec<f32>,
    blocks: Vec<f32>,
    /// Room for the farthest depths of a column of a row of tiles.
    columns: Vec<f32>,
}

/// An image in memory: rows of `stride` samples, of which the first `width` count.
#[derive(Clone, Copy)]
pub(super) struct DepthRows<'a> {
    pub(super) samples: &'a [f32],
    pub(super) stride: usize,
    pub(super) width: usize,
    pub(super) height: usize,
}

impl DepthRows<'_> {
    fn row(&self, y: usize) -> &[f32] {
        &self.samples[y * self.stride..y * self.stride + self.width]
    }
}

fn farthest(depths: &[f32]) -> f32 {
    depths.iter().copied().fold(f32::NEG_INFINITY, farther)
}

impl DepthMaxima {
    /// Takes the maxima of an image, of any size.
    pub(super) fn renew(&mut self, image: DepthRows<'_>) {
        (self.width, self.height) = (image.width, image.height);
        self.tiles.clear();
        for top in (0..image.height).step_by(SIDE) {
            self.columns.clear();
            self.columns.extend_from_slice(image.row(top));
            for y in top + 1..(top + SIDE).min(image.height) {
                for (most, &depth) in self.columns.iter_mut().zip(image.row(y)) {
                    *most = farther(*most, depth);
                }
            }
            self.tiles.extend(self.columns.chunks(SIDE).map(farthest));
        }
        let across = self.width.div_ceil(SIDE);
        self.blocks.clear();
        for rows in self.tiles.chunks(across * SIDE) {
            for left in (0..across).step_by(SIDE) {
                let right = (left + SIDE).min(across);
                let most = rows.chunks(across).map(|row| farthest(&row[left..right]));
                self.blocks.push(most.fold(f32::NEG_INFINITY, farther));
            }
        }
    }

    /// Whether every tile and block has the farthest depth of its samples, and there is one for each.
    ///
    /// # Errors
    /// The first that has not, or how many there are.
    pub(super) fn check(&self, image: DepthRows<'_>) -> Result<(), String> {
        for (what, side, table) in
            [("tile", SIDE, &self.tiles), ("block", SIDE * SIDE, &self.blocks)]
        {
            let across = image.width.div_ceil(side);
            let mut most = vec![f32::NEG_INFINITY; across * image.height.div_ceil(side)];
            for y in 0..image.height {
                for (x, &depth) in image.row(y).iter().enumerate() {
                    let place = &mut most[y / side * across + x / side];
                    *place = farther(*place, depth);
                }
            }
            if *table != most {
                let place = most.iter().zip(table).position(|(most, has)| most != has);
                let place = place.unwrap_or(most.len().min(table.len()));
                return Err(format!("{what} {place} has not the farthest depth of its samples"));
            }
        }
        Ok(())
    }

    /// Whether any sample of columns `min[0]..max[0]`, rows `min[1]..max[1]` is at or beyond `depth`:
    /// what an occlusion query that compares less-or-equal says of a rectangle at that depth.
    pub(super) fn any(
        &self,
        image: DepthRows<'_>,
        min: [u32; 2],
        max: [u32; 2],
        depth: f32,
    ) -> bool {
        debug_assert_eq!((self.width, self.height), (image.width, image.height));
        let (min, max) = (min.map(|c| c as usize), max.map(|c| c as usize));
        let (block, across) = (SIDE * SIDE, self.width.div_ceil(SIDE));
        let blocks = across.div_ceil(SIDE);
        let within = |left: usize, top: usize, side: usize| {
            min[0] <= left && min[1] <= top && left + side <= max[0] && top + side <= max[1]
        };
        let tile = |x: usize, y: usize| {
            if self.tiles[y * across + x] < depth {
                return false;
            }
            let columns = (x * SIDE).max(min[0])..(x * SIDE + SIDE).min(max[0]);
            within(x * SIDE, y * SIDE, SIDE)
                || ((y * SIDE).max(min[1])..(y * SIDE + SIDE).min(max[1]))
                    .any(|row| image.row(row)[columns.clone()].iter().any(|&d| d >= depth))
        };
        let tiles_of = |low: usize, high: usize, block_number: usize| {
            (low / SIDE).max(block_number * SIDE)
                ..high.div_ceil(SIDE).min(block_number * SIDE + SIDE)
        };
        (min[1] / block..max[1].div_ceil(block)).any(|by| {
            (min[0] / block..max[0].div_ceil(block)).any(|bx| {
                self.blocks[by * blocks + bx] >= depth
                    && (within(bx * block, by * block, block)
                        || tiles_of(min[1], max[1], by)
                            .any(|y| tiles_of(min[0], max[0], bx).any(|x| tile(x, y))))
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Sides of an image, those at and beside the sides of tiles, blocks and levels as often as all others.
    fn sides() -> impl Strategy<Value = usize> {
        prop_oneof![1_usize..150, proptest::sample::select(&[1, 7, 8, 9, 63, 64, 65, 128, 129][..])]
    }

    /// Places along a side, the first and the last as often as all others.
    fn places() -> impl Strategy<Value = usize> {
        prop_oneof![0_usize..150, Just(0), Just(usize::MAX)]
    }

    /// Shares of a side, its ends as often as all others.
    fn share() -> impl Strategy<Value = f64> {
        prop_oneof![0.0..1.0_f64, Just(0.0), Just(1.0)]
    }

    proptest! {
        /// Equal to looking at every sample, whatever the size, the padding and the rectangle.
        #[test]
        fn equals_looking_at_every_sample(
            width in sides(),
            height in sides(),
            padding in 0_usize..3,
            far in proptest::collection::vec((places(), places(), 0_u8..4), 0..6),
            corners in [share(), share(), share(), share()],
            depth in 0_u8..=4,
            reversed in proptest::bool::ANY,
        ) {
            let stride = width + padding;
            // Of forward depth, or of reversed depth as it is kept.
            let least = if reversed { -1.0 } else { 0.0 };
            // What pads a row must not count.
            let mut samples = vec![1.0; stride * height];
            for y in 0..height {
                samples[y * stride..y * stride + width].fill(least);
            }
            for (x, y, d) in far {
                samples[y.min(height - 1) * stride + x.min(width - 1)] = f32::from(d) / 4.0 + least;
            }
            let image = DepthRows { samples: &samples, stride, width, height };
            let span = |a: f64, b: f64, side: usize| {
                let low = ((a.min(b) * side as f64) as u32).min(side as u32 - 1);
                (low, ((a.max(b) * side as f64) as u32).max(low + 1))
            };
            let ((x0, x1), (y0, y1)) =
                (span(corners[0], corners[1], width), span(corners[2], corners[3], height));
            let depth = f32::from(depth) / 4.0 + least;
            let plain = (y0..y1)
                .any(|y| image.row(y as usize)[x0 as usize..x1 as usize].iter().any(|&d| d >= depth));
            let mut maxima = DepthMaxima::default();
            maxima.renew(image);
            prop_assert_eq!(maxima.any(image, [x0, y0], [x1, y1], depth), plain);
        }
    }
}
