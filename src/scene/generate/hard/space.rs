//! Hard spaces: mirrored, flattened and sheared things, tiny and huge ones, far from the origin.

use glam::{DQuat, DVec3};

use super::{Placement, SMALL, Site, cube, glide, pose, scaled, wall};
use crate::scene::generate::{Chosen, Generator, shape};
use crate::scene::{CameraPath, Mesh, Path, Scene, SceneError, Stream};

/// A camera that goes from side to side before `middle`, all lengths times `unit`.
fn before(chosen: &Chosen, middle: DVec3, unit: f64) -> CameraPath {
    let at = |x: f64, y: f64, z: f64| (middle + DVec3::new(x, y, z) * unit).to_array();
    let poses =
        [pose(at(-2.0, 1.0, 9.0), at(0.0, 0.0, 0.0)), pose(at(2.5, 0.5, 7.0), at(0.5, 0.0, 0.0))];
    glide(chosen, &poses, 60.0, [0.1 * unit, 40.0 * unit])
}

pub(super) const SCALES: Generator = Generator {
    name: "hard/scales",
    summary: "negative, tiny, huge and uneven scale, shear, all at once",
    build: scales,
    ..SMALL
};

fn scales(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let mut place = Stream::new(chosen.seed, "placement");
    // Each mesh is as large as its objects are scaled down.
    for exponent in [-6, -2, 0, 3, 6] {
        let factor = libm::pow(10.0, f64::from(exponent));
        let mesh = shape::blob(160, chosen.seed);
        let positions: Vec<[f32; 3]> =
            mesh.positions().iter().map(|p| p.map(|c| (f64::from(c) / factor) as f32)).collect();
        let mesh = Mesh::new(format!("blob-{exponent}"), positions, mesh.triangles().to_vec())?;
        let mesh = site.mesh(mesh);
        for number in 0..scaled(chosen, 12) {
            let mut along = |reach: f64| place.range(-reach, reach);
            let translation = DVec3::new(along(4.0), along(3.0), along(4.0));
            let rotation = DQuat::from_rotation_y(along(3.0)) * DQuat::from_rotation_x(along(3.0));
            let mut scale = DVec3::new(1.0, 0.2 + along(0.1), 3.0) * factor * 0.3;
            let sign = |bit: u32| if number >> bit & 1 == 0 { 1.0 } else { -1.0 };
            scale *= DVec3::new(sign(0), sign(1), sign(2));
            let shear = DVec3::new(along(2.0), along(1.0), along(0.5));
            site.put(mesh, Placement { translation, rotation, scale, shear });
        }
    }
    let screen = site.mesh(wall(3.0, 3.0, 8));
    site.at(screen, 0.5, 0.0, 3.0);
    Ok(site.finish(chosen, SCALES.name, before(chosen, DVec3::ZERO, 1.0)))
}

pub(super) const COLLAPSED: Generator = Generator {
    name: "hard/collapsed",
    summary: "scales of zero: matrices without an inverse, things flattened to a plane or a point",
    build: collapsed,
    ..SMALL
};

fn collapsed(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(4.0)), 30, true);
    let mesh = site.mesh(shape::blob(300, chosen.seed));
    let mut place = Stream::new(chosen.seed, "flattened");
    for number in 0..scaled(chosen, 24) {
        let mut along = |reach: f64| place.range(-reach, reach);
        let translation = DVec3::new(along(4.0), along(3.0), along(4.0));
        let axis = |bit: u32| if number >> bit & 1 == 0 { 0.8 } else { 0.0 };
        let scale = DVec3::new(axis(0), axis(1), axis(2));
        let rotation = DQuat::from_rotation_y(along(3.0));
        site.put(mesh, Placement { translation, rotation, scale, ..Placement::IDENTITY });
    }
    Ok(site.finish(chosen, COLLAPSED.name, before(chosen, DVec3::ZERO, 1.0)))
}

/// How far "far" is, world units.
const FAR: DVec3 = DVec3::new(1.0e6, -7.5e5, 1.25e6);

pub(super) const FAR_FROM_ORIGIN: Generator = Generator {
    name: "hard/far-from-origin",
    summary: "objects and camera a million units from the origin",
    build: far_from_origin,
    ..SMALL
};

fn far_from_origin(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (FAR, DVec3::splat(4.0)), 60, true);
    let screen = site.mesh(wall(3.0, 3.0, 8));
    site.put(screen, Placement::at(FAR + DVec3::new(0.5, 0.0, 4.5)));
    Ok(site.finish(chosen, FAR_FROM_ORIGIN.name, before(chosen, FAR, 1.0)))
}

