//! What the fast renderer owes: the naive renderer's image, bit for bit, at every SIMD level, on any
//! number of threads, with and without leaving hidden clusters out.

use plainsight_reference::fast::{Instance, Mesh, Options, SimdLevel};
use plainsight_reference::{DepthOrder, Draw, Faces, Image, Viewport, fast, naive};
use proptest::prelude::*;

const IDENTITY: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// One mesh in several places.
#[derive(Clone, Debug)]
struct Model {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    matrices: Vec<[f32; 16]>,
}

/// Right-handed, w = −z, near 0.5 and far 50; the object is scaled and moved.
fn perspective(scale: f32, [x, y, z]: [f32; 3], turn: f32) -> [f32; 16] {
    let (near, far) = (0.5_f32, 50.0_f32);
    let (a, b) = (far / (near - far), near * far / (near - far));
    // A turn of rational sine and cosine, so that no platform's trigonometry is asked.
    let (c, s) = ((1.0 - turn * turn) / (1.0 + turn * turn), 2.0 * turn / (1.0 + turn * turn));
    let column = |v: [f32; 3], w: f32| [1.2 * v[0], 1.6 * v[1], a * v[2] + b * w, -v[2]];
    let columns = [
        column([scale * c, 0.0, -scale * s], 0.0),
        column([0.0, scale, 0.0], 0.0),
        column([scale * s, 0.0, scale * c], 0.0),
        column([x, y, z], 1.0),
    ];
    std::array::from_fn(|i| columns[i / 4][i % 4])
}

/// The matrix for a depth order: z − w, which goes from −w to 0, where z goes from 0 to w.
fn ordered(mut m: [f32; 16], order: DepthOrder) -> [f32; 16] {
    if order == DepthOrder::Reversed {
        (0..4).for_each(|column| m[4 * column + 2] -= m[4 * column + 3]);
    }
    m
}

/// A bumpy patch of `side` × `side` squares over ±1.
fn patch(side: u32, bumps: &[f32]) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    let at = |i: u32| i as f32 / side as f32 * 2.0 - 1.0;
    let n = side + 1;
    let positions =
        (0..n * n).map(|i| [at(i % n), at(i / n), bumps[i as usize % bumps.len()] * 0.2]).collect();
    let squares = (0..side * side).map(|i| i / side * n + i % side);
    let triangles = squares.flat_map(|a| [[a, a + 1, a + n], [a + 1, a + n + 1, a + n]]).collect();
    (positions, triangles)
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

fn soup() -> impl Strategy<Value = (Vec<[f32; 3]>, Vec<[u32; 3]>)> {
    prop::collection::vec([coordinate(), coordinate(), coordinate()], 3..60).prop_flat_map(
        |positions| {
            let n = positions.len() as u32;
            (Just(positions), prop::collection::vec([0..n, 0..n, 0..n], 1..120))
        },
    )
}

