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

    /// A tube of `sides` flat sides round the polyline `points`, open at both ends. The rings are
    /// carried along without twisting; points that coincide are passed over.
    pub(super) fn tube(&mut self, points: &[DVec3], radius: f64, sides: u32) {
        let mut rings: Vec<u32> = Vec::new();
        let mut side = DVec3::ZERO;
        for (place, &point) in points.iter().enumerate() {
            let before = points[place.saturating_sub(1)];
            let after = points[(place + 1).min(points.len() - 1)];
            let Some(along) = (after - before).try_normalize() else { continue };
            // The part of the last side that is still across; any perpendicular at the start.
            side = (side - along * side.dot(along))
                .try_normalize()
                .unwrap_or_else(|| along.any_orthonormal_vector());
            let up = along.cross(side);
            rings.push(self.positions.len() as u32);
            for corner in 0..sides {
                let turn = std::f64::consts::TAU * f64::from(corner) / f64::from(sides);
                let at = point + (side * cos(turn) + up * sin(turn)) * radius;
                self.positions.push(at.as_vec3().to_array());
            }
        }
        for pair in rings.windows(2) {
            self.band(pair[0], pair[1], sides);
        }
    }

    /// A body of revolution about the y axis through `origin`: `profile` lists (radius, height), and
    /// a radius of zero closes an end.
    pub(super) fn lathe(&mut self, origin: DVec3, profile: &[[f64; 2]], sides: u32) {
        let first = self.positions.len() as u32;
        for &[radius, height] in profile {
            for corner in 0..sides {
                let turn = std::f64::consts::TAU * f64::from(corner) / f64::from(sides);
                let at = origin + DVec3::new(radius * cos(turn), height, radius * sin(turn));
                self.positions.push(at.as_vec3().to_array());
            }
        }
        for ring in 1..profile.len() as u32 {
            self.band(first + (ring - 1) * sides, first + ring * sides, sides);
        }
    }

    /// The triangles between two rings of vertices.
    fn band(&mut self, low: u32, high: u32, sides: u32) {
        for corner in 0..sides {
            let next = (corner + 1) % sides;
            let [a, b, c, d] = [low + corner, low + next, high + corner, high + next];
            self.triangles.extend([[a, b, d], [a, d, c]]);
        }
    }

    /// Turns what was built so far a quarter about the z axis, so that y becomes x.
    pub(super) fn lay_along_x(&mut self) {
        self.positions.iter_mut().for_each(|p| *p = [p[1], -p[0], p[2]]);
    }

    pub(super) fn finish(self, name: &str) -> Mesh {
        Mesh::new(name, self.positions, self.triangles).expect("generated shapes are finite")
    }
}

/// The polyline with its corners rounded: each inner corner becomes `steps` chords of a curve that
/// begins and ends `reach` away from it, or half way to its neighbour where that is nearer; straight
/// runs are cut about every `cell` units.
pub(super) fn rounded(corners: &[DVec3], reach: f64, steps: u32, cell: f64) -> Vec<DVec3> {
    let mut points = vec![corners[0]];
    let straight = |points: &mut Vec<DVec3>, to: DVec3| {
        let from = points[points.len() - 1];
        let cells = (from.distance(to) / cell).ceil().max(1.0) as u32;
        points.extend((1..=cells).map(|i| from.lerp(to, f64::from(i) / f64::from(cells))));
    };
    for three in corners.windows(3) {
        let [before, corner, after] = [three[0], three[1], three[2]];
        let near = |end: DVec3| {
            let whole = end - corner;
            corner + whole * (reach / whole.length().max(reach)).min(0.5)
        };
        let (enter, leave) = (near(before), near(after));
        straight(&mut points, enter);
        points.extend((1..=steps).map(|i| {
            let t = f64::from(i) / f64::from(steps);
            enter.lerp(corner, t).lerp(corner.lerp(leave, t), t)
        }));
    }
    straight(&mut points, corners[corners.len() - 1]);
    points
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
