//! `rooms`: a square floor of furnished rooms with doorways in every inner wall; the camera walks
//! through the doorways, a few balls roll about. `--scale` multiplies the number of rooms.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::Chosen;
use super::shape::Builder;
use crate::scene::{
    CameraPath, CameraPose, Effects, Lens, Mesh, Motion, Object, Path, Placement, Scene,
    SceneError, Stream, Travel,
};

/// Rooms along a side at scale 1.
const ROOMS: f64 = 7.0;
/// World units along a room's side.
const SIDE: f64 = 6.0;
/// Height of a room.
const HEIGHT: f64 = 3.0;
/// Half the thickness of a wall.
const HALF_WALL: f64 = 0.1;
/// Width and height of a doorway.
const DOOR: [f64; 2] = [1.2, 2.1];

const FLOOR: u32 = 0;
const WALL: u32 = 1;
const DOORWAY: u32 = 2;
const TABLE: u32 = 3;
const SHELF: u32 = 4;
const STATUE: u32 = 5;

pub(super) fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let rooms = (ROOMS * chosen.scale.sqrt()).round().max(1.0) as u32;
    let meshes =
        [floor(), wall(false), wall(true), table(), shelf(), super::blob(12_000, chosen.seed)]
            .map(Arc::new)
            .to_vec();
    let mut place = Stream::new(chosen.seed, "placement");
    let mut motion = Stream::new(chosen.seed, "motion");
    let (mut objects, mut movers) = (Vec::new(), Vec::new());
    let quarter = DQuat::from_rotation_y(-std::f64::consts::FRAC_PI_2);
    let mut put = |mesh: u32, translation: DVec3, rotation: DQuat, scale: DVec3| {
        objects.push(Object {
            mesh,
            placement: Placement { translation, rotation, scale, ..Placement::IDENTITY },
        });
        objects.len() as u32 - 1
    };
    for i in 0..=rooms {
        for j in 0..rooms {
            let wall = if i == 0 || i == rooms { WALL } else { DOORWAY };
            let (far, along) = (f64::from(i) * SIDE, f64::from(j) * SIDE);
            put(wall, DVec3::new(along, 0.0, far), DQuat::IDENTITY, DVec3::ONE);
            put(wall, DVec3::new(far, 0.0, along), quarter, DVec3::ONE);
        }
    }
    for room in 0..rooms * rooms {
        let corner = DVec3::new(f64::from(room % rooms), 0.0, f64::from(room / rooms)) * SIDE;
        put(FLOOR, corner, DQuat::IDENTITY, DVec3::ONE);
        put(FLOOR, corner + DVec3::Y * HEIGHT, DQuat::IDENTITY, DVec3::ONE);
        for (mesh, x, z) in
            [(TABLE, 1.5, 4.5), (SHELF, 4.6, 0.4), (SHELF, 0.4, 1.0), (STATUE, 4.7, 4.7)]
        {
            let jitter = DVec3::new(place.range(-0.2, 0.2), 0.0, place.range(-0.2, 0.2));
            let up = if mesh == STATUE { DVec3::Y } else { DVec3::ZERO };
            let turn = DQuat::from_rotation_y(place.range(-0.1, 0.1));
            let scale = if mesh == STATUE { DVec3::new(0.5, 1.0, 0.5) } else { DVec3::ONE };
            put(mesh, corner + DVec3::new(x, 0.0, z) + jitter + up, turn, scale);
        }
        if room % 3 == 0 {
            let at = corner + DVec3::new(3.0, 0.3, 3.0);
            let ball = put(STATUE, at, DQuat::IDENTITY, DVec3::splat(0.3));
            let velocity = DVec3::new(motion.range(-0.1, 0.1), 0.0, motion.range(-0.1, 0.1));
            let (min, max) = (corner + DVec3::splat(0.5), corner + DVec3::splat(SIDE - 0.5));
            movers.push((ball, Path::Reflect { velocity, min, max, spin: 0.1 }));
        }
    }
    for (_, path) in &mut movers {
        if let Path::Reflect { min, max, .. } = path {
            (min.y, max.y) = (0.3, 0.3);
        }
    }
    Ok(Scene {
        name: "rooms".to_owned(),
        seed: chosen.seed,
        meshes,
        objects,
        cameras: vec![walk(chosen, rooms)],
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects: Effects { motion: Some(Motion { movers }), ..Effects::default() },
    })
}

