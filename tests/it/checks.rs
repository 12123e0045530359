//! Each check by itself: what it counts, where it points, and that it stays silent where all is right. The
//! device is a fake one, so that what it gets wrong is known.

use std::sync::OnceLock;

use plainsight::check::{Gate, Verdict, judge};
use plainsight::cull::{CULLERS, Culler, Pen, View};
use plainsight::oracle::{
    Answer, FrameView, Oracle, OracleError, Proxy, QueryId, ReadBack, Sim, part_instance,
};
use plainsight::part::{PartId, PartitionKnobs};
use plainsight::run::{
    FrameState, FrameTrace, Lane, LaneInfo, Moment, Observer, Repeat, Repetition, Truth, World,
    fates_of_parts, run,
};
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::{Scene, Viewport};
use plainsight_reference::{Fate, Tolerance, fast};

const FRAMES: u32 = 3;
const VIEWPORT: Viewport = Viewport { width: 70, height: 41 };

fn scene() -> Scene {
    let (viewport, frames) = (Some(VIEWPORT), Some(FRAMES));
    let knobs = Knobs { scale: Some(0.03), frames, viewport, ..Knobs::default() };
    build("rooms", &knobs).unwrap()
}

fn world() -> World {
    World::new(scene(), PartitionKnobs::default())
}

/// Draws all parts but those of `leaves_out`, after one question about the whole screen.
struct Draws {
    leaves_out: fn(&[PartId]) -> Vec<PartId>,
    visible: Vec<Vec<PartId>>,
}

impl Draws {
    /// Over what shows in each frame of the scene, ascending.
    fn but(leaves_out: fn(&[PartId]) -> Vec<PartId>) -> Self {
        let world = world();
        let visible = (0..FRAMES).map(|frame| shows(&world, frame)).collect();
        Self { leaves_out, visible }
    }
}

fn shows(world: &World, frame: u32) -> Vec<PartId> {
    let truth = Truth::of(world, &FrameState::at(world, Moment { frame, view: 0 }));
    let parts = (0..world.partition.part_count()).map(PartId);
    parts.filter(|part| truth.visible_pixels[part.0 as usize] > 0).collect()
}

impl Culler for Draws {
    fn name(&self) -> &str {
        "draws"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let Viewport { width, height } = view.viewport;
        pen.ask(&Proxy::Rectangle { min: [0, 0], max: [width, height], depth: 0.0 });
        pen.round_trip(&mut Vec::new())?;
        let out = (self.leaves_out)(&self.visible[view.frame as usize]);
        let parts = (0..view.partition.part_count()).map(PartId);
        parts.filter(|part| !out.contains(part)).for_each(|part| pen.draw(part));
        Ok(())
    }
}

/// A device that draws as the reference does, but for what it is told.
struct Fake {
    sim: Sim,
    world: World,
    matrices: Vec<[f32; 16]>,
    flaws: Flaws,
}

/// What it gets wrong; nothing by default.
#[derive(Clone, Copy, Default)]
struct Flaws {
    /// Hands every answer over twice.
    twice: bool,
    /// A sample of its own image that has another depth.
    wrong: Option<usize>,
    /// What it declares.
    tolerance: Option<Tolerance>,
}

