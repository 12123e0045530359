//! Meshes cut into parts: the object trees of Kovalčík & Sochor 2006 (section 3.1), part boxes and
//! stable ids. It must not know indexes over moving objects, nor oracles.
//!
//! Ids. A mesh's fragments are ranked by (source triangle, fragment); a *draw index* is the sum of
//! the object's first index and the rank, so that it orders by (object, source triangle, fragment)
//! as the raster rules ask. A *part id* is the sum of the object's first part and the leaf's number
//! in its tree, counted in depth-first order. Both are functions of the scene and the knobs alone.

mod boxes;
mod cache;
mod check;
mod cut;
mod pack;
mod tree;

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use cache::Got;

use crate::math::Aabb;
use crate::scene::{LEAF_TRIANGLES, Mesh, Scene};

pub use cache::{Cache, CacheError};
pub use tree::{ObjectNode, ObjectTree};

/// How meshes become parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct PartitionKnobs {
    /// A leaf of an object tree holds at most this many triangles, unless no plane can part them.
    /// At least 1. An object with no more than this is one part and has no tree.
    pub leaf_triangles: u32,
    /// What becomes of a triangle that a plane crosses.
    pub crossing: Crossing,
}

/// What becomes of a triangle that the plane between two parts crosses.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Crossing {
    /// It is split, as in the paper: parts do not overlap, triangles become more.
    #[default]
    Split,
    /// It goes whole to the side of its middle: no new triangles and no cracks, but parts and the
    /// tight boxes of the tree overlap. What the paper's conclusion asks for.
    Whole,
}

impl PartitionKnobs {
    /// Every object is one part, whole.
    #[must_use]
    pub const fn uncut() -> Self {
        Self { leaf_triangles: u32::MAX, crossing: Crossing::Split }
    }
}

impl Default for PartitionKnobs {
    fn default() -> Self {
        Self { leaf_triangles: LEAF_TRIANGLES, crossing: Crossing::Split }
    }
}

/// A part of the whole scene; counts up from zero over objects, then over an object's leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct PartId(pub u32);

/// An object of the scene, by its place in the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ObjectId(pub u32);

/// One part of a mesh: a run of vertices and a run of triangles that use no others.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// First of its positions in [`PartedMesh::positions`].
    pub first_vertex: u32,
    /// How many positions.
    pub vertex_count: u32,
    /// First of its triangles in [`PartedMesh::triangles`].
    pub first_triangle: u32,
    /// How many triangles; at least one, but for the single part of an empty mesh.
    pub triangle_count: u32,
    /// Tight box of its positions in the object's space, exact.
    pub bounds: Aabb,
}

/// A mesh cut into parts. Positions and triangles are grouped by part; a position on a cut stands in
/// each part that uses it, bit for bit the same.
#[derive(Clone, Debug)]
pub struct PartedMesh {
    /// Positions, grouped by part.
    pub positions: Vec<[f32; 3]>,
    /// Triangles, grouped by part and ascending in rank within one. Indices count **from the part's
    /// first vertex**.
    pub triangles: Vec<[u32; 3]>,
    /// Rank of each triangle of `triangles`: its place in the order (source triangle, fragment).
    pub ranks: Vec<u32>,
    /// The part that holds the fragment of each rank.
    pub part_of_rank: Vec<u32>,
    /// The place in `triangles` of the fragment of each rank.
    pub triangle_of_rank: Vec<u32>,
    /// The source triangle of each rank, non-decreasing.
    pub source_of_rank: Vec<u32>,
    /// The parts, at least one.
    pub parts: Vec<Part>,
    /// Each part as the reference draws it; built by [`Partition::new`].
    pub drawable: Vec<plainsight_reference::fast::Mesh>,
    /// Boxes of each part in the object's space, see [`PartedMesh::boxes_of`]; built by
    /// [`Partition::new`].
    pub boxes: Vec<Vec<Aabb>>,
    /// The tree over the parts; `None` for a mesh of one part.
    pub tree: Option<ObjectTree>,
    /// Tight box of all positions.
    pub bounds: Aabb,
}

impl PartedMesh {
    /// The positions of a part.
    #[must_use]
    pub fn positions_of(&self, part: &Part) -> &[[f32; 3]] {
        let first = part.first_vertex as usize;
        &self.positions[first..first + part.vertex_count as usize]
    }

    /// The triangles of a part and their ranks.
    #[must_use]
    pub fn triangles_of(&self, part: &Part) -> (&[[u32; 3]], &[u32]) {
        let first = part.first_triangle as usize;
        let range = first..first + part.triangle_count as usize;
        (&self.triangles[range.clone()], &self.ranks[range])
    }

