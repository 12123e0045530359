//! Meshes as the fast renderer wants them: clusters of neighbouring triangles that own their vertices
//! as structure of arrays. Built once a mesh; knows nothing of cameras.

use super::level::LANES;

/// Most triangles of a cluster: five vectors of sixteen. A compact patch of a smooth mesh of that many
/// has some 55 vertices.
const CLUSTER_TRIANGLES: usize = 80;
/// Most vertices of a cluster: as many 32-bit words as four AVX-512 registers hold, for the look-up of
/// corners (two shuffles of two registers).
pub(crate) const CLUSTER_VERTICES: usize = 64;
/// Most clusters of a unit, the first thing that is tested and sorted.
pub(crate) const UNIT_CLUSTERS: usize = 64;

/// Triangles of one mesh, made ready for drawing any number of instances.
///
/// A mesh may be empty. Vertices that no triangle uses are dropped.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    pub(crate) clusters: Vec<Cluster>,
    /// Boxes of the clusters: lowest x, y, z, highest x, y, z.
    pub(crate) boxes: [Vec<f32>; 6],
    /// Positions by component; each cluster's are padded to [`LANES`] with its first vertex.
    pub(crate) positions: [Vec<f32>; 3],
    /// Corners of the triangles by corner, as places within the cluster; each cluster's are padded to
    /// [`LANES`] with zeros, that is with triangles without area.
    pub(crate) corners: [Vec<u8>; 3],
    /// Draw index of each triangle from the instance's first; padded like `corners`.
    pub(crate) ranks: Vec<u32>,
    triangles: usize,
    highest_rank: u32,
}

/// A few neighbouring triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cluster {
    /// First place in `positions`, a multiple of [`LANES`].
    pub(crate) first_vertex: u32,
    /// First place in `corners` and `ranks`, a multiple of [`LANES`].
    pub(crate) first_triangle: u32,
    pub(crate) vertices: u8,
    pub(crate) triangles: u8,
}

impl Mesh {
    /// Sorts the triangles into clusters. The draw index of triangle `i` in an instance is the
    /// instance's first plus `ranks[i]`.
    ///
    /// # Panics
    /// Where `ranks` is not as long as `triangles`, a triangle names a vertex that does not exist, a
    /// used position is not finite, or a mesh has 2³² / 2 triangles or more.
    #[must_use]
    pub fn new(positions: &[[f32; 3]], triangles: &[[u32; 3]], ranks: &[u32]) -> Self {
        assert_eq!(triangles.len(), ranks.len(), "one rank a triangle");
        assert!(triangles.len() < 1 << 31, "too many triangles for 32 bits");
        let corner = |vertex: u32| {
            let position = positions[vertex as usize];
            assert!(position.iter().all(|c| c.is_finite()), "vertex {vertex} is not finite");
            position
        };
        let centers: Vec<[f32; 3]> = triangles
            .iter()
            .map(|triangle| {
                let [a, b, c] = triangle.map(corner);
                // Halved first: the sum of three huge coordinates is no finite number.
                std::array::from_fn(|axis| a[axis] * 0.5 + b[axis] * 0.5 + c[axis] * 0.5)
            })
            .collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut mesh = Self {
            triangles: triangles.len(),
            highest_rank: ranks.iter().copied().max().unwrap_or(0),
            ..Self::default()
        };
        let mut local = vec![u32::MAX; positions.len()];
        let source = Source { positions, triangles, ranks, centers: &centers };
        mesh.split(&source, &mut order, &mut local);
        mesh
    }

    /// How many triangles it has.
    #[must_use]
    pub fn triangle_count(&self) -> usize {
        self.triangles
    }

    /// Bytes that it holds.
    #[must_use]
    pub fn bytes(&self) -> usize {
        let floats = self.boxes.iter().chain(&self.positions).map(Vec::len).sum::<usize>();
        let corners = self.corners.iter().map(Vec::len).sum::<usize>();
        (floats + self.ranks.len()) * 4 + corners + self.clusters.len() * size_of::<Cluster>()
    }

