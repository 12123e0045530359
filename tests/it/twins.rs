//! Bounds on error, each held against a second derivation that is as plain as can be: where a bound is made,
//! put together or handed up, dropping it, halving it or taking another axis's shows here. The errors are
//! large, far from each other and other on each axis, so that none hides behind another.

use glam::{DMat4, DVec3, DVec4};
use plainsight::cull::{Appearance, CullerSetup, Item, ProxyKind, Scenery, SceneryKnobs, View};
use plainsight::index::{INDEXES, Index, NodeId};
use plainsight::math::{
    Aabb, BOX_DEPTH_SLACK, BOX_DILATION_PIXELS, ClipBox, ClipError, DEPTH_ROUNDING,
    HULL_DILATION_PIXELS, Hull, Outline, PixelRectangle, Projection, RECTANGLE_DILATION_PIXELS,
    inflated_box,
};
use plainsight::oracle::{CostModel, Proxy};
use plainsight::part::{ObjectId, PartitionKnobs};
use plainsight::run::{FrameState, Moment, World};
use plainsight::scene::generate::{HARD, Knobs, build};
use plainsight::scene::{Camera, DepthOrder, Lens, Stream, Viewport};
use rayon::prelude::*;

const ORDERS: [DepthOrder; 2] = [DepthOrder::Forward, DepthOrder::Reversed];
/// 2⁻²⁴ and 2⁻⁵³: the unit roundoffs.
const F32: f64 = 1.0 / (1_u64 << 24) as f64;
const F64: f64 = 1.0 / (1_u64 << 53) as f64;

/// Matrix entries by row and column.
fn rows(matrix: &DMat4) -> [[f64; 4]; 4] {
    std::array::from_fn(|row| std::array::from_fn(|column| matrix.col(column)[row]))
}

/// The bound of the derivation in `clip_error`, by sums over entries.
fn clip_error(clip: &DMat4, world: &DMat4, reach: DVec3) -> [f64; 4] {
    let gamma = |n: f64, unit: f64| n * unit / (1.0 - n * unit);
    let flushed = libm::pow(2.0, -120.0);
    let (clip, world) = (rows(clip), rows(world));
    let reach = [reach.x, reach.y, reach.z, 1.0];
    std::array::from_fn(|i| {
        let mut bound = 0.0;
        for (j, reach) in reach.iter().enumerate() {
            let entry: f64 = (0..4).map(|k| clip[i][k] * world[k][j]).sum();
            let absolute: f64 = (0..4).map(|k| (clip[i][k] * world[k][j]).abs()).sum();
            bound += gamma(23.0, F32) * entry.abs() * reach;
            bound += gamma(8.0, F64) * absolute * reach;
            bound += flushed * reach;
        }
        bound
    })
}

/// A camera of one of the lenses, and how large things are before it.
fn camera(stream: &mut Stream, order: DepthOrder, viewport: Viewport) -> (DMat4, f64) {
    let size = libm::pow(10.0, stream.range(-2.0, 3.0));
    let lens = match stream.below(3) {
        0 => Lens::Orthographic { height: size * stream.range(2.0, 9.0) },
        1 => Lens::Perspective { fov_y: 1.1, shift: [stream.range(-0.8, 0.8), 0.3] },
        _ => Lens::perspective(libm::pow(10.0, stream.range(-2.0, 0.2))),
    };
    let mut side = || stream.range(-1.0, 1.0);
    let forward = DVec3::new(side(), side(), side() + 2.0).normalize();
    let eye = DVec3::new(side(), side(), side()) * size * libm::pow(10.0, side() * 3.0 + 1.0);
    let camera = Camera { eye, forward, lens, near: 0.1 * size, far: 60.0 * size };
    (camera.clip_from_world(viewport, order), size)
}

