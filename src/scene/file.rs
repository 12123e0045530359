//! The scene file: TOML with a version. Either a generator with its knobs, or inline objects with a
//! camera path. Unknown keys are refused, so that a misspelt knob does not pass unseen.
//!
//! ```toml
//! version = 1
//! generator = "city"   # or [[objects]] and [camera_path] below
//! seed = 7
//! scale = 0.5
//! frames = 10
//! start = 5                                # tick of the first frame, of inline objects
//! viewport = [640, 480]
//! depth = "reversed"                        # or "forward", the default
//! ```
//!
//! ```toml
//! version = 1
//! leaf_triangles = 48                      # most in a part
//! [[objects]]
//! positions = [[0,0,0], [1,0,0], [0,1,0]]
//! triangles = [[0,1,2]]
//! translation = [0,0,-3]                   # all of these are optional
//! rotation_y_degrees = 30                  # or rotation = [x,y,z,w], a unit quaternion
//! scale = [1,-2,1]
//! shear = [0.5,0,0]                        # x leans with y, x with z, y with z
//! reflect = { velocity = [1,0,0], min = [-5,0,0], max = [5,0,0], spin = 0.1 }
//! # circuit = { corners = [[0,0,0], [9,0,0]], speed = 0.5, start = 2 }    # in the place of reflect
//! # lap = { center = [0,0,0], half = [9,5], round = 1, speed = 0.5, start = 2 }
//! jumps = { offsets = [[0,0,0], [0,9,0]], period = 4 }
//! [[figures]]                              # objects that are limbs of one body
//! lap = { center = [0,0,0], half = [9,5], round = 1, speed = 0.5 }    # or reflect with at, or circuit
//! pace = 0.2                               # radians of the swing a frame; phase = 1 is where it starts
//! limbs = [{ object = 0, joints = [{ hinge = [0,1,0], swing = 0.5, phase = 0 }] }]
//! [camera_path]
//! poses = [{ eye = [0,0,5], target = [0,0,0] }]
//! travel = "jump"                          # or "glide", the default
//! fov_y_degrees = 60                       # or fov_y in radians, or orthographic_height = 4
//! duration = 24                            # frames from the first pose to the last; all, by default
//! shift = [0.5,0]                          # how far the view direction is off the middle
//! near = 0.1
//! far = inf                                # or a number
//! [[views]]                                # more views of every frame, with the keys of camera_path
//! poses = [{ eye = [1,0,5], target = [1,0,0] }]
//! fov_y_degrees = 60
//! near = 0.1
//! far = 10
//! ```

use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DQuat, DVec3};
use serde::Deserialize;

use super::generate::{self, CameraMode, Knobs};
use super::inline_motion::{self, InlineCircuit, InlineFigure, InlineLap, InlineReflect};
use super::{
    CameraPath, CameraPose, DepthOrder, Effects, Jumps, Lens, Mesh, Motion, Object, Placement,
    Scene, SceneError, Teleport, Travel, Viewport,
};

