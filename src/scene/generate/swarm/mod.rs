//! `swarm`: small worlds of every kind, for sweeps over thousands of seeds. What the seed decides is kept
//! apart by concern, each in a stream of its own: the layout, the shapes, who moves and how, the camera.
//! Each choice is made fully or not at all (Groce, Zhang, Eide, Chen & Regehr 2012, *Swarm testing*:
//! leaving features out of a test finds what their mixture hides). `--scale` multiplies the number of
//! objects.
//!
//! | file | decides |
//! |---|---|
//! | `shapes` | meshes, and how far they are from their own origin |
//! | `layout` | how objects stand to one another |
//! | `fringe` | long objects whose ends lie at the edge of a view |
//! | `motion` | who moves, jumps and swings |
//! | `cameras` | cameras and their ways |

mod cameras;
mod fringe;
mod layout;
mod motion;
mod shapes;

use glam::DVec3;

use super::{Chosen, Generator, USUAL};
use crate::scene::{Scene, SceneError, Stream, Viewport};

/// The generator; it stands in neither list of those that people look at.
pub const SWARM: Generator = Generator {
    name: "swarm",
    summary: "a small world of any kind, other for each seed: what `stress` runs",
    viewport: Viewport { width: 160, height: 120 },
    frames: 10,
    leaf_triangles: 64,
    build,
    ..USUAL
};

/// World units from the middle to a wall of the space, before the world's own scale.
const SPACE: f64 = 10.0;

/// Where the space of a world is, and how large.
#[derive(Clone, Copy)]
struct Site {
    /// Its middle in the world.
    middle: DVec3,
    /// World units to one of the space.
    size: f64,
}

fn within(stream: &mut Stream, reach: DVec3) -> DVec3 {
    let mut along = |reach: f64| stream.range(-reach, reach);
    DVec3::new(along(reach.x), along(reach.y), along(reach.z))
}

/// Ten to a power that is drawn from a range.
fn power(stream: &mut Stream, low: f64, high: f64) -> f64 {
    libm::pow(10.0, stream.range(low, high))
}

