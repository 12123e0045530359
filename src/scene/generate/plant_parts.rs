//! What a power plant is made of: meshes for `powerplant`. Sizes are in the plant's world units,
//! about metres; each mesh has its origin at a lower corner or at the middle of its foot.

use glam::DVec3;

use super::powerplant::{BAY, HEIGHT};
use super::shape::{Builder, rounded};
use crate::math::sin;
use crate::scene::{Mesh, Stream};

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn flat(_: f64, _: f64) -> DVec3 {
    DVec3::ZERO
}

/// A plain bar of twelve triangles.
fn bar(mesh: &mut Builder, min: DVec3, size: DVec3) {
    mesh.cuboid(min, min + size, f64::INFINITY, 1);
}

/// A handrail: two tubes on posts from `from` to `to`.
fn rail(mesh: &mut Builder, from: DVec3, to: DVec3) {
    let posts = (from.distance(to) / 1.5).ceil() as u32;
    for height in [0.5, 1.0] {
        let up = DVec3::Y * height;
        mesh.tube(&rounded(&[from + up, to + up], 0.1, 1, 1.5), 0.025, 6);
    }
    for post in 0..=posts {
        let foot = from.lerp(to, f64::from(post) / f64::from(posts));
        mesh.tube(&[foot, foot + DVec3::Y], 0.025, 6);
    }
}

/// A beam of I section along x, z or y: two flanges and a web.
fn beam(mesh: &mut Builder, from: DVec3, length: DVec3, depth: DVec3, width: DVec3) {
    let plate = |mesh: &mut Builder, at: DVec3, across: DVec3, thick: DVec3| {
        let (a, b) = (from + at, from + at + length + across + thick);
        mesh.cuboid(a.min(b), a.max(b), 2.0, 16);
    };
    plate(mesh, DVec3::ZERO, width, depth * 0.08);
    plate(mesh, depth * 0.92, width, depth * 0.08);
    plate(mesh, depth * 0.08 + width * 0.46, width * 0.08, depth * 0.84);
}

/// An open roof: trusses along x under purlins along z.
pub(super) fn roof() -> Mesh {
    let mut mesh = Builder::default();
    for truss in 0..6 {
        let z = 5.0 * f64::from(truss);
        for y in [0.0, 1.6] {
            beam(&mut mesh, v(0.0, y, z), DVec3::X * BAY, DVec3::Y * 0.3, DVec3::Z * 0.2);
        }
        for web in 0..15 {
            let x = 2.0 * f64::from(web);
            let [low, high] = if web % 2 == 0 { [0.2, 1.7] } else { [1.7, 0.2] };
            mesh.tube(&[v(x, low, z + 0.1), v(x + 2.0, high, z + 0.1)], 0.06, 8);
        }
    }
    for purlin in 0..20 {
        let x = 1.5 * f64::from(purlin);
        beam(&mut mesh, v(x, 1.9, 0.0), DVec3::Z * BAY, DVec3::Y * 0.2, DVec3::X * 0.1);
    }
    mesh.finish("roof")
}

pub(super) fn slab() -> Mesh {
    let mut mesh = Builder::default();
    mesh.cuboid(DVec3::ZERO, v(BAY, 0.4, BAY), 1.0, 30);
    mesh.finish("slab")
}

/// Height of the sheets round a bay; above them the plant is open.
const WALL_HEIGHT: f64 = 14.0;

/// A sheet of corrugated metal along x, with a doorway in its middle if `doorway`.
pub(super) fn wall(doorway: bool) -> Mesh {
    let mut mesh = Builder::default();
    let mut sheet = |x: [f64; 2], y: [f64; 2]| {
        let across = DVec3::X * (x[1] - x[0]);
        let cells = [((x[1] - x[0]) * 8.0) as u32, ((y[1] - y[0]) / 2.0).ceil() as u32];
        mesh.grid(v(x[0], y[0], 0.0), across, DVec3::Y * (y[1] - y[0]), cells, |u, _| {
            DVec3::Z * (0.06 * sin((x[0] + u * across.x) * std::f64::consts::TAU * 2.0))
        });
    };
    if doorway {
        let (left, right, top) = (BAY * 0.5 - 3.0, BAY * 0.5 + 3.0, 6.0);
        sheet([0.0, left], [0.0, WALL_HEIGHT]);
        sheet([right, BAY], [0.0, WALL_HEIGHT]);
        sheet([left, right], [top, WALL_HEIGHT]);
    } else {
        sheet([0.0, BAY], [0.0, WALL_HEIGHT]);
    }
    mesh.finish(if doorway { "doorway" } else { "wall" })
}

