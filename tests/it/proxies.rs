//! An attack on every proxy: seeded search, then climbing, for contents of a box that show at a sample
//! which the box's proxy misses. The climb goes for the last bits: it keeps what comes nearer to the edge
//! of the proxy. That it has teeth is seen by what it does to proxies without their margins.
//!
//! `PLAINSIGHT_ATTACKS` multiplies the number of attacks, for a long run by hand.

use glam::{DMat4, DQuat, DVec3};
use plainsight::math::{
    Aabb, ClipBox, ClipError, Hull, PixelRectangle, Projection, inflated_box, rounded_clip_matrix,
};
use plainsight::scene::{Camera, Lens, Stream, Viewport};
use plainsight_reference::{Draw, Faces, Image, naive};

/// Where attacks begin, and steps of each climb.
const ATTACKS: u32 = 1500;
const STEPS: u32 = 120;

/// A box, what is in it, and how it is seen.
#[derive(Clone)]
struct Case {
    viewport: Viewport,
    camera: Camera,
    translation: DVec3,
    turn: [f64; 3],
    scale: DVec3,
    low: [f32; 3],
    high: [f32; 3],
    /// Corners of the contents, each a place in the box: shares of the way from low to high.
    places: [[f64; 3]; 3],
}

fn near_end(stream: &mut Stream) -> f64 {
    // Mostly on faces, edges and corners, where contents reach farthest.
    match stream.below(5) {
        0 => stream.unit(),
        1 | 2 => 0.0,
        _ => 1.0,
    }
}

fn power(stream: &mut Stream, low: f64, high: f64) -> f64 {
    libm::pow(10.0, stream.range(low, high))
}

impl Case {
    fn random(stream: &mut Stream) -> Self {
        let viewport = Viewport { width: 1 + stream.below(60), height: 1 + stream.below(45) };
        let mut vector = |reach: f64| {
            let mut along = || stream.range(-reach, reach);
            DVec3::new(along(), along(), along())
        };
        let (turn, aside, wobble) = (vector(3.0).to_array(), vector(1.0), vector(0.3));
        // Straight on, where whole edges lie beside samples, or from anywhere.
        let straight = f64::from(stream.below(2));
        let (turn, wobble) = (turn.map(|angle| angle * straight), wobble * straight);
        let unit = power(stream, -3.0, 3.0);
        let far_off = if stream.below(3) == 0 { power(stream, 0.0, 5.0) } else { 0.0 } * unit;
        let fov = [1.0, 30.0, 60.0, 120.0, 170.0][stream.below(5) as usize];
        let lens = if stream.below(6) == 0 {
            Lens::Orthographic { height: 3.0 * unit }
        } else {
            let shift = [stream.range(-0.5, 0.5), stream.range(-0.5, 0.5)];
            Lens::Perspective { fov_y: f64::to_radians(fov), shift }
        };
        // The box about fills the picture, or is far smaller.
        let distance =
            unit * match lens {
                Lens::Orthographic { .. } => 3.0,
                Lens::Perspective { .. } => {
                    2.0 / libm::tan(f64::to_radians(fov) * 0.5).max(0.02) + 1.5
                }
            } * power(stream, 0.0, 0.8);
        let forward = (DVec3::NEG_Z + wobble).normalize();
        let origin = DVec3::new(1.0, -0.7, 1.3) * far_off;
        let eye = origin - forward * distance + aside * unit * 0.3;
        let near = unit * power(stream, -3.0, -1.0);
        let far = if stream.below(4) == 0 { f64::INFINITY } else { distance + unit * 30.0 };
        let far =
            if matches!(lens, Lens::Orthographic { .. }) { distance + unit * 9.0 } else { far };
        let camera = Camera { eye, forward, lens, near, far };
        // The mesh's own coordinates, away from its origin at times.
        let own = power(stream, -2.0, 2.0);
        let away = if stream.below(3) == 0 { power(stream, 0.0, 5.0) * own } else { 0.0 };
        let mut side = || {
            let low = (away + stream.range(-1.0, 0.0) * own) as f32;
            let thick = [0.0, 1e-4, 1.0, 1.0, 1.0, 1.0][stream.below(6) as usize]
                * stream.range(0.3, 2.0)
                * own;
            (low, (f64::from(low) + thick) as f32)
        };
        let sides = [side(), side(), side()];
        let (low, high) = (sides.map(|side| side.0), sides.map(|side| side.1));
        let mirror = |stream: &mut Stream| if stream.below(4) == 0 { -1.0 } else { 1.0 };
        let scale = DVec3::new(mirror(stream), mirror(stream), mirror(stream))
            * (unit / own)
            * DVec3::new(1.0, power(stream, -1.0, 0.5), 1.0);
        let placed = DQuat::from_euler(glam::EulerRot::XYZ, turn[0], turn[1], turn[2]);
        let middle = (DVec3::from(low.map(f64::from)) + DVec3::from(high.map(f64::from))) * 0.5;
        let translation = origin - placed * (middle * scale);
        let places = [0; 3].map(|_| [0; 3].map(|_| near_end(stream)));
        Self { viewport, camera, translation, turn, scale, low, high, places }
    }

