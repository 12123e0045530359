//! Hard edges: things that reach into the view, past a shadow or to the end of the world by so little that
//! a bound which is a little too small loses them.

use glam::{DQuat, DVec3};

use super::{Builder, Placement, SMALL, Site, cube, glide, pose, scaled, wall};
use crate::scene::generate::rim::{SIDES, edge, longest, reaching};
use crate::scene::generate::{Chosen, Generator};
use crate::scene::{CameraPath, Lens, Mesh, Scene, SceneError, Stream};

/// A bar of four sides from −`reach` to `reach`.
fn bar(reach: DVec3, radius: f64) -> Mesh {
    let mut mesh = Builder::default();
    mesh.tube(&[-reach, reach], radius, 4);
    mesh.finish("bar")
}

/// How long bars are, world units from their middle to an end.
const ARM: f64 = 12.0;
/// How far a bar's end reaches into the view, of its arm.
const INSIDE: [f64; 2] = [0.01, 0.08];

/// Bars round a view whose ends reach into it; `shape` gives scale and shear of one, and the end of its mesh.
fn fringe(
    chosen: &Chosen,
    name: &str,
    fov_y: f64,
    shape: impl Fn(&mut Stream) -> (DVec3, DVec3, DVec3),
) -> Scene {
    let mut site = Site::default();
    let poses = [pose([3.0, -2.0, 1.0], [9.0, -5.0, -7.0])];
    let path = glide(chosen, &poses, fov_y, [0.1, 90.0]);
    let camera = path.at(0);
    let mut place = Stream::new(chosen.seed, "placement");
    for number in 0..scaled(chosen, 24) {
        let (scale, shear, tip) = shape(&mut place);
        let where_seen = (place.range(6.0, 16.0), place.range(-0.8, 0.8));
        let (point, inward) = edge(&camera, chosen.viewport, number % SIDES, where_seen);
        // Across the plane up to some 30 degrees from its normal.
        let aside = DVec3::from_array([0; 3].map(|_| place.range(-0.35, 0.35)));
        let towards = (inward + aside).normalize();
        let at = point + inward * (ARM * place.range(INSIDE[0], INSIDE[1]));
        let placed = reaching((scale, shear), tip, at, (towards, place.range(0.0, 6.2)));
        let mesh = site.mesh(bar(tip, tip.length() * 0.02));
        site.put(mesh, placed);
    }
    site.finish(chosen, name, path)
}

pub(super) const POLES: Generator = Generator {
    name: "hard/poles",
    summary: "unit bars stretched to poles, turned so that an end reaches just into the view",
    frames: 3,
    build: |chosen| {
        Ok(fringe(chosen, POLES.name, 80.0, |place| {
            let thin = place.range(0.5, 1.5);
            (DVec3::new(ARM, thin, thin), DVec3::ZERO, DVec3::X)
        }))
    },
    ..SMALL
};

pub(super) const SPARS: Generator = Generator {
    name: "hard/spars",
    summary: "bars along the direction that a shear lengthens most, an end just in the view",
    frames: 3,
    build: |chosen| {
        Ok(fringe(chosen, SPARS.name, 70.0, |place| {
            let shear =
                DVec3::new(place.range(0.8, 1.3), place.range(0.7, 1.2), place.range(0.8, 1.4));
            sheared(shear)
        }))
    },
    ..SMALL
};

pub(super) const CROSSED_SPARS: Generator = Generator {
    name: "hard/crossed-spars",
    summary: "bars that a shear of the other sign lengthens, while it shortens their box's diagonal",
    frames: 3,
    build: |chosen| {
        Ok(fringe(chosen, CROSSED_SPARS.name, 75.0, |place| {
            let lean = |place: &mut Stream| -place.range(0.7, 1.3);
            sheared(DVec3::new(lean(place), lean(place), lean(place)))
        }))
    },
    ..SMALL
};

/// A bar of unit scale under a shear, along the direction that it lengthens most, as long as all others in
/// the world.
fn sheared(shear: DVec3) -> (DVec3, DVec3, DVec3) {
    let (along, factor) = longest(DVec3::ONE, shear);
    (DVec3::ONE, shear, along * (ARM / factor))
}

pub(super) const WORLD_EDGE: Generator = Generator {
    name: "hard/world-edge",
    summary: "flat walls on the ends of the world, where `min + (max - min)` in f32 falls an ulp short",
    frames: 3,
    build: world_edge,
    ..SMALL
};

