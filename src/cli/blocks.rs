//! `faults --swarm --blocks`: how many seeds of the swarm it takes until a fault is caught, as a median over
//! disjoint blocks of seeds that are the same for everybody.

use rayon::prelude::*;
use serde_json::json;

use super::progress::progress_bar;
use super::run::exit_of;
use super::signals::{catch_interrupt, interrupted};
use super::watchdog::SharedFile;
use super::{CliError, Streams};
use crate::check::Ruling;
use crate::cull::CULLERS;
use crate::fault::{Evidence, Fault, Trial};
use crate::run::Canary;
use crate::stress::Choice;

/// Version of the JSON line.
const JSON_SCHEMA: u32 = 1;
/// Seeds from the start of one block to the next.
const BLOCK: u64 = 1000;

/// The trial of a fault in the world of a seed.
pub(super) fn trial_in_swarm(
    fault: &Fault,
    seed: u64,
    canary: Option<Canary>,
) -> Result<Evidence, CliError> {
    let choice = Choice::of(seed, CULLERS, &[]);
    let trial = Trial::of(fault, &choice.scene()?, choice.partition).with_canary(canary);
    Ok(trial.run(fault, &mut || !interrupted())?)
}

/// How many seeds of each block it took until a fault was first caught there.
struct Blocks {
    fault: Fault,
    /// By block; `None` where none of its seeds caught it.
    waits: Vec<Option<u64>>,
    /// What the gate said of the unbroken rig, and what that comes to.
    false_alarms: Vec<String>,
    alarm: Ruling,
}

/// What one block came to: how many seeds it took, and what the gate said of the unbroken rig.
type Block = (Option<u64>, Vec<String>, Ruling);

impl Blocks {
    /// Looks at the first `most` seeds of each block, at most a whole one, until one catches the fault.
    fn new(
        fault: Fault,
        (blocks, most, canary): (u64, u64, Option<Canary>),
    ) -> Result<Self, CliError> {
        let of = |block: u64| -> Result<Block, CliError> {
            let (mut alarms, mut alarm) = (Vec::new(), Ruling::Held);
            for wait in 1..=most.min(BLOCK) {
                let seed = block * BLOCK + wait - 1;
                let evidence = trial_in_swarm(&fault, seed, canary)?;
                let lines = evidence.false_alarms.iter();
                alarms.extend(lines.map(|line| format!("seed {seed}: {line}")));
                alarm = alarm.max(evidence.alarm);
                if evidence.caught() {
                    return Ok((Some(wait), alarms, alarm));
                }
            }
            Ok((None, alarms, alarm))
        };
        let done: Vec<_> = (0..blocks).into_par_iter().map(of).collect();
        let (waits, false_alarms, alarm) = (Vec::new(), Vec::new(), Ruling::Held);
        let mut all = Self { fault, waits, false_alarms, alarm };
        for block in done {
            let (wait, alarms, alarm) = block?;
            all.alarm = all.alarm.max(alarm);
            all.waits.push(wait);
            all.false_alarms.extend(alarms);
        }
        Ok(all)
    }

    /// The middle one of the waits, the upper of two, and the longest; `None` where that block never caught
    /// it.
    fn median_and_most(&self) -> [Option<u64>; 2] {
        let mut waits = self.waits.clone();
        // What was never caught took longest.
        waits.sort_unstable_by_key(|wait| wait.unwrap_or(u64::MAX));
        [waits[waits.len() / 2], waits[waits.len() - 1]]
    }

    fn json(&self) -> String {
        let [median, most] = self.median_and_most();
        json!({
            "schema": JSON_SCHEMA,
            "fault": self.fault.name,
            "bug_class": self.fault.bug,
            "blocks": self.waits.len(),
            "block_seeds": BLOCK,
            "seeds_until_caught": self.waits,
            "median_seeds": median,
            "most_seeds": most,
            "false_alarms": self.false_alarms,
        })
        .to_string()
    }
}

/// Looks for each fault in blocks of seeds of the swarm.
pub(super) fn hunt(
    chosen: &[Fault],
    (blocks, most, canary): (u64, u64, Option<Canary>),
    on_trial: &mut dyn FnMut(&Fault),
    (json, out): (bool, &mut SharedFile<'_>),
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    catch_interrupt();
    let bar = progress_bar();
    bar.set_length(chosen.len() as u64);
    let wide = chosen.iter().map(|fault| fault.name.len()).max().unwrap_or(0).max(5);
    if !json {
        writeln!(streams.out, "{:<wide$} class  median of {blocks} blocks  longest", "fault")?;
    }
    let (mut caught, mut alarms, mut ruling) = (0, 0, Ruling::Held);
    for &fault in chosen {
        bar.set_message(fault.name);
        on_trial(&fault);
        let found = Blocks::new(fault, (blocks, most, canary));
        if found.is_err() {
            bar.finish_and_clear();
        }
        let found = found?;
        bar.inc(1);
        let line = found.json();
        out.line(&line)?;
        let [median, longest] = found.median_and_most();
        let said = |wait: Option<u64>| wait.map_or("NEVER".to_owned(), |wait| wait.to_string());
        let text = match json {
            true => line,
            false => format!(
                "{:<wide$} {:>5}  {:>19}  {:>7}",
                fault.name,
                fault.bug,
                said(median),
                said(longest)
            ),
        };
        bar.suspend(|| writeln!(streams.out, "{text}"))?;
        for alarm in &found.false_alarms {
            bar.suspend(|| writeln!(streams.talk, "FALSE ALARM: {} {alarm}", fault.sound.name))?;
        }
        alarms += found.false_alarms.len();
        ruling = ruling.max(found.alarm);
        caught += usize::from(median.is_some());
    }
    bar.finish_and_clear();
    out.finish(&[])?;
    let to = if json { &mut streams.talk } else { &mut streams.out };
    writeln!(
        to,
        "faults: {caught} of {} have a median over {blocks} blocks of {BLOCK} seeds; false alarms {alarms}",
        chosen.len()
    )?;
    Ok(exit_of(if caught == chosen.len() { ruling } else { Ruling::Failed }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fault::faults;

    /// What was never caught took longest; of an even number of blocks the worse of the two in the middle.
    #[test]
    fn the_median_is_over_all_blocks() {
        let of = |waits: &[Option<u64>]| {
            let (waits, false_alarms) = (waits.to_vec(), Vec::new());
            let (fault, alarm) = (faults()[0], Ruling::Held);
            Blocks { fault, waits, false_alarms, alarm }.median_and_most()
        };
        assert_eq!(of(&[Some(9), Some(2), Some(4)]), [Some(4), Some(9)]);
        assert_eq!(of(&[Some(9), None, Some(4)]), [Some(9), None]);
        assert_eq!(of(&[None, None, Some(4)]), [None, None]);
        assert_eq!(of(&[Some(1), Some(7)]), [Some(7), Some(7)]);
    }
}
