//! Out of core: the books against a plain model of them, and every oracle with too little memory for
//! the scene against the same oracle with enough.

use std::collections::BTreeMap;
use std::sync::Arc;

use plainsight::cull::{CULLERS, CullerKind, ProxyKind};
use plainsight::index::INDEXES;
use plainsight::oracle::wgpu::{GpuStage, Hardware};
use plainsight::oracle::{
    DeviceLimits, FrameView, Memory, MemoryKnobs, Oracle, OracleError, Proxy, Questions, Residency,
    Sim, Stage, Step, least_budget, mesh_bytes,
};
use plainsight::part::{PartId, Partition, PartitionKnobs};
use plainsight::run::{FrameTrace, Trace, World};
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::{Effects, Mesh, Object, Placement, Viewport};
use proptest::prelude::*;
use proptest::test_runner::{Config, TestRunner};

use crate::common::{gate, gpu, world};

/// One object a mesh, one part each, of so many triangles within [0, 0.1]² at depth 0.5.
fn strips(triangles: &[usize]) -> Arc<Partition> {
    let mut scene = build("soup", &Knobs { scale: Some(0.001), ..Knobs::default() }).unwrap();
    scene.meshes.clear();
    scene.objects.clear();
    for (number, &count) in triangles.iter().enumerate() {
        let point = |i: usize| [i as f32 / count as f32 * 0.1, (i % 2) as f32 * 0.1, 0.5];
        let corners = |i: usize| [i, i + 1, i + 2].map(|corner| corner as u32);
        let points = (0..count + 2).map(point).collect();
        let mesh = Mesh::new("strip", points, (0..count).map(corners).collect()).unwrap();
        scene.meshes.push(Arc::new(mesh));
        scene.objects.push(Object { mesh: number as u32, placement: Placement::IDENTITY });
    }
    scene.effects = Effects::default();
    Arc::new(Partition::new(&scene, PartitionKnobs::default()))
}

/// Bytes of a strip: 16 a position, 12 a triangle.
fn strip_bytes(triangles: usize) -> u64 {
    (triangles as u64 + 2) * 16 + triangles as u64 * 12
}

/// The object moved to the right by `x`; outside the frustum beyond 1 and before −1.1.
fn at(x: f32) -> [f32; 16] {
    let mut matrix = [0.0; 16];
    [0, 5, 10, 15].into_iter().for_each(|i| matrix[i] = 1.0);
    matrix[12] = x;
    matrix
}

/// The books kept by hand: what is resident and when it was last used, in plain maps.
struct Model {
    bytes_of: Vec<u64>,
    budget: u64,
    /// Last use of each resident mesh.
    resident: BTreeMap<u32, u64>,
    clock: u64,
    counts: Memory,
}

impl Model {
    fn bytes(&self) -> u64 {
        self.resident.keys().map(|&mesh| self.bytes_of[mesh as usize]).sum()
    }

    fn carry_out(&mut self, steps: &[Step]) -> Result<(), TestCaseError> {
        for &step in steps {
            match step {
                Step::Evict(mesh) => {
                    prop_assert!(self.resident.remove(&mesh).is_some(), "evicts what is not there");
                    self.counts.evictions += 1;
                }
                Step::Load(mesh) => {
                    self.clock += 1;
                    prop_assert!(self.resident.insert(mesh, self.clock).is_none(), "loads twice");
                    prop_assert!(self.bytes() <= self.budget, "the budget is broken");
                    self.counts.most_bytes = self.counts.most_bytes.max(self.bytes());
                }
            }
        }
        Ok(())
    }

    /// A frame begins: nothing drawn in the last one goes, nothing goes and comes at once.
    fn begin(&mut self, steps: &[Step], drawn: &[u32], first: bool) -> Result<(), TestCaseError> {
        self.counts = Memory { most_bytes: self.bytes(), ..Memory::default() };
        self.carry_out(steps)?;
        if first {
            prop_assert!(self.resident.is_empty());
            self.counts = Memory::default();
            return Ok(());
        }
        let loads = |mesh| steps.contains(&Step::Load(mesh));
        for (mesh, &bytes) in (0..).zip(&self.bytes_of) {
            let evicted = steps.contains(&Step::Evict(mesh));
            prop_assert!(!evicted || !(drawn.contains(&mesh) || loads(mesh)), "churns");
            if loads(mesh) {
                self.counts.prefetches += 1;
                self.counts.prefetched_bytes += bytes;
            }
        }
        Ok(())
    }

