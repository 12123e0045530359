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

#[cfg(test)]
mod tests {
    use std::cell::RefCell;

    use super::*;
    use crate::draw::Faces;
    use crate::fast::painter::recorder::{Record, Recorder};
    use crate::fast::{self, Instance, Mesh, Options};
    use crate::image::{Image, Viewport};
    use crate::order::DepthOrder;

    const IDENTITY: [f32; 16] =
        [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
    /// Two regions by two, none of them whole.
    const VIEWPORT: Viewport = Viewport { width: 200, height: 150 };

    /// A square of two triangles over ±`size`, at one depth.
    fn square(size: f32, z: f32) -> Vec<[f32; 3]> {
        [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]: [f32; 2]| [x * size, y * size, z])
            .to_vec()
    }

    /// A mesh of squares one after the other; triangle i has rank i.
    fn mesh(squares: &[(f32, f32)]) -> Mesh {
        let positions: Vec<[f32; 3]> =
            squares.iter().flat_map(|&(size, z)| square(size, z)).collect();
        let count = positions.len() as u32 / 3;
        let triangles: Vec<[u32; 3]> = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Mesh::new(&positions, &triangles, &(0..count).collect::<Vec<_>>())
    }

    /// A unit that begins exactly at the farthest depth there is may still win ties.
    #[test]
    fn a_tie_with_the_farthest_is_drawn() {
        let mesh = mesh(&[(1.0, 0.5)]);
        let mut image = Image::new(VIEWPORT);
        for first in [10, 0] {
            let instance = Instance::new(&mesh, first, IDENTITY, Faces::Both);
            fast::draw(&mut image, &[instance], Options::default());
        }
        assert!(image.draw_indices().all(|draw| draw.is_some_and(|draw| draw < 2)));
    }

    /// Bounds are the farthest depths when all is drawn, whatever was drawn there.
    #[test]
    fn no_bound_is_stale_after_drawing() {
        // Large triangles, and small ones in clusters of many.
        let mesh = mesh(&[(1.0, 0.7), (0.9, 0.5), (0.03, 0.2), (0.02, 0.3), (0.4, 0.4)]);
        let small = {
            let mut m = IDENTITY;
            (m[0], m[5]) = (0.1, 0.1);
            m
        };
        for place in [[0.0, 0.0], [0.8, 0.9], [-0.9, 0.3], [0.3, -0.95]] {
            let mut moved = small;
            (moved[12], moved[13]) = (place[0], place[1]);
            let of = |m: [f32; 16], first: u32| Instance::new(&mesh, first, m, Faces::Both);
            let mut image = Image::new(VIEWPORT);
            let work =
                fast::render(&mut image, &[of(moved, 0), of(IDENTITY, 20)], Options::default());
            assert!(work.clusters > 0, "{work:?}");
            assert!(image.bounds_hold());
            assert!(image.regions().all(|region| region.stale.iter().all(|&stale| !stale)));
        }
    }

    /// Units by their nearest depth, triangles of a unit by theirs.
    #[test]
    fn what_is_nearer_comes_first() {
        let (far, near) =
            (mesh(&[(1.0, 0.9), (0.8, 0.6), (0.9, 0.7)]), mesh(&[(0.95, 0.5), (0.97, 0.1)]));
        let instances = [
            Instance::new(&far, 0, IDENTITY, Faces::Both),
            Instance::new(&near, 10, IDENTITY, Faces::Both),
        ];
        let names = fast::frame::names(&instances);
        let target = (VIEWPORT, DepthOrder::Forward);
        let (frame, _) = Frame::new(None, target, &instances, &names, true);
        let mut image = Image::new(VIEWPORT);
        let keys = frame.regions(VIEWPORT);
        let recorded = RefCell::new(Record::default());
        for (mut region, mut keys) in image.regions().zip(keys) {
            recorded.borrow_mut().drawn.clear();
            keys.sort_unstable();
            draw(Recorder(&recorded), &frame, &keys, &mut region, &mut Room::new());
            let mut squares: Vec<u32> =
                recorded.borrow().drawn.iter().map(|&(id, _)| (id - 1) / 2).collect();
            squares.dedup();
            // Of the near mesh 0.1 and 0.5, of the far one 0.6, 0.7 and 0.9; two triangles each.
            assert_eq!(squares, [6, 5, 1, 2, 0], "{:?}", region.origin);
        }
    }
}
