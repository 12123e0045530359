//! Hard times: jumps, verdicts that flip from frame to frame, things that stop and go, long runs.

use glam::DVec3;

use super::{Builder, SMALL, Site, cube, glide, pose, scaled, wall};
use crate::scene::generate::{Chosen, Generator, shape};
use crate::scene::{CameraPath, Scene, SceneError, Stream, Travel, Viewport};

pub(super) const TELEPORTS: Generator = Generator {
    name: "hard/teleports",
    summary: "camera and objects jump: nothing that was remembered holds",
    frames: 18,
    build: teleports,
    ..SMALL
};

fn teleports(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(5.0)), 60, true);
    let mut motion = Stream::new(chosen.seed, "jumps");
    for object in 0..site.objects.len() as u32 {
        let mut along = |reach: f64| motion.range(-reach, reach);
        let offsets = [0; 3].map(|_| DVec3::new(along(9.0), along(9.0), along(9.0)));
        if object % 2 == 0 {
            site.jump(object, 1 + object % 5, &offsets);
        }
    }
    let poses = [
        pose([0.0, 1.0, 11.0], [0.0, 0.0, 0.0]),
        pose([0.5, 0.0, 0.0], [9.0, 0.0, 1.0]),
        pose([0.5, 0.0, 0.0], [-9.0, 0.0, 1.0]),
        pose([9.0, 5.0, -9.0], [0.0, 0.0, 0.0]),
        pose([0.0, 1.0, 11.0], [0.0, 0.0, 22.0]),
        pose([0.0, 1.0, 11.0], [0.0, 0.0, 0.0]),
    ];
    let camera = glide(chosen, &poses, 70.0, [0.05, 60.0]);
    let camera = CameraPath { travel: Travel::Jump, ..camera };
    Ok(site.finish(chosen, TELEPORTS.name, camera))
}

pub(super) const PING_PONG: Generator = Generator {
    name: "hard/ping-pong",
    summary: "a wall that is there in every other frame: each verdict flips",
    frames: 24,
    build: ping_pong,
    ..SMALL
};

fn ping_pong(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(4.0)), 60, false);
    let screen = site.mesh(wall(9.0, 9.0, 6));
    let shutter = site.at(screen, 0.0, 0.0, 5.0);
    site.jump(shutter, 1, &[DVec3::ZERO, DVec3::Y * 20.0]);
    // Others with periods of two, three and seven: their verdicts meet every postponement.
    for (number, period) in [2, 3, 7].into_iter().enumerate() {
        let small = site.mesh(wall(3.0, 9.0, 6));
        let object = site.at(small, 3.0 * number as f64 - 3.0, 0.0, 4.5);
        site.jump(object, period, &[DVec3::ZERO, DVec3::Y * 20.0]);
    }
    let poses = [pose([0.0, 0.0, 10.0], [0.0, 0.0, 0.0])];
    Ok(site.finish(chosen, PING_PONG.name, glide(chosen, &poses, 60.0, [0.1, 30.0])))
}

pub(super) const CUSP: Generator = Generator {
    name: "hard/cusp",
    summary: "the eye crosses the faces of boxes by less than a float, there and back",
    frames: 24,
    build: cusp,
    ..SMALL
};

fn cusp(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let hull = site.mesh(cube(DVec3::splat(2.0), 5));
    let inner = site.mesh(shape::blob(200, chosen.seed));
    for x in [-3.0, 0.0, 3.0] {
        site.at(hull, x, 0.0, 0.0);
        site.at(inner, x, 0.0, -4.0);
    }
    // The near plane, and then the eye, on the face at z = 1.
    const NEAR: f64 = 0.25;
    let poses: Vec<_> = [1.0 + NEAR, 1.0]
        .into_iter()
        .flat_map(|z: f64| {
            let single = z as f32;
            [-2, -1, 0, 1, 2, 0].map(|ulps: i32| {
                let bits = single.to_bits().wrapping_add_signed(ulps);
                let z = f64::from(f32::from_bits(bits));
                pose([0.1, 0.0, z], [0.1, 0.0, z - 1.0])
            })
        })
        .collect();
    let camera = glide(chosen, &poses, 70.0, [NEAR, 30.0]);
    let camera = CameraPath { travel: Travel::Jump, duration: poses.len() as u32 - 1, ..camera };
    Ok(site.finish(chosen, CUSP.name, camera))
}