/// A camera in a random place, as a matrix from boxes of about unit size somewhere before it.
fn clip_from_box(stream: &mut Stream, order: DepthOrder, viewport: Viewport) -> DMat4 {
    let (clip, size) = camera(stream, order, viewport);
    // Somewhere in the picture, or just beside it.
    let place = [0; 2].map(|_| stream.range(-1.2, 1.2));
    let depth = match order {
        DepthOrder::Forward => stream.range(0.3, 0.98),
        DepthOrder::Reversed => -libm::pow(10.0, stream.range(-1.7, -0.1)),
    };
    let at = clip.inverse() * DVec4::new(place[0], place[1], depth, 1.0);
    let turn = DMat4::from_rotation_y(stream.range(-3.0, 3.0))
        * DMat4::from_rotation_x(stream.range(-1.5, 1.5));
    let scale = DVec3::new(stream.unit(), stream.unit(), stream.unit()) * size * 0.5;
    clip * DMat4::from_translation((at / at.w).truncate()) * turn * DMat4::from_scale(scale)
}

/// A box with its bound as the derivations in `clip_box`, `hull` and `inflate` take it, and nothing else.
struct Twin {
    corners: Vec<[f64; 4]>,
    /// Bounds on x, y, z, w.
    error: [f64; 4],
    order: DepthOrder,
    pixels: [f64; 2],
}

impl Twin {
    fn new(aabb: &Aabb, matrix: &DMat4, error: &ClipError, order: DepthOrder, v: Viewport) -> Self {
        let m = rows(matrix);
        let far = aabb.max_abs();
        let far = [far.x, far.y, far.z, 1.0];
        let corner = |p: DVec3| {
            let p = [p.x, p.y, p.z, 1.0];
            std::array::from_fn(|i| (0..4).map(|j| m[i][j] * p[j]).sum())
        };
        let own = |i: usize| (0..4).map(|j| m[i][j].abs() * far[j]).sum::<f64>() * 8.0 * F64;
        Self {
            corners: aabb.corners().into_iter().map(corner).collect(),
            error: std::array::from_fn(|i| error.bound[i] + own(i)),
            order,
            pixels: [f64::from(v.width), f64::from(v.height)],
        }
    }

    /// By how much the corner nearest to it is inside each plane, errors added: less than zero for a box
    /// that is wholly beyond one.
    fn inside(&self) -> f64 {
        let [ex, ey, ez, ew] = self.error;
        let most = |of: &dyn Fn(&[f64; 4]) -> f64| {
            self.corners.iter().map(of).fold(f64::NEG_INFINITY, f64::max)
        };
        let (near, far) = match self.order {
            DepthOrder::Forward => (most(&|c| c[2]) + ez, most(&|c| c[3] - c[2]) + ez + ew),
            DepthOrder::Reversed => (most(&|c| c[3] + c[2]) + ez + ew, most(&|c| -c[2]) + ez),
        };
        let sides = [
            most(&|c| c[3] + c[0]) + ex + ew,
            most(&|c| c[3] - c[0]) + ex + ew,
            most(&|c| c[3] + c[1]) + ey + ew,
            most(&|c| c[3] - c[1]) + ey + ew,
        ];
        sides.into_iter().fold(near.min(far), f64::min)
    }

    /// The smallest w, and how far the box keeps from the near plane, errors taken off.
    fn before_the_eye(&self) -> [f64; 2] {
        let [_, _, ez, ew] = self.error;
        let least = |of: &dyn Fn(&[f64; 4]) -> f64| {
            self.corners.iter().map(of).fold(f64::INFINITY, f64::min)
        };
        let near = match self.order {
            DepthOrder::Forward => least(&|c| c[2]) - ez,
            DepthOrder::Reversed => least(&|c| c[3] + c[2]) - ez - ew,
        };
        [least(&|c| c[3]) - ew, near]
    }

    /// Columns and rows of the corners, and by how much each may be off.
    fn window(&self) -> (Vec<[f64; 2]>, [f64; 2]) {
        let [w_min, _] = self.before_the_eye();
        let place = |c: &[f64; 4]| {
            let [x, y] = [c[0] / c[3], -c[1] / c[3]];
            [(x + 1.0) * 0.5 * self.pixels[0], (y + 1.0) * 0.5 * self.pixels[1]]
        };
        let bound = |axis: usize| {
            let most = self.corners.iter().map(|c| (c[axis] / c[3]).abs()).fold(0.0, f64::max);
            (self.error[axis] + most * self.error[3]) / w_min * self.pixels[axis] * 0.5
        };
        (self.corners.iter().map(place).collect(), [bound(0), bound(1)])
    }