/// A furnace ten units square of vertical tubes before a membrane, with headers and a steam drum.
pub(super) fn boiler() -> Mesh {
    let mut mesh = Builder::default();
    let (half, height) = (5.0, 34.0);
    mesh.cuboid(v(-half, 2.0, -half), v(half, height, half), 1.0, 40);
    for side in 0..4 {
        for tube in 0..40 {
            let along = -half + 0.125 + 0.25 * f64::from(tube);
            let at = |y: f64, out: f64| match side {
                0 => v(along, y, half + out),
                1 => v(along, y, -half - out),
                2 => v(half + out, y, along),
                _ => v(-half - out, y, along),
            };
            let path = [at(1.0, 0.8), at(2.5, 0.1), at(height - 1.0, 0.1), at(height, 0.9)];
            mesh.tube(&rounded(&path, 0.6, 4, 2.0), 0.11, 8);
        }
        let header = |y: f64, out: f64| match side {
            0 => [v(-half, y, half + out), v(half, y, half + out)],
            1 => [v(-half, y, -half - out), v(half, y, -half - out)],
            2 => [v(half + out, y, -half), v(half + out, y, half)],
            _ => [v(-half - out, y, -half), v(-half - out, y, half)],
        };
        for (y, out) in [(1.0, 0.8), (34.0, 0.9), (12.0, 0.5), (22.0, 0.5)] {
            mesh.tube(&rounded(&header(y, out), 0.5, 1, 0.5), 0.3, 16);
        }
    }
    let drum: Vec<DVec3> =
        rounded(&[v(-7.0, height + 2.5, 0.0), v(7.0, height + 2.5, 0.0)], 1.0, 1, 0.25);
    mesh.tube(&drum, 1.3, 48);
    mesh.finish("boiler")
}

/// A casing of stepped cylinders along x, with ribs, on a table.
pub(super) fn turbine() -> Mesh {
    let mut mesh = Builder::default();
    let mut profile = vec![[0.0, -6.0]];
    for step in 0..=240 {
        let x = f64::from(step) / 240.0;
        let stage = (x * 4.0).floor() / 4.0;
        let rib = if step % 10 == 0 { 0.12 } else { 0.0 };
        profile.push([1.1 + 0.8 * sin(stage * 2.6 + 0.4) + rib, -6.0 + 12.0 * x]);
    }
    profile.push([0.0, 6.0]);
    mesh.lathe(DVec3::ZERO, &profile, 144);
    mesh.lay_along_x();
    mesh.cuboid(v(-7.0, -2.6, -2.2), v(7.0, -1.4, 2.2), 0.5, 30);
    mesh.finish("turbine")
}

/// A panel of grating six units square with rails on two sides.
pub(super) fn grating() -> Mesh {
    let mut mesh = Builder::default();
    for i in 0..150 {
        bar(&mut mesh, v(0.04 * f64::from(i), 0.0, 0.0), v(0.006, 0.05, 6.0));
    }
    for i in 0..60 {
        bar(&mut mesh, v(0.0, 0.02, 0.1 * f64::from(i)), v(6.0, 0.02, 0.01));
    }
    rail(&mut mesh, v(0.0, 0.05, 0.0), v(6.0, 0.05, 0.0));
    rail(&mut mesh, v(6.0, 0.05, 0.0), v(6.0, 0.05, 6.0));
    mesh.finish("grating")
}

/// A flight of stairs, four units up over six, with stringers and rails.
pub(super) fn stairs() -> Mesh {
    let mut mesh = Builder::default();
    for step in 0..20 {
        let at = v(0.3 * f64::from(step), 0.2 * f64::from(step + 1), 0.0);
        for slat in 0..6 {
            bar(&mut mesh, at + v(0.05 * f64::from(slat), 0.0, 0.05), v(0.03, 0.04, 0.9));
        }
    }
    for z in [0.0, 0.95] {
        let up = v(6.0, 4.0, 0.0);
        mesh.grid(v(0.0, 0.0, z), up, DVec3::Y * 0.3, [20, 1], flat);
        rail(&mut mesh, v(0.0, 0.2, z), v(6.0, 4.2, z));
    }
    mesh.finish("stairs")
}

