//! Meshes as the fast renderer wants them: clusters of neighbouring triangles that own their vertices
//! as structure of arrays. Built once a mesh; knows nothing of cameras.

use super::level::LANES;

/// Most triangles of a cluster: five vectors of sixteen. A compact patch of a smooth mesh of that many
/// has some 55 vertices.
const CLUSTER_TRIANGLES: usize = 80;
/// Triangles this many times as large as the mesh's median have clusters of their own.
const LARGE: f32 = 8.0;
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
    /// One run of words a cluster (see [`View`]), so that a cluster is one sequential read.
    words: Vec<u32>,
    triangles: usize,
    highest_rank: u32,
}

/// A few neighbouring triangles.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cluster {
    first_word: u32,
    pub(crate) vertices: u8,
    pub(crate) triangles: u8,
}

/// What a cluster consists of.
#[derive(Clone, Copy)]
pub(crate) struct View<'a> {
    /// Bits of the positions by component; padded to [`LANES`] with the first vertex.
    pub(crate) positions: [&'a [u32]; 3],
    /// The triangles' corners as places among the positions, a byte each, the first lowest; padded to
    /// [`LANES`] with zeros, that is with triangles without area.
    pub(crate) corners: &'a [u32],
    /// Draw index of each triangle from the instance's first; padded like `corners`.
    pub(crate) ranks: &'a [u32],
}

impl View<'_> {
    /// Places of the corners of a triangle.
    #[inline(always)]
    pub(crate) fn triangle(&self, i: usize) -> [usize; 3] {
        let word = self.corners[i] as usize;
        three!(corner => word >> (8 * corner) & (CLUSTER_VERTICES - 1))
    }

    pub(crate) fn position(&self, i: usize) -> [f32; 3] {
        self.positions.map(|component| f32::from_bits(component[i]))
    }
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
        let corners = || triangles.iter().map(|triangle| triangle.map(corner));
        // Halved first: the sum of three huge coordinates is no finite number.
        let center =
            |[a, b, c]: [[f32; 3]; 3], axis: usize| a[axis] * 0.5 + b[axis] * 0.5 + c[axis] * 0.5;
        let centers: Vec<[f32; 3]> =
            corners().map(|triangle| [0, 1, 2].map(|axis| center(triangle, axis))).collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut mesh = Self {
            triangles: triangles.len(),
            highest_rank: ranks.iter().copied().max().unwrap_or(0),
            ..Self::default()
        };
        let mut local = vec![u32::MAX; positions.len()];
        let source = Source { positions, triangles, ranks, centers: &centers };
        let large = large_first(&mut order, &corners().map(extent).collect::<Vec<_>>());
        let (large, small) = order.split_at_mut(large);
        mesh.split(&source, large, &mut local);
        mesh.split(&source, small, &mut local);
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
        let floats: usize = self.boxes.iter().map(Vec::len).sum();
        (floats + self.words.len()) * 4 + self.clusters.len() * size_of::<Cluster>()
    }

    #[inline(always)]
    pub(crate) fn view(&self, cluster: Cluster) -> View<'_> {
        let vertices = usize::from(cluster.vertices).next_multiple_of(LANES);
        let triangles = usize::from(cluster.triangles).next_multiple_of(LANES);
        let words = &self.words[cluster.first_word as usize..][..3 * vertices + 2 * triangles];
        let (positions, words) = words.split_at(3 * vertices);
        let (corners, ranks) = words.split_at(triangles);
        let positions = three!(axis => &positions[axis * vertices..(axis + 1) * vertices]);
        View { positions, corners, ranks }
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
        let first_word = u32::try_from(self.words.len()).expect("a mesh fits 16 GiB");
        let pad = |count: usize| count.next_multiple_of(LANES) - count;
        let position = |vertex: u32, axis: usize| source.positions[vertex as usize][axis];
        for axis in 0..3 {
            let of = used.iter().map(|&vertex| position(vertex, axis));
            let (low, high) =
                of.clone().fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), c| {
                    (low.min(c), high.max(c))
                });
            self.boxes[axis].push(low);
            self.boxes[3 + axis].push(high);
            let padding = std::iter::repeat_n(position(used[0], axis), pad(used.len()));
            self.words.extend(of.chain(padding).map(f32::to_bits));
        }
        let corners = order.iter().map(|&t| {
            let [a, b, c] = source.triangles[t as usize].map(|vertex| local[vertex as usize]);
            a | b << 8 | c << 16
        });
        let ranks = order.iter().map(|&t| source.ranks[t as usize]);
        let padding = || std::iter::repeat_n(0, pad(order.len()));
        self.words.extend(corners.chain(padding()));
        self.words.extend(ranks.chain(padding()));
        self.clusters.push(Cluster {
            first_word,
            vertices: used.len() as u8,
            triangles: order.len() as u8,
        });
    }
}

