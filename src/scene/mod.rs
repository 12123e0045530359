//! What a world is: meshes, objects, the camera's path, the viewport and the declared effects; the
//! seed streams and generators that make one, the scene file and the import that read one.
//! It must not know the state of effects, nor anything that culls.
//!
//! Conventions: right-handed world, y up, units are the scene's own; a camera looks along its
//! `forward`; matrices are column-major and act on column vectors; time `t` is the frame number.

mod camera;
pub mod file;
pub mod generate;
pub mod import;
mod inline_motion;
mod sources;
mod stream;
mod write;

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DMat3, DMat4, DQuat, DVec3};
pub use plainsight_reference::{DepthOrder, Viewport};

pub use camera::{Camera, CameraPath, CameraPose, Lens, Travel};
pub use generate::is_scene_file;
pub use sources::sources;
pub use stream::Stream;
pub use write::to_toml;

/// Most triangles in a part by default.
pub const LEAF_TRIANGLES: u32 = 3072;

/// Triangles over shared positions, in the mesh's own space.
///
/// Every index is in range and every coordinate finite: [`Mesh::new`] refuses anything else. An
/// empty mesh is legal and draws nothing.
#[derive(Clone, Debug)]
pub struct Mesh {
    name: String,
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Checks and keeps the triangles.
    ///
    /// # Errors
    /// [`SceneError::Mesh`] where a coordinate is not finite or an index is out of range.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<[f32; 3]>,
        triangles: Vec<[u32; 3]>,
    ) -> Result<Self, SceneError> {
        let name = name.into();
        let fail = |what: String| Err(SceneError::Mesh { mesh: name.clone(), what });
        if let Some(i) = positions.iter().position(|p| p.iter().any(|c| !c.is_finite())) {
            return fail(format!("vertex {i} has a coordinate that is not finite"));
        }
        let bad = triangles.iter().position(|t| t.iter().any(|&i| i as usize >= positions.len()));
        if let Some(i) = bad {
            let count = positions.len();
            return fail(format!("triangle {i} names a vertex beyond the {count} there are"));
        }
        Ok(Self { name, positions, triangles })
    }

    /// The name it was made or imported under.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Vertex positions in the mesh's own space, all finite.
    #[must_use]
    pub fn positions(&self) -> &[[f32; 3]] {
        &self.positions
    }

    /// Three positions a triangle, all in range. The place in this slice is the *source triangle*.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }
}

/// Where an object stands: scale first, then shear, rotation, translation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Position of the object's origin in the world.
    pub translation: DVec3,
    /// Unit quaternion.
    pub rotation: DQuat,
    /// Factors along the object's axes; negative ones mirror.
    pub scale: DVec3,
    /// How far scaled points lean: x by `shear.x` times y and `shear.y` times z, y by `shear.z` times z.
    /// What a child of an unevenly scaled and turned parent gets in a scene graph.
    pub shear: DVec3,
}

impl Placement {
    /// At the world's origin, unrotated and unscaled.
    pub const IDENTITY: Self = Self {
        translation: DVec3::ZERO,
        rotation: DQuat::IDENTITY,
        scale: DVec3::ONE,
        shear: DVec3::ZERO,
    };

    /// The placement at `translation`, unrotated and unscaled.
    #[must_use]
    pub const fn at(translation: DVec3) -> Self {
        Self { translation, ..Self::IDENTITY }
    }

    /// The affine matrix from the object's space to the world.
    #[must_use]
    pub fn world_from_object(&self) -> DMat4 {
        let placed =
            DMat4::from_scale_rotation_translation(self.scale, self.rotation, self.translation);
        if self.shear == DVec3::ZERO {
            return placed;
        }
        let DVec3 { x, y, z } = self.shear;
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(x, 1.0, 0.0), DVec3::new(y, z, 1.0));
        let turned = DMat3::from_quat(self.rotation) * shear * DMat3::from_diagonal(self.scale);
        DMat4::from_mat3_translation(turned, self.translation)
    }
}

/// A mesh with a placement; the placement is where it stands at t = 0.
#[derive(Clone, Copy, Debug)]
pub struct Object {
    /// Which of the scene's meshes.
    pub mesh: u32,
    /// Where it stands at t = 0, and for ever if no effect moves it.
    pub placement: Placement,
}

/// The effects a scene calls for. What is `None` is not simulated and costs nothing.
#[derive(Clone, Debug, Default)]
pub struct Effects {
    /// Objects that move.
    pub motion: Option<Motion>,
    /// Figures whose limbs swing.
    pub articulated: Option<Articulated>,
    /// Objects that jump.
    pub teleport: Option<Teleport>,
}

/// Figures of several objects.
#[derive(Clone, Debug, Default)]
pub struct Articulated {
    /// In any order. An object is the limb of at most one figure, and then has no path of its own.
    pub figures: Vec<Figure>,
}

/// A body on a path, and the limbs that hang on it.
#[derive(Clone, Debug)]
pub struct Figure {
    /// Where the body's origin goes; its x axis faces along it.
    pub path: Path,
    /// Where the body's origin is at t = 0, for a path that has no place of its own ([`Path::Reflect`]).
    pub start: DVec3,
    /// Radians a frame of the swing of all joints.
    pub pace: f64,
    /// Radians of the swing at t = 0.
    pub phase: f64,
    /// The limbs.
    pub limbs: Vec<Limb>,
}

