//! Lanes: cullers with their oracles, run side by side over the same frames, so that each frame's
//! truth is rendered once and kept no longer than the frame.

use std::cell::OnceCell;
use std::time::Instant;

use plainsight_reference::Tolerance;

use super::audit::{Deeds, audit, looks_closely};
use super::heartbeat::Pulse;
use super::stop::attempt;
use super::{
    Canary, Cause, DeviceImages, FrameRecord, FrameState, FrameTrace, HASH_START, Moment,
    Repetition, Stop, Trace, Truth, World, canary, caught, fold,
};
use crate::cull::{Counts, Culler, Finished, Journal, Pen};
use crate::index::promises;
use crate::oracle::{FrameView, Oracle, OracleError, ReadBack};
use crate::part::PartId;

/// Which lane a record belongs to.
#[derive(Clone, Debug)]
pub struct LaneInfo {
    /// The culler's name.
    pub culler: String,
    /// The oracle's name.
    pub oracle: &'static str,
    /// The adapter's name where a real device draws.
    pub device: Option<String>,
    /// How far the device's images may stand from the reference's.
    pub tolerance: Tolerance,
    /// The line that replays the lane.
    pub replay: String,
}

impl LaneInfo {
    /// Of a culler of that name beside `oracle`.
    #[must_use]
    pub fn of(culler: impl Into<String>, oracle: &dyn Oracle, replay: String) -> Self {
        Self {
            culler: culler.into(),
            oracle: oracle.name(),
            device: oracle.device(),
            tolerance: oracle.tolerance(),
            replay,
        }
    }
}

/// Looks at each finished frame of a lane.
pub trait Observer {
    /// One frame, in order from 0.
    fn frame(&mut self, record: &FrameRecord<'_>);

    /// A promise that the lane's culler, index or oracle made was broken in that view of a frame; comes before
    /// the frame itself, and only of lanes that are audited. One who does not judge may only pass it on.
    ///
    /// # Panics
    /// With the promise, where that is not kept.
    fn broken(&mut self, moment: Moment, promise: &str) {
        panic!("{moment}: {promise}");
    }

    /// A frame that was run for another time by a new culler: the traces must be equal.
    fn repeated(&mut self, repetition: &Repetition<'_>) {
        let _ = repetition;
    }

    /// The lane ended early. One who does not judge may only pass a panic on.
    ///
    /// # Panics
    /// With what is said of the end, where that is not kept.
    fn stopped(&mut self, stop: &Stop) {
        panic!("{stop}");
    }
}

/// A culler beside an oracle, and who watches.
pub struct Lane<'a> {
    /// Names.
    pub info: LaneInfo,
    /// Makes the culler; called once for the run and once for the repetition. Where frames have several
    /// views it is asked for each of them; see [`PerView`](crate::cull::PerView).
    pub culler: Box<dyn Fn() -> Box<dyn Culler> + 'a>,
    /// The oracle.
    pub oracle: Box<dyn Oracle + 'a>,
    /// Who watches.
    pub observer: &'a mut dyn Observer,
    /// Whether to measure as well how long the device takes for the truth's visible parts alone. Not
    /// done where its memory is limited: it would change what is resident. Lanes share one measurement a
    /// frame.
    pub with_bound: bool,
    /// Whether every promise that the culler, its index and its oracle make on the way is held against each
    /// frame, see [`Observer::broken`]. It is for oracles that err towards visible alone, without tolerance,
    /// and takes time: not where that is measured.
    pub audited: bool,
}

/// What is run again, with new cullers: the traces must be equal, and wall times are the medians.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Repeat {
    /// So many first frames.
    pub frames: u32,
    /// How often again.
    pub rounds: u32,
}

impl Repeat {
    /// Nothing.
    pub const NONE: Self = Self { frames: 0, rounds: 0 };

    /// The first frames, once.
    #[must_use]
    pub const fn first(frames: u32) -> Self {
        Self { frames, rounds: 1 }
    }

    /// Frames run again of `frames`, over all rounds.
    #[must_use]
    pub fn total(self, frames: u32) -> u64 {
        u64::from(self.frames.min(frames)) * u64::from(self.rounds)
    }
}

/// Why a run ended early.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The oracle gave up.
    #[error(transparent)]
    Oracle(#[from] OracleError),
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
}

/// One frame of one lane as it was run.
struct Shot {
    trace: FrameTrace,
    drawn: Vec<PartId>,
    own: Option<ReadBack>,
    /// What the culler did, where the lane is audited.
    journal: Option<Journal>,
}

