//! Lanes: cullers with their oracles, run side by side over the same frames, so that each frame's
//! truth is rendered once and kept no longer than the frame.

use std::time::Instant;

use super::{
    DeviceImages, FrameRecord, FrameState, FrameTrace, HASH_START, Trace, Truth, World, fold,
};
use crate::cull::{Counts, Culler, Pen};
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
    /// The line that replays the lane.
    pub replay: String,
}

/// Looks at each finished frame of a lane.
pub trait Observer {
    /// One frame, in order from 0.
    fn frame(&mut self, record: &FrameRecord<'_>);

    /// A frame that was run a second time by a new culler: the traces must be equal.
    fn repeated(&mut self, first: &FrameTrace, again: &FrameTrace) {
        let _ = (first, again);
    }
}

/// A culler beside an oracle, and who watches.
pub struct Lane<'a> {
    /// Names.
    pub info: LaneInfo,
    /// Makes the culler; called once for the run and once for the repetition.
    pub culler: Box<dyn Fn() -> Box<dyn Culler> + 'a>,
    /// The oracle.
    pub oracle: Box<dyn Oracle + 'a>,
    /// Who watches.
    pub observer: &'a mut dyn Observer,
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
}

/// Runs every lane over frames `0..frames`, then the first `repeat` frames a second time with new
/// cullers. `tick` is called after each lane's frame and stops the run by returning false.
///
/// # Errors
/// [`RunError::Oracle`] where an oracle gives up, [`RunError::Interrupted`] where `tick` says so.
///
/// # Panics
/// Where a culler's own invariants are broken, in builds with debug assertions.
pub fn run(
    world: &World,
    frames: u32,
    repeat: u32,
    lanes: &mut [Lane<'_>],
    tick: &mut dyn FnMut() -> bool,
) -> Result<Vec<Trace>, RunError> {
    let traces = |lane: &Lane<'_>| Trace { lane: lane.info.clone(), frames: Vec::new() };
    let mut traces: Vec<Trace> = lanes.iter().map(traces).collect();
    let mut cullers: Vec<_> = lanes.iter().map(|lane| (lane.culler)()).collect();
    for t in 0..frames {
        let state = FrameState::at(world, t);
        let truth = Truth::of(world, &state);
        let mut everything: Option<ReadBack> = None;
        for ((lane, culler), trace) in lanes.iter_mut().zip(&mut cullers).zip(&mut traces) {
            let shot = shoot(world, &state, truth_facts(&truth), lane, culler.as_mut())?;
            observe(world, &state, &truth, lane, &shot, &mut everything)?;
            trace.frames.push(shot.trace);
            if !tick() {
                return Err(RunError::Interrupted);
            }
        }
    }
    repeat_first(world, repeat.min(frames), lanes, &traces)?;
    Ok(traces)
}

/// What a trace keeps of the truth: visible parts, their triangles, the image's hash.
fn truth_facts(truth: &Truth) -> (u32, u64, u64) {
    (truth.visible_parts, truth.visible_triangles, truth.hash)
}

fn shoot(
    world: &World,
    state: &FrameState,
    (visible_parts, visible_triangles, truth_hash): (u32, u64, u64),
    lane: &mut Lane<'_>,
    culler: &mut dyn Culler,
) -> Result<Shot, OracleError> {
    let oracle = lane.oracle.as_mut();
    // Wall time is reported and never compared.
    let start = Instant::now();
    oracle.begin_frame(&FrameView { frame: state.frame, clip_from_object: &state.matrices })?;
    let mut pen = Pen::new(oracle, &world.partition);
    culler.frame(&state.view(world), &mut pen)?;
    let (drawn, counts, events_hash) = pen.finish()?;
    let wall_ns = start.elapsed().as_nanos() as u64;
    if cfg!(debug_assertions)
        && let Err(broken) = culler.check()
    {
        panic!("{} broke its invariants in frame {}: {broken}", culler.name(), state.frame);
    }
    let memory = oracle.memory();
    let own = oracle.read_back()?;
    let words = |image: &ReadBack| {
        image.depth.iter().fold(HASH_START, |hash, depth| fold(hash, u64::from(depth.to_bits())))
    };
    let image_hash = own.as_ref().map_or(0, words);
    let drawn_parts = drawn.len() as u32;
    let trace = FrameTrace {
        frame: state.frame,
        drawn_parts,
        visible_parts,
        visible_triangles,
        counts,
        memory,
        events_hash,
        truth_hash,
        image_hash,
        wall_ns,
    };
    Ok(Shot { trace, drawn, own })
}

fn observe(
    world: &World,
    state: &FrameState,
    truth: &Truth,
    lane: &mut Lane<'_>,
    shot: &Shot,
    everything: &mut Option<ReadBack>,
) -> Result<(), OracleError> {
    let mut sorted = shot.drawn.clone();
    sorted.sort_unstable();
    let redrawn = if lane.info.device.is_some() { lane.oracle.redraw(&sorted)? } else { None };
    if redrawn.is_some() && everything.is_none() {
        let all: Vec<PartId> = (0..world.partition.part_count()).map(PartId).collect();
        *everything = lane.oracle.redraw(&all)?;
    }
    let device = match (&shot.own, &redrawn, &*everything) {
        (Some(own), Some(drawn), Some(all)) => Some(DeviceImages { own, drawn, all }),
        _ => None,
    };
    let counts: Counts = shot.trace.counts;
    let record =
        FrameRecord { lane: &lane.info, world, state, truth, drawn: &shot.drawn, counts, device };
    lane.observer.frame(&record);
    Ok(())
}

fn repeat_first(
    world: &World,
    frames: u32,
    lanes: &mut [Lane<'_>],
    traces: &[Trace],
) -> Result<(), OracleError> {
    let mut cullers: Vec<_> = lanes.iter().map(|lane| (lane.culler)()).collect();
    for t in 0..frames {
        let state = FrameState::at(world, t);
        for ((lane, culler), trace) in lanes.iter_mut().zip(&mut cullers).zip(traces) {
            let first = &trace.frames[t as usize];
            let facts = (first.visible_parts, first.visible_triangles, first.truth_hash);
            let again = shoot(world, &state, facts, lane, culler.as_mut())?;
            lane.observer.repeated(first, &again.trace);
        }
    }
    Ok(())
}
