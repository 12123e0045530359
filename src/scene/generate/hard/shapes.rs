//! Hard shapes: without thickness, without area, in one plane, seen through a pinhole or edge-on.

use glam::{DQuat, DVec3};

use super::{Builder, Placement, SMALL, Site, cube, glide, pose, scaled, wall};
use crate::scene::generate::{Chosen, Generator, shape};
use crate::scene::{CameraPath, Mesh, Scene, SceneError, Stream};

/// A camera that goes from side to side before the origin.
fn before(chosen: &Chosen) -> CameraPath {
    let poses = [pose([-2.0, 1.0, 9.0], [0.0, 0.0, 0.0]), pose([2.5, 0.5, 7.0], [0.5, 0.0, 0.0])];
    glide(chosen, &poses, 60.0, [0.1, 40.0])
}

pub(super) const FLAT: Generator = Generator {
    name: "hard/flat",
    summary: "boxes without thickness, lines and points, before and behind a wall",
    build: flat,
    ..SMALL
};

fn flat(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let sheet = site.mesh(wall(1.0, 1.0, 6));
    let screen = site.mesh(wall(3.0, 3.0, 8));
    let mesh = |corners: &[DVec3]| {
        let mut mesh = Builder::default();
        for i in 0..corners.len() {
            let next = |by: usize| corners[(i + by) % corners.len()];
            mesh.triangle([next(0), next(1), next(2)]);
        }
        mesh.finish("collapsed")
    };
    let line = site.mesh(mesh(&[DVec3::ZERO, DVec3::X, DVec3::X * 0.4]));
    let point = site.mesh(mesh(&[DVec3::ZERO; 3]));
    let lone = site.mesh(mesh(&[DVec3::ZERO, DVec3::X, DVec3::Y]));
    site.at(screen, 0.5, 0.0, 1.0);
    let mut place = Stream::new(chosen.seed, "placement");
    for number in 0..scaled(chosen, 60) {
        let mut along = |reach: f64| place.range(-reach, reach);
        let translation = DVec3::new(along(4.0), along(3.0), along(4.0));
        // A third of them in the planes of the axes, where their boxes have no thickness either.
        let quarter = std::f64::consts::FRAC_PI_2 * f64::from(number % 4);
        let rotation = match number % 3 {
            0 => DQuat::from_rotation_y(quarter),
            1 => DQuat::from_rotation_x(quarter),
            _ => DQuat::from_rotation_y(along(3.0)) * DQuat::from_rotation_x(along(3.0)),
        };
        let mesh = [sheet, line, lone, sheet, point][number as usize % 5];
        site.put(mesh, Placement { translation, rotation, ..Placement::IDENTITY });
    }
    Ok(site.finish(chosen, FLAT.name, before(chosen)))
}

pub(super) const NEEDLES: Generator = Generator {
    name: "hard/needles",
    summary: "needles, triangles without area and triangles between samples",
    build: needles,
    ..SMALL
};

fn needles(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let mut shape = Stream::new(chosen.seed, "shape");
    let mut point = |reach: f64| {
        DVec3::new(
            shape.range(-reach, reach),
            shape.range(-reach, reach),
            shape.range(-reach, reach),
        )
    };
    let mut meshes = Vec::new();
    for _ in 0..6 {
        let mut mesh = Builder::default();
        for number in 0..150 {
            let (at, along) = (point(1.0), point(1.5));
            let width = [0.0, 1e-7, 1e-4, 2e-3][number % 4];
            mesh.triangle(match number % 3 {
                0 => [at, at + along, at + along * 0.5 + point(width)],
                1 => [at, at + point(width), at + point(width)],
                _ => [at, at + along, at],
            });
        }
        meshes.push(site.mesh(mesh.finish("needles")));
    }
    let screen = site.mesh(wall(2.0, 3.0, 8));
    site.at(screen, 1.5, 0.0, 2.0);
    let mut place = Stream::new(chosen.seed, "placement");
    for number in 0..scaled(chosen, 40) {
        let mut along = |reach: f64| place.range(-reach, reach);
        let (x, y, z) = (along(4.0), along(3.0), along(4.0));
        site.at(meshes[number as usize % meshes.len()], x, y, z);
    }
    Ok(site.finish(chosen, NEEDLES.name, before(chosen)))
}

pub(super) const SPECKS: Generator = Generator {
    name: "hard/specks",
    summary: "things that cover one sample or none, far and near",
    build: specks,
    ..SMALL
};

fn specks(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let speck = site.mesh(cube(DVec3::splat(0.02), 1));
    let screen = site.mesh(wall(3.0, 3.0, 8));
    site.at(screen, -1.0, 0.0, 2.0);
    let mut place = Stream::new(chosen.seed, "placement");
    for _ in 0..scaled(chosen, 300) {
        let mut along = |reach: f64| place.range(-reach, reach);
        let (x, y, z) = (along(4.0), along(3.0), along(6.0));
        site.at(speck, x, y, z);
    }
    Ok(site.finish(chosen, SPECKS.name, before(chosen)))
}

