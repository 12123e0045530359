//! The boxes that stand for a part hold it: every triangle lies in one of them, through the matrix and as
//! rounded, and wherever a part shows, what is asked about it covers that sample at a depth not behind it.

use plainsight::cull::{Appearance, CullerSetup, Item, ProxyKind, Scenery, SceneryKnobs, View};
use plainsight::index::INDEXES;
use plainsight::math::Aabb;
use plainsight::oracle::{CostModel, Proxy};
use plainsight::part::{Crossing, ObjectId, PartId, PartedMesh, PartitionKnobs};
use plainsight::run::{FrameState, Moment, World};
use plainsight::scene::Viewport;
use plainsight::scene::generate::{HARD, Knobs, build};
use plainsight_reference::{Draw, Faces, Image, naive};
use rayon::prelude::*;

use glam::DVec3;

/// Seeds of the swarm.
const SEEDS: u64 = 120;
/// Parts of a frame that are drawn alone.
const MOST_DRAWN: usize = 40;
/// No larger than this: what a sample is asked does not depend on how many there are.
const LARGEST: Viewport = Viewport { width: 80, height: 60 };

/// Every hard scene and worlds of the swarm, in parts of several sizes, split and whole.
fn worlds() -> Vec<World> {
    let hard = HARD.iter().map(|generator| (generator.name, generator.viewport, 1));
    let swarm = (0..SEEDS).map(|seed| ("swarm", LARGEST, seed));
    let world = |(place, (name, own, seed)): (usize, (&str, Viewport, u64))| {
        let small = u64::from(own.width) * u64::from(own.height) <= 4800;
        let viewport = Some(if small { own } else { LARGEST });
        let knobs = Knobs { seed: Some(seed), frames: Some(4), viewport, ..Knobs::default() };
        let scene = build(name, &knobs).unwrap();
        let leaf_triangles = [64, 7, 200][place % 3];
        let crossing = [Crossing::Split, Crossing::Whole][place / 3 % 2];
        World::new(scene, PartitionKnobs { leaf_triangles, crossing })
    };
    hard.chain(swarm).enumerate().map(world).collect()
}

fn wide(p: [f32; 3]) -> DVec3 {
    DVec3::from_array(p.map(f64::from))
}

/// Whether all of a triangle is in a box.
fn holds(aabb: &Aabb, corners: &[DVec3; 3]) -> bool {
    corners.iter().all(|&corner| aabb.contains_point(corner))
}

/// Everything of a mesh is in the boxes that stand for it, its parts and its tree's nodes.
fn held(mesh: &PartedMesh) -> Result<usize, String> {
    let mut several = 0;
    for (number, part) in mesh.parts.iter().enumerate() {
        let positions = mesh.positions_of(part);
        let boxes = mesh.boxes_of(number as u32);
        if part.bounds != Aabb::of_points(positions) || !mesh.bounds.contains(&part.bounds) {
            return Err(format!("part {number}: its bounds are not those of its vertices"));
        }
        for triangle in mesh.triangles_of(part).0 {
            let corners = triangle.map(|v| wide(positions[v as usize]));
            if !boxes.iter().any(|aabb| holds(aabb, &corners)) {
                return Err(format!("part {number}: {corners:?} is in none of {boxes:?}"));
            }
        }
        if let Some(out) = boxes.iter().find(|aabb| !part.bounds.contains(aabb)) {
            return Err(format!("part {number}: {out:?} sticks out of {:?}", part.bounds));
        }
        several += usize::from(boxes.len() > 1);
    }
    for node in mesh.tree.iter().flat_map(|tree| &tree.nodes) {
        for part in node.first_part..node.end_part {
            if !node.bounds.contains(&mesh.parts[part as usize].bounds) {
                return Err(format!("part {part} sticks out of a node above"));
            }
        }
    }
    Ok(several)
}

#[test]
fn every_part_is_in_its_boxes() {
    let several: usize = worlds()
        .par_iter()
        .map(|world| {
            let name = format!("{} seed {}", world.scene.name, world.scene.seed);
            let mut several = 0;
            for object in (0..world.partition.object_count()).map(ObjectId) {
                let mesh = world.partition.mesh(object);
                several += held(mesh).unwrap_or_else(|what| panic!("{name} {object:?}: {what}"));
                // Where it stands, the box in the world holds its vertices.
                for frame in [0, 3] {
                    let placed = world.world_from_object(object, frame);
                    let aabb = mesh.bounds.transformed(&placed);
                    let out = mesh
                        .positions
                        .iter()
                        .map(|&p| placed.transform_point3(wide(p)))
                        .find(|&at| !aabb.contains_point(at));
                    assert!(out.is_none(), "{name} {object:?} frame {frame}: {out:?} {aabb:?}");
                }
            }
            several
        })
        .sum();
    assert!(several > 1_000, "{several} parts with several boxes prove little");
}

/// Whether a proxy covers a sample at a depth that is not behind what shows there.
struct Cover {
    proxy: Proxy,
    /// Of a box, as drawn.
    image: Option<Image>,
}

impl Cover {
    fn new(world: &World, proxy: Proxy) -> Self {
        let Proxy::Box { clip_from_box, min, max } = proxy else {
            return Self { proxy, image: None };
        };
        let mut image = world.image();
        let aabb = Aabb::new(wide(min), wide(max));
        let positions = aabb.corners().map(|corner| corner.as_vec3().to_array());
        let faces: [[u32; 4]; 6] =
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> =
            faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        draw(&mut image, &positions, &triangles, clip_from_box);
        Self { proxy, image: Some(image) }
    }

