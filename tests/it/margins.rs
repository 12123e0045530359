//! The margins of the projection: what they must cover is covered, and at, under and over each bound
//! the answer is the one derived.

use glam::{DMat4, DVec3, DVec4};
use plainsight::math::{
    Aabb, CLIP_ERROR_GAMMA, ClipBox, ClipError, DEPTH_ROUNDING, FLAT_DEPTH_STEP, FrustumPlane,
    HULL_DILATION_PIXELS, Hull, MOST_HULL_CORNERS, Margins, Outline, Projection,
    RECTANGLE_DILATION_PIXELS, inflated_box, rounded_clip_matrix,
};
use plainsight::scene::{Camera, DepthOrder, Lens, Stream, Viewport};
use plainsight_reference::{Draw, Faces, Image, naive};

const VIEWPORT: Viewport = Viewport { width: 201, height: 133 };

const ORDERS: [DepthOrder; 2] = [DepthOrder::Forward, DepthOrder::Reversed];

fn camera(near: f64, far: f64, order: DepthOrder) -> DMat4 {
    let (eye, forward) = (DVec3::ZERO, DVec3::NEG_Z);
    let camera = Camera { eye, forward, lens: Lens::perspective(1.0), near, far };
    camera.clip_from_world(VIEWPORT, order)
}

/// Clip coordinates (x, y, z, w) = (x, y, z, 1): boxes can be put where a test wants them.
fn plain(min: [f64; 3], max: [f64; 3]) -> ClipBox {
    let aabb = Aabb::new(DVec3::from_array(min), DVec3::from_array(max));
    ClipBox::new(&aabb, &DMat4::IDENTITY, &ClipError::ZERO, DepthOrder::Forward)
}

#[test]
fn the_frustum_is_closed_up_to_the_error() {
    let at = |x: f64| plain([x, 0.0, 0.5], [x + 0.1, 0.1, 0.6]).outside_frustum();
    assert!(at(1.0 + 1e-12) && !at(1.0) && !at(1.0 - 1e-12));
    let mut error = ClipError::ZERO;
    error.bound = [1e-6, 0.0, 0.0, 1e-6];
    let with = |x: f64| {
        let aabb = Aabb::new(DVec3::new(x, 0.0, 0.5), DVec3::new(x + 0.1, 0.1, 0.6));
        ClipBox::new(&aabb, &DMat4::IDENTITY, &error, DepthOrder::Forward).outside_frustum()
    };
    assert!(with(1.0 + 2.1e-6) && !with(1.0 + 1.9e-6));
    let nan = plain([f64::NAN; 3], [f64::NAN; 3]);
    assert!(!nan.outside_frustum(), "NaN is not outside");
    assert_eq!(nan.project(10, 10), Projection::Unbounded, "what cannot be projected is visible");
}

#[test]
fn the_near_plane_makes_visible() {
    let nearest = |z: f64| plain([0.0, 0.0, z], [0.1, 0.1, 0.5]).project(100, 100);
    assert_eq!(nearest(0.0), Projection::Unbounded);
    assert_eq!(nearest(-1e-9), Projection::Unbounded);
    assert!(matches!(nearest(1e-3), Projection::Within { .. }));
}

