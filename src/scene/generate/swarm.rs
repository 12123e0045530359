//! `swarm`: small worlds of every kind, for sweeps over thousands of seeds. What the seed decides is kept
//! apart by concern, each in a stream of its own: the layout, the shapes, who moves and how, the camera.
//! Each choice is made fully or not at all (Groce, Zhang, Eide, Chen & Regehr 2012, *Swarm testing*:
//! leaving features out of a test finds what their mixture hides). `--scale` multiplies the number of
//! objects.

use std::sync::Arc;

use glam::{DQuat, DVec3};

use super::shape::{self, Builder};
use super::{Chosen, Generator, USUAL};
use crate::scene::{
    Articulated, CameraPath, CameraPose, Effects, Figure, Joint, Jumps, Lens, Limb, Mesh, Motion,
    Object, Path, Placement, Scene, SceneError, Stream, Teleport, Travel, Viewport,
};

/// The generator; it stands in neither list of those that people look at.
pub const SWARM: Generator = Generator {
    name: "swarm",
    summary: "a small world of any kind, other for each seed: what `stress` runs",
    viewport: Viewport { width: 160, height: 120 },
    frames: 10,
    leaf_triangles: 64,
    build,
    ..USUAL
};

/// World units from the middle to a wall of the space, before the world's own scale.
const SPACE: f64 = 10.0;
/// Most objects at scale 1.
const MOST_OBJECTS: u32 = 100;
/// Fewest and most triangles of a mesh.
const TRIANGLES: [u32; 2] = [12, 300];

fn within(stream: &mut Stream, reach: DVec3) -> DVec3 {
    let mut along = |reach: f64| stream.range(-reach, reach);
    DVec3::new(along(reach.x), along(reach.y), along(reach.z))
}

/// How objects stand to one another.
#[derive(Clone, Copy)]
enum Layout {
    /// Anywhere in the space.
    Scattered,
    /// On a grid of whole units, faces and edges touching.
    Grid,
    /// Behind walls across the view, with gaps between them.
    Walls,
    /// In cells between walls that cross.
    Rooms,
    /// Most of them in one place.
    Heap,
}

fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut layout = Stream::new(chosen.seed, "layout");
    // Far from the origin of the world, or large or tiny as a whole, now and then.
    let size = layout.pick(&[1.0, 1.0, 1.0, 1.0, 1e-3, 1e3]);
    let origin = layout.pick(&[0.0, 0.0, 0.0, 0.0, 1e3, 1e5]) * size;
    let middle = DVec3::new(origin, 0.0, -origin);
    let meshes = meshes(chosen.seed);
    let mut objects = placed(chosen, &mut layout, meshes.len() as u32);
    let effects = effects(chosen.seed, &objects, middle, size);
    for object in &mut objects {
        object.placement.translation = middle + object.placement.translation * size;
        object.placement.scale *= size;
    }
    Ok(Scene {
        name: SWARM.name.to_owned(),
        seed: chosen.seed,
        meshes,
        objects,
        cameras: cameras(chosen, middle, size),
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects,
    })
}

/// One to six meshes about the origin, of about unit size; the first is a wall.
fn meshes(seed: u64) -> Vec<Arc<Mesh>> {
    let mut shape = Stream::new(seed, "shape");
    let count = 1 + shape.below(6);
    let mesh = |number: u32| {
        let triangles = shape.pick(&[TRIANGLES[0], 40, 100, 200, TRIANGLES[1]]);
        let mut builder = Builder::default();
        let kind = if number == 0 { 1 } else { shape.below(6) };
        match kind {
            0 => return Arc::new(shape::blob(triangles, seed + u64::from(number))),
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
                    let tip = within(&mut shape, DVec3::splat(0.5));
                    let aside = within(&mut shape, DVec3::splat(0.01));
                    builder.triangle([DVec3::ZERO, tip, tip + aside]);
                }
            }
            4 => {
                // Loose triangles of sizes over four decades, some without area.
                for _ in 0..triangles {
                    let at = within(&mut shape, DVec3::splat(0.5));
                    let reach = libm::pow(10.0, shape.range(-4.0, -0.3));
                    let corner = |shape: &mut Stream| at + within(shape, DVec3::splat(reach));
                    let (a, b) = (corner(&mut shape), corner(&mut shape));
                    let c = if shape.below(16) == 0 { a } else { corner(&mut shape) };
                    builder.triangle([a, b, c]);
                }
            }
            _ => builder.tube(
                &[DVec3::NEG_X * 0.5, DVec3::Y * 0.3, DVec3::X * 0.5],
                0.1,
                (triangles / 6).clamp(3, 40),
            ),
        }
        Arc::new(builder.finish(&format!("swarm {number}")))
    };
    (0..count).map(mesh).collect()
}

