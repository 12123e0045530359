//! **determinism**: a frame run again by a new culler leaves the same trace.

use crate::run::{FrameTrace, HASH_START, Moment};

/// Compares repeated frames.
#[derive(Clone, Debug, Default)]
pub struct Determinism {
    compared: u32,
    first_difference: Option<(Moment, String)>,
}

impl Determinism {
    /// Compares the two traces of one frame by what must repeat; wall time is left out.
    pub fn repeated(&mut self, first: &FrameTrace, again: &FrameTrace) {
        self.compared += 1;
        if first.fold_into(HASH_START) != again.fold_into(HASH_START) {
            self.first_difference.get_or_insert_with(|| (first.moment, what_differs(first, again)));
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
        self.first_difference.as_ref().map(|(moment, _)| *moment)
    }

    /// The first event of it that differed, in words, or what else did; empty where all repeated.
    #[must_use]
    pub fn first_event(&self) -> &str {
        self.first_difference.as_ref().map_or("", |(_, event)| event)
    }
}

/// The first event of two traces of one frame that differs; where none does, what else.
fn what_differs(first: &FrameTrace, again: &FrameTrace) -> String {
    let pairs = first.events.iter().zip(&again.events);
    let same = pairs.take_while(|(a, b)| a == b).count();
    let at = |trace: &FrameTrace| {
        trace.events.get(same).map_or("the end of the frame".to_owned(), ToString::to_string)
    };
    if same < first.events.len().max(again.events.len()) {
        return format!("event {same} was {}, and then {}", at(first), at(again));
    }
    let figures = [
        ("the truth's image", first.truth_hash, again.truth_hash),
        ("the image of what was drawn", first.image_hash, again.image_hash),
    ];
    let other = figures.into_iter().find(|(_, a, b)| a != b);
    format!("all events were the same, {} was not", other.map_or("the memory's traffic", |o| o.0))
}
