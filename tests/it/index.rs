//! Every index keeps its promises after every step, and hides nothing from a traversal.

use glam::DVec3;
use plainsight::cull::{CULLERS, CullerSetup, Item, ProxyKind, Scenery, SceneryKnobs};
use plainsight::index::{
    BspKnobs, Entry, GridKnobs, INDEXES, Index, IrregularOctree, LazyGrid, LooseKnobs, Moves,
    NodeId, RegularGrid, Split, TemporalVolumes, TreeKnobs, TwoLevelBsp, VolumeKnobs, Work,
    bounds_octree, extents_octree, loose_octree, octree, overlapping_octree, promises,
    radius_octree,
};
use plainsight::math::{Aabb, Volume};
use plainsight::oracle::CostModel;
use plainsight::part::ObjectId;
use plainsight::run::{FrameState, Moment};
use plainsight::scene::{Camera, DepthOrder, Lens, Stream, Viewport};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use crate::common::{gate, world};

fn random_box(stream: &mut Stream, reach: f64) -> Aabb {
    let mut point =
        |r: f64| DVec3::new(stream.range(-r, r), stream.range(-r, r), stream.range(-r, r));
    let (center, half) = (point(reach), point(2.0).abs());
    // Some boxes are flat, some are points.
    let half = if center.x > reach * 0.8 { half * DVec3::new(1.0, 0.0, 1.0) } else { half };
    let half = if center.y > reach * 0.9 { DVec3::ZERO } else { half };
    Aabb::new(center - half, center + half)
}

/// All objects in traversal order, each node's box checked to hold what hangs below it.
fn walk(index: &dyn Index, boxes: &[Aabb], eye: DVec3) -> Vec<ObjectId> {
    let mut found = Vec::new();
    let mut stack = vec![NodeId(0)];
    while let Some(node) = stack.pop() {
        let this = index.node(node);
        let mut children = Vec::new();
        let before = index.children(node, eye, &mut children);
        assert!(before <= children.len());
        if let Some(query_box) = this.query_box {
            for object in this.objects {
                assert!(query_box.contains(&boxes[object.0 as usize]), "{object:?} sticks out");
            }
            for child in &children {
                let inner = index.node(*child).query_box.expect("only the root can be left");
                assert!(query_box.contains(&inner));
            }
        }
        for child in &children {
            assert!(index.parent(*child) == Some(node));
        }
        found.extend_from_slice(this.objects);
        stack.extend(children);
    }
    assert_eq!(index.node(NodeId(0)).subtree_objects as usize, found.len());
    found.sort_unstable();
    found
}

/// Boxes that wander: some stand, some step, some turn, some jump now and then, and leave the space.
struct Wanderers {
    stream: Stream,
    boxes: Vec<Aabb>,
    entries: Vec<Entry>,
    moved: Vec<ObjectId>,
    jumped: Vec<ObjectId>,
}

/// The farthest that a wanderer steps, by its number.
fn step_of(object: usize) -> f64 {
    [0.0, 0.01, 0.3, 2.0][object % 4]
}

impl Wanderers {
    fn new(seed: u64, count: usize) -> Self {
        let mut stream = Stream::new(seed, "boxes");
        let boxes: Vec<Aabb> = (0..count).map(|_| random_box(&mut stream, 20.0)).collect();
        let entry = |(object, &bounds): (usize, &Aabb)| {
            // Every box may become a cube of its largest side.
            let reach = 2.0 * (1.0 + 1e-12);
            Entry { bounds, step_bound: step_of(object) * (1.0 + 1e-9), reach }
        };
        let entries = boxes.iter().enumerate().map(entry).collect();
        Self { stream, boxes, entries, moved: Vec::new(), jumped: Vec::new() }
    }

    fn step(&mut self) {
        self.moved.clear();
        self.jumped.clear();
        for object in 0..self.boxes.len() {
            let id = ObjectId(object as u32);
            let (step, this) = (step_of(object), &mut self.boxes[object]);
            let stream = &mut self.stream;
            if stream.below(40) == 0 {
                let reach = if stream.below(4) == 0 { 60.0 } else { 20.0 };
                *this = random_box(stream, reach);
                self.moved.push(id);
                self.jumped.push(id);
            } else if step > 0.0 && stream.below(3) > 0 {
                let mut any = |r: f64| stream.range(-r, r);
                // On the whole away from the middle, so that many leave the space.
                let by = DVec3::new(any(step), any(step), any(step)) / 3.0_f64.sqrt();
                let out = this.center() * 1e-3;
                let by = if out.length() + by.length() <= step { by + out } else { by };
                let half = (this.size() * 0.5 * stream.range(0.9, 1.1)).min(DVec3::splat(2.0));
                let center = this.center() + by;
                *this = Aabb::new(center - half, center + half);
                self.moved.push(id);
            }
        }
    }

