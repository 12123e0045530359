//! Attacks on the three proxies: a search for a box whose contents show at a sample that its proxy
//! misses, at distances down to the last bits.
//!
//! Each start draws a camera, a placement and a box at random, of the kinds that strain f32: far from
//! the origin of their space, beside the near plane, flat, grazing, smaller than a pixel, larger than the
//! screen. The contents are triangles between corners of the box, so that they reach as far and as near
//! as anything inside can. Then the search climbs: it shifts the picture by parts of a sub-pixel and
//! moves the box by ulps, and keeps what brings a covered sample farther outside the box's exact
//! projection, or a depth farther before its exact nearest one. Every step is put to every proxy.
//!
//! It runs on the reference and on a device with 4 sub-pixel bits, the fewest that Vulkan allows, whose
//! contents and proxies are both snapped to 1/16 pixel. That the search has teeth is shown by taking
//! margins away: it then finds what they are there for.

use glam::{DMat4, DVec3, DVec4};
use plainsight::math::{
    Aabb, ClipBox, ClipError, Margins, Outline, Projection, RECTANGLE_DILATION_PIXELS,
    inflated_box_with, rounded_clip_matrix,
};
use plainsight::oracle::Proxy;
use plainsight::scene::{Camera, DepthOrder, Lens, Stream, Viewport};
use plainsight_reference::{Draw, Faces, Image, naive};

const VIEWPORT: Viewport = Viewport { width: 24, height: 18 };
/// Steps of a climb.
const STEPS: u32 = 48;
/// Starts of the search that runs with every test, and at most to find what a lacking margin misses.
const STARTS: u32 = 400;
const STARTS_WITH_TEETH: u32 = 4_000;
/// How many starts the search by hand makes.
const BY_HAND: &str = "PLAINSIGHT_ATTACKS";
const IDENTITY: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
/// Faces of a box by corner, two triangles each.
const BOX: [[u32; 3]; 12] = [
    [0, 1, 3],
    [0, 3, 2],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 3, 7],
    [2, 7, 6],
    [0, 2, 6],
    [0, 6, 4],
    [1, 3, 7],
    [1, 7, 5],
];

#[derive(Clone, Copy, Debug, PartialEq)]
enum Kind {
    Rectangle,
    Hull,
    Box,
    /// The rectangle of a node above: of the box in the world, with the bound that was handed up.
    Node,
    /// The node's hull.
    NodeHull,
    /// The rectangle of a part's own box, which is smaller than its mesh's, with the mesh's bound.
    Part,
}

const KINDS: [Kind; 6] =
    [Kind::Rectangle, Kind::Hull, Kind::Box, Kind::Node, Kind::NodeHull, Kind::Part];

/// What the proxies are made with: the margins, and the share of the transform bound.
#[derive(Clone, Copy, Debug)]
struct Proof {
    margins: Margins,
    transform: f64,
}

const PROVEN: Proof = Proof { margins: Margins::PROVEN, transform: 1.0 };

/// A box under its matrices, and triangles between its corners.
#[derive(Clone, Debug)]
struct Case {
    order: DepthOrder,
    clip: DMat4,
    world: DMat4,
    min: [f32; 3],
    max: [f32; 3],
    triangles: Vec<[u32; 3]>,
}

/// What a climb brings farther out.
#[derive(Clone, Copy, Debug)]
enum Goal {
    /// A covered sample beyond the exact outline.
    Pixels,
    /// A depth before the exact nearest one.
    Depth,
}

/// A sample where contents show.
#[derive(Clone, Copy, Debug)]
struct Shown {
    sample: usize,
    depth: f32,
}

/// Images to draw in, cleared for each use.
struct Room {
    image: Image,
}

impl Room {
    fn new(order: DepthOrder) -> Self {
        Self { image: Image::ordered(VIEWPORT, order) }
    }

