//! What a seed picks beside the scene: the picture, the cut, the culler and what it stands on, the device.

use std::fmt;

use crate::cull::{AfterGroup, CullerKind, FullKnobs, Postponement, ProxyKind};
use crate::index::{INDEXES, IndexKind};
use crate::oracle::{CostModel, Latency, Misbehaviour, Questions, Schedule};
use crate::part::{Crossing, PartitionKnobs};
use crate::run::Canary;
use crate::scene::generate::{Knobs, SWARM, build};
use crate::scene::{DepthOrder, Scene, SceneError, Stream, Viewport};

/// What answers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Device {
    /// The reference, exact and at once.
    Sim,
    /// A pyramid of its depth.
    HierarchicalZ,
    /// The simulated device under a schedule.
    Simulated(Schedule),
    /// A real device.
    Real(Questions),
}

/// Everything that a seed picks but the scene itself.
#[derive(Clone, Debug)]
pub struct Choice {
    /// The seed, also the scene's.
    pub seed: u64,
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
    /// Of `full`, another policy than its own.
    pub policy: Option<FullKnobs>,
    /// The index under it.
    pub index: IndexKind,
    /// What it asks about.
    pub proxy: ProxyKind,
    /// What work costs, for cullers that weigh it and for the virtual clock.
    pub cost: CostModel,
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

/// Another policy of `full`; its own for one seed in three.
fn policy(seed: u64) -> Option<FullKnobs> {
    let mut policy = Stream::new(seed, "policy");
    let knobs = FullKnobs {
        most_in_flight: policy.pick(&[1024, 16, 1]),
        postponement: policy.pick(&[
            Postponement::Never,
            Postponement::Figure3,
            Postponement::Seldom,
        ]),
        most_together: policy.pick(&[1, 4, 16, 64]),
        after_group: policy.pick(&[AfterGroup::AskAgain, AfterGroup::Trust]),
        most_boxes: policy.pick(&[1, 4, 16]),
        tighten: policy.below(2) == 0,
        ..FullKnobs::default()
    };
    (policy.below(3) > 0).then_some(knobs)
}

impl Choice {
    /// What `seed` picks among `cullers`, of which there is at least one; on real devices by each of `real`,
    /// if any are given, in the place of simulated ones.
    ///
    /// # Panics
    /// Without cullers.
    #[must_use]
    pub fn of(seed: u64, cullers: &[CullerKind], real: &[Questions]) -> Self {
        // A stream a concern, so that one more culler does not move the picture.
        let mut picture = Stream::new(seed, "picture");
        let usual = SWARM.viewport;
        let sizes = [
            [usual.width, usual.height],
            [usual.width, usual.height],
            [usual.width, usual.height],
            [97, 61],
            [257, 33],
            [31, 200],
            [1, 1],
        ];
        let [width, height] = picture.pick(&sizes);
        let depth = match picture.below(4) {
            0 => DepthOrder::Reversed,
            _ => DepthOrder::Forward,
        };
        let frames = picture.pick(&[SWARM.frames, SWARM.frames, SWARM.frames, 3, 24]);
        let mut cut = Stream::new(seed, "cut");
        // Small leaves make thousands of parts, and most of a sweep's time: one world in eight has them.
        let usual = SWARM.leaf_triangles;
        let partition = PartitionKnobs {
            leaf_triangles: cut.pick(&[usual, usual, usual, usual, usual, 1000, 1000, 7]),
            crossing: if cut.below(4) == 0 { Crossing::Whole } else { Crossing::Split },
        };
        let mut culler = Stream::new(seed, "culler");
        let kind = culler.pick(cullers);
        let proxy = culler.pick(&[ProxyKind::Rectangle, ProxyKind::Hull, ProxyKind::Box]);
        let index = Stream::new(seed, "index").pick(INDEXES);
        let policy = (kind.name == FullKnobs::default().name).then(|| policy(seed)).flatten();
        let costs = CostModel::named();
        let cost = costs[culler.below(costs.len() as u32) as usize].clone();
        let mut device = Stream::new(seed, "device");
        let latency = device.pick(&[Latency::Even, Latency::Jittery, Latency::Spiky]);
        let doubt = device.pick(&[0.0, 0.0, 0.05, 0.5, 1.0]);
        let mut wrong = Stream::new(seed, "misbehaviour");
        // One device in ten goes wrong, somewhere in the first frames.
        let misbehaviour = match wrong.below(30) {
            0 => Some(Misbehaviour::Lost(wrong.below(40))),
            1 => Some(Misbehaviour::Hangs(wrong.below(40))),
            2 => Some(Misbehaviour::Unwritten(wrong.below(200))),
            _ => None,
        };
        let schedule = Schedule { seed, latency, doubt, misbehaviour };
        let device = match device.below(8) {
            _ if !real.is_empty() => Device::Real(device.pick(real)),
            0 => Device::Sim,
            1 => Device::HierarchicalZ,
            _ => Device::Simulated(schedule),
        };
        let viewport = Viewport { width, height };
        Self {
            seed,
            viewport,
            depth,
            frames,
            partition,
            culler: kind,
            policy,
            index,
            proxy,
            cost,
            device,
            canary: None,
        }
    }