impl Oracle for Fake {
    fn name(&self) -> &'static str {
        "fake"
    }

    fn device(&self) -> Option<String> {
        Some("a fake".to_owned())
    }

    fn tolerance(&self) -> Tolerance {
        self.flaws.tolerance.unwrap_or(Tolerance::EXACT)
    }

    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError> {
        self.matrices = view.clip_from_object.to_vec();
        self.sim.begin_frame(view)
    }

    fn draw_part(&mut self, part: PartId) {
        self.sim.draw_part(part);
    }

    fn ask(&mut self, proxies: &[Proxy]) -> QueryId {
        self.sim.ask(proxies)
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        self.sim.submit()
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        let before = answers.len();
        self.sim.collect(answers)?;
        if self.flaws.twice {
            answers.extend_from_within(before..);
        }
        Ok(())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        let mut own = self.sim.read_back()?;
        if let (Some(own), Some(wrong)) = (&mut own, self.flaws.wrong) {
            own.depth[wrong] = own.depth[wrong].next_down();
        }
        Ok(own)
    }

    fn redraw(&mut self, parts: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        let partition = &self.world.partition;
        let instance = |&part: &PartId| part_instance(partition, part, &self.matrices);
        let mut image = self.world.image();
        let instances: Vec<_> = parts.iter().map(instance).collect();
        fast::render(&mut image, &instances, self.world.render);
        let part = |draw: Option<u32>| draw.map_or(0, |draw| partition.part_of_draw(draw).0 + 1);
        let parts = Some(image.draw_indices().map(part).collect());
        Ok(Some(ReadBack { depth: image.depths(), parts }))
    }
}

fn on_fake(flaws: Flaws, leaves_out: fn(&[PartId]) -> Vec<PartId>) -> Gate {
    before(Gate::default(), flaws, leaves_out)
}

fn before(mut gate: Gate, flaws: Flaws, leaves_out: fn(&[PartId]) -> Vec<PartId>) -> Gate {
    let world = world();
    let (sim, matrices) = (Sim::new(world.stage()), Vec::new());
    let oracle = Box::new(Fake { sim, world: self::world(), matrices, flaws });
    let info = LaneInfo::of("draws", oracle.as_ref(), String::new());
    let culler = Box::new(|| Box::new(Draws::but(leaves_out)) as Box<dyn Culler>);
    let lane = Lane { info, culler, oracle, observer: &mut gate, with_bound: false, audited: true };
    run(&world, FRAMES, Repeat::NONE, &mut [lane], &mut || true).unwrap();
    gate
}

fn nothing(_: &[PartId]) -> Vec<PartId> {
    Vec::new()
}

fn judged(leaves_out: fn(&[PartId]) -> Vec<PartId>) -> Verdict {
    judge(scene(), move |_| Box::new(Draws::but(leaves_out))).unwrap()
}

/// A miss has the part, its samples, and the first of them by row, then column.
#[test]
fn misses_point_at_the_first_pixel() {
    let verdict = judged(|visible| visible.to_vec());
    let world = world();
    let mut expected = Vec::new();
    for frame in 0..FRAMES {
        let moment = Moment { frame, view: 0 };
        let truth = Truth::of(&world, &FrameState::at(&world, moment));
        for part in shows(&world, frame) {
            let rows = (0..VIEWPORT.height).flat_map(|y| (0..VIEWPORT.width).map(move |x| [x, y]));
            let of = |&[x, y]: &[u32; 2]| {
                truth.part_at(&world, (y * VIEWPORT.width + x) as usize) == Some(part)
            };
            let places: Vec<[u32; 2]> = rows.filter(of).collect();
            expected.push((moment, part, places.len() as u32, places[0]));
        }
    }
    let misses = verdict.gate.conservative.misses().iter();
    let found: Vec<_> = misses.map(|m| (m.moment, m.part, m.pixels, m.first_pixel)).collect();
    assert_eq!(found, expected);
    assert!(expected.iter().any(|(.., [x, y])| *x > 0 && *y > 1), "places of all kinds");
    // Eight are named, the rest is counted, and the images differ as well.
    let lines = verdict.gate.failures();
    let named = lines.iter().filter(|line| line.starts_with("set: frame")).count();
    assert_eq!(named, 8);
    assert!(lines.contains(&format!("set: {} more misses", expected.len() - 8)), "{lines:?}");
    assert_eq!(verdict.gate.image.differences().len(), FRAMES as usize);
    assert_eq!(verdict.gate.first_failure(), Some(Moment { frame: 0, view: 0 }));
}

