//! The works: what is drawn, at what size, all from one seed.

use plainsight_reference::fast::{Instance, Mesh};
use plainsight_reference::{Draw, Faces, Viewport};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

/// One mesh many times.
pub(crate) struct Work {
    pub(crate) name: &'static str,
    pub(crate) what: &'static str,
    pub(crate) viewport: Viewport,
    pub(crate) positions: Vec<[f32; 3]>,
    pub(crate) triangles: Vec<[u32; 3]>,
    ranks: Vec<u32>,
    pub(crate) mesh: Mesh,
    pub(crate) matrices: Vec<[f32; 16]>,
}

/// As in the published comparisons of occlusion cullers' rasterizers.
pub(crate) const SIZE: Viewport = Viewport { width: 1280, height: 1024 };

impl Work {
    fn new(
        (name, what): (&'static str, &'static str),
        (positions, triangles): (Vec<[f32; 3]>, Vec<[u32; 3]>),
        matrices: Vec<[f32; 16]>,
    ) -> Self {
        let ranks: Vec<u32> = (0..triangles.len() as u32).collect();
        let mesh = Mesh::new(&positions, &triangles, &ranks);
        Self { name, what, viewport: SIZE, positions, triangles, ranks, mesh, matrices }
    }

    /// How many triangles are drawn.
    pub(crate) fn triangle_count(&self) -> usize {
        self.triangles.len() * self.matrices.len()
    }

    pub(crate) fn draws(&self) -> impl Iterator<Item = Draw<'_>> {
        self.matrices.iter().enumerate().map(|(i, &clip_from_object)| Draw {
            positions: &self.positions,
            triangles: &self.triangles,
            ranks: &self.ranks,
            first_draw: (i * self.triangles.len()) as u32,
            clip_from_object,
            faces: Faces::CounterClockwise,
        })
    }

    pub(crate) fn instances(&self) -> Vec<Instance<'_>> {
        let faces = Faces::CounterClockwise;
        let instance = |(i, &matrix): (usize, &[f32; 16])| {
            Instance::new(&self.mesh, (i * self.triangles.len()) as u32, matrix, faces)
        };
        self.matrices.iter().enumerate().map(instance).collect()
    }

    /// The names, in the order of the table.
    pub(crate) const NAMES: [&'static str; 6] = ["A1", "A100", "A300", "B", "C1", "C2"];

    /// The work of that name.
    pub(crate) fn named(name: &str) -> Option<Self> {
        match name {
            "A1" => Some(blobs("A1", 1)),
            "A100" => Some(blobs("A100", 100)),
            "A300" => Some(blobs("A300", 300)),
            "B" => Some(street(16_000)),
            "C1" => Some(screen(("C1", "small triangles"), &[(1_000_000, 10.0)])),
            "C2" => Some(screen(("C2", "large triangles"), &[(2_000, 100_000.0)])),
            _ => None,
        }
    }
}

struct Dice(ChaCha8Rng);