fn world_edge(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let mut ends = Stream::new(chosen.seed, "ends");
    let mut falls_short = || {
        loop {
            let (low, high) = (-ends.range(3.0, 9.0) as f32, ends.range(9.0, 20.0) as f32);
            if low + (high - low) < high {
                return (f64::from(low), f64::from(high));
            }
        }
    };
    let [x, y, z] = [falls_short(), falls_short(), falls_short()];
    let (low, high) = (DVec3::new(x.0, y.0, z.0), DVec3::new(x.1, y.1, z.1));
    // Walls on all six ends, a unit short of the corners.
    let (from, to) = (low + 1.0, high - 1.0);
    for axis in 0..3 {
        let [a, b] = [(axis + 1) % 3, (axis + 2) % 3];
        for end in [low, high] {
            let mut origin = from;
            origin[axis] = end[axis];
            let side = |axis: usize| DVec3::AXES[axis] * (to[axis] - from[axis]);
            let mut mesh = Builder::default();
            mesh.grid(origin, side(a), side(b), [3, 3], |_, _| DVec3::ZERO);
            let mesh = site.mesh(mesh.finish("end"));
            site.at(mesh, 0.0, 0.0, 0.0);
        }
    }
    let block = site.mesh(cube(DVec3::splat(0.7), 2));
    let mut place = Stream::new(chosen.seed, "placement");
    for _ in 0..scaled(chosen, 20) {
        let at = DVec3::from_array([0, 1, 2].map(|axis| place.range(from[axis], to[axis])));
        site.put(block, Placement::at(at));
    }
    let middle = (low + high) * 0.5;
    let poses =
        [pose(middle.to_array(), high.to_array()), pose(middle.to_array(), [high.x, 0.0, high.z])];
    Ok(site.finish(chosen, WORLD_EDGE.name, glide(chosen, &poses, 75.0, [0.1, 60.0])))
}

pub(super) const ENDLESS_SIDES: Generator = Generator {
    name: "hard/endless-sides",
    summary: "no far plane, and small things a hand's breadth inside the side planes, near the eye",
    frames: 4,
    build: endless_sides,
    ..SMALL
};

fn endless_sides(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let poses =
        [pose([1.0, 2.0, 3.0], [-5.0, 1.0, -4.0]), pose([1.0, 2.0, 3.0], [-5.0, 4.0, -3.0])];
    let path = glide(chosen, &poses, 65.0, [0.1, f64::INFINITY]);
    let thing = site.mesh(cube(DVec3::splat(0.08), 1));
    let mut place = Stream::new(chosen.seed, "placement");
    for number in 0..scaled(chosen, 96) {
        let camera = path.at(number % chosen.frames.max(1));
        let where_seen = (place.range(1.5, 8.0), place.range(-0.9, 0.9));
        let (point, inward) = edge(&camera, chosen.viewport, number / 4 % SIDES, where_seen);
        site.put(thing, Placement::at(point + inward * place.range(0.0, 0.3)));
    }
    Ok(site.finish(chosen, ENDLESS_SIDES.name, path))
}

pub(super) const PARALLEL_SHADOW: Generator = Generator {
    name: "hard/parallel-shadow",
    summary: "parallel rays: things beside the shadow of a wall, and behind one that the near plane cuts",
    frames: 4,
    build: parallel_shadow,
    ..SMALL
};

fn parallel_shadow(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // The eye is ten units before the origin; the near plane three units before the eye.
    let screen = site.mesh(wall(2.4, 2.4, 1));
    for x in [-3.0, 3.0] {
        site.at(screen, x, 0.0, 4.0);
    }
    // Its upper end is before the near plane and is cut off, its lower end well behind.
    let ramp = site.mesh(wall(3.0, 6.0, 1));
    let rotation = DQuat::from_rotation_x(0.9);
    site.put(ramp, Placement { rotation, ..Placement::at(DVec3::new(0.0, 1.0, 6.5)) });
    let thing = site.mesh(cube(DVec3::splat(0.16), 1));
    let mut place = Stream::new(chosen.seed, "placement");
    for _ in 0..scaled(chosen, 120) {
        let mut along = |reach: f64| place.range(-reach, reach);
        let (x, y, z) = (along(5.0), along(3.6), along(6.0) - 4.0);
        site.at(thing, x, y, z);
    }
    let poses = [pose([0.0, 0.0, 10.0], [0.0, 0.0, 0.0]), pose([0.3, 0.0, 10.0], [0.3, 0.0, 0.0])];
    let path = glide(chosen, &poses, 60.0, [3.0, 30.0]);
    let path = CameraPath { lens: Lens::Orthographic { height: 8.0 }, ..path };
    Ok(site.finish(chosen, PARALLEL_SHADOW.name, path))
}

pub(super) const BETWEEN_FLOATS: Generator = Generator {
    name: "hard/between-floats",
    summary: "a million units out, things that reach into the view by less than a float there resolves",
    frames: 3,
    build: between_floats,
    ..SMALL
};

fn between_floats(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // An ulp of a float there is an eighth of a unit or a sixteenth.
    let far = DVec3::new(-1.3e6, 0.6e6, 0.9e6);
    let poses = [pose((far + DVec3::new(0.4, 0.3, 2.0)).to_array(), far.to_array())];
    let path = glide(chosen, &poses, 50.0, [0.1, 30.0]);
    let camera = path.at(0);
    let thing = site.mesh(cube(DVec3::splat(0.3), 1));
    let mut place = Stream::new(chosen.seed, "placement");
    for number in 0..scaled(chosen, 64) {
        let where_seen = (place.range(1.5, 4.0), place.range(-0.9, 0.9));
        let (point, inward) = edge(&camera, chosen.viewport, number % SIDES, where_seen);
        // The corner that is farthest in.
        let corner = inward.signum() * 0.15;
        let inside = place.range(0.012, 0.04);
        site.put(thing, Placement::at(point + inward * inside - corner));
    }
    Ok(site.finish(chosen, BETWEEN_FLOATS.name, path))
}
