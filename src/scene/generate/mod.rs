//! Seeded scenes, one generator per file; a new one is a file and a line in [`GENERATORS`].

mod bunnies;
mod city;
mod city250k;
mod hard;
mod model;
mod plant_parts;
mod powerplant;
mod rim;
mod rooms;
mod shape;
mod soup;
mod spheres200k;
mod swarm;

use std::path::PathBuf;

use glam::DVec3;

use super::{
    CameraPath, CameraPose, DepthOrder, LEAF_TRIANGLES, Lens, Scene, SceneError, Travel, Viewport,
    file,
};
use crate::math::{cos, sin};

pub use hard::HARD;
pub use shape::blob;
pub use swarm::SWARM;

/// What a user may choose; `None` leaves it to the generator or the scene file.
#[derive(Clone, Debug, Default)]
pub struct Knobs {
    /// Seed of every stream; 1 by default.
    pub seed: Option<u64>,
    /// Size of the scene, 1 by default; see each generator for what grows. In (0, 1000].
    pub scale: Option<f64>,
    /// Frames of a run, at least 1; 24 by default, in most scenes.
    pub frames: Option<u32>,
    /// Pixels; 1280 × 1024 by default, in most scenes.
    pub viewport: Option<Viewport>,
    /// Which way depth runs; forward by default, in most scenes.
    pub depth: Option<DepthOrder>,
    /// A model in the place of the generated shape.
    pub mesh: Option<PathBuf>,
    /// Where the camera of an imported model goes.
    pub camera: Option<CameraMode>,
    /// The size its source gives, for the scenes that have one; excludes `scale`.
    pub full_size: bool,
}

/// Where the camera of an imported model goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CameraMode {
    /// Through its middle at eye height.
    Inside,
    /// Round it.
    Orbit,
}

/// Knobs with defaults in place, checked.
pub(super) struct Chosen {
    pub(super) seed: u64,
    pub(super) scale: f64,
    pub(super) frames: u32,
    pub(super) viewport: Viewport,
    pub(super) depth: DepthOrder,
    pub(super) leaf_triangles: u32,
    pub(super) mesh: Option<PathBuf>,
    pub(super) camera: CameraMode,
    pub(super) full_size: bool,
}

impl Knobs {
    /// With the defaults of `generator` in the place of what is left open.
    pub(super) fn chosen(&self, generator: &Generator) -> Result<Chosen, SceneError> {
        let refuse = |knob, range, got: String| Err(SceneError::Knob { knob, range, got });
        let scale = self.scale.unwrap_or(1.0);
        if !(scale > 0.0 && scale <= 1000.0) {
            return refuse("--scale", "above 0 and at most 1000", scale.to_string());
        }
        let frames = self.frames.unwrap_or(generator.frames);
        if !(1..=1_000_000).contains(&frames) {
            return refuse("--frames", "from 1 to 1000000", frames.to_string());
        }
        let viewport = self.viewport.unwrap_or(generator.viewport);
        let legal = 1..=Viewport::MAX_SIDE;
        if !(legal.contains(&viewport.width) && legal.contains(&viewport.height)) {
            let got = format!("{}x{}", viewport.width, viewport.height);
            return refuse("--viewport", "1 to 16384 pixels on each side", got);
        }
        Ok(Chosen {
            seed: self.seed.unwrap_or(1),
            scale,
            frames,
            viewport,
            depth: self.depth.unwrap_or(generator.depth),
            leaf_triangles: generator.leaf_triangles,
            mesh: self.mesh.clone(),
            camera: self.camera.unwrap_or(CameraMode::Orbit),
            full_size: self.full_size,
        })
    }
}

/// A member of the family.
#[derive(Clone, Copy)]
pub struct Generator {
    /// Name for flags, files and reports.
    pub name: &'static str,
    /// One line for `list`.
    pub summary: &'static str,
    /// Frames of a run at the size its source gives; `None` for a scene without such a size.
    pub full_size_frames: Option<u32>,
    /// Pixels where none are asked for.
    pub viewport: Viewport,
    /// Which way depth runs where nothing is asked for.
    pub depth: DepthOrder,
    /// Frames of a run where none are asked for.
    pub frames: u32,
    /// Most triangles in a part where no number is asked for.
    pub leaf_triangles: u32,
    build: fn(&Chosen) -> Result<Scene, SceneError>,
}

