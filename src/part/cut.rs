//! Cuts a mesh into parts by axis-aligned planes (Kovalčík & Sochor 2006, section 3.1): recursively,
//! splitting the triangles that cross, until a leaf is under the limit.
//!
//! With [`Crossing::Whole`] nothing is split: a triangle goes to the side of its middle, and the axis
//! along which the triangles reach farthest is taken.
//!
//! The paper does not say how planes are chosen; here each axis offers the median of its triangles'
//! centres and the axis with the smaller larger side wins. A cut vertex is computed from the lower
//! end of its edge towards the upper one, so both triangles of the edge, and the fragments on both
//! sides, get the same bits. Fragments of *different* cells may still meet in a T-junction along a
//! cut: the truth renders the partition, and the difference to the uncut mesh is reported.
//! Cost: O(n log n) for a mesh that parts well, and bounded for any ([`MOST_GROWTH`]).

use std::collections::BTreeMap;

use super::tree::{ObjectNode, ObjectTree};
use super::{Crossing, Part, PartedMesh, PartitionKnobs};
use crate::math::Aabb;
use crate::scene::Mesh;

/// Which cut this is. It grows whenever any mesh may be cut another way than before: trees kept by an
/// older cut are then not taken for this one's. A test holds the cut of one scene beside it.
pub(super) const VERSION: u32 = 2;
/// A plane is taken only if its larger side keeps at most this share (in eighths) of the triangles;
/// otherwise splitting makes more triangles than it parts, and the cell stays a leaf above the limit.
const MOST_KEPT_EIGHTHS: usize = 7;

/// A mesh of n triangles is cut into at most about this many times n pieces; what is left then stays as
/// large as it is. Triangles that all meet in one point, or all cross all planes, would else be cut for
/// ever: with both sides at seven eighths a cell of 300 grows a millionfold on its way to 7. Scenes that
/// part well grow by a tenth, the worst of the hard ones by three times; a mesh of the plant at a fiftieth of
/// its size, cut down to 256, is one that this ends.
const MOST_GROWTH: usize = 8;

/// A piece of a source triangle, over the growing pool of positions.
#[derive(Clone, Copy, Debug)]
struct Fragment {
    source: u32,
    corners: [u32; 3],
}

/// Cuts `mesh`. An empty mesh becomes one empty part.
///
/// # Panics
/// For a leaf limit of zero.
pub(super) fn cut(mesh: &Mesh, knobs: PartitionKnobs) -> PartedMesh {
    assert!(knobs.leaf_triangles > 0, "a leaf holds at least one triangle");
    let fragments: Vec<Fragment> = mesh
        .triangles()
        .iter()
        .enumerate()
        .map(|(source, &corners)| Fragment { source: source as u32, corners })
        .collect();
    let mut cutter = Cutter {
        pieces: fragments.len(),
        most_pieces: fragments.len().saturating_mul(MOST_GROWTH),
        positions: mesh.positions().to_vec(),
        limit: knobs.leaf_triangles as usize,
        crossing: knobs.crossing,
        nodes: Vec::new(),
        leaves: Vec::new(),
    };
    cutter.build(fragments);
    cutter.finish()
}

struct Cutter {
    /// Pieces so far, and how many end the cutting.
    pieces: usize,
    most_pieces: usize,
    positions: Vec<[f32; 3]>,
    limit: usize,
    crossing: Crossing,
    nodes: Vec<ObjectNode>,
    leaves: Vec<Vec<Fragment>>,
}

impl Cutter {
    fn coordinate(&self, vertex: u32, axis: usize) -> f32 {
        self.positions[vertex as usize][axis]
    }

    fn bounds(&self, fragments: &[Fragment]) -> Aabb {
        let corners = fragments.iter().flat_map(|f| f.corners);
        Aabb::of_points(corners.map(|v| &self.positions[v as usize]))
    }