/// Exactly eight misses are all named, and none is "more".
#[test]
fn eight_misses_are_all_named() {
    let left = |count: usize, frame| shows(&world(), frame)[..count].to_vec();
    let out: Vec<Vec<PartId>> = [3, 3, 2].into_iter().zip(0..).map(|(n, f)| left(n, f)).collect();
    let draws = move || Draws { leaves_out: <[PartId]>::to_vec, visible: out.clone() };
    let verdict = judge(scene(), move |_| Box::new(draws())).unwrap();
    let lines = verdict.gate.failures();
    assert_eq!(lines.iter().filter(|line| line.starts_with("set: frame")).count(), 8);
    assert!(!lines.iter().any(|line| line.contains("more misses")), "{lines:?}");
    let words = verdict.to_string();
    assert!(words.starts_with("failed: draws on "), "{words}");
    assert!(words.contains(", 3 frames, drew ") && words.contains("set: frame"), "{words}");
}

/// Where all events were the same, what else was not is named.
#[test]
fn what_did_not_repeat_is_named() {
    let verdict = judged(nothing);
    let first = &verdict.trace.frames[0];
    let words = |change: fn(&mut FrameTrace)| {
        let (mut gate, mut again) = (Gate::default(), first.clone());
        change(&mut again);
        let (world, lane) = (world(), &verdict.trace.lane);
        let state = FrameState::first(&world);
        let (world, state, again) = (&world, &state, &again);
        gate.repeated(&Repetition { lane, world, state, first, again });
        (gate.determinism.first_event().to_owned(), gate.word())
    };
    assert_eq!(words(|_| {}), (String::new(), "held".to_owned()));
    let was_not =
        |what: &str| (format!("all events were the same, {what} was not"), "failed".to_owned());
    assert_eq!(words(|t| t.truth_hash ^= 1), was_not("the truth's image"));
    assert_eq!(words(|t| t.counts.round_trips += 1), was_not("the number of round trips"));
    // A picture is the device's.
    let device = (String::new(), "device not repeatable".to_owned());
    assert_eq!(words(|t| t.image_hash ^= 1), device);
}

#[test]
fn sums_are_those_of_the_frames() {
    let full = CULLERS[0];
    let verdict = judge(scene(), |setup| (full.make)(setup)).unwrap();
    assert!(verdict.gate.held());
    let (total, trace) = (verdict.gate.counts.total(), &verdict.trace);
    assert_eq!(total.queries, trace.sum(|f| f.counts.queries));
    assert_eq!(total.proxies, trace.sum(|f| f.counts.proxies));
    assert_eq!(total.pixels, trace.sum(|f| f.counts.pixels));
    assert_eq!(total.triangles, trace.sum(|f| f.counts.triangles));
    assert_eq!(total.visible_answers, trace.sum(|f| f.counts.visible_answers));
    assert_eq!(total.round_trips, trace.sum(|f| f.counts.round_trips));
    let least = [total.queries, total.visible_answers, total.round_trips, total.pixels];
    assert!(least.iter().all(|&sum| sum > 1), "{total:?}");
    let excess = verdict.gate.excess;
    assert_eq!(excess.drawn(), trace.sum(|f| u64::from(f.drawn_parts)));
    assert_eq!(excess.visible(), trace.sum(|f| u64::from(f.visible_parts)));
    assert!(excess.drawn() > excess.visible() && excess.visible() > 0);
    assert_eq!(verdict.gate.determinism.compared(), 2, "judge repeats two frames");
    assert_eq!(verdict.gate.determinism.first_difference(), None);
    assert_eq!(verdict.gate.device_image.equal(), None, "no device drew");
    assert_eq!(verdict.gate.first_failure(), None);
}

/// One answer to one question is right, two are not.
#[test]
fn more_answers_than_questions_are_told() {
    let right = on_fake(Flaws::default(), nothing);
    assert_eq!(right.counts.overcounted(), None);
    assert!(right.held(), "{:?}", right.failures());
    let wrong = on_fake(Flaws { twice: true, ..Flaws::default() }, nothing);
    assert_eq!(wrong.counts.overcounted(), Some(Moment { frame: 0, view: 0 }));
    assert_eq!(wrong.failures(), ["counts: frame 0 has more answers than questions"]);
}