pub(super) const FAR_IN_MESH: Generator = Generator {
    name: "hard/far-in-mesh",
    summary: "meshes whose own coordinates are a million units from their origin: f32 jitters by pixels",
    build: far_in_mesh,
    ..SMALL
};

fn far_in_mesh(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let mut place = Stream::new(chosen.seed, "placement");
    for exponent in [3, 4, 5, 6] {
        let far = DVec3::new(1.0, -0.75, 1.25) * libm::pow(10.0, f64::from(exponent));
        let blob = shape::blob(300, chosen.seed);
        let moved = |p: &[f32; 3]| (DVec3::from(p.map(f64::from)) + far).as_vec3().to_array();
        let positions = blob.positions().iter().map(moved).collect();
        let mesh = Mesh::new(format!("blob-{exponent}"), positions, blob.triangles().to_vec())?;
        let mesh = site.mesh(mesh);
        for _ in 0..scaled(chosen, 10) {
            let mut along = |reach: f64| place.range(-reach, reach);
            let at = DVec3::new(along(4.0), along(3.0), along(4.0));
            site.put(mesh, Placement::at(at - far));
        }
    }
    let screen = site.mesh(wall(3.0, 3.0, 8));
    site.at(screen, 0.5, 0.0, 4.5);
    Ok(site.finish(chosen, FAR_IN_MESH.name, before(chosen, DVec3::ZERO, 1.0)))
}

pub(super) const TINY_WORLD: Generator = Generator {
    name: "hard/tiny-world",
    summary: "a scene a millionth of a unit across",
    build: tiny_world,
    ..SMALL
};

fn tiny_world(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    const UNIT: f64 = 1.0e-7;
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(4.0 * UNIT)), 60, true);
    let screen = site.mesh(wall(3.0 * UNIT, 3.0 * UNIT, 8));
    site.at(screen, 0.5 * UNIT, 0.0, 4.5 * UNIT);
    Ok(site.finish(chosen, TINY_WORLD.name, before(chosen, DVec3::ZERO, UNIT)))
}

pub(super) const OVERFLOW: Generator = Generator {
    name: "hard/overflow",
    summary: "coordinates near the end of f32, whose products and lengths overflow",
    build: overflow,
    ..SMALL
};

fn overflow(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(4.0)), 40, true);
    // Whole: 10³⁸ in every direction; and things of that size scaled down to what is seen.
    let huge = site.mesh(cube(DVec3::splat(2.0e38), 3));
    for exponent in [-37, -36, -20, 0] {
        let scale = DVec3::splat(libm::pow(10.0, f64::from(exponent)));
        let x = f64::from(exponent) * 0.1 + 3.0;
        let translation = DVec3::new(x, 1.0, -1.0);
        site.put(huge, Placement { translation, scale, ..Placement::IDENTITY });
    }
    let block = site.mesh(cube(DVec3::ONE, 3));
    site.at(block, 1.0e30, 0.0, -1.0e30);
    Ok(site.finish(chosen, OVERFLOW.name, before(chosen, DVec3::ZERO, 1.0)))
}

pub(super) const PIVOTS: Generator = Generator {
    name: "hard/pivots",
    summary: "things that turn about a pivot far outside of them, across the edges of the view",
    build: pivots,
    ..SMALL
};

fn pivots(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let mut place = Stream::new(chosen.seed, "placement");
    let mut motion = Stream::new(chosen.seed, "motion");
    let blob = shape::blob(160, chosen.seed);
    for arm in [2.0, 4.0, 6.0] {
        let moved = |p: &[f32; 3]| [p[0] + arm, p[1], p[2]];
        let positions = blob.positions().iter().map(moved).collect();
        let mesh =
            site.mesh(Mesh::new(format!("arm-{arm}"), positions, blob.triangles().to_vec())?);
        for _ in 0..scaled(chosen, 14) {
            let mut along = |reach: f64| place.range(-reach, reach);
            let translation = DVec3::new(along(6.0), along(3.0), along(4.0));
            let rotation = DQuat::from_rotation_y(along(3.0)) * DQuat::from_rotation_z(along(3.0));
            let scale = DVec3::splat(0.5);
            let object =
                site.put(mesh, Placement { translation, rotation, scale, ..Placement::IDENTITY });
            // On the spot: what moves is what hangs on the arm.
            let (min, max) = (translation, translation);
            let spin = motion.range(-0.4, 0.4);
            site.movers.push((object, Path::Reflect { velocity: DVec3::ZERO, min, max, spin }));
        }
    }
    let screen = site.mesh(wall(3.0, 3.0, 8));
    site.at(screen, 0.5, 0.0, 4.5);
    Ok(site.finish(chosen, PIVOTS.name, before(chosen, DVec3::ZERO, 1.0)))
}