    fn draw(&mut self, positions: &[[f32; 3]], triangles: &[[u32; 3]], matrix: [f32; 16]) {
        let ranks: Vec<u32> = (0..triangles.len() as u32).collect();
        let (first_draw, clip_from_object, faces) = (0, matrix, Faces::Both);
        let ranks = &ranks;
        let draw = Draw { positions, triangles, ranks, first_draw, clip_from_object, faces };
        naive::draw(&mut self.image, &draw);
    }
}

/// A device that snaps to so many places a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Device {
    steps: f32,
}

const REFERENCE: Device = Device { steps: 256.0 };
const COARSE: Device = Device { steps: 16.0 };

impl Device {
    /// Draws triangles under a matrix; `None` where this device would have to clip.
    fn draw(
        self,
        room: &mut Room,
        positions: &[[f32; 3]],
        triangles: &[[u32; 3]],
        m: [f32; 16],
    ) -> Option<()> {
        room.image.clear();
        if self == REFERENCE {
            room.draw(positions, triangles, m);
            return Some(());
        }
        let mut snapped = Vec::with_capacity(positions.len());
        for &[x, y, z] in positions {
            let c: [f32; 4] = std::array::from_fn(|row| {
                ((m[row] * x + m[4 + row] * y) + m[8 + row] * z) + m[12 + row]
            });
            let [near, far] = room.image.order().range();
            if !(c[3] > 0.0 && (near * c[3]..=far * c[3]).contains(&c[2])) {
                return None;
            }
            let r = 1.0 / c[3];
            let (half_x, half_y) = (VIEWPORT.width as f32 * 0.5, VIEWPORT.height as f32 * 0.5);
            let place = [(c[0] * r) * half_x + half_x, (c[1] * r) * -half_y + half_y];
            if !place.iter().all(|at| at.abs() < 8192.0) {
                return None;
            }
            let [x, y] = self.placed(place);
            snapped.push([x, y, (c[2] * r).clamp(near, far)]);
        }
        room.draw(&snapped, triangles, IDENTITY);
        Some(())
    }

    /// A place in the window, snapped, as clip coordinates with w = 1.
    fn placed(self, place: [f32; 2]) -> [f32; 2] {
        let [x, y] = place.map(|at| f64::from((at * self.steps).round_ties_even() / self.steps));
        let (width, height) = (f64::from(VIEWPORT.width), f64::from(VIEWPORT.height));
        [(x * 2.0 / width - 1.0) as f32, (1.0 - y * 2.0 / height) as f32]
    }
}

impl Case {
    fn random(order: DepthOrder, stream: &mut Stream) -> Self {
        let power =
            |stream: &mut Stream, low: f64, high: f64| 10.0_f64.powf(stream.range(low, high));
        // How far out the contents are in their own space, and how large.
        let base = if stream.below(2) == 0 { 0.0 } else { power(stream, 0.0, 6.5) };
        let size = power(stream, -3.0, 2.0).max(base * 4e-7);
        let distance = size * power(stream, -0.5, 2.0);
        let mut axis = || {
            let middle = if stream.below(4) == 0 { 0.0 } else { base * stream.range(-1.0, 1.0) };
            let flat = stream.below(6) == 0;
            let long = size * if flat { 0.0 } else { stream.range(0.1, 1.0) };
            [middle, (middle - long * 0.5) as f32 as f64, (middle + long * 0.5) as f32 as f64]
        };
        let [x, y, z] = [axis(), axis(), axis()];
        let middle = DVec3::new(x[0], y[0], z[0]);
        let turn = match stream.below(4) {
            0 => DMat4::IDENTITY,
            1 => DMat4::from_rotation_y(stream.range(-1e-3, 1e-3)),
            _ => {
                DMat4::from_rotation_y(stream.range(-3.2, 3.2))
                    * DMat4::from_rotation_x(stream.range(-1.6, 1.6))
            }
        };
        let sideways = [0; 2].map(|_| stream.range(-0.4, 0.4) * distance);
        let place = DVec3::new(sideways[0], sideways[1], -distance - size * stream.unit());
        let world = DMat4::from_translation(place) * turn * DMat4::from_translation(-middle);
        let near = distance * if stream.below(2) == 0 { 0.01 } else { stream.range(0.3, 0.999) };
        let far = near * power(stream, 1.0, 6.0) + 4.0 * size;
        // Now and then all of it, eye and object, ten thousand to a million units from the world's origin.
        let eye = match stream.below(3) {
            0 => DVec3::from_array([0; 3].map(|_| {
                let far = power(stream, 4.0, 6.0);
                if stream.below(2) == 0 { far } else { -far }
            })),
            _ => DVec3::ZERO,
        };
        let world = DMat4::from_translation(eye) * world;
        let forward = DVec3::NEG_Z;
        let lens = match stream.below(4) {
            0 => Lens::Orthographic { height: 1.1 * distance },
            _ => Lens::perspective(1.0),
        };
        let clip = Camera { eye, forward, lens, near, far }.clip_from_world(VIEWPORT, order);
        let corner = |stream: &mut Stream| stream.below(8);
        let triangles = (0..1 + stream.below(3)).map(|_| [0; 3].map(|_| corner(stream))).collect();
        let [min, max] = [1, 2].map(|i| [x[i] as f32, y[i] as f32, z[i] as f32]);
        Self { order, clip, world, min, max, triangles }
    }