    /// A case near it.
    fn changed(&self, stream: &mut Stream) -> Self {
        let mut case = self.clone();
        // From a hundredth of a unit down to the last bits.
        let small = 1.0 + libm::pow(2.0, -stream.range(4.0, 26.0)) * stream.range(-1.0, 1.0);
        match stream.below(9) {
            6.. => {
                // Aside by a pixel or a share of one.
                let distance = case.translation.distance(case.camera.eye);
                let pixel = case.camera.lens.height_at(distance) / f64::from(case.viewport.height);
                let step = pixel * power(stream, -6.0, 0.0) * stream.range(-1.0, 1.0);
                case.translation[stream.below(3) as usize] += step;
            }
            0 => case.translation[stream.below(3) as usize] *= small,
            1 => case.turn[stream.below(3) as usize] *= small,
            2 => case.camera.eye[stream.below(3) as usize] *= small,
            3 => {
                let axis = stream.below(3) as usize;
                case.high[axis] = if stream.below(2) == 0 {
                    case.high[axis].next_up()
                } else {
                    case.high[axis].next_down().max(case.low[axis])
                };
            }
            4 => {
                case.places[stream.below(3) as usize][stream.below(3) as usize] = near_end(stream);
            }
            _ => case.scale[stream.below(3) as usize] *= small,
        }
        case
    }

    fn world_from_object(&self) -> DMat4 {
        let [x, y, z] = self.turn;
        let turn = DQuat::from_euler(glam::EulerRot::XYZ, x, y, z);
        DMat4::from_scale_rotation_translation(self.scale, turn, self.translation)
    }

    /// The contents' corners, within the box.
    fn contents(&self) -> [[f32; 3]; 3] {
        self.places.map(|place| {
            std::array::from_fn(|axis| {
                let (low, high) = (self.low[axis], self.high[axis]);
                let between = f64::from(low) + (f64::from(high) - f64::from(low)) * place[axis];
                (between as f32).clamp(low, high)
            })
        })
    }
}

/// What a proxy says of one sample.
struct Sample {
    column: u32,
    row: u32,
    depth: f32,
}

/// The triangles' image alone.
fn drawn(
    viewport: Viewport,
    positions: &[[f32; 3]],
    triangles: &[[u32; 3]],
    m: [f32; 16],
) -> Image {
    let ranks: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut image = Image::new(viewport);
    let faces = Faces::Both;
    naive::draw(
        &mut image,
        &Draw { positions, triangles, ranks: &ranks, first_draw: 0, clip_from_object: m, faces },
    );
    image
}

fn samples(image: &Image) -> Vec<Sample> {
    let width = image.viewport().width;
    (0..image.sample_count() as u32)
        .filter(|&i| image.draw_index(i as usize).is_some())
        .map(|i| Sample { column: i % width, row: i / width, depth: image.depth(i as usize) })
        .collect()
}