/// An object of a figure. Of its placement the rotation and scale hold in the frame of its last joint; the
/// translation is where it stands if nothing moves.
#[derive(Clone, Debug)]
pub struct Limb {
    /// The object.
    pub object: u32,
    /// From the body outwards; figures may share them.
    pub joints: Arc<[Joint]>,
}

/// A hinge, about whose z axis what hangs on it swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// Place in the frame of the joint before, or of the body.
    pub hinge: DVec3,
    /// Radians to either side; 0 for a stiff one.
    pub swing: f64,
    /// Radians that it is ahead of the figure.
    pub phase: f64,
}

/// Which objects jump, and where to.
#[derive(Clone, Debug, Default)]
pub struct Teleport {
    /// (object, jumps), at most one entry an object. An object that moves as well jumps on its way.
    pub jumpers: Vec<(u32, Jumps)>,
}

/// Places that an object is at in turn, with nothing between.
#[derive(Clone, Debug, Default)]
pub struct Jumps {
    /// World units, added to where the object would be; without any it stays there.
    pub offsets: Vec<DVec3>,
    /// Frames at each; 0 counts as 1.
    pub period: u32,
}

/// Which objects move, and how.
#[derive(Clone, Debug, Default)]
pub struct Motion {
    /// (object, path), at most one path an object, sorted by object.
    pub movers: Vec<(u32, Path)>,
}

/// The way an object moves; its position is a pure function of t.
#[derive(Clone, Debug)]
pub enum Path {
    /// A straight line from the starting place, mirrored at the walls of a box (Kovalčík & Sochor
    /// 2006, section 4: straight line paths), while turning about its own y axis.
    Reflect {
        /// World units a frame.
        velocity: DVec3,
        /// Walls for the object's origin.
        min: DVec3,
        /// Walls for the object's origin.
        max: DVec3,
        /// Radians a frame about y.
        spin: f64,
    },
    /// Round a closed polygon at constant speed, facing along it; t = 0 is at `start` along it.
    Circuit {
        /// Corners in the world, at least two.
        corners: Vec<DVec3>,
        /// World units a frame.
        speed: f64,
        /// World units along the polygon at t = 0.
        start: f64,
    },
    /// Round a level rectangle with round corners at constant speed, facing along it, from +x to +z; t = 0
    /// is at `start` from the low end of the side of lowest z.
    Lap {
        /// The middle, in the world.
        center: DVec3,
        /// Half sides along x and z, world units, above 0.
        half: [f64; 2],
        /// Radius of the corners, above 0; no larger than the smaller half side.
        round: f64,
        /// World units a frame.
        speed: f64,
        /// World units along the way at t = 0.
        start: f64,
    },
}

/// A scene: a pure description. Everything at frame t is a function of it and t.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name for reports and replay lines.
    pub name: String,
    /// The seed it was made from.
    pub seed: u64,
    /// Meshes, shared by objects.
    pub meshes: Vec<Arc<Mesh>>,
    /// Objects, at most 2³² of them; the place in this list is the object's id.
    pub objects: Vec<Object>,
    /// The cameras of every frame, at least one: each is a *view* of the same moment, as the two eyes of a
    /// headset or two players at one screen, drawn and judged by itself.
    pub cameras: Vec<CameraPath>,
    /// Pixels.
    pub viewport: Viewport,
    /// Which way depth runs.
    pub depth: DepthOrder,
    /// How many frames a run has by default.
    pub frames: u32,
    /// The tick of frame 0: later than 0 where what went before is of no interest.
    pub start: u32,
    /// Most triangles in a part where the user says nothing; at least 1.
    pub leaf_triangles: u32,
    /// What moves or changes.
    pub effects: Effects,
}

impl Scene {
    /// Triangles of all objects, before any is cut.
    #[must_use]
    pub fn triangle_count(&self) -> u64 {
        let of = |o: &Object| self.meshes[o.mesh as usize].triangles().len() as u64;
        self.objects.iter().map(of).sum()
    }
}

/// Why a scene could not be had. Every message names the place and what to do.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// A file could not be read.
    #[error("{}: {source}; check the path", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// A file was read and refused.
    #[error("{}: {what}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// The place in it and the remedy.
        what: String,
    },
    /// Triangles that no scene may hold.
    #[error("mesh '{mesh}': {what}")]
    Mesh {
        /// The mesh's name.
        mesh: String,
        /// The place and the reason.
        what: String,
    },
    /// A name that no generator has.
    #[error("no scene is called '{name}'; there are {known}, or name a .toml file")]
    Unknown {
        /// What was asked for.
        name: String,
        /// What there is, for the message.
        known: String,
    },
    /// A pattern that no scene's name fits.
    #[error("no scene fits '{pattern}'; `plainsight list` names them all")]
    NoneMatches {
        /// What was asked for.
        pattern: String,
    },
    /// A knob out of its range.
    #[error("{knob} must be {range}, got {got}")]
    Knob {
        /// The knob, as the user writes it.
        knob: &'static str,
        /// The legal range in words.
        range: &'static str,
        /// What was given.
        got: String,
    },
}