    /// A few boxes, in the object's space, that hold everything of a part together and are tighter
    /// than its one box; none for an empty part.
    #[must_use]
    pub fn boxes_of(&self, part: u32) -> &[Aabb] {
        &self.boxes[part as usize]
    }

    fn drawable(&self, part: &Part) -> plainsight_reference::fast::Mesh {
        let (triangles, ranks) = self.triangles_of(part);
        plainsight_reference::fast::Mesh::new(self.positions_of(part), triangles, ranks)
    }
}

/// How the cut meshes of a partition were come by.
#[derive(Clone, Debug, Default)]
pub struct Made {
    /// Meshes that were cut.
    pub cut: u32,
    /// Meshes that were read from the cache.
    pub loaded: u32,
    /// What was wrong with files of the cache, a line each, in the order of the meshes.
    pub warnings: Vec<String>,
}

/// A scene's objects cut into parts, with the numbering that ids follow.
#[derive(Clone, Debug)]
pub struct Partition {
    meshes: Vec<Arc<PartedMesh>>,
    mesh_of_object: Vec<u32>,
    first_part: Vec<u32>,
    first_draw: Vec<u32>,
}

impl Partition {
    /// Cuts every mesh of `scene`, several at once; the result does not depend on how many.
    ///
    /// # Panics
    /// Where the scene has 2³² − 1 or more fragments or parts: draw indices are 32 bits wide.
    #[must_use]
    pub fn new(scene: &Scene, knobs: PartitionKnobs) -> Self {
        Self::make(scene, knobs, None, &|_, _| {}).0
    }

    /// The same, with what `cache` already holds read from there. `progress` is told, from any
    /// thread, how many source triangles of how many are done, first at 0; the numbers may come out
    /// of order.
    ///
    /// # Panics
    /// As [`Partition::new`].
    #[must_use]
    pub fn make(
        scene: &Scene,
        knobs: PartitionKnobs,
        cache: Option<&Cache>,
        progress: &(dyn Fn(u64, u64) + Sync),
    ) -> (Self, Made) {
        use rayon::prelude::*;
        let size = |mesh: &Mesh| mesh.triangles().len() as u64;
        let (done, total) = (AtomicU64::new(0), scene.meshes.iter().map(|mesh| size(mesh)).sum());
        progress(0, total);
        let get = |source: &Arc<Mesh>| {
            let cut = || Got { mesh: cut::cut(source, knobs), loaded: false, warning: None };
            let Got { mut mesh, loaded, warning } =
                cache.map_or_else(cut, |cache| cache.get(source, knobs));
            mesh.drawable = mesh.parts.par_iter().map(|part| mesh.drawable(part)).collect();
            mesh.boxes = mesh.parts.par_iter().map(|part| boxes::boxes(&mesh, part)).collect();
            let own = size(source);
            progress(done.fetch_add(own, Ordering::Relaxed) + own, total);
            (Arc::new(mesh), loaded, warning)
        };
        let got: Vec<_> = scene.meshes.par_iter().map(get).collect();
        let mut made = Made::default();
        let mut meshes = Vec::with_capacity(got.len());
        for (mesh, loaded, warning) in got {
            *if loaded { &mut made.loaded } else { &mut made.cut } += 1;
            made.warnings.extend(warning);
            meshes.push(mesh);
        }
        (Self::number(scene, meshes), made)
    }

    /// Counts parts and fragments over the objects.
    fn number(scene: &Scene, meshes: Vec<Arc<PartedMesh>>) -> Self {
        let mesh_of_object: Vec<u32> = scene.objects.iter().map(|o| o.mesh).collect();
        let running = |size: &dyn Fn(&PartedMesh) -> usize| {
            let mut sums = vec![0_u32];
            for &mesh in &mesh_of_object {
                let total = sums[sums.len() - 1] as usize + size(&meshes[mesh as usize]);
                assert!(total < u32::MAX as usize, "draw indices and part ids are 32 bits wide");
                sums.push(total as u32);
            }
            sums
        };
        let first_part = running(&|m| m.parts.len());
        let first_draw = running(&|m| m.triangles.len());
        Self { meshes, mesh_of_object, first_part, first_draw }
    }

    /// The same with every cut mesh altered, and its parts made drawable anew: for trials of the bench
    /// itself. Numbers of parts and fragments must stay.
    #[must_use]
    pub fn altered(&self, alter: impl Fn(&mut PartedMesh)) -> Self {
        let change = |mesh: &Arc<PartedMesh>| {
            let mut mesh = PartedMesh::clone(mesh);
            alter(&mut mesh);
            mesh.drawable = mesh.parts.iter().map(|part| mesh.drawable(part)).collect();
            Arc::new(mesh)
        };
        Self { meshes: self.meshes.iter().map(change).collect(), ..self.clone() }
    }

