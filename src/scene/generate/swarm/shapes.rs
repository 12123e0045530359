//! Meshes of about unit size, about their own origin or away from it.

use std::sync::Arc;

use glam::DVec3;

use super::{power, within};
use crate::scene::generate::shape::{self, Builder};
use crate::scene::{Mesh, Stream};

/// Fewest and most triangles of a mesh.
pub(super) const TRIANGLES: [u32; 2] = [12, 300];
/// A mesh whose middle is farther than this from its own origin does not turn about it: it would be
/// nowhere to be seen.
const TURNS_WITHIN: f64 = 4.0;

/// A mesh with the place of its middle in its own space.
pub(super) struct Shape {
    pub(super) mesh: Arc<Mesh>,
    /// Where its middle is, about; what is placed by its middle is placed with this in mind.
    pub(super) middle: DVec3,
}

impl Shape {
    /// Whether an object of it may turn about its origin and still be about where it was.
    pub(super) fn may_turn(&self) -> bool {
        self.middle.length() < TURNS_WITHIN
    }
}

/// One to six meshes; the first is a wall.
pub(super) fn shapes(seed: u64) -> Vec<Shape> {
    let mut shape = Stream::new(seed, "shape");
    let count = 1 + shape.below(6);
    let mut away = Stream::new(seed, "middle of a mesh");
    // In one world of three meshes stand away from their origin: a little, so that they turn about a place
    // outside, or so far along one axis or all that floats there are coarse.
    let far = away.pick(&[0, 0, 0, 0, 1, 2]);
    (0..count)
        .map(|number| {
            let mesh = mesh(&mut shape, number, seed);
            let middle = match far {
                1 => within(&mut away, DVec3::splat(2.0)),
                2 => {
                    let axis = away.below(4) as usize;
                    let mut reach = DVec3::splat(power(&mut away, 2.0, 4.0));
                    if axis < 3 {
                        reach *= DVec3::AXES[axis];
                    }
                    within(&mut away, reach)
                }
                _ => DVec3::ZERO,
            };
            let moved =
                |p: &[f32; 3]| (DVec3::from(p.map(f64::from)) + middle).as_vec3().to_array();
            let mesh = match far {
                0 => mesh,
                _ => {
                    let positions = mesh.positions().iter().map(moved).collect();
                    let triangles = mesh.triangles().to_vec();
                    Mesh::new(mesh.name(), positions, triangles).expect("they are finite")
                }
            };
            Shape { mesh: Arc::new(mesh), middle }
        })
        .collect()
}

fn mesh(shape: &mut Stream, number: u32, seed: u64) -> Mesh {
    let triangles = shape.pick(&[TRIANGLES[0], 40, 100, 200, TRIANGLES[1]]);
    let mut builder = Builder::default();
    let kind = if number == 0 { 1 } else { shape.below(6) };
    match kind {
        0 => return shape::blob(triangles, seed + u64::from(number)),
        1 => {
            let cells = (f64::from(triangles) / 12.0).sqrt().floor().max(1.0);
            builder.cuboid(DVec3::splat(-0.5), DVec3::splat(0.5), 1.0 / cells, cells as u32);
        }
        2 => {
            // Flat: no thickness at all.
            let cells = triangles / 2;
            let columns = f64::from(cells).sqrt() as u32;
            let (across, up, cells) = (DVec3::X, DVec3::Y, [columns, cells.div_ceil(columns)]);
            builder.grid((across + up) * -0.5, across, up, cells, |_, _| DVec3::ZERO);
        }
        3 => {
            // Slivers that all meet in one point.
            for _ in 0..triangles {
                let tip = within(shape, DVec3::splat(0.5));
                let aside = within(shape, DVec3::splat(0.01));
                builder.triangle([DVec3::ZERO, tip, tip + aside]);
            }
        }
        4 => {
            // Loose triangles of sizes over four decades, some without area.
            for _ in 0..triangles {
                let at = within(shape, DVec3::splat(0.5));
                let reach = power(shape, -4.0, -0.3);
                let corner = |shape: &mut Stream| at + within(shape, DVec3::splat(reach));
                let (a, b) = (corner(shape), corner(shape));
                let c = if shape.below(16) == 0 { a } else { corner(shape) };
                builder.triangle([a, b, c]);
            }
        }
        _ => builder.tube(
            &[DVec3::NEG_X * 0.5, DVec3::Y * 0.3, DVec3::X * 0.5],
            0.1,
            (triangles / 6).clamp(3, 40),
        ),
    }
    builder.finish(&format!("swarm {number}"))
}
