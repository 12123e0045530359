//! Hard cameras: near planes, eyes and lenses where projections go wrong, and viewports of odd sizes.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

use super::{Builder, Placement, SMALL, Site, cube, glide, pose, scaled, wall};
use crate::scene::generate::{Chosen, Generator, shape};
use crate::scene::{CameraPath, DepthOrder, Lens, Scene, SceneError, Stream, Travel, Viewport};

pub(super) const NEAR_PLANE: Generator = Generator {
    name: "hard/near-plane",
    summary: "the near plane cuts boxes and triangles, long ones among them",
    build: near_plane,
    ..SMALL
};

fn near_plane(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(4.0)), 60, true);
    // Few large triangles: their vertices are on both sides of the eye.
    let beam = site.mesh(cube(DVec3::new(0.3, 0.3, 40.0), 1));
    let across = site.mesh(cube(DVec3::new(60.0, 0.2, 0.2), 1));
    for x in [-1.5, 0.4, 2.0] {
        site.at(beam, x, 0.3 * x, 0.0);
        site.at(across, 0.0, 0.7 - x, 2.0 * x);
    }
    let poses = [pose([0.0, 0.0, 7.0], [0.0, 0.0, 0.0]), pose([0.3, 0.2, -3.0], [1.0, 0.0, -9.0])];
    // A tenth of the scene lies before the near plane.
    Ok(site.finish(chosen, NEAR_PLANE.name, glide(chosen, &poses, 70.0, [0.8, 30.0])))
}

pub(super) const EYE_ON_BOX: Generator = Generator {
    name: "hard/eye-on-box",
    summary: "the eye in boxes and exactly on their faces, edges and corners",
    frames: 13,
    build: eye_on_box,
    ..SMALL
};

fn eye_on_box(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // A row of boxes from −1 to 1 in every axis but one, each with something inside.
    let hull = site.mesh(cube(DVec3::splat(2.0), 4));
    let inner = site.mesh(cube(DVec3::splat(0.5), 6));
    for step in -3..=3 {
        let z = 4.0 * f64::from(step);
        site.at(hull, 0.0, 0.0, z);
        site.at(inner, 0.1, -0.2, z);
        site.at(inner, 2.5, 0.5, z + 1.0);
    }
    let eyes = [
        [0.0, 0.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 1.0, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 1.0, 0.0],
        [0.0, 1.0, 1.0],
        [1.0, 1.0, 1.0],
        [-1.0, -1.0, -1.0],
        // An ulp inside and outside of a face.
        [0.0, 0.0, 1.0f64.next_down()],
        [0.0, 0.0, 1.0f64.next_up()],
        [0.35, 0.05, 0.0],
        [0.1, -0.2, 0.25],
        [0.0, 0.0, 2.0],
    ];
    let poses = eyes.map(|eye: [f64; 3]| pose(eye, [eye[0] + 0.3, eye[1] - 0.1, eye[2] - 5.0]));
    let camera = glide(chosen, &poses, 80.0, [0.01, 40.0]);
    let camera = CameraPath { travel: Travel::Jump, duration: poses.len() as u32 - 1, ..camera };
    Ok(site.finish(chosen, EYE_ON_BOX.name, camera))
}

pub(super) const EYE_ON_PLANE: Generator = Generator {
    name: "hard/eye-on-plane",
    summary: "the eye slides along the planes that split the scene, and looks along them",
    build: eye_on_plane,
    ..SMALL
};

fn eye_on_plane(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // Boxes on a grid: splitting planes go through their faces, at whole numbers.
    let mesh = site.mesh(cube(DVec3::new(1.0, 2.0, 1.0), 3));
    for x in -4..4 {
        for z in -4..4 {
            site.at(mesh, f64::from(x) * 2.0 + 0.5, 0.0, f64::from(z) * 2.0 + 0.5);
        }
    }
    let poses = [
        pose([0.0, 0.0, 9.0], [0.0, 0.0, 0.0]),
        pose([0.0, 0.0, 0.0], [0.0, 0.0, -9.0]),
        pose([1.0, 1.0, 1.0], [9.0, 1.0, 1.0]),
    ];
    Ok(site.finish(chosen, EYE_ON_PLANE.name, glide(chosen, &poses, 75.0, [0.05, 40.0])))
}