    fn moves(&self) -> Moves<'_> {
        Moves { boxes: &self.boxes, moved: &self.moved, jumped: &self.jumped }
    }

    /// A camera anywhere, looking anywhere, with a limit of any distance.
    fn volume(&mut self) -> Volume {
        let stream = &mut self.stream;
        let mut point =
            |r: f64| DVec3::new(stream.range(-r, r), stream.range(-r, r), stream.range(-r, r));
        let (eye, target) = (point(30.0), point(20.0));
        let far = stream.range(5.0, 60.0);
        let camera = Camera {
            eye,
            forward: (target - eye).normalize(),
            lens: Lens::perspective(stream.range(0.3, 1.8)),
            near: 0.1,
            far,
        };
        let order = [DepthOrder::Forward, DepthOrder::Reversed][stream.below(2) as usize];
        Volume::new(&camera.clip_from_world(Viewport { width: 400, height: 300 }, order), order)
    }
}

/// What an index did over a crowd.
#[derive(Default)]
struct Deeds {
    found: usize,
    exact: usize,
    work: Work,
}

/// Every structural promise after every step; every object once in a walk, inside its nodes' boxes; and
/// what is found is what a look at every box finds, or more.
fn exercise(
    name: &str,
    build: &dyn Fn(&[Entry]) -> Box<dyn Index>,
    crowd: &mut Wanderers,
    steps: u32,
) -> Deeds {
    let mut index = build(&crowd.entries);
    let all: Vec<ObjectId> = (0..crowd.boxes.len() as u32).map(ObjectId).collect();
    let mut deeds = Deeds::default();
    for step in 0..steps {
        let at = format!("{name} step {step}");
        let check = |index: &dyn Index, boxes: &[Aabb]| {
            index.check(boxes).unwrap_or_else(|broken| panic!("{at}: {broken}"));
            promises(index, boxes).unwrap_or_else(|broken| panic!("{at}: {broken}"));
        };
        check(index.as_ref(), &crowd.boxes);
        let volume = crowd.volume();
        let (mut found, mut exact) = (Vec::new(), Vec::new());
        if step % 3 == 0 {
            index.refine(&crowd.boxes, &volume);
            check(index.as_ref(), &crowd.boxes);
        }
        index.find(&crowd.boxes, &volume, &mut found);
        check(index.as_ref(), &crowd.boxes);
        exact.extend(all.iter().filter(|o| volume.touches(&crowd.boxes[o.0 as usize])));
        found.sort_unstable();
        assert!(found.is_sorted_by(|a, b| a < b), "{at}: found twice");
        let missed = exact.iter().find(|id| found.binary_search(id).is_err());
        assert_eq!(missed, None, "{at}");
        deeds.found += found.len();
        deeds.exact += exact.len();
        let eye = DVec3::splat(crowd.stream.range(-30.0, 30.0));
        assert_eq!(walk(index.as_ref(), &crowd.boxes, eye), all, "{at}");
        crowd.step();
        index.update(crowd.moves());
    }
    deeds.work = index.work();
    deeds
}

#[test]
fn invariants_hold_after_every_step() {
    let mut lines = String::new();
    for kind in INDEXES {
        let mut all = Deeds::default();
        for (seed, count) in [(1, 0), (2, 1), (3, 2), (4, 50), (5, 300)] {
            let name = format!("{} seed {seed}", kind.name);
            let these = exercise(&name, &kind.build, &mut Wanderers::new(seed, count), 60);
            all.found += these.found;
            all.exact += these.exact;
            all.work = all.work + these.work;
        }
        assert!(all.exact > 4000, "{}: {} in sight", kind.name, all.exact);
        let Work { ok, updates, steps, node_checks, object_checks, lowered } = all.work;
        lines += &format!(
            "{:<22} {:>6} {ok:>6} {updates:>6} {steps:>7} {node_checks:>7} {object_checks:>6} {lowered:>6}\n",
            kind.name, all.found
        );
    }
    let head = "index                   found     ok  moved    steps    nodes objects lowered\n";
    insta::assert_snapshot!("index_work", format!("{head}{lines}"));
}