    fn covers(&self, sample: usize, [x, y]: [u32; 2], shown: f32) -> bool {
        match self.proxy {
            Proxy::Rectangle { min, max, depth } => {
                let inside = (min[0]..max[0]).contains(&x) && (min[1]..max[1]).contains(&y);
                inside && depth <= shown
            }
            Proxy::Hull { hull, depth, .. } => {
                let middle = [x, y].map(|at| at as i32 * 256 + 128);
                hull.holds(middle) && depth <= shown
            }
            Proxy::Box { .. } => self.image.as_ref().is_some_and(|image| {
                image.draw_index(sample).is_some() && image.depth(sample) <= shown
            }),
        }
    }
}

fn draw(image: &mut Image, positions: &[[f32; 3]], triangles: &[[u32; 3]], matrix: [f32; 16]) {
    let ranks: Vec<u32> = (0..triangles.len() as u32).collect();
    let (ranks, clip_from_object, faces) = (ranks.as_slice(), matrix, Faces::Both);
    let draw = Draw { positions, triangles, ranks, first_draw: 0, clip_from_object, faces };
    naive::draw(image, &draw);
}

/// Draws parts of a frame alone and holds what is asked about them against what shows; how many samples.
fn shown_is_covered(world: &World, view: &View<'_>, kind: ProxyKind) -> usize {
    let state = FrameState::at(world, Moment { frame: view.frame, view: view.view });
    let setup = CullerSetup {
        partition: world.partition.clone(),
        index: (INDEXES[0].build)(&world.entries()),
        proxy: kind,
        cost: CostModel::lavapipe(),
    };
    let scenery = Scenery::new(setup, SceneryKnobs::default());
    let mut samples = 0;
    let parts = world.partition.part_count() as usize;
    let mut image = world.image();
    for part in (0..parts).step_by(parts.div_ceil(MOST_DRAWN)) {
        let (object, local) = world.partition.locate(PartId(part as u32));
        let mesh = world.partition.mesh(object);
        let this = &mesh.parts[local as usize];
        let node = mesh.tree.as_ref().map_or(0, |tree| {
            let leaf =
                tree.nodes.iter().position(|n| n.children.is_none() && n.first_part == local);
            leaf.expect("a part has a leaf") as u32
        });
        let item = Item::Object(object, node);
        let proxy = match scenery.appearance(view, item) {
            Appearance::Certain => continue,
            Appearance::Nowhere => None,
            Appearance::Ask { proxy, .. } => Some(proxy),
        };
        image.clear();
        let matrix = state.matrices[object.0 as usize];
        draw(&mut image, mesh.positions_of(this), mesh.triangles_of(this).0, matrix);
        let shown: Vec<usize> =
            (0..image.sample_count()).filter(|&s| image.draw_index(s).is_some()).collect();
        let name = format!("{} seed {}", world.scene.name, world.scene.seed);
        let Some(proxy) = proxy else {
            assert!(shown.is_empty(), "{name}: part {part} shows and is nowhere");
            continue;
        };
        if shown.is_empty() {
            continue;
        }
        for most in [1, 4, 16] {
            let mut proxies = Vec::new();
            scenery.tightest_proxies(view, item, (proxy, most), &mut proxies);
            let covers: Vec<Cover> =
                proxies.into_iter().map(|proxy| Cover::new(world, proxy)).collect();
            for &sample in &shown {
                let width = world.scene.viewport.width as usize;
                let at = [(sample % width) as u32, (sample / width) as u32];
                let depth = image.depth(sample);
                let covered = covers.iter().any(|cover| cover.covers(sample, at, depth));
                assert!(covered, "{name}: {kind:?} of {most} misses part {part} at {at:?}");
            }
            samples += shown.len();
        }
    }
    samples
}

#[test]
fn every_sample_of_a_part_is_asked_about() {
    let samples: usize = worlds()
        .par_iter()
        .map(|world| {
            let frame = 2;
            let state = FrameState::at(world, Moment { frame, view: 0 });
            let view = state.view(world);
            // A box is a few draws to a question: for one world in three.
            let kinds = match world.scene.seed % 3 {
                0 => &[ProxyKind::Rectangle, ProxyKind::Hull][..],
                1 => &[ProxyKind::Hull, ProxyKind::Box],
                _ => &[ProxyKind::Rectangle],
            };
            kinds.iter().map(|&kind| shown_is_covered(world, &view, kind)).sum::<usize>()
        })
        .sum();
    assert!(samples > 200_000, "{samples} samples prove little");
}

/// The test itself: a box that is shrunk by a little no longer holds its mesh.
#[test]
fn a_box_that_is_too_small_is_noticed() {
    let knobs = Knobs { seed: Some(1), ..Knobs::default() };
    let mut scene = build("soup", &knobs).unwrap();
    scene.objects.truncate(1);
    let world =
        World::new(scene, PartitionKnobs { leaf_triangles: 200, ..PartitionKnobs::default() });
    let mut mesh = world.partition.mesh(ObjectId(0)).clone();
    assert!(held(&mesh).unwrap() > 0);
    let part = mesh.boxes.iter().position(|boxes| boxes.len() > 1).unwrap();
    let shrunk = &mut mesh.boxes[part][0];
    shrunk.max.x -= shrunk.size().x * 1e-3;
    assert!(held(&mesh).is_err(), "a box that lost its end");
    mesh.boxes[part].pop();
    assert!(held(&mesh).is_err(), "a box that is lost");
}