pub(super) const ORTHOGRAPHIC: Generator = Generator {
    name: "hard/orthographic",
    summary: "parallel rays: no eye to be near to, depth that is linear",
    build: orthographic,
    ..SMALL
};

fn orthographic(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(5.0)), 60, true);
    let screen = site.mesh(wall(6.0, 5.0, 8));
    site.at(screen, 1.0, 0.5, 3.0);
    let poses = [pose([2.0, 3.0, 12.0], [0.0, 0.0, 0.0]), pose([-3.0, 1.0, 6.0], [0.0, 0.0, 0.0])];
    // The near plane cuts through the crowd at the end.
    let camera = glide(chosen, &poses, 60.0, [3.0, 20.0]);
    let camera = CameraPath { lens: Lens::Orthographic { height: 9.0 }, ..camera };
    Ok(site.finish(chosen, ORTHOGRAPHIC.name, camera))
}

pub(super) const ASYMMETRIC: Generator = Generator {
    name: "hard/asymmetric",
    summary: "a frustum whose axis is far off the middle, as of one eye or a tile of screens",
    build: asymmetric,
    ..SMALL
};

fn asymmetric(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::new(12.0, 6.0, 6.0)), 90, true);
    let screen = site.mesh(wall(5.0, 6.0, 8));
    site.at(screen, 6.0, 1.0, 7.0);
    let poses = [pose([0.0, 0.0, 14.0], [0.0, 0.0, 0.0]), pose([1.0, 1.0, 9.0], [0.5, 0.0, 0.0])];
    let camera = glide(chosen, &poses, 60.0, [0.1, 50.0]);
    // The view direction itself is outside the picture.
    let lens = Lens::Perspective { fov_y: 1.0, shift: [1.3, -0.4] };
    Ok(site.finish(chosen, ASYMMETRIC.name, CameraPath { lens, ..camera }))
}

pub(super) const TELEPHOTO: Generator = Generator {
    name: "hard/telephoto",
    summary: "a field of view of one degree: planes that nearly coincide",
    build: telephoto,
    ..SMALL
};

fn telephoto(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(5.0)), 60, true);
    let screen = site.mesh(wall(3.0, 3.0, 8));
    site.at(screen, -1.0, 0.5, 100.0);
    let poses =
        [pose([0.0, 20.0, 500.0], [0.0, 0.0, 0.0]), pose([9.0, 20.0, 500.0], [1.0, 0.0, 0.0])];
    Ok(site.finish(chosen, TELEPHOTO.name, glide(chosen, &poses, 1.0, [1.0, 600.0])))
}

pub(super) const WIDE_ANGLE: Generator = Generator {
    name: "hard/wide-angle",
    summary: "a field of view of 170 degrees: planes that are nearly one",
    build: wide_angle,
    ..SMALL
};

fn wide_angle(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(6.0)), 120, true);
    let poses = [pose([0.0, 0.0, 3.0], [0.0, 0.0, 0.0]), pose([1.0, 0.5, -3.0], [3.0, 0.0, -4.0])];
    Ok(site.finish(chosen, WIDE_ANGLE.name, glide(chosen, &poses, 170.0, [0.01, 40.0])))
}

pub(super) const INFINITE_FAR: Generator = Generator {
    name: "hard/infinite-far",
    summary: "no far plane: things from a hand's breadth to ten million units away",
    build: infinite_far,
    ..SMALL
};

fn infinite_far(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    receding(&mut site, chosen, 8);
    let poses = [pose([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]), pose([0.0, 0.1, 0.0], [0.02, 0.1, -1.0])];
    let camera = glide(chosen, &poses, 60.0, [0.1, f64::INFINITY]);
    Ok(site.finish(chosen, INFINITE_FAR.name, camera))
}

pub(super) const DEPTH_RATIO: Generator = Generator {
    name: "hard/depth-ratio",
    summary: "a far plane ten million times farther than the near one",
    build: depth_ratio,
    ..SMALL
};

fn depth_ratio(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    receding(&mut site, chosen, 6);
    let poses = [pose([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]), pose([0.0, 0.1, 0.0], [0.02, 0.1, -1.0])];
    Ok(site.finish(chosen, DEPTH_RATIO.name, glide(chosen, &poses, 60.0, [0.1, 1.0e6])))
}

