//! Measures what a device takes for designed work, so that a cost model can be fitted to it: frames of
//! a scene with random subsets of its parts, cut into random batches, and random questions between
//! them. The work is a function of (scene, seed) alone; only its times are the machine's. It must not
//! know how prices are fitted, and no run sees its times but through a saved calibration file.
//!
//! The design. Prices can be told apart only where the amounts do not go together, so each is drawn on
//! its own and over its decades: the share of the parts, whether small or large ones, how many
//! questions, proxies in one, samples under them, round trips. Parts come from those in the frustum,
//! in the order in which a culler would draw them: one behind the eye costs less than the model means.
//! A part's own price is small beside its triangles', so whoever measures should have the scene in
//! large parts and in small ones. Every workload is run once in each round, so that a slow drift of the machine meets all alike, and
//! counts with the median over the rounds.

use std::time::Instant;

use super::{FrameState, Moment, RunError, World};
use crate::cull::{Culler, CullerSetup, Finished, Pen, ProxyKind, ViewFrustum};
use crate::index::INDEXES;
use crate::oracle::{
    Always, Answer, CostModel, FrameView, Measurement, Oracle, OracleError, Proxy,
};
use crate::part::PartId;
use crate::scene::{Scene, Stream};

/// How much is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CalibrationKnobs {
    /// Different workloads; fewer than [`CalibrationKnobs::LEAST_WORKLOADS`] do not tell seven prices
    /// apart.
    pub workloads: u32,
    /// How often each is measured, at least 1; the median counts.
    pub rounds: u32,
}

impl CalibrationKnobs {
    /// Two of each kind, which are more than there are prices.
    pub const LEAST_WORKLOADS: u32 = 2 * KINDS.len() as u32;
}

impl Default for CalibrationKnobs {
    /// About twenty measurements a price; a round too many is cheap beside one disturbed.
    fn default() -> Self {
        Self { workloads: 144, rounds: 5 }
    }
}

/// Most frames of the scene that the workloads are spread over.
const MOST_FRAMES: u32 = 8;
/// Least share of the parts in view that a workload draws.
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Most questions of a workload: as many as `full` puts in one batch.
const MOST_QUESTIONS: f64 = 1024.0;
/// Most round trips of a workload: `chc` at full size makes some dozens.
const MOST_TRIPS: f64 = 64.0;
/// Most proxies in one question: as many as `full` asks about together.
const MOST_PROXIES: u32 = 16;
/// Fewest samples under all rectangles of a workload.
const LEAST_PIXELS: f64 = 256.0;
/// Most samples under all rectangles of a workload, in viewports.
const MOST_VIEWPORTS: f64 = 8.0;
/// Rectangles are no longer than this times their width, nor wider than this times their length.
const MOST_ASPECT: f64 = 4.0;
/// Depths of rectangles are from 1 down by this: perspective crowds what is drawn there, so that both
/// answers come back.
const DEPTH_RANGE: f64 = 0.1;

/// What a workload has of questions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Neither parts nor questions.
    Nothing,
    /// Parts alone.
    Parts,
    /// Parts, and all questions in one round trip.
    OneTrip,
    /// Parts, and some questions in each of many round trips.
    ManyTrips,
    /// Any of it.
    Mixed,
}

/// The kinds in turn; those that tell the most prices apart more often.
const KINDS: [Kind; 8] = [
    Kind::Nothing,
    Kind::Parts,
    Kind::OneTrip,
    Kind::ManyTrips,
    Kind::Mixed,
    Kind::Parts,
    Kind::OneTrip,
    Kind::Mixed,
];

/// One thing to do.
#[derive(Clone, Debug, PartialEq)]
enum Step {
    Draw(PartId),
    Ask(Vec<Proxy>),
    RoundTrip,
}

/// A frame's work, ready to be measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Workload {
    /// Which frame of the scene.
    pub frame: u32,
    steps: Vec<Step>,
}

/// The workloads of a scene, a pure function of it, its seed, their number and the name of the stream
/// that they are drawn from.
///
/// # Panics
/// For a scene without frames.
#[must_use]
pub fn workloads(world: &World, stream: &str, count: u32) -> Vec<Workload> {
    assert!(world.scene.frames > 0, "a scene has frames");
    let views = parts_in_view(world);
    let mut stream = Stream::new(world.scene.seed, stream);
    let kinds = KINDS.iter().cycle().take(count as usize);
    let make = |&kind: &Kind| {
        let (frame, parts) = &views[stream.below(views.len() as u32) as usize];
        let parts = subset(&mut stream, kind, world, parts);
        let questions = questions(&mut stream, kind, &world.scene);
        Workload { frame: *frame, steps: steps(&mut stream, parts, questions) }
    };
    kinds.map(make).collect()
}