    /// The first pixel and one beyond the last whose middles are within `margin` of the corners.
    fn columns(&self, axis: usize, margin: f64) -> [u32; 2] {
        let (places, bound) = self.window();
        let along = || places.iter().map(|place| place[axis]);
        let low = along().fold(f64::INFINITY, f64::min) - bound[axis] - margin;
        let high = along().fold(f64::NEG_INFINITY, f64::max) + bound[axis] + margin;
        let most = self.pixels[axis] as u32;
        let within = |pixel: u32| (low..=high).contains(&(f64::from(pixel) + 0.5));
        let first = (0..most).find(|&pixel| within(pixel)).unwrap_or(most);
        let end = (0..most).rev().find(|&pixel| within(pixel)).map_or(0, |pixel| pixel + 1);
        [first, end]
    }

    /// The nearest depth, errors and rounding taken off.
    fn depth(&self) -> f64 {
        let [_, _, ez, ew] = self.error;
        let [w_min, _] = self.before_the_eye();
        let nearest = self.corners.iter().map(|c| c[2] / c[3]).fold(f64::INFINITY, f64::min);
        match self.order {
            DepthOrder::Forward => (nearest - (ez + ew) / w_min - DEPTH_ROUNDING).max(0.0),
            DepthOrder::Reversed => {
                let nearest = nearest.min(0.0);
                let moved = nearest - (ez - nearest * ew) / w_min;
                (moved + DEPTH_ROUNDING * moved).max(-1.0)
            }
        }
    }
}

/// What is too near to a decision for two derivations to agree, of the numbers at hand.
const NEARLY: f64 = 1e-9;

/// A random box under a random camera with errors of up to some pixels, other on every axis.
fn case(stream: &mut Stream, round: u32) -> (Aabb, DMat4, ClipError, DepthOrder, Viewport) {
    let order = ORDERS[round as usize % 2];
    let viewport = Viewport { width: 1 + stream.below(120), height: 1 + stream.below(90) };
    let matrix = clip_from_box(stream, order, viewport);
    let mut half = || DVec3::new(stream.unit(), stream.unit(), stream.unit());
    let aabb = Aabb::new(-half(), half());
    let w = (matrix * DVec4::W).w.abs();
    let mut error = || w * libm::pow(10.0, stream.range(-6.0, -0.8));
    (aabb, matrix, ClipError { bound: [error(), error(), error(), error()] }, order, viewport)
}