/// Runs every lane over frames `0..frames`, each view by itself, the lanes in turn within each view, then
/// what `repeat` says, again in turn. `tick` is called after each lane's view and stops the run by
/// returning false. A lane whose culler or oracle panics, or whose oracle gives up, ends there: its observer
/// is told and its trace says why ([`Trace::stop`]); the others go on. A panic while the truth is drawn ends
/// them all.
///
/// # Errors
/// [`RunError::Interrupted`] where `tick` says so.
pub fn run(
    world: &World,
    frames: u32,
    repeat: Repeat,
    lanes: &mut [Lane<'_>],
    tick: &mut dyn FnMut() -> bool,
) -> Result<Vec<Trace>, RunError> {
    if world.canary == Some(Canary::DeviceImage) {
        for lane in lanes.iter_mut() {
            lane.info.device.get_or_insert("a canary".to_owned());
        }
    }
    let traces = lanes.iter().map(|lane| lane.info.clone());
    let traces = traces.map(|lane| Trace { lane, frames: Vec::new(), stop: None }).collect();
    let pulse = Pulse::new(world, lanes.iter().map(|lane| &lane.info));
    let mut running = Running { world, lanes, traces, pulse };
    running.once(frames, repeat, tick)?;
    running.again(repeat, tick)?;
    Ok(running.traces)
}

/// Lanes and what they have left so far.
struct Running<'a, 'b> {
    world: &'a World,
    lanes: &'a mut [Lane<'b>],
    traces: Vec<Trace>,
    pulse: Pulse,
}

/// The cullers of a round by lane; none where a lane has ended.
type Cullers = Vec<Option<Box<dyn Culler>>>;

impl Running<'_, '_> {
    fn goes_on(&self, place: usize) -> bool {
        self.traces[place].stop.is_none()
    }

    /// Ends a lane.
    fn stop(&mut self, place: usize, moment: Option<Moment>, again: bool, cause: Cause) {
        let stop = Stop { moment, again, cause };
        self.lanes[place].observer.stopped(&stop);
        self.traces[place].stop = Some(stop);
    }

    /// A new culler for every lane that goes on.
    fn cullers(&mut self, again: bool) -> Cullers {
        let mut cullers: Cullers = Vec::new();
        for place in 0..self.lanes.len() {
            let beat = self.pulse.begin(place, None);
            let made = self.goes_on(place).then(|| attempt(|| Ok((self.lanes[place].culler)())));
            drop(beat);
            cullers.push(match made {
                Some(Ok(culler)) => Some(culler),
                Some(Err(cause)) => {
                    self.stop(place, None, again, cause);
                    None
                }
                None => None,
            });
        }
        cullers
    }

    /// Every frame for the first time.
    fn once(
        &mut self,
        frames: u32,
        repeat: Repeat,
        tick: &mut dyn FnMut() -> bool,
    ) -> Result<(), RunError> {
        let world = self.world;
        let mut cullers = self.cullers(false);
        let mut last: Option<Truth> = None;
        for moment in Moment::all(world, frames) {
            let seen = caught(|| {
                let state = FrameState::at(world, moment);
                let truth = match last.take() {
                    Some(last) => last.next(world, &state),
                    None => Truth::of(world, &state),
                };
                (state, truth)
            });
            let (state, truth) = match seen {
                Ok(seen) => seen,
                Err(said) => {
                    let said = format!("while the truth was drawn: {said}");
                    for place in 0..self.lanes.len() {
                        if self.goes_on(place) {
                            self.stop(place, Some(moment), false, Cause::Panic(said.clone()));
                        }
                    }
                    return Ok(());
                }
            };
            let keeps_events = repeat.rounds > 0 && moment.frame < repeat.frames;
            let mut shared = Shared::default();
            for (place, slot) in cullers.iter_mut().enumerate() {
                let Some(culler) = slot.as_deref_mut() else { continue };
                let (lane, pulse) = (&mut self.lanes[place], &self.pulse);
                let done = attempt(|| {
                    let facts = truth_facts(&truth);
                    let beat = pulse.begin(place, Some(moment));
                    let shot = shoot(world, &state, facts, lane, culler, keeps_events)?;
                    drop(beat);
                    if let Some(journal) = &shot.journal {
                        hold(world, &state, &truth, lane, culler, (&shot.drawn, journal));
                    }
                    observe(world, &state, &truth, lane, &shot, &mut shared.everything)?;
                    let bounded =
                        lane.info.device.is_some() && lane.with_bound && world.memory.is_none();
                    if bounded && shared.bound.is_none() {
                        let oracle = lane.oracle.as_mut();
                        shared.bound = Some(draw_visible(world, &state, &truth, oracle)?);
                    }
                    let visible_wall_ns = shared.bound.filter(|_| bounded);
                    Ok(FrameTrace { visible_wall_ns, ..shot.trace })
                });
                match done {
                    Ok(trace) => self.traces[place].frames.push(trace),
                    Err(cause) => {
                        *slot = None;
                        self.stop(place, Some(moment), false, cause);
                    }
                }
                if !tick() {
                    return Err(RunError::Interrupted);
                }
            }
            last = Some(truth);
        }
        Ok(())
    }

