//! Three-valued truth: exact at tolerance zero, monotone in the tolerance, and true of every device that
//! keeps to the tolerance.

use plainsight_reference::{
    DepthOrder, Draw, Faces, Fate, Fates, Image, Tolerance, Viewport, fates, naive,
};
use proptest::prelude::*;

const IDENTITY: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
/// z − 1: reversed depth.
const REVERSED: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0, 1.0];
const VIEWPORT: Viewport = Viewport { width: 40, height: 30 };

/// A depth order with the matrix that takes z from 0 to 1 to its depths.
fn order() -> impl Strategy<Value = (DepthOrder, [f32; 16])> {
    prop_oneof![Just((DepthOrder::Forward, IDENTITY)), Just((DepthOrder::Reversed, REVERSED))]
}

/// Parts of up to three triangles of their own, in clip space with w = 1.
type Parts = Vec<Vec<[[f32; 3]; 3]>>;

fn parts() -> impl Strategy<Value = Parts> {
    let coordinate = prop_oneof![
        4 => -1.3_f32..1.3,
        // On a grid: ties, shared edges, no area.
        3 => (-4_i8..5).prop_map(|i| f32::from(i) * 0.25),
    ];
    // Some lie before the near plane or beyond the far one.
    let depth = prop_oneof![4 => 0.0_f32..1.0, 2 => (0_i8..5).prop_map(|i| f32::from(i) * 0.25), 1 => -0.5_f32..1.5];
    let corner = (coordinate.clone(), coordinate, depth).prop_map(|(x, y, z)| [x, y, z]);
    let triangle = [corner.clone(), corner.clone(), corner];
    prop::collection::vec(prop::collection::vec(triangle, 1..4), 1..12)
}

fn tolerance() -> impl Strategy<Value = Tolerance> {
    let pixels = prop_oneof![Just(0.0), 0.0_f64..0.6];
    (pixels, 0_u32..2000, 0_u32..40_000).prop_map(|(pixels, ulps, clipped_ulps)| Tolerance {
        pixels,
        ulps,
        clipped_ulps,
    })
}

struct Flat {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    ranks: Vec<u32>,
    first: u32,
}

fn flat(parts: &Parts) -> Vec<Flat> {
    let mut first = 0;
    let each = parts.iter().map(|triangles| {
        let count = triangles.len() as u32;
        first += count;
        Flat {
            positions: triangles.iter().flatten().copied().collect(),
            triangles: (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
            ranks: (0..count).collect(),
            first: first - count,
        }
    });
    each.collect()
}

fn draws(parts: &[Flat], matrix: [f32; 16]) -> Vec<Draw<'_>> {
    let each = parts.iter().map(|part| Draw {
        positions: &part.positions,
        triangles: &part.triangles,
        ranks: &part.ranks,
        first_draw: part.first,
        clip_from_object: matrix,
        faces: Faces::Both,
    });
    each.collect()
}

/// Parts that a renderer shows, by the draw indices of its image.
fn shown(parts: &[Flat], image: &Image) -> Vec<bool> {
    let shows = |part: &Flat| {
        let mine = part.first..part.first + part.triangles.len() as u32;
        image_indices(image).any(|draw| mine.contains(&draw))
    };
    parts.iter().map(shows).collect()
}

fn image_indices(image: &Image) -> impl Iterator<Item = u32> + '_ {
    image.draw_indices().flatten()
}

