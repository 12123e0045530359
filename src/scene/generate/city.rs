//! `city`: blocks of buildings along streets, cars driving round the blocks, the camera at street
//! level, driving and turning a corner. `--scale` multiplies the number of blocks.

use std::sync::Arc;

use glam::DVec3;

use super::Chosen;
use super::shape::Builder;
use crate::scene::{
    CameraPath, CameraPose, Effects, Lens, Mesh, Motion, Object, Path, Placement, Scene,
    SceneError, Stream, Travel,
};

/// Blocks along a side at scale 1.
const BLOCKS: f64 = 7.0;
/// World units from one block to the next, street included.
const PITCH: f64 = 40.0;
/// Width of a street.
const STREET: f64 = 12.0;
/// Lots along a block's side.
const LOTS: u32 = 2;
/// Building designs; each is one mesh.
const DESIGNS: u32 = 6;
/// Cars a block.
const CARS: u32 = 2;

pub(super) fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let blocks = (BLOCKS * chosen.scale.sqrt()).round().max(1.0) as u32;
    let mut shape = Stream::new(chosen.seed, "shape");
    let mut meshes: Vec<Arc<Mesh>> = (0..DESIGNS).map(|_| Arc::new(building(&mut shape))).collect();
    meshes.push(Arc::new(car()));
    meshes.push(Arc::new(ground()));
    let mut place = Stream::new(chosen.seed, "placement");
    let mut motion = Stream::new(chosen.seed, "motion");
    let (mut objects, mut movers) = (Vec::new(), Vec::new());
    for block in 0..blocks * blocks {
        let corner = DVec3::new(f64::from(block % blocks), 0.0, f64::from(block / blocks)) * PITCH;
        objects.push(Object { mesh: DESIGNS + 1, placement: Placement::at(corner) });
        let lot = (PITCH - STREET) / f64::from(LOTS);
        for i in 0..LOTS * LOTS {
            let at = corner
                + DVec3::new(f64::from(i % LOTS) * lot, 0.0, f64::from(i / LOTS) * lot)
                + DVec3::new(STREET * 0.5, 0.0, STREET * 0.5);
            let scale = DVec3::new(lot * 0.98, place.range(0.7, 1.6), lot * 0.98);
            let placement = Placement { scale, ..Placement::at(at) };
            objects.push(Object { mesh: place.below(DESIGNS), placement });
        }
        for _ in 0..CARS {
            let inset = STREET * 0.25;
            let (low, high) = (corner + DVec3::splat(inset), corner + DVec3::splat(PITCH - inset));
            let at = |x: f64, z: f64| DVec3::new(x, 0.0, z);
            let corners =
                vec![at(low.x, low.z), at(high.x, low.z), at(high.x, high.z), at(low.x, high.z)];
            let (speed, start) = (motion.range(0.2, 0.8), motion.range(0.0, 4.0 * PITCH));
            movers.push((objects.len() as u32, Path::Circuit { corners, speed, start }));
            objects.push(Object { mesh: DESIGNS, placement: Placement::at(corner) });
        }
    }
    Ok(Scene {
        name: "city".to_owned(),
        seed: chosen.seed,
        meshes,
        objects,
        cameras: vec![drive(chosen, blocks)],
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects: Effects { motion: Some(Motion { movers }), ..Effects::default() },
    })
}

/// Along the middle of a street, round a corner, up the next one.
fn drive(chosen: &Chosen, blocks: u32) -> CameraPath {
    let side = f64::from(blocks) * PITCH;
    let street = f64::from(blocks / 2) * PITCH;
    let at = |x: f64, z: f64| DVec3::new(x, 1.7, z);
    let pose = |eye: DVec3, target: DVec3| CameraPose { eye, target };
    let poses = vec![
        pose(at(-PITCH * 0.2, street), at(side, street + 2.0)),
        pose(at(street * 0.8, street), at(side, street + 1.0)),
        pose(at(street, street), at(street + PITCH, street + PITCH)),
        pose(at(street, street + PITCH * 0.5), at(street + 1.0, side + PITCH)),
    ];
    CameraPath {
        poses,
        duration: chosen.frames,
        travel: Travel::Glide,
        lens: Lens::perspective(1.0),
        near: 0.1,
        far: side * 2.0 + 100.0,
    }
}

/// A tower on the unit lot, 8 to 24 units high, with ledges, windows set in, and a stepped top.
fn building(shape: &mut Stream) -> Mesh {
    let mut mesh = Builder::default();
    let (mut inset, mut base) = (0.0, 0.0);
    for _ in 0..1 + shape.below(3) {
        let height = shape.range(6.0, 10.0);
        let floors = height.round();
        let depth = shape.range(0.01, 0.03);
        let (low, high) = (inset, 1.0 - inset);
        let width = high - low;
        let walls = [
            (DVec3::new(low, base, low), DVec3::X * width, DVec3::NEG_Z),
            (DVec3::new(high, base, low), DVec3::Z * width, DVec3::X),
            (DVec3::new(high, base, high), DVec3::NEG_X * width, DVec3::Z),
            (DVec3::new(low, base, high), DVec3::NEG_Z * width, DVec3::NEG_X),
        ];
        let columns = 8.0;
        for (origin, across, outward) in walls {
            // Every third row and column of the fine grid stands out: piers and ledges.
            let cells = [columns as u32 * 3, floors as u32 * 3];
            mesh.grid(origin, across, DVec3::Y * height, cells, |u, v| {
                let pier = (u * columns * 3.0).round() % 3.0 == 0.0;
                let ledge = (v * floors * 3.0).round() % 3.0 == 0.0;
                // Corners stay where they are, so that walls meet.
                let edge = u == 0.0 || u == 1.0;
                if edge || pier || ledge { DVec3::ZERO } else { outward * -depth }
            });
        }
        base += height;
        mesh.grid(
            DVec3::new(low, base, low),
            DVec3::X * width,
            DVec3::Z * width,
            [4, 4],
            |_, _| DVec3::ZERO,
        );
        inset += shape.range(0.05, 0.15);
    }
    mesh.finish("building")
}

fn car() -> Mesh {
    let mut mesh = Builder::default();
    mesh.cuboid(DVec3::new(-2.0, 0.3, -0.9), DVec3::new(2.0, 1.0, 0.9), 0.2, 20);
    mesh.cuboid(DVec3::new(-1.2, 1.0, -0.8), DVec3::new(1.0, 1.6, 0.8), 0.2, 12);
    for (x, z) in [(-1.3, -0.9), (-1.3, 0.7), (1.3, -0.9), (1.3, 0.7)] {
        mesh.cuboid(DVec3::new(x - 0.35, 0.0, z), DVec3::new(x + 0.35, 0.7, z + 0.2), 0.2, 4);
    }
    mesh.finish("car")
}

fn ground() -> Mesh {
    let mut mesh = Builder::default();
    let (x, z) = (DVec3::X * PITCH, DVec3::Z * PITCH);
    mesh.grid(DVec3::ZERO, x, z, [10, 10], |_, _| DVec3::ZERO);
    let low = DVec3::new(STREET * 0.4, 0.0, STREET * 0.4);
    let high = DVec3::new(PITCH - STREET * 0.4, 0.15, PITCH - STREET * 0.4);
    mesh.cuboid(low, high, 3.0, 16);
    mesh.finish("ground")
}