/// An index by its place in the family of those that take knobs.
fn with_knobs(
    place: usize,
    (knobs, loose, grid, volumes): (TreeKnobs, LooseKnobs, GridKnobs, VolumeKnobs),
    entries: &[Entry],
) -> Box<dyn Index> {
    match place {
        0 => octree(entries, knobs),
        1 => overlapping_octree(entries, knobs),
        2 => bounds_octree(entries, knobs),
        3 => extents_octree(entries, knobs),
        4 => radius_octree(entries, knobs),
        5 => loose_octree(entries, knobs, loose),
        6 => Box::new(IrregularOctree::new(entries, knobs)),
        7 => Box::new(LazyGrid::new(entries, grid)),
        8 => Box::new(RegularGrid::new(entries, grid)),
        _ => Box::new(TemporalVolumes::new("volumes", volumes, entries, |held| {
            with_knobs(place % 9, (knobs, loose, grid, volumes), held)
        })),
    }
}

/// The same with any knobs: depths, divisors, buckets, reductions, checklists, leaves by boxes, other node
/// sizes, and each of them over temporal bounding volumes.
#[test]
fn any_knobs_hold() {
    let mut runner =
        TestRunner::new(Config { cases: 240, failure_persistence: None, ..Config::default() });
    let size = prop::sample::select(vec![0.5, 1.0, 2.0, 6.0, f64::INFINITY]);
    // Both ends of each range as often as all that is between them.
    let depth = prop_oneof![0..9_u8, Just(0), Just(TreeKnobs::DEEPEST)];
    let capacity = prop_oneof![1..20_u32, Just(1), Just(u32::MAX)];
    let start = prop_oneof![0..6_u8, Just(0), Just(TreeKnobs::DEEPEST)];
    let ahead = prop_oneof![3..300_u32, Just(3)];
    let tree =
        (any::<bool>(), depth, size, capacity, start.clone(), start, ahead, any::<[bool; 2]>());
    let loose = (prop::sample::select(vec![0.01, 0.1, 0.5, 0.75, 1.0]), any::<bool>());
    let per_cell = prop_oneof![0.5..40.0_f64, Just(0.25), Just(1e9)];
    let lives = (prop_oneof![1..8_u16, Just(1)], prop_oneof![1..9_u16, Just(1), Just(64)]);
    let count = prop_oneof![0..120_usize, Just(0), Just(1)];
    let all = (0..18_usize, any::<u64>(), count, tree, loose, (per_cell, lives));
    runner
        .run(&all, |(place, seed, count, tree, (shrink, largest), (per_cell, lives))| {
            let (flat, max_depth, size_divisor, capacity, start_depth, depth_reduction, ahead, on) =
                tree;
            let [checklists, leaf_boxes] = on;
            let knobs = TreeKnobs {
                split: if flat { Split::Quadrants } else { Split::Octants },
                max_depth,
                size_divisor,
                capacity,
                start_depth,
                depth_reduction,
                checklists,
                ahead,
                leaf_boxes,
            };
            let (shortest, times) = lives;
            let volumes = VolumeKnobs { shortest, longest: shortest * times };
            let (loose, grid) = (LooseKnobs { shrink, largest }, GridKnobs { per_cell, ahead });
            let all = (knobs, loose, grid, volumes);
            let build = |entries: &[Entry]| with_knobs(place, all, entries);
            let name = format!("{place} {all:?}");
            exercise(&name, &build, &mut Wanderers::new(seed, count), 24);
            Ok(())
        })
        .unwrap();
}

/// The scene tree holds by any of its knobs.
#[test]
fn any_knobs_of_the_scene_tree_hold() {
    for (leaf_objects, period, worth, tighten_after) in
        [(1, 1, 1, 0), (1, 1, 1, 1), (2, 2, 1, 0), (8, 3, 2, 4), (u32::MAX, 1, 1, 2)]
    {
        let knobs = BspKnobs {
            leaf_objects,
            reconstruction_period: period,
            worth_reconstruction: worth,
            tighten_after,
        };
        let build =
            |entries: &[Entry]| -> Box<dyn Index> { Box::new(TwoLevelBsp::with(entries, knobs)) };
        for (seed, count) in [(7, 0), (8, 1), (9, 60), (10, 200)] {
            let name = format!("{knobs:?} seed {seed}");
            exercise(&name, &build, &mut Wanderers::new(seed, count), 40);
        }
    }
}

/// The scenes of Wortel 2011 with occlusion: nothing in plain sight is culled over any index.
#[test]
fn cullers_hold_over_crowds() {
    for (scene, scale) in [("city250k", 0.006), ("spheres200k", 0.004)] {
        let world = world(scene, 1, scale, 6);
        let culler = *CULLERS.iter().find(|culler| culler.name == "full").unwrap();
        for &index in INDEXES {
            let device = ["lazy-grid", "loose-quadtree-lazy"].contains(&index.name);
            for oracle in if device { &["sim", "hardware"][..] } else { &["sim"] } {
                let (_, gate) = gate(&world, culler, index, oracle, ProxyKind::Rectangle);
                let name = format!("{scene} {} {oracle}", index.name);
                assert!(gate.held(), "{name}: {:?}", gate.failures());
                assert!(gate.excess.visible() > 0, "{name}: nothing to see");
            }
        }
    }
}