/// The only version there is.
const VERSION: u32 = 1;
/// The latest tick that a scene may begin at: frames after it fit 32 bits.
const LATEST_START: u32 = 1_000_000_000;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    version: u32,
    generator: Option<String>,
    name: Option<String>,
    seed: Option<u64>,
    scale: Option<f64>,
    #[serde(default)]
    full_size: bool,
    frames: Option<u32>,
    #[serde(default)]
    start: u32,
    viewport: Option<[u32; 2]>,
    depth: Option<DepthName>,
    leaf_triangles: Option<u32>,
    mesh: Option<PathBuf>,
    camera: Option<CameraName>,
    #[serde(default)]
    objects: Vec<InlineObject>,
    #[serde(default)]
    figures: Vec<InlineFigure>,
    camera_path: Option<InlinePath>,
    #[serde(default)]
    views: Vec<InlinePath>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum DepthName {
    Forward,
    Reversed,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum CameraName {
    Inside,
    Orbit,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InlineObject {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    #[serde(default)]
    translation: [f64; 3],
    #[serde(default)]
    rotation_y_degrees: f64,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
    #[serde(default)]
    shear: [f64; 3],
    reflect: Option<InlineReflect>,
    circuit: Option<InlineCircuit>,
    lap: Option<InlineLap>,
    jumps: Option<InlineJumps>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InlineJumps {
    offsets: Vec<[f64; 3]>,
    period: u32,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum TravelName {
    #[default]
    Glide,
    Jump,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InlinePath {
    poses: Vec<InlinePose>,
    #[serde(default)]
    travel: TravelName,
    fov_y_degrees: Option<f64>,
    fov_y: Option<f64>,
    duration: Option<u32>,
    #[serde(default)]
    shift: [f64; 2],
    orthographic_height: Option<f64>,
    near: f64,
    far: f64,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct InlinePose {
    eye: [f64; 3],
    target: [f64; 3],
}

/// Reads the scene of a file; knobs given by the caller win over the file's.
///
/// # Errors
/// [`SceneError::Read`] and [`SceneError::File`] with the line and the remedy, or what the generator
/// says.
pub fn load(path: &Path, knobs: &Knobs) -> Result<Scene, SceneError> {
    let text = std::fs::read_to_string(path)
        .map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
    parse(&text, path, knobs)
}

/// The same of a file's text; `path` is where it comes from, for messages and for models beside it.
///
/// # Errors
/// As [`load`].
pub fn parse(text: &str, path: &Path, knobs: &Knobs) -> Result<Scene, SceneError> {
    let refuse = |what: String| SceneError::File { path: path.to_owned(), what };
    let file: SceneFile = toml::from_str(text).map_err(|error| refuse(one_line(text, &error)))?;
    if file.version != VERSION {
        return Err(refuse(format!("version {} is not known; write version = 1", file.version)));
    }
    if file.leaf_triangles == Some(0) {
        return Err(refuse("leaf_triangles must be at least 1".to_owned()));
    }
    if file.start > LATEST_START {
        return Err(refuse(format!("start must be at most {LATEST_START}")));
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let camera = file.camera.map(|camera| match camera {
        CameraName::Inside => CameraMode::Inside,
        CameraName::Orbit => CameraMode::Orbit,
    });
    let depth = file.depth.map(|depth| match depth {
        DepthName::Forward => DepthOrder::Forward,
        DepthName::Reversed => DepthOrder::Reversed,
    });
    let viewport = file.viewport.map(|[width, height]| Viewport { width, height });
    let merged = Knobs {
        seed: knobs.seed.or(file.seed),
        scale: knobs.scale.or(file.scale),
        full_size: knobs.full_size || file.full_size,
        frames: knobs.frames.or(file.frames),
        viewport: knobs.viewport.or(viewport),
        depth: knobs.depth.or(depth),
        mesh: knobs.mesh.clone().or_else(|| file.mesh.as_ref().map(|mesh| folder.join(mesh))),
        camera: knobs.camera.or(camera),
    };
    match (&file.generator, file.objects.is_empty()) {
        (Some(generator), true) => generate::build(generator, &merged).map(|scene| Scene {
            leaf_triangles: file.leaf_triangles.unwrap_or(scene.leaf_triangles),
            ..scene
        }),
        (None, false) => inline(file, &merged).map_err(refuse),
        (Some(_), false) => {
            Err(refuse("has a generator and objects; keep one of the two".to_owned()))
        }
        (None, true) => Err(refuse("has neither a generator nor [[objects]]; add one".to_owned())),
    }
}

/// The parser's message without its picture, with the line in front.
fn one_line(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().replace('\n', " ");
    match error.span() {
        Some(span) => {
            let line =
                text.as_bytes()[..span.start.min(text.len())].iter().filter(|&&b| b == b'\n');
            format!("line {}: {message}", line.count() + 1)
        }
        None => message,
    }
}

fn inline(file: SceneFile, knobs: &Knobs) -> Result<Scene, String> {
    let chosen = knobs.chosen(&generate::USUAL).map_err(|error| error.to_string())?;
    let path = file.camera_path.ok_or("inline objects need a [camera_path]")?;
    let mut cameras = vec![camera("camera_path", &path, chosen.frames)?];
    for (number, path) in (1..).zip(&file.views) {
        cameras.push(camera(&format!("view {number}"), path, chosen.frames)?);
    }
    let (mut meshes, mut objects) = (Vec::new(), Vec::new());
    let (mut movers, mut jumpers) = (Vec::new(), Vec::new());
    for (number, object) in file.objects.into_iter().enumerate() {
        let numbers = [object.translation, object.scale.unwrap_or([1.0; 3]), object.shear];
        if !(numbers.as_flattened().iter().all(|c| c.is_finite())
            && object.rotation_y_degrees.is_finite())
        {
            return Err(format!("object {number}: its placement must be finite"));
        }
        let mesh = Mesh::new(format!("object {number}"), object.positions, object.triangles);
        meshes.push(Arc::new(mesh.map_err(|error| error.to_string())?));
        let rotation = match object.rotation {
            Some(xyzw) => {
                let rotation = DQuat::from_array(xyzw);
                if !rotation.is_normalized() || object.rotation_y_degrees != 0.0 {
                    return Err(format!(
                        "object {number}: rotation is a unit quaternion x, y, z, w, without rotation_y_degrees"
                    ));
                }
                rotation
            }
            None => DQuat::from_rotation_y(object.rotation_y_degrees.to_radians()),
        };
        let placement = Placement {
            translation: object.translation.into(),
            rotation,
            scale: numbers[1].into(),
            shear: object.shear.into(),
        };
        objects.push(Object { mesh: number as u32, placement });
        let place = format!("object {number}");
        let way = inline_motion::path(&place, object.reflect, object.circuit, object.lap)?;
        movers.extend(way.map(|way| (number as u32, way)));
        if let Some(InlineJumps { offsets, period }) = object.jumps {
            if !offsets.as_flattened().iter().all(|c| c.is_finite()) {
                return Err(format!("object {number}: its jumps must be finite"));
            }
            let offsets = offsets.into_iter().map(DVec3::from).collect();
            jumpers.push((number as u32, Jumps { offsets, period }));
        }
    }
    let moving: Vec<u32> = movers.iter().map(|(object, _)| *object).collect();
    let articulated = inline_motion::articulated(file.figures, objects.len(), &moving)?;
    Ok(Scene {
        name: file.name.unwrap_or_else(|| "inline".to_owned()),
        seed: chosen.seed,
        meshes,
        objects,
        cameras,
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: file.leaf_triangles.unwrap_or(chosen.leaf_triangles),
        frames: chosen.frames,
        start: file.start,
        effects: Effects {
            motion: (!movers.is_empty()).then_some(Motion { movers }),
            articulated,
            teleport: (!jumpers.is_empty()).then_some(Teleport { jumpers }),
        },
    })
}

/// The path; `place` is what the user calls it.
fn camera(place: &str, path: &InlinePath, duration: u32) -> Result<CameraPath, String> {
    let pose = |pose: &InlinePose| {
        let (eye, target) = (DVec3::from(pose.eye), DVec3::from(pose.target));
        let seen = eye.is_finite() && target.is_finite() && eye != target;
        seen.then_some(CameraPose { eye, target })
    };
    let poses: Option<Vec<CameraPose>> = path.poses.iter().map(pose).collect();
    let poses = poses
        .filter(|poses| !poses.is_empty())
        .ok_or(format!("{place}: needs poses whose eye and target are finite and differ"))?;
    let fov_y = match (path.fov_y_degrees, path.fov_y) {
        (Some(degrees), None) if degrees > 0.0 && degrees < 180.0 => Some(degrees.to_radians()),
        (None, Some(radians)) if radians > 0.0 && radians < PI => Some(radians),
        (None, None) => None,
        _ => {
            return Err(format!(
                "{place}: fov_y_degrees must be above 0 and below 180, or fov_y in radians below pi"
            ));
        }
    };
    let lens = match (fov_y, path.orthographic_height) {
        (Some(fov_y), None) => Lens::Perspective { fov_y, shift: path.shift },
        (None, Some(height)) if height > 0.0 && height.is_finite() => Lens::Orthographic { height },
        (None, Some(_)) => {
            return Err(format!("{place}: orthographic_height must be above 0 and finite"));
        }
        _ => {
            return Err(format!("{place}: needs one of fov_y_degrees and orthographic_height"));
        }
    };
    if !path.shift.iter().all(|share| share.is_finite()) {
        return Err(format!("{place}: shift must be finite"));
    }
    let endless = path.far == f64::INFINITY && matches!(lens, Lens::Perspective { .. });
    if !(path.near > 0.0 && path.far > path.near && (path.far.is_finite() || endless)) {
        let what = "needs 0 < near < far; with fov_y_degrees far may be inf";
        return Err(format!("{place}: {what}"));
    }
    let duration = path.duration.unwrap_or(duration);
    let travel = match path.travel {
        TravelName::Glide => Travel::Glide,
        TravelName::Jump => Travel::Jump,
    };
    Ok(CameraPath { poses, duration, travel, lens, near: path.near, far: path.far })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Scene, String> {
        let file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
        std::fs::write(file.path(), text).unwrap();
        load(file.path(), &Knobs::default()).map_err(|error| error.to_string())
    }

    const INLINE: &str = "version = 1\nframes = 3\n[[objects]]\npositions = [[0,0,0],[1,0,0],[0,1,0]]\n\
        triangles = [[0,1,2]]\n[camera_path]\nposes = [{ eye = [0,0,5], target = [0,0,0] }]\n\
        fov_y_degrees = 60\nnear = 0.1\nfar = 10\n";

    #[test]
    fn generators_and_inline_objects_are_read() {
        let scene = read("version = 1\ngenerator = \"soup\"\nseed = 5\nscale = 0.01\nframes = 2\n");
        let scene = scene.unwrap();
        assert_eq!((scene.name.as_str(), scene.seed, scene.frames), ("soup", 5, 2));
        assert_eq!(read(INLINE).unwrap().triangle_count(), 1);
    }

    fn two_views() -> String {
        let view = "poses = [{ eye = [1,0,5], target = [0,0,0] }]\nfov_y_degrees = 9\nnear = 2\nfar = 10\n";
        format!("{INLINE}[[views]]\n{view}")
    }

    #[test]
    fn a_frame_may_have_several_views() {
        let cameras = read(&two_views()).unwrap().cameras;
        let nears: Vec<f64> = cameras.iter().map(|camera| camera.near).collect();
        assert_eq!(nears, [0.1, 2.0]);
    }

    #[test]
    fn refusals_are_one_line_and_name_the_place() {
        for (text, says) in [
            ("version = 2\n", "version 2 is not known"),
            ("version = 1\n", "neither a generator nor"),
            ("version = 1\ngenerater = \"soup\"\n", "line 2: unknown field `generater`"),
            ("version = 1\nseed = \n", "line 2"),
            (&INLINE.replace("[0,1,2]", "[0,1,3]"), "names a vertex beyond the 3"),
            (&INLINE.replace("near = 0.1", "near = 0.0"), "needs 0 < near < far"),
            (&INLINE.replace("fov_y_degrees = 60", "fov_y_degrees = 180"), "below 180"),
            (&INLINE.replace("fov_y_degrees = 60", ""), "needs one of fov_y_degrees"),
            (
                &INLINE
                    .replace("fov_y_degrees = 60", "orthographic_height = 2")
                    .replace("= 10\n", "= inf\n"),
                "needs 0 < near < far",
            ),
            (&INLINE.replace("target = [0,0,0]", "target = [0,0,5]"), "finite and differ"),
            (&INLINE.replace("[1,0,0]", "[nan,0,0]"), "not finite"),
            (
                &INLINE.replace("[camera_path]", "lap = { center = [0,0,0], half = [0,1], round = 1, speed = 1 }\n[camera_path]"),
                "object 0: a lap has finite numbers",
            ),
            (
                &INLINE.replace("[camera_path]", "[[figures]]\nlimbs = []\n[camera_path]"),
                "figure 0: needs one of reflect",
            ),
            (
                &INLINE.replace("[camera_path]", "[[figures]]\ncircuit = { corners = [[0,0,0],[1,0,0]], speed = 1 }\nlimbs = [{ object = 1 }]\n[camera_path]"),
                "figure 0: object 1 does not exist",
            ),
            (&two_views().replace("near = 2", "near = 20"), "view 1: needs 0 < near < far"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(says) && !error.contains('\n'), "{text:?} said {error}");
        }
    }
}