/// The triangles of a box.
fn box_mesh(aabb: &Aabb) -> (Vec<[f32; 3]>, [[u32; 3]; 12]) {
    let corners = aabb.corners().map(|corner| corner.as_vec3().to_array());
    let faces =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangle = |i: usize| {
        let [a, b, c, d] = faces[i / 2];
        if i.is_multiple_of(2) { [a, b, c] } else { [a, c, d] }
    };
    (corners.to_vec(), std::array::from_fn(triangle))
}

/// Whether each kind of proxy holds every sample, and the same without its margins.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Found {
    /// Samples that contents showed at in a box that can be asked about.
    samples: u64,
    /// Samples that a proxy misses: rectangle, hull, box.
    missed: [u64; 3],
    /// Samples that it would miss without margins.
    bare: [u64; 3],
    /// Samples outside of the exact projection.
    outside: u64,
    /// How far a sample of the contents stood out of the exact projection, at most, as a share of the margin;
    /// negative inside.
    reached: f64,
}

impl Found {
    const NOTHING: Self =
        Self { samples: 0, missed: [0; 3], bare: [0; 3], outside: 0, reached: f64::NEG_INFINITY };
}

fn exact_bounds(corners: &[[f64; 2]]) -> [[f64; 2]; 2] {
    let bound = |axis: usize, pick: fn(f64, f64) -> f64, from: f64| {
        corners.iter().fold(from, |all, corner| pick(all, corner[axis]))
    };
    [
        [bound(0, f64::min, f64::INFINITY), bound(1, f64::min, f64::INFINITY)],
        [bound(0, f64::max, f64::NEG_INFINITY), bound(1, f64::max, f64::NEG_INFINITY)],
    ]
}

/// Attacks the three proxies with one case.
fn attack(case: &Case) -> Found {
    let Viewport { width, height } = case.viewport;
    let clip_from_world = case.camera.clip_from_world(case.viewport);
    let world_from_object = case.world_from_object();
    let clip_from_object = clip_from_world * world_from_object;
    let wide = |p: [f32; 3]| DVec3::from(p.map(f64::from));
    let aabb = Aabb::new(wide(case.low), wide(case.high));
    let error = ClipError::of(&clip_from_world, &world_from_object, aabb.max_abs());
    let matrix = rounded_clip_matrix(&clip_from_object);
    let mut found = Found::NOTHING;
    let contents = drawn(case.viewport, &case.contents(), &[[0, 1, 2]], matrix);
    let samples = samples(&contents);
    let clip = ClipBox::new(&aabb, &clip_from_object, &error);
    let (rectangle, depth) = match clip.project(width, height) {
        Projection::Unbounded => return found,
        Projection::Nowhere => {
            found.samples = samples.len() as u64;
            found.missed[0] = found.samples;
            return found;
        }
        Projection::Within { rectangle, depth } => (rectangle, depth),
    };
    found.samples = samples.len() as u64;
    let hull = clip.hull(width, height, &rectangle);
    // Without margins: corners as they are, depth as it is.
    let corners = aabb.corners().map(|corner| clip_from_object * corner.extend(1.0));
    let half = [f64::from(width) * 0.5, f64::from(height) * 0.5];
    let window = corners.map(|c| [c.x / c.w * half[0] + half[0], half[1] - c.y / c.w * half[1]]);
    let nearest = corners.iter().fold(1.0_f64, |z, c| z.min(c.z / c.w));
    let [low, high] = exact_bounds(&window);
    let whole = PixelRectangle { min: [0, 0], max: [width, height] };
    let bare_hull = Hull::new(&window, [0.0; 2], &whole);
    let holds = |hull: &Hull, sample: &Sample| {
        hull.rows().any(|(row, from, to)| row == sample.row && (from..to).contains(&sample.column))
    };
    let w_min = corners.iter().fold(f64::INFINITY, |w, c| w.min(c.w));
    let margin = |axis: usize| {
        let reach = corners.iter().fold(0.0_f64, |r, c| r.max((c[axis] / c.w).abs()));
        (error.bound[axis] + reach * error.bound[3]) / w_min * half[axis]
            + plainsight::math::RECTANGLE_DILATION_PIXELS
    };
    for sample in &samples {
        let Sample { column, row, depth: shown } = *sample;
        let at = [f64::from(column) + 0.5, f64::from(row) + 0.5];
        let within = |r: &PixelRectangle| {
            (r.min[0]..r.max[0]).contains(&column) && (r.min[1]..r.max[1]).contains(&row)
        };
        let before = depth <= shown;
        found.missed[0] += u64::from(!(within(&rectangle) && before));
        let in_hull = hull.as_ref().map_or(within(&rectangle), |hull| holds(hull, sample));
        found.missed[1] += u64::from(!(in_hull && before));
        let out = (0..2).map(|i| (low[i] - at[i]).max(at[i] - high[i]) / margin(i));
        let out = out.fold(f64::NEG_INFINITY, f64::max);
        found.reached = found.reached.max(out);
        let bare_depth = nearest <= f64::from(shown);
        found.outside += u64::from(out > 0.0);
        found.bare[0] += u64::from(out > 0.0 || !bare_depth);
        let in_bare = bare_hull.as_ref().is_some_and(|hull| holds(hull, sample));
        found.bare[1] += u64::from(bare_hull.is_some() && !(in_bare && bare_depth));
    }
    let box_misses = |aabb: &Aabb| {
        let (positions, triangles) = box_mesh(aabb);
        let proxy = drawn(case.viewport, &positions, &triangles, matrix);
        let misses = |sample: &&Sample| {
            let i = (sample.row * width + sample.column) as usize;
            proxy.draw_index(i).is_none() || proxy.depth(i) > sample.depth
        };
        samples.iter().filter(misses).count() as u64
    };
    if let Some(grown) = inflated_box(&aabb, &clip_from_object, &error, (width, height)) {
        found.missed[2] = box_misses(&grown);
        found.bare[2] = box_misses(&aabb);
    }
    found
}

