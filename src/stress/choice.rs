//! What a seed picks beside the scene: the picture, the cut, the culler and what it stands on, the device.

use std::fmt;

use super::array::{Axis, level};
use super::knobs::{Policy, index_knobs};
use crate::cull::{Culler, CullerKind, CullerSetup, ProxyKind};
use crate::index::{Entry, INDEXES, Index, IndexKind, IndexKnobs};
use crate::oracle::{
    CostModel, HierarchicalZ, Latency, MemoryKnobs, Misbehaviour, Oracle, OracleError, Questions,
    Schedule, Sim, Simulated, Stage, Tables, least_budget,
};
use crate::part::{Crossing, Partition, PartitionKnobs};
use crate::run::Canary;
use crate::scene::generate::{Knobs, SWARM, build};
use crate::scene::{DepthOrder, Scene, SceneError, Stream, Viewport};

/// What answers exactly or errs towards visible, without a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The reference, exact and at once.
    Sim,
    /// A pyramid of its depth.
    HierarchicalZ,
    /// Tables of maxima of its depth.
    Tables,
}

impl Source {
    fn name(self) -> &'static str {
        match self {
            Self::Sim => "sim",
            Self::HierarchicalZ => "hierarchical-z",
            Self::Tables => "tables",
        }
    }

    /// An oracle of its own over the stage.
    fn oracle(self, stage: Stage) -> Box<dyn Oracle> {
        match self {
            Self::Sim => Box::new(Sim::new(stage)),
            Self::HierarchicalZ => Box::new(HierarchicalZ::new(stage)),
            Self::Tables => Box::new(Tables::new(stage)),
        }
    }
}

/// What answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Device {
    /// At once.
    Plain(Source),
    /// The simulated device under a schedule.
    Simulated(Source, Schedule),
    /// A real device.
    Real(Questions),
}

/// How much geometry the device may hold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Room {
    /// The largest mesh alone: the least budget there is.
    Least,
    /// Half as much again.
    Tight,
    /// Everything.
    Ample,
}

/// Everything that a seed picks but the scene itself.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The seed, also the scene's.
    pub seed: u64,
    /// Times as many objects as the scene has by itself.
    pub scale: f64,
    /// Pixels.
    pub viewport: Viewport,
    /// Which way depth runs.
    pub depth: DepthOrder,
    /// Frames of the run.
    pub frames: u32,
    /// The cut.
    pub partition: PartitionKnobs,
    /// The culler.
    pub culler: CullerKind,
    /// Other knobs of the culler than its own.
    pub policy: Option<Policy>,
    /// The index under it.
    pub index: IndexKind,
    /// Other knobs of the index than the usual ones.
    pub index_knobs: Option<IndexKnobs>,
    /// An index beside it, told of the same moves and held to its promises, with knobs of its own.
    pub beside: IndexKind,
    /// What it asks about.
    pub proxy: ProxyKind,
    /// What work costs, for cullers that weigh it and for the virtual clock.
    pub cost: CostModel,
    /// The device's memory, and bytes that may be loaded ahead of a frame; `None` without a limit.
    pub memory: Option<(Room, u64)>,
    /// What answers.
    pub device: Device,
    /// What is wrong on purpose with the world: no seed picks any.
    pub canary: Option<Canary>,
}

/// The seed that a user wrote: a number, or the first sixteen digits of a commit's hash of forty, so that a
/// commit can name its own worlds.
///
/// # Errors
/// Where it is neither.
pub fn seed_of(text: &str) -> Result<u64, String> {
    let is_hash = text.len() == 40 && text.bytes().all(|b| b.is_ascii_hexdigit());
    let seed = if is_hash { u64::from_str_radix(&text[..16], 16) } else { text.parse() };
    seed.map_err(|_| format!("'{text}' is no seed: write a number or a commit's hash of 40 digits"))
}

/// Most worlds are small; one in so many is large.
pub const LARGE_ONE_IN: u64 = 50;
/// Which of them is.
const LARGE: u64 = 13;
/// Times as many objects as a small world has.
const LARGE_SCALE: f64 = 20.0;
/// A world of small leaves has thousands of parts: it has the fewer objects.
const SMALL_LEAVES_SCALE: f64 = 0.4;

