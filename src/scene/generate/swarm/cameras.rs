//! Cameras: from outside, from inside and from very far away; still, on their way, or by a part of a pixel
//! a frame.

use glam::DVec3;

use super::{SPACE, Site, within};
use crate::scene::generate::Chosen;
use crate::scene::generate::rim::axes;
use crate::scene::{CameraPath, CameraPose, Lens, Stream, Travel};

/// One or two cameras.
pub(super) fn cameras(chosen: &Chosen, site: Site) -> Vec<CameraPath> {
    let mut camera = Stream::new(chosen.seed, "camera");
    let views = if camera.below(8) == 0 { 2 } else { 1 };
    // Outside looking in, anywhere inside, or still.
    let inside = camera.below(2) == 0;
    let poses = camera.pick(&[1, 2, 2, 3, 5]);
    // Now and then from so far away that a lens of a degree or a tenth sees the space.
    let long = if camera.below(8) == 0 { camera.pick(&[1.0, 0.1]) } else { 0.0 };
    let slides = camera.below(6) == 0;
    (0..views)
        .map(|_| {
            let path = path(&mut camera, chosen, site, (poses, inside, long));
            if slides { sliding(&mut camera, chosen, path) } else { path }
        })
        .collect()
}

fn path(
    camera: &mut Stream,
    chosen: &Chosen,
    Site { middle, size }: Site,
    (poses, inside, long): (u32, bool, f64),
) -> CameraPath {
    let degrees: f64 = camera.pick(&[60.0, 60.0, 60.0, 90.0, 5.0, 150.0]);
    let degrees = if long > 0.0 { long } else { degrees };
    // As far away as a lens of sixty degrees sees as much from two lengths of the space.
    let away = if long > 0.0 { SPACE * 2.0 / degrees.to_radians() } else { 0.0 };
    let pose = |camera: &mut Stream| {
        let place = within(camera, DVec3::new(SPACE, SPACE * 0.3, SPACE));
        let eye = if inside { place } else { place + DVec3::new(0.0, 0.0, SPACE * 2.0) };
        let target = within(camera, DVec3::splat(SPACE * 0.4));
        // A pose must look somewhere.
        let target = if target == eye { eye + DVec3::NEG_Z } else { target };
        let eye = eye + (eye - target).normalize() * away;
        CameraPose { eye: middle + eye * size, target: middle + target * size }
    };
    let poses: Vec<CameraPose> = (0..poses).map(|_| pose(camera)).collect();
    let travel = if camera.below(5) == 0 { Travel::Jump } else { Travel::Glide };
    let near = camera.pick(&[0.1, 0.1, 0.001, 2.0]) * size;
    let lens = match camera.below(7) {
        0 => Lens::Orthographic { height: camera.range(2.0, 2.0 * SPACE) * size },
        1 => Lens::Perspective {
            fov_y: degrees.to_radians(),
            shift: [camera.range(-1.0, 1.0), camera.range(-1.0, 1.0)],
        },
        _ => Lens::perspective(degrees.to_radians()),
    };
    let endless = camera.below(6) == 0 && matches!(lens, Lens::Perspective { .. });
    let far = (camera.range(2.0, 6.0) * SPACE + away) * size;
    let far = if endless { f64::INFINITY } else { far };
    CameraPath { poses, duration: chosen.frames, travel, lens, near, far }
}

/// The same camera at the first of its poses, on its way aside by a part of a pixel a frame: things come
/// past edges one sample at a time.
fn sliding(camera: &mut Stream, chosen: &Chosen, path: CameraPath) -> CameraPath {
    let from = path.poses[0];
    let first = path.at(0);
    let (right, up) = axes(&first);
    let high = first.lens.height_at(from.eye.distance(from.target));
    let pixel = high / f64::from(chosen.viewport.height);
    let along = (right * camera.range(-1.0, 1.0) + up * camera.range(-1.0, 1.0)) * pixel;
    let way = along * f64::from(chosen.frames);
    let to = CameraPose { eye: from.eye + way, target: from.target + way };
    CameraPath { poses: vec![from, to], travel: Travel::Glide, ..path }
}
