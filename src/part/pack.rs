//! A cut mesh as bytes and back, bit for bit. It knows bytes only, no files. What else a cut mesh holds
//! (ranks, part boxes) follows from what is kept, and `drawable` is built anew.
//!
//! # The format, version 1
//! Little-endian, nothing between the fields:
//!
//! | bytes | what |
//! |---|---|
//! | 8 | [`MAGIC`] |
//! | 4 | [`FORMAT_VERSION`] |
//! | 32 | the [`Key`] |
//! | 4 × 4 | how many positions P, triangles T, parts and tree nodes (0 for a mesh of one part) |
//! | 48 | box of the mesh: smallest corner, largest corner, f64 |
//! | 8 a part | how many positions, how many triangles |
//! | 72 a node | box, two children (all ones in a leaf), axis, place of the plane (f32), first part, end |
//! | 12 P | positions, f32 |
//! | 12 T | triangles, from the part's first position |
//! | 4 T | the source triangle of each |
//! | 32 | BLAKE3 of everything before |
//!
//! What is read is not believed: lengths, checksum and every index are looked at first, so that a file
//! that was truncated, damaged or made by something else costs a new cut and nothing worse.

use glam::DVec3;

use super::tree::{ObjectNode, ObjectTree};
use super::{Crossing, Part, PartedMesh, PartitionKnobs, cut};
use crate::math::Aabb;
use crate::scene::Mesh;

/// Opens every file. The last byte is no text, so that a transfer as text is noticed.
const MAGIC: [u8; 8] = *b"PSTREE\r\xff";
/// It grows with any change to the format.
const FORMAT_VERSION: u32 = 1;
/// Bytes of a key and of a checksum.
const HASH_BYTES: usize = blake3::OUT_LEN;
/// Bytes up to the counts, and with them.
const COUNTS_AT: usize = 8 + 4 + HASH_BYTES;
pub(super) const HEADER_BYTES: usize = COUNTS_AT + 4 * 4;
/// Bytes of a box, a part and a node.
const BOX_BYTES: usize = 6 * 8;
const PART_BYTES: usize = 2 * 4;
const NODE_BYTES: usize = BOX_BYTES + 6 * 4;
/// Stands for a leaf's children.
const NO_CHILD: u32 = u32::MAX;

/// What a cut mesh is a function of, as one hash: equal keys have equal cuts.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) struct Key([u8; HASH_BYTES]);

impl Key {
    /// The hash of the mesh's positions and triangles, the knobs and the versions.
    pub(super) fn of(mesh: &Mesh, knobs: PartitionKnobs) -> Self {
        let PartitionKnobs { leaf_triangles, crossing } = knobs;
        let crossing = match crossing {
            Crossing::Split => 0,
            Crossing::Whole => 1,
        };
        let (points, triangles) = (mesh.positions(), mesh.triangles());
        let mut hasher = blake3::Hasher::new();
        hasher.update(&MAGIC);
        for word in [FORMAT_VERSION, cut::VERSION, leaf_triangles, crossing] {
            hasher.update(&word.to_le_bytes());
        }
        for count in [points.len() as u64, triangles.len() as u64] {
            hasher.update(&count.to_le_bytes());
        }
        // In blocks: the hash is quick over many bytes at once.
        let mut block = Vec::new();
        for points in points.chunks(4096) {
            block.clear();
            points.iter().flatten().for_each(|c| block.extend(c.to_le_bytes()));
            hasher.update(&block);
        }
        for triangles in triangles.chunks(4096) {
            block.clear();
            triangles.iter().flatten().for_each(|v| block.extend(v.to_le_bytes()));
            hasher.update(&block);
        }
        Self(*hasher.finalize().as_bytes())
    }

    /// Sixty-four hexadecimal digits.
    pub(super) fn hex(&self) -> String {
        blake3::Hash::from_bytes(self.0).to_hex().to_string()
    }
}

/// Why bytes are not the cut mesh they should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum Damage {
    #[error("is no object tree of plainsight")]
    Foreign,
    #[error("has format {0}, this is format {FORMAT_VERSION}")]
    Version(u32),
    #[error("holds another mesh")]
    OtherMesh,
    #[error("has the wrong length")]
    Length,
    #[error("has a wrong checksum")]
    Checksum,
    #[error("does not fit together: {0}")]
    Inconsistent(&'static str),
}

