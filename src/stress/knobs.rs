//! The limits of cullers and indexes as a seed draws them: tiny and at their ends, so that each is crossed in
//! small worlds.

use crate::cull::{
    Adaptive, AdaptiveKnobs, AfterGroup, ChcPlus, ChcPlusKnobs, Culler, CullerSetup, Full,
    FullKnobs, FullWaits, FullWaitsKnobs, Pipelined, PipelinedKnobs, Postponement,
};
use crate::index::{BspKnobs, GridKnobs, IndexKnobs, LooseKnobs, Split, TreeKnobs, VolumeKnobs};
use crate::scene::Stream;

/// Knobs of a culler in the place of its own.
#[derive(Clone, Debug)]
pub enum Policy {
    /// Of `full` and `full-trusting`.
    Full(FullKnobs),
    /// Of `full-waits`.
    Waits(FullWaitsKnobs),
    /// Of `full-adaptive`.
    Adaptive(AdaptiveKnobs),
    /// Of `chc++`.
    ChcPlus(ChcPlusKnobs),
    /// Of `pipelined`.
    Pipelined(PipelinedKnobs),
}

impl Policy {
    /// What `seed` draws for the culler of that name; `None` for one without knobs.
    #[must_use]
    pub fn of(seed: u64, culler: &str) -> Option<Self> {
        let mut policy = Stream::new(seed, "policy");
        let postponement =
            policy.pick(&[Postponement::Never, Postponement::Figure3, Postponement::Seldom]);
        let trusting = FullKnobs::trusting();
        Some(match culler {
            "full" | "full-trusting" => Self::Full(FullKnobs {
                name: if culler == trusting.name { trusting.name } else { "full" },
                most_in_flight: policy.pick(&[1, 2, 3, 7, 16, 1024]),
                postponement,
                most_together: policy.pick(&[1, 2, 3, 16, 64]),
                after_group: policy.pick(&[AfterGroup::AskAgain, AfterGroup::Trust]),
                most_boxes: policy.pick(&[1, 2, 4, 16]),
                first_layer: policy.pick(&[1, 2, 5, 64]),
                tighten: policy.below(4) > 0,
            }),
            "full-waits" => Self::Waits(FullWaitsKnobs {
                most_in_flight: policy.pick(&[1, 2, 3, 7, 128]),
                postponement,
            }),
            "full-adaptive" => Self::Adaptive(AdaptiveKnobs {
                first_layer: policy.pick(&[1, 2, 5, 64]),
                levels_a_batch: policy.pick(&[0, 1, 2, 8]),
                unasked: policy.pick(&[0.0, 0.3, 0.8, 1.0]),
                // The second pays for a few questions where they are all but free.
                allowance: policy.pick(&[0.0, 5e-6, 5e-6, 0.03, 100.0]),
            }),
            "chc++" => Self::ChcPlus(ChcPlusKnobs {
                assumed_visible: policy.pick(&[1, 2, 3, 10]),
                batch: policy.pick(&[1, 2, 3, 20]),
                most_together: policy.pick(&[1, 2, 3, 16]),
            }),
            "pipelined" => Self::Pipelined(PipelinedKnobs {
                batch: policy.pick(&[1, 2, 3, 16]),
                most_batches: policy.pick(&[1, 2, 3, 9]),
            }),
            _ => return None,
        })
    }

    /// The culler by these knobs.
    #[must_use]
    pub fn make(&self, setup: CullerSetup) -> Box<dyn Culler> {
        match self {
            Self::Full(knobs) => Box::new(Full::new(setup, knobs.clone())),
            Self::Waits(knobs) => Box::new(FullWaits::new(setup, *knobs)),
            Self::Adaptive(knobs) => Box::new(Adaptive::new(setup, *knobs)),
            Self::ChcPlus(knobs) => Box::new(ChcPlus::new(setup, *knobs)),
            Self::Pipelined(knobs) => Box::new(Pipelined::new(setup, *knobs)),
        }
    }
}

/// Index knobs that `seed` draws for the concern `name`.
pub(super) fn index_knobs(seed: u64, name: &str) -> IndexKnobs {
    let mut knobs = Stream::new(seed, name);
    let shortest = knobs.pick(&[1, 2, 4]);
    let longest = shortest * knobs.pick(&[1, 2, 3, 64]);
    IndexKnobs {
        tree: TreeKnobs {
            split: Split::Octants,
            max_depth: knobs.pick(&[0, 1, 2, 3, 6, TreeKnobs::DEEPEST]),
            size_divisor: knobs.pick(&[0.5, 1.0, 2.0, 6.0, f64::INFINITY]),
            capacity: knobs.pick(&[1, 2, 3, 7]),
            start_depth: knobs.pick(&[0, 0, 1, 3]),
            depth_reduction: knobs.pick(&[0, 1, 2, 6]),
            checklists: knobs.below(2) == 0,
            ahead: knobs.pick(&[3, 4, 8, TreeKnobs::AHEAD]),
            leaf_boxes: knobs.below(2) == 0,
        },
        loose: LooseKnobs {
            shrink: knobs.pick(&[0.1, 0.5, 0.75, 1.0]),
            largest: knobs.below(2) == 0,
        },
        grid: GridKnobs {
            per_cell: knobs.pick(&[0.3, 1.0, 12.0, 1000.0]),
            ahead: knobs.pick(&[3, 4, 8, 64]),
        },
        bsp: BspKnobs {
            leaf_objects: knobs.pick(&[1, 2, 5]),
            reconstruction_period: knobs.pick(&[1, 2, 3, 8]),
            worth_reconstruction: knobs.pick(&[1, 2]),
            tighten_after: knobs.pick(&[0, 1, 2, 4]),
        },
        volumes: VolumeKnobs { shortest, longest },
    }
}
