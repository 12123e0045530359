//! Hard scenes: input that a correct culler must survive, one reason each. Most come from bugs that
//! shipped: near planes through boxes, pinholes, ties, a million units from the origin. They are small,
//! so that a test can put every culler, index and oracle through all of them.
//!
//! `--scale` multiplies how many things stand about; nothing else depends on it.

mod camera;
mod edge;
mod shapes;
mod space;
mod time;

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::shape::{self, Builder};
use super::{Chosen, Generator, USUAL};
use crate::scene::{
    CameraPath, CameraPose, Effects, Jumps, Lens, Mesh, Motion, Object, Path, Placement, Scene,
    Stream, Teleport, Travel, Viewport,
};

/// Pixels of most of them.
const VIEWPORT: Viewport = Viewport { width: 320, height: 240 };
/// Triangles in a part, few: so that things have trees.
const LEAF_TRIANGLES: u32 = 48;
/// What most of them have in common.
const SMALL: Generator =
    Generator { viewport: VIEWPORT, frames: 12, leaf_triangles: LEAF_TRIANGLES, ..USUAL };

/// Every hard scene there is. Their names begin with `hard/`.
pub const HARD: &[Generator] = &[
    camera::NEAR_PLANE,
    camera::EYE_ON_BOX,
    camera::EYE_ON_PLANE,
    camera::ORTHOGRAPHIC,
    camera::ASYMMETRIC,
    camera::TELEPHOTO,
    camera::WIDE_ANGLE,
    camera::INFINITE_FAR,
    camera::DEPTH_RATIO,
    camera::REVERSED_DEPTH,
    camera::REVERSED_INFINITE,
    camera::REVERSED_NEAR,
    camera::STRAIGHT_DOWN,
    camera::EDGE_OF_VIEW,
    camera::ONE_PIXEL,
    camera::ONE_ROW,
    camera::ONE_COLUMN,
    camera::ODD_VIEWPORT,
    camera::WIDE_VIEWPORT,
    camera::LAST_COLUMN,
    camera::STEREO,
    camera::SPLIT_SCREEN,
    edge::POLES,
    edge::SPARS,
    edge::CROSSED_SPARS,
    edge::WORLD_EDGE,
    edge::ENDLESS_SIDES,
    edge::PARALLEL_SHADOW,
    edge::BETWEEN_FLOATS,
    shapes::FLAT,
    shapes::NEEDLES,
    shapes::SPECKS,
    shapes::COPLANAR,
    shapes::PINHOLES,
    shapes::GRAZING,
    shapes::T_JUNCTIONS,
    shapes::TOUCHING,
    shapes::BEHIND_A_GAP,
    shapes::LAYERS,
    shapes::MANY,
    shapes::NOTHING,
    space::SCALES,
    space::COLLAPSED,
    space::PIVOTS,
    space::FAR_FROM_ORIGIN,
    space::FAR_IN_MESH,
    space::TINY_WORLD,
    space::OVERFLOW,
    time::TELEPORTS,
    time::PING_PONG,
    time::CUSP,
    time::STOP_AND_GO,
    time::OUT_OF_SPACE,
    time::PEEPING,
    time::STRAYS,
    time::SLITS,
    time::LONG_RUN,
];

/// A scene under construction.
#[derive(Default)]
struct Site {
    meshes: Vec<Arc<Mesh>>,
    objects: Vec<Object>,
    movers: Vec<(u32, Path)>,
    jumpers: Vec<(u32, Jumps)>,
}

impl Site {
    fn mesh(&mut self, mesh: Mesh) -> u32 {
        self.meshes.push(Arc::new(mesh));
        self.meshes.len() as u32 - 1
    }

    /// An object with that placement; returns its id.
    fn put(&mut self, mesh: u32, placement: Placement) -> u32 {
        self.objects.push(Object { mesh, placement });
        self.objects.len() as u32 - 1
    }

    /// An object at a place, unturned and in its own size; returns its id.
    fn at(&mut self, mesh: u32, x: f64, y: f64, z: f64) -> u32 {
        self.put(mesh, Placement::at(DVec3::new(x, y, z)))
    }

    /// An object there that jumps by these offsets in turn, `period` frames at each.
    fn jump(&mut self, object: u32, period: u32, offsets: &[DVec3]) {
        self.jumpers.push((object, Jumps { offsets: offsets.to_vec(), period }));
    }

