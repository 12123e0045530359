//! Merging sweeps: the lines of many shards, added up, with what is there twice refused and what is missing
//! named. Each line says which sweep and which shard it belongs to.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};

use super::CliError;
use crate::stress::{Outcome, Shard, Tally, VERSION};

/// Missing shards that are named; of more, the others are counted.
const NAMED_SHARDS: usize = 8;

/// Which sweep, and which share of it, a line belongs to.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Sweep {
    /// The flags that decide what a seed is, as they stand in a command line; empty for none.
    pub(super) flags: String,
    /// The first seed.
    pub(super) first: u64,
    /// The last seed, which belongs to it.
    pub(super) last: u64,
    /// Of how many shards.
    pub(super) shards: u64,
    /// Which shard, from 0.
    pub(super) shard: u64,
}

impl Sweep {
    /// The line of a world.
    pub(super) fn line(&self, outcome: &Outcome) -> String {
        let mut line = serde_json::to_value(outcome).unwrap_or(Value::Null);
        line["plainsight"] = json!("stress");
        line["version"] = json!(VERSION);
        line["sweep"] = json!(self);
        line.to_string()
    }

    /// The seeds of all shards, as `--seeds` takes them.
    fn seeds(&self) -> String {
        seeds(self.first, self.last)
    }

    /// The shard, of which seeds.
    fn named(&self) -> String {
        let shard = Shard { index: self.shard, count: self.shards };
        format!("shard {shard} of {}", self.seeds())
    }

    /// How many seeds the shard has.
    fn size(&self) -> u128 {
        let all = u128::from(self.last - self.first) + 1;
        (all + u128::from(self.shards) - 1 - u128::from(self.shard)) / u128::from(self.shards)
    }

    /// Whether a seed is the shard's.
    fn has(&self, seed: u64) -> bool {
        (self.first..=self.last).contains(&seed) && (seed - self.first) % self.shards == self.shard
    }

    fn sound(&self) -> bool {
        self.first <= self.last && self.shard < self.shards
    }
}

/// Seeds from the first to the last, as `--seeds` takes them.
pub(super) fn seeds(first: u64, last: u64) -> String {
    format!("seeds {first}..{}", u128::from(last) + 1)
}

/// What files come to.
pub(super) struct Merged {
    /// The sum.
    pub(super) tally: Tally,
    /// What is missing, a line each; empty where every sweep is whole.
    pub(super) missing: Vec<String>,
}

/// A world of a file.
struct Line {
    seed: u64,
    /// Which file, by its place among those named.
    file: u32,
}

/// Adds up the lines of files.
///
/// # Errors
/// One line, where a file is none of `stress`, is empty, or holds a world that another line holds.
pub(super) fn merged(files: &[PathBuf]) -> Result<Merged, CliError> {
    let mut tally = Tally::default();
    let mut sweeps: BTreeMap<Sweep, Vec<Line>> = BTreeMap::new();
    for (file, path) in (0..).zip(files) {
        let before = tally.worlds;
        read(path, &mut |sweep, outcome| {
            tally.add(&outcome);
            sweeps.entry(sweep).or_default().push(Line { seed: outcome.seed, file });
        })?;
        if tally.worlds == before {
            let what = "holds no line; give files that stress --out wrote";
            return Err(CliError::Usage(format!("{}: {what}", path.display())));
        }
    }
    sweeps.values_mut().for_each(|lines| lines.sort_by_key(|line| line.seed));
    refuse_twice(files, &sweeps)?;
    Ok(Merged { tally, missing: missing(&sweeps) })
}

fn read(path: &PathBuf, each: &mut dyn FnMut(Sweep, Outcome)) -> Result<(), CliError> {
    let refuse =
        |place: &str, what: String| CliError::Usage(format!("{}{place}: {what}", path.display()));
    let file = File::open(path).map_err(|error| refuse("", error.to_string()))?;
    for (number, line) in (1..).zip(BufReader::new(file).lines()) {
        let place = format!(" line {number}");
        let line = line.map_err(|error| refuse(&place, error.to_string()))?;
        let value: Value = serde_json::from_str(&line).map_err(|_| {
            refuse(&place, "is no JSON; give files that stress --out wrote".to_owned())
        })?;
        if value["plainsight"] != json!("stress") || value["version"] != json!(VERSION) {
            let what = format!(
                "is no line of stress, version {VERSION}; give files that stress --out wrote"
            );
            return Err(refuse(&place, what));
        }
        let sweep = Sweep::deserialize(&value["sweep"])
            .map_err(|error| refuse(&place, format!("sweep: {error}")))?;
        let outcome: Outcome =
            serde_json::from_value(value).map_err(|error| refuse(&place, error.to_string()))?;
        if !sweep.sound() || !sweep.has(outcome.seed) {
            let what = format!("seed {} is not of its own sweep, {sweep:?}", outcome.seed);
            return Err(refuse(&place, what));
        }
        each(sweep, outcome);
    }
    Ok(())
}

