//! Situations that a culler can get into, noted while it draws, so that a sweep can say which of them it
//! ever reached. A note is a bit; it changes nothing.

use std::fmt;

/// A situation worth having been in.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[repr(u8)]
pub enum Situation {
    /// An answer was "hidden".
    AnsweredHidden,
    /// An answer was "visible".
    AnsweredVisible,
    /// One question about several proxies was answered "hidden".
    SeveralHidden,
    /// A part drawn on trust was asked about again, and is hidden.
    PostponedHidden,
    /// A node that was hidden in the frame before shows.
    HiddenShows,
    /// Something in a group shows, and its nodes are looked at one by one.
    GroupSplit,
    /// A node's own box shows and nothing in it does.
    PulledUp,
    /// A part was drawn without a question, for it was visible lately.
    DrawnOnTrust,
    /// What a node holds may stick out of its box: it counts as visible.
    SticksOut,
    /// A box that cannot be projected: the near plane cuts it, or the eye is in it.
    Unprojectable,
    /// The scene tree was made anew in part, and what was remembered of it is void.
    Rebuilt,
    /// An object went from one side of the scene tree's root to the other.
    CrossedRoot,
    /// There was more to ask about than a batch holds.
    BatchFull,
    /// As many nodes stand in one question as may.
    GroupFull,
    /// Nodes that nothing is known of wait for a later batch.
    LayerWaits,
    /// As many batches are on their way as may be, and the walk waits.
    QueueFull,
    /// A question that would pay is not asked: its frame has spent what it may.
    PurseEmpty,
}

impl Situation {
    /// All there are.
    pub const ALL: [Self; 17] = [
        Self::AnsweredHidden,
        Self::AnsweredVisible,
        Self::SeveralHidden,
        Self::PostponedHidden,
        Self::HiddenShows,
        Self::GroupSplit,
        Self::PulledUp,
        Self::DrawnOnTrust,
        Self::SticksOut,
        Self::Unprojectable,
        Self::Rebuilt,
        Self::CrossedRoot,
        Self::BatchFull,
        Self::GroupFull,
        Self::LayerWaits,
        Self::QueueFull,
        Self::PurseEmpty,
    ];
}

impl fmt::Display for Situation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::AnsweredHidden => "an answer was hidden",
            Self::AnsweredVisible => "an answer was visible",
            Self::SeveralHidden => "several boxes were hidden in one question",
            Self::PostponedHidden => "a postponed part became hidden",
            Self::HiddenShows => "a hidden node became visible",
            Self::GroupSplit => "a group was taken apart",
            Self::PulledUp => "a node showed and nothing in it did",
            Self::DrawnOnTrust => "a part was drawn without a question",
            Self::SticksOut => "contents stuck out of their node",
            Self::Unprojectable => "the near plane cut a query box",
            Self::Rebuilt => "the scene tree was rebuilt",
            Self::CrossedRoot => "a relink crossed the root",
            Self::BatchFull => "there was more to ask about than a batch holds",
            Self::GroupFull => "a question was about as many nodes as may be",
            Self::LayerWaits => "nodes of a layer waited for the next batch",
            Self::QueueFull => "the walk waited for the oldest of a full queue of batches",
            Self::PurseEmpty => "a question that pays was beyond the frame's purse",
        })
    }
}

/// A set of situations.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Situations(u32);

impl Situations {
    /// Adds one.
    pub fn insert(&mut self, situation: Situation) {
        self.0 |= 1 << situation as u8;
    }

    /// Whether it is among them.
    #[must_use]
    pub fn contains(self, situation: Situation) -> bool {
        self.0 >> situation as u8 & 1 == 1
    }

    /// Both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}
