//! Faults of what is remembered from frame to frame: the real `full` by broken rules of history.

use super::{Fault, Rig, two_pass};
use crate::cull::ViewFrustum;
use crate::cull::full::{Full, FullKnobs, HistoryRules};
use crate::index::TwoLevelBsp;
use crate::oracle::Always;

struct PostponedHides;

impl HistoryRules for PostponedHides {
    const POSTPONED_SHOWS: bool = false;
}

struct StreakStays;

impl HistoryRules for StreakStays {
    const HIDDEN_ENDS_STREAK: bool = false;
}

struct ChildrenInherit;

impl HistoryRules for ChildrenInherit {
    const CHILDREN_STAND_ALONE: bool = false;
}

/// `full` as it is.
pub(super) const FULL: Rig = Rig {
    name: "full on sim",
    culler: |setup| Box::new(Full::new(setup, FullKnobs::default())),
    index: |entries| Box::new(TwoLevelBsp::new(entries)),
    keeps_views: false,
    ..two_pass::EXACT
};
/// `vfc` as it is.
pub(super) const VFC: Rig = Rig {
    name: "vfc",
    culler: |setup| Box::new(ViewFrustum::new(setup)),
    oracle: |_| Box::<Always>::default(),
    ..FULL
};

macro_rules! by {
    ($rules:ident) => {
        Rig {
            culler: |setup| Box::new(Full::<$rules>::by_rules(setup, FullKnobs::default())),
            ..FULL
        }
    };
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::drops(
        ("postponed-hides", 56),
        "a part whose question is postponed counts as invisible meanwhile",
        &["hard/orthographic", "hard/layers"],
        (FULL, by!(PostponedHides)),
    ),
    Fault::overdraws(
        ("streak-stays", 56),
        "the row of \"visible\" answers is not ended by \"hidden\", and questions wait too long",
        &["hard/ping-pong", "hard/teleports"],
        (FULL, by!(StreakStays)),
    ),
    Fault::drops(
        ("children-inherit", 60),
        "nodes below one that was hidden count as hidden when it comes into view",
        &["hard/ping-pong", "hard/orthographic"],
        (FULL, by!(ChildrenInherit)),
    ),
];