/// Whether a box is outside, its rectangle and its depth are those of the derivation, for perspective,
/// shifted and parallel rays, in both orders.
#[test]
fn projections_are_those_of_the_derivation() {
    let mut stream = Stream::new(3, "twins");
    let [mut outside, mut unbounded, mut within, mut parallel] = [0; 4];
    for round in 0..60_000 {
        let (aabb, matrix, error, order, viewport) = case(&mut stream, round);
        let clip = ClipBox::new(&aabb, &matrix, &error, order);
        let twin = Twin::new(&aabb, &matrix, &error, order, viewport);
        let inside = twin.inside();
        let size = twin.corners.iter().flatten().fold(0.0, |most: f64, c| most.max(c.abs()));
        if inside.abs() > NEARLY * size {
            assert_eq!(clip.outside_frustum(), inside < 0.0, "round {round}: {inside}");
        }
        let found = clip.project(viewport.width, viewport.height);
        if inside < NEARLY * size {
            outside += 1;
            continue;
        }
        let least = twin.before_the_eye();
        if least.iter().any(|least| *least < -NEARLY * size) {
            assert_eq!(found, Projection::Unbounded, "round {round}: {least:?}");
            unbounded += 1;
            continue;
        }
        if least.iter().any(|least| *least < NEARLY * size) {
            continue;
        }
        let [x, y] = [0, 1].map(|axis| twin.columns(axis, RECTANGLE_DILATION_PIXELS));
        // Where another margin by a trifle gives another rectangle, either will do.
        let trifle = [-1e-6, 1e-6]
            .map(|by| [0, 1].map(|axis| twin.columns(axis, RECTANGLE_DILATION_PIXELS + by)));
        let sure = trifle.iter().all(|other| *other == [x, y]);
        let nowhere = x[0] >= x[1] || y[0] >= y[1];
        match found {
            Projection::Nowhere => assert!(nowhere || !sure, "round {round}: {x:?} {y:?}"),
            Projection::Unbounded => panic!("round {round}: {least:?}"),
            Projection::Within { rectangle, depth } => {
                let expected = PixelRectangle { min: [x[0], y[0]], max: [x[1], y[1]] };
                assert!(
                    rectangle == expected || !sure,
                    "round {round}: {rectangle:?} {expected:?}"
                );
                let (depth, derived) = (f64::from(depth), twin.depth());
                let ulps = 2.0 * F32 * depth.abs().max(1e-6);
                assert!(depth <= derived + ulps * 1e-3, "round {round}: {depth} {derived}");
                assert!(depth >= derived - ulps, "round {round}: {depth} {derived}");
                within += 1;
                parallel += u32::from(twin.corners.iter().all(|c| c[3] == 1.0));
            }
        }
    }
    let seen = [outside, unbounded, within, parallel];
    assert!(
        outside > 2_000 && unbounded > 2_000 && within > 10_000 && parallel > 3_000,
        "{seen:?}"
    );
}

/// Whether a sample is in the fan of triangles that a hull is drawn as. [`Hull::holds`] asks the line through each
/// side, which says less where rounding has bent a short one inwards.
fn is_drawn(hull: &Hull, [x, y]: [i32; 2]) -> bool {
    let left_of = |a: &[i32; 2], b: &[i32; 2]| {
        let wide = |from: i32, to: i32| i64::from(to) - i64::from(from);
        wide(a[0], b[0]) * wide(a[1], y) >= wide(a[1], b[1]) * wide(a[0], x)
    };
    let corners = hull.corners();
    let first = &corners[0];
    corners[1..].windows(2).any(|pair| {
        left_of(first, &pair[0]) && left_of(&pair[0], &pair[1]) && left_of(&pair[1], first)
    })
}

/// A hull holds every corner's surroundings, as far as its bound and the dilation reach on each axis, and
/// where nothing cuts it, hardly more.
#[test]
fn hulls_reach_as_far_as_the_derivation() {
    let mut stream = Stream::new(4, "twins");
    let [mut hulls, mut parallel] = [0; 2];
    for round in 0..40_000 {
        let (aabb, matrix, error, order, viewport) = case(&mut stream, round);
        let clip = ClipBox::new(&aabb, &matrix, &error, order);
        let pixels = (viewport.width, viewport.height);
        let Projection::Within { rectangle, depth } = clip.project(pixels.0, pixels.1) else {
            continue;
        };
        let Outline::Within { hull, .. } = clip.outline(pixels, (rectangle, depth)) else {
            continue;
        };
        let twin = Twin::new(&aabb, &matrix, &error, order, viewport);
        let (places, bound) = twin.window();
        hulls += 1;
        parallel += u32::from(twin.corners.iter().all(|c| c[3] == 1.0));
        for place in places {
            for [across, down] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
                let reach = [0, 1].map(|axis| bound[axis] + HULL_DILATION_PIXELS);
                let corner = [place[0] + across * reach[0], place[1] + down * reach[1]];
                // To the nearest sub-pixels towards the middle; rounding of cut corners takes two more.
                let toward = |at: f64, out: f64| ((at * 256.0) - out * 3.0).round() as i32;
                let at = [toward(corner[0], across), toward(corner[1], down)];
                let side = |axis: usize| {
                    let [low, high] = [rectangle.min[axis], rectangle.max[axis]];
                    (low as i32 * 256..=high as i32 * 256).contains(&at[axis])
                };
                assert!(
                    !(side(0) && side(1)) || is_drawn(&hull, at),
                    "round {round}: {corner:?} is not in {hull:?}"
                );
            }
        }
    }
    assert!(hulls > 5_000 && parallel > 1_500, "{hulls} {parallel}");
}