/// A portal frame across the bay: columns, beams at each level, bracing.
pub(super) fn frame() -> Mesh {
    let mut mesh = Builder::default();
    for z in [0.2, 10.0, 20.0, 29.4] {
        beam(&mut mesh, v(0.0, 0.0, z), DVec3::Y * HEIGHT, DVec3::Z * 0.4, DVec3::X * 0.4);
    }
    for level in 1..=5 {
        let y = 8.0 * f64::from(level) - 0.6;
        beam(&mut mesh, v(0.0, y, 0.2), DVec3::Z * 29.6, DVec3::Y * 0.5, DVec3::X * 0.3);
        for z in [0.4, 20.2] {
            mesh.tube(&rounded(&[v(0.2, y - 7.0, z), v(0.2, y, z + 9.6)], 0.1, 1, 1.0), 0.08, 8);
        }
    }
    mesh.finish("frame")
}

/// A bundle of pipes along x through the bay, each with jogs of its own, on hangers.
pub(super) fn rack(shape: &mut Stream) -> Mesh {
    let mut mesh = Builder::default();
    for pipe in 0..18 {
        let radius = [0.05, 0.08, 0.12, 0.2][shape.below(4) as usize];
        let (mut y, mut z) = (0.55 * f64::from(pipe / 5), 0.55 * f64::from(pipe % 5));
        let mut corners = vec![v(0.0, y, z)];
        let mut x = 0.0;
        for _ in 0..4 {
            x += shape.range(3.0, 7.0);
            corners.push(v(x, y, z));
            if shape.below(2) == 0 {
                y += shape.range(-0.8, 0.8);
            } else {
                z += shape.range(-0.8, 0.8);
            }
            corners.push(v(x, y, z));
        }
        corners.push(v(BAY - 1.0, y, z));
        mesh.tube(&rounded(&corners, 2.5 * radius, 5, 1.0), radius, 10);
        // Flanges.
        for flange in [0.25, 0.6] {
            let at = corners[0] + (corners[1] - corners[0]) * flange;
            mesh.tube(&[at, at + DVec3::X * 0.08], radius * 1.6, 10);
        }
    }
    for hanger in 0..8 {
        let x = 1.0 + 4.0 * f64::from(hanger);
        beam(&mut mesh, v(x, -0.4, -0.3), DVec3::Z * 3.4, DVec3::Y * 0.15, DVec3::X * 0.12);
    }
    mesh.finish("rack")
}

/// A bundle of pipes that climbs the bay, with branches and valves' bodies.
pub(super) fn riser(shape: &mut Stream) -> Mesh {
    let mut mesh = Builder::default();
    for pipe in 0..12 {
        let radius = [0.06, 0.1, 0.18][shape.below(3) as usize];
        let (mut x, mut z) = (0.5 * f64::from(pipe % 4), 0.5 * f64::from(pipe / 4));
        let mut corners = vec![v(x, 0.0, z)];
        let mut y = 0.0;
        for _ in 0..5 {
            y += shape.range(4.0, 7.0);
            corners.push(v(x, y, z));
            if shape.below(2) == 0 {
                x += shape.range(-0.7, 0.7);
            } else {
                z += shape.range(-0.7, 0.7);
            }
            corners.push(v(x, y, z));
            let out = v(shape.range(-2.0, 2.0), 0.0, shape.range(-2.0, -0.5));
            let branch = [v(x, y - 1.0, z), v(x, y - 1.0, z) + out, v(x, y - 2.5, z) + out];
            mesh.tube(&rounded(&branch, 2.0 * radius, 4, 0.6), radius * 0.7, 8);
        }
        corners.push(v(x, HEIGHT - 2.0, z));
        mesh.tube(&rounded(&corners, 2.5 * radius, 5, 1.0), radius, 10);
    }
    mesh.finish("riser")
}

