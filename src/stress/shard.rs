//! Which seeds of a sweep are this machine's: every n-th, so that shards cost alike. Where the user names no
//! shard, the variables that parallel jobs are given by common systems say it.

use std::fmt;
use std::str::FromStr;

/// One of several equal shares: `index` of `count`, from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which, below `count`.
    pub index: u64,
    /// Of how many, at least 1.
    pub count: u64,
}

/// Why a shard could not be told.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ShardError(String);

/// The variables of a system: its name, the index, the number of the first index, the count.
const SYSTEMS: [(&str, &str, First, &[&str]); 6] = [
    // https://docs.gitlab.com/ci/variables/predefined_variables: from 1.
    ("GitLab", "CI_NODE_INDEX", First::At(1), &["CI_NODE_TOTAL"]),
    ("CircleCI", "CIRCLE_NODE_INDEX", First::At(0), &["CIRCLE_NODE_TOTAL"]),
    ("Buildkite", "BUILDKITE_PARALLEL_JOB", First::At(0), &["BUILDKITE_PARALLEL_JOB_COUNT"]),
    ("Azure", "SYSTEM_JOBPOSITIONINPHASE", First::At(1), &["SYSTEM_TOTALJOBSINPHASE"]),
    // An array may begin anywhere.
    (
        "Slurm",
        "SLURM_ARRAY_TASK_ID",
        First::Told("SLURM_ARRAY_TASK_MIN"),
        &["SLURM_ARRAY_TASK_COUNT"],
    ),
    // An indexed job is not told its own size: the manifest must say it once more.
    ("Kubernetes", "JOB_COMPLETION_INDEX", First::At(0), &["JOB_COMPLETIONS"]),
];

/// What the first index is.
#[derive(Clone, Copy)]
enum First {
    At(u64),
    /// In a variable.
    Told(&'static str),
}

impl Shard {
    /// All of it.
    pub const WHOLE: Self = Self { index: 0, count: 1 };

    /// From the variables that `variable` knows; the whole where no system's are there.
    ///
    /// # Errors
    /// Where a system's index is there and its count is not, or either is out of range.
    pub fn of_environment(variable: impl Fn(&str) -> Option<String>) -> Result<Self, ShardError> {
        for (system, index, first, counts) in SYSTEMS {
            let Some(text) = variable(index) else { continue };
            let fail = |what: String| ShardError(format!("{system}: {what}; say --shard i/n"));
            let number = |name: &str, text: &str| {
                text.parse::<u64>().map_err(|_| fail(format!("{name} is '{text}', no number")))
            };
            let at = number(index, &text)?;
            let first = match first {
                First::At(first) => first,
                First::Told(name) => match variable(name) {
                    Some(text) => number(name, &text)?,
                    None => return Err(fail(format!("{index} is set and {name} is not"))),
                },
            };
            let Some((name, text)) = counts.iter().find_map(|&name| Some((name, variable(name)?)))
            else {
                return Err(fail(format!("{index} is set and {} is not", counts.join(" or "))));
            };
            let count = number(name, &text)?;
            return match at.checked_sub(first).filter(|at| *at < count) {
                Some(index) => Ok(Self { index, count }),
                None => Err(fail(format!("{index} is {at} of {count}"))),
            };
        }
        Ok(Self::WHOLE)
    }

    /// The seeds from `from` to `to`, the end left out, that are this shard's, ascending.
    pub fn seeds(self, from: u64, to: u64) -> impl Iterator<Item = u64> {
        (from..to).filter(move |seed| (seed - from) % self.count == self.index)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let parts =
            text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if index < count => Ok(Self { index, count }),
            _ => Err(ShardError("write i/n, i from 0 and below n, as in 0/4".to_owned())),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.index, self.count)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(variables: &[(&str, &str)]) -> Result<Shard, ShardError> {
        let find = |name: &str| {
            let found = variables.iter().find(|(key, _)| *key == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        Shard::of_environment(find)
    }

    #[test]
    fn systems_say_which_share_is_ours() {
        assert_eq!(of(&[]), Ok(Shard::WHOLE));
        let third = Ok(Shard { index: 2, count: 5 });
        assert_eq!(of(&[("CI_NODE_INDEX", "3"), ("CI_NODE_TOTAL", "5")]), third);
        assert_eq!(of(&[("CIRCLE_NODE_INDEX", "2"), ("CIRCLE_NODE_TOTAL", "5")]), third);
        let buildkite = [("BUILDKITE_PARALLEL_JOB", "2"), ("BUILDKITE_PARALLEL_JOB_COUNT", "5")];
        assert_eq!(of(&buildkite), third);
        assert_eq!(of(&[("JOB_COMPLETION_INDEX", "2"), ("JOB_COMPLETIONS", "5")]), third);
        let slurm = [
            ("SLURM_ARRAY_TASK_ID", "12"),
            ("SLURM_ARRAY_TASK_MIN", "10"),
            ("SLURM_ARRAY_TASK_COUNT", "5"),
        ];
        assert_eq!(of(&slurm), third);
        let error = of(&[("JOB_COMPLETION_INDEX", "2")]).unwrap_err().to_string();
        assert!(error.contains("JOB_COMPLETIONS is not"), "{error}");
        let error = of(&[("CI_NODE_INDEX", "6"), ("CI_NODE_TOTAL", "5")]).unwrap_err().to_string();
        assert!(error.contains("6 of 5"), "{error}");
        let error = of(&[("CI_NODE_INDEX", "x"), ("CI_NODE_TOTAL", "5")]).unwrap_err().to_string();
        assert!(error.contains("'x'"), "{error}");
    }

    /// Every seed is one shard's, and only one's.
    #[test]
    fn shards_share_all_seeds() {
        let mut all: Vec<u64> = (0..4)
            .flat_map(|index| Shard { index, count: 4 }.seeds(10, 33).collect::<Vec<_>>())
            .collect();
        all.sort_unstable();
        assert_eq!(all, (10..33).collect::<Vec<_>>());
        assert!("4/4".parse::<Shard>().is_err() && "1".parse::<Shard>().is_err());
        assert_eq!("3/4".parse(), Ok(Shard { index: 3, count: 4 }));
    }
}