    /// The highest of the ranks, 0 for an empty mesh.
    pub(crate) fn highest_rank(&self) -> u32 {
        self.highest_rank
    }

    /// Halves the triangles along the longest side of their centres' box until a cluster holds them.
    /// Ties go by number, so the same mesh always gives the same clusters.
    fn split(&mut self, source: &Source<'_>, order: &mut [u32], local: &mut [u32]) {
        if order.len() <= CLUSTER_TRIANGLES && self.push(source, order, local) {
            return;
        }
        let mut low = [f32::INFINITY; 3];
        let mut high = [f32::NEG_INFINITY; 3];
        for &triangle in order.iter() {
            for (axis, &c) in source.centers[triangle as usize].iter().enumerate() {
                low[axis] = low[axis].min(c);
                high[axis] = high[axis].max(c);
            }
        }
        let side = |axis: usize| high[axis] - low[axis];
        let axis = if side(0) >= side(1) && side(0) >= side(2) {
            0
        } else if side(1) >= side(2) {
            1
        } else {
            2
        };
        // Whole clusters on the left, so that only the last is not full.
        let half = if order.len() > CLUSTER_TRIANGLES {
            order.len().div_ceil(CLUSTER_TRIANGLES).div_ceil(2) * CLUSTER_TRIANGLES
        } else {
            order.len() / 2
        };
        order.select_nth_unstable_by(half, |&a, &b| {
            let key = |t: u32| source.centers[t as usize][axis];
            key(a).total_cmp(&key(b)).then(a.cmp(&b))
        });
        let (left, right) = order.split_at_mut(half);
        self.split(source, left, local);
        self.split(source, right, local);
    }

    /// Makes a cluster of the triangles; `false`, and nothing done, where they have too many vertices.
    fn push(&mut self, source: &Source<'_>, order: &mut [u32], local: &mut [u32]) -> bool {
        if order.is_empty() {
            return true;
        }
        order.sort_unstable();
        let mut used = Vec::with_capacity(CLUSTER_VERTICES);
        let corners = order.iter().flat_map(|&t| source.triangles[t as usize]);
        for vertex in corners {
            let place = &mut local[vertex as usize];
            if *place == u32::MAX {
                *place = used.len() as u32;
                used.push(vertex);
            }
        }
        let fits = used.len() <= CLUSTER_VERTICES;
        if fits {
            self.push_cluster(source, order, local, &used);
        }
        used.iter().for_each(|&vertex| local[vertex as usize] = u32::MAX);
        fits
    }

    fn push_cluster(&mut self, source: &Source<'_>, order: &[u32], local: &[u32], used: &[u32]) {
        let first_vertex = self.positions[0].len() as u32;
        let first_triangle = self.ranks.len() as u32;
        let position = |vertex: u32| source.positions[vertex as usize];
        for axis in 0..3 {
            let of = used.iter().map(|&vertex| position(vertex)[axis]);
            let (low, high) = of
                .clone()
                .fold((f32::INFINITY, f32::NEG_INFINITY), |(l, h), c| (l.min(c), h.max(c)));
            self.boxes[axis].push(low);
            self.boxes[3 + axis].push(high);
            let padding = used.len().next_multiple_of(LANES) - used.len();
            let first = position(used[0])[axis];
            self.positions[axis].extend(of.chain(std::iter::repeat_n(first, padding)));
        }
        let padding = order.len().next_multiple_of(LANES) - order.len();
        for (corner, places) in self.corners.iter_mut().enumerate() {
            let of =
                order.iter().map(|&t| local[source.triangles[t as usize][corner] as usize] as u8);
            places.extend(of.chain(std::iter::repeat_n(0, padding)));
        }
        let ranks = order.iter().map(|&t| source.ranks[t as usize]);
        self.ranks.extend(ranks.chain(std::iter::repeat_n(0, padding)));
        self.clusters.push(Cluster {
            first_vertex,
            first_triangle,
            vertices: used.len() as u8,
            triangles: order.len() as u8,
        });
    }
}

/// What a mesh is built from.
struct Source<'a> {
    positions: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
    ranks: &'a [u32],
    centers: &'a [[f32; 3]],
}
