//! Probes: situations that a sweep should reach, or it proves less than it seems to. A probe never reached
//! over a whole sweep is said.

use std::fmt;

use crate::cull::{Situation, Situations};
use crate::index::Shape;
use crate::math::Aabb;
use crate::run::{FrameRecord, Moment};

/// A situation of a world, of a culler or of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Probe {
    /// Of a culler.
    Culler(Situation),
    /// A part shows that did not in the frame before.
    Appeared,
    /// A part does not show that did in the frame before.
    Vanished,
    /// Nothing shows at all.
    NothingShows,
    /// All of more than one part show.
    EverythingShows,
    /// An object jumped.
    Jumped,
    /// A moving object is where its first space does not reach.
    LeftSpace,
    /// The eye is in the box of an object.
    EyeInBox,
    /// The box of an object has no volume.
    FlatObject,
    /// A hidden answer came back as "visible".
    FalseVisible,
    /// A batch was back before an earlier one.
    Overtaken,
    /// The device went away, and the run ended in an error.
    Lost,
    /// The device hung, and the run ended in an error.
    Hung,
    /// The answer to a question was never written, and was taken for "visible".
    Unwritten,
    /// A draw had to wait for its mesh.
    LoadedLate,
    /// A mesh that was loaded ahead was drawn.
    LoadedAhead,
    /// A mesh was thrown out of memory.
    ThrownOut,
    /// An index beside the run has six levels or more.
    DeepIndex,
    /// An index beside the run has ten objects or more at one node.
    FullNode,
    /// Things stuck out of the root's box of an index beside the run.
    Strays,
    /// The world is a large one.
    Large,
}

/// From so many levels on an index is deep.
const DEEP: u32 = 6;
/// From so many objects on a node is full.
const FULL: u32 = 10;

/// Those that are of no culler.
const OTHERS: [Probe; 20] = [
    Probe::Appeared,
    Probe::Vanished,
    Probe::NothingShows,
    Probe::EverythingShows,
    Probe::Jumped,
    Probe::LeftSpace,
    Probe::EyeInBox,
    Probe::FlatObject,
    Probe::FalseVisible,
    Probe::Overtaken,
    Probe::Lost,
    Probe::Hung,
    Probe::Unwritten,
    Probe::LoadedLate,
    Probe::LoadedAhead,
    Probe::ThrownOut,
    Probe::DeepIndex,
    Probe::FullNode,
    Probe::Strays,
    Probe::Large,
];

impl Probe {
    /// All there are.
    pub fn all() -> impl Iterator<Item = Self> {
        Situation::ALL.into_iter().map(Self::Culler).chain(OTHERS)
    }

    /// Its place among all.
    fn place(self) -> usize {
        match self {
            Self::Culler(situation) => situation as usize,
            other => {
                let place = OTHERS.iter().position(|probe| *probe == other);
                Situation::ALL.len() + place.expect("every probe is in the list")
            }
        }
    }
}

impl fmt::Display for Probe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Culler(situation) => return situation.fmt(f),
            Self::Appeared => "a part came into sight",
            Self::Vanished => "a part went out of sight",
            Self::NothingShows => "nothing showed",
            Self::EverythingShows => "every part showed",
            Self::Jumped => "an object jumped",
            Self::LeftSpace => "an object left the first frame's space",
            Self::EyeInBox => "the eye was in an object's box",
            Self::FlatObject => "an object had no volume",
            Self::FalseVisible => "the device said visible of what is hidden",
            Self::Overtaken => "a batch overtook another",
            Self::Lost => "the device went away",
            Self::Hung => "the device hung",
            Self::Unwritten => "an answer was never written",
            Self::LoadedLate => "a draw waited for its mesh",
            Self::LoadedAhead => "a mesh loaded ahead was drawn",
            Self::ThrownOut => "a mesh was thrown out of memory",
            Self::DeepIndex => "an index had six levels or more",
            Self::FullNode => "a node of an index had ten objects or more",
            Self::Strays => "objects stuck out of an index's root",
            Self::Large => "the world was large",
        })
    }
}

/// Which probes one world reached, in the order of [`Probe::all`].
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Reached(Vec<bool>);

impl Default for Reached {
    fn default() -> Self {
        Self(vec![false; Situation::ALL.len() + OTHERS.len()])
    }
}

impl Reached {
    /// Adds one where it is so.
    pub fn note(&mut self, probe: Probe, so: bool) {
        if so {
            self.0[probe.place()] = true;
        }
    }

    /// Adds a culler's situations.
    pub fn note_situations(&mut self, situations: Situations) {
        for (place, situation) in Situation::ALL.into_iter().enumerate() {
            self.0[place] |= situations.contains(situation);
        }
    }

    /// Those that were reached.
    #[must_use]
    pub fn probes(&self) -> Vec<Probe> {
        Probe::all().zip(&self.0).filter(|(_, there)| **there).map(|(p, _)| p).collect()
    }
}

/// Watches a world frame by frame.
#[derive(Debug, Default)]
pub(super) struct Watch {
    pub(super) reached: Reached,
    /// By view, whether each part shows in its last frame.
    before: Vec<Vec<bool>>,
    /// What holds every object in frame 0: the space that an index is built over.
    space: Option<Aabb>,
}

impl Watch {
    /// Notes how large and deep an index is.
    pub(super) fn shape(&mut self, shape: Shape) {
        self.reached.note(Probe::DeepIndex, shape.depth >= DEEP);
        self.reached.note(Probe::FullNode, shape.fullest >= FULL);
        self.reached.note(Probe::Strays, shape.strays && shape.depth > 0);
    }

    pub(super) fn frame(&mut self, record: &FrameRecord<'_>) {
        let (state, truth) = (record.state, record.truth);
        let Moment { frame, view } = state.moment;
        let shows: Vec<bool> = truth.visible_pixels.iter().map(|&pixels| pixels > 0).collect();
        let view = view as usize;
        if frame == 0 {
            self.before.push(Vec::new());
        } else {
            let pairs = || self.before[view].iter().zip(&shows);
            let (new, gone) = (pairs().any(|(a, b)| !a && *b), pairs().any(|(a, b)| *a && !b));
            self.reached.note(Probe::Appeared, new);
            self.reached.note(Probe::Vanished, gone);
        }
        let all = shows.len() > 1 && shows.iter().all(|shows| *shows);
        self.reached.note(Probe::NothingShows, truth.visible_parts == 0);
        self.reached.note(Probe::EverythingShows, all);
        self.before[view] = shows;
        self.reached.note(Probe::Jumped, !state.jumped.is_empty());
        let union = || state.objects.iter().fold(Aabb::EMPTY, |all, o| all.union(&o.bounds));
        let space = *self.space.get_or_insert_with(union);
        let out = state.moved.iter().any(|id| !space.contains(&state.boxes[id.0 as usize]));
        self.reached.note(Probe::LeftSpace, out);
        let bounds = || state.objects.iter().map(|object| object.bounds);
        let eye = state.camera.eye;
        self.reached.note(Probe::EyeInBox, bounds().any(|aabb| aabb.contains_point(eye)));
        let flat = |aabb: &Aabb| !aabb.is_empty() && aabb.size().min_element() == 0.0;
        let meshes = record.world.partition.meshes();
        self.reached.note(Probe::FlatObject, meshes.iter().any(|mesh| flat(&mesh.bounds)));
    }
}