/// Where everything stands in the space, before the world's own scale.
fn placed(chosen: &Chosen, layout: &mut Stream, meshes: u32) -> Vec<Object> {
    let mut place = Stream::new(chosen.seed, "placement");
    let kinds = [
        Layout::Scattered,
        Layout::Grid,
        Layout::Walls,
        Layout::Walls,
        Layout::Rooms,
        Layout::Heap,
    ];
    let kind = layout.pick(&kinds);
    // Distorted placements fully or not at all.
    let (turned, distorted) = (layout.below(3) > 0, layout.below(4) == 0);
    let largest = layout.pick(&[0.5, 1.5, 4.0]);
    let count = (f64::from(1 + layout.below(MOST_OBJECTS)) * chosen.scale).ceil() as u32;
    let mut objects = Vec::new();
    let walls = |objects: &mut Vec<Object>, translation: DVec3, scale: DVec3| {
        let placement = Placement { scale, ..Placement::at(translation) };
        objects.push(Object { mesh: 0, placement });
    };
    match kind {
        Layout::Walls => {
            for row in 0..1 + layout.below(3) {
                let z = 4.0 - 4.0 * f64::from(row);
                let gap = layout.range(0.0, 2.0);
                for side in [-1.0, 1.0] {
                    let wide = SPACE - gap;
                    let at = DVec3::new(side * (gap + wide * 0.5), 0.0, z);
                    walls(&mut objects, at, DVec3::new(wide, SPACE, 0.1));
                }
            }
        }
        Layout::Rooms => {
            let rooms = 2 + layout.below(3);
            for line in 0..=rooms {
                let at = f64::from(line) / f64::from(rooms) * 2.0 * SPACE - SPACE;
                let (long, thin) = (SPACE * 1.7, 0.05);
                walls(&mut objects, DVec3::new(at, 0.0, 0.0), DVec3::new(thin, 4.0, long));
                walls(&mut objects, DVec3::new(0.0, 0.0, at), DVec3::new(long, 4.0, thin));
            }
        }
        Layout::Scattered | Layout::Grid | Layout::Heap => {}
    }
    for _ in 0..count {
        let reach = match kind {
            Layout::Heap => DVec3::splat(SPACE * 0.15),
            Layout::Rooms => DVec3::new(SPACE, 1.5, SPACE),
            _ => DVec3::new(SPACE, SPACE * 0.5, SPACE),
        };
        let mut translation = within(&mut place, reach);
        let mut scale = DVec3::splat(libm::pow(10.0, place.range(-0.7, 0.0)) * largest);
        let mut rotation = DQuat::IDENTITY;
        if turned {
            let axis = within(&mut place, DVec3::ONE).try_normalize().unwrap_or(DVec3::Y);
            rotation = DQuat::from_axis_angle(axis, place.range(-3.0, 3.0));
        }
        if let Layout::Grid = kind {
            (translation, scale, rotation) = (translation.round(), DVec3::ONE, DQuat::IDENTITY);
        }
        let mut placement = Placement { translation, scale, rotation, ..Placement::IDENTITY };
        if distorted {
            placement.scale *= DVec3::new(
                place.pick(&[1.0, -1.0, 0.01, 10.0]),
                1.0,
                place.pick(&[1.0, 1.0, 0.0, 3.0]),
            );
            placement.shear = within(&mut place, DVec3::ONE);
        }
        objects.push(Object { mesh: place.below(meshes), placement });
    }
    objects
}

