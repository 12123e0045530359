//! One region of the image: everything that may show in it, front to back.

use super::bound::Place;
use super::frame::{Frame, Unit};
use super::narrow::{Job, Room};
use super::painter::Painter;
use super::{Work, wide};
use crate::image::{BLOCK, BLOCKS, REGION, Region};
use crate::order::Order;

/// Marks a triangle among the items of a unit; without it an item is a cluster.
const WIDE: u32 = 1 << 31;

/// Draws the units, whose keys (nearest depth, then number) are sorted, into the region.
#[inline(always)]
pub(crate) fn draw<P: Painter>(
    painter: P,
    frame: &Frame<'_>,
    keys: &[u64],
    region: &mut Region<'_>,
    room: &mut Room,
) -> Work {
    let mut work = Work::default();
    let mut items = Vec::new();
    let mut deepest = region.deepest();
    for &key in keys {
        let unit = &frame.units[key as u32 as usize];
        if frame.skips
            && (unit.near > deepest || region.hidden(painter, unit.min, unit.max, unit.near))
        {
            work.units_hidden += 1;
            continue;
        }
        items.clear();
        list::<P>(frame, unit, region, &mut items);
        items.sort_unstable();
        for &item in &items {
            let near = (item >> 32) as u32;
            let number = item as u32;
            if number & WIDE != 0 {
                let triangle = &frame.wide(unit)[(number & !WIDE) as usize];
                if near <= deepest {
                    wide::draw(painter, triangle, region);
                    deepest = region.deepest();
                }
                continue;
            }
            let Place::Narrow { min, max, near } = frame.places(unit)[number as usize] else {
                continue;
            };
            if frame.skips && (near > deepest || region.hidden(painter, min, max, near)) {
                work.clusters_hidden += 1;
                continue;
            }
            let instance = &frame.instances[unit.instance as usize];
            let cluster = instance.mesh.clusters[unit.first_cluster as usize + number as usize];
            work.clusters += 1;
            work.triangles += u64::from(cluster.triangles);
            let min = min.map(i32::from);
            let job = Job {
                instance,
                view: instance.mesh.view(cluster),
                vertices: usize::from(cluster.vertices),
                triangles: usize::from(cluster.triangles),
                half: frame.half,
                min,
            };
            painter.cluster(&job, region, room);
        }
        deepest = region.deepest();
    }
    region.renew_all(painter);
    work
}

/// Clusters and triangles of the unit that may show in the region, by nearest depth.
fn list<P: Painter>(frame: &Frame<'_>, unit: &Unit, region: &Region<'_>, items: &mut Vec<u64>) {
    let meets = |min: [i16; 2], max: [i16; 2]| {
        (0..2).all(|axis| {
            i32::from(max[axis]) >= region.origin[axis]
                && i32::from(min[axis]) < region.origin[axis] + region.size[axis]
        })
    };
    for (i, place) in frame.places(unit).iter().enumerate() {
        if let Place::Narrow { min, max, near } = *place
            && meets(min, max)
        {
            items.push(u64::from(near) << 32 | i as u64);
        }
    }
    for (i, wide) in frame.wide(unit).iter().enumerate() {
        if meets(wide.min, wide.max) {
            items.push(u64::from(wide.near(P::Order::ORDER)) << 32 | u64::from(WIDE) | i as u64);
        }
    }
}

impl Region<'_> {
    /// The key of a depth that no sample lies behind.
    #[inline(always)]
    fn deepest(&self) -> u32 {
        self.far.iter().copied().fold(0, u32::max)
    }

    #[inline(always)]
    fn renew_all<P: Painter>(&mut self, painter: P) {
        for block in 0..BLOCKS * BLOCKS {
            if self.stale[block] {
                painter.renew(self, block);
            }
        }
    }

    /// Whether nothing at depth `near` or behind shows on the pixels from `min` to `max`.
    #[inline(always)]
    fn hidden<P: Painter>(&mut self, painter: P, min: [i16; 2], max: [i16; 2], near: u32) -> bool {
        let block = |axis: usize, pixel: i16| {
            (i32::from(pixel) - self.origin[axis]).clamp(0, REGION as i32 - 1) as usize / BLOCK
        };
        let (x0, x1) = (block(0, min[0]), block(0, max[0]));
        let (y0, y1) = (block(1, min[1]), block(1, max[1]));
        for row in y0..=y1 {
            for block in row * BLOCKS + x0..=row * BLOCKS + x1 {
                if near <= self.far[block] {
                    if !self.stale[block] {
                        return false;
                    }
                    painter.renew(self, block);
                    if near <= self.far[block] {
                        return false;
                    }
                }
            }
        }
        true
    }
}