/// A camera that goes straight along x while it turns, a tenth of a unit and a hundredth of a radian in a
/// frame (Wortel 2011, section 4.2). It looks up by `rise` in ten.
fn straight_while_turning(chosen: &Chosen, from: DVec3, rise: f64, far: f64) -> CameraPath {
    const POSES: u32 = 24;
    let length = f64::from(chosen.frames) * 0.1;
    let pose = |i: u32| {
        let way = length * f64::from(i) / f64::from(POSES);
        let eye = from + DVec3::X * way;
        let turn = 0.3 + way * 0.1;
        CameraPose { eye, target: eye + DVec3::new(cos(turn), rise, sin(turn)) * 10.0 }
    };
    CameraPath {
        poses: (0..=POSES).map(pose).collect(),
        duration: chosen.frames,
        travel: Travel::Glide,
        lens: Lens::perspective(1.0),
        near: 0.1,
        far,
    }
}

/// What most generators have in common; also the defaults of an inline scene file.
pub(super) const USUAL: Generator = Generator {
    name: "",
    summary: "",
    full_size_frames: None,
    viewport: Viewport { width: 1280, height: 1024 },
    depth: DepthOrder::Forward,
    frames: 24,
    leaf_triangles: LEAF_TRIANGLES,
    build: |_| unreachable!("nothing is called like it"),
};

/// The generators of large scenes; the hard ones are in [`HARD`].
pub const GENERATORS: &[Generator] = &[
    Generator {
        name: "bunnies",
        summary: "moving bumpy blobs packed densely in a box, freely interpenetrating",
        full_size_frames: Some(100),
        build: bunnies::build,
        ..USUAL
    },
    Generator {
        name: "powerplant",
        summary: "bays of a plant with boilers, pipes, gratings and walls; the camera flies through",
        full_size_frames: Some(250),
        build: powerplant::build,
        ..USUAL
    },
    Generator {
        name: "city",
        summary: "blocks and streets with moving cars, the camera at street level",
        build: city::build,
        ..USUAL
    },
    Generator {
        name: "rooms",
        summary: "a floor of furnished rooms with doorways, the camera walking through",
        build: rooms::build,
        ..USUAL
    },
    Generator {
        name: "soup",
        summary: "random triangles and boxes of wild sizes, for property tests",
        build: soup::build,
        ..USUAL
    },
    Generator {
        name: "city250k",
        summary: "a city of 250,000 objects, most of them limbs of pedestrians (Wortel 2011)",
        build: city250k::build,
        ..USUAL
    },
    Generator {
        name: "spheres200k",
        summary: "a cloud of 200,000 spheres, half of them moving (Wortel 2011)",
        build: spheres200k::build,
        ..USUAL
    },
    Generator {
        name: "model",
        summary: "an imported model (--mesh; OBJ, glTF, PLY), each of its groups an object",
        build: model::build,
        ..USUAL
    },
];

/// Every generator there is.
pub fn all() -> impl Iterator<Item = &'static Generator> {
    GENERATORS.iter().chain(HARD).chain(std::iter::once(&SWARM))
}

/// Builds the scene called `name`.
///
/// # Errors
/// [`SceneError::Unknown`] for a name that is not in [`GENERATORS`], [`SceneError::Knob`] for a knob
/// out of range, and what the import says where a model is asked for.
pub fn build(name: &str, knobs: &Knobs) -> Result<Scene, SceneError> {
    let Some(generator) = all().find(|g| g.name == name) else {
        let names: Vec<&str> = GENERATORS.iter().map(|g| g.name).collect();
        let known = format!("{}, swarm and hard/…", names.join(", "));
        return Err(SceneError::Unknown { name: name.to_owned(), known });
    };
    let mut chosen = knobs.chosen(generator)?;
    if knobs.full_size {
        let refuse = |range, got: String| Err(SceneError::Knob { knob: "--full-size", range, got });
        let Some(frames) = generator.full_size_frames else {
            return refuse("used with powerplant or bunnies", name.to_owned());
        };
        if let Some(scale) = knobs.scale {
            return refuse("used without --scale", format!("--scale {scale}"));
        }
        chosen.frames = knobs.frames.unwrap_or(frames);
    }
    (generator.build)(&chosen)
}