/// Some frames of the scene, and the parts in their frusta from front to back.
fn parts_in_view(world: &World) -> Vec<(u32, Vec<PartId>)> {
    let frames = world.scene.frames;
    let count = frames.min(MOST_FRAMES);
    let chosen: Vec<u32> =
        (0..count).map(|i| (u64::from(i) * u64::from(frames) / u64::from(count)) as u32).collect();
    let mut culler = ViewFrustum::new(CullerSetup {
        partition: world.partition.clone(),
        index: (INDEXES[0].build)(&world.entries()),
        proxy: ProxyKind::Rectangle,
        cost: CostModel::lavapipe(),
    });
    let mut oracle = Always::default();
    let mut views = Vec::new();
    // An index follows the objects, so it sees the frames between as well.
    for t in 0..=chosen[chosen.len() - 1] {
        let state = FrameState::at(world, Moment { frame: t, view: 0 });
        let mut pen = Pen::new(&mut oracle, &world.partition);
        let drawn = culler.frame(&state.view(world), &mut pen).and_then(|()| pen.finish());
        let parts = drawn.expect("this oracle never fails").drawn;
        if chosen.contains(&t) {
            views.push((t, parts));
        }
    }
    views
}

/// From `least` to `most`, each decade alike.
fn scattered(stream: &mut Stream, least: f64, most: f64) -> f64 {
    libm::exp(stream.range(libm::log(least), libm::log(most)))
}

/// A random share of the parts in view, in their order: of all, of the smaller half or of the larger; at
/// least one where the workload is of parts alone.
fn subset(stream: &mut Stream, kind: Kind, world: &World, parts: &[PartId]) -> Vec<PartId> {
    if kind == Kind::Nothing || parts.is_empty() {
        return Vec::new();
    }
    let triangles = |part: PartId| world.partition.part(part).triangle_count;
    let mut sizes: Vec<u32> = parts.iter().map(|&part| triangles(part)).collect();
    sizes.sort_unstable();
    let middle = sizes[sizes.len() / 2];
    let (share, half) = (scattered(stream, LEAST_SHARE, 1.0), stream.below(3));
    let mut taken = |part: &PartId| {
        let in_half = match half {
            0 => triangles(*part) <= middle,
            1 => triangles(*part) >= middle,
            _ => true,
        };
        stream.unit() < share && in_half
    };
    let mut subset: Vec<PartId> = parts.iter().copied().filter(|part| taken(part)).collect();
    if subset.is_empty() && kind == Kind::Parts {
        subset.push(parts[stream.below(parts.len() as u32) as usize]);
    }
    subset
}

/// The questions of each round trip; a trip has at least one, as no culler waits for nothing.
fn questions(stream: &mut Stream, kind: Kind, scene: &Scene) -> Vec<Vec<Vec<Proxy>>> {
    let mut up_to = |most: f64| scattered(stream, 1.0, most) as usize;
    let (count, trips) = match kind {
        Kind::Nothing | Kind::Parts => return Vec::new(),
        Kind::OneTrip => (up_to(MOST_QUESTIONS), 1),
        Kind::ManyTrips => (up_to(MOST_QUESTIONS), up_to(MOST_TRIPS)),
        Kind::Mixed => (up_to(MOST_QUESTIONS), up_to(MOST_TRIPS / 4.0)),
    };
    let most = if stream.below(2) == 0 { 1 } else { MOST_PROXIES };
    let proxies: Vec<u32> = (0..count.max(trips)).map(|_| 1 + stream.below(most)).collect();
    let viewport = scene.viewport;
    let viewports = MOST_VIEWPORTS * f64::from(viewport.width) * f64::from(viewport.height);
    let pixels = scattered(stream, LEAST_PIXELS, viewports.max(LEAST_PIXELS));
    let each = pixels / f64::from(proxies.iter().sum::<u32>());
    let mut asked = vec![Vec::new(); trips];
    for (number, count) in proxies.into_iter().enumerate() {
        let question = (0..count).map(|_| rectangle(stream, each, scene)).collect();
        let trip = if number < trips { number } else { stream.below(trips as u32) as usize };
        asked[trip].push(question);
    }
    asked
}