    /// The cut meshes, in the scene's order.
    #[must_use]
    pub fn meshes(&self) -> &[Arc<PartedMesh>] {
        &self.meshes
    }

    /// How many objects.
    #[must_use]
    pub fn object_count(&self) -> u32 {
        self.mesh_of_object.len() as u32
    }

    /// How many parts all objects have together.
    #[must_use]
    pub fn part_count(&self) -> u32 {
        self.first_part[self.mesh_of_object.len()]
    }

    /// How many fragments all objects have together.
    #[must_use]
    pub fn fragment_count(&self) -> u32 {
        self.first_draw[self.mesh_of_object.len()]
    }

    /// Which of the cut meshes an object shows.
    #[must_use]
    pub fn mesh_index(&self, object: ObjectId) -> u32 {
        self.mesh_of_object[object.0 as usize]
    }

    /// The cut mesh of an object.
    #[must_use]
    pub fn mesh(&self, object: ObjectId) -> &PartedMesh {
        &self.meshes[self.mesh_of_object[object.0 as usize] as usize]
    }

    /// The first part id of an object; its parts follow one another.
    #[must_use]
    pub fn first_part(&self, object: ObjectId) -> PartId {
        PartId(self.first_part[object.0 as usize])
    }

    /// The first draw index of an object.
    #[must_use]
    pub fn first_draw(&self, object: ObjectId) -> u32 {
        self.first_draw[object.0 as usize]
    }

    /// All parts of an object, as ids.
    pub fn parts_of(&self, object: ObjectId) -> impl Iterator<Item = PartId> + use<> {
        let at = object.0 as usize;
        (self.first_part[at]..self.first_part[at + 1]).map(PartId)
    }

    /// The object of a part and the part's number in it.
    ///
    /// # Panics
    /// For an id beyond the last part.
    #[must_use]
    pub fn locate(&self, part: PartId) -> (ObjectId, u32) {
        assert!(part.0 < self.part_count(), "part {} of {}", part.0, self.part_count());
        let object = self.first_part.partition_point(|&first| first <= part.0) - 1;
        (ObjectId(object as u32), part.0 - self.first_part[object])
    }

    /// The run of vertices and triangles of a part.
    ///
    /// # Panics
    /// For an id beyond the last part.
    #[must_use]
    pub fn part(&self, part: PartId) -> &Part {
        let (object, local) = self.locate(part);
        &self.mesh(object).parts[local as usize]
    }

    /// Triangles of the parts `first..end` of an object's mesh, counted from its first part.
    ///
    /// # Panics
    /// For a part beyond the mesh's last.
    #[must_use]
    pub fn triangles_between(&self, object: ObjectId, first: u32, end: u32) -> u64 {
        let parts = &self.mesh(object).parts[first as usize..end as usize];
        parts.last().map_or(0, |last| {
            u64::from(last.first_triangle + last.triangle_count - parts[0].first_triangle)
        })
    }

    fn locate_draw(&self, draw: u32) -> (ObjectId, u32) {
        assert!(draw < self.fragment_count(), "draw {draw} of {}", self.fragment_count());
        let object = self.first_draw.partition_point(|&first| first <= draw) - 1;
        (ObjectId(object as u32), draw - self.first_draw[object])
    }

    /// The part that holds the fragment with this draw index.
    ///
    /// # Panics
    /// For an index beyond the last fragment.
    #[must_use]
    pub fn part_of_draw(&self, draw: u32) -> PartId {
        let (object, rank) = self.locate_draw(draw);
        PartId(self.first_part(object).0 + self.mesh(object).part_of_rank[rank as usize])
    }

    /// The same, quicker where the object is `near`, which becomes the fragment's: neighbouring samples of
    /// an image mostly show one object.
    ///
    /// # Panics
    /// For an index beyond the last fragment, and an object beyond the last.
    #[must_use]
    pub fn part_of_draw_near(&self, draw: u32, near: &mut ObjectId) -> PartId {
        let object = near.0 as usize;
        if !(self.first_draw[object]..self.first_draw[object + 1]).contains(&draw) {
            *near = self.locate_draw(draw).0;
        }
        let rank = draw - self.first_draw[near.0 as usize];
        PartId(self.first_part(*near).0 + self.mesh(*near).part_of_rank[rank as usize])
    }

    /// The object and source triangle of the fragment with this draw index.
    ///
    /// # Panics
    /// For an index beyond the last fragment.
    #[must_use]
    pub fn source_of_draw(&self, draw: u32) -> (ObjectId, u32) {
        let (object, rank) = self.locate_draw(draw);
        (object, self.mesh(object).source_of_rank[rank as usize])
    }
}