/// Reversed: from −1 at the near plane to 0, a margin that is a share of the depth, and the same planes.
#[test]
fn reversed_depth_has_its_planes_and_margins() {
    let error = ClipError { bound: [0.0, 0.0, 1e-6, 2e-6] };
    let boxed = |near: f64, far: f64, error: &ClipError| {
        let aabb = Aabb::new(DVec3::new(0.005, 0.005, near), DVec3::new(0.495, 0.495, far));
        ClipBox::new(&aabb, &DMat4::IDENTITY, error, DepthOrder::Reversed)
    };
    let beyond = |near: f64, far: f64| boxed(near, far, &error).beyond();
    assert_eq!(beyond(-1.2, -1.0 - 3.1e-6), Some(FrustumPlane::Near), "over both errors");
    assert_eq!(beyond(-1.2, -1.0 - 2.9e-6), None, "under them");
    assert_eq!(beyond(1.1e-6, 0.2), Some(FrustumPlane::Far), "w takes no part");
    assert_eq!(beyond(0.9e-6, 0.2), None);
    let project = |near: f64| boxed(near, -1e-9, &ClipError::ZERO).project(100, 100);
    assert_eq!(project(-1.0), Projection::Unbounded, "on the near plane");
    for nearest in [-1.0 + 1e-3, -0.5, -1e-4, -1e-8] {
        let Projection::Within { depth, .. } = project(nearest) else { panic!("{nearest}") };
        let margin = nearest - f64::from(depth);
        assert!(margin >= DEPTH_ROUNDING * -nearest, "{nearest}: {depth}");
        assert!(margin < 2.0 * DEPTH_ROUNDING * -nearest, "{nearest}: {depth}");
    }
    let outside = boxed(-0.5, -0.1, &ClipError::ZERO);
    assert!(outside.inside_frustum() && !boxed(-0.5, 0.1, &ClipError::ZERO).inside_frustum());
}

/// Both orders see the same frustum, and reversed depth is forward depth less one, up to f64's rounding.
#[test]
fn a_camera_has_one_frustum_in_both_orders() {
    for (near, far) in [(0.1, 100.0), (0.5, 2.0), (0.1, f64::INFINITY)] {
        for lens in [
            Lens::Perspective { fov_y: 1.0, shift: [0.3, -0.2] },
            Lens::Orthographic { height: 3.0 },
        ] {
            if !far.is_finite() && matches!(lens, Lens::Orthographic { .. }) {
                continue;
            }
            let camera = Camera { eye: DVec3::ONE, forward: DVec3::NEG_Z, lens, near, far };
            let [a, b] = ORDERS.map(|order| camera.clip_from_world(VIEWPORT, order));
            let at = |distance: f64| DVec4::new(1.2, 0.9, 1.0 - distance, 1.0);
            for distance in [near, 2.0 * near, far.min(1e6)] {
                let (a, b) = (a * at(distance), b * at(distance));
                assert_eq!((a.x, a.y, a.w), (b.x, b.y, b.w));
                assert!((a.z - a.w - b.z).abs() <= 1e-12 * a.w, "{distance}: {a} {b}");
            }
            let [first, last] = [near, far.min(1e300)].map(|d| b * at(d));
            assert!((first.z / first.w + 1.0).abs() < 1e-12, "{first}");
            assert!((last.z / last.w).abs() < 1e-12, "{last}");
        }
    }
}

#[test]
fn rectangle_and_depth_are_rounded_outward_by_their_margins() {
    let within =
        |x0: f64, x1: f64| match plain([x0, 0.005, 0.5], [x1, 0.495, 0.6]).project(100, 100) {
            Projection::Within { rectangle, depth } => (rectangle, depth),
            other => panic!("{other:?}"),
        };
    // Columns 50.25 to 74.75 and rows 25.25 to 49.75 of 100: the middles 50.5 to 74.5 and 25.5 to 49.5.
    let (rectangle, depth) = within(0.005, 0.495);
    assert_eq!((rectangle.min, rectangle.max), ([50, 25], [75, 50]));
    assert!(f64::from(depth) <= 0.5 - DEPTH_ROUNDING);
    assert!(f64::from(depth.next_up()) > 0.5 - 2.0 * DEPTH_ROUNDING);
    // A middle as far outside as the dilation is taken, for the corner's own rounding is added; one a
    // little farther is not.
    let columns = |low: f64, high: f64| {
        let (rectangle, _) = within(low / 50.0 - 1.0, high / 50.0 - 1.0);
        (rectangle.min[0], rectangle.max[0])
    };
    let (first, last) = (50.5 + RECTANGLE_DILATION_PIXELS, 74.5 - RECTANGLE_DILATION_PIXELS);
    assert_eq!(columns(first, last), (50, 75), "at the bound");
    assert_eq!(columns(first - 1e-9, last + 1e-9), (50, 75), "under it");
    assert_eq!(columns(first + 1e-9, last - 1e-9), (51, 74), "over it");
}