/// A rectangle of about so many samples, at least one, somewhere in the viewport.
fn rectangle(stream: &mut Stream, pixels: f64, scene: &Scene) -> Proxy {
    let (viewport, [_, far]) = (scene.viewport, scene.depth.range());
    let pixels = pixels * stream.range(0.5, 1.5);
    let aspect = scattered(stream, 1.0 / MOST_ASPECT, MOST_ASPECT);
    let mut span = |side: f64, most: u32| {
        let side = side.round().clamp(1.0, f64::from(most)) as u32;
        let first = stream.below(most - side + 1);
        (first, first + side)
    };
    let (x, y) = (
        span((pixels * aspect).sqrt(), viewport.width),
        span((pixels / aspect).sqrt(), viewport.height),
    );
    let depth = (f64::from(far) - DEPTH_RANGE * stream.unit() * stream.unit()) as f32;
    Proxy::Rectangle { min: [x.0, y.0], max: [x.1, y.1], depth }
}

/// The parts cut into batches of random size, one before each round trip's questions and one at the
/// end.
fn steps(stream: &mut Stream, parts: Vec<PartId>, trips: Vec<Vec<Vec<Proxy>>>) -> Vec<Step> {
    let mut cuts: Vec<usize> =
        trips.iter().map(|_| stream.below(parts.len() as u32 + 1) as usize).collect();
    cuts.sort_unstable();
    let (mut steps, mut drawn) = (Vec::new(), 0);
    for (cut, questions) in cuts.into_iter().zip(trips) {
        steps.extend(parts[drawn..cut].iter().map(|&part| Step::Draw(part)));
        drawn = cut;
        steps.extend(questions.into_iter().map(Step::Ask));
        steps.push(Step::RoundTrip);
    }
    steps.extend(parts[drawn..].iter().map(|&part| Step::Draw(part)));
    steps
}

/// Workloads with the world they are of and an oracle over it.
pub struct Bench<'a> {
    /// The world.
    pub world: &'a World,
    /// An oracle over its stage.
    pub oracle: Box<dyn Oracle + 'a>,
    /// What to do, made by [`workloads`] of this world.
    pub works: Vec<Workload>,
}

