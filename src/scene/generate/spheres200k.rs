//! `spheres200k`: the cloud of Wortel 2011, section 4.2: spheres of which half move at random, the largest
//! four times as large as the smallest, all that move at one speed; 200,000 at scale 1. `--scale`
//! multiplies their number and the space with it, so that what is near the camera stays as much. The
//! camera starts in the middle and goes straight while it turns; its far plane is the distance limit.
//!
//! The thesis gives no densities. Here a sphere has about 130 cubic units, and diameters are 1 to 4.

use std::sync::Arc;

use glam::DVec3;

use super::shape::Builder;
use super::{Chosen, straight_while_turning};
use crate::math::{cos, sin};
use crate::scene::{Effects, Mesh, Motion, Object, Path, Placement, Scene, SceneError, Stream};

/// Spheres at scale 1.
const COUNT: f64 = 200_000.0;
/// Half a side of the space at scale 1.
const SPACE: f64 = 150.0;
/// World units a frame of all that move.
const SPEED: f64 = 0.1;
/// Nothing is drawn beyond.
const DISTANCE: f64 = 100.0;

pub(super) fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let count = (COUNT * chosen.scale).round().max(2.0) as u32;
    let space = SPACE * libm::cbrt(chosen.scale);
    let mut place = Stream::new(chosen.seed, "placement");
    let mut motion = Stream::new(chosen.seed, "motion");
    let within = |stream: &mut Stream, reach: f64| {
        DVec3::from_array(std::array::from_fn(|_| stream.range(-reach, reach)))
    };
    let (mut objects, mut movers) = (Vec::new(), Vec::new());
    for object in 0..count {
        let radius = place.range(0.5, 2.0);
        let translation = within(&mut place, space);
        let placement = Placement { scale: DVec3::splat(radius), ..Placement::at(translation) };
        objects.push(Object { mesh: 0, placement });
        if object % 2 == 0 {
            let direction = loop {
                let any = within(&mut motion, 1.0);
                if any.length_squared() <= 1.0
                    && let Some(direction) = any.try_normalize()
                {
                    break direction;
                }
            };
            let wall = DVec3::splat(space);
            let velocity = direction * SPEED;
            movers.push((object, Path::Reflect { velocity, min: -wall, max: wall, spin: 0.0 }));
        }
    }
    Ok(Scene {
        name: "spheres200k".to_owned(),
        seed: chosen.seed,
        meshes: vec![Arc::new(sphere())],
        objects,
        cameras: vec![straight_while_turning(chosen, DVec3::new(1.0, 0.5, 0.5), 0.1, DISTANCE)],
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects: Effects { motion: Some(Motion { movers }), ..Effects::default() },
    })
}

/// A ball within unit distance of its centre, eight by six.
fn sphere() -> Mesh {
    const RINGS: u32 = 6;
    let ring = |i: u32| {
        let down = std::f64::consts::PI * f64::from(i) / f64::from(RINGS);
        [sin(down), cos(down)]
    };
    let profile: Vec<[f64; 2]> = (0..=RINGS).map(ring).collect();
    let mut mesh = Builder::default();
    mesh.lathe(DVec3::ZERO, &profile, 8);
    mesh.finish("sphere")
}
