//! Ties: how near a proxy's depth comes to a depth buffer's. At a tie one unit of rounding decides between
//! "visible" and "hidden"; far from any, two answers to one question cannot both come of rounding.

use plainsight_reference::{Draw, Faces, Image, naive};

use super::Proxy;
use super::proxy_mesh::box_triangles;

/// Where a proxy comes nearest to a depth buffer, over the samples of its rectangle; of a box over the
/// samples that it covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// First column and row of the rectangle around the proxy, and one beyond its last.
    pub rectangle: [[u32; 2]; 2],
    /// The proxy's depth; of a box the nearest.
    pub depth: f32,
    /// The least difference of the proxy's depth and the buffer's.
    pub distance: f64,
    /// How many steps between neighbouring numbers of the depth's format that is.
    pub ulps: u32,
    /// Column and row of the first sample where it is so.
    pub pixel: [u32; 2],
}

impl Proxy {
    /// Where it comes nearest to the depth in `image`; `None` where it covers no sample.
    ///
    /// # Panics
    /// For a rectangle beyond the image.
    #[must_use]
    pub fn nearest_tie(&self, image: &Image) -> Option<Tie> {
        let width = image.viewport().width;
        let (samples, rectangle): (Vec<([u32; 2], f32)>, _) = match *self {
            Self::Rectangle { min, max, depth } | Self::Hull { min, max, depth, .. } => {
                let rows = min[1]..max[1];
                let samples = rows.flat_map(|y| (min[0]..max[0]).map(move |x| ([x, y], depth)));
                (samples.collect(), [min, max])
            }
            Self::Box { clip_from_box, min, max } => {
                let (positions, triangles) = box_triangles(min, max);
                let mut own = Image::ordered(image.viewport(), image.order());
                let ranks: Vec<u32> = (0..).take(triangles.len()).collect();
                naive::draw(
                    &mut own,
                    &Draw {
                        positions: &positions,
                        triangles: &triangles,
                        ranks: &ranks,
                        first_draw: 0,
                        clip_from_object: clip_from_box,
                        faces: Faces::Both,
                    },
                );
                let covered = |sample: &usize| own.draw_index(*sample).is_some();
                let sample = |sample: usize| {
                    ([sample as u32 % width, sample as u32 / width], own.depth(sample))
                };
                let samples: Vec<_> = (0..own.sample_count()).filter(covered).map(sample).collect();
                let [x, y] = [0, 1].map(|axis| samples.iter().map(move |(at, _)| at[axis]));
                let least = [x.clone().min()?, y.clone().min()?];
                let most = [x.max()? + 1, y.max()? + 1];
                (samples, [least, most])
            }
        };
        let key = |depth: f32| image.order().key(depth);
        let stored = |[x, y]: [u32; 2]| image.depth((y * width + x) as usize);
        let ulps = |&(at, depth): &([u32; 2], f32)| key(depth).abs_diff(key(stored(at)));
        let least = samples.iter().min_by_key(|sample| ulps(sample))?;
        let (pixel, own) = *least;
        Some(Tie {
            rectangle,
            depth: samples.iter().map(|&(_, depth)| depth).min_by_key(|&depth| key(depth))?,
            distance: (f64::from(own) - f64::from(stored(pixel))).abs(),
            ulps: ulps(least),
            pixel,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{DepthOrder, Viewport};

    /// Half way between the planes.
    fn middle(order: DepthOrder) -> f32 {
        let [near, far] = order.range();
        (near + far) / 2.0
    }

    /// An image with the middle depth over its left half, and nothing over the right.
    fn half(order: DepthOrder) -> Image {
        let mut image = Image::ordered(Viewport { width: 8, height: 4 }, order);
        let z = middle(order);
        let positions = [[-1.0, -1.0, z], [0.0, -1.0, z], [-1.0, 1.0, z], [0.0, 1.0, z]];
        naive::draw(
            &mut image,
            &Draw {
                positions: &positions,
                triangles: &[[0, 1, 2], [1, 3, 2]],
                ranks: &[0, 1],
                first_draw: 0,
                clip_from_object: glam::Mat4::IDENTITY.to_cols_array(),
                faces: Faces::Both,
            },
        );
        image
    }

    #[test]
    fn the_nearest_sample_counts() {
        for order in [DepthOrder::Forward, DepthOrder::Reversed] {
            let image = half(order);
            let near = order.depth(order.key(middle(order)) - 3);
            let proxy = Proxy::Rectangle { min: [2, 1], max: [7, 3], depth: near };
            let tie = proxy.nearest_tie(&image).unwrap();
            assert_eq!((tie.ulps, tie.pixel, tie.depth), (3, [2, 1], near));
            assert_eq!(tie.distance, (f64::from(near) - f64::from(middle(order))).abs());
            // Right of the half there is only the far plane.
            let right = Proxy::Rectangle { min: [4, 0], max: [8, 4], depth: middle(order) };
            assert_eq!(right.nearest_tie(&image).unwrap().distance, 0.5);
        }
    }

    #[test]
    fn a_box_is_measured_where_it_covers() {
        let image = half(DepthOrder::Forward);
        let clip_from_box = glam::Mat4::IDENTITY.to_cols_array();
        let of = |min, max| Proxy::Box { clip_from_box, min, max }.nearest_tie(&image);
        let tie = of([-0.5, -0.5, 0.375], [0.5, 0.5, 0.75]).unwrap();
        assert_eq!(tie.rectangle, [[2, 1], [6, 3]]);
        assert_eq!((tie.depth, tie.distance, tie.pixel), (0.375, 0.125, [2, 1]));
        assert_eq!(of([3.0, 3.0, 0.375], [4.0, 4.0, 0.75]), None);
    }
}