/// Longest side of a triangle's box, halved.
fn extent([a, b, c]: [[f32; 3]; 3]) -> f32 {
    let side = |axis: usize| {
        let [a, b, c] = [a[axis] * 0.5, b[axis] * 0.5, c[axis] * 0.5];
        a.max(b).max(c) - a.min(b).min(c)
    };
    side(0).max(side(1)).max(side(2))
}

/// Brings the triangles that are much larger than most to the front; how many. Among small ones each
/// would make a whole cluster large.
fn large_first(order: &mut [u32], extents: &[f32]) -> usize {
    if order.len() <= CLUSTER_TRIANGLES {
        return 0;
    }
    let middle = order.len() / 2;
    let by_extent =
        |&a: &u32, &b: &u32| extents[a as usize].total_cmp(&extents[b as usize]).then(a.cmp(&b));
    let (_, &mut median, _) = order.select_nth_unstable_by(middle, by_extent);
    let limit = extents[median as usize] * LARGE;
    order.sort_unstable_by_key(|&t| (extents[t as usize] <= limit, t));
    order.partition_point(|&t| extents[t as usize] > limit)
}

/// What a mesh is built from.
struct Source<'a> {
    positions: &'a [[f32; 3]],
    triangles: &'a [[u32; 3]],
    ranks: &'a [u32],
    centers: &'a [[f32; 3]],
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extents_are_half_the_longest_side() {
        let triangle = |order: [usize; 3]| {
            let corners = [[10.0_f32, -20.0, 3.0], [13.0, -19.0, 5.0], [11.0, -16.0, 4.0]];
            corners.map(|corner| order.map(|axis| corner[axis]))
        };
        for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1]] {
            assert_eq!(extent(triangle(order)), 2.0, "{order:?}");
        }
    }

    /// More than eight times the median is large; exactly eight times is not, nor is anything in a mesh of
    /// one cluster.
    #[test]
    fn large_triangles_come_first() {
        // Those of exactly eight times first, so that they would be taken with the large ones.
        let mut extents = vec![8.0_f32; 3];
        extents.extend([0.01; 70]);
        extents.extend([1.0; 100]);
        extents.splice(30..30, [8.5, 100.0]);
        let mut order: Vec<u32> = (0..175).rev().collect();
        assert_eq!(large_first(&mut order, &extents), 2);
        let expected: Vec<u32> = [30, 31].into_iter().chain(0..30).chain(32..175).collect();
        assert_eq!(order, expected);
        let mut few: Vec<u32> = (0..80).collect();
        extents[79] = 1e9;
        assert_eq!(large_first(&mut few, &extents), 0);
        let mut more: Vec<u32> = (0..81).collect();
        // The median is 0.01 there: all but the 70 of it are large.
        assert_eq!(large_first(&mut more, &extents), 11);
        assert_eq!(more[..5], [0, 1, 2, 30, 31]);
    }

    /// Eighty triangles without common vertices have too many vertices for a cluster, and are halved twice.
    #[test]
    fn clusters_end_at_their_vertices() {
        let positions: Vec<[f32; 3]> = (0..240).map(|i| [i as f32, (i % 3) as f32, 0.0]).collect();
        let triangles: Vec<[u32; 3]> = (0..80).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let ranks: Vec<u32> = (0..80).collect();
        let mesh = Mesh::new(&positions, &triangles, &ranks);
        let counts: Vec<_> = mesh.clusters.iter().map(|c| (c.triangles, c.vertices)).collect();
        assert_eq!(counts, [(20, 60); 4]);
        // In the order of their places, each with its own box and ranks.
        for (i, &cluster) in mesh.clusters.iter().enumerate() {
            let first = 60.0 * i as f32;
            assert_eq!((mesh.boxes[0][i], mesh.boxes[3][i]), (first, first + 59.0));
            let ranks = 20 * i as u32..20 * (i as u32 + 1);
            assert_eq!(mesh.view(cluster).ranks[..20], ranks.collect::<Vec<_>>());
        }
    }
}