    /// A small step away.
    fn moved(&self, stream: &mut Stream) -> Self {
        let mut moved = self.clone();
        let power = |stream: &mut Stream, low: f64| 2.0_f64.powf(stream.range(low, 0.0));
        let sign = if stream.below(2) == 0 { 1.0 } else { -1.0 };
        match stream.below(4) {
            0 => {
                let ulps = sign * (power(stream, -8.0) * 256.0).ceil();
                let axis = stream.below(3) as usize;
                let side = if stream.below(2) == 0 { &mut moved.min } else { &mut moved.max };
                let ulp = f64::from(side[axis].abs().next_up() - side[axis].abs());
                side[axis] = (f64::from(side[axis]) + ulps * ulp) as f32;
                if moved.min[axis] > moved.max[axis] {
                    return self.clone();
                }
            }
            // The picture as a whole, by parts of a pixel: x grows by a share of w.
            _ => {
                let pixels = sign * power(stream, -16.0);
                let across = stream.below(2) == 0;
                let side = if across { VIEWPORT.width } else { VIEWPORT.height };
                let share = pixels * 2.0 / f64::from(side);
                let mut shift = DMat4::IDENTITY;
                shift.w_axis = if across {
                    DVec4::new(share, 0.0, 0.0, 1.0)
                } else {
                    DVec4::new(0.0, share, 0.0, 1.0)
                };
                moved.clip = shift * moved.clip;
            }
        }
        moved
    }

    fn corners(&self) -> [[f32; 3]; 8] {
        std::array::from_fn(|i| {
            std::array::from_fn(|axis| if i >> axis & 1 == 0 { self.min } else { self.max }[axis])
        })
    }

    fn bounds(&self) -> Aabb {
        let wide = |corner: [f32; 3]| DVec3::from_array(corner.map(f64::from));
        Aabb::new(wide(self.min), wide(self.max))
    }

    /// Clip from the box's space, and the bound on what f32 makes of it.
    fn matrices(&self) -> (DMat4, ClipError) {
        let error = ClipError::of(&self.clip, &self.world, self.bounds().max_abs());
        (self.clip * self.world, error)
    }

    /// Where the contents show on a device.
    fn shown(&self, device: Device, room: &mut Room) -> Vec<Shown> {
        let matrix = rounded_clip_matrix(&(self.clip * self.world));
        if device.draw(room, &self.corners(), &self.triangles, matrix).is_none() {
            return Vec::new();
        }
        let image = &room.image;
        let drawn = (0..image.sample_count()).filter(|&s| image.draw_index(s).is_some());
        drawn.map(|sample| Shown { sample, depth: image.depth(sample) }).collect()
    }