    /// Seeded blobs, turned and of several sizes, in a box about `middle`; every third moves if `moving`.
    fn crowd(
        &mut self,
        chosen: &Chosen,
        (middle, reach): (DVec3, DVec3),
        count: u32,
        moving: bool,
    ) {
        let meshes = [120, 400].map(|triangles| self.mesh(shape::blob(triangles, chosen.seed)));
        let mut place = Stream::new(chosen.seed, "placement");
        let mut motion = Stream::new(chosen.seed, "motion");
        let within = |stream: &mut Stream, reach: DVec3| {
            let mut along = |reach: f64| stream.range(-reach, reach);
            DVec3::new(along(reach.x), along(reach.y), along(reach.z))
        };
        let (min, max) = (middle - reach, middle + reach);
        for number in 0..scaled(chosen, count) {
            let object = self.put(
                meshes[number as usize % 2],
                Placement {
                    translation: middle + within(&mut place, reach),
                    rotation: DQuat::from_rotation_y(place.range(-3.0, 3.0)),
                    scale: DVec3::splat(reach.max_element() * place.range(0.04, 0.16)),
                    ..Placement::IDENTITY
                },
            );
            if moving && number % 3 == 0 {
                let velocity = within(&mut motion, reach * 0.06);
                let spin = motion.range(-0.2, 0.2);
                self.movers.push((object, Path::Reflect { velocity, min, max, spin }));
            }
        }
    }

    fn finish(self, chosen: &Chosen, name: &str, camera: CameraPath) -> Scene {
        self.finish_views(chosen, name, vec![camera])
    }

    fn finish_views(self, chosen: &Chosen, name: &str, cameras: Vec<CameraPath>) -> Scene {
        let Self { meshes, objects, movers, jumpers } = self;
        Scene {
            name: name.to_owned(),
            seed: chosen.seed,
            meshes,
            objects,
            cameras,
            viewport: chosen.viewport,
            depth: chosen.depth,
            frames: chosen.frames,
            start: 0,
            leaf_triangles: chosen.leaf_triangles,
            effects: Effects {
                motion: (!movers.is_empty()).then_some(Motion { movers }),
                articulated: None,
                teleport: (!jumpers.is_empty()).then_some(Teleport { jumpers }),
            },
        }
    }
}

/// So many things at this scale, at least one.
fn scaled(chosen: &Chosen, count: u32) -> u32 {
    (f64::from(count) * chosen.scale).round().max(1.0) as u32
}

/// An eye and the point that it looks at.
fn pose(eye: [f64; 3], target: [f64; 3]) -> CameraPose {
    CameraPose { eye: eye.into(), target: target.into() }
}

/// A glide through `poses` with a symmetric lens of `fov_y` degrees.
fn glide(chosen: &Chosen, poses: &[CameraPose], fov_y: f64, [near, far]: [f64; 2]) -> CameraPath {
    CameraPath {
        poses: poses.to_vec(),
        duration: chosen.frames,
        travel: Travel::Glide,
        lens: Lens::perspective(fov_y.to_radians()),
        near,
        far,
    }
}

/// A flat wall of `cells` × `cells` squares in the plane z = 0, `width` by `height` about the origin.
fn wall(width: f64, height: f64, cells: u32) -> Mesh {
    let mut mesh = Builder::default();
    let corner = DVec3::new(-width, -height, 0.0) * 0.5;
    let flat = |_: f64, _: f64| DVec3::ZERO;
    mesh.grid(corner, DVec3::X * width, DVec3::Y * height, [cells, cells], flat);
    mesh.finish("wall")
}

/// A box of `size` about the origin, its faces cut into `cells` × `cells` squares.
fn cube(size: DVec3, cells: u32) -> Mesh {
    let mut mesh = Builder::default();
    mesh.cuboid(size * -0.5, size * 0.5, size.max_element() / f64::from(cells), cells);
    mesh.finish("cube")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::generate::{Knobs, build};

    #[test]
    fn they_are_small_seeded_and_named() {
        let mut names = Vec::new();
        for generator in HARD {
            assert!(generator.name.starts_with("hard/") && !names.contains(&generator.name));
            names.push(generator.name);
            let scene =
                |seed| build(generator.name, &Knobs { seed: Some(seed), ..Knobs::default() });
            let (a, b) = (scene(3).unwrap(), scene(3).unwrap());
            assert_eq!(format!("{a:?}"), format!("{b:?}"), "{}", generator.name);
            assert!(a.triangle_count() < 60_000, "{}: {}", generator.name, a.triangle_count());
            assert_eq!((a.viewport, a.frames), (generator.viewport, generator.frames));
            assert_eq!(a.name, generator.name);
        }
    }
}