/// A seed under the same flags is the same world, whichever sweep ran it.
fn refuse_twice(files: &[PathBuf], sweeps: &BTreeMap<Sweep, Vec<Line>>) -> Result<(), CliError> {
    let mut worlds: Vec<(&str, u64, u32, &Sweep)> = sweeps
        .iter()
        .flat_map(|(sweep, lines)| {
            lines.iter().map(move |line| (sweep.flags.as_str(), line.seed, line.file, sweep))
        })
        .collect();
    worlds.sort_unstable();
    let twice: Vec<_> = worlds
        .windows(2)
        .filter(|pair| (pair[0].0, pair[0].1) == (pair[1].0, pair[1].1))
        .map(|pair| (pair[0].1, [pair[0].2, pair[1].2], [pair[0].3, pair[1].3]))
        .collect();
    let Some(&(seed, [a, b], [one, other])) = twice.first() else { return Ok(()) };
    let both = twice.iter().filter(|(_, files, _)| *files == [a, b]).count();
    let path = |file: u32| files[file as usize].display().to_string();
    let places =
        if a == b { format!("{} twice", path(a)) } else { format!("{} and {}", path(a), path(b)) };
    let shards =
        if one == other { one.named() } else { format!("{}, {}", one.named(), other.named()) };
    Err(CliError::Usage(format!(
        "--merge: {both} worlds are in {places}, seed {seed} first ({shards}); give each once"
    )))
}

/// A shard with its lines, by seed.
type Held<'a> = (&'a Sweep, &'a [Line]);

/// What no line tells of, by sweep.
fn missing(sweeps: &BTreeMap<Sweep, Vec<Line>>) -> Vec<String> {
    // Shards of one sweep, whether cut in as many or not, have the same seeds to share.
    let mut whole: BTreeMap<(&str, u64, u64), Vec<Held<'_>>> = BTreeMap::new();
    for (sweep, lines) in sweeps {
        let key = (sweep.flags.as_str(), sweep.first, sweep.last);
        whole.entry(key).or_default().push((sweep, lines));
    }
    let mut said = Vec::new();
    for ((flags, first, last), shards) in whole {
        let there: u128 = shards.iter().map(|(_, lines)| lines.len() as u128).sum();
        let lacking = u128::from(last - first) + 1 - there;
        if lacking == 0 {
            continue;
        }
        let of = match flags {
            "" => seeds(first, last),
            flags => format!("{} {flags}", seeds(first, last)),
        };
        let count = shards[0].0.shards;
        if shards.iter().any(|(sweep, _)| sweep.shards != count) {
            said.push(format!("{lacking} worlds of {of}, cut in shards of several sizes"));
            continue;
        }
        let held: Vec<u64> = shards.iter().map(|(sweep, _)| sweep.shard).collect();
        // Shards come in order, so that each is looked at once.
        let absent: Vec<String> = (0..count)
            .filter(|shard| held.binary_search(shard).is_err())
            .take(NAMED_SHARDS)
            .map(|index| Shard { index, count }.to_string())
            .collect();
        let more = (count - held.len() as u64).saturating_sub(absent.len() as u64);
        if !absent.is_empty() {
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            let word = if absent.len() == 1 { "shard" } else { "shards" };
            said.push(format!("{word} {}{more} of {of}", absent.join(", ")));
        }
        for (sweep, lines) in shards {
            let lacking = sweep.size() - lines.len() as u128;
            if lacking > 0 {
                let (size, from) = (sweep.size(), first_gap(sweep, lines));
                let shard = Shard { index: sweep.shard, count };
                said.push(format!(
                    "{lacking} of {size} worlds of shard {shard} of {of}, seed {from} first: it was cut short"
                ));
            }
        }
    }
    said
}

/// The first seed of a shard that no line has.
fn first_gap(sweep: &Sweep, lines: &[Line]) -> u64 {
    let own = (0..).map(|place: u64| sweep.first + sweep.shard + place * sweep.shards);
    let mut lines = lines.iter();
    own.into_iter().find(|&seed| lines.next().is_none_or(|line| line.seed != seed)).unwrap_or(0)
}