    /// The box that stands in, and its matrix.
    fn stand_in(&self, kind: Kind) -> (Aabb, DMat4) {
        let bounds = self.bounds();
        match kind {
            Kind::Rectangle | Kind::Hull | Kind::Box => (bounds, self.clip * self.world),
            Kind::Node | Kind::NodeHull => (bounds.transformed(&self.world), self.clip),
            Kind::Part => {
                let corners = self.corners();
                let used = self.triangles.iter().flatten().map(|&corner| &corners[corner as usize]);
                (Aabb::of_points(used), self.clip * self.world)
            }
        }
    }

    /// The proxy; `Err` says whether the box counts as visible unasked.
    fn proxy(&self, kind: Kind, proof: &Proof) -> Result<Proxy, bool> {
        let (_, error) = self.matrices();
        let error = ClipError { bound: error.bound.map(|bound| bound * proof.transform) };
        let pixels = (VIEWPORT.width, VIEWPORT.height);
        let (bounds, matrix) = self.stand_in(kind);
        let clip = ClipBox::new(&bounds, &matrix, &error, self.order);
        match clip.project_with(pixels.0, pixels.1, &proof.margins) {
            Projection::Nowhere => Err(false),
            Projection::Unbounded => Err(true),
            Projection::Within { rectangle, depth } => {
                let (min, max) = (rectangle.min, rectangle.max);
                let plain = Proxy::Rectangle { min, max, depth };
                match kind {
                    Kind::Rectangle | Kind::Node | Kind::Part => Ok(plain),
                    Kind::Hull | Kind::NodeHull => {
                        match clip.outline_with(pixels, (rectangle, depth), &proof.margins) {
                            Outline::Nowhere => Err(false),
                            Outline::Rectangle => Ok(plain),
                            Outline::Within { hull, depth } => {
                                Ok(Proxy::Hull { hull, min, max, depth })
                            }
                        }
                    }
                    Kind::Box => {
                        let grown = inflated_box_with(
                            &bounds,
                            &matrix,
                            &error,
                            (pixels, self.order),
                            &proof.margins,
                        );
                        Ok(grown.map_or(plain, |grown| Proxy::Box {
                            clip_from_box: rounded_clip_matrix(&matrix),
                            min: grown.min.to_array().map(|c| c as f32),
                            max: grown.max.to_array().map(|c| c as f32),
                        }))
                    }
                }
            }
        }
    }

    /// How far the farthest of `shown` is beyond the exact outline of the box, pixels in the max norm; less
    /// than zero inside. And how far a depth is before the exact nearest.
    fn beyond(&self, shown: &[Shown]) -> (f64, f64) {
        let (matrix, _) = self.matrices();
        let clip = self.bounds().corners().map(|corner| matrix * corner.extend(1.0));
        let (half_x, half_y) = (f64::from(VIEWPORT.width) * 0.5, f64::from(VIEWPORT.height) * 0.5);
        let places = clip.map(|c| [c.x / c.w * half_x + half_x, half_y - c.y / c.w * half_y]);
        let mut normals = vec![[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0]];
        for a in places {
            normals.extend(places.iter().filter_map(|b| {
                let (x, y) = (a[1] - b[1], b[0] - a[0]);
                let long = x.abs() + y.abs();
                (long > 1e-6).then(|| [x / long, y / long])
            }));
        }
        let dot = |n: [f64; 2], p: [f64; 2]| n[0] * p[0] + n[1] * p[1];
        let walls: Vec<([f64; 2], f64)> = normals
            .into_iter()
            .map(|n| (n, places.iter().map(|&p| dot(n, p)).fold(f64::NEG_INFINITY, f64::max)))
            .collect();
        let width = VIEWPORT.width as usize;
        let outside = |shown: &Shown| {
            let (x, y) = (shown.sample % width, shown.sample / width);
            let place = [x as f64 + 0.5, y as f64 + 0.5];
            walls.iter().map(|&(n, h)| dot(n, place) - h).fold(f64::NEG_INFINITY, f64::max)
        };
        let nearest = clip.iter().map(|c| c.z / c.w).fold(f64::INFINITY, f64::min);
        let before = |shown: &Shown| nearest - f64::from(shown.depth);
        let most =
            |of: &dyn Fn(&Shown) -> f64| shown.iter().map(of).fold(f64::NEG_INFINITY, f64::max);
        (most(&outside), most(&before))
    }
}