    /// Builds the node over `fragments` and all below it; its number is the place in `nodes`.
    fn build(&mut self, fragments: Vec<Fragment>) -> u32 {
        let number = self.nodes.len() as u32;
        let first_part = self.leaves.len() as u32;
        self.nodes.push(ObjectNode {
            bounds: self.bounds(&fragments),
            children: None,
            plane: (0, 0.0),
            first_part,
            end_part: first_part + 1,
        });
        let cuts = fragments.len() > self.limit && self.pieces < self.most_pieces;
        let plane = if cuts { self.choose(&fragments) } else { None };
        let Some((axis, at)) = plane else {
            self.leaves.push(fragments);
            return number;
        };
        let (low, high) = self.split(&fragments, axis, at);
        self.pieces = self.pieces + low.len() + high.len() - fragments.len();
        drop(fragments);
        let children = [self.build(low), self.build(high)];
        let end_part = self.leaves.len() as u32;
        let node = &mut self.nodes[number as usize];
        node.plane = (axis as u8, at);
        node.children = Some(children);
        node.end_part = end_part;
        number
    }

    /// The best of the three medians, or `None` where none parts the triangles well enough.
    fn choose(&self, fragments: &[Fragment]) -> Option<(usize, f32)> {
        let mut best: Option<(f64, usize, f32)> = None;
        for axis in 0..3 {
            let extent = |f: &Fragment| {
                let c = f.corners.map(|v| self.coordinate(v, axis));
                (c[0].min(c[1]).min(c[2]), c[0].max(c[1]).max(c[2]))
            };
            let mut centers: Vec<f32> =
                fragments.iter().map(extent).map(|(low, high)| low * 0.5 + high * 0.5).collect();
            let middle = centers.len() / 2;
            let (_, &mut at, _) = centers.select_nth_unstable_by(middle, f32::total_cmp);
            let (mut low_count, mut high_count) = (0, 0);
            let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
            for (low, high) in fragments.iter().map(extent) {
                // The same choice as in `split`.
                let whole = self.crossing == Crossing::Whole;
                let below = low * 0.5 + high * 0.5 <= at;
                low_count += usize::from(if whole { below } else { high <= at || low < at });
                high_count += usize::from(if whole { !below } else { high > at });
                (least, most) = (least.min(low), most.max(high));
            }
            let larger = low_count.max(high_count);
            let parts_well = larger * 8 <= fragments.len() * MOST_KEPT_EIGHTHS;
            // Both costs are smaller for a better axis.
            let cost = match self.crossing {
                Crossing::Split => larger as f64,
                Crossing::Whole => f64::from(least) - f64::from(most),
            };
            if parts_well && best.is_none_or(|(least, ..)| cost < least) {
                best = Some((cost, axis, at));
            }
        }
        best.map(|(_, axis, at)| (axis, at))
    }

    /// Sends each fragment below or above the plane; one that crosses is split. A fragment in the
    /// plane goes below.
    fn split(&mut self, from: &[Fragment], axis: usize, at: f32) -> (Vec<Fragment>, Vec<Fragment>) {
        let (mut low, mut high) = (Vec::new(), Vec::new());
        let mut cuts = BTreeMap::new();
        for &fragment in from {
            let side = fragment.corners.map(|v| self.coordinate(v, axis));
            if self.crossing == Crossing::Whole {
                let least = side[0].min(side[1]).min(side[2]);
                let most = side[0].max(side[1]).max(side[2]);
                let below = least * 0.5 + most * 0.5 <= at;
                if below { &mut low } else { &mut high }.push(fragment);
            } else if side.iter().all(|&c| c <= at) {
                low.push(fragment);
            } else if side.iter().all(|&c| c >= at) {
                high.push(fragment);
            } else {
                self.split_one(fragment, axis, at, &mut cuts, (&mut low, &mut high));
            }
        }
        (low, high)
    }

    /// Walks round the triangle and collects the polygon on each side, then fans both.
    fn split_one(
        &mut self,
        fragment: Fragment,
        axis: usize,
        at: f32,
        cuts: &mut BTreeMap<(u32, u32), u32>,
        (low, high): (&mut Vec<Fragment>, &mut Vec<Fragment>),
    ) {
        let (mut below, mut above) = (Vec::with_capacity(4), Vec::with_capacity(4));
        for i in 0..3 {
            let (from, to) = (fragment.corners[i], fragment.corners[(i + 1) % 3]);
            let (a, b) = (self.coordinate(from, axis), self.coordinate(to, axis));
            if a <= at {
                below.push(from);
            }
            if a >= at {
                above.push(from);
            }
            if (a < at && b > at) || (a > at && b < at) {
                let (lower, upper) = if a < b { (from, to) } else { (to, from) };
                let cut = *cuts
                    .entry((lower, upper))
                    .or_insert_with(|| cut_edge(&mut self.positions, lower, upper, axis, at));
                below.push(cut);
                above.push(cut);
            }
        }
        for (polygon, side) in [(below, low), (above, high)] {
            for i in 1..polygon.len() - 1 {
                let corners = [polygon[0], polygon[i], polygon[i + 1]];
                side.push(Fragment { source: fragment.source, corners });
            }
        }
    }