pub(super) const REVERSED_DEPTH: Generator = Generator {
    name: "hard/reversed-depth",
    summary: "depth from 1 near to 0 far, and a far plane ten million times farther than the near one",
    depth: DepthOrder::Reversed,
    build: reversed_depth,
    ..SMALL
};

fn reversed_depth(chosen: &Chosen) -> Result<Scene, SceneError> {
    let scene = depth_ratio(chosen)?;
    Ok(Scene { name: REVERSED_DEPTH.name.to_owned(), ..scene })
}

pub(super) const REVERSED_INFINITE: Generator = Generator {
    name: "hard/reversed-infinite",
    summary: "reversed depth without a far plane: twelve decades of distance, told apart to the end",
    depth: DepthOrder::Reversed,
    build: reversed_infinite,
    ..SMALL
};

fn reversed_infinite(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    receding(&mut site, chosen, 12);
    let poses = [pose([0.0, 0.0, 0.0], [0.0, 0.0, -1.0]), pose([0.0, 0.1, 0.0], [0.02, 0.1, -1.0])];
    let camera = glide(chosen, &poses, 60.0, [0.1, f64::INFINITY]);
    Ok(site.finish(chosen, REVERSED_INFINITE.name, camera))
}

pub(super) const REVERSED_NEAR: Generator = Generator {
    name: "hard/reversed-near",
    summary: "the near plane goes through boxes and triangles, where reversed depth is 1",
    depth: DepthOrder::Reversed,
    build: reversed_near,
    ..SMALL
};

fn reversed_near(chosen: &Chosen) -> Result<Scene, SceneError> {
    let scene = (NEAR_PLANE.build)(chosen)?;
    Ok(Scene { name: REVERSED_NEAR.name.to_owned(), ..scene })
}

/// Blobs and boxes ahead, each decade of distance ten times larger: the picture of each is alike, and
/// what is behind differs from it by the last bits of depth.
fn receding(site: &mut Site, chosen: &Chosen, decades: i32) {
    let meshes = [site.mesh(cube(DVec3::ONE, 5)), site.mesh(shape::blob(200, chosen.seed))];
    let mut place = Stream::new(chosen.seed, "placement");
    for decade in -1..decades {
        let size = libm::pow(10.0, f64::from(decade));
        for number in 0..scaled(chosen, 6) {
            let ahead = -size * place.range(2.0, 12.0);
            let (x, y) = (place.range(-0.6, 0.6) * ahead, place.range(-0.45, 0.45) * ahead);
            let placement = Placement {
                scale: DVec3::splat(size * place.range(0.3, 1.0)),
                ..Placement::at(DVec3::new(x, y, ahead))
            };
            site.put(meshes[number as usize % 2], placement);
        }
    }
}

pub(super) const STRAIGHT_DOWN: Generator = Generator {
    name: "hard/straight-down",
    summary: "the view direction passes through the world's up and down",
    frames: 16,
    build: straight_down,
    ..SMALL
};

fn straight_down(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::new(8.0, 2.0, 8.0)), 80, true);
    let floor = site.mesh(cube(DVec3::new(6.0, 0.2, 6.0), 8));
    site.at(floor, 1.0, 0.5, 0.0);
    let poses = [
        pose([0.0, 9.0, 4.0], [0.0, 0.0, 0.0]),
        pose([0.0, 9.0, 0.0], [0.0, 0.0, 0.0]),
        pose([0.0, 9.0, -4.0], [0.0, 0.0, 0.0]),
        pose([0.0, -9.0, 0.0], [0.0, 0.0, 0.0]),
    ];
    Ok(site.finish(chosen, STRAIGHT_DOWN.name, glide(chosen, &poses, 65.0, [0.1, 40.0])))
}

pub(super) const EDGE_OF_VIEW: Generator = Generator {
    name: "hard/edge-of-view",
    summary: "faces on the very planes of the frustum, and ulps to either side",
    viewport: Viewport { width: 240, height: 240 },
    build: edge_of_view,
    ..SMALL
};