fn build(chosen: &Chosen) -> Result<Scene, SceneError> {
    let mut layout = Stream::new(chosen.seed, "layout");
    // Far from the origin of the world, or large or tiny as a whole, now and then.
    let size = layout.pick(&[1.0, 1.0, 1.0, 1.0, 1e-3, 1e3]);
    let origin = layout.pick(&[0.0, 0.0, 0.0, 0.0, 1e3, 1e5, 1e6]) * size;
    let site = Site { middle: DVec3::new(origin, 0.0, -origin), size };
    let mut shapes = shapes::shapes(chosen.seed);
    let mut objects = layout::placed(chosen, &mut layout, &shapes);
    for object in &mut objects {
        object.placement.translation = site.middle + object.placement.translation * size;
        object.placement.scale *= size;
    }
    let cameras = cameras::cameras(chosen, site);
    fringe::add(chosen, &cameras, site, &mut shapes, &mut objects);
    let effects = motion::effects(chosen, site, &cameras, &shapes, &mut objects);
    Ok(Scene {
        name: SWARM.name.to_owned(),
        seed: chosen.seed,
        meshes: shapes.into_iter().map(|shape| shape.mesh).collect(),
        objects,
        cameras,
        viewport: chosen.viewport,
        depth: chosen.depth,
        leaf_triangles: chosen.leaf_triangles,
        frames: chosen.frames,
        start: 0,
        effects,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::generate::{Knobs, build};
    use crate::scene::{Figure, Lens, Path, Travel};

    fn scenes(count: u64) -> Vec<Scene> {
        (0..count)
            .map(|seed| build("swarm", &Knobs { seed: Some(seed), ..Knobs::default() }).unwrap())
            .collect()
    }

    /// Every choice is made by some seeds and left by others.
    #[test]
    fn seeds_make_worlds_of_every_kind() {
        let scenes = scenes(200);
        let both = |of: &dyn Fn(&Scene) -> bool| {
            let count = scenes.iter().filter(|scene| of(scene)).count();
            assert!((10..=190).contains(&count), "{count} of 200");
        };
        both(&|scene| scene.effects.motion.is_some());
        both(&|scene| scene.effects.articulated.is_some());
        both(&|scene| scene.effects.teleport.is_some());
        both(&|scene| scene.cameras.len() == 2);
        both(&|scene| scene.cameras[0].far.is_infinite());
        both(&|scene| scene.cameras[0].travel == Travel::Jump);
        both(&|scene| matches!(scene.cameras[0].lens, Lens::Orthographic { .. }));
        both(&|scene| {
            let lens = scene.cameras[0].lens;
            matches!(lens, Lens::Perspective { fov_y, .. } if fov_y < 0.03)
        });
        both(&|scene| scene.objects.len() > 50);
        both(&|scene| scene.objects.iter().any(|object| object.placement.shear != DVec3::ZERO));
        both(&|scene| {
            let far = |p: &[f32; 3]| p.iter().any(|c| c.abs() > 50.0);
            scene.meshes.iter().any(|mesh| mesh.positions().iter().any(far))
        });
        let average = scenes.iter().map(|scene| scene.objects.len()).sum::<usize>() / 200;
        assert!((40..65).contains(&average), "{average} objects");
        for mesh in scenes.iter().flat_map(|scene| &scene.meshes) {
            let triangles = mesh.triangles().len() as u32;
            let [mut least, most] = shapes::TRIANGLES;
            if mesh.name() == "swarm bar" {
                least = 8;
            }
            assert!((least..=most + 20).contains(&triangles), "{triangles}");
        }
    }

    /// Kinds of motion whose bounds have been got wrong: each comes up in any forty seeds.
    #[test]
    fn every_kind_of_motion_comes_up_soon() {
        const SEEDS: usize = 40;
        let path = |scene: &Scene, of: &dyn Fn(&Path) -> bool| {
            scene.effects.motion.iter().flat_map(|motion| &motion.movers).any(|(_, path)| of(path))
        };
        let reflects = |scene: &Scene, of: &dyn Fn(DVec3, f64) -> bool| {
            path(scene, &|path| match path {
                Path::Reflect { velocity, spin, .. } => of(*velocity, *spin),
                _ => false,
            })
        };
        let figure = |scene: &Scene, of: &dyn Fn(&Figure) -> bool| {
            scene.effects.articulated.iter().flat_map(|all| &all.figures).any(of)
        };
        let off_center = |scene: &Scene, object: u32| {
            let positions = scene.meshes[scene.objects[object as usize].mesh as usize].positions();
            let bounds = crate::math::Aabb::of_points(positions);
            bounds.center().length() > bounds.size().length() * 0.5
        };
        type Kind<'a> = (&'a str, &'a dyn Fn(&Scene) -> bool);
        let kinds: [Kind<'_>; 8] = [
            ("runs straight", &|s| reflects(s, &|v, spin| v != DVec3::ZERO && spin == 0.0)),
            ("spins in place", &|s| reflects(s, &|v, spin| v == DVec3::ZERO && spin != 0.0)),
            ("spins fast", &|s| reflects(s, &|_, spin| spin.abs() > 0.4)),
            ("turns at corners", &|s| path(s, &|path| matches!(path, Path::Circuit { .. }))),
            ("swings", &|s| {
                let swings =
                    |f: &Figure| f.limbs.iter().flat_map(|l| &*l.joints).any(|j| j.swing > 0.0);
                figure(s, &swings)
            }),
            ("swings at a pace above 1", &|s| figure(s, &|figure| figure.pace > 1.0)),
            ("swings on a straight run", &|s| {
                figure(s, &|figure| matches!(figure.path, Path::Reflect { spin: 0.0, .. }))
            }),
            ("turns about a place outside", &|s| {
                let turns = |path: &Path| !matches!(path, Path::Reflect { spin: 0.0, .. });
                s.effects
                    .motion
                    .iter()
                    .flat_map(|motion| &motion.movers)
                    .any(|(object, path)| turns(path) && off_center(s, *object))
            }),
        ];
        for (block, scenes) in scenes(10 * SEEDS as u64).chunks(SEEDS).enumerate() {
            for (name, of) in &kinds {
                let count = scenes.iter().filter(|scene| of(scene)).count();
                assert!(count > 0, "nothing {name} in block {block}");
            }
        }
    }
}