/// Through the doorways of the middle row of rooms, looking about, then round a corner.
fn walk(chosen: &Chosen, rooms: u32) -> CameraPath {
    let middle = f64::from(rooms / 2) * SIDE + SIDE * 0.5;
    let far = f64::from(rooms) * SIDE;
    let at = |x: f64, z: f64| DVec3::new(x, 1.7, z);
    let pose = |eye: DVec3, target: DVec3| CameraPose { eye, target };
    let poses = vec![
        pose(at(SIDE * 0.3, middle), at(far, middle)),
        pose(at(middle * 0.6, middle), at(far, middle + SIDE)),
        pose(at(middle, middle), at(middle + SIDE, far)),
        pose(at(middle, middle + SIDE * 0.9), at(middle - SIDE * 0.2, far + SIDE)),
    ];
    CameraPath {
        poses,
        duration: chosen.frames,
        travel: Travel::Glide,
        lens: Lens::perspective(1.2),
        near: 0.05,
        far: far * 2.0 + 10.0,
    }
}

fn floor() -> Mesh {
    let mut mesh = Builder::default();
    let thin = DVec3::Y * 0.05;
    mesh.cuboid(-thin, DVec3::new(SIDE, 0.0, SIDE) + thin, 0.3, 20);
    mesh.finish("floor")
}

/// Along x from the corner of a room, with a doorway in its middle or without.
fn wall(doorway: bool) -> Mesh {
    let mut mesh = Builder::default();
    let mut slab = |x0: f64, x1: f64, y0: f64, y1: f64| {
        mesh.cuboid(DVec3::new(x0, y0, -HALF_WALL), DVec3::new(x1, y1, HALF_WALL), 0.15, 40);
    };
    if doorway {
        let (left, right) = ((SIDE - DOOR[0]) * 0.5, (SIDE + DOOR[0]) * 0.5);
        slab(0.0, left, 0.0, HEIGHT);
        slab(right, SIDE, 0.0, HEIGHT);
        slab(left, right, DOOR[1], HEIGHT);
    } else {
        slab(0.0, SIDE, 0.0, HEIGHT);
    }
    mesh.finish(if doorway { "doorway" } else { "wall" })
}

fn table() -> Mesh {
    let mut mesh = Builder::default();
    mesh.cuboid(DVec3::new(-0.8, 0.7, -0.5), DVec3::new(0.8, 0.75, 0.5), 0.06, 27);
    for (x, z) in [(-0.7, -0.4), (0.7, -0.4), (-0.7, 0.4), (0.7, 0.4)] {
        mesh.cuboid(
            DVec3::new(x - 0.04, 0.0, z - 0.04),
            DVec3::new(x + 0.04, 0.7, z + 0.04),
            0.05,
            14,
        );
    }
    mesh.finish("table")
}

fn shelf() -> Mesh {
    let mut mesh = Builder::default();
    for board in 0..6 {
        let y = 0.35 * f64::from(board);
        mesh.cuboid(DVec3::new(-0.6, y, -0.2), DVec3::new(0.6, y + 0.03, 0.2), 0.1, 12);
        for book in 0..10 {
            let x = -0.55 + 0.11 * f64::from(book);
            let high = y + 0.2 + 0.01 * f64::from((book * 7 + board * 3) % 10);
            mesh.cuboid(DVec3::new(x, y + 0.03, -0.15), DVec3::new(x + 0.08, high, 0.1), 0.12, 3);
        }
    }
    mesh.finish("shelf")
}