    /// A draw: late where it was not there, and the least recently used goes first.
    fn need(&mut self, mesh: u32, steps: &[Step]) -> Result<bool, TestCaseError> {
        let late = !self.resident.contains_key(&mesh);
        prop_assert_eq!(!late, steps.is_empty());
        for &step in steps {
            if let Step::Evict(victim) = step {
                let oldest = self.resident.iter().min_by_key(|(_, used)| **used).unwrap().0;
                prop_assert_eq!(victim, *oldest, "not the least recently used");
                let fits = self.bytes() + self.bytes_of[mesh as usize] <= self.budget;
                prop_assert!(!fits, "evicts for nothing");
            }
            self.carry_out(&[step])?;
        }
        self.clock += 1;
        prop_assert!(self.resident.insert(mesh, self.clock).is_some(), "drawn and not there");
        if late {
            self.counts.late_loads += 1;
            self.counts.late_bytes += self.bytes_of[mesh as usize];
        }
        Ok(late)
    }
}

/// What a random run is made of: triangles a mesh, what the budget has beyond the largest, bytes
/// ahead a frame, and for each frame how far each object is moved and what is drawn.
type Stream = (Vec<usize>, u64, u64, Vec<(Vec<f32>, Vec<prop::sample::Index>)>);

fn streams() -> impl Strategy<Value = Stream> {
    let frame = |meshes: usize| {
        let steps = prop::collection::vec(-0.4_f32..0.4, meshes);
        (steps, prop::collection::vec(any::<prop::sample::Index>(), 0..24))
    };
    prop::collection::vec(1_usize..60, 1..16).prop_flat_map(move |sizes| {
        let frames = prop::collection::vec(frame(sizes.len()), 1..10);
        (Just(sizes), 0_u64..8_000, prop_oneof![Just(0_u64), 1_u64..6_000], frames)
    })
}

fn follow((sizes, beyond, ahead, frames): &Stream) -> Result<(), TestCaseError> {
    let partition = strips(sizes);
    let bytes_of: Vec<u64> = partition.meshes().iter().map(|mesh| mesh_bytes(mesh)).collect();
    prop_assert!(bytes_of.iter().zip(sizes).all(|(&bytes, &size)| bytes == strip_bytes(size)));
    let largest = least_budget(&partition);
    let knobs = MemoryKnobs { budget_bytes: largest + beyond, prefetch_bytes: *ahead };
    let (budget, resident) = (knobs.budget_bytes, BTreeMap::new());
    let mut model = Model { bytes_of, budget, resident, clock: 0, counts: Memory::default() };
    let mut books = Residency::new(&partition, knobs);
    let mut runs = Vec::new();
    // Frame 0 forgets everything: the second run repeats the first.
    for _ in 0..2 {
        let mut matrices: Vec<[f32; 16]> =
            (0..sizes.len()).map(|i| at(i as f32 * 0.3 - 2.0)).collect();
        let (mut all, mut drawn, mut used) = (Vec::new(), Vec::new(), 0);
        for (number, (moves, draws)) in (0_u32..).zip(frames) {
            matrices.iter_mut().zip(moves).for_each(|(matrix, by)| matrix[12] += by);
            let mut steps = Vec::new();
            let view = FrameView { frame: number, clip_from_object: &matrices };
            books.begin_frame(&view, &mut steps);
            model.begin(&steps, &drawn, number == 0)?;
            drawn.clear();
            for index in draws {
                let mesh = index.index(sizes.len()) as u32;
                let mut these = Vec::new();
                let late = books.need(mesh, &mut these);
                prop_assert_eq!(model.need(mesh, &these)?, late);
                prop_assert_eq!(books.bytes(), model.bytes());
                drawn.push(mesh);
            }
            let counts = books.counts();
            used += counts.prefetches_used;
            let known = Memory { prefetches_used: counts.prefetches_used, ..model.counts };
            prop_assert_eq!(counts, known);
            all.push(counts);
        }
        let sum = |of: fn(&Memory) -> u64| all.iter().map(of).sum::<u64>();
        prop_assert!(used <= sum(|m| m.prefetches));
        let ahead_bytes = sum(|m| m.prefetched_bytes);
        let most = if *ahead == 0 { 0 } else { ahead * all.len() as u64 + largest };
        prop_assert!(ahead_bytes <= most);
        runs.push(all);
    }
    prop_assert_eq!(&runs[0], &runs[1]);
    Ok(())
}

