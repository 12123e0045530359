//! Faults of what is remembered from frame to frame: the real `full` by broken rules of history.

use super::{Fault, Harm, Rig, two_pass};
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

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault {
        name: "postponed-hides",
        bug: 56,
        summary: "a part whose question is postponed counts as invisible meanwhile",
        harm: Harm::Drops,
        scenes: &["hard/orthographic", "hard/layers"],
        sound: FULL,
        broken: Rig {
            culler: |s| Box::new(Full::<PostponedHides>::by_rules(s, FullKnobs::default())),
            ..FULL
        },
    },
    Fault {
        name: "streak-stays",
        bug: 56,
        summary: "the row of \"visible\" answers is not ended by \"hidden\", and questions wait too long",
        harm: Harm::Overdraws,
        scenes: &["hard/ping-pong", "hard/teleports"],
        sound: FULL,
        broken: Rig {
            culler: |s| Box::new(Full::<StreakStays>::by_rules(s, FullKnobs::default())),
            ..FULL
        },
    },
    Fault {
        name: "children-inherit",
        bug: 60,
        summary: "nodes below one that was hidden count as hidden when it comes into view",
        harm: Harm::Drops,
        scenes: &["hard/ping-pong", "hard/orthographic"],
        sound: FULL,
        broken: Rig {
            culler: |s| Box::new(Full::<ChildrenInherit>::by_rules(s, FullKnobs::default())),
            ..FULL
        },
    },
];