/// Small triangles anywhere, without common vertices.
fn crumbs() -> impl Strategy<Value = (Vec<[f32; 3]>, Vec<[u32; 3]>)> {
    let crumb =
        ([-1.0_f32..1.0, -1.0_f32..1.0, 0.0_f32..1.0], prop::array::uniform6(-0.08_f32..0.08));
    prop::collection::vec(crumb, 1..200).prop_map(|crumbs| {
        let positions: Vec<[f32; 3]> = crumbs
            .iter()
            .flat_map(|&([x, y, z], d)| {
                [[x, y, z], [x + d[0], y + d[1], z], [x + d[2], y + d[3], z + d[4]]]
            })
            .collect();
        let triangles = (0..crumbs.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        (positions, triangles)
    })
}

fn matrix() -> impl Strategy<Value = [f32; 16]> {
    let placed = (0.05_f32..4.0, [-6.0_f32..6.0, -4.0_f32..4.0, -30.0_f32..1.0], -3.0_f32..3.0)
        .prop_map(|(scale, at, turn)| perspective(scale, at, turn));
    let scaled = prop_oneof![Just(1.0_f32), Just(0.125), 1e-4_f32..20.0].prop_map(|scale| {
        let mut m = IDENTITY;
        (m[0], m[5]) = (scale, -scale);
        m
    });
    prop_oneof![6 => placed, 2 => scaled, 1 => Just(IDENTITY)]
}

fn model() -> impl Strategy<Value = Model> {
    let dense = (2_u32..24, prop::collection::vec(-1.0_f32..1.0, 1..9))
        .prop_map(|(side, bumps)| patch(side, &bumps));
    let mesh = prop_oneof![3 => dense, 2 => soup(), 2 => crumbs()];
    (mesh, prop::collection::vec(matrix(), 1..5))
        .prop_map(|((positions, triangles), matrices)| Model { positions, triangles, matrices })
}

fn order() -> impl Strategy<Value = DepthOrder> {
    prop_oneof![Just(DepthOrder::Forward), Just(DepthOrder::Reversed)]
}

/// From one pixel to several regions, with odd sizes, and 16 × 16 whose centres lie on the grid of
/// [`coordinate`].
fn viewport() -> impl Strategy<Value = Viewport> {
    let of = |(width, height)| Viewport { width, height };
    prop_oneof![
        3 => (1_u32..90, 1_u32..70).prop_map(of),
        2 => (100_u32..300, 90_u32..280).prop_map(of),
        2 => Just(of((16, 16))),
        1 => prop_oneof![Just((1, 1)), Just((127, 129)), Just((128, 128)), Just((1, 700)), Just((700, 1))].prop_map(of),
    ]
}

/// Draws the models with both renderers, the fast one in every way that `ways` names, and compares
/// samples, hash and bounds.
fn compare(
    viewport: Viewport,
    order: DepthOrder,
    models: &[Model],
    faces: Faces,
    ways: impl Iterator<Item = (SimdLevel, bool, usize)>,
) -> Result<(), String> {
    let ranks: Vec<Vec<u32>> = models
        .iter()
        .map(|model| {
            let count = model.triangles.len() as u32;
            // Not the order of the triangles, so that ties are seen.
            (0..count).map(|i| count - 1 - i).collect()
        })
        .collect();
    let mut expected = Image::ordered(viewport, order);
    let meshes: Vec<Mesh> = models
        .iter()
        .zip(&ranks)
        .map(|(model, ranks)| Mesh::new(&model.positions, &model.triangles, ranks))
        .collect();
    let mut instances = Vec::new();
    let mut first_draw = 0;
    for ((model, ranks), mesh) in models.iter().zip(&ranks).zip(&meshes) {
        for &matrix in &model.matrices {
            let clip_from_object = ordered(matrix, order);
            let (positions, triangles) = (&model.positions, &model.triangles);
            let draw = Draw { positions, triangles, ranks, first_draw, clip_from_object, faces };
            naive::draw(&mut expected, &draw);
            instances.push(Instance::new(mesh, first_draw, clip_from_object, faces));
            first_draw += ranks.len() as u32;
        }
    }
    let mut image = Image::ordered(viewport, order);
    for (level, skip_hidden, threads) in ways {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let options = Options { level, skip_hidden };
        let way = format!("{level}, {threads} threads, skip_hidden {skip_hidden}");
        pool.install(|| fast::render(&mut image, &instances, options));
        if image != expected {
            let sample = (0..image.sample_count()).find(|&s| image.word(s) != expected.word(s));
            let sample = sample.unwrap_or(0);
            return Err(format!(
                "{way}: sample {sample} is {:?} {:?}, naive has {:?} {:?}",
                image.depth(sample),
                image.draw_index(sample),
                expected.depth(sample),
                expected.draw_index(sample)
            ));
        }
        if image.hash() != expected.hash() || !image.bounds_hold() {
            return Err(format!("{way}: hash or bounds"));
        }
        // Instance by instance, the last first, onto what is there.
        let mut other = Image::ordered(viewport, order);
        pool.install(|| {
            for instance in instances.iter().rev() {
                fast::draw(&mut other, std::slice::from_ref(instance), options);
            }
        });
        if other != expected || !other.bounds_hold() {
            return Err(format!("{way}: one by one"));
        }
    }
    Ok(())
}

fn all_ways() -> impl Iterator<Item = (SimdLevel, bool, usize)> {
    let ways = |level| [true, false].into_iter().map(move |skip| (level, skip));
    let levels = SimdLevel::available().into_iter().flat_map(ways);
    levels.flat_map(|(level, skip)| (1..=3).map(move |threads| (level, skip, threads)))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn fast_equals_naive(
        viewport in viewport(),
        order in order(),
        models in prop::collection::vec(model(), 1..4),
        both in prop::bool::weighted(0.7),
        threads in 1_usize..4,
    ) {
        let faces = if both { Faces::Both } else { Faces::CounterClockwise };
        let ways = SimdLevel::available().into_iter().flat_map(|level| [(level, true, threads), (level, false, threads)]);
        if let Err(error) = compare(viewport, order, &models, faces, ways) {
            prop_assert!(false, "{error}");
        }
    }
}

/// Hundreds of dense patches behind one another, and large triangles among them; every way.
#[test]
fn a_crowded_picture_is_equal_in_every_way() {
    let bumps: Vec<f32> = (0..97).map(|i| (i * 37 % 97) as f32 / 97.0).collect();
    let (positions, triangles) = patch(20, &bumps);
    let matrices = (0..40)
        .map(|i| {
            let [a, b, c] = [7, 11, 13].map(|step| (i * step % 17) as f32 / 17.0 - 0.5);
            perspective(1.5, [a * 8.0, b * 6.0, -6.0 - 8.0 * c], a + b)
        })
        .collect();
    let dense = Model { positions, triangles, matrices };
    let positions = (0..90)
        .map(|i| {
            let [a, b, c] = [31, 17, 23].map(|step| (i * step % 89) as f32 / 89.0);
            [a * 3.0 - 1.5, b * 3.0 - 1.5, c]
        })
        .collect();
    let triangles = (0..30).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let large = Model { positions, triangles, matrices: vec![IDENTITY] };
    let (forward, reversed) = (DepthOrder::Forward, DepthOrder::Reversed);
    let ways =
        [(333, 251, forward), (4096, 33, reversed), (77, 4096, forward), (251, 333, reversed)];
    for (width, height, order) in ways {
        let viewport = Viewport { width, height };
        let models = [dense.clone(), large.clone()];
        compare(viewport, order, &models, Faces::Both, all_ways()).unwrap();
    }
}

/// As large as pictures get here: a thousand regions.
#[test]
fn a_large_picture_is_equal_at_every_level() {
    let (positions, triangles) = patch(24, &[0.0, 0.3, 0.7, 0.1]);
    let matrices =
        vec![perspective(3.0, [0.3, 0.2, -6.0], 0.2), perspective(9.0, [1.0, 0.0, -20.0], 0.5)];
    let viewport = Viewport { width: 4096, height: 4095 };
    let model = Model { positions, triangles, matrices };
    let ways = SimdLevel::available().into_iter().map(|level| (level, true, 2));
    compare(viewport, DepthOrder::Forward, &[model], Faces::Both, ways).unwrap();
}

/// Edges from near to very far away: coordinates stay in range, and both renderers agree.
#[test]
fn edges_too_uneven_for_f32_stay_in_range() {
    let viewport = Viewport { width: 33, height: 21 };
    for far in [1e6_f32, 1e12, 1e20, 3e37] {
        for (x, y, z) in [(far, 0.3, -2.0), (0.1, -far, -far), (far, far, far), (-far, 0.2, -3.0)] {
            let positions = vec![[0.1, 0.2, -5.0], [-0.3, 0.1, -4.0], [x, y, z]];
            let matrices = vec![IDENTITY, perspective(1.0, [0.0; 3], 0.0)];
            let model = Model { positions, triangles: vec![[0, 1, 2]], matrices };
            for order in [DepthOrder::Forward, DepthOrder::Reversed] {
                compare(viewport, order, std::slice::from_ref(&model), Faces::Both, all_ways())
                    .unwrap();
            }
        }
    }
}

/// What the renderer does in all for a picture of many patches, some of them hidden, outside, cut or
/// large. A change that makes it work more must show here; the bench `instructions` has the rest.
#[test]
fn the_work_of_a_picture_is_known() {
    let bumps: Vec<f32> = (0..89).map(|i| (i * 31 % 89) as f32 / 89.0).collect();
    let (positions, triangles) = patch(70, &bumps);
    let ranks: Vec<u32> = (0..triangles.len() as u32).collect();
    let mesh = Mesh::new(&positions, &triangles, &ranks);
    let matrix = |i: usize, order: DepthOrder| {
        let [a, b, c] = [7, 11, 13].map(|step| (i * step % 17) as f32 / 17.0 - 0.5);
        let scale = if i == 20 { 4.0 } else { 1.5 + c };
        ordered(perspective(scale, [a * 16.0, b * 12.0, -5.0 - 13.0 * c], a + b), order)
    };
    for order in [DepthOrder::Forward, DepthOrder::Reversed] {
        let instance = |i: usize| Instance::new(&mesh, 0, matrix(i, order), Faces::Both);
        let instances: Vec<Instance<'_>> = (0..30).map(instance).collect();
        for level in SimdLevel::available().into_iter().filter(|&l| l != SimdLevel::Scalar) {
            let mut image = Image::ordered(Viewport { width: 400, height: 300 }, order);
            let work = fast::render(&mut image, &instances, Options { level, skip_hidden: true });
            assert_eq!(
                format!("{work:?}"),
                "Work { units: 60, units_hidden: 11, clusters_outside: 2641, clusters_narrow: 1046, clusters_wide: 3, clusters: 1089, clusters_hidden: 42, triangles: 87200 }",
                "{order:?} {level}"
            );
        }
    }
}

/// What is hidden is left out, and what was left out is counted alike on any number of threads.
#[test]
fn hidden_clusters_are_left_out() {
    let viewport = Viewport { width: 300, height: 200 };
    let (positions, triangles) = patch(60, &[0.0, 0.1, 0.3]);
    let ranks: Vec<u32> = (0..triangles.len() as u32).collect();
    let mesh = Mesh::new(&positions, &triangles, &ranks);
    let at = |z: f32| Instance::new(&mesh, 0, perspective(4.0, [0.0, 0.0, z], 0.0), Faces::Both);
    let instances = [at(-20.0), at(-5.0), at(-10.0)];
    let work = |threads: usize, skip_hidden: bool| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = Options { skip_hidden, ..Options::default() };
        pool.install(|| fast::render(&mut Image::new(viewport), &instances, options))
    };
    let (some, all) = (work(1, true), work(1, false));
    assert_eq!(some, work(3, true));
    assert_eq!(all, work(3, false));
    assert!(some.units_hidden + some.clusters_hidden > 0 && all.clusters_hidden == 0, "{some:?}");
    assert!(some.triangles * 2 < all.triangles, "{some:?} {all:?}");
}