    /// The scene.
    ///
    /// # Errors
    /// None that a seed can lead to; what a generator says.
    pub fn scene(&self) -> Result<Scene, SceneError> {
        let knobs = Knobs {
            seed: Some(self.seed),
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
            Device::Simulated(schedule) => schedule.misbehaviour,
            _ => None,
        }
    }

    /// The same with one thing as plain as it can be; `None` after the last of these steps.
    #[must_use]
    pub fn simpler(&self, step: usize) -> Option<Self> {
        let sound = |Schedule { seed, .. }: Schedule| Schedule { seed, ..Schedule::default() };
        let device = match self.device {
            Device::Simulated(schedule) => Device::Simulated(sound(schedule)),
            other => other,
        };
        let split = PartitionKnobs { crossing: Crossing::Split, ..self.partition };
        let list: [&dyn Fn(Self) -> Self; 7] = [
            &|choice| Self { policy: None, ..choice },
            &|choice| Self { device, ..choice },
            &|choice| Self { device: Device::Sim, ..choice },
            &|choice| Self { proxy: ProxyKind::Rectangle, ..choice },
            &|choice| Self { cost: CostModel::lavapipe(), ..choice },
            &|choice| Self { partition: split, ..choice },
            &|choice| Self { index: INDEXES[INDEXES.len() - 1], ..choice },
        ];
        list.get(step).map(|simpler| simpler(self.clone()))
    }

    /// The flags of `run` that pick the same beside a scene file, each with a space before it.
    #[must_use]
    pub fn flags(&self) -> String {
        let mut flags = format!(" --culler {} --index {}", self.culler.name, self.index.name);
        match self.device {
            Device::Sim => flags += " --oracle sim",
            Device::HierarchicalZ => flags += " --oracle hierarchical-z",
            Device::Simulated(Schedule { latency, doubt, misbehaviour, .. }) => {
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
        if let Some(knobs) = &self.policy {
            write!(
                f,
                "[{} in flight, {:?} postponement, {} together then {:?}, {} boxes, {}] ",
                knobs.most_in_flight,
                knobs.postponement,
                knobs.most_together,
                knobs.after_group,
                knobs.most_boxes,
                if knobs.tighten { "tightened" } else { "not tightened" }
            )?;
        }
        match self.device {
            Device::Sim => f.write_str("sim"),
            Device::HierarchicalZ => f.write_str("hierarchical-z"),
            Device::Simulated(Schedule { latency, doubt, misbehaviour, .. }) => {
                let latency = latency.name();
                write!(f, "simulated ({latency} latency, doubt {doubt}")?;
                match misbehaviour {
                    Some(misbehaviour) => write!(f, ", {misbehaviour})"),
                    None => f.write_str(")"),
                }
            }
            Device::Real(questions) => f.write_str(questions.name()),
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

    /// Every culler, index, proxy and device comes up, and what is picked is a function of the seed.
    #[test]
    fn every_member_is_picked() {
        let choices: Vec<Choice> = (0..2000).map(|seed| Choice::of(seed, CULLERS, &[])).collect();
        let share = |of: &dyn Fn(&Choice) -> bool| choices.iter().filter(|c| of(c)).count();
        // Half an even share; what comes up by chance is far nearer to a whole one.
        for kind in CULLERS {
            let named = share(&|choice| choice.culler.name == kind.name);
            assert!(named * CULLERS.len() > 1000, "{}", kind.name);
        }
        for kind in INDEXES {
            let named = share(&|choice| choice.index.name == kind.name);
            assert!(named * INDEXES.len() > 1000, "{}", kind.name);
        }
        assert!(share(&|choice| choice.device == Device::Sim) > 100);
        assert!(share(&|choice| choice.depth == DepthOrder::Reversed) > 300);
        assert!(share(&|choice| choice.partition.crossing == Crossing::Whole) > 300);
        let said = |seed| Choice::of(seed, CULLERS, &[]).to_string();
        assert_eq!(said(5), said(5));
        let real = Choice::of(5, CULLERS, &[Questions::Pyramid]);
        assert_eq!(real.device, Device::Real(Questions::Pyramid));
        assert_eq!(real.viewport, choices[5].viewport);
    }
}