pub(super) const COPLANAR: Generator = Generator {
    name: "hard/coplanar",
    summary: "duplicates and overlapping faces in one plane: nothing but the draw index decides",
    build: coplanar,
    ..SMALL
};

fn coplanar(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let sheets = [1, 3, 8].map(|cells| site.mesh(wall(2.0, 2.0, cells)));
    let block = site.mesh(cube(DVec3::splat(2.0), 4));
    for layer in 0..3 {
        let z = -1.5 * f64::from(layer);
        for (number, &sheet) in sheets.iter().enumerate() {
            // The same place, and half a sheet on.
            site.at(sheet, 0.0, 0.0, z);
            site.at(sheet, 1.0, 0.5 * number as f64, z);
            site.at(sheet, -2.0, 0.0, z);
        }
        // Twice, and once more with a face in the sheets' plane.
        site.at(block, 3.0, 0.0, z - 1.0);
        site.at(block, 3.0, 0.0, z - 1.0);
    }
    Ok(site.finish(chosen, COPLANAR.name, before(chosen)))
}

pub(super) const PINHOLES: Generator = Generator {
    name: "hard/pinholes",
    summary: "a wall with holes one pixel wide, and what shows through them",
    build: pinholes,
    ..SMALL
};

fn pinholes(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // Nine units away a pixel of 240 over 60 degrees is 0.043 wide.
    const HOLE: f64 = 0.045;
    const PITCH: f64 = 0.8;
    let mut mesh = Builder::default();
    let mut slab = |x0: f64, x1: f64, y0: f64, y1: f64| {
        let flat = |_: f64, _: f64| DVec3::ZERO;
        let (across, up) = (DVec3::X * (x1 - x0), DVec3::Y * (y1 - y0));
        mesh.grid(DVec3::new(x0, y0, 0.0), across, up, [1, 1], flat);
    };
    for column in -6..=6 {
        let x = PITCH * f64::from(column);
        slab(x + HOLE, x + PITCH, -5.0, 5.0);
        for row in -6..=6 {
            let y = PITCH * f64::from(row);
            slab(x, x + HOLE, y + HOLE, y + PITCH);
        }
    }
    let screen = site.mesh(mesh.finish("screen"));
    site.at(screen, 0.0, 0.0, 0.0);
    site.crowd(chosen, (DVec3::new(0.0, 0.0, -5.0), DVec3::new(5.0, 4.0, 3.0)), 80, true);
    Ok(site.finish(chosen, PINHOLES.name, before(chosen)))
}

pub(super) const GRAZING: Generator = Generator {
    name: "hard/grazing",
    summary: "walls that the camera sees edge-on, or nearly",
    frames: 17,
    build: grazing,
    ..SMALL
};

fn grazing(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let sheet = site.mesh(wall(12.0, 3.0, 10));
    let upright = DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2);
    let level = DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    for step in -4..=4 {
        let aside = 0.5 * f64::from(step);
        for rotation in [upright, level, upright * DQuat::from_rotation_y(1e-4)] {
            let translation = if rotation == level { DVec3::Y } else { DVec3::X } * aside;
            site.put(sheet, Placement { translation, rotation, ..Placement::IDENTITY });
        }
    }
    site.crowd(chosen, (DVec3::new(0.0, 0.0, -9.0), DVec3::splat(3.0)), 40, true);
    // From aside to aside, through the planes of the sheets.
    let poses =
        [pose([-1.0, 0.5, 9.0], [-1.0, 0.5, 0.0]), pose([1.0, -0.5, 7.0], [1.0, -0.5, 0.0])];
    Ok(site.finish(chosen, GRAZING.name, glide(chosen, &poses, 60.0, [0.1, 40.0])))
}

pub(super) const T_JUNCTIONS: Generator = Generator {
    name: "hard/t-junctions",
    summary: "neighbours that share an edge with other corners on it, light behind the cracks",
    build: t_junctions,
    ..SMALL
};

fn t_junctions(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let turn = DQuat::from_rotation_y(0.37) * DQuat::from_rotation_x(0.21);
    for column in -3..=3_i32 {
        // Edges with 7, 11, 13 … corners of their own, at places that no float holds.
        let cells = [7, 11, 13, 5, 17, 3, 19][(column + 3) as usize];
        let mut mesh = Builder::default();
        let origin = DVec3::new(f64::from(column) * 1.1, -4.0, 0.0);
        let flat = |_: f64, _: f64| DVec3::ZERO;
        mesh.grid(origin, DVec3::X * 1.1, DVec3::Y * 8.0, [2, cells], flat);
        let mesh = site.mesh(mesh.finish("strip"));
        site.put(mesh, Placement { rotation: turn, ..Placement::IDENTITY });
    }
    site.crowd(chosen, (DVec3::new(0.0, 0.0, -6.0), DVec3::splat(3.0)), 60, true);
    Ok(site.finish(chosen, T_JUNCTIONS.name, before(chosen)))
}