/// Sixty-five clusters, and so a unit of one that is not all of its mesh, before and after other meshes;
/// at every level.
#[test]
fn what_is_left_of_a_mesh_is_a_unit() {
    let (positions, triangles) = patch(51, &[0.0, 0.2, 0.1, 0.3, 0.05]);
    let place = |x: f32| perspective(1.0, [x, 0.2 * x, -4.0], 0.1 * x);
    let large = Model {
        positions,
        triangles: triangles[..65 * 80].to_vec(),
        matrices: vec![place(-1.0), place(1.5)],
    };
    let (positions, triangles) = patch(10, &[0.1, 0.0, 0.3]);
    let small = Model { positions, triangles, matrices: vec![place(0.5), place(-0.5)] };
    let (positions, triangles) = patch(3, &[0.0, 0.4]);
    let single = Model { positions, triangles, matrices: vec![place(0.2), place(-0.2)] };
    let models = [large.clone(), small, single, large];
    let viewport = Viewport { width: 150, height: 140 };
    compare(viewport, DepthOrder::Forward, &models, Faces::Both, all_ways()).unwrap();
}

/// Outside the view a unit is nowhere, and so not hidden either.
#[test]
fn what_is_outside_is_not_hidden() {
    let (positions, triangles) = patch(3, &[0.0]);
    let ranks: Vec<u32> = (0..triangles.len() as u32).collect();
    let mesh = Mesh::new(&positions, &triangles, &ranks);
    let beside = Instance::new(&mesh, 0, perspective(1.0, [90.0, 0.0, -9.0], 0.0), Faces::Both);
    let mut image = Image::new(Viewport { width: 60, height: 50 });
    let work = fast::render(&mut image, &[beside], Options::default());
    assert_eq!(work, fast::Work { units: 1, clusters_outside: 1, ..fast::Work::default() });
}