impl Dice {
    fn new(stream: u64) -> Self {
        let mut generator = ChaCha8Rng::seed_from_u64(1);
        generator.set_stream(stream);
        Self(generator)
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        let unit = (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
        low + (high - low) * unit
    }
}

/// Half the height over the distance, for 60 degrees from bottom to top.
const HALF_TANGENT: f64 = 0.577_350_269_189_625_8;
const NEAR: f64 = 0.1;
const FAR: f64 = 1000.0;

/// A camera at the origin that looks along −z, and an object that is scaled and moved.
fn placed(scale: [f64; 3], at: [f64; 3]) -> [f32; 16] {
    let focal = 1.0 / HALF_TANGENT;
    let across = focal * f64::from(SIZE.height) / f64::from(SIZE.width);
    let (a, b) = (FAR / (NEAR - FAR), NEAR * FAR / (NEAR - FAR));
    let column = |[x, y, z]: [f64; 3], w: f64| [across * x, focal * y, a * z + b * w, -z];
    let columns = [
        column([scale[0], 0.0, 0.0], 0.0),
        column([0.0, scale[1], 0.0], 0.0),
        column([0.0, 0.0, scale[2]], 0.0),
        column(at, 1.0),
    ];
    std::array::from_fn(|i| columns[i / 4][i % 4] as f32)
}

/// Bumpy spheres of 69,564 triangles, about 130 pixels across, all in view.
pub(crate) fn blobs(name: &'static str, count: usize) -> Work {
    const RINGS: u32 = 187;
    let mut positions = Vec::new();
    for ring in 0..=RINGS {
        for segment in 0..RINGS {
            let polar = std::f64::consts::PI * f64::from(ring) / f64::from(RINGS);
            let round = std::f64::consts::TAU * f64::from(segment) / f64::from(RINGS);
            let bump = libm::sin(polar * 9.0) * libm::sin(round * 7.0);
            let radius = 1.0 + 0.08 * bump;
            let flat = radius * libm::sin(polar);
            let p = [flat * libm::cos(round), radius * libm::cos(polar), flat * libm::sin(round)];
            positions.push(p.map(|c| c as f32));
        }
    }
    let at = |ring: u32, segment: u32| ring * RINGS + segment % RINGS;
    let triangles = (0..RINGS * RINGS)
        .flat_map(|i| {
            let (ring, segment) = (i / RINGS, i % RINGS);
            let [a, b] = [at(ring, segment), at(ring, segment + 1)];
            let [c, d] = [at(ring + 1, segment), at(ring + 1, segment + 1)];
            // At a pole one of the two has no area.
            let upper = (ring > 0).then_some([a, b, c]);
            let lower = (ring + 1 < RINGS).then_some([b, d, c]);
            upper.into_iter().chain(lower)
        })
        .collect();
    let mut dice = Dice::new(1);
    let aspect = f64::from(SIZE.width) / f64::from(SIZE.height);
    let matrices = (0..count)
        .map(|_| {
            let depth = dice.between(15.0, 40.0);
            let reach = depth * HALF_TANGENT - 2.2;
            let x = dice.between(-1.0, 1.0) * (depth * HALF_TANGENT * aspect - 2.2);
            placed([1.75; 3], [x, dice.between(-reach, reach), -depth])
        })
        .collect();
    Work::new((name, "dense blobs"), (positions, triangles), matrices)
}

/// Boxes along streets, 80 abreast, seen from between them.
pub(crate) fn street(count: u32) -> Work {
    let positions: Vec<[f32; 3]> =
        (0..8_u32).map(|i| [0, 1, 2].map(|axis| (i >> axis & 1) as f32 - 0.5)).collect();
    let faces: [[u32; 4]; 6] =
        [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let mut dice = Dice::new(2);
    let matrices = (0..count)
        .map(|i| {
            let (column, row) = (f64::from(i % 80) - 39.5, f64::from(i / 80));
            let height = dice.between(4.0, 30.0);
            let [wide, deep] = [dice.between(6.0, 9.0), dice.between(6.0, 9.0)];
            // The eye is 1.7 above the ground, in the middle of a street.
            let at = [column * 10.0, height * 0.5 - 1.7, -6.0 - row * 10.0];
            placed([wide, height, deep], at)
        })
        .collect();
    Work::new(("B", "boxes in a street"), (positions, triangles), matrices)
}

/// Small and large triangles.
pub(crate) fn mixed_triangles(small: u32, large: u32) -> Work {
    screen(("mixed", "small and large triangles"), &[(small, 10.0), (large, 100_000.0)])
}

/// Triangles (how many, of about how many pixels) anywhere on the screen, at any depth, in random
/// order.
fn screen(name: (&'static str, &'static str), kinds: &[(u32, f64)]) -> Work {
    let mut dice = Dice::new(3);
    let (width, height) = (f64::from(SIZE.width), f64::from(SIZE.height));
    let mut positions = Vec::new();
    for &(count, area) in kinds {
        // The circumscribed circle of an equilateral triangle: area = 3·√3/4·r².
        let radius = libm::sqrt(area / 1.299_038_105_676_658);
        for _ in 0..count {
            let center = [dice.between(0.0, width), dice.between(0.0, height)];
            let depth = dice.between(0.05, 0.95);
            let turn = dice.between(0.0, std::f64::consts::TAU);
            for corner in 0..3 {
                let round = turn + std::f64::consts::TAU * f64::from(corner) / 3.0;
                let x = center[0] + radius * libm::cos(round);
                let y = center[1] + radius * libm::sin(round);
                let z = depth + dice.between(-0.04, 0.04);
                positions
                    .push([x / width * 2.0 - 1.0, y / height * 2.0 - 1.0, z].map(|c| c as f32));
            }
        }
    }
    let count = positions.len() as u32 / 3;
    let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let identity = std::array::from_fn(|i| if i % 5 == 0 { 1.0 } else { 0.0 });
    Work::new(name, (positions, triangles), vec![identity])
}
