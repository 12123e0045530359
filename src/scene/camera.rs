//! The camera and its path.

use glam::{DMat4, DVec3, DVec4};

use super::{DepthOrder, Viewport};
use crate::math;

/// How a camera turns directions into places in the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// Rays from the eye.
    Perspective {
        /// Full vertical field of view, radians in (0, π).
        fov_y: f64,
        /// Where the direction `forward` appears, from the middle of the picture: shares of half its
        /// width (positive: to the left of the middle) and height (positive: below). Zero is the
        /// symmetric frustum; one eye of a headset or a tile of a wall of screens has another.
        shift: [f64; 2],
    },
    /// Parallel rays along `forward`. What is before the near plane is cut off as ever.
    Orthographic {
        /// World units from the bottom of the picture to its top, > 0.
        height: f64,
    },
}

impl Lens {
    /// A symmetric perspective of full vertical field of view `fov_y`, radians in (0, π).
    #[must_use]
    pub const fn perspective(fov_y: f64) -> Self {
        Self::Perspective { fov_y, shift: [0.0; 2] }
    }

    /// World units from the bottom of the picture to its top, `distance` along `forward`.
    #[must_use]
    pub fn height_at(&self, distance: f64) -> f64 {
        match *self {
            Self::Perspective { fov_y, .. } => 2.0 * math::tan(fov_y * 0.5) * distance,
            Self::Orthographic { height } => height,
        }
    }
}

/// A camera at one frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Position in the world.
    pub eye: DVec3,
    /// Unit view direction.
    pub forward: DVec3,
    /// How directions become places in the picture.
    pub lens: Lens,
    /// Distance of the near plane along `forward`, > 0.
    pub near: f64,
    /// Distance of the far plane, > near. With a perspective it may be infinite: then nothing is too
    /// far, and depth comes near 1 without reaching it.
    pub far: f64,
}

impl Camera {
    /// Clip from world in f64: x right, y up, z from 0 at the near plane to w at the far plane, or from
    /// −w to 0 where depth is reversed: an engine's z there, its sign turned ([`DepthOrder::Reversed`]).
    /// World y is up; where `forward` is parallel to it, world z is taken instead.
    #[must_use]
    pub fn clip_from_world(&self, viewport: Viewport, depth: DepthOrder) -> DMat4 {
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
        self.projection(viewport, depth) * view
    }

    /// Clip from view space, whose z goes backwards.
    fn projection(&self, viewport: Viewport, depth: DepthOrder) -> DMat4 {
        let aspect = f64::from(viewport.height) / f64::from(viewport.width);
        match self.lens {
            Lens::Perspective { fov_y, shift } => {
                let scale_y = 1.0 / math::tan(fov_y * 0.5);
                // z is slope·z_view + offset. Forward: far / (near − far), which goes to −1, and near
                // times that. Reversed, less w: near / (near − far), which goes to 0, and far times that,
                // which goes to −near.
                let (slope, offset) = match (depth, self.far.is_finite()) {
                    (DepthOrder::Forward, true) => {
                        let slope = self.far / (self.near - self.far);
                        (slope, slope * self.near)
                    }
                    (DepthOrder::Forward, false) => (-1.0, -self.near),
                    (DepthOrder::Reversed, true) => {
                        let slope = self.near / (self.near - self.far);
                        (slope, slope * self.far)
                    }
                    (DepthOrder::Reversed, false) => (0.0, -self.near),
                };
                DMat4::from_cols(
                    DVec4::new(scale_y * aspect, 0.0, 0.0, 0.0),
                    DVec4::new(0.0, scale_y, 0.0, 0.0),
                    DVec4::new(shift[0], shift[1], slope, -1.0),
                    DVec4::new(0.0, 0.0, offset, 0.0),
                )
            }
            Lens::Orthographic { height } => {
                let (scale_y, slope) = (2.0 / height, 1.0 / (self.near - self.far));
                // Where z is 0.
                let at = match depth {
                    DepthOrder::Forward => self.near,
                    DepthOrder::Reversed => self.far,
                };
                DMat4::from_cols(
                    DVec4::new(scale_y * aspect, 0.0, 0.0, 0.0),
                    DVec4::new(0.0, scale_y, 0.0, 0.0),
                    DVec4::new(0.0, 0.0, slope, 0.0),
                    DVec4::new(0.0, 0.0, slope * at, 1.0),
                )
            }
        }
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

/// How a camera gets from one pose to the next.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Travel {
    /// Straight and at an even pace.
    #[default]
    Glide,
    /// It stays at each pose and is at the next one a frame later: what was remembered is of no use.
    Jump,
}

/// A camera's way through key poses.
#[derive(Clone, Debug)]
pub struct CameraPath {
    /// At least one pose. The first is at t = 0, the last at t = `duration`; the path is walked back
    /// and forth beyond that, so that every t has a pose.
    pub poses: Vec<CameraPose>,
    /// Frames from the first pose to the last, at least 1.
    pub duration: u32,
    /// How it gets from pose to pose.
    pub travel: Travel,
    /// The camera's lens, the same at every t.
    pub lens: Lens,
    /// Near plane distance.
    pub near: f64,
    /// Far plane distance; see [`Camera::far`].
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
        let part = match self.travel {
            Travel::Glide => along - from as f64,
            Travel::Jump => 0.0,
        };
        let mix = |a: DVec3, b: DVec3| a + (b - a) * part;
        let eye = mix(self.poses[from].eye, self.poses[to].eye);
        let target = mix(self.poses[from].target, self.poses[to].target);
        let forward = (target - eye).normalize();
        Camera { eye, forward, lens: self.lens, near: self.near, far: self.far }
    }
}
