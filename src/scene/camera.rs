//! The camera and its path.

use glam::{DMat4, DVec3, DVec4};

use super::Viewport;
use crate::math;

/// A perspective camera at one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position in the world.
    pub eye: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// Full vertical field of view, radians in (0, π).
    pub fov_y: f64,
    /// Distance of the near plane along `forward`, > 0.
    pub near: f64,
    /// Distance of the far plane, > near.
    pub far: f64,
}

impl Camera {
    /// Clip from world in f64: x right, y up, z from 0 at the near plane to w at the far plane.
    /// World y is up; where `forward` is parallel to it, world z is taken instead.
    #[must_use]
    pub fn clip_from_world(&self, viewport: Viewport) -> DMat4 {
        let f = self.forward;
        let up = if f.x == 0.0 && f.z == 0.0 { DVec3::Z } else { DVec3::Y };
        let right = f.cross(up).normalize();
        let up = right.cross(f);
        let view = DMat4::from_cols(
            DVec4::new(right.x, up.x, -f.x, 0.0),
            DVec4::new(right.y, up.y, -f.y, 0.0),
            DVec4::new(right.z, up.z, -f.z, 0.0),
            DVec4::new(-right.dot(self.eye), -up.dot(self.eye), f.dot(self.eye), 1.0),
        );
        let scale_y = 1.0 / math::tan(self.fov_y * 0.5);
        let scale_x = scale_y * f64::from(viewport.height) / f64::from(viewport.width);
        let depth = self.far / (self.near - self.far);
        let projection = DMat4::from_cols(
            DVec4::new(scale_x, 0.0, 0.0, 0.0),
            DVec4::new(0.0, scale_y, 0.0, 0.0),
            DVec4::new(0.0, 0.0, depth, -1.0),
            DVec4::new(0.0, 0.0, depth * self.near, 0.0),
        );
        projection * view
    }
}

/// Eye and point looked at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Position in the world.
    pub eye: DVec3,
    /// The point in the middle of the picture; must differ from `eye`.
    pub target: DVec3,
}

/// A camera flying through key poses, straight and at an even pace between two of them.
#[derive(Clone, Debug)]
pub struct CameraPath {
    /// At least one pose. The first is at t = 0, the last at t = `duration`; the path is walked back
    /// and forth beyond that, so that every t has a pose.
    pub poses: Vec<CameraPose>,
    /// Frames from the first pose to the last, at least 1.
    pub duration: u32,
    /// Full vertical field of view in radians.
    pub fov_y: f64,
    /// Near plane distance.
    pub near: f64,
    /// Far plane distance.
    pub far: f64,
}

impl CameraPath {
    /// The camera of frame `t`.
    ///
    /// # Panics
    /// Without poses.
    #[must_use]
    pub fn at(&self, t: u32) -> Camera {
        assert!(!self.poses.is_empty(), "a camera path has at least one pose");
        let duration = self.duration.max(1);
        let phase = t % (2 * duration);
        let folded = if phase <= duration { phase } else { 2 * duration - phase };
        let along = f64::from(folded) / f64::from(duration) * (self.poses.len() - 1) as f64;
        let from = (along as usize).min(self.poses.len() - 1);
        let to = (from + 1).min(self.poses.len() - 1);
        let part = along - from as f64;
        let mix = |a: DVec3, b: DVec3| a + (b - a) * part;
        let eye = mix(self.poses[from].eye, self.poses[to].eye);
        let target = mix(self.poses[from].target, self.poses[to].target);
        let forward = (target - eye).normalize();
        Camera { eye, forward, fov_y: self.fov_y, near: self.near, far: self.far }
    }
}
