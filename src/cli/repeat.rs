//! What is run another time, to see that it repeats and for medians of wall times.

use clap::Args;

use crate::run::Repeat;

/// Flags of verbs that run lanes before the gate.
#[derive(Args, Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct RepeatArgs {
    /// How many first frames are run again by new cullers, to see that they repeat; 0 for none (default: 1,
    /// and all of them with --rounds).
    #[arg(long, value_name = "FRAMES")]
    pub(super) repeat: Option<u32>,
    /// How often these are run in all, the cullers in turn; wall times are the medians (default: twice).
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    pub(super) rounds: Option<u32>,
}

impl RepeatArgs {
    /// As a run takes it: the first frame once again, where nothing is said.
    pub(super) fn repeat(self) -> Repeat {
        let rounds = self.rounds.unwrap_or(1);
        let usual = if rounds > 1 { u32::MAX } else { 1 };
        Repeat { frames: self.repeat.unwrap_or(usual), rounds: (rounds - 1).max(1) }
    }

    /// The flags that lead here again, each with a space before it.
    pub(super) fn replay_flags(self) -> String {
        let flag = |name: &str, value: Option<u32>| {
            value.map_or(String::new(), |value| format!(" --{name} {value}"))
        };
        flag("repeat", self.repeat) + &flag("rounds", self.rounds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_said_is_repeated() {
        let of = |repeat, rounds| RepeatArgs { repeat, rounds };
        let frames = |frames, rounds| Repeat { frames, rounds };
        assert_eq!(of(None, None).repeat(), frames(1, 1));
        assert_eq!(of(None, Some(1)).repeat(), frames(1, 1));
        assert_eq!(of(None, Some(9)).repeat(), frames(u32::MAX, 8));
        assert_eq!(of(Some(5), None).repeat(), frames(5, 1));
        assert_eq!(of(Some(5), Some(3)).repeat(), frames(5, 2));
        assert_eq!(of(Some(0), None).repeat(), frames(0, 1));
        assert_eq!(of(None, None).replay_flags(), "");
        assert_eq!(of(Some(0), Some(9)).replay_flags(), " --repeat 0 --rounds 9");
    }
}