/// How many of everything; the header's end.
#[derive(Clone, Copy)]
struct Counts {
    positions: usize,
    triangles: usize,
    parts: usize,
    nodes: usize,
}

impl Counts {
    /// Bytes of the whole file; cannot overflow, at 2³² of each.
    fn file_bytes(&self) -> u64 {
        let of = |count: usize, bytes: usize| count as u64 * bytes as u64;
        (HEADER_BYTES + BOX_BYTES + HASH_BYTES) as u64
            + of(self.parts, PART_BYTES)
            + of(self.nodes, NODE_BYTES)
            + of(self.positions, 3 * 4)
            + of(self.triangles, 4 * 4)
    }
}

/// The mesh as bytes.
pub(super) fn encode(mesh: &PartedMesh, key: &Key) -> Vec<u8> {
    let nodes = mesh.tree.as_ref().map_or(&[][..], |tree| &tree.nodes);
    let counts = Counts {
        positions: mesh.positions.len(),
        triangles: mesh.triangles.len(),
        parts: mesh.parts.len(),
        nodes: nodes.len(),
    };
    let mut bytes = Vec::with_capacity(counts.file_bytes() as usize);
    let put_box = |bytes: &mut Vec<u8>, aabb: &Aabb| {
        let corners = aabb.min.to_array().into_iter().chain(aabb.max.to_array());
        corners.for_each(|c| bytes.extend(c.to_le_bytes()));
    };
    bytes.extend(MAGIC);
    bytes.extend(FORMAT_VERSION.to_le_bytes());
    bytes.extend(key.0);
    for count in [counts.positions, counts.triangles, counts.parts, counts.nodes] {
        bytes.extend((count as u32).to_le_bytes());
    }
    put_box(&mut bytes, &mesh.bounds);
    for part in &mesh.parts {
        bytes.extend(part.vertex_count.to_le_bytes());
        bytes.extend(part.triangle_count.to_le_bytes());
    }
    for node in nodes {
        put_box(&mut bytes, &node.bounds);
        let [low, high] = node.children.unwrap_or([NO_CHILD; 2]);
        let (axis, at) = node.plane;
        for word in [low, high, u32::from(axis), at.to_bits(), node.first_part, node.end_part] {
            bytes.extend(word.to_le_bytes());
        }
    }
    mesh.positions.iter().flatten().for_each(|c| bytes.extend(c.to_le_bytes()));
    mesh.triangles.iter().flatten().for_each(|v| bytes.extend(v.to_le_bytes()));
    for &rank in &mesh.ranks {
        bytes.extend(mesh.source_of_rank[rank as usize].to_le_bytes());
    }
    let checksum = blake3::hash(&bytes);
    bytes.extend(checksum.as_bytes());
    bytes
}

/// The length that a file with this header has.
pub(super) fn file_bytes(header: &[u8], key: &Key) -> Result<u64, Damage> {
    Ok(counts(header, key)?.file_bytes())
}

fn counts(header: &[u8], key: &Key) -> Result<Counts, Damage> {
    if header.len() < HEADER_BYTES || header[..8] != MAGIC {
        return Err(Damage::Foreign);
    }
    let mut reader = Reader(&header[8..]);
    let version = reader.word();
    if version != FORMAT_VERSION {
        return Err(Damage::Version(version));
    }
    if *reader.take(HASH_BYTES) != key.0 {
        return Err(Damage::OtherMesh);
    }
    let [positions, triangles, parts, nodes] = [(); 4].map(|()| reader.word() as usize);
    Ok(Counts { positions, triangles, parts, nodes })
}

/// Takes bytes from the front; there are enough of them, or it panics.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.0.split_at(count);
        self.0 = rest;
        taken
    }

    fn word(&mut self) -> u32 {
        word(self.take(4))
    }

    fn aabb(&mut self) -> Aabb {
        let of = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().expect("eight bytes"));
        let [x, y, z, u, v, w] = [(); 6].map(|()| of(self.take(8)));
        Aabb::new(DVec3::new(x, y, z), DVec3::new(u, v, w))
    }

    /// `count` runs of three words.
    fn triples<T>(&mut self, count: usize, of: impl Fn(u32) -> T) -> Vec<[T; 3]> {
        let runs = self.take(count * 12).chunks_exact(12);
        runs.map(|run| [0, 4, 8].map(|at| of(word(&run[at..at + 4])))).collect()
    }
}

