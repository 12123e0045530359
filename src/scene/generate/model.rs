//! `model`: an imported model as it is, each of its groups an object; nothing moves but the camera.
//! The scene is called `model-` and the stem of the file, so that reports tell models apart.
//! `--scale` repeats it: scale 2 puts a second copy beside the first, and so on.

use std::sync::Arc;

use glam::DVec3;

use super::{CameraMode, Chosen};
use crate::math::{Aabb, cos, sin};
use crate::scene::{
    CameraPath, CameraPose, Effects, Lens, Object, Placement, Scene, SceneError, Travel, import,
};

/// Poses of the camera round a model.
const POSES: u32 = 16;

pub(super) fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let Some(path) = &chosen.mesh else {
        let (knob, range) = ("--mesh", "a model file for the scene 'model'");
        return Err(SceneError::Knob { knob, range, got: "none".to_owned() });
    };
    let meshes = import::model(path)?;
    let bounds = Aabb::of_points(meshes.iter().flat_map(|mesh| mesh.positions()));
    let copies = chosen.scale.round().max(1.0) as u32;
    let step = DVec3::X * bounds.size().x * 1.1;
    let objects = (0..copies)
        .flat_map(|copy| {
            let placement = Placement::at(step * f64::from(copy));
            (0..meshes.len() as u32).map(move |mesh| Object { mesh, placement })
        })
        .collect();
    Ok(Scene {
        name: format!("model-{}", path.file_stem().unwrap_or_default().to_string_lossy()),
        seed: chosen.seed,
        meshes: meshes.into_iter().map(Arc::new).collect(),
        objects,
        cameras: vec![camera(chosen, &bounds)],
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects: Effects::default(),
    })
}

fn camera(chosen: &Chosen, bounds: &Aabb) -> CameraPath {
    // A model of one point still has a view.
    let size = bounds.size().max(DVec3::splat(1e-3 * bounds.max_abs().max_element() + 1e-6));
    let (center, radius) = (bounds.center(), size.length() * 0.5);
    let pose = |i: u32| {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(POSES);
        let around = DVec3::new(cos(angle), 0.0, sin(angle));
        match chosen.camera {
            CameraMode::Orbit => {
                let eye = center + (around + DVec3::Y * 0.35) * radius * 1.8;
                CameraPose { eye, target: center }
            }
            CameraMode::Inside => {
                // Along the longer side at a fifth of the height, looking about.
                let along = f64::from(i) / f64::from(POSES) - 0.5;
                let path = if size.x >= size.z { DVec3::X * size.x } else { DVec3::Z * size.z };
                let eye = center + path * along * 0.6 - DVec3::Y * size.y * 0.3;
                CameraPose { eye, target: eye + (around + DVec3::Y * 0.1) * radius }
            }
        }
    };
    let (near, far) = (radius * 1e-3, radius * 6.0);
    let poses = (0..=POSES).map(pose).collect();
    CameraPath {
        poses,
        duration: chosen.frames,
        travel: Travel::Glide,
        lens: Lens::perspective(1.0),
        near,
        far,
    }
}