/// A box grows on each axis by what its errors, a pixel and the slack of depth come to in its own space.
#[test]
fn boxes_grow_as_far_as_the_derivation() {
    let mut stream = Stream::new(5, "twins");
    let [mut boxes, mut parallel] = [0; 2];
    for round in 0..40_000 {
        let (aabb, matrix, mut error, order, viewport) = case(&mut stream, round);
        // Small enough for a box to be left.
        error.bound.iter_mut().for_each(|bound| *bound *= 0.05);
        let pixels = (viewport.width, viewport.height);
        let Some(grown) = inflated_box(&aabb, &matrix, &error, pixels, order) else { continue };
        let m = rows(&matrix);
        let corners: Vec<[f64; 4]> = aabb
            .corners()
            .into_iter()
            .map(|p| {
                let p = [p.x, p.y, p.z, 1.0];
                std::array::from_fn(|i| (0..4).map(|j| m[i][j] * p[j]).sum())
            })
            .collect();
        let most = |of: &dyn Fn(&[f64; 4]) -> f64| corners.iter().map(of).fold(0.0, f64::max);
        let w = most(&|c| c[3]);
        let depth = if order == DepthOrder::Forward { w } else { most(&|c| c[2].abs()) };
        let [ex, ey, ez, ew] = error.bound;
        let pixel = |side: u32| 2.0 * BOX_DILATION_PIXELS * w / f64::from(side);
        let moved = [
            2.0 * ex + 2.0 * ew + pixel(viewport.width),
            2.0 * ey + 2.0 * ew + pixel(viewport.height),
            2.0 * ez + 2.0 * ew + BOX_DEPTH_SLACK * depth,
            2.0 * ew,
        ];
        let inverse = rows(&matrix.inverse());
        let shift: [f64; 4] =
            std::array::from_fn(|i| (0..4).map(|j| inverse[i][j].abs() * moved[j]).sum());
        let far = aabb.max_abs();
        boxes += 1;
        parallel += u32::from(corners.iter().all(|c| c[3] == 1.0));
        for axis in 0..3 {
            // Twice, for the rounding of the inverse; then the point p + d with d = (a - b p) / (1 + b).
            let (a, b) = (2.0 * shift[axis], 2.0 * shift[3]);
            let margin = (a + b * far[axis]) / (1.0 - b);
            let (low, high) = (aabb.min[axis] - grown.min[axis], grown.max[axis] - aabb.max[axis]);
            let ulps = 4.0 * F32 * (far[axis] + margin);
            for out in [low, high] {
                assert!(
                    out >= margin * (1.0 - NEARLY),
                    "round {round} axis {axis}: {out} {margin}"
                );
                assert!(
                    out <= margin * (1.0 + NEARLY) + ulps,
                    "round {round} axis {axis}: {out} {margin}"
                );
            }
        }
    }
    assert!(boxes > 5_000 && parallel > 1_500, "{boxes} {parallel}");
}

/// The transform bound takes every axis's reach by its own column.
#[test]
fn transform_bounds_are_those_of_the_derivation() {
    let mut stream = Stream::new(6, "twins");
    for round in 0..20_000 {
        let viewport = Viewport { width: 320, height: 200 };
        let (clip, size) = camera(&mut stream, ORDERS[round % 2], viewport);
        let mut entry = || libm::pow(10.0, stream.range(-2.0, 6.0)) * stream.range(-1.0, 1.0);
        let world = DMat4::from_translation(DVec3::new(entry(), entry(), entry()) * size)
            * DMat4::from_rotation_y(entry())
            * DMat4::from_rotation_x(entry())
            * DMat4::from_scale(DVec3::new(entry(), entry(), entry()));
        let reach = DVec3::new(entry(), entry(), entry()).abs();
        let bound = ClipError::of(&clip, &world, reach).bound;
        for (row, (bound, derived)) in
            bound.iter().zip(clip_error(&clip, &world, reach)).enumerate()
        {
            // Sums that cancel are other ones in another order, by as much as the second term covers.
            assert!(
                (bound - derived).abs() <= derived * 1e-3,
                "round {round} row {row}: {bound} {derived}"
            );
        }
    }
}

