//! **counts**: what the run spent; snapshots compare the sums. One thing can be wrong by itself: a
//! frame that got more "visible" answers than it asked questions.

use crate::cull::Counts;
use crate::run::{FrameRecord, Moment};

/// Sums over the frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct CountsCheck {
    total: Counts,
    overcounted: Option<Moment>,
}

impl CountsCheck {
    /// Adds one frame.
    pub fn frame(&mut self, record: &FrameRecord<'_>) {
        let counts = record.counts;
        self.total.queries += counts.queries;
        self.total.proxies += counts.proxies;
        self.total.pixels += counts.pixels;
        self.total.triangles += counts.triangles;
        self.total.visible_answers += counts.visible_answers;
        self.total.round_trips += counts.round_trips;
        if counts.visible_answers > counts.queries {
            self.overcounted.get_or_insert(record.state.moment);
        }
    }

    /// The sums.
    #[must_use]
    pub fn total(&self) -> Counts {
        self.total
    }

    /// The first frame with more answers than questions.
    #[must_use]
    pub fn overcounted(&self) -> Option<Moment> {
        self.overcounted
    }
}
