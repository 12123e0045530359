//! Cut meshes: nothing lost, nothing doubled, ids stable, trees sound.

use std::collections::BTreeMap;
use std::sync::Arc;

use glam::DVec3;
use plainsight::math::Aabb;
use plainsight::part::{Crossing, ObjectId, PartId, PartedMesh, Partition, PartitionKnobs};
use plainsight::run::{World, partition_difference};
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::{Mesh, Object, Placement, Scene, Stream};

use crate::common::{SCENES, leaf_triangles, world};

fn area(triangle: [[f32; 3]; 3]) -> f64 {
    let [a, b, c] = triangle.map(|p| DVec3::from_array(p.map(f64::from)));
    (b - a).cross(c - a).length() * 0.5
}

/// How far rounding to f32 moves a cut point: half an ulp on each axis of coordinates below 64. A
/// fragment's area changes by at most that times its perimeter, which is no longer than the whole's.
const CUT_POINT_ROUNDING: f64 = 64.0 * (f32::EPSILON as f64 / 2.0) * 1.75;

fn perimeter(triangle: [[f32; 3]; 3]) -> f64 {
    let [a, b, c] = triangle.map(|p| DVec3::from_array(p.map(f64::from)));
    a.distance(b) + b.distance(c) + c.distance(a)
}

fn corners(mesh: &PartedMesh, part: usize, triangle: usize) -> [[f32; 3]; 3] {
    let first = mesh.parts[part].first_vertex;
    mesh.triangles[triangle].map(|corner| mesh.positions[(first + corner) as usize])
}

#[test]
fn fragments_tile_their_source_triangles() {
    for scene in SCENES {
        let world = world(scene, 2, 0.02, 1);
        for (mesh, source) in world.partition.meshes().iter().zip(&world.scene.meshes) {
            let mut sums: BTreeMap<u32, (f64, u32)> = BTreeMap::new();
            for (number, part) in mesh.parts.iter().enumerate() {
                for i in part.first_triangle..part.first_triangle + part.triangle_count {
                    let rank = mesh.ranks[i as usize];
                    assert_eq!(mesh.triangle_of_rank[rank as usize], i);
                    assert_eq!(mesh.part_of_rank[rank as usize], number as u32);
                    let size = area(corners(mesh, number, i as usize));
                    let sum = sums.entry(mesh.source_of_rank[rank as usize]).or_default();
                    *sum = (sum.0 + size, sum.1 + 1);
                }
            }
            assert!(mesh.source_of_rank.is_sorted());
            assert_eq!(sums.len(), source.triangles().len(), "{scene}: a triangle was lost");
            for (source_triangle, (sum, fragments)) in sums {
                let whole = source.triangles()[source_triangle as usize];
                let whole = whole.map(|corner| source.positions()[corner as usize]);
                let margin = CUT_POINT_ROUNDING * perimeter(whole) * f64::from(fragments);
                let off = (sum - area(whole)).abs();
                assert!(off <= margin, "{scene} {source_triangle}: {off} beyond {margin}");
            }
        }
    }
}

#[test]
fn trees_are_sound_and_leaves_under_the_limit() {
    for scene in SCENES {
        let world = world(scene, 2, 0.02, 1);
        for mesh in world.partition.meshes() {
            for part in &mesh.parts {
                let run =
                    part.first_vertex as usize..(part.first_vertex + part.vertex_count) as usize;
                assert_eq!(Aabb::of_points(&mesh.positions[run]), part.bounds);
            }
            let Some(tree) = &mesh.tree else {
                assert_eq!(mesh.parts.len(), 1);
                continue;
            };
            let mut next_part = 0;
            for node in &tree.nodes {
                let parts = &mesh.parts[node.first_part as usize..node.end_part as usize];
                let bounds = parts.iter().fold(Aabb::EMPTY, |all, part| all.union(&part.bounds));
                assert!(node.bounds.contains(&bounds));
                match node.children {
                    None => {
                        assert_eq!((node.first_part, node.end_part), (next_part, next_part + 1));
                        next_part += 1;
                        // A leaf above the limit must be one that no plane parts.
                        let limit = leaf_triangles(scene);
                        assert!(parts[0].triangle_count <= limit || scene == "soup", "{scene}");
                    }
                    Some([low, high]) => {
                        let (axis, at) = (node.plane.0 as usize, f64::from(node.plane.1));
                        assert!(tree.nodes[low as usize].bounds.max[axis] <= at);
                        assert!(tree.nodes[high as usize].bounds.min[axis] >= at);
                    }
                }
            }
            assert_eq!(next_part as usize, mesh.parts.len());
        }
    }
}

