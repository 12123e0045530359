//! Faults: cullers, oracles, indexes and math broken on purpose, one real bug class each, to see that the
//! bench notices. A check earns its trust here: a fault that gets through is a hole in the gate, a failure
//! of an unbroken culler a false alarm. It must not know reports.
//!
//! A fault is a [`Rig`] (culler, index, oracle) that differs from a sound rig in one respect. Nothing of
//! it is in the way of what a run calls: broken rules are types, broken parts wrap sound ones.
//!
//! | file | what is broken |
//! |---|---|
//! | `two_pass` | a culler as engines have it: projections, tests, lists, views |
//! | `spheres` | spheres against planes |
//! | `blocks` | objects by the blocks of space that they are in |
//! | `volumes` | a tree of boxes in f32 |
//! | `shadows` | what lies in the shadow of a triangle |
//! | `sight` | what a sound culler is shown |
//! | `history` | what `full` remembers |
//! | `pyramid` | hierarchical z |
//! | `answers` | what becomes of questions and answers |
//! | `structure` | the scene tree's upkeep, the cut |

mod answers;
mod blocks;
mod history;
mod pyramid;
mod shadows;
mod sight;
mod spheres;
mod structure;
mod trial;
mod two_pass;
mod volumes;

use crate::cull::{Culler, CullerSetup};
use crate::index::{Entry, Index};
use crate::oracle::{Oracle, Stage};
use crate::part::PartedMesh;

pub use trial::{Evidence, Trial, false_alarms, first_failure, world};

/// Makes an oracle over a stage.
pub type MakeOracle = fn(Stage) -> Box<dyn Oracle>;
/// Makes a culler from what it stands on.
pub type MakeCuller = fn(CullerSetup) -> Box<dyn Culler>;
/// Makes an index over the objects of frame 0.
pub type MakeIndex = fn(&[Entry]) -> Box<dyn Index>;

/// A culler with what it stands on.
#[derive(Clone, Copy, Debug)]
pub struct Rig {
    /// Name for reports.
    pub name: &'static str,
    /// The culler.
    pub culler: MakeCuller,
    /// The index it is given.
    pub index: MakeIndex,
    /// The oracle it asks.
    pub oracle: MakeOracle,
    /// Whether one culler serves all views of a frame, and tells them apart itself.
    pub keeps_views: bool,
    /// What is done to each mesh after it is cut.
    pub alter: Option<fn(&mut PartedMesh)>,
}

/// What a fault does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Harm {
    /// Something visible is not drawn: the picture changes.
    Drops,
    /// It errs towards visible: the picture holds, more is drawn or asked than by the sound rig.
    Overdraws,
}

/// One seeded fault.
#[derive(Clone, Copy, Debug)]
pub struct Fault {
    /// Name for flags and reports.
    pub name: &'static str,
    /// Its number in the list of bug classes, 1 to [`BUG_CLASSES`].
    pub bug: u8,
    /// What is wrong, in a line.
    pub summary: &'static str,
    /// What it does.
    pub harm: Harm,
    /// Scenes in which it shows, the likeliest first.
    pub scenes: &'static [&'static str],
    /// What it is a broken form of.
    pub sound: Rig,
    /// The broken form.
    pub broken: Rig,
}

impl Fault {
    /// A fault that changes the picture.
    const fn drops(
        (name, bug): (&'static str, u8),
        summary: &'static str,
        scenes: &'static [&'static str],
        (sound, broken): (Rig, Rig),
    ) -> Self {
        Self { name, bug, summary, harm: Harm::Drops, scenes, sound, broken }
    }

    /// A fault that errs towards visible.
    const fn overdraws(
        named: (&'static str, u8),
        summary: &'static str,
        scenes: &'static [&'static str],
        rigs: (Rig, Rig),
    ) -> Self {
        Self { harm: Harm::Overdraws, ..Self::drops(named, summary, scenes, rigs) }
    }
}

/// How many bug classes the list has.
pub const BUG_CLASSES: u8 = 69;

/// Every seeded fault, by number of its bug class.
#[must_use]
pub fn faults() -> Vec<Fault> {
    let families = [
        two_pass::FAULTS,
        spheres::FAULTS,
        blocks::FAULTS,
        volumes::FAULTS,
        shadows::FAULTS,
        sight::FAULTS,
        history::FAULTS,
        pyramid::FAULTS,
        answers::FAULTS,
        structure::FAULTS,
    ];
    let mut all = families.concat();
    all.sort_by_key(|fault| fault.bug);
    all
}

