//! The renderer that runs use: equal to [`crate::naive`] bit for bit, at every SIMD level, on any number
//! of threads.
//!
//! # How it works
//! A [`Mesh`] is sorted once into *clusters* of up to 80 neighbouring triangles with at most 64 vertices.
//! For a frame all boxes of clusters are projected, sixteen at a time (`bound`). A *narrow* cluster is
//! small on the screen and wholly before the eye; the triangles of the others, *wide* ones, are
//! transformed, clipped and snapped one by one (`frame`). The image is cut into regions of 128 × 128
//! samples that fit the second level cache; each belongs to one thread at a time and takes whatever may
//! show in it, front to back (`region`). Small triangles go through vectors of sixteen triangles
//! (`narrow`), large ones block by block of 8 × 8 samples (`wide`). For each block the image keeps a
//! bound of its farthest depth; clusters, triangles and blocks behind it are left out (Greene, Kass &
//! Miller 1993, *Hierarchical Z-buffer visibility*; the order front to back is theirs too). Regions
//! owned by threads are the sort-first case of Molnar, Cox, Ellsworth & Fuchs 1994, *A sorting
//! classification of parallel rendering*.
//!
//! # Why it is exact
//! 1. **Order does not matter.** The image is the minimum of (depth, draw index) at each sample over all
//!    fragments, and a minimum takes its operands in any order. So neither sorting, nor threads, nor
//!    regions, nor drawing a fragment twice (in the column that two vectors share) moves a bit.
//! 2. **The same operations.** Vectors run the written operations of the transform, the division, the
//!    scaling and the snapping, unfused and in the written order; each is one IEEE operation a lane. A
//!    cluster's own copy of a vertex has the same bits as the mesh's, so it is snapped to the same place.
//! 3. **Narrow clusters need no clipping.** `bound` proves for each of them that no vertex is beyond near
//!    or far, that w is positive and that all lie on at most 120 × 120 pixels that meet the image, well
//!    within the guard band: the clipper would hand their triangles back untouched.
//! 4. **Edge values are whole numbers** that fit their type: within a narrow cluster i32 (`bound`,
//!    `NARROW_PIXELS`), else i64. Blocks test signs on ⌊(e − bias) / 256⌋, which has the sign of e − bias,
//!    because samples step by whole multiples of 256; where that does not fit i32 it is clamped to a
//!    value that keeps its sign all over the block (`wide`, `SATURATED`).
//! 5. **Depth is the written expression** on the same exact edge values; they are below 2⁵³, so f64
//!    holds them, however they were added up. Exchanged vertices 1 and 2 are exchanged in both renderers.
//! 6. **A triangle whose box holds no sample covers none**, and of the tiny boxes of up to 2 × 2 samples
//!    all four are tested.
//! 7. **What is left out is strictly behind.** A fragment's depth is never below its nearest vertex': the
//!    f64 sum of terms of one sign errs by less than 4·2⁻⁵³ of itself, and rounding to f32 is monotone
//!    with that vertex' depth among its values. A cluster's bound is below all depths of its vertices
//!    (`bound`), a block's bound below the plane of the triangle by the plane's error and compared with
//!    the next f32 after the stored depth (`wide`). All are compared with *less*, never *less or equal*,
//!    so a tie still meets the draw index. Bounds of blocks are never too near: depths only fall.
//! 8. **Scalar** is a way of its own, `Plain`: all clusters are wide and samples are tested one by one.

/// The three values of an expression for `i` = 0, 1, 2. An array's `map` and `from_fn` are calls, and a
/// call to a function compiled without the vector instructions passes vectors through memory.
macro_rules! three {
    ($i:ident => $value:expr) => {
        [
            {
                let $i = 0_usize;
                $value
            },
            {
                let $i = 1_usize;
                $value
            },
            {
                let $i = 2_usize;
                $value
            },
        ]
    };
}

/// A closure as it is: the place where stable Rust lets a closure be marked for inlining, which it must
/// be for the reason of [`three`].
#[inline(always)]
fn inlined<F>(closure: F) -> F {
    closure
}

mod bound;
mod count;
mod frame;
mod level;
mod lookup;
mod mesh;
mod narrow;
mod painter;
mod region;
mod wide;

use std::ops::Add;

use fearless_simd::dispatch;
use rayon::prelude::*;

pub use count::{any, count};
pub use level::SimdLevel;
pub use mesh::Mesh;

use crate::draw::Faces;
use crate::image::{Image, Region};
use crate::order::{DepthOrder, Forward, Order, Reversed};
use frame::Frame;
use narrow::Room;
use painter::{Plain, Vectors};

/// A mesh somewhere.
#[derive(Clone, Copy, Debug)]
pub struct Instance<'a> {
    mesh: &'a Mesh,
    first_draw: u32,
    clip_from_object: [f32; 16],
    faces: Faces,
}

impl<'a> Instance<'a> {
    /// `mesh` under an object-to-clip matrix (column-major). The draw index of triangle `i` is
    /// `first_draw` plus its rank.
    ///
    /// # Panics
    /// Where a draw index reaches `u32::MAX`.
    #[must_use]
    pub fn new(mesh: &'a Mesh, first_draw: u32, clip_from_object: [f32; 16], faces: Faces) -> Self {
        let highest = first_draw.checked_add(mesh.highest_rank());
        assert!(highest.is_some_and(|draw| draw < u32::MAX), "a draw index fits 32 bits");
        Self { mesh, first_draw, clip_from_object, faces }
    }
}

