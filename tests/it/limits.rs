//! Limits of what a real device is sent at once: wherever a batch is cut, no answer moves, and no question
//! begins or ends where lavapipe's memory for a scene runs out.

use std::sync::Arc;

use plainsight::oracle::wgpu::{GpuStage, Hardware};
use plainsight::oracle::{
    Answer, DeviceLimits, FrameView, Oracle, Proxy, QUERIES_PER_PASS, Questions, ReadBack, Sim,
    Stage,
};
use plainsight::part::{PartId, Partition, PartitionKnobs};
use plainsight::run::FrameState;
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::{Effects, Mesh, Object, Placement, Stream, Viewport};

use crate::common::{gpu, world};

const IDENTITY: [f32; 16] =
    [1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
/// Nothing is cut for its bytes.
const UNCUT: DeviceLimits =
    DeviceLimits { queries_per_pass: QUERIES_PER_PASS, scene_bytes: Some(u64::MAX) };
/// Triangles of the dust in [`wall_and_dust`].
const DUST: u32 = 2000;

/// A wall before everything, part 0, and triangles of a few pixels each behind it, part 1.
fn wall_and_dust(viewport: Viewport) -> Stage {
    let mut scene = build("soup", &Knobs { scale: Some(0.001), ..Knobs::default() }).unwrap();
    let wall = [[-1.0, 1.0], [1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]].map(|[x, y]| [x, y, 0.5]);
    let wall = Mesh::new("wall", wall.to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
    let specks = (0..DUST).flat_map(|speck| {
        let x = (speck % 50) as f32 / 25.0 - 0.99;
        let y = (speck / 50) as f32 / 20.0 - 0.99;
        [[x, y, 0.9], [x + 0.005, y, 0.9], [x, y + 0.005, 0.9]]
    });
    let triangles = (0..DUST).map(|speck| [0, 1, 2].map(|corner| speck * 3 + corner));
    let dust = Mesh::new("dust", specks.collect(), triangles.collect()).unwrap();
    scene.meshes = vec![Arc::new(wall), Arc::new(dust)];
    scene.objects = (0..2).map(|mesh| Object { mesh, placement: Placement::IDENTITY }).collect();
    scene.effects = Effects::default();
    let knobs = PartitionKnobs { leaf_triangles: DUST, ..PartitionKnobs::default() };
    let partition = Arc::new(Partition::new(&scene, knobs));
    assert_eq!(partition.part_count(), 2, "dust is one draw");
    Stage::new(partition, viewport)
}

fn hardware(stage: &Arc<GpuStage>, limits: DeviceLimits) -> Hardware {
    Hardware::with_limits(stage, Questions::Queries, limits).unwrap()
}

fn begin(oracle: &mut dyn Oracle) {
    let matrices = [IDENTITY; 2];
    oracle.begin_frame(&FrameView { frame: 0, clip_from_object: &matrices }).unwrap();
}

/// A question about the whole picture, before the wall or behind it.
fn whole(viewport: Viewport, shows: bool) -> Proxy {
    let max = [viewport.width, viewport.height];
    Proxy::Rectangle { min: [0, 0], max, depth: if shows { 0.25 } else { 0.75 } }
}

/// What is sent, by events, and in how many submissions: `d` dust, `h` a hundred times dust, `q` a question.
#[test]
fn a_batch_is_cut_where_questions_would_share_too_much() {
    let viewport = Viewport { width: 320, height: 200 };
    let device = GpuStage::new(gpu(), &wall_and_dust(viewport)).unwrap();
    let limits = |scene_bytes| DeviceLimits { scene_bytes: Some(scene_bytes), ..UNCUT };
    // Of this picture's 20 tiles: a question takes under 100 kB, dust 480 to 520 kB.
    let cases = [
        ("dqqdq", u64::MAX, 1),
        ("dqqdq", 0, 5),
        ("dqqdq", 300_000, 4),
        ("dqqdq", 1_000_000, 2),
        ("dqqdq", 1_600_000, 1),
        ("dddddddd", 0, 1),
        ("hq", 18 << 20, 2),
        ("qh", 18 << 20, 2),
        ("qhq", 18 << 20, 3),
        ("hqqqqqdqqqq", 18 << 20, 2),
        ("dqdqdq", 18 << 20, 1),
        ("", 0, 1),
    ];
    for (events, bytes, submissions) in cases {
        let mut oracle = hardware(&device, limits(bytes));
        begin(&mut oracle);
        oracle.draw_part(PartId(0));
        let mut answers = Vec::new();
        oracle.submit().unwrap();
        oracle.collect(&mut answers).unwrap();
        let first = oracle.submissions();
        let mut expected = Vec::new();
        for event in events.chars() {
            match event {
                'd' => oracle.draw_part(PartId(1)),
                'h' => (0..100).for_each(|_| oracle.draw_part(PartId(1))),
                _ => {
                    let visible = expected.len() % 2 == 0;
                    let query = oracle.ask(&[whole(viewport, visible)]);
                    expected.push(Answer { query, visible });
                }
            }
            oracle.collect(&mut answers).unwrap();
            assert!(answers.is_empty(), "{events}: the batch has not ended");
        }
        oracle.submit().unwrap();
        assert_eq!(oracle.submissions() - first, submissions, "{events} within {bytes} bytes");
        oracle.collect(&mut answers).unwrap();
        assert_eq!(answers, expected, "{events} within {bytes} bytes");
    }
}

/// Only query objects are cut.
#[test]
fn what_asks_without_query_objects_is_sent_at_once() {
    let viewport = Viewport { width: 320, height: 200 };
    let device = GpuStage::new(gpu(), &wall_and_dust(viewport)).unwrap();
    let limits = DeviceLimits { queries_per_pass: 1, scene_bytes: Some(0) };
    let mut oracle = Hardware::with_limits(&device, Questions::Pyramid, limits).unwrap();
    begin(&mut oracle);
    oracle.draw_part(PartId(0));
    for _ in 0..4 {
        oracle.ask(&[whole(viewport, false)]);
    }
    oracle.submit().unwrap();
    assert_eq!(oracle.submissions(), 1);
}

/// Draws and questions of every kind in random order, several batches on their way at once.
fn asked(oracle: &mut dyn Oracle, world: &plainsight::run::World) -> (Vec<Answer>, ReadBack) {
    let state = FrameState::first(world);
    oracle.begin_frame(&FrameView { frame: 0, clip_from_object: &state.matrices }).unwrap();
    let mut stream = Stream::new(4, "limits");
    let Viewport { width, height } = world.scene.viewport;
    let parts = world.partition.part_count();
    let mut answers = Vec::new();
    // Something stands before most of the background from the start.
    (0..parts).step_by(2).for_each(|part| oracle.draw_part(PartId(part)));
    for event in 0..400 {
        let mut span = |side: u32| {
            let first = stream.below(side);
            // Small: a large one shows somewhere.
            (first, first + 1 + stream.below((side - first).min(6)))
        };
        let (x, y) = (span(width), span(height));
        let depth = (1.0 - stream.unit() * stream.unit() * 0.05) as f32;
        let rectangle = Proxy::Rectangle { min: [x.0, y.0], max: [x.1, y.1], depth };
        match stream.below(4) {
            0 => oracle.draw_part(PartId(stream.below(parts))),
            1 => {
                oracle.ask(&[rectangle, rectangle, rectangle]);
            }
            _ => {
                oracle.ask(&[rectangle]);
            }
        }
        if event % 90 == 89 {
            oracle.submit().unwrap();
        }
        if event % 150 == 149 {
            oracle.collect(&mut answers).unwrap();
        }
    }
    oracle.submit().unwrap();
    let mut had = usize::MAX;
    while had != answers.len() {
        had = answers.len();
        oracle.collect(&mut answers).unwrap();
    }
    (answers, oracle.read_back().unwrap().unwrap())
}

#[test]
fn no_limit_moves_an_answer() {
    let world = world("rooms", 3, 0.02, 1);
    let (answers, _) = asked(&mut Sim::new(world.stage()), &world);
    let shown = answers.iter().filter(|answer| answer.visible).count();
    assert!(answers.len() > 250 && (50..250).contains(&shown), "{shown} of {}", answers.len());
    let device = GpuStage::new(gpu(), &world.stage()).unwrap();
    let mut images: Vec<ReadBack> = Vec::new();
    for (queries_per_pass, scene_bytes) in [
        (QUERIES_PER_PASS, Some(u64::MAX)),
        (QUERIES_PER_PASS, None),
        (0, Some(0)),
        (1, Some(u64::MAX)),
        (usize::MAX, Some(300_000)),
        (7, Some(500_000)),
        (QUERIES_PER_PASS, Some(2_000_000)),
    ] {
        let limits = DeviceLimits { queries_per_pass, scene_bytes };
        let (theirs, image) = asked(&mut hardware(&device, limits), &world);
        assert_eq!(theirs, answers, "{limits:?}");
        images.push(image);
    }
    assert!(images.windows(2).all(|two| two[0] == two[1]), "all leave the same depth");
}

/// As `tests/driver/full_scene.rs`: so much dust before the questions that lavapipe's memory for a scene runs
/// out among them, each time a little earlier, if they are sent together.
#[test]
fn no_question_meets_a_full_scene() {
    let viewport = Viewport { width: 1280, height: 1024 };
    let device = GpuStage::new(gpu(), &wall_and_dust(viewport)).unwrap();
    let mut oracle = Hardware::new(&device, Questions::Queries).unwrap();
    for dust in DUST_DRAWS {
        begin(&mut oracle);
        oracle.draw_part(PartId(0));
        (0..dust).for_each(|_| oracle.draw_part(PartId(1)));
        let mut expected = Vec::new();
        for question in 0..64 {
            let visible = question % 2 == 0;
            let query = oracle.ask(&[whole(viewport, visible)]);
            expected.push(Answer { query, visible });
        }
        let mut answers = Vec::new();
        oracle.submit().unwrap();
        oracle.collect(&mut answers).unwrap();
        assert_eq!(answers, expected, "{dust} times dust");
    }
}

/// How often dust is drawn: with [`UNCUT`] limits some of these give wrong answers on Mesa 22.3.6.
const DUST_DRAWS: std::ops::Range<u32> = 84..100;