/// The scenes that a name with `*` in the place of any letters stands for, in the order of the lists;
/// one without stands for itself.
///
/// # Errors
/// [`SceneError::NoneMatches`] where nothing does.
pub fn matching(pattern: &str) -> Result<Vec<String>, SceneError> {
    let Some((head, tail)) = pattern.split_once('*') else { return Ok(vec![pattern.to_owned()]) };
    let matches = |name: &str| {
        name.len() >= head.len() + tail.len() && name.starts_with(head) && name.ends_with(tail)
    };
    let names = all().map(|g| g.name);
    let found: Vec<String> = names.filter(|name| matches(name)).map(str::to_owned).collect();
    if found.is_empty() {
        return Err(SceneError::NoneMatches { pattern: pattern.to_owned() });
    }
    Ok(found)
}

/// Whether a scene's name is that of a file: it ends in `.toml`.
#[must_use]
pub fn is_scene_file(name: &str) -> bool {
    name.to_ascii_lowercase().ends_with(".toml")
}

/// A generator's scene or, for a name that ends in `.toml`, that file's; knobs given here win over
/// the file's.
///
/// # Errors
/// As [`build`] and [`file::load`].
pub fn open(name_or_file: &str, knobs: &Knobs) -> Result<Scene, SceneError> {
    if is_scene_file(name_or_file) {
        file::load(name_or_file.as_ref(), knobs)
    } else {
        build(name_or_file, knobs)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn small(name: &str, seed: u64) -> Scene {
        build(name, &Knobs { seed: Some(seed), scale: Some(0.01), ..Knobs::default() }).unwrap()
    }

    #[test]
    fn same_seed_same_scene() {
        for generator in GENERATORS.iter().filter(|g| g.name != "model") {
            let (a, b) = (small(generator.name, 7), small(generator.name, 7));
            assert_eq!(format!("{a:?}"), format!("{b:?}"), "{}", generator.name);
            assert_ne!(format!("{a:?}"), format!("{:?}", small(generator.name, 8)));
            assert!(a.triangle_count() > 0 && a.triangle_count() < 400_000, "{}", generator.name);
        }
    }

    #[test]
    fn full_size_has_a_million_triangles() {
        for generator in GENERATORS.iter().filter(|g| g.name != "model") {
            let scene = build(generator.name, &Knobs::default()).unwrap();
            let triangles = scene.triangle_count();
            assert!(triangles >= 1_000_000, "{} has {triangles}", generator.name);
        }
    }

    /// Kovalčík & Sochor 2006, section 4: 1,185 objects of about 13 million triangles, and 300 meshes
    /// of nearly 70,000.
    #[test]
    fn full_size_is_the_papers() {
        let full = Knobs { full_size: true, ..Knobs::default() };
        let (plant, bunnies) = (build("powerplant", &full), build("bunnies", &full));
        let (plant, bunnies) = (plant.unwrap(), bunnies.unwrap());
        assert_eq!((plant.objects.len(), plant.frames), (1185, 250));
        assert!((12_500_000..13_500_000).contains(&plant.triangle_count()));
        assert_eq!(
            (bunnies.objects.len(), bunnies.effects.motion.unwrap().movers.len()),
            (300, 300)
        );
        let each = bunnies.meshes[0].triangles().len();
        assert!((68_000..70_000).contains(&each), "{each}");
    }

    #[test]
    fn knobs_out_of_range_are_refused() {
        let refused = |knobs: Knobs| matches!(build("soup", &knobs), Err(SceneError::Knob { .. }));
        assert!(refused(Knobs { frames: Some(0), ..Knobs::default() }));
        assert!(refused(Knobs { scale: Some(f64::NAN), ..Knobs::default() }));
        assert!(refused(Knobs { scale: Some(0.0), ..Knobs::default() }));
        let viewport = Some(Viewport { width: 0, height: 1 });
        assert!(refused(Knobs { viewport, ..Knobs::default() }));
        let full = Knobs { full_size: true, ..Knobs::default() };
        assert!(refused(full.clone()), "soup has no full size");
        let both = Knobs { scale: Some(0.5), ..full.clone() };
        assert!(matches!(build("powerplant", &both), Err(SceneError::Knob { .. })));
        assert!(matches!(build("nowhere", &Knobs::default()), Err(SceneError::Unknown { .. })));
        assert!(matches!(build("model", &Knobs::default()), Err(SceneError::Knob { .. })));
    }

    #[test]
    fn stars_stand_for_letters() {
        assert_eq!(matching("hard/*").unwrap().len(), HARD.len());
        assert_eq!(matching("*ounds").map_err(|e| e.to_string()).unwrap_err().lines().count(), 1);
        assert_eq!(matching("b*s").unwrap(), ["bunnies"]);
        assert_eq!(matching("no star").unwrap(), ["no star"]);
    }
}
