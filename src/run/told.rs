//! A lane whose draws are told from outside: no culler runs and no oracle is asked. The truth and the
//! observers are those of any lane.

use std::cell::OnceCell;

use super::lane::truth_facts;
use super::{FrameRecord, FrameState, FrameTrace, HASH_START, LaneInfo, Moment, Observer, Trace};
use super::{Truth, World, fold};
use crate::cull::{Counts, Situations};
use crate::part::PartId;

/// Has `observer` look at every view of frames `0..frames` with the parts that `says` of it; a part that is
/// said twice counts once.
///
/// # Errors
/// What `says` returns.
///
/// # Panics
/// For a part beyond the last.
pub fn told<E>(
    world: &World,
    frames: u32,
    info: &LaneInfo,
    says: &mut dyn FnMut(&FrameState) -> Result<Vec<PartId>, E>,
    observer: &mut dyn Observer,
) -> Result<Trace, E> {
    let mut trace = Trace { lane: info.clone(), frames: Vec::new() };
    let mut last: Option<Truth> = None;
    for moment in Moment::all(world, frames) {
        let state = FrameState::at(world, moment);
        let mut drawn = says(&state)?;
        drawn.sort_unstable();
        drawn.dedup();
        let truth = match last.take() {
            Some(last) => last.next(world, &state),
            None => Truth::of(world, &state),
        };
        let triangles = |part: &PartId| u64::from(world.partition.part(*part).triangle_count);
        let counts = Counts { triangles: drawn.iter().map(triangles).sum(), ..Counts::default() };
        let events_hash = drawn.iter().fold(HASH_START, |hash, part| fold(hash, part.0.into()));
        let (visible_parts, visible_triangles, truth_hash) = truth_facts(&truth);
        trace.frames.push(FrameTrace {
            moment,
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
        });
        let (lane, state, drawn) = (info, &state, drawn.as_slice());
        let (device, fates) = (None, OnceCell::new());
        observer.frame(&FrameRecord {
            lane,
            world,
            state,
            truth: &truth,
            drawn,
            counts,
            device,
            reference: None,
            fates,
        });
        last = Some(truth);
    }
    Ok(trace)
}