#[test]
fn ids_count_up_over_objects_and_find_their_way_back() {
    let world = world("city", 2, 0.02, 1);
    let partition = &world.partition;
    let (mut part, mut draw) = (0, 0);
    for object in (0..partition.object_count()).map(ObjectId) {
        assert_eq!((partition.first_part(object).0, partition.first_draw(object)), (part, draw));
        let mesh = partition.mesh(object);
        for id in partition.parts_of(object) {
            assert_eq!(partition.locate(id), (object, id.0 - part));
        }
        let last = draw + mesh.triangles.len() as u32 - 1;
        assert_eq!(partition.source_of_draw(last).0, object);
        part += mesh.parts.len() as u32;
        draw += mesh.triangles.len() as u32;
    }
    assert_eq!((partition.part_count(), partition.fragment_count()), (part, draw));
}

/// Cutting is a function of the mesh and the knobs, whatever the number of threads.
#[test]
fn the_cut_does_not_depend_on_threads() {
    let world = world("bunnies", 2, 0.05, 1);
    let cut = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let knobs = PartitionKnobs { leaf_triangles: 100, ..PartitionKnobs::default() };
        let partition = pool.install(|| Partition::new(&world.scene, knobs));
        let of = |mesh: &Arc<PartedMesh>| (mesh.triangles.clone(), mesh.positions.clone());
        partition.meshes().iter().map(of).collect::<Vec<_>>()
    };
    assert!(cut(1) == cut(3));
}

/// Whole triangles: none is added, each stands in one part, the uncut picture comes out bit for bit,
/// and trees and leaves are as sound, but for planes that no longer part the boxes.
/// Triangles as large as their mesh part badly: the cut ends in time, and parts stay above the limit.
#[test]
fn a_mesh_that_does_not_part_is_left_in_time() {
    let mut stream = Stream::new(1, "large triangles");
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for first in (0..900).step_by(3) {
        positions.extend([0; 3].map(|_| [0; 3].map(|_| stream.range(-0.5, 0.5) as f32)));
        triangles.push([first, first + 1, first + 2]);
    }
    let mesh = Mesh::new("large", positions, triangles).unwrap();
    let knobs = PartitionKnobs { leaf_triangles: 7, ..PartitionKnobs::default() };
    let nothing = build("hard/nothing", &Knobs::default()).unwrap();
    let object = Object { mesh: 0, placement: Placement::IDENTITY };
    let scene = Scene { meshes: vec![Arc::new(mesh)], objects: vec![object], ..nothing };
    let partition = Partition::new(&scene, knobs);
    let pieces: u32 =
        (0..partition.part_count()).map(|p| partition.part(PartId(p)).triangle_count).sum();
    assert!((2000..3000).contains(&pieces), "{pieces} pieces of 300 triangles");
}

#[test]
fn whole_triangles_stay_whole() {
    for name in SCENES {
        let split = world(name, 2, 0.02, 1);
        let knobs =
            PartitionKnobs { leaf_triangles: leaf_triangles(name), crossing: Crossing::Whole };
        let world = World::new((*split.scene).clone(), knobs);
        let (whole, before) = (world.partition.fragment_count(), world.scene.triangle_count());
        assert_eq!(u64::from(whole), before, "{name}");
        assert!(whole <= split.partition.fragment_count());
        assert_eq!(partition_difference(&world), 0, "{name}");
        for (mesh, source) in world.partition.meshes().iter().zip(&world.scene.meshes) {
            let every: Vec<u32> = (0..source.triangles().len() as u32).collect();
            assert_eq!(mesh.source_of_rank, every);
            for part in &mesh.parts {
                let bounds = Aabb::of_points(mesh.positions_of(part));
                assert_eq!(bounds, part.bounds);
                let limit = leaf_triangles(name);
                assert!(part.triangle_count <= limit || name == "soup", "{name}");
            }
            for node in mesh.tree.iter().flat_map(|tree| &tree.nodes) {
                let parts = &mesh.parts[node.first_part as usize..node.end_part as usize];
                let bounds = parts.iter().fold(Aabb::EMPTY, |all, part| all.union(&part.bounds));
                assert_eq!(node.bounds, bounds);
            }
        }
    }
}