#[test]
fn random_streams_keep_the_books_and_the_budget() {
    let config = Config { cases: 512, failure_persistence: None, ..Config::default() };
    TestRunner::new(config).run(&streams(), |stream| follow(&stream)).unwrap();
}

/// Begins `frame` with objects at these places; what is carried out.
fn begin(books: &mut Residency, frame: u32, places: &[f32]) -> Vec<Step> {
    let matrices: Vec<[f32; 16]> = places.iter().map(|&x| at(x)).collect();
    let mut steps = Vec::new();
    books.begin_frame(&FrameView { frame, clip_from_object: &matrices }, &mut steps);
    steps
}

fn need(books: &mut Residency, mesh: u32) -> Vec<Step> {
    let mut steps = Vec::new();
    books.need(mesh, &mut steps);
    steps
}

#[test]
fn the_least_recently_used_goes_first() {
    let partition = strips(&[10; 4]);
    let budget_bytes = 3 * strip_bytes(10);
    let mut books = Residency::new(&partition, MemoryKnobs { budget_bytes, prefetch_bytes: 0 });
    begin(&mut books, 0, &[0.0; 4]);
    for mesh in [0, 1, 2, 0] {
        need(&mut books, mesh);
    }
    assert_eq!(need(&mut books, 3), [Step::Evict(1), Step::Load(3)]);
    assert_eq!(need(&mut books, 1), [Step::Evict(2), Step::Load(1)]);
    assert_eq!(need(&mut books, 3), []);
    assert_eq!(books.counts().late_loads, 5);
}

/// One that comes in at a steady pace is there when it is first drawn, and is told of once.
#[test]
fn what_comes_is_loaded_ahead_and_counts_as_used_when_drawn() {
    let partition = strips(&[10, 20]);
    let budget_bytes = strip_bytes(10) + strip_bytes(20);
    let mut books = Residency::new(&partition, MemoryKnobs { budget_bytes, prefetch_bytes: 1 });
    // The second is far to the right and comes nearer by a quarter a frame.
    assert_eq!(begin(&mut books, 0, &[0.0, 2.75]), []);
    assert_eq!(need(&mut books, 0), [Step::Load(0)]);
    assert_eq!(begin(&mut books, 1, &[0.0, 2.5]), [], "nothing is known of its pace");
    need(&mut books, 0);
    assert_eq!(begin(&mut books, 2, &[0.0, 2.25]), [Step::Load(1)], "inside in eight frames");
    need(&mut books, 0);
    let counts = books.counts();
    assert_eq!((counts.prefetches, counts.prefetched_bytes), (1, strip_bytes(20)));
    assert_eq!(counts.prefetches_used, 0);
    assert_eq!(need(&mut books, 1), []);
    assert_eq!(need(&mut books, 1), []);
    assert_eq!((books.counts().prefetches_used, books.counts().late_loads), (1, 0));
    assert_eq!(begin(&mut books, 3, &[0.0, 2.0]), []);
    need(&mut books, 1);
    assert_eq!(books.counts().prefetches_used, 0, "loaded ahead once, used once");
}

/// Hidden or not, what is before the eye stays; what leaves goes a frame after it was drawn last,
/// though there is memory for it.
#[test]
fn what_is_neither_drawn_nor_expected_goes() {
    let partition = strips(&[10; 3]);
    let knobs = MemoryKnobs { budget_bytes: 1 << 20, prefetch_bytes: 0 };
    let mut books = Residency::new(&partition, knobs);
    begin(&mut books, 0, &[0.0; 3]);
    (0..3).for_each(|mesh| drop(need(&mut books, mesh)));
    assert_eq!(begin(&mut books, 1, &[0.0, 9.0, 9.0]), []);
    need(&mut books, 2);
    // Standing still out of sight from here on: the second was not drawn, the third was.
    assert_eq!(begin(&mut books, 2, &[0.0, 9.0, 9.0]), [Step::Evict(1)]);
    assert_eq!(begin(&mut books, 3, &[0.0, 9.0, 9.0]), [Step::Evict(2)]);
    assert_eq!((books.counts().evictions, books.bytes()), (1, strip_bytes(10)));
    assert_eq!(books.counts().most_bytes, 2 * strip_bytes(10));
}

/// A mesh beyond a frame's share is loaded all the same, and the next frames load the less.
#[test]
fn loading_ahead_keeps_to_its_share() {
    let partition = strips(&[40; 4]);
    let knobs = MemoryKnobs { budget_bytes: 1 << 20, prefetch_bytes: strip_bytes(40) / 2 };
    let mut books = Residency::new(&partition, knobs);
    let loads = (0..9).map(|frame| begin(&mut books, frame, &[0.0; 4]).len());
    assert_eq!(loads.collect::<Vec<_>>(), [0, 1, 0, 1, 0, 1, 0, 1, 0]);
}