    /// What is repeated.
    fn again(&mut self, repeat: Repeat, tick: &mut dyn FnMut() -> bool) -> Result<(), RunError> {
        let world = self.world;
        let run = self.traces.iter().map(|trace| trace.frames.len() as u32).max().unwrap_or(0);
        let frames = repeat.frames.min(run / world.views());
        let walls_of = |trace: &Trace| trace.frames.iter().map(|f| vec![f.wall_ns]).collect();
        let mut walls: Vec<Vec<Vec<u64>>> = self.traces.iter().map(walls_of).collect();
        let rounds = if frames > 0 { repeat.rounds } else { 0 };
        for _ in 0..rounds {
            let mut cullers = self.cullers(true);
            for (shot, moment) in Moment::all(world, frames).enumerate() {
                let state = FrameState::at(world, moment);
                for (place, slot) in cullers.iter_mut().enumerate() {
                    let Some(culler) = slot.as_deref_mut() else { continue };
                    let (lane, pulse) = (&mut self.lanes[place], &self.pulse);
                    let first = &self.traces[place].frames[shot];
                    let done = attempt(|| {
                        let facts =
                            (first.visible_parts, first.visible_triangles, first.truth_hash);
                        let beat = pulse.begin(place, Some(moment));
                        let mut again = shoot(world, &state, facts, lane, culler, true)?.trace;
                        drop(beat);
                        canary::alter(world, &mut again);
                        let (lane, observer) = (&lane.info, &mut *lane.observer);
                        let (state, again) = (&state, &again);
                        observer.repeated(&Repetition { lane, world, state, first, again });
                        Ok(again.wall_ns)
                    });
                    match done {
                        Ok(wall_ns) => walls[place][shot].push(wall_ns),
                        Err(cause) => {
                            *slot = None;
                            self.stop(place, Some(moment), true, cause);
                        }
                    }
                    if !tick() {
                        return Err(RunError::Interrupted);
                    }
                }
            }
        }
        for (trace, walls) in self.traces.iter_mut().zip(walls) {
            for (frame, mut walls) in trace.frames.iter_mut().zip(walls) {
                walls.sort_unstable();
                frame.wall_ns = walls[(walls.len() - 1) / 2];
                frame.wall_range_ns = [walls[0], walls[walls.len() - 1]];
            }
        }
        Ok(())
    }
}

/// What lanes share within a frame: the device's picture of everything, and how long it takes for the
/// visible parts alone.
#[derive(Default)]
struct Shared {
    everything: Option<ReadBack>,
    bound: Option<u64>,
}

/// Draws the visible parts and nothing else, the nearest objects first, and returns the wall time in
/// nanoseconds. No culler can draw less; one could only be quicker by a luckier order.
fn draw_visible(
    world: &World,
    state: &FrameState,
    truth: &Truth,
    oracle: &mut dyn Oracle,
) -> Result<u64, OracleError> {
    let parts = (0..world.partition.part_count()).map(PartId);
    let mut visible: Vec<(f64, PartId)> = parts
        .filter(|part| truth.visible_pixels[part.0 as usize] > 0)
        .map(|part| {
            let (object, _) = world.partition.locate(part);
            let center = state.objects[object.0 as usize].bounds.center();
            (center.distance_squared(state.camera.eye), part)
        })
        .collect();
    visible.sort_by(|a, b| a.0.total_cmp(&b.0));
    let start = Instant::now();
    oracle.begin_frame(&frame_view(state))?;
    let mut pen = Pen::new(oracle, &world.partition);
    visible.into_iter().for_each(|(_, part)| pen.draw(part));
    pen.finish()?;
    Ok(start.elapsed().as_nanos() as u64)
}

