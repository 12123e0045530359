//! The raster rules as properties: watertight edges, exact coverage, exact depth, order independence,
//! and counting. What the fast renderer owes the naive one is in `fast.rs`.

use plainsight_reference::{DepthOrder, Draw, Faces, Image, Viewport, fast, naive};
use proptest::prelude::*;

const IDENTITY: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
/// w = −z, z from 0 at −1 to w at −100: a camera at the origin.
const PERSPECTIVE: [f32; 16] = [
    1.2,
    0.0,
    0.0,
    0.0,
    0.0,
    1.5,
    0.0,
    0.0,
    0.0,
    0.0,
    -100.0 / 99.0,
    -1.0,
    0.0,
    0.0,
    -100.0 / 99.0,
    0.0,
];

/// The matrix for a depth order: z − w, which goes from −w to 0, where z goes from 0 to w.
fn ordered(mut m: [f32; 16], order: DepthOrder) -> [f32; 16] {
    if order == DepthOrder::Reversed {
        (0..4).for_each(|column| m[4 * column + 2] -= m[4 * column + 3]);
    }
    m
}

fn order() -> impl Strategy<Value = DepthOrder> {
    prop_oneof![Just(DepthOrder::Forward), Just(DepthOrder::Reversed)]
}

fn draw<'a>(m: [f32; 16], p: &'a [[f32; 3]], t: &'a [[u32; 3]], ranks: &'a [u32]) -> Draw<'a> {
    Draw {
        positions: p,
        triangles: t,
        ranks,
        first_draw: 0,
        clip_from_object: m,
        faces: Faces::Both,
    }
}

/// How many triangles cover each sample, drawn one by one, under the matrix made for the order.
fn layers(
    viewport: Viewport,
    order: DepthOrder,
    m: [f32; 16],
    p: &[[f32; 3]],
    t: &[[u32; 3]],
) -> Vec<u32> {
    let m = ordered(m, order);
    let mut layers = vec![0; (viewport.width * viewport.height) as usize];
    for triangle in t {
        let mut image = Image::ordered(viewport, order);
        naive::draw(&mut image, &draw(m, p, std::slice::from_ref(triangle), &[0]));
        for (sample, layer) in layers.iter_mut().enumerate() {
            *layer += u32::from(image.draw_index(sample).is_some());
        }
    }
    layers
}

/// Any small size, or one whose pixel centres lie on the grid of [`corner`], so that samples exactly
/// on edges and corners, which random numbers never meet, are common.
fn viewport() -> impl Strategy<Value = Viewport> {
    let any = (1_u32..90, 1_u32..70).prop_map(|(width, height)| Viewport { width, height });
    prop_oneof![any, Just(Viewport { width: 16, height: 16 })]
}

/// Coordinates from tiny to huge, many on a coarse grid so that ties and degenerate cases are common.
fn coordinate() -> impl Strategy<Value = f32> {
    prop_oneof![
        4 => -1.2_f32..1.2,
        3 => (-8_i8..9).prop_map(|i| f32::from(i) * 0.125),
        1 => -30.0_f32..30.0,
        1 => Just(0.0_f32),
        1 => -1e-6_f32..1e-6,
        1 => -1e20_f32..1e20,
    ]
}

fn soup(most: usize) -> impl Strategy<Value = (Vec<[f32; 3]>, Vec<[u32; 3]>)> {
    prop::collection::vec([coordinate(), coordinate(), coordinate()], 3..20).prop_flat_map(
        move |positions| {
            let n = positions.len() as u32;
            (Just(positions), prop::collection::vec([0..n, 0..n, 0..n], 1..most))
        },
    )
}

/// Sixteenths: whole and half pixels of a 16 × 16 viewport.
fn sixteenths(most: i8) -> impl Strategy<Value = f32> {
    (-most..=most).prop_map(|i| f32::from(i) / 16.0)
}

