//! Every index keeps its promises after every step, and hides nothing from a traversal.

use glam::DVec3;
use plainsight::cull::{CullerSetup, Item, ProxyKind, Scenery, SceneryKnobs};
use plainsight::index::{Entry, INDEXES, Index, Move, NodeId};
use plainsight::math::Aabb;
use plainsight::oracle::CostModel;
use plainsight::part::ObjectId;
use plainsight::run::{FrameState, Moment};
use plainsight::scene::Stream;

use crate::common::world;

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

#[test]
fn invariants_hold_after_every_step() {
    for kind in INDEXES {
        for (seed, count) in [(1, 0), (2, 1), (3, 2), (4, 50), (5, 300)] {
            let mut stream = Stream::new(seed, "boxes");
            let mut boxes: Vec<Aabb> = (0..count).map(|_| random_box(&mut stream, 20.0)).collect();
            let entry = |&bounds: &Aabb| Entry { bounds, step_bound: 1.0 };
            let entries: Vec<Entry> = boxes.iter().map(entry).collect();
            let mut index = (kind.build)(&entries);
            let all: Vec<ObjectId> = (0..count as u32).map(ObjectId).collect();
            for step in 0..30 {
                index
                    .check()
                    .unwrap_or_else(|broken| panic!("{} {seed} {step}: {broken}", kind.name));
                let eye = DVec3::splat(stream.range(-30.0, 30.0));
                assert_eq!(walk(index.as_ref(), &boxes, eye), all, "{} {seed} {step}", kind.name);
                let mut moves = Vec::new();
                for object in 0..count as u32 {
                    if stream.below(3) == 0 {
                        // Every fifth step leaves the space, and comes back.
                        let reach = if step % 5 == 4 { 60.0 } else { 20.0 };
                        boxes[object as usize] = random_box(&mut stream, reach);
                        let bounds = boxes[object as usize];
                        moves.push(Move { object: ObjectId(object), bounds, jumped: true });
                    }
                }
                index.update(&moves);
            }
        }
    }
}

#[test]
fn the_nearer_child_comes_first() {
    let at = |x: f64| Aabb::new(DVec3::new(x, 0.0, 0.0), DVec3::new(x + 1.0, 1.0, 1.0));
    let entries: Vec<Entry> =
        (0..8).map(|i| Entry { bounds: at(f64::from(i) * 2.0), step_bound: 0.0 }).collect();
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
        beside.update(&state.moves);
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