/// Worlds in which objects' bounds differ much: far in their meshes, far from the origin, of every scale.
fn worlds(seeds: u64) -> Vec<World> {
    let hard = HARD.iter().map(|generator| (generator.name, 1));
    let swarm = (0..seeds).map(|seed| ("swarm", seed));
    let world = |(name, seed): (&str, u64)| {
        let knobs = Knobs { seed: Some(seed), frames: Some(3), ..Knobs::default() };
        let scene = build(name, &knobs).unwrap();
        let leaf_triangles = scene.leaf_triangles;
        World::new(scene, PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() })
    };
    hard.chain(swarm).map(world).collect()
}

/// Every object's bound is made of its own mesh's reach, axis by axis, where it stands in that frame; and what
/// f32 makes of its vertices is within.
#[test]
fn objects_carry_the_bound_of_their_meshes() {
    worlds(40).par_iter().for_each(|world| {
        let meshes = &world.scene.meshes;
        let reach: Vec<DVec3> = meshes
            .iter()
            .map(|mesh| {
                let far =
                    |reach: DVec3, p: &[f32; 3]| reach.max(DVec3::from(p.map(f64::from)).abs());
                mesh.positions().iter().fold(DVec3::ZERO, far)
            })
            .collect();
        for frame in [0, 2] {
            let state = FrameState::at(world, Moment { frame, view: 0 });
            for (id, object) in (0..).zip(&state.objects) {
                // Nothing of it is drawn.
                if world.partition.mesh(ObjectId(id)).bounds.is_empty() {
                    continue;
                }
                let number = world.scene.objects[id as usize].mesh as usize;
                let (mesh, reach) = (&meshes[number], reach[number]);
                let placed = world.world_from_object(ObjectId(id), frame);
                let own = ClipError::of(&state.clip_from_world, &placed, reach).bound;
                let at = format!("{} frame {frame} object {id}", world.scene.name);
                // Cutting may leave out a vertex that nothing uses, and never adds one.
                let same = (0..4).all(|i| {
                    let (bound, own) = (object.error.bound[i], own[i]);
                    bound == own || bound.is_nan() && own.is_nan()
                });
                assert!(same, "{at}: {:?} {own:?}", object.error.bound);
                let m = &state.matrices[id as usize];
                for p in mesh.positions().iter().step_by(37) {
                    let exact =
                        object.clip_from_object * DVec3::from_array(p.map(f64::from)).extend(1.0);
                    for row in 0..4 {
                        let f32s =
                            ((m[row] * p[0] + m[4 + row] * p[1]) + m[8 + row] * p[2]) + m[12 + row];
                        let off = (f64::from(f32s) - exact[row]).abs();
                        // What is no number is within what is not finite.
                        let within = off <= object.error.bound[row] || off.is_nan();
                        assert!(
                            within || object.error.bound[row].is_nan(),
                            "{at} row {row}: {off}"
                        );
                    }
                }
            }
        }
    });
}

/// The bound that holds for everything at and below a node, by a walk of the tree; noted for every node on
/// the way.
fn bound_below(index: &dyn Index, view: &View<'_>, node: NodeId, noted: &mut [[f64; 4]]) {
    let mut all = [0.0_f64; 4];
    let mut also = |bound: [f64; 4]| all = std::array::from_fn(|i| larger(all[i], bound[i]));
    for object in index.node(node).objects {
        also(view.objects[object.0 as usize].error.bound);
    }
    let mut children = Vec::new();
    index.children(node, view.camera.eye, &mut children);
    for child in children {
        bound_below(index, view, child, noted);
        also(noted[child.0 as usize]);
    }
    noted[node.0 as usize] = all;
}

fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) }
}