fn corner() -> impl Strategy<Value = [f32; 3]> {
    let grid = (sixteenths(18), sixteenths(18), 0.0_f32..1.0).prop_map(|(x, y, z)| [x, y, z]);
    prop_oneof![[-1.1_f32..1.1, -1.1_f32..1.1, 0.0_f32..1.0], grid]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 1000, failure_persistence: None, ..ProptestConfig::default() })]

    /// Two triangles over a quad that covers the whole screen: every sample once, also where near or
    /// the guard band cut them.
    #[test]
    fn a_shared_edge_is_watertight(
        viewport in viewport(),
        order in order(),
        reach in 1.2_f32..2000.0,
        depth in 1.5_f32..90.0,
        tilt in -0.3_f32..0.3,
        shift in [-0.05_f32..0.05, -0.05_f32..0.05],
    ) {
        let r = reach * depth;
        let [a, b, c, d] = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]: [f32; 2]| [(x + shift[0]) * r, (y + shift[1]) * r, -depth + tilt * x]);
        let covered = layers(viewport, order, PERSPECTIVE, &[a, b, c, d], &[[0, 1, 2], [0, 2, 3]]);
        prop_assert!(covered.iter().all(|&layers| layers == 1), "{covered:?}");
    }

    /// A fan round a point over the whole screen: every sample once, whatever the spokes.
    #[test]
    fn a_fan_is_watertight(
        viewport in viewport(),
        center in prop_oneof![[-0.9_f32..0.9, -0.9_f32..0.9], [sixteenths(14), sixteenths(14)]],
        mut turns in prop::collection::vec(
            prop_oneof![0.0_f32..1.0, (0_u8..64).prop_map(|i| f32::from(i) / 64.0)], 4..12),
    ) {
        turns.extend([0.0, 0.25, 0.5, 0.75]);
        turns.sort_by(f32::total_cmp);
        turns.dedup();
        // Round a square of ±2 whose corners are at quarters.
        let rim = |t: f32| {
            let along = (t * 4.0).fract() * 4.0 - 2.0;
            match (t * 4.0) as u32 {
                0 => [along, -2.0, 0.5],
                1 => [2.0, along, 0.5],
                2 => [-along, 2.0, 0.5],
                _ => [-2.0, -along, 0.5],
            }
        };
        let mut positions = vec![[center[0], center[1], 0.5]];
        positions.extend(turns.iter().map(|&t| rim(t)));
        let n = turns.len() as u32;
        let triangles: Vec<[u32; 3]> = (0..n).map(|i| [0, 1 + i, 1 + (i + 1) % n]).collect();
        let covered = layers(viewport, DepthOrder::Forward, IDENTITY, &positions, &triangles);
        prop_assert!(covered.iter().all(|&layers| layers == 1), "{covered:?}");
    }

    /// A triangle cut into fragments with shared cut points: no sample twice.
    #[test]
    fn a_cut_is_watertight(
        viewport in viewport(), a in corner(), b in corner(), c in corner(),
        at in 0.05_f32..0.95, and in 0.05_f32..0.95,
    ) {
        let mix = |a: [f32; 3], b: [f32; 3], t: f32| [0, 1, 2].map(|i| a[i] + (b[i] - a[i]) * t);
        let positions = [a, b, c, mix(a, b, at), mix(a, c, and)];
        let triangles = [[0, 3, 4], [3, 1, 2], [3, 2, 4]];
        // Snapping may turn a needle over; where all fragments keep one orientation none may overlap.
        let half = [viewport.width as f32 * 0.5, viewport.height as f32 * -0.5];
        let snapped = positions.map(|p| {
            [0, 1].map(|i| ((p[i] * half[i] + half[i].abs()) * 256.0).round_ties_even() as i64)
        });
        let area = |t: [u32; 3]| {
            let [a, b, c] = t.map(|i| snapped[i as usize]);
            (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        };
        let areas = triangles.map(area);
        prop_assume!(areas.iter().all(|&a| a >= 0) || areas.iter().all(|&a| a <= 0));
        let cut = layers(viewport, DepthOrder::Forward, IDENTITY, &positions, &triangles);
        prop_assert!(cut.iter().all(|&layers| layers <= 1), "{cut:?}");
    }

    /// Coverage and depth against rational arithmetic on the snapped vertices.
    #[test]
    fn coverage_and_depth_are_exact(
        viewport in viewport(), order in order(), p in [corner(), corner(), corner()],
    ) {
        // Not the far plane's own depth, which loses against a cleared sample; reversed, depths near
        // zero have many more bits.
        let p = p.map(|[x, y, z]| match order {
            DepthOrder::Forward => [x, y, z],
            DepthOrder::Reversed => [x, y, -(z * z).max(1e-9)],
        });
        let mut image = Image::ordered(viewport, order);
        naive::draw(&mut image, &draw(IDENTITY, &p, &[[0, 1, 2]], &[0]));
        let half = [viewport.width as f32 * 0.5, viewport.height as f32 * 0.5];
        let snap = |v: f32| i128::from((v * 256.0).round_ties_even() as i64);
        let v = p.map(|[x, y, z]| (snap(x * half[0] + half[0]), snap(y * -half[1] + half[1]), z));
        for sample in 0..image.sample_count() {
            let x = (sample as i128 % i128::from(viewport.width)) * 256 + 128;
            let y = (sample as i128 / i128::from(viewport.width)) * 256 + 128;
            match rational(v, x, y) {
                None => prop_assert_eq!(image.draw_index(sample), None, "sample {}", sample),
                Some((above, below)) => {
                    prop_assert_eq!(image.draw_index(sample), Some(0), "sample {}", sample);
                    // above / below is the exact depth times 2⁶⁰.
                    let scale = (1_u64 << 60) as f64;
                    let got = image.depth(sample);
                    let off = ((f64::from(got) * scale) as i128 * below - above).abs();
                    let ulp = (f64::from(got.next_up() - got) * scale) as i128;
                    prop_assert!(off <= (ulp + 1) * below, "sample {}: {} of {}", sample, off / below, ulp);
                }
            }
        }
    }

    /// The image is a function of what is drawn, not of the order; both renderers count alike.
    #[test]
    fn order_does_not_matter(
        viewport in viewport(), order in order(), (positions, triangles) in soup(40),
        perspective: bool, turn in 0_usize..40,
    ) {
        let m = ordered(if perspective { PERSPECTIVE } else { IDENTITY }, order);
        let ranks: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut image = Image::ordered(viewport, order);
        naive::draw(&mut image, &draw(m, &positions, &triangles, &ranks));
        let (mut turned, mut turned_ranks) = (triangles.clone(), ranks.clone());
        turned.rotate_left(turn % triangles.len());
        turned_ranks.rotate_left(turn % triangles.len());
        let mut other = Image::ordered(viewport, order);
        naive::draw(&mut other, &draw(m, &positions, &turned, &turned_ranks));
        prop_assert_eq!(image.hash(), other.hash());
        prop_assert!(image == other);
        let one = draw(m, &positions, &triangles[..1], &ranks[..1]);
        prop_assert_eq!(naive::count(&image, &one), fast::count(&image, &one));
        prop_assert_eq!(fast::any(&image, &one), fast::count(&image, &one) > 0);
        prop_assert!(image.bounds_hold());
    }
}