#[test]
fn a_budget_below_the_largest_mesh_is_refused() {
    let whole = world("bunnies", 1, 0.02, 1);
    let least = least_budget(&whole.partition);
    let knobs = |budget_bytes| MemoryKnobs { budget_bytes, prefetch_bytes: 0 };
    let refused = whole.within(knobs(least - 1)).err().unwrap();
    assert!(
        matches!(refused, OracleError::Budget { budget, least: l } if budget == least - 1 && l == least)
    );
    assert!(world("bunnies", 1, 0.02, 1).within(knobs(least)).is_ok());
}

#[test]
#[should_panic(expected = "every mesh must fit the budget")]
fn books_below_the_largest_mesh_are_not_opened() {
    let knobs = MemoryKnobs { budget_bytes: strip_bytes(9) - 1, prefetch_bytes: 0 };
    let _ = Residency::new(&strips(&[4, 9]), knobs);
}

/// Three quads behind one another, on devices that hold one: draws evict in the middle of a batch and
/// while the batch before it is on its way, and questions see what they should.
#[test]
fn an_eviction_in_the_middle_of_a_batch_moves_no_answer() {
    let partition = strips(&[3, 3, 3]);
    let viewport = Viewport { width: 64, height: 48 };
    let knobs = MemoryKnobs { budget_bytes: strip_bytes(3), prefetch_bytes: 0 };
    let stage = Stage { memory: Some(knobs), ..Stage::new(partition, viewport) };
    let device = GpuStage::new(gpu(), &stage).unwrap();
    let on_device = |questions| Box::new(Hardware::new(&device, questions).unwrap());
    let tiny = DeviceLimits { queries_per_pass: 1, scene_bytes: Some(0) };
    let oracles: Vec<Box<dyn Oracle>> = vec![
        Box::new(Sim::new(stage)),
        on_device(Questions::Queries),
        on_device(Questions::Pyramid),
        // Cut before every question too.
        Box::new(Hardware::with_limits(&device, Questions::Queries, tiny).unwrap()),
    ];
    let places = [at(-0.9), at(0.0), at(0.7)];
    let everywhere = Proxy::Rectangle { min: [0, 0], max: [64, 48], depth: 0.5_f32.next_up() };
    // Pixels that the first strip covers: x from −0.9 to −0.8, y from 0 to 0.1.
    let first = Proxy::Rectangle { min: [4, 23], max: [6, 24], depth: 0.9 };
    for mut oracle in oracles {
        for frame in 0..2 {
            oracle.begin_frame(&FrameView { frame, clip_from_object: &places }).unwrap();
            oracle.ask(&[first]);
            oracle.draw_part(PartId(0));
            oracle.ask(&[first]);
            oracle.ask(&[everywhere]);
            oracle.draw_part(PartId(1));
            let mut answers = Vec::new();
            oracle.collect(&mut answers).unwrap();
            assert!(answers.is_empty(), "{}: the batch has not ended", oracle.name());
            oracle.ask(&[first]);
            oracle.submit().unwrap();
            // On its way, and its mesh goes.
            oracle.draw_part(PartId(2));
            oracle.draw_part(PartId(0));
            oracle.ask(&[first]);
            oracle.collect(&mut answers).unwrap();
            assert_eq!(answers.len(), 4, "{}", oracle.name());
            oracle.submit().unwrap();
            oracle.collect(&mut answers).unwrap();
            let visible: Vec<bool> = answers.iter().map(|a| a.visible).collect();
            assert_eq!(visible, [true, false, true, false, false], "{}", oracle.name());
            assert!(answers.iter().map(|a| a.query.0).eq(0..5));
            let depth = oracle.read_back().unwrap().unwrap().depth;
            let covered = |column: usize| (0..48).any(|row| depth[row * 64 + column] == 0.5);
            assert!(covered(4) && covered(33) && covered(56) && !covered(20), "{}", oracle.name());
            let memory = oracle.memory().unwrap();
            assert_eq!(memory.most_bytes, strip_bytes(3));
            // The last frame drew the first strip last: it is there when the next begins.
            let (late, evictions) = if frame == 0 { (4, 3) } else { (3, 3) };
            assert_eq!((memory.late_loads, memory.evictions), (late, evictions), "{frame}");
        }
    }
}

