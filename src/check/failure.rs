//! What a check says, and what a lane comes to. Every failure of a lane is one of these, from wherever it
//! comes, and every verdict, word and exit code is taken from them alone: a check cannot be heard in one
//! place and lost in another.

use std::fmt;

use crate::run::Moment;

/// What noticed a failure.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Check {
    /// The fast renderer against the naive one.
    Truth,
    /// No visible part is missing.
    Set,
    /// The reference's images are equal.
    Image,
    /// The device's images are equal.
    DeviceImage,
    /// The culler repeats.
    Determinism,
    /// No more answers than questions.
    Counts,
    /// No promise of the culler, its index or its oracle is broken on the way.
    Invariant,
    /// Nothing panics.
    Panic,
    /// Every frame ends in time.
    Hang,
    /// The device repeats.
    Repeatable,
    /// The device stays.
    Lost,
}

impl Check {
    /// Its name in failure lines and tables.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Truth => "truth",
            Self::Set => "set",
            Self::Image => "image",
            Self::DeviceImage => "device image",
            Self::Determinism => "determinism",
            Self::Counts => "counts",
            Self::Invariant => "invariant",
            Self::Panic => "panic",
            Self::Hang => "hang",
            Self::Repeatable => "device not repeatable",
            Self::Lost => "oracle",
        }
    }

    /// What a lane comes to in which it fails.
    #[must_use]
    pub const fn ruling(self) -> Ruling {
        match self {
            Self::Repeatable => Ruling::NotRepeatable,
            Self::Lost => Ruling::Lost,
            _ => Ruling::Failed,
        }
    }
}

/// What a lane, or all lanes of a run, came to; the worst is the greatest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Ruling {
    /// Everything held, though for policies that trust a stale "hidden" perhaps late.
    #[default]
    Held,
    /// The device answered one question in two ways. No check failed.
    NotRepeatable,
    /// The device went away. No check failed before.
    Lost,
    /// A check failed.
    Failed,
}

impl Ruling {
    /// The word of tables and verdicts.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Held => "held",
            Self::NotRepeatable => "device not repeatable",
            Self::Lost => "device lost",
            Self::Failed => "failed",
        }
    }

    /// The ruling of a word as reports have it; `held late(k)` is held.
    #[must_use]
    pub fn of(word: &str) -> Option<Self> {
        let all = [Self::Held, Self::NotRepeatable, Self::Lost, Self::Failed];
        let late = word.starts_with("held late(").then_some(Self::Held);
        all.into_iter().find(|ruling| ruling.word() == word).or(late)
    }
}

impl fmt::Display for Ruling {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.word())
    }
}

/// One thing that is wrong with a lane.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// What noticed.
    pub check: Check,
    /// When first; `None` before the first frame.
    pub moment: Option<Moment>,
    /// In words: a line that begins with the check's name.
    pub line: String,
}

impl Failure {
    /// Of a check, its name before what it says.
    pub(super) fn new(check: Check, moment: Option<Moment>, said: impl fmt::Display) -> Self {
        Self { check, moment, line: format!("{}: {said}", check.name()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_read_back() {
        for ruling in [Ruling::Held, Ruling::NotRepeatable, Ruling::Lost, Ruling::Failed] {
            assert_eq!(Ruling::of(ruling.word()), Some(ruling));
        }
        assert_eq!(Ruling::of("held late(3)"), Some(Ruling::Held));
        assert_eq!(Ruling::of("fine"), None);
    }

    /// A real failure is worse than a device that is at fault, and that than nothing.
    #[test]
    fn the_worst_is_the_greatest() {
        assert!(Ruling::Held < Ruling::NotRepeatable && Ruling::NotRepeatable < Ruling::Lost);
        assert!(Ruling::Lost < Ruling::Failed);
    }
}