/// The first sample that shows and that the proxy does not cover at its depth or nearer, both drawn by
/// the device.
fn missed(
    case: &Case,
    (kind, device, proof): (Kind, Device, &Proof),
    shown: &[Shown],
    room: &mut Room,
) -> Option<Shown> {
    let proxy = match case.proxy(kind, proof) {
        Ok(proxy) => proxy,
        Err(visible) => return shown.first().filter(|_| !visible).copied(),
    };
    let corners = |proxy: &Proxy| match *proxy {
        Proxy::Hull { hull, depth, .. } => {
            let fan = (2..hull.corners().len() as u32).map(|i| [0, i - 1, i]).collect::<Vec<_>>();
            let place = |corner: &[i32; 2]| {
                let [x, y] = device.placed(corner.map(|at| at as f32 / 256.0));
                [x, y, depth]
            };
            (hull.corners().iter().map(place).collect::<Vec<_>>(), fan, None)
        }
        Proxy::Box { min, max, clip_from_box } => {
            let grown = Case { min, max, ..case.clone() };
            (grown.corners().to_vec(), BOX.to_vec(), Some(clip_from_box))
        }
        Proxy::Rectangle { .. } => (Vec::new(), Vec::new(), None),
    };
    if let Proxy::Rectangle { min, max, depth } = proxy {
        let width = VIEWPORT.width as usize;
        let outside = |shown: &&Shown| {
            let at = [(shown.sample % width) as u32, (shown.sample / width) as u32];
            let within = (0..2).all(|i| (min[i]..max[i]).contains(&at[i]));
            !within || depth > shown.depth
        };
        return shown.iter().find(outside).copied();
    }
    let (positions, triangles, matrix) = corners(&proxy);
    match matrix {
        Some(matrix) => device.draw(room, &positions, &triangles, matrix)?,
        None => {
            room.image.clear();
            room.draw(&positions, &triangles, IDENTITY);
        }
    }
    let image = &room.image;
    shown
        .iter()
        .find(|shown| {
            image.draw_index(shown.sample).is_none() || image.depth(shown.sample) > shown.depth
        })
        .copied()
}

/// Whether the question passes against an empty buffer, and against one that is near everywhere but at
/// one sample, where it holds the contents' depth.
fn passes(case: &Case, proxy: &Proxy, at: Shown, room: &mut Room) -> bool {
    room.image.clear();
    if !proxy.shows(&room.image) {
        return false;
    }
    let matrix = rounded_clip_matrix(&(case.clip * case.world));
    room.draw(&case.corners(), &case.triangles, matrix);
    let (width, height) = (VIEWPORT.width as usize, VIEWPORT.height as usize);
    let (x, y) = (at.sample % width, at.sample / width);
    // Left, right, above and below of the sample.
    for [x0, y0, x1, y1] in
        [[0, 0, x, height], [x + 1, 0, width, height], [x, 0, x + 1, y], [x, y + 1, x + 1, height]]
    {
        let corner = |x: usize, y: usize| {
            let [x, y] = REFERENCE.placed([x as f32, y as f32]);
            [x, y, case.order.range()[0]]
        };
        let quad = [corner(x0, y0), corner(x1, y0), corner(x1, y1), corner(x0, y1)];
        room.draw(&quad, &[[0, 1, 2], [0, 2, 3]], IDENTITY);
    }
    assert_eq!(room.image.depth(at.sample), at.depth, "the sample holds the contents");
    proxy.shows(&room.image)
}

/// What a search went through.
#[derive(Debug, Default)]
struct Tally {
    cases: u64,
    samples: u64,
    /// Proxies asked about that are no rectangles: hulls and boxes.
    hulls: u64,
    boxes: u64,
    /// The farthest that a sample was beyond the exact outline, pixels: reference, coarse device.
    pixels: [f64; 2],
    /// The farthest that a depth was before the nearest.
    depth: f64,
}