/// Points between two samples are on neither; a box that no sample's place touches is nowhere.
#[test]
fn a_box_between_samples_is_nowhere() {
    let between = |side: f64| {
        let (low, high) = ((50.0 - side) / 50.0 - 1.0, (50.0 + side) / 50.0 - 1.0);
        plain([low, low, 0.5], [high, high, 0.6]).project(100, 100)
    };
    let bound = 0.5 - RECTANGLE_DILATION_PIXELS;
    assert_eq!(between(bound - 1e-9), Projection::Nowhere);
    assert!(matches!(between(bound), Projection::Within { .. }));
}

/// An attack on the dilation: triangles whose edges pass sample places at distances down to a small
/// share of a sub-pixel, in boxes as tight as can be.
#[test]
fn edges_beside_sample_places_stay_inside() {
    let mut stream = Stream::new(5, "edges beside samples");
    let (side, mut touched) = (64_u32, 0);
    for round in 0..8_000 {
        let mut corner = |_| {
            // A sample's place, and up to two sub-pixels away from it in steps of 1/32 sub-pixel.
            let off = (f64::from(stream.below(129)) - 64.0) / (256.0 * 32.0);
            (f64::from(stream.below(side)) + 0.5 + off) / f64::from(side) * 2.0 - 1.0
        };
        let positions: [[f32; 3]; 3] = [0; 3].map(|i| [corner(i) as f32, corner(i) as f32, 0.5]);
        let bounds = Aabb::of_points(&positions);
        let error = ClipError::of(&DMat4::IDENTITY, &DMat4::IDENTITY, bounds.max_abs());
        let viewport = Viewport { width: side, height: side };
        let mut image = Image::new(viewport);
        let draw = Draw {
            positions: &positions,
            triangles: &[[0, 1, 2]],
            ranks: &[0],
            first_draw: 0,
            clip_from_object: rounded_clip_matrix(&DMat4::IDENTITY),
            faces: Faces::Both,
        };
        naive::draw(&mut image, &draw);
        let seen = ClipBox::new(&bounds, &DMat4::IDENTITY, &error, DepthOrder::Forward)
            .project(side, side);
        for sample in (0..image.sample_count()).filter(|&s| image.draw_index(s).is_some()) {
            let at = [sample as u32 % side, sample as u32 / side];
            let Projection::Within { rectangle: r, .. } = seen else { panic!("round {round}") };
            assert!((0..2).all(|i| (r.min[i]..r.max[i]).contains(&at[i])), "round {round}: {at:?}");
            let edge = |i: usize| at[i] == r.min[i] || at[i] + 1 == r.max[i];
            touched += u32::from(edge(0) || edge(1));
        }
    }
    assert!(touched > 10_000, "{touched} samples at the rectangle's edge prove little");
}

#[test]
fn the_clip_error_bounds_what_f32_does() {
    let mut stream = Stream::new(9, "clip error");
    let mut worst = 0.0_f64;
    for _ in 0..20_000 {
        let far_out = libm_pow10(stream.range(-2.0, 6.0));
        let place = DVec3::new(stream.range(-1.0, 1.0), stream.range(-1.0, 1.0), -3.0) * far_out;
        let world = DMat4::from_translation(place)
            * DMat4::from_scale(DVec3::splat(stream.range(0.1, 9.0)));
        let order = ORDERS[stream.below(2) as usize];
        let clip = camera(0.1 * far_out, 100.0 * far_out, order);
        let reach = DVec3::splat(stream.range(0.0, 2.0));
        let p = [reach.x as f32, -reach.y as f32, reach.z as f32];
        let exact = clip * world * DVec3::from_array(p.map(f64::from)).extend(1.0);
        let m = rounded_clip_matrix(&(clip * world));
        let error = ClipError::of(&clip, &world, DVec3::from_array(p.map(f64::from)).abs());
        for row in 0..4 {
            let f32s = ((m[row] * p[0] + m[4 + row] * p[1]) + m[8 + row] * p[2]) + m[12 + row];
            let off = (f64::from(f32s) - exact[row]).abs();
            assert!(off <= error.bound[row], "row {row}: {off} beyond {}", error.bound[row]);
            worst = worst.max(off / error.bound[row]);
        }
    }
    // The bound is no wild exaggeration: of its 23 roundings, five are those of the transform.
    assert!(worst > 0.03, "the bound is {worst} used: too wide to mean anything");
    assert!(CLIP_ERROR_GAMMA < 24.0 * f64::from(f32::EPSILON) / 2.0);
}