pub(super) const STOP_AND_GO: Generator = Generator {
    name: "hard/stop-and-go",
    summary: "things stand still until their boxes are tight, and then are elsewhere",
    frames: 32,
    build: stop_and_go,
    ..SMALL
};

fn stop_and_go(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(4.0)), 60, false);
    let mut motion = Stream::new(chosen.seed, "jumps");
    for object in 0..site.objects.len() as u32 {
        let mut along = |reach: f64| motion.range(-reach, reach);
        // Near enough to stay in their nodes, as a rule, and to come out of a tight box.
        let offsets = [DVec3::ZERO, DVec3::new(along(1.2), along(1.2), along(1.2))];
        if object % 4 == 0 {
            site.jump(object, 7 + object % 3, &offsets);
        }
    }
    let screen = site.mesh(wall(4.0, 4.0, 6));
    site.at(screen, 0.5, 0.0, 5.0);
    let poses = [pose([0.0, 1.0, 10.0], [0.0, 0.0, 0.0]), pose([1.0, 1.0, 10.0], [0.0, 0.0, 0.0])];
    Ok(site.finish(chosen, STOP_AND_GO.name, glide(chosen, &poses, 60.0, [0.1, 30.0])))
}

pub(super) const OUT_OF_SPACE: Generator = Generator {
    name: "hard/out-of-space",
    summary: "objects leave the space that the index was built over, and come back",
    frames: 40,
    build: out_of_space,
    ..SMALL
};

fn out_of_space(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(4.0)), 50, true);
    let mut motion = Stream::new(chosen.seed, "jumps");
    for object in 0..site.objects.len() as u32 {
        let mut along = |reach: f64| motion.range(-reach, reach);
        let away = DVec3::new(along(30.0), along(10.0), along(30.0));
        if object % 3 == 0 {
            site.jump(object, 5 + object % 7, &[DVec3::ZERO, away, away * 2.0]);
        }
    }
    let poses = [pose([0.0, 4.0, 26.0], [0.0, 0.0, 0.0]), pose([9.0, 4.0, 22.0], [0.0, 0.0, 0.0])];
    Ok(site.finish(chosen, OUT_OF_SPACE.name, glide(chosen, &poses, 70.0, [0.1, 120.0])))
}

pub(super) const LONG_RUN: Generator = Generator {
    name: "hard/long-run",
    summary: "ten thousand frames, so that counters of postponed questions come round",
    viewport: Viewport { width: 64, height: 48 },
    frames: 10_000,
    build: long_run,
    ..SMALL
};

fn long_run(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let mesh = site.mesh(shape::blob(100, chosen.seed));
    let mut place = Stream::new(chosen.seed, "placement");
    for number in 0..scaled(chosen, 14) {
        let mut along = |reach: f64| place.range(-reach, reach);
        let (x, y, z) = (along(4.0), along(3.0), along(4.0));
        let object = site.at(mesh, x, y, z);
        if number % 3 == 0 {
            // Long at rest: longer than any wait, and than what a byte counts.
            let period = [97, 300, 701, 1201, 2000][number as usize / 3 % 5];
            site.jump(object, period, &[DVec3::ZERO, DVec3::new(along(4.0), along(3.0), 0.0)]);
        }
    }
    let screen = site.mesh(wall(3.0, 3.0, 4));
    let shutter = site.at(screen, 0.0, 0.0, 5.0);
    site.jump(shutter, 509, &[DVec3::ZERO, DVec3::X * 2.0, DVec3::Y * 9.0]);
    // There and back again in a thousand frames.
    let poses = [pose([-2.0, 1.0, 11.0], [0.0, 0.0, 0.0]), pose([3.0, 0.0, 9.0], [0.0, 0.0, 0.0])];
    let camera = glide(chosen, &poses, 60.0, [0.1, 30.0]);
    Ok(site.finish(chosen, LONG_RUN.name, CameraPath { duration: 500, ..camera }))
}