fn edge_of_view(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // A right angle: the planes are |x| = |z|, |y| = |z|.
    for (number, ulps) in (-8..=8).enumerate() {
        let z = -3.0 - 0.5 * number as f64;
        let moved = |at: f64| {
            let bits = (at as f32).to_bits().wrapping_add_signed(ulps);
            f64::from(f32::from_bits(bits))
        };
        // A thin plate that begins at the plane, outside of it or an ulp or so inside.
        let mut mesh = Builder::default();
        let edge = moved(-z);
        mesh.cuboid(DVec3::new(edge, -0.5, z - 0.25), DVec3::new(edge + 2.0, 0.5, z), 0.5, 4);
        mesh.cuboid(DVec3::new(-0.5, edge, z - 0.25), DVec3::new(0.5, edge + 2.0, z), 0.5, 4);
        mesh.cuboid(DVec3::new(-edge - 2.0, -0.5, z - 0.25), DVec3::new(-edge, 0.5, z), 0.5, 4);
        mesh.cuboid(DVec3::new(-0.5, -edge - 2.0, z - 0.25), DVec3::new(0.5, -edge, z), 0.5, 4);
        let mesh = site.mesh(mesh.finish("plate"));
        site.at(mesh, 0.0, 0.0, 0.0);
        // Beside the near and the far plane.
        let end = site.mesh(wall(0.4, 0.4, 2));
        let across = 0.05 * number as f64 - 0.4;
        site.at(end, across, 0.1, moved(-1.0));
        site.at(end, 40.0 * across, 3.0, moved(-64.0));
    }
    let poses = [pose([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])];
    let camera = glide(chosen, &poses, 90.0, [1.0, 64.0]);
    let camera = CameraPath { lens: Lens::perspective(FRAC_PI_2), ..camera };
    Ok(site.finish(chosen, EDGE_OF_VIEW.name, camera))
}

/// The same crowd for every viewport.
fn crowd(chosen: &Chosen, name: &str) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::splat(5.0)), 60, true);
    let screen = site.mesh(wall(4.0, 3.0, 8));
    site.at(screen, 0.5, 0.5, 5.5);
    let poses = [pose([0.0, 1.0, 11.0], [0.0, 0.0, 0.0]), pose([4.0, 1.0, 7.0], [0.0, 0.0, 0.0])];
    Ok(site.finish(chosen, name, glide(chosen, &poses, 60.0, [0.1, 30.0])))
}

pub(super) const ONE_PIXEL: Generator = Generator {
    name: "hard/one-pixel",
    summary: "a viewport of one pixel",
    viewport: Viewport { width: 1, height: 1 },
    build: |chosen| crowd(chosen, "hard/one-pixel"),
    ..SMALL
};

pub(super) const ONE_ROW: Generator = Generator {
    name: "hard/one-row",
    summary: "a viewport one pixel high",
    viewport: Viewport { width: 640, height: 1 },
    build: |chosen| crowd(chosen, "hard/one-row"),
    ..SMALL
};

pub(super) const ONE_COLUMN: Generator = Generator {
    name: "hard/one-column",
    summary: "a viewport one pixel wide",
    viewport: Viewport { width: 1, height: 480 },
    build: |chosen| crowd(chosen, "hard/one-column"),
    ..SMALL
};

pub(super) const ODD_VIEWPORT: Generator = Generator {
    name: "hard/odd-viewport",
    summary: "a viewport with odd sides that no power of two is near to",
    viewport: Viewport { width: 331, height: 197 },
    build: |chosen| crowd(chosen, "hard/odd-viewport"),
    ..SMALL
};

pub(super) const WIDE_VIEWPORT: Generator = Generator {
    name: "hard/wide-viewport",
    summary: "a viewport 8192 pixels wide: the guard band is near its sides",
    viewport: Viewport { width: 8192, height: 48 },
    frames: 6,
    build: wide_viewport,
    ..SMALL
};

fn wide_viewport(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::ZERO, DVec3::new(70.0, 3.0, 8.0)), 80, true);
    let poses = [pose([0.0, 0.0, 14.0], [0.0, 0.0, 0.0]), pose([9.0, 0.2, 12.0], [9.0, 0.0, 0.0])];
    // Three degrees high, a hundred and fifty wide.
    Ok(site.finish(chosen, WIDE_VIEWPORT.name, glide(chosen, &poses, 3.0, [0.1, 90.0])))
}