/// Who moves and who jumps.
fn effects(seed: u64, objects: &[Object], middle: DVec3, size: f64) -> Effects {
    let mut motion = Stream::new(seed, "motion");
    let share = motion.pick(&[0, 0, 1, 8, 16]);
    let fastest = motion.pick(&[0.02, 0.3, 6.0]) * size;
    let (min, max) = (middle - DVec3::splat(SPACE * size), middle + DVec3::splat(SPACE * size));
    let mut movers = Vec::new();
    for number in 0..objects.len() as u32 {
        if motion.below(16) >= share {
            continue;
        }
        let path = if motion.below(8) == 0 {
            let corner = |motion: &mut Stream| {
                middle + within(motion, DVec3::new(SPACE, SPACE * 0.3, SPACE)) * size
            };
            let corners = (0..2 + motion.below(3)).map(|_| corner(&mut motion)).collect();
            let (speed, start) = (motion.unit() * fastest, motion.unit() * SPACE * size);
            Path::Circuit { corners, speed, start }
        } else {
            let velocity = within(&mut motion, DVec3::splat(fastest));
            Path::Reflect { velocity, min, max, spin: motion.range(-0.4, 0.4) }
        };
        movers.push((number, path));
    }
    let mut jump = Stream::new(seed, "teleport");
    let share = jump.pick(&[0, 0, 0, 2, 16]);
    let mut jumpers = Vec::new();
    for number in 0..objects.len() as u32 {
        if jump.below(16) < share {
            let offsets =
                (0..1 + jump.below(3)).map(|_| within(&mut jump, DVec3::splat(SPACE)) * size);
            jumpers.push((number, Jumps { offsets: offsets.collect(), period: 1 + jump.below(4) }));
        }
    }
    let articulated = figures(seed, objects, middle, size, &movers);
    Effects {
        articulated,
        motion: (!movers.is_empty()).then_some(Motion { movers }),
        teleport: (!jumpers.is_empty()).then_some(Teleport { jumpers }),
    }
}

/// Figures of two to five objects that do not move by themselves, in one world of five.
fn figures(
    seed: u64,
    objects: &[Object],
    middle: DVec3,
    size: f64,
    movers: &[(u32, Path)],
) -> Option<Articulated> {
    let mut stream = Stream::new(seed, "figures");
    if stream.below(5) > 0 {
        return None;
    }
    let moves = |id: &u32| movers.binary_search_by_key(id, |(object, _)| *object).is_ok();
    let free: Vec<u32> = (0..objects.len() as u32).filter(|id| !moves(id)).collect();
    let mut free = free.as_slice();
    let mut figures = Vec::new();
    while free.len() > 1 && figures.len() < 8 {
        let (taken, rest) = free.split_at((2 + stream.below(4) as usize).min(free.len()));
        free = rest;
        let half =
            [stream.range(0.2, 0.9), stream.range(0.2, 0.9)].map(|share| share * SPACE * size);
        let path = Path::Lap {
            center: middle + within(&mut stream, DVec3::ONE) * size,
            half,
            round: stream.range(0.01, 1.5) * half[0],
            speed: stream.range(-0.5, 0.5) * size,
            start: stream.unit() * SPACE * size,
        };
        let joint = |stream: &mut Stream| Joint {
            hinge: within(stream, DVec3::ONE) * size,
            swing: stream.pick(&[0.0, 0.3, 1.5]),
            phase: stream.range(0.0, 6.0),
        };
        let limb = |(place, &object): (usize, &u32)| {
            let joints = (0..1 + place % 3).map(|_| joint(&mut stream)).collect();
            Limb { object, joints }
        };
        let limbs = taken.iter().enumerate().map(limb).collect();
        let (pace, phase) = (stream.range(0.0, 1.0), stream.range(0.0, 6.0));
        figures.push(Figure { path, start: middle, pace, phase, limbs });
    }
    (!figures.is_empty()).then_some(Articulated { figures })
}