pub(super) const TOUCHING: Generator = Generator {
    name: "hard/touching",
    summary: "contents that touch their box, occluders that touch the contents",
    build: touching,
    ..SMALL
};

fn touching(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // A box is its own bounds; its front face is also the occluder's.
    let block = site.mesh(cube(DVec3::splat(1.0), 5));
    let inner = site.mesh(cube(DVec3::splat(0.999_999), 5));
    let face = site.mesh(wall(1.0, 1.0, 5));
    for x in -3..=3 {
        let x = 1.0 * f64::from(x);
        site.at(block, x, 0.0, 0.0);
        // Inside, with faces an ulp or two behind those around it.
        site.at(inner, x, 0.0, 0.0);
        site.at(inner, x, 1.0, 0.0);
        site.at(face, x, 1.0, 0.5);
        // The face behind an equal one, one float apart.
        site.at(face, x, -1.0, 0.5);
        site.at(face, x, -1.0, f64::from(0.5f32.next_down()));
    }
    Ok(site.finish(chosen, TOUCHING.name, before(chosen)))
}

pub(super) const BEHIND_A_GAP: Generator = Generator {
    name: "hard/behind-a-gap",
    summary: "a large slanted box whose near corner is aside, seen through a gap",
    build: behind_a_gap,
    ..SMALL
};

fn behind_a_gap(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let slab = site.mesh(cube(DVec3::new(14.0, 0.4, 3.0), 12));
    let screen = site.mesh(wall(5.0, 8.0, 8));
    // A gap of about a pixel's width.
    site.at(screen, -2.52, 0.0, 3.0);
    site.at(screen, 2.52, 0.0, 3.0);
    for number in 0..6 {
        let lean = 0.5 + 0.4 * f64::from(number);
        let rotation = DQuat::from_rotation_y(lean) * DQuat::from_rotation_z(lean * 0.7);
        let translation = DVec3::new(1.5 * f64::from(number) - 4.0, 0.0, -3.0 - f64::from(number));
        site.put(slab, Placement { translation, rotation, ..Placement::IDENTITY });
    }
    Ok(site.finish(chosen, BEHIND_A_GAP.name, before(chosen)))
}

pub(super) const LAYERS: Generator = Generator {
    name: "hard/layers",
    summary: "sixty walls one behind the other, with doors that never line up",
    build: layers,
    ..SMALL
};

fn layers(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let leaf = site.mesh(wall(6.0, 6.0, 5));
    for layer in 0..60 {
        let aside = [-3.5, 3.5, -3.1, 3.3][layer % 4];
        let z = 2.0 - 0.25 * layer as f64;
        site.at(leaf, aside, 0.0, z);
        site.at(leaf, aside + if aside < 0.0 { 6.4 } else { -6.4 }, 0.1, z);
    }
    Ok(site.finish(chosen, LAYERS.name, before(chosen)))
}

pub(super) const MANY: Generator = Generator {
    name: "hard/many",
    summary: "more things than a device counts right in one pass of queries",
    frames: 6,
    build: many,
    ..SMALL
};

fn many(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let block = site.mesh(cube(DVec3::splat(0.12), 1));
    for number in 0..scaled(chosen, 1000) {
        let (column, row, layer) = (number % 40, number / 40 % 20, number / 800);
        let x = 0.2 * f64::from(column) - 4.0;
        let y = 0.2 * f64::from(row) - 2.0;
        site.at(block, x, y, -0.5 * f64::from(layer));
    }
    Ok(site.finish(chosen, MANY.name, before(chosen)))
}

pub(super) const NOTHING: Generator = Generator {
    name: "hard/nothing",
    summary: "objects without triangles, and hardly anything else",
    frames: 4,
    build: nothing,
    ..SMALL
};

fn nothing(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let empty = site.mesh(Mesh::new("empty", Vec::new(), Vec::new())?);
    let unused = site.mesh(Mesh::new("unused", vec![[9.0, 9.0, 9.0]], Vec::new())?);
    site.mesh(shape::blob(64, chosen.seed));
    for x in [-1.0, 0.0, 1.0] {
        site.at(empty, x, 0.0, 0.0);
        site.at(unused, 0.0, x, 0.0);
    }
    Ok(site.finish(chosen, NOTHING.name, before(chosen)))
}