/// How to draw. No knob moves a bit of the image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Vector instructions; a level that the machine lacks falls back to the best one below it.
    pub level: SimdLevel,
    /// Whether clusters strictly behind what is already drawn are left out before their vertices are
    /// touched. Off, every triangle in view is processed.
    pub skip_hidden: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { level: SimdLevel::best(), skip_hidden: true }
    }
}

/// What one call did. The same for any number of threads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Groups of up to 64 clusters.
    pub units: u64,
    /// Units found behind, counted in each region that they may touch.
    pub units_hidden: u64,
    /// Clusters outside the view.
    pub clusters_outside: u64,
    /// Clusters small on the screen and wholly before the eye.
    pub clusters_narrow: u64,
    /// All others: their triangles are set up one by one.
    pub clusters_wide: u64,
    /// Small clusters drawn, counted in each region that they touch.
    pub clusters: u64,
    /// Small clusters found behind, counted in each region that they touch.
    pub clusters_hidden: u64,
    /// Triangles transformed and set up, counted in each region where that happened.
    pub triangles: u64,
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            units: self.units + other.units,
            units_hidden: self.units_hidden + other.units_hidden,
            clusters_outside: self.clusters_outside + other.clusters_outside,
            clusters_narrow: self.clusters_narrow + other.clusters_narrow,
            clusters_wide: self.clusters_wide + other.clusters_wide,
            clusters: self.clusters + other.clusters,
            clusters_hidden: self.clusters_hidden + other.clusters_hidden,
            triangles: self.triangles + other.triangles,
        }
    }
}

/// Draws the instances into what `image` holds, on as many threads as rayon has, or on the caller's alone
/// where there is little to draw. Takes 16 bytes for each cluster, 64 for each triangle of a cluster that is
/// large on the screen or not wholly before the eye, and 8 for each region that some 5,000 triangles touch,
/// until it returns.
pub fn draw(image: &mut Image, instances: &[Instance<'_>], options: Options) -> Work {
    paint(image, instances, options, false)
}

/// Clears `image` and draws the instances; quicker than the two one after the other.
pub fn render(image: &mut Image, instances: &[Instance<'_>], options: Options) -> Work {
    paint(image, instances, options, true)
}

/// A picture of up to so many regions and clusters is drawn by the thread that asks for it. To wake another,
/// to wait for it and to let it look for more work took longer: a run of small scenes over every index took
/// 27 s instead of 44 on two cores, where 30 of 65 seconds of processor time had been the system's. Clusters
/// up to 1,024 made no difference there; up to 4 regions were too few, those scenes have 6.
const ALONE_REGIONS: usize = 8;
const ALONE_CLUSTERS: usize = 64;

/// Units that go through the plain painter together: at most a million triangles, 64 bytes each.
const PLAIN_UNITS: usize = 200;

fn paint(image: &mut Image, instances: &[Instance<'_>], options: Options, clears: bool) -> Work {
    match image.order() {
        DepthOrder::Forward => paint_ordered(Forward, image, instances, options, clears),
        DepthOrder::Reversed => paint_ordered(Reversed, image, instances, options, clears),
    }
}

fn paint_ordered<O: Order>(
    order: O,
    image: &mut Image,
    instances: &[Instance<'_>],
    options: Options,
    clears: bool,
) -> Work {
    let (names, target) = (frame::names(instances), (image.viewport(), O::ORDER));
    let Some(level) = options.level.or_below() else {
        if clears {
            image.clear();
        }
        let parts = names.chunks(PLAIN_UNITS).map(|names| {
            let (frame, work) = Frame::new(None, target, instances, names, options.skip_hidden);
            let draw = |keys: &[u64], region: &mut Region<'_>, room: &mut Room| {
                region::draw(Plain(order), &frame, keys, region, room)
            };
            work + each_region(image, &frame, false, draw)
        });
        return parts.fold(Work::default(), Add::add);
    };
    let (frame, work) = Frame::new(Some(level), target, instances, &names, options.skip_hidden);
    let draw = |keys: &[u64], region: &mut Region<'_>, room: &mut Room| dispatch!(level, s => region::draw(Vectors(s, order), &frame, keys, region, room));
    work + each_region(image, &frame, clears, draw)
}

/// Calls `draw` for each region that something may show in, on all threads or on this one, with the sorted keys of
/// its units.
fn each_region(
    image: &mut Image,
    frame: &Frame<'_>,
    clears: bool,
    draw: impl Fn(&[u64], &mut Region<'_>, &mut Room) -> Work + Sync,
) -> Work {
    let keys = frame.regions(image.viewport());
    let mut regions: Vec<(Region<'_>, Vec<u64>)> = image.regions().zip(keys).collect();
    // The fullest first, so that no thread is left with one at the end.
    regions.sort_by_key(|(region, keys)| (std::cmp::Reverse(keys.len()), region.origin));
    let one = |room: &mut Room, (region, keys): &mut (Region<'_>, Vec<u64>)| {
        if clears {
            region.clear();
        }
        keys.sort_unstable();
        if keys.is_empty() { Work::default() } else { draw(keys, region, room) }
    };
    let drawn: Vec<Work> = if regions.len() <= ALONE_REGIONS && frame.clusters() <= ALONE_CLUSTERS {
        let mut room = Room::new();
        regions.iter_mut().map(|region| one(&mut room, region)).collect()
    } else {
        regions.par_iter_mut().with_max_len(1).map_init(Room::new, one).collect()
    };
    drawn.into_iter().fold(Work::default(), Add::add)
}
