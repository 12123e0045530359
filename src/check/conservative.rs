//! **set**: no part that must be visible is missing from what was drawn, in any frame. On an exact
//! device that is every part that shows a sample; on another, those of them that show on every device
//! within its tolerance. Must implies visible, so the rest of the truth is asked only where a visible
//! part is missing.
//!
//! A policy that trusts a stale "hidden" may declare for how many frames a part that shows may be missing.
//! What is missing longer is a miss; what is not makes the verdict "held late", never "held".

use plainsight_reference::{Fate, Tolerance};

use crate::part::PartId;
use crate::run::{FrameRecord, Moment};

/// A visible part that was not drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Miss {
    /// The frame and view.
    pub moment: Moment,
    /// The part.
    pub part: PartId,
    /// How many samples show it.
    pub pixels: u32,
    /// Column and row of the first of them, row 0 on top.
    pub first_pixel: [u32; 2],
}

/// Lists the misses.
#[derive(Clone, Debug, Default)]
pub struct Conservative {
    misses: Vec<Miss>,
    may_missed: u64,
    /// For how many frames a part may be missing.
    forgives: u32,
    /// By view and part, for how many frames it has been missing; empty where nothing is forgiven.
    missing: Vec<Vec<u32>>,
    latest: u32,
}

impl Conservative {
    /// One that lets a part that shows be missing for `frames` frames in a row.
    #[must_use]
    pub fn forgiving(frames: u32) -> Self {
        Self { forgives: frames, ..Self::default() }
    }

    /// Whether a part that is missing (or not) in this frame has not been for too long.
    fn forgives(&mut self, record: &FrameRecord<'_>, part: usize, is_missing: bool) -> bool {
        if self.forgives == 0 {
            return false;
        }
        let view = record.state.moment.view as usize;
        if self.missing.len() <= view {
            self.missing.resize(view + 1, vec![0; record.truth.visible_pixels.len()]);
        }
        let frames = &mut self.missing[view][part];
        *frames = if is_missing { *frames + 1 } else { 0 };
        let forgiven = *frames <= self.forgives;
        if forgiven {
            self.latest = self.latest.max(*frames);
        }
        forgiven
    }

    /// For how many frames a part that shows was missing at most, of what was forgiven.
    #[must_use]
    pub fn latest(&self) -> u32 {
        self.latest
    }

    /// Compares one frame.
    pub fn frame(&mut self, record: &FrameRecord<'_>) {
        let truth = record.truth;
        let mut drawn = vec![false; truth.visible_pixels.len()];
        for part in record.drawn {
            drawn[part.0 as usize] = true;
        }
        for (part, &pixels) in truth.visible_pixels.iter().enumerate() {
            let is_missing = pixels > 0 && !drawn[part];
            let exact = record.lane.tolerance == Tolerance::EXACT;
            // What need not show is not late either.
            let need_not = is_missing && !exact && record.fates().parts[part] != Fate::Must;
            self.may_missed += u64::from(need_not);
            let is_missing = is_missing && !need_not;
            if !self.forgives(record, part, is_missing) && is_missing {
                let part = PartId(part as u32);
                let shows = |sample: &usize| truth.part_at(record.world, *sample) == Some(part);
                let sample = (0..truth.image.sample_count())
                    .find(shows)
                    .expect("a part with visible pixels shows at a sample");
                let width = truth.image.viewport().width;
                let first_pixel = [sample as u32 % width, sample as u32 / width];
                self.misses.push(Miss { moment: record.state.moment, part, pixels, first_pixel });
            }
        }
    }

    /// How many visible parts were not drawn, over all frames, that a device within the tolerance need
    /// not show.
    #[must_use]
    pub fn may_missed(&self) -> u64 {
        self.may_missed
    }

    /// Every miss, in order of frames, then parts.
    #[must_use]
    pub fn misses(&self) -> &[Miss] {
        &self.misses
    }
}