#[test]
fn a_mesh_says_what_it_holds() {
    let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let one = Mesh::new(&triangle, &[[0, 1, 2]], &[7]);
    // A box, three components of sixteen vertices, sixteen triangles' corners and ranks, and a cluster.
    assert_eq!((one.triangle_count(), one.bytes()), (1, (6 + 3 * 16 + 2 * 16) * 4 + 8));
    let (positions, triangles) = patch(10, &[0.0]);
    let ranks: Vec<u32> = (0..200).collect();
    let some = Mesh::new(&positions, &triangles, &ranks);
    // Two full clusters and one of forty; each of up to 64 vertices.
    assert_eq!(some.triangle_count(), 200);
    let triangles_padded = 80 + 80 + 48;
    let without_vertices = (3 * 6 + 2 * triangles_padded) * 4 + 3 * 8;
    let vertices = (some.bytes() - without_vertices) / (3 * 4);
    assert!((some.bytes() - without_vertices).is_multiple_of(3 * 16 * 4), "{}", some.bytes());
    assert!((121..=3 * 64).contains(&vertices), "{vertices} vertices, padded, of 121");
    let empty = Mesh::new(&[], &[], &[]);
    assert_eq!((empty.triangle_count(), empty.bytes()), (0, 0));
}

/// The highest draw index of an instance is the last but one that 32 bits hold.
#[test]
fn the_last_draw_index_fits() {
    let triangle = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let mesh = Mesh::new(&triangle, &[[0, 1, 2], [0, 1, 2]], &[2, 5]);
    let instance = |first: u32| Instance::new(&mesh, first, IDENTITY, Faces::Both);
    let mut image = Image::new(Viewport { width: 4, height: 4 });
    fast::render(&mut image, &[instance(u32::MAX - 6)], Options::default());
    assert_eq!(
        image.draw_indices().flatten().max(),
        Some(u32::MAX - 4),
        "the lower of equal depths"
    );
    for first in [u32::MAX - 5, u32::MAX - 4, u32::MAX] {
        assert!(std::panic::catch_unwind(|| instance(first)).is_err(), "{first}");
    }
}

#[test]
fn levels_are_named() {
    for level in SimdLevel::ALL {
        assert_eq!(level.to_string().parse(), Ok(level));
    }
    let error = "sse3".parse::<SimdLevel>().expect_err("no such level");
    assert_eq!(
        error,
        "no SIMD level \"sse3\"; the levels are scalar, sse2, sse4.2, neon, avx2, avx512"
    );
}