fn libm_pow10(exponent: f64) -> f64 {
    10.0_f64.powf(exponent)
}

/// Triangles inside a box never show outside its rectangle, nor nearer than its depth, nor where the
/// inflated box has no sample at that depth or before.
#[test]
fn proxies_cover_their_contents() {
    let mut stream = Stream::new(4, "contents");
    let (mut samples, mut boxes) = (0, 0);
    for round in 0..600 {
        let far_out = libm_pow10(stream.range(-1.0, 5.0));
        let place =
            DVec3::new(stream.range(-1.0, 1.0), stream.range(-1.0, 1.0), stream.range(-9.0, -2.0));
        let world = DMat4::from_translation(place * far_out)
            * DMat4::from_rotation_y(stream.range(-3.0, 3.0))
            * DMat4::from_scale(DVec3::splat(far_out * stream.range(0.01, 1.0)));
        let order = ORDERS[round % 2];
        let clip = camera(0.01 * far_out, 100.0 * far_out, order);
        let point = |stream: &mut Stream| {
            [0; 3].map(|_| {
                // On a face of the box every other time.
                let free = stream.range(-1.0, 1.0);
                (if stream.below(2) == 0 { free } else { free.signum() }) as f32
            })
        };
        let positions: Vec<[f32; 3]> = (0..12).map(|_| point(&mut stream)).collect();
        let triangles: Vec<[u32; 3]> = (0..4).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        let bounds = Aabb::of_points(&positions);
        let error = ClipError::of(&clip, &world, bounds.max_abs());
        let seen = ClipBox::new(&bounds, &(clip * world), &error, order);
        let mut image = Image::ordered(VIEWPORT, order);
        let clip_from_object = rounded_clip_matrix(&(clip * world));
        let draw = Draw {
            positions: &positions,
            triangles: &triangles,
            ranks: &[0, 1, 2, 3],
            first_draw: 0,
            clip_from_object,
            faces: Faces::Both,
        };
        naive::draw(&mut image, &draw);
        let shown: Vec<usize> =
            (0..image.sample_count()).filter(|&s| image.draw_index(s).is_some()).collect();
        match seen.project(VIEWPORT.width, VIEWPORT.height) {
            Projection::Nowhere => assert!(shown.is_empty(), "round {round}"),
            Projection::Unbounded => {}
            Projection::Within { rectangle, depth } => {
                for &sample in &shown {
                    let (x, y) = (sample as u32 % VIEWPORT.width, sample as u32 / VIEWPORT.width);
                    assert!((rectangle.min[0]..rectangle.max[0]).contains(&x), "round {round}");
                    assert!((rectangle.min[1]..rectangle.max[1]).contains(&y), "round {round}");
                    assert!(image.depth(sample) >= depth, "round {round}");
                }
                samples += shown.len();
            }
        }
        let pixels = (VIEWPORT.width, VIEWPORT.height);
        if let Some(grown) = inflated_box(&bounds, &(clip * world), &error, pixels, order) {
            boxes += 1;
            let mut proxy = Image::ordered(VIEWPORT, order);
            draw_box(&mut proxy, &grown, clip_from_object);
            for &sample in &shown {
                assert!(
                    proxy.depth(sample) <= image.depth(sample),
                    "round {round} sample {sample}"
                );
            }
        }
    }
    assert!(samples > 10_000 && boxes > 300, "{samples} samples, {boxes} boxes prove little");
}

fn draw_box(image: &mut Image, aabb: &Aabb, clip_from_object: [f32; 16]) {
    let positions = aabb.corners().map(|c| c.as_vec3().to_array());
    let faces =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles: Vec<[u32; 3]> =
        faces.iter().flat_map(|&[a, b, c, d]: &[u32; 4]| [[a, b, c], [a, c, d]]).collect();
    let ranks: Vec<u32> = (0..12).collect();
    let draw = Draw {
        positions: &positions,
        triangles: &triangles,
        ranks: &ranks,
        first_draw: 0,
        clip_from_object,
        faces: Faces::Both,
    };
    naive::draw(image, &draw);
}