/// A globe valve with its wheel.
pub(super) fn valve() -> Mesh {
    let mut mesh = Builder::default();
    let round = |turn: f64| v(0.3 * crate::math::cos(turn), 1.3, 0.3 * sin(turn));
    let wheel: Vec<DVec3> =
        (0..=36).map(|i| round(std::f64::consts::TAU * f64::from(i) / 36.0)).collect();
    mesh.tube(&wheel, 0.03, 10);
    for spoke in 0..3 {
        let turn = std::f64::consts::TAU * f64::from(spoke) / 3.0;
        mesh.tube(&[v(0.0, 1.3, 0.0), round(turn)], 0.02, 8);
    }
    let body: Vec<[f64; 2]> = (0..=40)
        .map(|i| {
            let y = f64::from(i) / 40.0;
            [0.08 + 0.22 * sin(y * std::f64::consts::PI).abs() * (1.2 - y), 0.1 + 0.9 * y]
        })
        .collect();
    mesh.lathe(DVec3::ZERO, &body, 32);
    mesh.tube(&[v(0.0, 1.0, 0.0), v(0.0, 1.3, 0.0)], 0.03, 12);
    mesh.tube(&rounded(&[v(-0.8, 0.5, 0.0), v(0.8, 0.5, 0.0)], 0.1, 1, 0.1), 0.16, 24);
    mesh.finish("valve")
}

/// A motor and a pump on a frame.
pub(super) fn pump() -> Mesh {
    let mut mesh = Builder::default();
    let mut profile = vec![[0.0, -1.2]];
    for step in 0..=60 {
        let rib = if step % 3 == 0 { 0.05 } else { 0.0 };
        profile.push([0.4 + rib, -1.2 + 0.025 * f64::from(step)]);
    }
    profile.extend([[0.15, 0.3], [0.15, 0.6], [0.55, 0.6], [0.55, 1.0], [0.0, 1.0]]);
    mesh.lathe(DVec3::ZERO, &profile, 56);
    mesh.lay_along_x();
    mesh.cuboid(v(-1.4, -0.7, -0.6), v(1.2, -0.5, 0.6), 0.2, 12);
    mesh.finish("pump")
}

/// A vessel with domes, on legs, with a ladder.
pub(super) fn tank() -> Mesh {
    let mut mesh = Builder::default();
    let mut profile = vec![[0.0, 0.6]];
    for step in 0..=12 {
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(step) / 12.0;
        profile.push([1.5 * sin(turn), 1.2 - 0.6 * crate::math::cos(turn)]);
    }
    profile.extend((1..=24).map(|i| [1.5, 1.2 + 0.15 * f64::from(i)]));
    for step in 1..=12 {
        let turn = std::f64::consts::FRAC_PI_2 * f64::from(step) / 12.0;
        profile.push([1.5 * crate::math::cos(turn), 4.8 + 0.6 * sin(turn)]);
    }
    mesh.lathe(DVec3::ZERO, &profile, 80);
    for (x, z) in [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)] {
        mesh.tube(&[v(x, 0.0, z), v(x, 1.2, z)], 0.1, 12);
    }
    for z in [-0.25, 0.25] {
        mesh.tube(&rounded(&[v(1.6, 0.0, z), v(1.6, 5.0, z)], 0.1, 1, 0.5), 0.03, 8);
    }
    for rung in 0..16 {
        let y = 0.3 * f64::from(rung + 1);
        mesh.tube(&[v(1.6, y, -0.25), v(1.6, y, 0.25)], 0.02, 6);
    }
    mesh.finish("tank")
}

/// A rectangular duct with an elbow and stiffeners.
pub(super) fn duct() -> Mesh {
    let mut mesh = Builder::default();
    mesh.cuboid(v(0.0, 0.0, 0.0), v(8.0, 1.5, 1.5), 0.4, 24);
    mesh.cuboid(v(6.5, 1.5, 0.0), v(8.0, 5.0, 1.5), 0.4, 12);
    for i in 0..12 {
        let x = 0.6 * f64::from(i);
        mesh.cuboid(v(x, -0.08, -0.08), v(x + 0.06, 1.58, 1.58), 0.5, 4);
    }
    mesh.finish("duct")
}

pub(super) fn cabinet() -> Mesh {
    let mut mesh = Builder::default();
    mesh.cuboid(v(0.0, 0.0, 0.0), v(1.2, 2.0, 0.6), 0.4, 4);
    mesh.finish("cabinet")
}

pub(super) fn lamp() -> Mesh {
    let mut mesh = Builder::default();
    mesh.tube(&[v(0.0, 0.3, 0.0), v(0.0, 1.5, 0.0)], 0.02, 8);
    mesh.lathe(DVec3::ZERO, &[[0.0, 0.3], [0.15, 0.25], [0.3, 0.0], [0.0, 0.05]], 24);
    mesh.finish("lamp")
}