/// How many frames [`measure`] runs.
#[must_use]
pub fn frames_to_measure(benches: &[Bench<'_>], rounds: u32) -> u64 {
    let warming = |bench: &Bench<'_>| bench.works.len().min(KINDS.len());
    let of = |bench| warming(bench) + bench.works.len() * rounds as usize;
    benches.iter().map(of).sum::<usize>() as u64
}

/// Runs every workload and takes the median of its times over `rounds`; the measurements stand in the
/// order of `benches` and their works. One of each kind is run before that: the first frames of a
/// device compile its shaders. `tick` is called after each frame and stops the measuring by returning
/// false.
///
/// # Errors
/// [`RunError::Oracle`] where an oracle gives up, [`RunError::Interrupted`] where `tick` says so.
///
/// # Panics
/// For no rounds.
pub fn measure(
    benches: &mut [Bench<'_>],
    rounds: u32,
    tick: &mut dyn FnMut() -> bool,
) -> Result<Vec<Measurement>, RunError> {
    assert!(rounds > 0, "a median is over at least one time");
    let states: Vec<Vec<FrameState>> = benches.iter().map(states).collect();
    let mut run = |bench: &mut Bench<'_>, states: &[FrameState], work: usize| {
        let Bench { world, oracle, works } = bench;
        let state = states.iter().find(|state| state.moment.frame == works[work].frame);
        let state = state.expect("each frame has its state");
        let measured = run_once(world, oracle.as_mut(), state, &works[work])?;
        if tick() { Ok(measured) } else { Err(RunError::Interrupted) }
    };
    for (bench, states) in benches.iter_mut().zip(&states) {
        for work in 0..bench.works.len().min(KINDS.len()) {
            run(bench, states, work)?;
        }
    }
    let mut times: Vec<Vec<Measurement>> = Vec::new();
    times.resize_with(benches.iter().map(|bench| bench.works.len()).sum(), Vec::new);
    for _ in 0..rounds {
        let mut times = times.iter_mut();
        for (bench, states) in benches.iter_mut().zip(&states) {
            for (work, times) in (0..bench.works.len()).zip(&mut times) {
                times.push(run(bench, states, work)?);
            }
        }
    }
    let median = |mut times: Vec<Measurement>| {
        times.sort_by(|a, b| a.ns.total_cmp(&b.ns));
        times[times.len() / 2]
    };
    Ok(times.into_iter().map(median).collect())
}

/// The states of the frames that the works are of.
fn states(bench: &Bench<'_>) -> Vec<FrameState> {
    let mut frames: Vec<u32> = bench.works.iter().map(|work| work.frame).collect();
    frames.sort_unstable();
    frames.dedup();
    frames.into_iter().map(|t| FrameState::at(bench.world, Moment { frame: t, view: 0 })).collect()
}

/// One frame, timed as a lane's frame is: through a pen, up to the end of its last batch.
fn run_once(
    world: &World,
    oracle: &mut dyn Oracle,
    state: &FrameState,
    workload: &Workload,
) -> Result<Measurement, OracleError> {
    let mut answers: Vec<Answer> = Vec::new();
    let start = Instant::now();
    oracle
        .begin_frame(&FrameView { frame: state.moment.frame, clip_from_object: &state.matrices })?;
    let mut pen = Pen::new(oracle, &world.partition);
    for step in &workload.steps {
        match step {
            Step::Draw(part) => pen.draw(*part),
            Step::Ask(proxies) => {
                pen.ask_any(proxies);
            }
            Step::RoundTrip => pen.round_trip(&mut answers)?,
        }
    }
    let Finished { drawn, counts, .. } = pen.finish()?;
    // A clock may be too coarse to see an empty frame on a simulated device.
    let ns = start.elapsed().as_nanos().max(1) as f64;
    Ok(Measurement { work: counts.amounts(drawn.len() as u64), ns })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::oracle::Sim;
    use crate::part::PartitionKnobs;
    use crate::scene::generate::{Knobs, build};

    fn world(seed: u64) -> World {
        let viewport = Some(crate::scene::Viewport { width: 96, height: 64 });
        let (scale, frames) = (Some(0.02), Some(12));
        let knobs = Knobs { seed: Some(seed), scale, frames, viewport, ..Knobs::default() };
        let knobs_of_parts = PartitionKnobs { leaf_triangles: 256, ..PartitionKnobs::default() };
        World::new(build("bunnies", &knobs).unwrap(), knobs_of_parts)
    }

    fn bench<'a>(world: &'a World, works: &[Workload]) -> Bench<'a> {
        Bench { world, oracle: Box::new(Sim::new(world.stage())), works: works.to_vec() }
    }

    fn measured(world: &World, works: &[Workload]) -> Vec<Measurement> {
        measure(&mut [bench(world, works)], 2, &mut || true).unwrap()
    }

    #[test]
    fn work_is_a_function_of_the_seed_and_every_kind_is_there() {
        let world = world(3);
        let works = workloads(&world, "a", 40);
        assert_eq!(works, workloads(&world, "a", 40));
        assert_ne!(works, workloads(&world, "b", 40));
        assert_ne!(works, workloads(&self::world(4), "a", 40));
        let amounts: Vec<_> = measured(&world, &works).iter().map(|m| m.work).collect();
        let again: Vec<_> = measured(&world, &works).iter().map(|m| m.work).collect();
        assert_eq!(amounts, again);
        let some = |of: &dyn Fn(&crate::oracle::Amounts) -> bool| amounts.iter().any(of);
        assert!(some(&|a| *a == crate::oracle::Amounts::default()), "nothing");
        assert!(some(&|a| a.parts > 0 && a.trips == 0), "parts only");
        assert!(some(&|a| a.queries > 200 && a.trips == 1), "many questions in one trip");
        assert!(some(&|a| a.trips > 20), "many trips");
        assert!(some(&|a| a.proxies > 4 * a.queries), "several proxies in a question");
        assert!(amounts.iter().all(|a| a.trips <= a.queries && a.pixels >= a.proxies));
        let most = (2.0 * MOST_VIEWPORTS * 96.0 * 64.0) as u64;
        assert!(amounts.iter().all(|a| a.pixels <= most + 2 * a.proxies));
    }

    #[test]
    fn measuring_stops_when_told() {
        let world = world(3);
        let (few, more) = (workloads(&world, "a", 16), workloads(&world, "b", 21));
        let (mut left, mut frames) = (20, 0_u64);
        let mut benches = [bench(&world, &few), bench(&world, &more)];
        let stopped = measure(&mut benches, 2, &mut || {
            left -= 1;
            left > 0
        });
        assert!(matches!(stopped, Err(RunError::Interrupted)) && left == 0);
        let all = measure(&mut benches, 2, &mut || {
            frames += 1;
            true
        });
        let works = |m: &[Measurement]| m.iter().map(|m| m.work).collect::<Vec<_>>();
        let all = works(&all.unwrap());
        assert_eq!(frames, frames_to_measure(&benches, 2));
        let alone = [measured(&world, &few), measured(&world, &more)].concat();
        assert_eq!(all, works(&alone), "in the order of the benches");
    }
}