/// What a trace keeps of the truth: visible parts, their triangles, the image's hash.
pub(super) fn truth_facts(truth: &Truth) -> (u32, u64, u64) {
    (truth.visible_parts, truth.visible_triangles, truth.hash)
}

/// What an oracle is told of it.
fn frame_view(state: &FrameState) -> FrameView<'_> {
    FrameView { frame: state.moment.frame, clip_from_object: &state.matrices }
}

fn shoot(
    world: &World,
    state: &FrameState,
    (visible_parts, visible_triangles, truth_hash): (u32, u64, u64),
    lane: &mut Lane<'_>,
    culler: &mut dyn Culler,
    keeps_events: bool,
) -> Result<Shot, OracleError> {
    canary::strike(world, state.moment)?;
    let oracle = lane.oracle.as_mut();
    // Wall time is reported and never compared.
    let start = Instant::now();
    oracle.begin_frame(&frame_view(state))?;
    let mut pen = Pen::new(oracle, &world.partition);
    if keeps_events {
        pen = pen.keeping_events();
    }
    let mut journal = lane.audited.then(Journal::default);
    if let Some(journal) = &mut journal {
        pen = pen.writing(journal);
    }
    culler.frame(&state.view(world), &mut pen)?;
    let Finished { drawn, counts, events_hash, situations, events } = pen.finish()?;
    let wall_ns = start.elapsed().as_nanos() as u64;
    let (memory, clock) = (oracle.memory(), oracle.clock());
    let words = |image: &ReadBack| {
        image.depth.iter().fold(HASH_START, |hash, depth| fold(hash, u64::from(depth.to_bits())))
    };
    let (own, image_hash) = match oracle.reference_image() {
        Some(image) => (None, image.hash()),
        None => {
            let own = oracle.read_back()?;
            let hash = own.as_ref().map_or(0, words);
            (own, hash)
        }
    };
    let drawn_parts = drawn.len() as u32;
    let trace = FrameTrace {
        moment: state.moment,
        drawn_parts,
        visible_parts,
        visible_triangles,
        counts,
        memory,
        events_hash,
        events,
        situations,
        clock,
        truth_hash,
        image_hash,
        wall_ns,
        wall_range_ns: [wall_ns; 2],
        visible_wall_ns: None,
    };
    Ok(Shot { trace, drawn, own, journal })
}

/// Holds the promises of a lane against a frame of it, and tells its observer of the first that is broken.
fn hold(
    world: &World,
    state: &FrameState,
    truth: &Truth,
    lane: &mut Lane<'_>,
    culler: &dyn Culler,
    (drawn, journal): (&[PartId], &Journal),
) {
    let kept = || {
        culler.check(&state.boxes)?;
        if let Some(scenery) = culler.scenery(state.moment.view) {
            promises(scenery.index(), &state.boxes)?;
            audit(world, state, truth, &Deeds { scenery, journal, drawn })?;
        }
        if looks_closely(state) { lane.oracle.check() } else { Ok(()) }
    };
    if let Err(promise) = kept() {
        lane.observer.broken(state.moment, &promise);
    }
}

fn observe(
    world: &World,
    state: &FrameState,
    truth: &Truth,
    lane: &mut Lane<'_>,
    shot: &Shot,
    everything: &mut Option<ReadBack>,
) -> Result<(), OracleError> {
    if lane.info.device.is_some() && everything.is_none() {
        let all: Vec<PartId> = (0..world.partition.part_count()).map(PartId).collect();
        *everything = lane.oracle.redraw(&all)?;
    }
    let mut counts: Counts = shot.trace.counts;
    let spoilt = canary::spoilt(world, truth, (state.moment, &shot.drawn, counts.queries));
    counts.visible_answers = spoilt.visible_answers.unwrap_or(counts.visible_answers);
    let device = match (&spoilt.device, &shot.own, &*everything) {
        (Some([own, all]), ..) => Some(DeviceImages { own, all }),
        (_, Some(own), Some(all)) if lane.info.device.is_some() => Some(DeviceImages { own, all }),
        _ => None,
    };
    let drawn = spoilt.drawn.as_ref().unwrap_or(&shot.drawn).as_slice();
    let reference = spoilt.reference.as_ref().or(lane.oracle.reference_image());
    let (lane, observer, fates) = (&lane.info, &mut *lane.observer, OnceCell::new());
    let record = FrameRecord { lane, world, state, truth, drawn, counts, device, reference, fates };
    observer.frame(&record);
    Ok(())
}