fn word(bytes: &[u8]) -> u32 {
    u32::from_le_bytes(bytes.try_into().expect("four bytes"))
}

fn fits(holds: bool, else_what: &'static str) -> Result<(), Damage> {
    if holds { Ok(()) } else { Err(Damage::Inconsistent(else_what)) }
}

/// The cut of a mesh of `source_triangles`, without `drawable`.
pub(super) fn decode(
    bytes: &[u8],
    key: &Key,
    source_triangles: usize,
) -> Result<PartedMesh, Damage> {
    let counts = counts(bytes, key)?;
    if bytes.len() as u64 != counts.file_bytes() {
        return Err(Damage::Length);
    }
    let (content, checksum) = bytes.split_at(bytes.len() - HASH_BYTES);
    if blake3::hash(content).as_bytes() != checksum {
        return Err(Damage::Checksum);
    }
    let mut reader = Reader(&content[HEADER_BYTES..]);
    let bounds = reader.aabb();
    let sizes: Vec<[u32; 2]> = (0..counts.parts).map(|_| [(); 2].map(|()| reader.word())).collect();
    let nodes: Vec<ObjectNode> =
        (0..counts.nodes).map(|_| node(&mut reader)).collect::<Result<_, _>>()?;
    let positions = reader.triples(counts.positions, f32::from_bits);
    let triangles = reader.triples(counts.triangles, |index| index);
    let sources: Vec<u32> = reader.0.chunks_exact(4).map(word).collect();
    fits(positions.iter().flatten().all(|c| c.is_finite()), "a position is not finite")?;
    let parts = parts(&sizes, &positions, &triangles)?;
    for part in &parts {
        let first = part.first_triangle as usize;
        let of = &sources[first..first + part.triangle_count as usize];
        fits(of.is_sorted(), "the fragments of a part are out of order")?;
    }
    let tree = tree(nodes, &parts)?;
    let root = tree.as_ref().map_or(bounds, |tree| tree.nodes[0].bounds);
    let all = parts.iter().fold(Aabb::EMPTY, |all, part| all.union(&part.bounds));
    fits(bounds == root && bounds.contains(&all), "the box does not hold the mesh")?;
    ranked(
        PartedMesh {
            positions,
            triangles,
            ranks: Vec::new(),
            part_of_rank: Vec::new(),
            triangle_of_rank: Vec::new(),
            source_of_rank: sources,
            parts,
            drawable: Vec::new(),
            boxes: Vec::new(),
            tree,
            bounds,
        },
        source_triangles,
    )
}

/// Numbers the ranks of a mesh whose `source_of_rank` still stands in the order of its triangles.
/// Ranks are the order of (source triangle, place), as the cut numbers them.
fn ranked(mut mesh: PartedMesh, source_triangles: usize) -> Result<PartedMesh, Damage> {
    let sources = std::mem::take(&mut mesh.source_of_rank);
    let mut next = vec![0_u32; source_triangles + 1];
    for &source in &sources {
        fits((source as usize) < source_triangles, "a source triangle is out of range")?;
        next[source as usize + 1] += 1;
    }
    fits(next[1..].iter().all(|&fragments| fragments > 0), "a source triangle is lost")?;
    // From counts to the first rank of each source.
    for source in 0..source_triangles {
        next[source + 1] += next[source];
    }
    let count = sources.len();
    mesh.ranks = vec![0; count];
    (mesh.part_of_rank, mesh.triangle_of_rank) = (vec![0; count], vec![0; count]);
    mesh.source_of_rank = vec![0; count];
    for (number, part) in mesh.parts.iter().enumerate() {
        for place in part.first_triangle..part.first_triangle + part.triangle_count {
            let source = sources[place as usize];
            let rank = next[source as usize];
            next[source as usize] += 1;
            mesh.ranks[place as usize] = rank;
            mesh.part_of_rank[rank as usize] = number as u32;
            mesh.triangle_of_rank[rank as usize] = place;
            mesh.source_of_rank[rank as usize] = source;
        }
    }
    Ok(mesh)
}

