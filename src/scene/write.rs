//! A scene as a file that stands alone: inline objects, every number to the bit, in the format of
//! [`file`](super::file). What reads it gets a scene whose frames are the same, draw by draw.

use std::fmt::Write;

use super::{CameraPath, DepthOrder, Joint, Lens, Mesh, Path, Placement, Scene, Travel};

/// The file's text. A scene without objects has none that can be read back: a file needs one.
#[must_use]
pub fn to_toml(scene: &Scene) -> String {
    let mut text = String::new();
    let mut line = |words: String| {
        text += &words;
        text.push('\n');
    };
    line("version = 1".to_owned());
    line(format!("name = {:?}", scene.name));
    line(format!("seed = {}", scene.seed));
    line(format!("frames = {}", scene.frames));
    if scene.start > 0 {
        line(format!("start = {}", scene.start));
    }
    line(format!("viewport = [{}, {}]", scene.viewport.width, scene.viewport.height));
    if scene.depth == DepthOrder::Reversed {
        line("depth = \"reversed\"".to_owned());
    }
    line(format!("leaf_triangles = {}", scene.leaf_triangles));
    for (number, object) in (0_u32..).zip(&scene.objects) {
        line("\n[[objects]]".to_owned());
        mesh(&mut line, &scene.meshes[object.mesh as usize]);
        placement(&mut line, &object.placement);
        let movers = scene.effects.motion.iter().flat_map(|motion| &motion.movers);
        for (_, path) in movers.filter(|(object, _)| *object == number) {
            line(way(path));
        }
        let jumpers = scene.effects.teleport.iter().flat_map(|teleport| &teleport.jumpers);
        for (_, jumps) in jumpers.filter(|(object, _)| *object == number) {
            let offsets = list(&jumps.offsets, |offset| numbers(&offset.to_array()));
            line(format!("jumps = {{ offsets = {offsets}, period = {} }}", jumps.period));
        }
    }
    for figure in scene.effects.articulated.iter().flat_map(|articulated| &articulated.figures) {
        line("\n[[figures]]".to_owned());
        line(way(&figure.path));
        line(format!("at = {}", numbers(&figure.start.to_array())));
        line(format!("pace = {:?}\nphase = {:?}", figure.pace, figure.phase));
        let joint = |joint: &Joint| {
            let Joint { hinge, swing, phase } = joint;
            let hinge = numbers(&hinge.to_array());
            format!("{{ hinge = {hinge}, swing = {swing:?}, phase = {phase:?} }}")
        };
        line(format!(
            "limbs = {}",
            list(&figure.limbs, |limb| {
                let joints = list(&limb.joints, joint);
                format!("{{ object = {}, joints = {joints} }}", limb.object)
            })
        ));
    }
    for (number, path) in scene.cameras.iter().enumerate() {
        line(if number == 0 { "\n[camera_path]" } else { "\n[[views]]" }.to_owned());
        camera(&mut line, path);
    }
    text
}

fn way(path: &Path) -> String {
    match path {
        Path::Reflect { velocity, min, max, spin } => format!(
            "reflect = {{ velocity = {}, min = {}, max = {}, spin = {spin:?} }}",
            numbers(&velocity.to_array()),
            numbers(&min.to_array()),
            numbers(&max.to_array())
        ),
        Path::Circuit { corners, speed, start } => format!(
            "circuit = {{ corners = {}, speed = {speed:?}, start = {start:?} }}",
            list(corners, |corner| numbers(&corner.to_array()))
        ),
        Path::Lap { center, half, round, speed, start } => format!(
            "lap = {{ center = {}, half = {}, round = {round:?}, speed = {speed:?}, start = {start:?} }}",
            numbers(&center.to_array()),
            numbers(half)
        ),
    }
}

fn mesh(line: &mut dyn FnMut(String), mesh: &Mesh) {
    let wide = |p: &[f32; 3]| numbers(&p.map(f64::from));
    line(format!("positions = {}", list(mesh.positions(), wide)));
    line(format!("triangles = {}", list(mesh.triangles(), |t| format!("{t:?}"))));
}