/// The exact depth times 2⁶⁰ as a fraction, or `None` where the sample is not covered. Written from
/// the rule's words: a sample on an edge belongs to the triangle whose inside is to the right of the
/// edge or, on a level edge, below it.
fn rational(v: [(i128, i128, f32); 3], x: i128, y: i128) -> Option<(i128, i128)> {
    type Corner = (i128, i128, f32);
    let cross =
        |a: Corner, b: Corner, x: i128, y: i128| (b.0 - a.0) * (y - a.1) - (b.1 - a.1) * (x - a.0);
    let area = cross(v[0], v[1], v[2].0, v[2].1);
    let mut e = [0; 3];
    for i in 0..3 {
        let (a, b, inner) = (v[(i + 1) % 3], v[(i + 2) % 3], v[i]);
        e[i] = cross(a, b, x, y) * area.signum();
        let rise = b.1 - a.1;
        let right = (inner.0 - a.0) * rise.abs() > (b.0 - a.0) * (inner.1 - a.1) * rise.signum();
        let owned = if rise == 0 { inner.1 > a.1 } else { right };
        if area == 0 || e[i] < 0 || (e[i] == 0 && !owned) {
            return None;
        }
    }
    let scaled = |z: f32| (f64::from(z) * (1_u64 << 60) as f64) as i128;
    Some(((0..3).map(|i| e[i] * scaled(v[i].2)).sum(), area.abs()))
}

/// Near and far at, under and over; depth exactly 1 loses against the cleared image.
#[test]
fn near_and_far_are_closed() {
    let viewport = Viewport { width: 8, height: 8 };
    for order in [DepthOrder::Forward, DepthOrder::Reversed] {
        let covered = |z: f32| {
            let mut image = Image::ordered(viewport, order);
            let p = [[-3.0, -1.0, z], [3.0, -1.0, z], [0.0, 3.0, z]];
            naive::draw(&mut image, &draw(IDENTITY, &p, &[[0, 1, 2]], &[0]));
            image.draw_indices().flatten().count()
        };
        let [near, far] = order.range();
        assert_eq!(covered(near.next_down()), 0);
        assert!(covered(near) > 0 && covered(far.next_down()) > 0);
        assert_eq!((covered(far), covered(far.next_up())), (0, 0));
    }
}

