//! `soup`: random triangles and boxes of wild sizes, slivers and zero areas among them, some moving.
//! For property tests at small scales. `--scale` multiplies the number of objects.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::Chosen;
use super::shape::Builder;
use crate::scene::{
    CameraPath, CameraPose, Effects, Lens, Mesh, Motion, Object, Path, Placement, Scene,
    SceneError, Stream, Travel,
};

/// Objects at scale 1.
const OBJECTS: f64 = 400.0;
/// Meshes to choose from, fewer at small scales.
const MESHES: f64 = 24.0;
/// Pieces (triangles or boxes) of a mesh at scale 1.
const PIECES: f64 = 700.0;
/// World units from the middle to a wall of the space.
const SPACE: f64 = 20.0;

pub(super) fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let number = |full: f64, exponent: f64| {
        (full * libm::pow(chosen.scale, exponent)).round().max(1.0) as u32
    };
    let (count, designs) = (number(OBJECTS, 1.0).max(2), number(MESHES, 0.3));
    let pieces = number(PIECES, 0.5).min(PIECES as u32);
    let mut shape = Stream::new(chosen.seed, "shape");
    let meshes = (0..designs).map(|_| Arc::new(soup(&mut shape, pieces))).collect();
    let mut place = Stream::new(chosen.seed, "placement");
    let mut motion = Stream::new(chosen.seed, "motion");
    let (mut objects, mut movers) = (Vec::new(), Vec::new());
    for object in 0..count {
        let translation = within(&mut place, SPACE);
        let axis = within(&mut place, 1.0).try_normalize().unwrap_or(DVec3::Y);
        let rotation = DQuat::from_axis_angle(axis, place.range(-3.0, 3.0));
        // Sizes over two decades, one axis in eight mirrored.
        let mut scale = DVec3::splat(libm::pow(10.0, place.range(-1.0, 0.6)));
        if place.below(8) == 0 {
            scale.x = -scale.x;
        }
        objects.push(Object {
            mesh: place.below(designs),
            placement: Placement { translation, rotation, scale, ..Placement::IDENTITY },
        });
        if motion.below(2) == 0 {
            let velocity = within(&mut motion, 0.5);
            let (min, max) = (DVec3::splat(-SPACE), DVec3::splat(SPACE));
            movers.push((
                object,
                Path::Reflect { velocity, min, max, spin: motion.range(-0.3, 0.3) },
            ));
        }
    }
    let pose = |x: f64, y: f64, z: f64| CameraPose {
        eye: DVec3::new(x, y, z) * SPACE,
        target: DVec3::ZERO,
    };
    let poses = vec![pose(1.8, 0.4, 0.3), pose(1.0, 0.9, 1.3), pose(0.2, 0.3, 0.9)];
    Ok(Scene {
        name: "soup".to_owned(),
        seed: chosen.seed,
        meshes,
        objects,
        cameras: vec![CameraPath {
            poses,
            duration: chosen.frames,
            travel: Travel::Glide,
            lens: Lens::perspective(1.1),
            near: 0.05,
            far: SPACE * 8.0,
        }],
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects: Effects { motion: Some(Motion { movers }), ..Effects::default() },
    })
}

fn within(stream: &mut Stream, reach: f64) -> DVec3 {
    DVec3::new(
        stream.range(-reach, reach),
        stream.range(-reach, reach),
        stream.range(-reach, reach),
    )
}

/// Pieces within about unit distance; sizes over five decades, few of them large.
fn soup(shape: &mut Stream, pieces: u32) -> Mesh {
    let mut mesh = Builder::default();
    for piece in 0..pieces {
        let at = within(shape, 1.0);
        let size = libm::pow(10.0, shape.range(-4.0, if piece % 64 == 0 { 0.3 } else { -0.9 }));
        match shape.below(8) {
            0 => {
                // A sliver, sometimes of no width at all.
                let width = if shape.below(4) == 0 { 0.0 } else { size * 1e-3 };
                let along = within(shape, 0.5);
                mesh.triangle([at, at + along, at + along * 0.5 + DVec3::Y * width]);
            }
            1..=4 => {
                let corner = |shape: &mut Stream| at + within(shape, size);
                mesh.triangle([corner(shape), corner(shape), corner(shape)]);
            }
            _ => {
                let half = DVec3::new(shape.unit(), shape.unit(), shape.unit()) * size;
                // One box in ten is flat.
                let half =
                    if shape.below(10) == 0 { half * DVec3::new(1.0, 0.0, 1.0) } else { half };
                mesh.cuboid(at - half, at + half, f64::INFINITY, 1);
            }
        }
    }
    mesh.finish("soup")
}