/// Every node of every index carries the largest bound of what is at and below it, however many nodes
/// without objects of their own are between; every node of an object's tree that of its object.
#[test]
fn bounds_are_handed_up_to_every_node() {
    let counts: Vec<[u32; 3]> = worlds(12)
        .par_iter()
        .map(|world| {
            let entries = world.entries();
            let mut counts = [0; 3];
            for index in INDEXES {
                let setup = CullerSetup {
                    partition: world.partition.clone(),
                    index: (index.build)(&entries),
                    proxy: ProxyKind::Rectangle,
                    cost: CostModel::lavapipe(),
                };
                let knobs = SceneryKnobs { tighten: true, treeless_items: true };
                let mut scenery = Scenery::new(setup, knobs);
                let mut history: Vec<()> = Vec::new();
                for frame in 0..world.scene.frames {
                    let state = FrameState::at(world, Moment { frame, view: 0 });
                    let view = state.view(world);
                    scenery.begin_frame(&view, &mut history);
                    if frame == 1 {
                        continue;
                    }
                    let more = nodes_carry_their_bounds(&scenery, &view, index.name);
                    counts.iter_mut().zip(more).for_each(|(all, more)| *all += more);
                }
            }
            counts
        })
        .collect();
    let [nodes, between, trees] =
        [0, 1, 2].map(|place| counts.iter().map(|counts| counts[place]).sum::<u32>());
    assert!(nodes > 10_000 && between > 1_000 && trees > 1_000, "{nodes} {between} {trees}");
}

/// Checks all nodes of both levels; how many there were, with how many of the scene's without objects of
/// their own, and of objects' trees.
fn nodes_carry_their_bounds(scenery: &Scenery, view: &View<'_>, index: &str) -> [u32; 3] {
    let mut counts = [0; 3];
    // What a box in clip space is made of shows in how it is written out.
    let same = |found: Option<ClipBox>, aabb: Option<Aabb>, matrix: &DMat4, error: &ClipError| {
        let expected = aabb.map(|aabb| ClipBox::new(&aabb, matrix, error, view.depth));
        format!("{found:?}") == format!("{expected:?}")
    };
    let mut noted = vec![[0.0; 4]; scenery.index().node_count() as usize];
    bound_below(scenery.index(), view, NodeId(0), &mut noted);
    let mut stack = vec![NodeId(0)];
    while let Some(node) = stack.pop() {
        let this = scenery.index().node(node);
        let before = stack.len();
        scenery.index().children(node, view.camera.eye, &mut stack);
        counts[0] += 1;
        counts[1] += u32::from(this.objects.is_empty() && stack.len() > before);
        let error = ClipError { bound: noted[node.0 as usize] };
        let found = scenery.clip_box(view, Item::Scene(node));
        assert!(
            same(found, this.tight_box.or(this.query_box), &view.clip_from_world, &error),
            "{index} {node:?}"
        );
        for &object in this.objects {
            let mesh = view.partition.mesh(object);
            let seen = &view.objects[object.0 as usize];
            let nodes = mesh.tree.as_ref().map_or(1, |tree| tree.nodes.len() as u32);
            for number in 0..nodes {
                counts[2] += u32::from(nodes > 1);
                let aabb = mesh
                    .tree
                    .as_ref()
                    .map_or(mesh.bounds, |tree| tree.nodes[number as usize].bounds);
                let found = scenery.clip_box(view, Item::Object(object, number));
                assert!(
                    same(found, Some(aabb), &seen.clip_from_object, &seen.error),
                    "{index} {object:?} {number}"
                );
            }
        }
    }
    counts
}

/// What is asked about a part is made of its own boxes and its object's bound, by every kind of proxy.
#[test]
fn questions_carry_the_bound_of_their_objects() {
    let asked: u32 = worlds(40)
        .par_iter()
        .map(|world| {
            let state = FrameState::at(world, Moment { frame: 2, view: 0 });
            let view = state.view(world);
            let kinds = [ProxyKind::Rectangle, ProxyKind::Hull, ProxyKind::Box];
            kinds.map(|kind| questions_are_sound(world, &view, kind)).into_iter().sum::<u32>()
        })
        .sum();
    assert!(asked > 10_000, "{asked}");
}

