//! Outcomes added up: of one sweep while it runs, or of the lines that many machines wrote.

use std::collections::BTreeMap;

use super::member::may_meet;
use super::{Outcome, Probe, RAREST_MEMBER_ONE_IN, RAREST_PAIR_ONE_IN};
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
    /// Worlds that picked each member.
    members: BTreeMap<String, u64>,
    /// Worlds that picked both of two members, by the lower family's and then the other's.
    pairs: BTreeMap<String, BTreeMap<String, u64>>,
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
        self.pick(&outcome.members);
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

    /// Counts what one world picked of each family.
    fn pick(&mut self, members: &[String]) {
        for (place, member) in members.iter().enumerate() {
            *count(&mut self.members, member) += 1;
            if !self.pairs.contains_key(member) {
                self.pairs.insert(member.clone(), BTreeMap::new());
            }
            if let Some(others) = self.pairs.get_mut(member) {
                members[place + 1..].iter().for_each(|other| *count(others, other) += 1);
            }
        }
    }

    /// Members with the number of worlds that picked each, the rarest first.
    #[must_use]
    pub fn members(&self) -> Vec<(u64, &str)> {
        let mut members: Vec<_> =
            self.members.iter().map(|(name, count)| (*count, name.as_str())).collect();
        members.sort_unstable();
        members
    }

    /// Pairs of members of two families with the number of worlds that picked both, the rarest first; pairs
    /// that cannot be are left out.
    #[must_use]
    pub fn pairs(&self) -> Vec<(u64, [&str; 2])> {
        let mut pairs = Vec::new();
        let names: Vec<&str> = self.members.keys().map(String::as_str).collect();
        let of = |a: &str, b: &str| {
            self.pairs.get(a).and_then(|others| others.get(b)).copied().unwrap_or(0)
        };
        for (place, &one) in names.iter().enumerate() {
            let others = names[place + 1..].iter().filter(|other| may_meet(one, other));
            pairs.extend(others.map(|&other| (of(one, other) + of(other, one), [one, other])));
        }
        pairs.sort_unstable();
        pairs
    }

    /// Members and pairs that came up less often than once in [`RAREST_MEMBER_ONE_IN`] and
    /// [`RAREST_PAIR_ONE_IN`] worlds, a line each; of members that were picked at all.
    #[must_use]
    pub fn rare(&self) -> Vec<String> {
        let members = self.members().into_iter();
        let members = members
            .filter(|(count, _)| *count < self.worlds / RAREST_MEMBER_ONE_IN)
            .map(|(count, name)| format!("{count} worlds: {name}"));
        let pairs = self.pairs().into_iter();
        let pairs = pairs
            .filter(|(count, _)| *count < self.worlds / RAREST_PAIR_ONE_IN)
            .map(|(count, [a, b])| format!("{count} worlds: {a} with {b}"));
        members.chain(pairs).collect()
    }

    /// Probes that no world reached.
    #[must_use]
    pub fn never_reached(&self) -> Vec<Probe> {
        let never = |&(_, count): &(Probe, u64)| count == 0;
        self.probes().into_iter().filter(never).map(|(probe, _)| probe).collect()
    }
}

/// The count under a name, without a copy of a name that is there.
fn count<'a>(counts: &'a mut BTreeMap<String, u64>, name: &str) -> &'a mut u64 {
    if !counts.contains_key(name) {
        counts.insert(name.to_owned(), 0);
    }
    counts.get_mut(name).expect("it was put in if it was not there")
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
    use crate::cull::CULLERS;
    use crate::stress::Choice;

    fn outcome(seed: u64, drawn: u64, failures: &[&str]) -> Outcome {
        Outcome {
            seed,
            options: String::new(),
            scene: String::new(),
            members: vec!["culler full".to_owned(), format!("index {}", seed % 2)],
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

    /// What the first `worlds` seeds pick.
    fn picked(worlds: u64) -> Tally {
        let mut tally = Tally { worlds, ..Tally::default() };
        for seed in 0..worlds {
            tally.pick(&Choice::of(seed, CULLERS, &[]).names());
        }
        tally
    }

    /// No member and no pair is rare in a sweep of 3,000 worlds; a sweep in which one is says so.
    #[test]
    fn no_member_and_no_pair_is_rare() {
        let tally = picked(3000);
        assert_eq!(tally.rare(), Vec::<String>::new());
        // There is none that such a sweep does not draw at all.
        assert_eq!(tally.members().len(), picked(20_000).members().len());
        for family in ["culler full-waits", "index list", "device Tables", "parts whole"] {
            assert!(tally.members().iter().any(|(_, name)| *name == family), "{family}");
        }
        let two = |name| tally.pairs().iter().filter(|(_, pair)| pair.contains(&name)).count();
        assert!(two("culler chc") > 60, "{}", two("culler chc"));
        let mut uneven = tally.clone();
        *uneven.members.get_mut("index list").unwrap() = 29;
        *uneven.pairs.get_mut("culler chc").unwrap().get_mut("index list").unwrap() = 1;
        assert_eq!(
            uneven.rare(),
            ["29 worlds: index list", "1 worlds: culler chc with index list"]
        );
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