/// Axes of the array that worlds are drawn from; their order means nothing.
mod axis {
    use crate::stress::array::Axis;

    pub(super) const PICTURE: Axis = Axis(0);
    pub(super) const DEPTH: Axis = Axis(1);
    pub(super) const FRAMES: Axis = Axis(2);
    pub(super) const LEAF: Axis = Axis(3);
    pub(super) const CROSSING: Axis = Axis(4);
    pub(super) const CULLER: Axis = Axis(5);
    pub(super) const PROXY: Axis = Axis(6);
    pub(super) const INDEX: Axis = Axis(7);
    pub(super) const COST: Axis = Axis(8);
    pub(super) const DEVICE: Axis = Axis(9);
    pub(super) const LATENCY: Axis = Axis(10);
    pub(super) const DOUBT: Axis = Axis(11);
    pub(super) const LIMITS: Axis = Axis(12);
    pub(super) const KNOBS: Axis = Axis(13);
    pub(super) const MEMORY: Axis = Axis(14);
    pub(super) const MISBEHAVIOUR: Axis = Axis(15);
    pub(super) const BESIDE: Axis = Axis(16);
}

/// Pictures: the usual one, and sizes at and beside the sides of tiles, blocks and levels.
const PICTURES: [[u32; 2]; 16] = [
    [160, 120],
    [160, 120],
    [160, 120],
    [160, 120],
    [97, 61],
    [97, 61],
    [97, 61],
    [257, 33],
    [31, 200],
    [65, 63],
    [64, 64],
    [129, 72],
    [72, 129],
    [9, 7],
    [1, 90],
    [1, 1],
];

/// What work costs where questions are all but free: cullers that weigh them ask as much as they can.
fn free_questions() -> CostModel {
    CostModel {
        name: "free-questions".to_owned(),
        source: "made up, so that every question pays".to_owned(),
        query_ns: 1.0,
        proxy_ns: 0.0,
        pixel_ns: 0.0,
        trip_ns: 1.0,
        ..CostModel::lavapipe()
    }
}

/// Something that goes wrong in the first frames, of that kind.
fn misbehaviour(kind: usize, seed: u64) -> Option<Misbehaviour> {
    let mut wrong = Stream::new(seed, "misbehaviour");
    match kind {
        0 => Some(Misbehaviour::Lost(wrong.below(40))),
        1 => Some(Misbehaviour::Hangs(wrong.below(40))),
        2 => Some(Misbehaviour::Unwritten(wrong.below(60))),
        _ => None,
    }
}

