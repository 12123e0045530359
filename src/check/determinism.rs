//! **determinism**: a frame run again by a new culler leaves the same trace.

use crate::run::{FrameTrace, HASH_START, Moment};

/// Compares repeated frames.
#[derive(Clone, Debug, Default)]
pub struct Determinism {
    compared: u32,
    first_difference: Option<Moment>,
}

impl Determinism {
    /// Compares the two traces of one frame by what must repeat; wall time is left out.
    pub fn repeated(&mut self, first: &FrameTrace, again: &FrameTrace) {
        self.compared += 1;
        if first.fold_into(HASH_START) != again.fold_into(HASH_START) {
            self.first_difference.get_or_insert(first.moment);
        }
    }

    /// How many frames were compared.
    #[must_use]
    pub fn compared(&self) -> u32 {
        self.compared
    }

    /// The first frame whose repetition differed.
    #[must_use]
    pub fn first_difference(&self) -> Option<Moment> {
        self.first_difference
    }
}