fn placement(line: &mut dyn FnMut(String), placement: &Placement) {
    let rest = Placement::IDENTITY;
    let mut unlike = |name: &str, these: &[f64], rest: &[f64]| {
        // −0 is equal to 0, and another number.
        if these.iter().zip(rest).any(|(a, b)| a.to_bits() != b.to_bits()) {
            line(format!("{name} = {}", numbers(these)));
        }
    };
    unlike("translation", &placement.translation.to_array(), &rest.translation.to_array());
    unlike("rotation", &placement.rotation.to_array(), &rest.rotation.to_array());
    unlike("scale", &placement.scale.to_array(), &rest.scale.to_array());
    unlike("shear", &placement.shear.to_array(), &rest.shear.to_array());
}

fn camera(line: &mut dyn FnMut(String), path: &CameraPath) {
    let pose = |pose: &super::CameraPose| {
        let [eye, target] = [pose.eye, pose.target].map(|at| numbers(&at.to_array()));
        format!("{{ eye = {eye}, target = {target} }}")
    };
    line(format!("poses = {}", list(&path.poses, pose)));
    line(format!("duration = {}", path.duration));
    if path.travel == Travel::Jump {
        line("travel = \"jump\"".to_owned());
    }
    line(match path.lens {
        Lens::Perspective { fov_y, shift } => {
            format!("fov_y = {fov_y:?}\nshift = {}", numbers(&shift))
        }
        Lens::Orthographic { height } => format!("orthographic_height = {height:?}"),
    });
    line(format!("near = {:?}\nfar = {:?}", path.near, path.far));
}

/// Shortest digits that read back to the same bits.
fn numbers(numbers: &[f64]) -> String {
    format!("{numbers:?}")
}

fn list<T>(of: &[T], say: impl Fn(&T) -> String) -> String {
    let mut text = String::from("[");
    for (number, item) in of.iter().enumerate() {
        let comma = if number > 0 { ", " } else { "" };
        // Writing to a string cannot fail.
        let _ = write!(text, "{comma}{}", say(item));
    }
    text + "]"
}

#[cfg(test)]
mod tests {
    use std::path::Path as FilePath;

    use super::*;
    use crate::scene::file::parse;
    use crate::scene::generate::{HARD, Knobs, SWARM, build};

    /// A scene without names of meshes, and each object with a mesh of its own, as the file has it.
    fn shape(scene: &Scene) -> String {
        let meshes: Vec<_> = scene
            .objects
            .iter()
            .map(|object| &scene.meshes[object.mesh as usize])
            .map(|mesh| (mesh.positions(), mesh.triangles()))
            .collect();
        let placements: Vec<_> = scene.objects.iter().map(|object| object.placement).collect();
        let rest = (&scene.cameras, &scene.effects, scene.viewport, scene.depth, scene.frames);
        format!(
            "{:?}{:?}",
            (meshes, placements, rest),
            (scene.start, scene.leaf_triangles, scene.seed)
        )
    }

    #[test]
    fn what_is_written_reads_back_to_the_bit() {
        let seeds = (0..40).map(|seed| (SWARM.name, seed));
        let hard = HARD.iter().map(|generator| (generator.name, 1));
        for (name, seed) in seeds.chain(hard) {
            let knobs = Knobs { seed: Some(seed), ..Knobs::default() };
            let scene = Scene { start: 3, ..build(name, &knobs).unwrap() };
            if scene.objects.is_empty() {
                continue;
            }
            let text = to_toml(&scene);
            let read = parse(&text, FilePath::new("written.toml"), &Knobs::default());
            let read = read.unwrap_or_else(|error| panic!("{name} {seed}: {error}"));
            assert!(shape(&read) == shape(&scene), "{name} {seed}:\n{text}");
        }
    }
}