pub(super) const PEEPING: Generator = Generator {
    name: "hard/peeping",
    summary: "things at rest behind a wall show past its edge, their middles still behind it, then wholly",
    frames: 40,
    build: peeping,
    ..SMALL
};

fn peeping(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    let screen = site.mesh(wall(8.0, 8.0, 6));
    site.at(screen, 0.0, 0.0, 5.0);
    let thing = site.mesh(cube(DVec3::new(3.0, 0.8, 0.8), 4));
    let mut place = Stream::new(chosen.seed, "placement");
    // What hides at rest is past the edge in the other half of the time: by less than half of its length,
    // or by all of it.
    for number in 0..scaled(chosen, 24) {
        let side = if number % 2 == 0 { 1.0 } else { -1.0 };
        let (y, z) = (place.range(-3.0, 3.0), place.range(-6.0, -1.0));
        let edge = 4.0 * (11.0 - z) / 6.0;
        let object = site.at(thing, side * (edge - 2.5), y, z);
        let out = if number % 3 == 0 { 5.0 } else { 2.3 + place.range(0.0, 0.15) };
        site.jump(object, 8 + number % 5, &[DVec3::ZERO, DVec3::X * (side * out)]);
    }
    let posts = site.mesh(cube(DVec3::new(0.3, 6.0, 0.3), 3));
    for x in [-24.0, 24.0] {
        site.at(posts, x, 0.0, -4.0);
    }
    let poses = [pose([0.0, 0.0, 11.0], [0.0, 0.0, 0.0])];
    Ok(site.finish(chosen, PEEPING.name, glide(chosen, &poses, 80.0, [0.1, 60.0])))
}

pub(super) const STRAYS: Generator = Generator {
    name: "hard/strays",
    summary: "the camera turns from the space that the index was built over to what has left it",
    frames: 24,
    build: strays,
    ..SMALL
};

fn strays(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(3.0)), 40, false);
    for object in (0..site.objects.len() as u32).step_by(4) {
        let far = DVec3::new(0.0, 0.0, 30.0);
        site.jump(object, 3 + object % 3, &[DVec3::ZERO, far, far * 1.2]);
    }
    let poses = [
        pose([0.0, 1.0, 12.0], [0.0, 0.0, 0.0]),
        pose([0.0, 1.0, 13.0], [9.0, 0.0, 20.0]),
        pose([0.0, 1.0, 14.0], [0.0, 0.0, 30.0]),
    ];
    Ok(site.finish(chosen, STRAYS.name, glide(chosen, &poses, 60.0, [0.1, 80.0])))
}

pub(super) const SLITS: Generator = Generator {
    name: "hard/slits",
    summary: "things behind a wall with slits stand still until boxes are tight, then show in a slit",
    frames: 30,
    build: slits,
    ..SMALL
};

fn slits(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // The eye is 6 before the wall and 9 before the things: what is x there is x · 1.5 here.
    const PITCH: f64 = 2.5;
    let columns = scaled(chosen, 8);
    let middle = f64::from(columns - 1) * 0.5;
    let mut panels = Builder::default();
    for column in 0..columns {
        let x = (f64::from(column) - middle) * PITCH;
        let corner = DVec3::new(x - 1.0, -4.0, 0.0);
        panels.grid(corner, DVec3::X * 2.0, DVec3::Y * 8.0, [1, 4], |_, _| DVec3::ZERO);
    }
    let panels = site.mesh(panels.finish("panels"));
    site.at(panels, 0.0, 0.0, 3.0);
    let thing = site.mesh(cube(DVec3::new(0.8, 1.2, 0.4), 3));
    let mut rest = Stream::new(chosen.seed, "rest");
    for column in 0..columns {
        let x = (f64::from(column) - middle) * PITCH * 1.5;
        for y in [-1.5, 1.5] {
            // Right of the panel's middle, and then in the slit to its left, within the same node.
            let object = site.at(thing, x + 0.6, y, 0.0);
            site.jump(object, 7 + rest.below(4), &[DVec3::ZERO, DVec3::X * -2.4]);
        }
    }
    let poses = [pose([0.0, 0.0, 9.0], [0.0, 0.0, 0.0])];
    Ok(site.finish(chosen, SLITS.name, glide(chosen, &poses, 75.0, [0.1, 40.0])))
}
