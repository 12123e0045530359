//! Shapes that generators share: tessellated boxes and the bumpy blob.

use glam::DVec3;

use crate::math::{cos, sin};
use crate::scene::{Mesh, Stream};

/// Triangles under construction.
#[derive(Default)]
pub(super) struct Builder {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Builder {
    pub(super) fn triangle(&mut self, corners: [DVec3; 3]) {
        let first = self.positions.len() as u32;
        self.positions.extend(corners.map(|p| p.as_vec3().to_array()));
        self.triangles.push([first, first + 1, first + 2]);
    }

    /// A grid of `cells[0]` × `cells[1]` squares over the parallelogram; neighbours share vertices.
    /// `lift` moves a point by its place (0..1, 0..1) in the grid.
    pub(super) fn grid(
        &mut self,
        origin: DVec3,
        across: DVec3,
        up: DVec3,
        cells: [u32; 2],
        lift: impl Fn(f64, f64) -> DVec3,
    ) {
        let first = self.positions.len() as u32;
        let [columns, rows] = cells.map(|c| c.max(1));
        for row in 0..=rows {
            for column in 0..=columns {
                let (u, v) =
                    (f64::from(column) / f64::from(columns), f64::from(row) / f64::from(rows));
                let point = origin + across * u + up * v + lift(u, v);
                self.positions.push(point.as_vec3().to_array());
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = first + row * (columns + 1) + column;
                let (b, c, d) = (a + 1, a + columns + 1, a + columns + 2);
                self.triangles.extend([[a, b, d], [a, d, c]]);
            }
        }
    }

    /// A closed box whose faces are grids with cells of about `cell` world units, at most `most`
    /// cells along an edge.
    pub(super) fn cuboid(&mut self, min: DVec3, max: DVec3, cell: f64, most: u32) {
        let size = max - min;
        let (x, y, z) = (DVec3::X * size.x, DVec3::Y * size.y, DVec3::Z * size.z);
        let cells = |edge: DVec3| ((edge.length() / cell).ceil() as u32).clamp(1, most);
        let flat = |_: f64, _: f64| DVec3::ZERO;
        for (origin, a, b) in [
            (min, x, y),
            (min + z, x, y),
            (min, z, y),
            (min + x, z, y),
            (min, x, z),
            (min + y, x, z),
        ] {
            self.grid(origin, a, b, [cells(a), cells(b)], flat);
        }
    }

    pub(super) fn finish(self, name: &str) -> Mesh {
        Mesh::new(name, self.positions, self.triangles).expect("generated shapes are finite")
    }
}

/// A closed bumpy blob with concavities, of about `triangles` triangles (at least 32), within unit
/// distance of its centre: a sphere by latitude and longitude whose radius is a sum of seeded waves,
/// with three dents that go half way in.
///
/// # Panics
/// Never for finite waves, which these are.
#[must_use]
pub fn blob(triangles: u32, seed: u64) -> Mesh {
    let mut stream = Stream::new(seed, "shape");
    let rings = ((f64::from(triangles.max(32)) / 4.0).sqrt().round() as u32).max(3);
    let segments = 2 * rings;
    let mut direction = || {
        let (z, around) = (stream.range(-1.0, 1.0), stream.range(0.0, std::f64::consts::TAU));
        let flat = (1.0 - z * z).sqrt();
        DVec3::new(flat * cos(around), z, flat * sin(around))
    };
    let waves: Vec<DVec3> = (0..6).map(|i| direction() * f64::from(3 + 2 * i)).collect();
    let dents: Vec<DVec3> = (0..3).map(|_| direction()).collect();
    let radius = |d: DVec3| {
        let bumps: f64 = waves.iter().map(|w| sin(w.dot(d) + w.x) / w.length()).sum();
        let depth: f64 = dents.iter().map(|c| (c.dot(d) - 0.7).max(0.0) * 1.6).sum();
        (0.75 + 0.25 * bumps - depth).clamp(0.3, 1.0)
    };
    let point = |ring: u32, segment: u32| {
        let down = std::f64::consts::PI * f64::from(ring) / f64::from(rings);
        let around = std::f64::consts::TAU * f64::from(segment) / f64::from(segments);
        let d = DVec3::new(sin(down) * cos(around), cos(down), sin(down) * sin(around));
        (d * radius(d)).as_vec3().to_array()
    };
    let mut positions = vec![point(0, 0)];
    for ring in 1..rings {
        positions.extend((0..segments).map(|segment| point(ring, segment)));
    }
    positions.push(point(rings, 0));
    let last = positions.len() as u32 - 1;
    let at = |ring: u32, segment: u32| 1 + (ring - 1) * segments + segment % segments;
    let mut faces = Vec::new();
    for s in 0..segments {
        faces.push([0, at(1, s + 1), at(1, s)]);
        for ring in 1..rings - 1 {
            let (a, b, c, d) = (at(ring, s), at(ring, s + 1), at(ring + 1, s), at(ring + 1, s + 1));
            faces.extend([[a, b, d], [a, d, c]]);
        }
        faces.push([last, at(rings - 1, s), at(rings - 1, s + 1)]);
    }
    Mesh::new("blob", positions, faces).expect("waves of finite numbers are finite")
}