/// A reversed image is what a device with a reversed buffer stores, its sign turned: written from that
/// device's words, with depths that only floats near zero tell apart.
#[test]
fn reversed_depth_is_a_reversed_device() {
    let viewport = Viewport { width: 31, height: 17 };
    let device_depth = |i: u32| 1.0 / (1.0 + 3e7 * f64::from(i)) as f32;
    let (mut nearest, mut image) = (0.0_f32, Image::ordered(viewport, DepthOrder::Reversed));
    for i in [900, 901, 5, 899, 3, 3_000_000] {
        let z = device_depth(i);
        let p = [[-3.0, -1.0, -z], [3.0, -1.0, -z], [0.0, 3.0, -z]];
        naive::draw(&mut image, &draw(IDENTITY, &p, &[[0, 1, 2]], &[i]));
        nearest = nearest.max(z);
        let sample = 8 * 31 + 15;
        assert_eq!(DepthOrder::Reversed.on_device(image.depth(sample)), nearest);
        assert_eq!(image.draw_index(sample).map(device_depth), Some(nearest));
        assert!(image.any_rectangle([15, 8], [16, 9], -nearest));
        assert!(!image.any_rectangle([15, 8], [16, 9], (-nearest).next_up()));
    }
}

/// Rectangles over several regions, against samples looked at one by one.
#[test]
fn rectangles_count_over_regions() {
    let viewport = Viewport { width: 301, height: 270 };
    for order in [DepthOrder::Forward, DepthOrder::Reversed] {
        let [near, _] = order.range();
        let mut image = Image::ordered(viewport, order);
        for i in 0..40_u32 {
            let [a, b, c] = [7, 11, 13].map(|step| (i * step % 17) as f32 / 8.5 - 1.0);
            let z = near + 0.1 + (i * 19 % 40) as f32 / 50.0;
            let p = [[a, b, z], [a + 0.4, b, z], [a, b + 0.5 + c * 0.2, z + 0.05]];
            naive::draw(&mut image, &draw(IDENTITY, &p, &[[0, 1, 2]], &[i]));
        }
        // Fresh bounds, as after a render, and stale ones.
        for fresh in [false, true] {
            if fresh {
                fast::draw(&mut image, &[], fast::Options::default());
            }
            for i in 0..400_u32 {
                let [x, y] = [i * 37 % 301, i * 53 % 270];
                let max = [x + i * 29 % 200, y + i * 31 % 150];
                let depth = near + (i * 23 % 100) as f32 / 100.0;
                let inside = |s: &usize| {
                    let (column, row) = (*s as u32 % 301, *s as u32 / 301);
                    (x..max[0]).contains(&column) && (y..max[1]).contains(&row)
                };
                let passes = |s: &usize| inside(s) && depth <= image.depth(*s);
                let plain = (0..image.sample_count()).filter(passes).count() as u64;
                assert_eq!(image.count_rectangle([x, y], max, depth), plain);
                assert_eq!(image.any_rectangle([x, y], max, depth), plain > 0);
            }
        }
    }
}

/// Images are equal if their size, their order and all their samples are, and hash alike only then.
#[test]
fn images_differ_by_any_sample() {
    let viewport = Viewport { width: 20, height: 9 };
    let empty = Image::new(viewport);
    let with = |z: f32, rank: u32| {
        let mut image = Image::new(viewport);
        let p = [[-0.1, -0.1, z], [0.1, -0.1, z], [0.0, 0.2, z]];
        naive::draw(&mut image, &draw(IDENTITY, &p, &[[0, 1, 2]], &[rank]));
        image
    };
    let one = with(0.5, 0);
    assert!(one == with(0.5, 0) && one.hash() == with(0.5, 0).hash());
    let others = [
        empty.clone(),
        with(0.5_f32.next_up(), 0),
        with(0.5, 1),
        Image::new(Viewport { width: 9, height: 20 }),
    ];
    for other in others {
        assert!(one != other && one.hash() != other.hash());
    }
    assert!(empty != Image::ordered(viewport, DepthOrder::Reversed), "another order");
}

/// Questions: less or equal, within the rectangle only.
#[test]
fn rectangles_count_what_passes() {
    let mut image = Image::new(Viewport { width: 10, height: 6 });
    let p = [[-3.0, -3.0, 0.5], [3.0, -3.0, 0.5], [0.0, 6.0, 0.5]];
    naive::draw(&mut image, &draw(IDENTITY, &p, &[[0, 1, 2]], &[0]));
    assert_eq!(image.count_rectangle([2, 1], [5, 3], 0.5), 6);
    assert_eq!(image.count_rectangle([2, 1], [5, 3], 0.5_f32.next_up()), 0);
    assert_eq!(image.count_rectangle([8, 4], [20, 20], 0.1), 4);
    assert!(!image.any_rectangle([5, 1], [5, 3], 0.0), "an empty rectangle");
}