impl Choice {
    /// What `seed` picks among `cullers`, of which there is at least one; on real devices by each of `real`,
    /// if any are given, in the place of simulated ones.
    ///
    /// # Panics
    /// Without cullers.
    #[must_use]
    pub fn of(seed: u64, cullers: &[CullerKind], real: &[Questions]) -> Self {
        fn pick<T: Clone>(seed: u64, axis: Axis, list: &[T]) -> T {
            list[level(seed, axis, list.len())].clone()
        }
        let large = seed % LARGE_ONE_IN == LARGE;
        let [width, height] = pick(seed, axis::PICTURE, &PICTURES);
        let depth = pick(
            seed,
            axis::DEPTH,
            &[DepthOrder::Forward, DepthOrder::Forward, DepthOrder::Reversed],
        );
        let usual = SWARM.frames;
        let frames = pick(seed, axis::FRAMES, &[usual, usual, usual, usual, usual, 3, 3, 24]);
        let usual = SWARM.leaf_triangles;
        let leaves = [usual, usual, usual, usual, usual, usual, usual, 1000, 1000, 1000, 7];
        let leaf_triangles = pick(seed, axis::LEAF, &leaves);
        let crossing = pick(
            seed,
            axis::CROSSING,
            &[Crossing::Split, Crossing::Split, Crossing::Split, Crossing::Whole, Crossing::Whole],
        );
        let mut partition = PartitionKnobs { leaf_triangles, crossing };
        let mut culler = pick(seed, axis::CULLER, cullers);
        let mut index = pick(seed, axis::INDEX, INDEXES);
        let proxies = [ProxyKind::Rectangle, ProxyKind::Hull, ProxyKind::Box];
        let proxy = pick(seed, axis::PROXY, &proxies);
        let free = [free_questions(), free_questions(), free_questions()];
        let costs = [CostModel::named().to_vec(), free.to_vec()].concat();
        let cost = pick(seed, axis::COST, &costs);
        let latency = pick(
            seed,
            axis::LATENCY,
            &[Latency::Even, Latency::Jittery, Latency::Spiky, Latency::Spiky],
        );
        let doubt = pick(seed, axis::DOUBT, &[0.0, 0.0, 0.0, 0.05, 0.05, 0.5, 1.0]);
        // One device in eight goes wrong, a simulated one always.
        let misbehaviour = misbehaviour(level(seed, axis::MISBEHAVIOUR, 23), seed);
        let schedule = Schedule { seed, latency, doubt, misbehaviour };
        let device = match level(seed, axis::DEVICE, 10) {
            _ if !real.is_empty() => Device::Real(pick(seed, axis::DEVICE, real)),
            1 | 2 if misbehaviour.is_some() => Device::Simulated(Source::HierarchicalZ, schedule),
            3 | 4 if misbehaviour.is_some() => Device::Simulated(Source::Tables, schedule),
            0 if misbehaviour.is_some() => Device::Simulated(Source::Sim, schedule),
            0 => Device::Plain(Source::Sim),
            1 | 2 => Device::Plain(Source::HierarchicalZ),
            3 | 4 => Device::Plain(Source::Tables),
            5 => Device::Simulated(Source::HierarchicalZ, schedule),
            6 => Device::Simulated(Source::Tables, schedule),
            _ => Device::Simulated(Source::Sim, schedule),
        };
        let rooms = [None, None, None, Some(Room::Least), Some(Room::Tight), Some(Room::Ample)];
        let ahead = Stream::new(seed, "memory").pick(&[0, 1, 4096, MemoryKnobs::PREFETCH_BYTES]);
        let memory = pick(seed, axis::MEMORY, &rooms).map(|room| (room, ahead));
        let (mut frames, mut viewport) = (frames, Viewport { width, height });
        let mut scale = if leaf_triangles < usual { SMALL_LEAVES_SCALE } else { 1.0 };
        if large {
            // Trees get deep, batches full and lists long; the time goes into objects alone. Members of the
            // largest families come in turn.
            let number = (seed / LARGE_ONE_IN) as usize;
            (scale, frames, viewport) = (LARGE_SCALE, 3, Viewport { width: 97, height: 61 });
            partition.leaf_triangles = 1000;
            culler = cullers[number % cullers.len()];
            index = INDEXES[(number + number / INDEXES.len()) % INDEXES.len()];
        }
        let policy = match level(seed, axis::LIMITS, 3) {
            0 => None,
            _ => Policy::of(seed, culler.name),
        };
        let index_knobs =
            (level(seed, axis::KNOBS, 3) > 0).then(|| index_knobs(seed, "index knobs"));
        Self {
            seed,
            scale,
            viewport,
            depth,
            frames,
            partition,
            culler,
            policy,
            index,
            index_knobs,
            beside: pick(seed, axis::BESIDE, INDEXES),
            proxy,
            cost,
            memory,
            device,
            canary: None,
        }
    }

    /// Whether the world is one of the large ones.
    #[must_use]
    pub fn is_large(&self) -> bool {
        self.seed % LARGE_ONE_IN == LARGE
    }

    /// The scene.
    ///
    /// # Errors
    /// None that a seed can lead to; what a generator says.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let knobs = Knobs {
            seed: Some(self.seed),
            scale: Some(self.scale),
            frames: Some(self.frames),
            viewport: Some(self.viewport),
            depth: Some(self.depth),
            ..Knobs::default()
        };
        build(SWARM.name, &knobs)
    }
}

impl Choice {
    /// What the device does wrong, if anything.
    #[must_use]
    pub fn misbehaviour(&self) -> Option<Misbehaviour> {
        match self.device {
            Device::Simulated(_, schedule) => schedule.misbehaviour,
            _ => None,
        }
    }