fn picture(order: DepthOrder, draws: &[Draw<'_>]) -> Image {
    let mut image = Image::ordered(VIEWPORT, order);
    draws.iter().for_each(|draw| naive::draw(&mut image, draw));
    image
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    /// Must is what wins a sample without a tie, hidden what wins none and ties nowhere.
    #[test]
    fn exact_at_tolerance_zero(parts in parts(), (order, matrix) in order()) {
        let parts = flat(&parts);
        let draws = draws(&parts, matrix);
        let found = fates(VIEWPORT, order, &draws, Tolerance::EXACT);
        let alone: Vec<Image> = draws.iter().map(|draw| picture(order, std::slice::from_ref(draw))).collect();
        let all = picture(order, &draws);
        for (number, image) in alone.iter().enumerate() {
            let (mut wins, mut ties) = (false, false);
            for sample in 0..all.sample_count() {
                if image.draw_index(sample).is_none() || image.depth(sample) > all.depth(sample) {
                    continue;
                }
                let rival = |(other, rival): (usize, &Image)| {
                    other != number
                        && rival.draw_index(sample).is_some()
                        && rival.depth(sample) == image.depth(sample)
                };
                let tied = alone.iter().enumerate().any(rival);
                wins |= !tied;
                ties |= tied;
                prop_assert_eq!(found.decided[sample] == Some(number as u32), !tied);
            }
            let expected = match (wins, ties) {
                (true, _) => Fate::Must,
                (false, true) => Fate::May,
                (false, false) => Fate::Hidden,
            };
            prop_assert_eq!(found.parts[number], expected, "part {}", number);
        }
    }

    /// Widening moves parts from must and hidden into may, and nowhere else.
    #[test]
    fn wider_is_no_surer(parts in parts(), (order, matrix) in order(), a in tolerance(), b in tolerance()) {
        let wide = Tolerance {
            pixels: a.pixels.max(b.pixels),
            ulps: a.ulps.max(b.ulps),
            clipped_ulps: a.clipped_ulps.max(b.clipped_ulps),
        };
        let parts = flat(&parts);
        let draws = draws(&parts, matrix);
        let of = |tolerance: Tolerance| -> Fates { fates(VIEWPORT, order, &draws, tolerance) };
        let (narrow, wide) = (of(a), of(wide));
        for (narrow, wide) in narrow.parts.iter().zip(&wide.parts) {
            prop_assert!(narrow == wide || *wide == Fate::May, "{:?} became {:?}", narrow, wide);
        }
        for (narrow, wide) in narrow.decided.iter().zip(&wide.decided) {
            prop_assert!(wide.is_none() || narrow == wide);
        }
    }

    /// A renderer that displaces everything by less than ε, and by some depths, shows what must be shown
    /// and nothing hidden.
    #[test]
    fn a_device_within_the_tolerance_agrees(
        parts in parts(),
        (order, exact) in order(),
        (x, y) in (-0.4_f32..0.4, -0.4_f32..0.4),
        lift in 0_u32..40,
    ) {
        // Clear of the near and the far plane: clipping there is another matter.
        let squeezed = |[x, y, z]: [f32; 3]| [x, y, 0.1 + 0.8 * z.clamp(0.0, 1.0)];
        let parts: Parts =
            parts.iter().map(|part| part.iter().map(|t| t.map(squeezed)).collect()).collect();
        let parts = flat(&parts);
        let mut moved = exact;
        moved[12] = x * 2.0 / VIEWPORT.width as f32;
        moved[13] = y * 2.0 / VIEWPORT.height as f32;
        moved[14] += lift as f32 * f32::EPSILON;
        // The displacement, and 1/256 pixel for snapping to another place on either side. At a depth of
        // 0.1, from zero, a lift is sixteen ulps.
        let pixels = f64::from(x.abs().hypot(y.abs())) + 1.5 / 256.0;
        let ulps = lift * 16 + 8;
        let tolerance = Tolerance { pixels, ulps, clipped_ulps: ulps };
        let found = fates(VIEWPORT, order, &draws(&parts, exact), tolerance);
        let device = shown(&parts, &picture(order, &draws(&parts, moved)));
        for (number, (fate, shows)) in found.parts.iter().zip(device).enumerate() {
            prop_assert!(*fate != Fate::Must || shows, "part {} must show", number);
            prop_assert!(*fate != Fate::Hidden || !shows, "part {} must not show", number);
        }
    }
}
