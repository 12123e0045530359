//! A lane whose draws are told from outside: no culler runs and no oracle is asked. The truth and the
//! observers are those of any lane.

use std::cell::OnceCell;

use super::lane::truth_facts;
use super::stop::attempt;
use super::{
    Cause, DeviceImages, FrameRecord, FrameState, FrameTrace, HASH_START, LaneInfo, Moment,
    Observer, Stop, Trace, Truth, World, canary, fold,
};
use crate::cull::{Counts, Situations};
use crate::part::PartId;

/// The parts that are told of a frame, or why there are none to come; or an error that ends the run.
pub type Said<E> = Result<Result<Vec<PartId>, Cause>, E>;

/// Has `observer` look at every view of frames `0..frames` with the parts that `says` of it; a part that is
/// said twice counts once. Where `says` gives a cause in their place the lane ends there, and so it does
/// where the truth or the observer panics: the observer is told.
///
/// # Errors
/// What `says` returns.
pub fn told<E>(
    world: &World,
    frames: u32,
    info: &LaneInfo,
    says: &mut dyn FnMut(&FrameState) -> Said<E>,
    observer: &mut dyn Observer,
) -> Result<Trace, E> {
    let mut trace = Trace { lane: info.clone(), frames: Vec::new(), stop: None };
    let mut last: Option<Truth> = None;
    for moment in Moment::all(world, frames) {
        let state = FrameState::at(world, moment);
        let seen = match says(&state)? {
            Ok(drawn) => attempt(|| {
                canary::strike(world, moment)?;
                let truth = match last.take() {
                    Some(last) => last.next(world, &state),
                    None => Truth::of(world, &state),
                };
                let frame = look(world, &state, &truth, info, drawn, observer);
                Ok((truth, frame))
            }),
            Err(cause) => Err(cause),
        };
        match seen {
            Ok((truth, frame)) => {
                trace.frames.push(frame);
                last = Some(truth);
            }
            Err(cause) => {
                let stop = Stop { moment: Some(moment), again: false, cause };
                observer.stopped(&stop);
                trace.stop = Some(stop);
                break;
            }
        }
    }
    Ok(trace)
}

/// Has `observer` look at a frame.
fn look(
    world: &World,
    state: &FrameState,
    truth: &Truth,
    lane: &LaneInfo,
    mut drawn: Vec<PartId>,
    observer: &mut dyn Observer,
) -> FrameTrace {
    drawn.sort_unstable();
    drawn.dedup();
    let triangles = |part: &PartId| u64::from(world.partition.part(*part).triangle_count);
    let mut counts = Counts { triangles: drawn.iter().map(triangles).sum(), ..Counts::default() };
    let events_hash = drawn.iter().fold(HASH_START, |hash, part| fold(hash, part.0.into()));
    let (visible_parts, visible_triangles, truth_hash) = truth_facts(truth);
    let trace = FrameTrace {
        moment: state.moment,
        drawn_parts: drawn.len() as u32,
        visible_parts,
        visible_triangles,
        counts,
        memory: None,
        events_hash,
        events: Vec::new(),
        situations: Situations::default(),
        clock: None,
        truth_hash,
        image_hash: 0,
        wall_ns: 0,
        wall_range_ns: [0; 2],
        visible_wall_ns: None,
    };
    let spoilt = canary::spoilt(world, truth, (state.moment, &drawn, counts.queries));
    counts.visible_answers = spoilt.visible_answers.unwrap_or(counts.visible_answers);
    let device = spoilt.device.as_ref().map(|[own, all]| DeviceImages { own, all });
    let drawn = spoilt.drawn.as_ref().unwrap_or(&drawn).as_slice();
    let (reference, fates) = (spoilt.reference.as_ref(), OnceCell::new());
    observer.frame(&FrameRecord {
        lane,
        world,
        state,
        truth,
        drawn,
        counts,
        device,
        reference,
        fates,
    });
    trace
}