fn whole_bytes(world: &World) -> u64 {
    world.partition.meshes().iter().map(|mesh| mesh_bytes(mesh)).sum()
}

/// The world on devices that hold a `share`th of it, or its largest mesh where that is more.
fn within(world: World, share: u64, prefetch_bytes: u64) -> World {
    let (whole, least) = (whole_bytes(&world), least_budget(&world.partition));
    let budget_bytes = (whole / share).max(least);
    assert!(share == 1 || budget_bytes < whole * 2 / 3, "{}: well under", world.scene.name);
    world.within(MemoryKnobs { budget_bytes, prefetch_bytes }).unwrap()
}

fn lane(world: &World, culler: CullerKind, oracle: &str) -> Trace {
    let (trace, gate) = gate(world, culler, INDEXES[0], oracle, ProxyKind::Rectangle);
    let name = format!("{} {} {oracle}", world.scene.name, culler.name);
    assert!(gate.held(), "{name}: {:?}", gate.failures());
    trace
}

fn culler(name: &str) -> CullerKind {
    *CULLERS.iter().find(|culler| culler.name == name).unwrap()
}

/// What a frame's culler did and left, without its memory.
fn deeds(trace: &Trace) -> Vec<[u64; 5]> {
    let of = |f: &FrameTrace| {
        [f.moment.frame.into(), f.drawn_parts.into(), f.events_hash, f.image_hash, f.truth_hash]
    };
    trace.frames.iter().map(of).collect()
}

/// Cullers that ask in one batch, in many, and not at all.
#[test]
fn too_little_memory_moves_no_draw_answer_or_image() {
    for scene in ["bunnies", "powerplant", "city", "rooms", "soup"] {
        let whole = world(scene, 3, 0.02, 4);
        let tight = within(world(scene, 3, 0.02, 4), 4, MemoryKnobs::PREFETCH_BYTES);
        let budget = tight.memory.unwrap().budget_bytes;
        for (name, oracles) in [
            ("full", &["sim", "hardware", "pyramid"][..]),
            ("chc++", &["sim", "hardware"]),
            ("draw-all", &["sim", "hardware"]),
        ] {
            let mut memory = Vec::new();
            for &oracle in oracles {
                let with = lane(&tight, culler(name), oracle);
                let without = lane(&whole, culler(name), oracle);
                assert_eq!(deeds(&with), deeds(&without), "{scene} {name} {oracle}");
                assert!(without.frames.iter().all(|frame| frame.memory.is_none()));
                memory.push(with.frames.iter().map(|f| f.memory.unwrap()).collect::<Vec<_>>());
            }
            assert!(memory.iter().all(|counts| *counts == memory[0]), "{scene} {name}");
            assert!(memory[0].iter().all(|m| m.most_bytes <= budget), "{scene} {name}");
            // In frame 0 every mesh that goes goes between two draws.
            let gone = memory[0][0].evictions;
            assert!(
                gone > 0 || name != "draw-all",
                "{scene}: nothing was thrown out in the middle"
            );
        }
    }
}

/// What it comes to on moving cameras, without and with loading ahead, on devices that hold the whole
/// and half of it: fewer draws wait.
#[test]
fn loading_ahead_lowers_late_loads() {
    let mut lines = Vec::new();
    for scene in ["powerplant", "city"] {
        for (name, share) in [("full", 1), ("vfc", 1), ("full", 2), ("vfc", 2)] {
            let late = [0, MemoryKnobs::PREFETCH_BYTES].map(|prefetch_bytes| {
                let world = within(world(scene, 3, 0.1, 24), share, prefetch_bytes);
                let trace = lane(&world, culler(name), "sim");
                let sum = |of: fn(Memory) -> u64| trace.sum(|frame| of(frame.memory.unwrap()));
                let [late, ahead, used, gone] = [
                    sum(|m| m.late_loads),
                    sum(|m| m.prefetches),
                    sum(|m| m.prefetches_used),
                    sum(|m| m.evictions),
                ];
                lines.push(format!(
                    "{scene:<10} {name:<4} 1/{share} {} MiB ahead a frame: late {late:>4}, ahead {ahead:>4}, used {used:>4}, thrown out {gone:>4}",
                    prefetch_bytes >> 20
                ));
                late
            });
            assert!(late[1] < late[0], "{scene} {name} {share}: {late:?}");
        }
    }
    insta::assert_snapshot!(lines.join("\n"));
}