fn cameras(chosen: &Chosen, middle: DVec3, size: f64) -> Vec<CameraPath> {
    let mut camera = Stream::new(chosen.seed, "camera");
    // Outside looking in, anywhere inside, or still.
    let inside = camera.below(2) == 0;
    let poses = camera.pick(&[1, 2, 2, 3, 5]);
    let pose = |camera: &mut Stream| {
        let place = within(camera, DVec3::new(SPACE, SPACE * 0.3, SPACE));
        let away = if inside { place } else { place + DVec3::new(0.0, 0.0, SPACE * 2.0) };
        let target = within(camera, DVec3::splat(SPACE * 0.4));
        // A pose must look somewhere.
        let target = if target == away { away + DVec3::NEG_Z } else { target };
        CameraPose { eye: middle + away * size, target: middle + target * size }
    };
    let path = |camera: &mut Stream| {
        let poses: Vec<CameraPose> = (0..poses).map(|_| pose(camera)).collect();
        let travel = if camera.below(5) == 0 { Travel::Jump } else { Travel::Glide };
        let near = camera.pick(&[0.1, 0.1, 0.001, 2.0]) * size;
        let degrees: f64 = camera.pick(&[60.0, 60.0, 60.0, 90.0, 5.0, 150.0]);
        let lens = match camera.below(8) {
            0 => Lens::Orthographic { height: camera.range(2.0, 2.0 * SPACE) * size },
            1 => Lens::Perspective {
                fov_y: degrees.to_radians(),
                shift: [camera.range(-1.0, 1.0), camera.range(-1.0, 1.0)],
            },
            _ => Lens::perspective(degrees.to_radians()),
        };
        let endless = camera.below(6) == 0 && matches!(lens, Lens::Perspective { .. });
        let far = if endless { f64::INFINITY } else { camera.range(2.0, 6.0) * SPACE * size };
        CameraPath { poses, duration: chosen.frames, travel, lens, near, far }
    };
    let views = if camera.below(8) == 0 { 2 } else { 1 };
    (0..views).map(|_| path(&mut camera)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::generate::{Knobs, build};

    /// Every choice is made by some seeds and left by others.
    #[test]
    fn seeds_make_worlds_of_every_kind() {
        let scenes: Vec<Scene> = (0..200)
            .map(|seed| build("swarm", &Knobs { seed: Some(seed), ..Knobs::default() }).unwrap())
            .collect();
        let both = |of: &dyn Fn(&Scene) -> bool| {
            let count = scenes.iter().filter(|scene| of(scene)).count();
            assert!((10..=190).contains(&count), "{count} of 200");
        };
        both(&|scene| scene.effects.motion.is_some());
        both(&|scene| scene.effects.articulated.is_some());
        both(&|scene| scene.effects.teleport.is_some());
        both(&|scene| scene.cameras.len() == 2);
        both(&|scene| scene.cameras[0].far.is_infinite());
        both(&|scene| scene.cameras[0].travel == Travel::Jump);
        both(&|scene| matches!(scene.cameras[0].lens, Lens::Orthographic { .. }));
        both(&|scene| scene.objects.len() > 50);
        both(&|scene| scene.objects.iter().any(|object| object.placement.shear != DVec3::ZERO));
        let average = scenes.iter().map(|scene| scene.objects.len()).sum::<usize>() / 200;
        assert!((40..65).contains(&average), "{average} objects");
        for mesh in scenes.iter().flat_map(|scene| &scene.meshes) {
            let triangles = mesh.triangles().len() as u32;
            assert!((TRIANGLES[0]..=TRIANGLES[1] + 20).contains(&triangles), "{triangles}");
        }
    }
}
