//! The promises of cut meshes: boxes hold what they stand for, runs follow one another, every fragment has one
//! place. What a culler relies on when it asks about a box in the place of a part.

use super::{Part, PartedMesh, Partition};
use crate::math::Aabb;

impl Partition {
    /// Whether every promise about every cut mesh holds: boxes of parts are tight, several boxes of a part
    /// hold each triangle whole, those of tree nodes hold their parts, and parts, triangles and ranks follow
    /// one another without a gap.
    ///
    /// # Errors
    /// The first broken promise, in words.
    pub fn check(&self) -> Result<(), String> {
        for (number, mesh) in self.meshes.iter().enumerate() {
            check_mesh(mesh).map_err(|broken| format!("mesh {number}: {broken}"))?;
        }
        Ok(())
    }
}

fn check_mesh(mesh: &PartedMesh) -> Result<(), String> {
    let (mut vertices, mut triangles) = (0, 0);
    for (number, part) in mesh.parts.iter().enumerate() {
        if (part.first_vertex, part.first_triangle) != (vertices, triangles) {
            return Err(format!("part {number} does not follow the one before it"));
        }
        vertices += part.vertex_count;
        triangles += part.triangle_count;
        check_part(mesh, number, part)?;
    }
    if (vertices as usize, triangles as usize) != (mesh.positions.len(), mesh.triangles.len()) {
        return Err("some triangles or positions are in no part".to_owned());
    }
    let whole = mesh.parts.iter().fold(Aabb::EMPTY, |all, part| all.union(&part.bounds));
    if !whole.is_empty() && !mesh.bounds.contains(&whole) {
        return Err("its box does not hold its parts".to_owned());
    }
    for (rank, &place) in mesh.triangle_of_rank.iter().enumerate() {
        if mesh.ranks.get(place as usize) != Some(&(rank as u32)) {
            return Err(format!("the fragment of rank {rank} is not where it is said to be"));
        }
    }
    if mesh.triangle_of_rank.len() != mesh.triangles.len() {
        return Err(format!("{} fragments have a rank", mesh.triangle_of_rank.len()));
    }
    check_tree(mesh)
}

fn check_part(mesh: &PartedMesh, number: usize, part: &Part) -> Result<(), String> {
    let (positions, (triangles, ranks)) = (mesh.positions_of(part), mesh.triangles_of(part));
    if Aabb::of_points(positions) != part.bounds {
        return Err(format!("the box of part {number} is not that of its positions"));
    }
    let boxes = mesh.boxes_of(number as u32);
    for (triangle, &rank) in triangles.iter().zip(ranks) {
        let held = Aabb::of_points(triangle.iter().map(|&vertex| &positions[vertex as usize]));
        if !boxes.iter().any(|aabb| aabb.contains(&held)) {
            return Err(format!("no box of part {number} holds the fragment of rank {rank}"));
        }
        if mesh.part_of_rank.get(rank as usize) != Some(&(number as u32)) {
            return Err(format!("the fragment of rank {rank} is not said to be in part {number}"));
        }
    }
    Ok(())
}

fn check_tree(mesh: &PartedMesh) -> Result<(), String> {
    let Some(tree) = &mesh.tree else {
        return match mesh.parts.len() {
            1 => Ok(()),
            parts => Err(format!("{parts} parts and no tree")),
        };
    };
    let mut next = 0;
    for (number, node) in tree.nodes.iter().enumerate() {
        let parts = mesh.parts.get(node.first_part as usize..node.end_part as usize);
        let Some(parts) = parts.filter(|parts| !parts.is_empty()) else {
            return Err(format!("node {number} has no parts"));
        };
        let held = parts.iter().fold(Aabb::EMPTY, |all, part| all.union(&part.bounds));
        if !held.is_empty() && !node.bounds.contains(&held) {
            return Err(format!("the box of node {number} does not hold its parts"));
        }
        match node.children {
            None if (node.first_part, node.end_part) == (next, next + 1) => next += 1,
            None => return Err(format!("leaf {number} is not part {next}")),
            Some([low, high]) => {
                let [low, high] = [low, high].map(|child| &tree.nodes[child as usize]);
                let ends = (low.first_part, low.end_part, high.end_part);
                if ends != (node.first_part, high.first_part, node.end_part) {
                    return Err(format!("the children of node {number} do not have its parts"));
                }
            }
        }
    }
    match next as usize == mesh.parts.len() {
        true => Ok(()),
        false => Err(format!("the tree has {next} leaves for {} parts", mesh.parts.len())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::part::PartitionKnobs;
    use crate::scene::generate::{Knobs, build};

    fn mesh() -> PartedMesh {
        let scene = build("bunnies", &Knobs { scale: Some(0.01), ..Knobs::default() }).unwrap();
        let knobs = PartitionKnobs { leaf_triangles: 100, ..PartitionKnobs::default() };
        let partition = Partition::new(&scene, knobs);
        partition.check().unwrap();
        PartedMesh::clone(&partition.meshes()[0])
    }

    /// Each promise by itself is missed when it is broken.
    #[test]
    fn each_broken_promise_is_told() {
        let told = |harm: &dyn Fn(&mut PartedMesh)| {
            let mut mesh = mesh();
            harm(&mut mesh);
            check_mesh(&mesh).unwrap_err()
        };
        let said = [
            told(&|mesh| mesh.boxes[1] = vec![Aabb::EMPTY]),
            told(&|mesh| mesh.parts[2].bounds.max.x *= 0.5),
            told(&|mesh| mesh.parts[1].first_triangle += 1),
            told(&|mesh| mesh.bounds.max.y -= 0.1),
            told(&|mesh| mesh.ranks.swap(0, 1)),
            told(&|mesh| mesh.triangle_of_rank.truncate(1)),
            told(&|mesh| mesh.part_of_rank[3] += 1),
            told(&|mesh| mesh.tree.as_mut().unwrap().nodes[0].bounds.min.z += 0.1),
            told(&|mesh| mesh.tree.as_mut().unwrap().nodes[1].end_part -= 1),
            told(&|mesh| mesh.tree = None),
        ];
        let wanted = [
            "no box of part 1",
            "the box of part 2",
            "part 1 does not follow",
            "its box does not hold",
            "the fragment of rank",
            "fragments have a rank",
            "is not said to be in part",
            "the box of node 0",
            "node",
            "no tree",
        ];
        for (said, wanted) in said.iter().zip(wanted) {
            assert!(said.contains(wanted), "'{said}' for '{wanted}'");
        }
    }
}
