//! Outcomes added up: of one sweep while it runs, or of the lines that many machines wrote.

use std::collections::BTreeMap;

use super::{Outcome, Probe};
use crate::check::Ruling;

/// Version of the lines.
pub const VERSION: u32 = 2;
/// Failing seeds kept; the others are only counted.
const KEPT_FAILURES: usize = 100;

/// The sum of a sweep.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    /// Worlds run.
    pub worlds: u64,
    /// Their frames times views.
    pub shots: u64,
    /// Worlds run twice.
    pub repeated: u64,
    /// Worlds in which something failed.
    pub failed: u64,
    /// Worlds in which nothing failed but the device: it did not repeat, or it was lost.
    pub device_at_fault: u64,
    /// What the worst of all worlds came to.
    pub ruling: Ruling,
    /// The worst of them, of those alike the first by seed.
    pub failures: Vec<Outcome>,
    /// The world that drew the most beyond what shows, by parts.
    pub worst_excess: Option<Outcome>,
    /// The world that asked the most questions a frame.
    pub most_queries: Option<Outcome>,
    /// Worlds that reached each probe, by its name.
    reached: BTreeMap<String, u64>,
}

impl Tally {
    /// Adds one world; the order makes no difference.
    pub fn add(&mut self, outcome: &Outcome) {
        self.worlds += 1;
        self.shots += u64::from(outcome.shots);
        self.repeated += u64::from(outcome.repeated);
        for probe in &outcome.reached {
            *self.reached.entry(probe.clone()).or_default() += 1;
        }
        let ruling = outcome.ruling();
        self.ruling = self.ruling.max(ruling);
        if ruling != Ruling::Held {
            match ruling {
                Ruling::Failed => self.failed += 1,
                _ => self.device_at_fault += 1,
            }
            self.failures.push(outcome.clone());
            self.failures.sort_by_key(|o| (std::cmp::Reverse(o.ruling()), o.seed));
            self.failures.truncate(KEPT_FAILURES);
        }
        let excess =
            |o: &Outcome| (o.drawn - o.visible.min(o.drawn)) * 1000 / u64::from(o.shots.max(1));
        let queries = |o: &Outcome| o.queries * 1000 / u64::from(o.shots.max(1));
        keep_most(&mut self.worst_excess, outcome, &excess);
        keep_most(&mut self.most_queries, outcome, &queries);
    }

    /// Probes with the number of worlds that reached them, in the order of [`Probe::all`].
    #[must_use]
    pub fn probes(&self) -> Vec<(Probe, u64)> {
        let count = |probe: &Probe| self.reached.get(&probe.to_string()).copied().unwrap_or(0);
        Probe::all().map(|probe| (probe, count(&probe))).collect()
    }

    /// Probes that no world reached.
    #[must_use]
    pub fn never_reached(&self) -> Vec<Probe> {
        let never = |&(_, count): &(Probe, u64)| count == 0;
        self.probes().into_iter().filter(never).map(|(probe, _)| probe).collect()
    }
}

/// Keeps the outcome with the larger figure, and the lower seed of two alike.
fn keep_most(kept: &mut Option<Outcome>, new: &Outcome, figure: &dyn Fn(&Outcome) -> u64) {
    let order = |o: &Outcome| (figure(o), std::cmp::Reverse(o.seed));
    if kept.as_ref().is_none_or(|old| order(new) > order(old)) {
        *kept = Some(new.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(seed: u64, drawn: u64, failures: &[&str]) -> Outcome {
        Outcome {
            seed,
            options: String::new(),
            scene: String::new(),
            shots: 10,
            failed_in: None,
            failures: failures.iter().map(|line| (*line).to_owned()).collect(),
            verdict: String::new(),
            reached: vec![Probe::Jumped.to_string()],
            drawn,
            visible: 5,
            queries: drawn,
            virtual_ns: 0,
            repeated: seed == 2,
            hash: String::new(),
            replay: String::new(),
        }
    }

    #[test]
    fn sums_do_not_depend_on_the_order() {
        let all = [
            outcome(1, 9, &[]),
            outcome(2, 30, &["set"]),
            outcome(3, 30, &[]),
            outcome(0, 1, &["image"]),
        ];
        let sum = |order: &[usize]| {
            let mut tally = Tally::default();
            order.iter().for_each(|&i| tally.add(&all[i]));
            tally
        };
        let tally = sum(&[0, 1, 2, 3]);
        assert_eq!(format!("{tally:?}"), format!("{:?}", sum(&[3, 1, 0, 2])));
        assert_eq!((tally.worlds, tally.shots, tally.failed, tally.repeated), (4, 40, 2, 1));
        assert_eq!(tally.worst_excess.as_ref().map(|o| o.seed), Some(2));
        assert_eq!(tally.failures.iter().map(|o| o.seed).collect::<Vec<_>>(), [0, 2]);
        assert!(!tally.never_reached().contains(&Probe::Jumped));
        assert!(tally.never_reached().contains(&Probe::Appeared));
    }
}