/// The parts of these sizes, one after another, with their boxes.
fn parts(
    sizes: &[[u32; 2]],
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
) -> Result<Vec<Part>, Damage> {
    let (mut first_vertex, mut first_triangle) = (0_usize, 0_usize);
    let mut parts = Vec::with_capacity(sizes.len());
    let empty = triangles.is_empty() && sizes.len() == 1;
    for &[vertex_count, triangle_count] in sizes {
        let vertices = first_vertex..first_vertex + vertex_count as usize;
        let corners = first_triangle..first_triangle + triangle_count as usize;
        let inside = vertices.end <= positions.len() && corners.end <= triangles.len();
        fits(inside, "parts hold more than there is")?;
        fits(triangle_count > 0 || empty, "a part is empty")?;
        let corners_inside = triangles[corners.clone()].iter().flatten().all(|&v| v < vertex_count);
        fits(corners_inside, "a triangle names a position beyond its part")?;
        parts.push(Part {
            first_vertex: first_vertex as u32,
            vertex_count,
            first_triangle: first_triangle as u32,
            triangle_count,
            bounds: Aabb::of_points(&positions[vertices.clone()]),
        });
        (first_vertex, first_triangle) = (vertices.end, corners.end);
    }
    let all = first_vertex == positions.len() && first_triangle == triangles.len();
    fits(all && !parts.is_empty(), "parts hold less than there is")?;
    Ok(parts)
}

fn node(reader: &mut Reader<'_>) -> Result<ObjectNode, Damage> {
    let bounds = reader.aabb();
    let [low, high, axis, at, first_part, end_part] = [(); 6].map(|()| reader.word());
    let leaf = [low, high] == [NO_CHILD; 2];
    let plane = (axis as u8, f32::from_bits(at));
    // A leaf has no plane; the cut leaves zeros there.
    let sound = if leaf { [axis, at] == [0; 2] } else { axis < 3 && plane.1.is_finite() };
    fits(sound, "a plane is none")?;
    let children = (!leaf).then_some([low, high]);
    Ok(ObjectNode { bounds, children, plane, first_part, end_part })
}

/// The tree, where its nodes stand in depth-first order over all parts and hold what is below them.
fn tree(nodes: Vec<ObjectNode>, parts: &[Part]) -> Result<Option<ObjectTree>, Damage> {
    if nodes.is_empty() {
        fits(parts.len() == 1, "several parts have no tree")?;
        return Ok(None);
    }
    fits(nodes.len() >= 3 && nodes.len() == 2 * parts.len() - 1, "the tree has too many nodes")?;
    // From the last node to the first, children before parents: where each node's subtree ends.
    let mut ends = vec![0_usize; nodes.len()];
    let mut parts_left = parts.len();
    for number in (0..nodes.len()).rev() {
        let node = &nodes[number];
        let Some([low, high]) = node.children else {
            fits(parts_left > 0, "the tree has too many leaves")?;
            parts_left -= 1;
            ends[number] = number + 1;
            let own = parts_left as u32..parts_left as u32 + 1;
            fits((node.first_part..node.end_part) == own, "leaves and parts differ")?;
            fits(node.bounds.contains(&parts[parts_left].bounds), "a leaf's box is too small")?;
            continue;
        };
        let (low, high) = (low as usize, high as usize);
        let ordered = low == number + 1 && low < nodes.len() && high == ends[low];
        fits(ordered && high < nodes.len(), "the tree is not in depth-first order")?;
        ends[number] = ends[high];
        let (low, high) = (&nodes[low], &nodes[high]);
        let run = low.first_part..high.end_part;
        fits((node.first_part..node.end_part) == run, "a node's parts are not its children's")?;
        let held = node.bounds.contains(&low.bounds.union(&high.bounds));
        fits(held, "a node's box is too small")?;
    }
    fits(ends[0] == nodes.len() && parts_left == 0, "the tree does not end")?;
    Ok(Some(ObjectTree { nodes }))
}