    /// Numbers ranks and parts, and gives each part its own run of positions.
    fn finish(self) -> PartedMesh {
        let mut order: Vec<(u32, u32)> = Vec::new();
        for fragment in self.leaves.iter().flatten() {
            order.push((fragment.source, order.len() as u32));
        }
        // Fragments of one source are numbered in the order of the leaves they fell into.
        order.sort_unstable();
        let mut ranks = vec![0; order.len()];
        for (rank, &(_, place)) in order.iter().enumerate() {
            ranks[place as usize] = rank as u32;
        }
        let mut mesh = PartedMesh {
            positions: Vec::new(),
            triangles: Vec::with_capacity(order.len()),
            ranks: Vec::with_capacity(order.len()),
            part_of_rank: vec![0; order.len()],
            triangle_of_rank: vec![0; order.len()],
            source_of_rank: order.iter().map(|&(source, _)| source).collect(),
            parts: Vec::new(),
            drawable: Vec::new(),
            boxes: Vec::new(),
            tree: None,
            bounds: self.nodes[0].bounds,
        };
        let mut local = vec![u32::MAX; self.positions.len()];
        let mut place = 0;
        for leaf in &self.leaves {
            let mut sorted: Vec<(u32, Fragment)> =
                leaf.iter().enumerate().map(|(i, &f)| (ranks[place + i], f)).collect();
            place += leaf.len();
            sorted.sort_unstable_by_key(|&(rank, _)| rank);
            mesh.push_part(&sorted, &self.positions, &mut local);
        }
        mesh.tree = (self.nodes.len() > 1).then_some(ObjectTree { nodes: self.nodes });
        mesh
    }
}

impl PartedMesh {
    /// Appends one part. `local` maps the pool to the part and is left all `u32::MAX`.
    fn push_part(&mut self, leaf: &[(u32, Fragment)], pool: &[[f32; 3]], local: &mut [u32]) {
        let number = self.parts.len() as u32;
        let (first_vertex, first_triangle) = (self.positions.len(), self.triangles.len());
        for &(rank, fragment) in leaf {
            let corners = fragment.corners.map(|v| {
                let slot = &mut local[v as usize];
                if *slot == u32::MAX {
                    *slot = (self.positions.len() - first_vertex) as u32;
                    self.positions.push(pool[v as usize]);
                }
                *slot
            });
            self.part_of_rank[rank as usize] = number;
            self.triangle_of_rank[rank as usize] = self.triangles.len() as u32;
            self.triangles.push(corners);
            self.ranks.push(rank);
        }
        for &(_, fragment) in leaf {
            for v in fragment.corners {
                local[v as usize] = u32::MAX;
            }
        }
        self.parts.push(Part {
            first_vertex: first_vertex as u32,
            vertex_count: (self.positions.len() - first_vertex) as u32,
            first_triangle: first_triangle as u32,
            triangle_count: leaf.len() as u32,
            bounds: Aabb::of_points(&self.positions[first_vertex..]),
        });
    }
}

/// Appends the point of the edge at the plane: exact on the axis, elsewhere interpolated in f64 from
/// the lower end and rounded once.
fn cut_edge(positions: &mut Vec<[f32; 3]>, lower: u32, upper: u32, axis: usize, at: f32) -> u32 {
    let (a, b) = (positions[lower as usize], positions[upper as usize]);
    let (a, b) = (a.map(f64::from), b.map(f64::from));
    let along = (f64::from(at) - a[axis]) / (b[axis] - a[axis]);
    let mut point: [f32; 3] = std::array::from_fn(|i| (a[i] + (b[i] - a[i]) * along) as f32);
    point[axis] = at;
    positions.push(point);
    (positions.len() - 1) as u32
}
