//! The two ways to draw into a region: with vectors, and plainly, sample by sample. The plain way is
//! what runs where a machine has no vectors, and a second opinion in tests.

use fearless_simd::prelude::*;
use fearless_simd::{Simd, i64x8};

use super::narrow::{self, Job, Room, nearest};
use super::wide::{self, Edge, Wide};
use crate::image::{BLOCK, BLOCKS, REGION, Region};
use crate::order::Order;
use crate::window::depth;

/// What draws into a region.
pub(crate) trait Painter: Copy {
    /// Which way depth runs.
    type Order: Order;

    /// Draws a wide triangle into one block (column and row); whether it reached any sample.
    fn block(
        self,
        wide: &Wide,
        region: &mut Region<'_>,
        edges: &[Edge; 3],
        block: [usize; 2],
    ) -> bool;

    /// Draws a cluster whose place is narrow.
    fn cluster(self, job: &Job<'_>, region: &mut Region<'_>, room: &mut Room);

    /// Makes the bound of a block its farthest depth.
    fn renew(self, region: &mut Region<'_>, block: usize);
}

/// Many samples or triangles at a time.
#[derive(Clone, Copy)]
pub(crate) struct Vectors<S, O>(pub(crate) S, pub(crate) O);

impl<S: Simd, O: Order> Painter for Vectors<S, O> {
    type Order = O;

    #[inline(always)]
    fn block(
        self,
        wide: &Wide,
        region: &mut Region<'_>,
        edges: &[Edge; 3],
        block: [usize; 2],
    ) -> bool {
        wide::samples((self.0, self.1), wide, region, edges, block)
    }

    #[inline(always)]
    fn cluster(self, job: &Job<'_>, region: &mut Region<'_>, room: &mut Room) {
        narrow::draw(self.0, self.1, job, region, room);
    }

    #[inline(always)]
    fn renew(self, region: &mut Region<'_>, block: usize) {
        let first = block / BLOCKS * BLOCK * REGION + block % BLOCKS * BLOCK;
        let mut most = i64x8::splat(self.0, 0);
        for line in 0..BLOCK {
            let place = first + line * REGION;
            most = most.max(i64x8::from_slice(self.0, &region.words[place..place + BLOCK]));
        }
        region.far[block] = (most.reduce_max() >> 32) as u32;
        region.stale[block] = false;
    }
}

/// One sample at a time. Its frames hold no narrow clusters.
#[derive(Clone, Copy)]
pub(crate) struct Plain<O>(pub(crate) O);

impl<O: Order> Painter for Plain<O> {
    type Order = O;

    fn block(
        self,
        wide: &Wide,
        region: &mut Region<'_>,
        edges: &[Edge; 3],
        [column, row]: [usize; 2],
    ) -> bool {
        let z = wide.triangle.v.map(|v| v.z);
        let nearest = nearest(O::ORDER, z);
        let mut any = false;
        for i in 0..BLOCK * BLOCK {
            let [x, y] = [column * BLOCK + i % BLOCK, row * BLOCK + i / BLOCK];
            let at = [x as i64, y as i64];
            let stored = &mut region.words[y * REGION + x];
            if edges.iter().all(|edge| edge.at(at) >= 0) && nearest <= *stored {
                let e = [0, 1, 2].map(|i| edges[i].exact_at(at));
                let key = O::ORDER.key(depth(e, z, wide.triangle.area));
                *stored = (*stored).min(i64::from(key) << 32 | i64::from(wide.id));
                any = true;
            }
        }
        any
    }

    fn cluster(self, _: &Job<'_>, _: &mut Region<'_>, _: &mut Room) {
        unreachable!("a plain frame has wide clusters only");
    }

    fn renew(self, region: &mut Region<'_>, block: usize) {
        let first = block / BLOCKS * BLOCK * REGION + block % BLOCKS * BLOCK;
        let word = |i: usize| region.words[first + i / BLOCK * REGION + i % BLOCK];
        let most = (0..BLOCK * BLOCK).map(word).max().unwrap_or(0);
        region.far[block] = (most >> 32) as u32;
        region.stale[block] = false;
    }
}

/// For tests: what it was asked to draw and to renew.
#[cfg(test)]
pub(crate) mod recorder {
    use std::cell::RefCell;

    use super::*;
    use crate::order::Forward;

    /// Ids and blocks that were drawn, in their order, and blocks that were renewed.
    #[derive(Default)]
    pub(crate) struct Record {
        pub(crate) drawn: Vec<(u32, usize)>,
        pub(crate) renewed: Vec<usize>,
    }

    /// Draws nothing, and says of blocks in even columns that it reached a sample there.
    #[derive(Clone, Copy)]
    pub(crate) struct Recorder<'a>(pub(crate) &'a RefCell<Record>);

    impl Painter for Recorder<'_> {
        type Order = Forward;

        fn block(
            self,
            wide: &Wide,
            _: &mut Region<'_>,
            _: &[Edge; 3],
            [column, row]: [usize; 2],
        ) -> bool {
            self.0.borrow_mut().drawn.push((wide.id, row * BLOCKS + column));
            column.is_multiple_of(2)
        }

        fn cluster(self, _: &Job<'_>, _: &mut Region<'_>, _: &mut Room) {
            unreachable!("a plain frame has wide clusters only");
        }

        fn renew(self, _: &mut Region<'_>, block: usize) {
            self.0.borrow_mut().renewed.push(block);
        }
    }
}