#[test]
fn no_content_gets_past_its_proxy() {
    let times = std::env::var("PLAINSIGHT_ATTACKS").ok();
    let times: u32 = times.map_or(1, |text| text.parse().expect("a number of times"));
    let mut stream = Stream::new(7, "attacks on proxies");
    let (mut all, mut asked) = (Found::NOTHING, 0_u64);
    for number in 0..ATTACKS * times {
        let mut case = Case::random(&mut stream);
        let mut best = attack(&case);
        for step in 0..=STEPS {
            let other = if step == 0 { case.clone() } else { case.changed(&mut stream) };
            let found = attack(&other);
            assert_eq!(
                found.missed,
                [0; 3],
                "attack {number}, step {step}: {} samples, reached {}: {:?} {:?} {:?} {:?}..{:?} {:?}",
                found.samples,
                found.reached,
                other.viewport,
                other.camera,
                other.world_from_object(),
                other.low,
                other.high,
                other.contents()
            );
            asked += u64::from(found.samples > 0);
            all.samples += found.samples;
            (0..3).for_each(|kind| all.bare[kind] += found.bare[kind]);
            all.outside += found.outside;
            all.reached = all.reached.max(found.reached);
            let nearer = found.samples > 0 && found.reached >= best.reached;
            if nearer || best.samples == 0 {
                (case, best) = (other, found);
            }
        }
    }
    // Teeth: without margins each kind would have missed samples, and margins were reached into.
    assert!(asked > u64::from(ATTACKS) && all.samples > 10_000, "{asked} {all:?}");
    assert!(all.bare.iter().all(|&missed| missed > 10), "{all:?}");
    assert!(all.outside > 10 && all.reached > 0.01 && all.reached < 1.0, "{all:?}");
    #[allow(clippy::print_stderr)] // what a long run by hand is for
    if times > 1 {
        eprintln!("{asked} boxes asked about, {all:?}");
    }
}