pub(super) const STEREO: Generator = Generator {
    name: "hard/stereo",
    summary: "two eyes: what one of them sees past an edge the other does not",
    build: stereo,
    ..SMALL
};

fn stereo(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    site.crowd(chosen, (DVec3::new(0.0, 0.0, -4.0), DVec3::new(6.0, 4.0, 3.0)), 80, true);
    // Posts near the eyes hide different things from each.
    let post = site.mesh(cube(DVec3::new(0.25, 5.0, 0.25), 8));
    for x in [-1.2, -0.4, 0.4, 1.2] {
        site.at(post, x, 0.0, 3.0);
    }
    // Eyes wide apart look straight ahead; their lenses are shifted so that both see the same scene.
    let eye = |side: f64| {
        let poses = [
            pose([side, 0.0, 8.0], [side, 0.0, 0.0]),
            pose([side + 1.0, 0.5, 5.0], [side + 1.2, 0.0, 0.0]),
        ];
        let lens = Lens::Perspective { fov_y: 60.0_f64.to_radians(), shift: [side * 0.4, 0.0] };
        CameraPath { lens, ..glide(chosen, &poses, 60.0, [0.1, 30.0]) }
    };
    Ok(site.finish_views(chosen, STEREO.name, vec![eye(-0.5), eye(0.5)]))
}

pub(super) const SPLIT_SCREEN: Generator = Generator {
    name: "hard/split-screen",
    summary: "two players back to back: what is hidden from one is before the other",
    build: split_screen,
    ..SMALL
};

fn split_screen(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    for z in [-6.0, 6.0] {
        site.crowd(chosen, (DVec3::new(0.0, 0.0, z), DVec3::new(5.0, 3.0, 2.5)), 40, true);
        let screen = site.mesh(wall(5.0, 4.0, 6));
        site.at(screen, 0.5, 0.0, z * 0.5);
    }
    let player = |ahead: f64, fov_y: f64| {
        let poses = [
            pose([0.0, 0.0, ahead * 0.5], [0.0, 0.0, ahead * 9.0]),
            pose([2.0, 0.3, -ahead], [0.0, 0.0, ahead * 9.0]),
        ];
        glide(chosen, &poses, fov_y, [0.05, 30.0])
    };
    Ok(site.finish_views(chosen, SPLIT_SCREEN.name, vec![player(-1.0, 70.0), player(1.0, 50.0)]))
}

pub(super) const LAST_COLUMN: Generator = Generator {
    name: "hard/last-column",
    summary: "things that show in the last column and row alone, in an image of odd sides",
    viewport: Viewport { width: 323, height: 243 },
    build: last_column,
    ..SMALL
};

fn last_column(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut site = Site::default();
    // One unit before the eye the picture is 2 units high; a pixel is so wide there.
    let pixel = 2.0 / f64::from(chosen.viewport.height);
    let (half_width, half_height) = (f64::from(chosen.viewport.width) * pixel * 0.5, 1.0);
    // A wall over all but a pixel and a half of the right and the lower edge.
    let gap = 1.5 * pixel;
    let (width, height) = (2.0 * half_width + 1.0 - gap, 2.0 * half_height + 1.0 - gap);
    let screen = site.mesh(wall(width, height, 4));
    site.at(screen, -(0.5 + gap * 0.5), 0.5 + gap * 0.5, -1.0);
    // Behind it, what reaches from the wall's middle into the gap, each a little less far than the last.
    let bar = site.mesh(cube(DVec3::new(1.0, 0.1, 0.1), 3));
    let post = site.mesh(cube(DVec3::new(0.1, 1.0, 0.1), 3));
    let mut place = Stream::new(chosen.seed, "placement");
    for number in 0..scaled(chosen, 12) {
        let depth = 2.0 + f64::from(number) * 0.25;
        let reach = 0.5 - place.range(-0.5, 1.5) * pixel * depth;
        let along = place.range(-0.9, 0.8);
        site.at(bar, half_width * depth - reach, along * depth, -depth);
        site.at(post, along * depth, -half_height * depth + reach, -depth);
    }
    let poses = [pose([0.0, 0.0, 0.0], [0.0, 0.0, -1.0])];
    Ok(site.finish(chosen, LAST_COLUMN.name, glide(chosen, &poses, 90.0, [0.1, 30.0])))
}