/// The device's own image: equal, off by one bit at one sample, or without a part.
#[test]
fn a_devices_image_is_compared_to_the_bit() {
    let right = on_fake(Flaws::default(), nothing);
    assert_eq!(right.device_image.equal(), Some(true));
    let place = 17 * VIEWPORT.width + 23;
    let wrong = on_fake(Flaws { wrong: Some(place as usize), ..Flaws::default() }, nothing);
    assert_eq!(wrong.device_image.equal(), Some(false));
    let differences = wrong.device_image.differences();
    assert_eq!(differences.len(), FRAMES as usize);
    assert_eq!((differences[1].pixels, differences[1].first_pixel), (1, [23, 17]));
    assert_eq!(differences[1].moment, Moment { frame: 1, view: 0 });
    let lacks = on_fake(Flaws::default(), |visible| visible[..1].to_vec());
    assert_eq!(lacks.device_image.differences().len(), FRAMES as usize);
    let pixels: Vec<u32> = lacks.conservative.misses().iter().map(|miss| miss.pixels).collect();
    let differ = lacks.device_image.differences().iter().map(|d| d.pixels);
    assert_eq!(differ.collect::<Vec<_>>(), pixels, "where the part shows, nothing else does");
}

/// A part that shows and is missing for three frames is late by three: that is held where so many are
/// allowed, and a miss in the third frame where only two are.
#[test]
fn lateness_is_forgiven_up_to_what_is_declared() {
    fn throughout() -> PartId {
        static PART: OnceLock<PartId> = OnceLock::new();
        *PART.get_or_init(|| {
            let world = world();
            let every = |part: &&PartId| (0..FRAMES).all(|f| shows(&world, f).contains(*part));
            *shows(&world, 0).iter().find(every).expect("some part shows in every frame")
        })
    }
    let first = throughout();
    let missing =
        |allowed: u32| before(Gate::forgiving(allowed), Flaws::default(), |_| vec![throughout()]);
    let strict = missing(0);
    assert_eq!((strict.conservative.misses().len(), strict.word()), (3, "failed".to_owned()));
    // Pictures are compared where nothing may be late, and only there.
    assert_eq!(strict.image.differences().len(), FRAMES as usize);
    let two = missing(2);
    let misses = two.conservative.misses();
    assert_eq!((misses.len(), misses[0].moment.frame, misses[0].part), (1, 2, first));
    assert_eq!(two.word(), "failed");
    let three = missing(3);
    assert_eq!((three.conservative.latest(), three.word()), (3, "held late(3)".to_owned()));
    let all = before(Gate::forgiving(3), Flaws::default(), nothing);
    assert_eq!(all.word(), "held", "nothing was late");
}

/// On a device with a tolerance what must show and is missing is a miss, and what only may show is counted.
#[test]
fn what_only_may_show_is_counted_and_no_miss() {
    let tolerance = Tolerance { pixels: 0.2, ulps: 16, clipped_ulps: 16 };
    let world = world();
    let (mut must, mut may) = (Vec::new(), 0);
    for frame in 0..FRAMES {
        let state = FrameState::at(&world, Moment { frame, view: 0 });
        let fates = fates_of_parts(&world, &state, tolerance);
        for part in shows(&world, frame) {
            match fates.parts[part.0 as usize] {
                Fate::Must => must.push((frame, part)),
                Fate::May | Fate::Hidden => may += 1,
            }
        }
    }
    assert!(!must.is_empty() && may > 1, "{} must, {may} may", must.len());
    let flaws = Flaws { tolerance: Some(tolerance), ..Flaws::default() };
    let gate = on_fake(flaws, |visible| visible.to_vec());
    let misses = gate.conservative.misses().iter().map(|m| (m.moment.frame, m.part));
    assert_eq!(misses.collect::<Vec<_>>(), must);
    assert_eq!(gate.conservative.may_missed(), may);
    // The picture is held to what is decided at each sample.
    assert_eq!(gate.image.differences().len(), FRAMES as usize);
    assert!(on_fake(flaws, nothing).image.differences().is_empty());
}