#[test]
fn a_matrix_without_inverse_gives_no_box() {
    let flat = DMat4::from_cols(DVec4::X, DVec4::Y, DVec4::ZERO, DVec4::new(0.0, 0.0, 0.5, 1.0));
    let aabb = Aabb::new(DVec3::ZERO, DVec3::ONE);
    assert_eq!(inflated_box(&aabb, &flat, &ClipError::ZERO, (10, 10), DepthOrder::Forward), None);
}

/// The outline of a box in a viewport, with the rectangle and its depth; `None` where there is none.
fn outline(clip: &ClipBox, side: u32, margins: &Margins) -> Option<(Outline, f32)> {
    match clip.project(side, side) {
        Projection::Within { rectangle, depth } => {
            Some((clip.outline_with((side, side), (rectangle, depth), margins), depth))
        }
        _ => None,
    }
}

/// Whether a place, in sub-pixels, is within a hull or on its edge.
fn holds(hull: &Hull, [x, y]: [i64; 2]) -> bool {
    let corners = hull.corners();
    let next = corners.iter().cycle().skip(1);
    corners.iter().zip(next).all(|(a, b)| {
        let [ax, ay, bx, by] = [a[0], a[1], b[0], b[1]].map(i64::from);
        (bx - ax) * (y - ay) - (by - ay) * (x - ax) >= 0
    })
}

/// A square that stands on its corner, 20 pixels from the middle (50, 50) of 100 × 100 pixels to each.
fn diamond() -> ClipBox {
    let half = 0.4 / 2.0_f64.sqrt();
    let aabb = Aabb::new(DVec3::new(-half, -half, 0.5), DVec3::new(half, half, 0.6));
    let turned = DMat4::from_rotation_z(std::f64::consts::FRAC_PI_4);
    ClipBox::new(&aabb, &turned, &ClipError::ZERO, DepthOrder::Forward)
}

/// Beside a slanted side the hull holds what is as far from the box as its dilation, and not what is a
/// little farther than the grid's rounding.
#[test]
fn a_hull_is_dilated_by_its_margin() {
    let pixels = |margin: f64| Margins { hull_pixels: margin, ..Margins::PROVEN };
    let at = |margin: f64, beyond: i64| {
        let Some((Outline::Within { hull, .. }, _)) = outline(&diamond(), 100, &pixels(margin))
        else {
            panic!("a hull")
        };
        // The middle of a slanted side is (60, 60); as far on both axes is as far in the max norm.
        holds(&hull, [60 * 256 + beyond; 2])
    };
    let dilation = (HULL_DILATION_PIXELS * 256.0) as i64;
    assert!(at(HULL_DILATION_PIXELS, dilation), "at the bound");
    assert!(at(HULL_DILATION_PIXELS, dilation - 1), "under it");
    assert!(!at(HULL_DILATION_PIXELS, dilation + 3), "over it");
    assert!(!at(HULL_DILATION_PIXELS - 4.0 / 256.0, dilation), "with a margin under it");
    assert!(at(HULL_DILATION_PIXELS + 4.0 / 256.0, dilation + 3), "with one over it");
}

#[test]
fn the_depth_of_a_hull_stands_before_the_rectangles() {
    let Some((Outline::Within { depth, .. }, plain)) = outline(&diamond(), 100, &Margins::PROVEN)
    else {
        panic!("a hull")
    };
    let step = f64::from(plain) - f64::from(depth);
    assert!(step >= FLAT_DEPTH_STEP && step < FLAT_DEPTH_STEP + f64::from(f32::EPSILON), "{step}");
}

