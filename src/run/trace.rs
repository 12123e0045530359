//! The record of a run, and what observers are shown of each frame.

use std::cell::OnceCell;
use std::fmt;

use plainsight_reference::{Fates, Image};

use super::{FrameState, HASH_START, LaneInfo, Stop, Truth, World, fates_of_parts, fold};
use crate::cull::{Counts, Event, Situations};
use crate::oracle::{Amounts, Clock, Memory, ReadBack};
use crate::part::PartId;

/// Which view of which frame; reads "frame 3", or "frame 3 view 1" where it is not the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Moment {
    /// t.
    pub frame: u32,
    /// The number of the camera.
    pub view: u32,
}

impl Moment {
    /// Every view of the first `frames` frames, in the order of a run.
    pub fn all(world: &World, frames: u32) -> impl Iterator<Item = Self> + use<> {
        let views = world.views();
        (0..frames).flat_map(move |frame| (0..views).map(move |view| Self { frame, view }))
    }
}

impl fmt::Display for Moment {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { frame, view } = self;
        if *view == 0 { write!(f, "frame {frame}") } else { write!(f, "frame {frame} view {view}") }
    }
}

/// What a real device drew in one frame.
pub struct DeviceImages<'a> {
    /// What the culler's own draws left.
    pub own: &'a ReadBack,
    /// Every part, in draw-index order.
    pub all: &'a ReadBack,
}

/// One finished view of a frame of one lane, lent to the observers.
pub struct FrameRecord<'a> {
    /// Which lane.
    pub lane: &'a LaneInfo,
    /// The scene.
    pub world: &'a World,
    /// The frame.
    pub state: &'a FrameState,
    /// The reference's answer.
    pub truth: &'a Truth,
    /// Parts drawn, in drawing order, each once.
    pub drawn: &'a [PartId],
    /// What it cost.
    pub counts: Counts,
    /// What a real device drew; `None` where none did.
    pub device: Option<DeviceImages<'a>>,
    /// What the lane's oracle drew, where that is a reference renderer.
    pub reference: Option<&'a Image>,
    pub(super) fates: OnceCell<Fates>,
}

/// A frame that was run for another time, by a new culler, lent to the observers.
pub struct Repetition<'a> {
    /// Which lane.
    pub lane: &'a LaneInfo,
    /// The scene.
    pub world: &'a World,
    /// The frame.
    pub state: &'a FrameState,
    /// What it left the first time.
    pub first: &'a FrameTrace,
    /// What it left now.
    pub again: &'a FrameTrace,
}

impl<'a> FrameRecord<'a> {
    /// The record with another truth and another picture of what was drawn.
    #[must_use]
    pub fn beside(&self, truth: &'a Truth, reference: &'a Image) -> Self {
        let Self { lane, world, state, drawn, counts, .. } = *self;
        let device = self.device.as_ref().map(|d| DeviceImages { own: d.own, all: d.all });
        let (reference, fates) = (Some(reference), self.fates.clone());
        Self { lane, world, state, truth, drawn, counts, device, reference, fates }
    }
}

impl FrameRecord<'_> {
    /// What the lane's device may make of each part, under its tolerance. Slow, and known only once
    /// asked for: the exact truth settles nearly every frame.
    #[must_use]
    pub fn fates(&self) -> &Fates {
        self.fates.get_or_init(|| fates_of_parts(self.world, self.state, self.lane.tolerance))
    }
}

/// What is kept of one view of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameTrace {
    /// Which frame and view.
    pub moment: Moment,
    /// Parts drawn.
    pub drawn_parts: u32,
    /// Parts the truth shows.
    pub visible_parts: u32,
    /// Triangles of those parts.
    pub visible_triangles: u64,
    /// Questions, answers, round trips.
    pub counts: Counts,
    /// Memory traffic of the device, where its memory is limited.
    pub memory: Option<Memory>,
    /// Hash of every draw, question and answer in order.
    pub events_hash: u64,
    /// What the culler got into; in no hash.
    pub situations: Situations,
    /// The device's clock after the frame, where it has one; in no hash.
    pub clock: Option<Clock>,
    /// Hash of the truth's image.
    pub truth_hash: u64,
    /// Hash of what the culler's own draws left: a reference renderer's image, a device's depth; 0 where no
    /// image is kept.
    pub image_hash: u64,
    /// The events that were hashed, where the frame is run again: so that the first that differs can be named.
    pub events: Vec<Event>,
    /// Wall time of the culler's frame, device included, in nanoseconds; the lower median where the
    /// frame was run several times. Never compared.
    pub wall_ns: u64,
    /// The least and the most of these times. Never compared.
    pub wall_range_ns: [u64; 2],
    /// Wall time for the visible parts alone, in nanoseconds, where it was asked for. Never compared.
    pub visible_wall_ns: Option<u64>,
}

/// The record of one lane.
#[derive(Clone, Debug)]
pub struct Trace {
    /// Which lane.
    pub lane: LaneInfo,
    /// Frame by frame, and view by view within a frame.
    pub frames: Vec<FrameTrace>,
    /// Why it ended early, if it did.
    pub stop: Option<Stop>,
}

impl Trace {
    /// One number for all that must repeat: draws, questions, answers and images of every frame.
    #[must_use]
    pub fn hash(&self) -> u64 {
        self.frames.iter().fold(HASH_START, |hash, frame| frame.fold_into(hash))
    }

    /// The sum of a figure over the frames.
    #[must_use]
    pub fn sum(&self, figure: impl Fn(&FrameTrace) -> u64) -> u64 {
        self.frames.iter().map(figure).sum()
    }
}

impl FrameTrace {
    /// The work as a cost model weighs it.
    #[must_use]
    pub fn amounts(&self) -> Amounts {
        self.counts.amounts(u64::from(self.drawn_parts))
    }

    /// Adds what must repeat of this frame to `hash`.
    #[must_use]
    pub fn fold_into(&self, hash: u64) -> u64 {
        let memory = self.memory.iter().flat_map(Memory::words);
        [
            u64::from(self.moment.view) << 32 | u64::from(self.moment.frame),
            u64::from(self.drawn_parts),
            self.counts.queries,
            self.counts.visible_answers,
            self.counts.round_trips,
            self.events_hash,
            self.truth_hash,
            self.image_hash,
        ]
        .into_iter()
        .chain(memory)
        .fold(hash, fold)
    }
}