/// Climbs from `starts` random starts; `visit` sees each step on each device and says whether to go on.
fn search(
    (name, order): (&str, DepthOrder),
    starts: u32,
    devices: &[Device],
    mut visit: impl FnMut(&Case, Device, &[Shown], &mut Room) -> bool,
) {
    let mut room = Room::new(order);
    let mut stream = Stream::new(11, name);
    for start in 0..starts {
        let goal = if start % 3 == 2 { Goal::Depth } else { Goal::Pixels };
        let device = devices[start as usize % devices.len()];
        let mut best: Option<(f64, Case)> = None;
        for _ in 0..STEPS {
            let case = match &best {
                Some((_, best)) => best.moved(&mut stream),
                None => Case::random(order, &mut stream),
            };
            let shown = case.shown(device, &mut room);
            if shown.is_empty() {
                continue;
            }
            if !visit(&case, device, &shown, &mut room) {
                return;
            }
            let (pixels, depth) = case.beyond(&shown);
            let score = match goal {
                Goal::Pixels => pixels,
                Goal::Depth => depth,
            };
            if best.as_ref().is_none_or(|(most, _)| score >= *most) {
                best = Some((score, case));
            }
        }
    }
}

/// Puts every proxy to the search; panics with the case where one misses a sample.
fn attack(name: &str, order: DepthOrder, starts: u32) -> Tally {
    let mut tally = Tally { pixels: [f64::NEG_INFINITY; 2], ..Tally::default() };
    search((name, order), starts, &[REFERENCE, COARSE], |case, device, shown, room| {
        tally.cases += 1;
        tally.samples += shown.len() as u64;
        for kind in KINDS {
            let miss = missed(case, (kind, device, &PROVEN), shown, room);
            assert!(miss.is_none(), "{kind:?} misses {miss:?} on {device:?}: {case:?}");
            if let Ok(proxy) = case.proxy(kind, &PROVEN) {
                tally.hulls += u64::from(matches!(proxy, Proxy::Hull { .. }));
                tally.boxes += u64::from(matches!(proxy, Proxy::Box { .. }));
                let at = shown[tally.cases as usize % shown.len()];
                let asked = device == REFERENCE && tally.cases.is_multiple_of(4);
                assert!(
                    !asked || passes(case, &proxy, at, room),
                    "{kind:?} hides {at:?}: {case:?}"
                );
            }
        }
        let (pixels, depth) = case.beyond(shown);
        let place = usize::from(device == COARSE);
        if case.proxy(Kind::Rectangle, &PROVEN).is_ok() {
            tally.pixels[place] = tally.pixels[place].max(pixels);
            tally.depth = tally.depth.max(depth);
        }
        true
    });
    tally
}

#[test]
fn nothing_shows_that_a_proxy_misses() {
    attacked(DepthOrder::Forward);
}

#[test]
fn nothing_shows_that_a_proxy_misses_with_reversed_depth() {
    attacked(DepthOrder::Reversed);
}

fn attacked(order: DepthOrder) {
    let tally = attack("proxies", order, STARTS);
    assert!(tally.samples > 100_000 && tally.cases > 5_000, "{tally:?} proves little");
    assert!(
        tally.hulls > 3_000 && tally.boxes > 1_000,
        "{tally:?} proves little of hulls and boxes"
    );
    // The search does reach samples outside the exact outline, and depths before the nearest.
    assert!(tally.pixels[0] > 0.1 && tally.pixels[1] > 1.0 / 64.0, "{tally:?}");
    assert!(tally.depth > 0.0, "{tally:?}");
}

/// By hand: `PLAINSIGHT_ATTACKS=100000 cargo test --release --test it proxies -- --ignored --nocapture`.
#[test]
#[ignore = "a long search, by hand"]
fn nothing_shows_that_a_proxy_misses_in_a_long_search() {
    let starts = std::env::var(BY_HAND).ok().and_then(|text| text.parse().ok()).unwrap_or(20_000);
    for order in [DepthOrder::Forward, DepthOrder::Reversed] {
        let tally = attack("proxies by hand", order, starts);
        let talk = format!("{order:?}, {starts} starts: {tally:?}\n");
        std::io::Write::write_all(&mut std::io::stderr(), talk.as_bytes()).unwrap();
    }
}