/// The sound rigs that faults are broken forms of.
pub const SOUND: &[Rig] = &[
    history::FULL,
    history::VFC,
    two_pass::EXACT,
    two_pass::PYRAMID,
    spheres::RIG,
    blocks::RIG,
    volumes::RIG,
    shadows::RIG,
];

/// Bug classes that are no fault of a culler's as it is here, with what holds them or what they await.
pub const OTHERS: &[(u8, &str)] = &[
    (9, "orthographic camera: hard/orthographic"),
    (20, "scale changed at run time: awaits an effect that scales"),
    (26, "wide cones: hard/wide-angle; cones themselves await a culler that uses them"),
    (28, "T-junctions against the device's coverage: hard/t-junctions"),
    (30, "alpha-tested or transparent occluders: awaits materials"),
    (40, "the eye on the cusp of a query box: hard/cusp, hard/ping-pong"),
    (42, "samples in place of pixels: awaits multisampling"),
    (46, "done after failing through the first portal: awaits portals"),
    (48, "incoming directions reset in a cell graph: awaits portals"),
    (49, "a vertex on the plane lost while a portal is clipped: awaits portals"),
    (51, "an off-screen shadow caster culled: awaits lights"),
    (53, "an old index into the table of levels: awaits LOD"),
];

/// The hard cases of the list, bug classes that a correct culler must survive, with the scenes that are
/// theirs; without a scene where [`OTHERS`] says what is awaited.
pub const HARD_CASES: &[(u8, &[&str])] = &[
    (2, &["hard/last-column", "hard/odd-viewport"]),
    (5, &["hard/pinholes", "hard/infinite-far"]),
    (8, &["hard/behind-a-gap", "hard/wide-angle"]),
    (9, &["hard/orthographic"]),
    (10, &["hard/asymmetric", "hard/stereo"]),
    (12, &["hard/near-plane", "hard/eye-on-box"]),
    (15, &["hard/infinite-far"]),
    (17, &["hard/collapsed", "hard/overflow"]),
    (19, &["hard/scales"]),
    (23, &["hard/flat"]),
    (24, &["hard/far-from-origin", "hard/far-in-mesh", "hard/overflow"]),
    (25, &["hard/specks", "hard/needles"]),
    (26, &["hard/wide-angle"]),
    (27, &["hard/pinholes", "hard/grazing"]),
    (28, &["hard/t-junctions"]),
    (31, &["hard/near-plane", "hard/wide-viewport"]),
    (40, &["hard/cusp", "hard/ping-pong"]),
    (42, &[]),
    (49, &[]),
    (61, &["hard/spars"]),
    (62, &["hard/poles"]),
    (63, &["hard/crossed-spars"]),
    (64, &["hard/world-edge"]),
    (65, &["hard/endless-sides"]),
    (66, &["hard/parallel-shadow"]),
    // A face parallel to the screen, which is its own box's front.
    (69, &["hard/pinholes", "hard/touching"]),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::generate::HARD;

    #[test]
    fn every_class_is_seeded_or_told_of() {
        let faults = faults();
        for bug in 1..=BUG_CLASSES {
            let seeded = faults.iter().filter(|fault| fault.bug == bug).count();
            let told = OTHERS.iter().filter(|(other, _)| *other == bug).count();
            assert!((seeded > 0) != (told == 1), "class {bug}: {seeded} seeded, {told} told of");
        }
        let mut names: Vec<&str> = faults.iter().map(|fault| fault.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), faults.len());
        let mut classes: Vec<u8> = faults.iter().map(|fault| fault.bug).collect();
        classes.dedup();
        assert!(classes.len() >= 40, "{} classes are seeded", classes.len());
        for (class, scenes) in HARD_CASES {
            let awaits = OTHERS.iter().any(|(other, _)| other == class);
            assert!(!scenes.is_empty() || awaits, "hard case {class} has neither scene nor reason");
        }
        let cases = HARD_CASES.iter().flat_map(|(_, scenes)| *scenes);
        let hard = |scene: &str| HARD.iter().any(|generator| generator.name == scene);
        assert!(faults.iter().flat_map(|fault| fault.scenes).chain(cases).all(|scene| hard(scene)));
    }
}