/// What there is to ask about a box of an object: `Err` says whether it is visible unasked.
fn expected(
    view: &View<'_>,
    object: ObjectId,
    aabb: &Aabb,
    kind: ProxyKind,
) -> Result<Proxy, bool> {
    let seen = &view.objects[object.0 as usize];
    let clip = ClipBox::new(aabb, &seen.clip_from_object, &seen.error, view.depth);
    let pixels = (view.viewport.width, view.viewport.height);
    let (rectangle, depth) = match clip.project(pixels.0, pixels.1) {
        Projection::Nowhere => return Err(false),
        Projection::Unbounded => return Err(true),
        Projection::Within { rectangle, depth } => (rectangle, depth),
    };
    let (min, max) = (rectangle.min, rectangle.max);
    let plain = Proxy::Rectangle { min, max, depth };
    match kind {
        ProxyKind::Rectangle => Ok(plain),
        ProxyKind::Hull => match clip.outline(pixels, (rectangle, depth)) {
            Outline::Nowhere => Err(false),
            Outline::Rectangle => Ok(plain),
            Outline::Within { hull, depth } => Ok(Proxy::Hull { hull, min, max, depth }),
        },
        ProxyKind::Box => {
            let matrix = &seen.clip_from_object;
            let grown = inflated_box(aabb, matrix, &seen.error, pixels, view.depth);
            Ok(grown.map_or(plain, |grown| Proxy::Box {
                clip_from_box: matrix.to_cols_array().map(|entry| entry as f32),
                min: grown.min.to_array().map(|c| c as f32),
                max: grown.max.to_array().map(|c| c as f32),
            }))
        }
    }
}

/// Checks the questions about every part of a frame; how many there are.
fn questions_are_sound(world: &World, view: &View<'_>, kind: ProxyKind) -> u32 {
    let setup = CullerSetup {
        partition: world.partition.clone(),
        index: (INDEXES[0].build)(&world.entries()),
        proxy: kind,
        cost: CostModel::lavapipe(),
    };
    let scenery = Scenery::new(setup, SceneryKnobs::default());
    let mut asked = 0;
    for object in (0..world.partition.object_count()).map(ObjectId) {
        let mesh = world.partition.mesh(object);
        let leaf = |node: &u32| scenery.is_part(Item::Object(object, *node));
        let nodes = mesh.tree.as_ref().map_or(1, |tree| tree.nodes.len() as u32);
        for node in (0..nodes).filter(leaf) {
            let item = Item::Object(object, node);
            let (aabb, part) = mesh.tree.as_ref().map_or((mesh.bounds, 0), |tree| {
                let node = &tree.nodes[node as usize];
                (node.bounds, node.first_part)
            });
            let own = expected(view, object, &aabb, kind);
            let proxy = match scenery.appearance(view, item) {
                Appearance::Nowhere => Err(false),
                Appearance::Certain => Err(true),
                Appearance::Ask { proxy, .. } => Ok(proxy),
            };
            assert_eq!(proxy, own, "{} {object:?} {node}", world.scene.name);
            let Ok(proxy) = proxy else { continue };
            for most in [1, 4, 16] {
                let mut found = Vec::new();
                scenery.tightest_proxies(view, item, (proxy, most), &mut found);
                let boxes = mesh.boxes_of(part);
                let each = boxes.len().div_ceil(most).next_power_of_two();
                let together: Vec<Aabb> = boxes
                    .chunks(each)
                    .map(|run| run.iter().fold(Aabb::EMPTY, |all, aabb| all.union(aabb)))
                    .collect();
                let each: Vec<_> =
                    together.iter().map(|aabb| expected(view, object, aabb, kind)).collect();
                let whole = each.contains(&Err(true));
                let parts: Vec<Proxy> = each.into_iter().flatten().collect();
                let expected = if whole { vec![proxy] } else { parts };
                assert_eq!(found, expected, "{} {object:?} {node} {most}", world.scene.name);
                assert!(found.len() <= most.max(1), "{} {object:?}", world.scene.name);
                asked += found.len() as u32;
            }
        }
    }
    asked
}
