//! The renderer that runs use: equal to [`crate::naive`] bit for bit.

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

/// Draws the instances into what `image` holds, on as many threads as rayon has.
pub fn draw(image: &mut Image, instances: &[Instance<'_>], options: Options) -> Work {
    paint(image, instances, options, false)
}

/// Clears `image` and draws the instances; quicker than the two one after the other.
pub fn render(image: &mut Image, instances: &[Instance<'_>], options: Options) -> Work {
    paint(image, instances, options, true)
}

/// Units that go through the plain painter together: at most a million triangles, 64 bytes each.
const PLAIN_UNITS: usize = 200;

fn paint(image: &mut Image, instances: &[Instance<'_>], options: Options, clears: bool) -> Work {
    let level = options.level.or_below();
    let names = frame::names(instances);
    let Some(level) = level else {
        if clears {
            image.clear();
        }
        let parts = names.chunks(PLAIN_UNITS).map(|names| {
            let (frame, work) =
                Frame::new(None, image.viewport(), instances, names, options.skip_hidden);
            let draw = |keys: &[u64], region: &mut Region<'_>, room: &mut Room| {
                region::draw(Plain, &frame, keys, region, room)
            };
            work + each_region(image, &frame, false, draw)
        });
        return parts.fold(Work::default(), Add::add);
    };
    let (frame, work) =
        Frame::new(Some(level), image.viewport(), instances, &names, options.skip_hidden);
    let draw = |keys: &[u64], region: &mut Region<'_>, room: &mut Room| dispatch!(level, s => region::draw(Vectors(s), &frame, keys, region, room));
    work + each_region(image, &frame, clears, draw)
}

/// Calls `draw` for each region that something may show in, on all threads, with the sorted keys of
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
    let drawn: Vec<Work> = regions
        .par_iter_mut()
        .with_max_len(1)
        .map_init(Room::new, |room, (region, keys)| {
            if clears {
                region.clear();
            }
            keys.sort_unstable();
            if keys.is_empty() { Work::default() } else { draw(keys, region, room) }
        })
        .collect();
    drawn.into_iter().fold(Work::default(), Add::add)
}
