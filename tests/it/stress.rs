//! Sweeps over worlds picked by seeds: every culler holds, situations are reached, and the way there
//! (shards, lines, replay) loses nothing.

use plainsight::cull::CULLERS;
use plainsight::oracle::{Oracle, OracleError, Questions, Stage};
use plainsight::stress::{Choice, Outcome, REPEATED_ONE_IN, Tally, judged};
use rayon::prelude::*;

use crate::common::{gpu, hardware_of};

/// Seeds of the sweep that runs with every test. With fewer some situation is not reached.
const SEEDS: u64 = 400;
/// On a real device.
const SEEDS_ON_A_DEVICE: u64 = 12;

fn none(_: &Stage, _: Questions) -> Result<Box<dyn Oracle>, OracleError> {
    unreachable!("no real device is named")
}

fn world(seed: u64) -> Outcome {
    judged(&Choice::of(seed, CULLERS, &[]), &none).unwrap()
}

#[test]
fn every_culler_holds_in_every_world() {
    let outcomes: Vec<Outcome> = (0..SEEDS).into_par_iter().map(world).collect();
    let mut tally = Tally::default();
    outcomes.iter().for_each(|outcome| tally.add(outcome));
    let said = tally.failures.iter().map(|o| format!("{}: {} {:?}", o.seed, o.options, o.failures));
    assert_eq!(tally.failed, 0, "{}", said.collect::<Vec<_>>().join("\n"));
    assert_eq!(tally.repeated, SEEDS.div_ceil(REPEATED_ONE_IN));
    let never: Vec<String> = tally.never_reached().iter().map(ToString::to_string).collect();
    assert!(never.is_empty(), "never reached: {}", never.join(", "));
}

/// A seed is its world: run again, alone or in another order, it leaves the same line.
#[test]
fn a_seed_is_a_whole_world() {
    for seed in [3, 60, 77] {
        assert_eq!(world(seed), world(seed));
    }
}

#[test]
fn worlds_hold_on_a_real_device() {
    let real = |stage: &Stage, questions: Questions| Ok(hardware_of(gpu(), stage, questions));
    for seed in 0..SEEDS_ON_A_DEVICE {
        let choice = Choice::of(seed, CULLERS, &Questions::ALL);
        let outcome = judged(&choice, &real).unwrap();
        assert!(outcome.failures.is_empty(), "{choice}: {:?}", outcome.failures);
    }
}