/// A box that stands upright fills its rectangle; one whose corner is beyond the grid has no hull.
#[test]
fn the_rectangle_stands_in_for_a_hull() {
    let upright = plain([-0.37, -0.37, 0.5], [0.41, 0.41, 0.6]);
    assert_eq!(outline(&upright, 100, &Margins::PROVEN).unwrap().0, Outline::Rectangle);
    let reach = |pixels: f64| {
        let slanted = DMat4::from_cols(
            DVec4::new(pixels / 50.0, pixels / 50.0, 0.0, 0.0),
            DVec4::new(0.0, 0.01, 0.0, 0.0),
            DVec4::new(0.0, 0.0, 1.0, 0.0),
            DVec4::new(0.0, 0.0, 0.0, 1.0),
        );
        let aabb = Aabb::new(DVec3::new(-1.0, -1.0, 0.5), DVec3::new(1.0, 1.0, 0.6));
        let clip = ClipBox::new(&aabb, &slanted, &ClipError::ZERO, DepthOrder::Forward);
        outline(&clip, 100, &Margins::PROVEN)
    };
    let grid = f64::from(1 << 20);
    assert!(matches!(reach(grid - 60.0), Some((Outline::Within { .. }, _))), "under it");
    assert!(matches!(reach(grid), Some((Outline::Rectangle, _))), "over it");
}

/// A box whose rectangle reaches the screen although its outline passes beside the corner.
#[test]
fn an_outline_beside_the_screen_is_nowhere() {
    let beside = |across: f64| {
        let slanted = DMat4::from_cols(
            DVec4::new(0.5, -0.5, 0.0, 0.0),
            DVec4::new(0.01, 0.01, 0.0, 0.0),
            DVec4::new(0.0, 0.0, 1.0, 0.0),
            DVec4::new(across, across, 0.0, 1.0),
        );
        let aabb = Aabb::new(DVec3::new(-1.0, -1.0, 0.5), DVec3::new(1.0, 1.0, 0.6));
        let clip = ClipBox::new(&aabb, &slanted, &ClipError::ZERO, DepthOrder::Forward);
        outline(&clip, 100, &Margins::PROVEN)
    };
    assert!(matches!(beside(1.2), Some((Outline::Nowhere, _))));
    assert!(matches!(beside(0.9), Some((Outline::Within { .. }, _))));
}

/// However a box is seen, its hull is convex up to the rounding of cut corners, lies within the
/// rectangle, and has no more corners than were derived.
#[test]
fn hulls_stay_within_their_rectangles() {
    let mut stream = Stream::new(6, "hulls");
    let (mut hulls, mut most) = (0, 0);
    for round in 0..20_000 {
        let entry =
            |stream: &mut Stream| stream.range(-1.0, 1.0) * libm_pow10(stream.range(-3.0, 1.0));
        let mut matrix = DMat4::from_cols_array(&[0.0; 16].map(|_| entry(&mut stream)));
        (matrix.x_axis.z, matrix.y_axis.z, matrix.z_axis.z) = (0.0, 0.0, 0.1);
        (matrix.w_axis.z, matrix.w_axis.w) = (0.5, stream.range(1.0, 40.0));
        let aabb = Aabb::new(DVec3::splat(-1.0), DVec3::ONE);
        let clip = ClipBox::new(&aabb, &matrix, &ClipError::ZERO, DepthOrder::Forward);
        let (width, height) = (1 + stream.below(300), 1 + stream.below(300));
        let Projection::Within { rectangle, depth } = clip.project(width, height) else { continue };
        let Outline::Within { hull, depth: nearer } =
            clip.outline((width, height), (rectangle, depth))
        else {
            continue;
        };
        hulls += 1;
        most = most.max(hull.corners().len());
        assert!(nearer <= depth && nearer >= 0.0, "round {round}");
        let side = |axis: usize, at: i32| {
            (rectangle.min[axis] as i32 * 256..=rectangle.max[axis] as i32 * 256).contains(&at)
        };
        let inside = hull.corners().iter().all(|c| side(0, c[0]) && side(1, c[1]));
        assert!(inside, "round {round}: {hull:?} in {rectangle:?}");
        let all: u64 = (0..2).map(|i| u64::from(rectangle.max[i] - rectangle.min[i])).product();
        assert!(hull.twice_area() < all * 2 * 65536, "round {round}");
    }
    assert!(hulls > 3_000, "{hulls} hulls prove little");
    assert!((9..=MOST_HULL_CORNERS).contains(&most), "{most} corners");
}