/// Bounds that a scene gives of its objects' steps and sides hold in every frame.
#[test]
fn bounds_on_steps_and_sides_hold() {
    let mut moves = 0;
    for (name, scale) in [
        ("city", 0.2),
        ("bunnies", 0.1),
        ("hard/teleports", 1.0),
        ("swarm", 1.0),
        ("city250k", 0.003),
        ("spheres200k", 0.002),
    ] {
        for seed in 1..4 {
            let world = world(name, seed, scale, 80);
            let entries = world.entries();
            let mut before: Option<FrameState> = None;
            for frame in 0..80 {
                let state = FrameState::at(&world, Moment { frame, view: 0 });
                for (id, (bounds, entry)) in state.boxes.iter().zip(&entries).enumerate() {
                    if bounds.is_empty() {
                        continue;
                    }
                    let at = format!("{name} seed {seed} frame {frame} object {id}");
                    assert!(bounds.size().max_element() * 0.5 <= entry.reach, "{at}");
                    let id = ObjectId(id as u32);
                    if let Some(before) = &before
                        && !state.jumped.contains(&id)
                    {
                        let was = before.boxes[id.0 as usize].center();
                        assert!(was.distance(bounds.center()) <= entry.step_bound, "{at}");
                        assert!(state.moved.contains(&id) || was == bounds.center(), "{at}");
                        moves += u32::from(was != bounds.center());
                    }
                }
                before = Some(state);
            }
        }
    }
    assert!(moves > 1000, "{moves}");
}

#[test]
fn the_nearer_child_comes_first() {
    let at = |x: f64| Aabb::new(DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.0, 1.0, 1.0));
    let entries: Vec<Entry> = (0..8)
        .map(|i| Entry { bounds: at(f64::from(i) * 2.0), step_bound: 0.0, reach: 1.0 })
        .collect();
    let index = (INDEXES[0].build)(&entries);
    for eye in [DVec3::new(-5.0, 0.0, 0.0), DVec3::new(50.0, 0.0, 0.0)] {
        let mut children = Vec::new();
        assert_eq!(index.children(NodeId(0), eye, &mut children), 1);
        let distance =
            |node: NodeId| (index.node(node).query_box.unwrap().center().x - eye.x).abs();
        assert!(distance(children[0]) < distance(children[1]));
    }
}

/// Whether an object below `node` was visible in the frame before, by `history`.
fn any_below(index: &dyn Index, node: NodeId, visible: &dyn Fn(ObjectId) -> bool) -> bool {
    let mut children = Vec::new();
    index.children(node, DVec3::ZERO, &mut children);
    index.node(node).objects.iter().any(|&object| visible(object))
        || children.into_iter().any(|child| any_below(index, child, visible))
}

/// What a culler knows of the objects is not lost when the index builds a subtree anew.
#[test]
fn rebuilt_nodes_inherit_what_was_visible() {
    let world = world("bunnies", 1, 0.3, 40);
    let entries = world.entries();
    // Both go the same way, so the one tells what the other did.
    let build = || (INDEXES[0].build)(&entries);
    let (mut beside, index) = (build(), build());
    let (partition, proxy, cost) =
        (world.partition.clone(), ProxyKind::Rectangle, CostModel::lavapipe());
    let setup = CullerSetup { partition, index, proxy, cost };
    let mut scenery = Scenery::new(setup, SceneryKnobs::default());
    let mut visible_after: Vec<u32> = Vec::new();
    let (mut inherited, mut forgotten) = (0, 0);
    for t in 0..40 {
        let state = FrameState::at(&world, Moment { frame: t, view: 0 });
        scenery.begin_frame(&state.view(&world), &mut visible_after);
        beside.update(state.moves());
        let of = |item| visible_after[scenery.slot(item)];
        for &node in beside.rebuilt() {
            let visible = |object| of(Item::Object(object, 0)) == t;
            let expected = any_below(beside.as_ref(), node, &visible);
            assert_eq!(of(Item::Scene(node)) == t, expected, "frame {t} {node:?}");
            inherited += u32::from(expected);
            forgotten += u32::from(!expected);
        }
        // Every third object is visible, others from frame to frame.
        for object in (0..entries.len() as u32).filter(|object| (object + t) % 3 == 0) {
            visible_after[scenery.slot(Item::Object(ObjectId(object), 0))] = t + 1;
        }
    }
    assert!(inherited > 20 && forgotten > 20, "{inherited} {forgotten}");
}