/// The case in which a proxy with less than the proven margins misses a sample, if the search finds one.
fn falls(order: DepthOrder, kind: Kind, device: Device, proof: &Proof) -> Option<Case> {
    let mut found = None;
    search(("teeth", order), STARTS_WITH_TEETH, &[device], |case, device, shown, room| {
        if missed(case, (kind, device, proof), shown, room).is_some() {
            found = Some(case.clone());
        }
        found.is_none()
    });
    found
}

#[test]
fn the_search_finds_what_each_margin_is_for() {
    let with = |change: &dyn Fn(&mut Proof)| {
        let mut proof = PROVEN;
        change(&mut proof);
        proof
    };
    // A vertex snaps by half a sub-pixel: 1/512 pixel on the reference, 1/32 on the coarse device.
    let most_of = |snap: f64| move |p: &mut Proof| p.margins.rectangle_pixels = snap * 7.0 / 8.0;
    let no_hull = |p: &mut Proof| p.margins.hull_pixels = 0.0;
    let no_transform = |p: &mut Proof| p.transform = 0.0;
    let no_depth = |p: &mut Proof| {
        p.transform = 0.0;
        (p.margins.depth, p.margins.flat_depth) = (0.0, 0.0);
    };
    let bare_box = |p: &mut Proof| {
        p.transform = 0.0;
        (p.margins.box_pixels, p.margins.box_depth) = (0.0, 0.0);
    };
    let teeth: [(&str, Kind, Device, Proof); 11] = [
        ("7/8 of a snap", Kind::Rectangle, REFERENCE, with(&most_of(1.0 / 512.0))),
        ("7/8 of a coarse snap", Kind::Rectangle, COARSE, with(&most_of(1.0 / 32.0))),
        ("no transform bound", Kind::Rectangle, REFERENCE, with(&no_transform)),
        ("no depth", Kind::Rectangle, REFERENCE, with(&no_depth)),
        ("no dilation", Kind::Hull, COARSE, with(&no_hull)),
        ("no transform bound", Kind::Hull, REFERENCE, with(&no_transform)),
        ("no depth", Kind::Hull, REFERENCE, with(&no_depth)),
        ("no transform bound", Kind::Node, REFERENCE, with(&no_transform)),
        ("no transform bound", Kind::Part, REFERENCE, with(&no_transform)),
        ("nothing", Kind::Box, REFERENCE, with(&bare_box)),
        ("no transform bound", Kind::Box, REFERENCE, with(&no_transform)),
    ];
    for (lacks, kind, device, proof) in teeth {
        let found = falls(DepthOrder::Forward, kind, device, &proof);
        assert!(found.is_some(), "{kind:?} with {lacks} on {device:?} stood");
        // A margin of depth is another where depth is reversed.
        if lacks == "no depth" || kind == Kind::Box {
            let found = falls(DepthOrder::Reversed, kind, device, &proof);
            assert!(found.is_some(), "reversed, {kind:?} with {lacks} on {device:?} stood");
        }
    }
    // At the bound nothing is found: the transform bound takes what f32 does besides.
    let at = |snap: f64| with(&move |p: &mut Proof| p.margins.rectangle_pixels = snap);
    for (device, snap) in [(REFERENCE, 1.0 / 512.0), (COARSE, 1.0 / 32.0)] {
        assert!(snap < RECTANGLE_DILATION_PIXELS);
        let mut found = None;
        search(
            ("at the bound", DepthOrder::Forward),
            STARTS / 4,
            &[device],
            |case, device, shown, room| {
                let miss = missed(case, (Kind::Rectangle, device, &at(snap)), shown, room);
                found = found.or(miss);
                found.is_none()
            },
        );
        assert!(found.is_none(), "{found:?}");
    }
}