    /// An oracle over the stage; `real` makes one of a real device, and is asked only for that.
    ///
    /// # Errors
    /// What `real` says.
    pub(super) fn oracle(
        &self,
        stage: Stage,
        real: &super::MakeReal<'_>,
    ) -> Result<Box<dyn Oracle>, OracleError> {
        Ok(match self.device {
            Device::Plain(source) => source.oracle(stage),
            Device::Simulated(source, schedule) => {
                let inner = source.oracle(stage.clone());
                Box::new(Simulated::over(inner, stage, self.cost.clone(), schedule))
            }
            Device::Real(questions) => real(&stage, questions)?,
        })
    }

    /// A culler over the index and partition of a setup.
    pub(super) fn make(&self, setup: CullerSetup) -> Box<dyn Culler> {
        match &self.policy {
            Some(policy) => policy.make(setup),
            None => (self.culler.make)(setup),
        }
    }

    /// The index over the objects of frame 0.
    pub(super) fn build(&self, entries: &[Entry]) -> Box<dyn Index> {
        match &self.index_knobs {
            Some(knobs) => (self.index.with)(entries, knobs),
            None => (self.index.build)(entries),
        }
    }

    /// The memory of a device that draws the parts of `partition`.
    pub(super) fn memory_knobs(&self, partition: &Partition) -> Option<MemoryKnobs> {
        let (room, prefetch_bytes) = self.memory?;
        let least = least_budget(partition);
        let budget_bytes = match room {
            Room::Least => least,
            Room::Tight => least + least / 2,
            Room::Ample => u64::from(u32::MAX),
        };
        Some(MemoryKnobs { budget_bytes, prefetch_bytes })
    }

    /// The same with one thing as plain as it can be; `None` after the last of these steps.
    #[must_use]
    pub fn simpler(&self, step: usize) -> Option<Self> {
        let sound = |Schedule { seed, .. }: Schedule| Schedule { seed, ..Schedule::default() };
        let device = match self.device {
            Device::Simulated(source, schedule) => Device::Simulated(source, sound(schedule)),
            other => other,
        };
        let at_once = match self.device {
            Device::Simulated(source, _) => Device::Plain(source),
            other => other,
        };
        let split = PartitionKnobs { crossing: Crossing::Split, ..self.partition };
        let list: [&dyn Fn(Self) -> Self; 10] = [
            &|choice| Self { policy: None, ..choice },
            &|choice| Self { index_knobs: None, ..choice },
            &|choice| Self { memory: None, ..choice },
            &|choice| Self { device, ..choice },
            &|choice| Self { device: at_once, ..choice },
            &|choice| Self { device: Device::Plain(Source::Sim), ..choice },
            &|choice| Self { proxy: ProxyKind::Rectangle, ..choice },
            &|choice| Self { cost: CostModel::lavapipe(), ..choice },
            &|choice| Self { partition: split, ..choice },
            &|choice| Self { index: INDEXES[INDEXES.len() - 1], ..choice },
        ];
        list.get(step).map(|simpler| simpler(self.clone()))
    }

    /// What it has that no flag of `run` picks, each in a few words.
    #[must_use]
    pub fn beyond_flags(&self) -> Vec<&'static str> {
        let simulated =
            matches!(self.device, Device::Simulated(source, _) if source != Source::Sim);
        let all = [
            ("the limits of the culler", self.policy.is_some()),
            ("the knobs of the index", self.index_knobs.is_some()),
            ("memory by the byte", self.memory.is_some()),
            ("the oracle under the simulated device", simulated),
            ("the cost model", CostModel::named().iter().all(|m| m.name != self.cost.name)),
        ];
        all.into_iter().filter(|(_, there)| *there).map(|(what, _)| what).collect()
    }

    /// The flags of `run` that pick the same beside a scene file, but for [`Choice::beyond_flags`]; each with a
    /// space before it.
    #[must_use]
    pub fn flags(&self) -> String {
        let mut flags = format!(" --culler {} --index {}", self.culler.name, self.index.name);
        match self.device {
            Device::Plain(source) => flags += &format!(" --oracle {}", source.name()),
            Device::Simulated(_, Schedule { latency, doubt, misbehaviour, .. }) => {
                flags +=
                    &format!(" --oracle simulated --latency {} --doubt {doubt}", latency.name());
                if let Some(misbehaviour) = misbehaviour {
                    flags += &format!(" --misbehave {misbehaviour}");
                }
            }
            Device::Real(questions) => flags += &format!(" --oracle {}", questions.name()),
        }
        flags += match self.proxy {
            ProxyKind::Rectangle => "",
            ProxyKind::Hull => " --proxy hull",
            ProxyKind::Box => " --proxy box",
        };
        if self.partition.crossing == Crossing::Whole {
            flags += " --parts whole";
        }
        if self.cost.name != CostModel::lavapipe().name {
            flags += &format!(" --cost {}", self.cost.name);
        }
        flags
    }
}

impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Viewport { width, height } = self.viewport;
        let depth = match self.depth {
            DepthOrder::Forward => "",
            DepthOrder::Reversed => ", reversed depth",
        };
        let parts = match self.partition.crossing {
            Crossing::Split => "split",
            Crossing::Whole => "whole",
        };
        let proxy = match self.proxy {
            ProxyKind::Rectangle => "rectangle",
            ProxyKind::Hull => "hull",
            ProxyKind::Box => "box",
        };
        write!(
            f,
            "{width}x{height}{depth}, {} frames, leaf {} {parts}, {} over {}, {proxy}, cost {}, on ",
            self.frames,
            self.partition.leaf_triangles,
            self.culler.name,
            self.index.name,
            self.cost.name
        )?;
        if let Some(policy) = &self.policy {
            write!(f, "[{policy:?}] ")?;
        }
        if let Some(knobs) = &self.index_knobs {
            write!(f, "[{knobs:?}] ")?;
        }
        match self.device {
            Device::Plain(source) => f.write_str(source.name()),
            Device::Simulated(source, Schedule { latency, doubt, misbehaviour, .. }) => {
                let (latency, source) = (latency.name(), source.name());
                write!(f, "simulated (over {source}, {latency} latency, doubt {doubt}")?;
                match misbehaviour {
                    Some(misbehaviour) => write!(f, ", {misbehaviour})"),
                    None => f.write_str(")"),
                }
            }
            Device::Real(questions) => f.write_str(questions.name()),
        }?;
        match self.memory {
            Some((room, ahead)) => write!(f, ", {room:?} memory, {ahead} bytes ahead"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cull::CULLERS;

    #[test]
    fn seeds_are_numbers_or_commits() {
        assert_eq!(seed_of("7"), Ok(7));
        assert_eq!(seed_of("0123456789abcdef0123456789abcdef01234567"), Ok(0x0123_4567_89ab_cdef));
        for bad in ["", "-1", "abc", "0123456789abcdef0123456789abcdef0123456", "1.5"] {
            assert!(seed_of(bad).unwrap_err().contains("is no seed"), "{bad}");
        }
    }

    /// What is picked is a function of the seed, and the picture does not depend on the device.
    #[test]
    fn a_seed_picks_the_same() {
        let said = |seed| Choice::of(seed, CULLERS, &[]).to_string();
        assert_eq!(said(5), said(5));
        let real = Choice::of(5, CULLERS, &[Questions::Pyramid]);
        assert_eq!(real.device, Device::Real(Questions::Pyramid));
        assert_eq!(real.viewport, Choice::of(5, CULLERS, &[]).viewport);
    }

    /// The limits that are drawn reach their ends, for every culler that has any.
    #[test]
    fn limits_are_drawn_at_their_ends() {
        let choices = (0..3000).map(|seed| Choice::of(seed, CULLERS, &[]));
        let mut ends = [0; 5];
        for choice in choices {
            let (end, least) = match choice.policy {
                Some(Policy::Full(knobs)) => (0, knobs.most_in_flight == 1),
                Some(Policy::Waits(knobs)) => (1, knobs.most_in_flight == 1),
                Some(Policy::Adaptive(knobs)) => (2, knobs.first_layer == 1),
                Some(Policy::ChcPlus(knobs)) => (3, knobs.batch == 1),
                Some(Policy::Pipelined(knobs)) => (4, knobs.batch == 1 && knobs.most_batches == 1),
                None => continue,
            };
            ends[end] += usize::from(least);
        }
        assert!(ends.iter().all(|&times| times >= 5), "{ends:?}");
    }
}
