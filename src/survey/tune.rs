//! The search for a contender's knobs by the thesis's rule (Wortel 2011, section 5.1): of those that find at
//! most about 1.1 times what there is, the one that costs least; where none does, the one that finds least.
//! The cost is a sum over operations, so that the outcome is the same everywhere.

use serde::Serialize;

use super::measure::volume_at;
use super::{Contender, Method};
use crate::index::{Entry, LooseKnobs, TreeKnobs, Work};
use crate::math::{Aabb, Volume};
use crate::part::ObjectId;
use crate::run::{Boxes, World};

/// Of what there is, what may be found: about 1.1 times. The thesis's number is no strict maximum either,
/// since depths do not allow for small changes; this is what rounds to it.
pub const MOST_FOUND: f64 = 1.15;

/// How often an operation was done.
type Count = fn(&Work) -> u64;

/// Nanoseconds of an operation, by which searches weigh: what surveys of the city come to on one core at
/// about 2 GHz, rounded. Only their ratios matter, and only in [`tune`].
const COSTS: [(f64, Count); 5] = [
    (300.0, |work| work.updates),
    (15.0, |work| work.steps),
    (150.0, |work| work.node_checks),
    (10.0, |work| work.object_checks),
    (90.0, |work| work.lowered),
];
/// Knobs of a method that are tried with depth reduction too.
const BEST_PLAIN: usize = 4;

/// Sizes of a level's nodes, of those a level above, that are tried of a contender with other than halves.
const SHRINKS: [f64; 4] = [0.4, 0.6, 0.7, 0.8];

/// Of an object that is where it belongs: looked at in turn, or where a checklist says.
const OK_COST: f64 = 25.0;
const LISTED_OK_COST: f64 = 60.0;

/// A contender with knobs that were tried.
#[derive(Clone, Debug, Serialize, PartialEq)]
pub struct Trial {
    /// The contender.
    #[serde(skip)]
    pub contender: Contender,
    /// Its knobs in words.
    pub knobs: String,
    /// Objects found, over all frames.
    pub found: u64,
    /// Objects there are to be found.
    pub actual: u64,
    /// By the weighed operations, nanoseconds a frame.
    pub cost_ns: f64,
}

impl Trial {
    /// Found of what there is.
    #[must_use]
    pub fn ratio(&self) -> f64 {
        self.found as f64 / self.actual.max(1) as f64
    }
}

/// A few frames, kept for all trials.
struct Course {
    entries: Vec<Entry>,
    frames: Vec<(Boxes, Volume)>,
    actual: u64,
}

impl Course {
    fn new(world: &World, frames: u32) -> Self {
        let mut boxes = Boxes::first(world);
        let mut kept = Vec::new();
        let mut actual = 0;
        for frame in 0..frames.max(1) {
            if frame > 0 {
                boxes.advance(world);
            }
            let volume = volume_at(world, frame);
            let touches = |aabb: &&Aabb| volume.touches(aabb);
            actual += boxes.moves().boxes.iter().filter(touches).count() as u64;
            kept.push((boxes.clone(), volume));
        }
        Self { entries: world.entries(), frames: kept, actual }
    }

    fn run(&self, contender: Contender) -> Trial {
        let mut index = contender.build(&self.entries);
        let mut found: Vec<ObjectId> = Vec::new();
        let mut total = 0;
        let mut first = Work::default();
        for (number, (boxes, volume)) in self.frames.iter().enumerate() {
            let moves = boxes.moves();
            if number > 0 {
                index.update(moves);
            }
            found.clear();
            index.find(moves.boxes, volume, &mut found);
            total += found.len() as u64;
            if number == 0 {
                // What is brought down for the first time is no part of a frame among many.
                first = index.work();
            }
        }
        let work = index.work() - first;
        let ok = if contender.knobs.checklists { LISTED_OK_COST } else { OK_COST };
        let others: f64 = COSTS.iter().map(|(ns, count)| ns * count(&work) as f64).sum();
        let cost = ok * work.ok as f64 + others;
        Trial {
            contender,
            knobs: contender.words(),
            found: total,
            actual: self.actual,
            cost_ns: cost / (self.frames.len() as f64 - 1.0).max(1.0),
        }
    }
}

/// What is tried of a contender, without depth reduction.
fn grid(contender: &Contender) -> Vec<Contender> {
    let base = TreeKnobs { depth_reduction: 0, checklists: false, ..contender.knobs };
    let divisors = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0];
    let mut knobs = Vec::new();
    match contender.method {
        Method::One | Method::TemporalOctree => {
            knobs.extend((4..=13).map(|max_depth| TreeKnobs { max_depth, ..base }));
        }
        Method::Two | Method::Four => {
            for max_depth in 4..=12 {
                let with = |&size_divisor: &f64| TreeKnobs { max_depth, size_divisor, ..base };
                knobs.extend(divisors.iter().map(with));
            }
        }
        Method::Three | Method::ThreeB | Method::ThreeBR => {
            for start_depth in 3..=11 {
                let with = |capacity| TreeKnobs { start_depth, capacity, ..base };
                knobs.extend([1, 2, 4, 8, 32, 168].map(with));
            }
        }
        Method::Irregular => {
            let with = |capacity| TreeKnobs { capacity, ..base };
            knobs.extend([4, 8, 16, 32, 64, 128, 256, 512].map(with));
        }
        Method::Bsp
        | Method::LazyGrid
        | Method::List
        | Method::RegularGrid
        | Method::TemporalGrid => knobs.push(base),
    }
    let shrinks: &[f64] =
        if contender.loose.shrink == LooseKnobs::default().shrink { &[0.5] } else { &SHRINKS };
    let all = knobs.into_iter().flat_map(|knobs| {
        let loose = |&shrink| LooseKnobs { shrink, ..contender.loose };
        shrinks.iter().map(loose).map(move |loose| Contender { knobs, loose, ..*contender })
    });
    all.collect()
}

/// Tries the knobs of a contender over the first `frames` frames, the best first. One whose depth is reduced
/// is tried with the [`BEST_PLAIN`] best knobs of the same method without, and with reductions by 1 to 8. `tick` is called
/// after each trial, with how many there are in all, and stops by returning false.
pub fn tune(
    world: &World,
    contender: &Contender,
    frames: u32,
    tick: &mut dyn FnMut(usize) -> bool,
) -> Vec<Trial> {
    let course = Course::new(world, frames);
    let mut try_all = |all: Vec<Contender>| {
        let count = all.len();
        let mut trials = Vec::new();
        for contender in all {
            trials.push(course.run(contender));
            if !tick(count) {
                break;
            }
        }
        let rank = |trial: &Trial| {
            // Tenths: no finer than the rule itself.
            let over = trial.ratio() > MOST_FOUND;
            (if over { (trial.ratio() * 10.0).round() } else { 0.0 }, trial.cost_ns)
        };
        trials.sort_by(|a, b| {
            let (a, b) = (rank(a), rank(b));
            a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1))
        });
        trials
    };
    let plain = try_all(grid(contender));
    if contender.knobs.depth_reduction == 0 {
        return plain;
    }
    let checklists = contender.knobs.checklists;
    let reduced = |best: Contender| {
        (1..=8).map(move |depth_reduction| {
            let knobs = TreeKnobs { depth_reduction, checklists, ..best.knobs };
            Contender { knobs, ..best }
        })
    };
    let best = plain.iter().take(BEST_PLAIN).map(|trial| trial.contender);
    try_all(best.flat_map(reduced).collect())
}
