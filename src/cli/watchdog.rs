//! A watchdog beside a run: a culler or device that does not come back from a frame cannot be stopped, as
//! threads cannot. So a thread looks at the heartbeats of the lanes, and where one is within a frame for
//! longer than the limit it says which, has the verb keep what it can, and ends the process as failed.

use std::io::Write;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

use clap::Args;

use super::out_file::{OutFile, WholeFile};
use super::{CliError, EXIT_FAILED};
use crate::check::Gate;
use crate::run::{Beat, Cause, Observer, Stop, oldest_beat};

/// Seconds that a frame of a lane may take where nothing is said. A frame of the plant at full size takes a few
/// seconds on a software device on two cores; this is far beyond, and still short of a CI system's patience.
const DEFAULT_SECONDS: f64 = 120.0;
/// The watchdog looks so often.
const LOOKS_EVERY: Duration = Duration::from_millis(100);

/// How long a frame may take.
#[derive(Args, Clone, Copy, Debug, PartialEq)]
pub(super) struct FrameLimit {
    /// Seconds that one frame of one culler may take before the run is ended as failed; 0 for any time.
    #[arg(long, value_name = "SECONDS", default_value_t = DEFAULT_SECONDS, value_parser = seconds)]
    pub(super) frame_limit: f64,
}

impl Default for FrameLimit {
    fn default() -> Self {
        Self { frame_limit: DEFAULT_SECONDS }
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    let seconds = text.parse().ok().filter(|&s| Duration::try_from_secs_f64(s).is_ok());
    seconds.ok_or_else(|| "write a number of seconds, or 0 for no limit".to_owned())
}

impl FrameLimit {
    /// As a time; `None` for no limit.
    pub(super) fn time(self) -> Option<Duration> {
        Some(Duration::from_secs_f64(self.frame_limit)).filter(|limit| !limit.is_zero())
    }

    /// The flag that leads here again, with a space before it; nothing for the default.
    pub(super) fn replay_flags(self) -> String {
        let usual = self == Self::default();
        if usual { String::new() } else { format!(" --frame-limit {}", self.frame_limit) }
    }
}

/// A lane that does not come back.
pub(super) struct Hung {
    pub(super) scene: String,
    pub(super) seed: u64,
    pub(super) culler: String,
    pub(super) oracle: &'static str,
    pub(super) seconds: f64,
    /// What the gate says of it, a line each.
    pub(super) failures: Vec<String>,
    pub(super) replay: String,
}

impl Hung {
    fn of(beat: &Beat, limit: FrameLimit) -> Self {
        // The words are the gate's own.
        let mut gate = Gate::default();
        let cause = Cause::Hang(limit.frame_limit);
        gate.stopped(&Stop { moment: beat.moment, again: false, cause });
        let (scene, seed) = (*beat.scene).clone();
        Self {
            scene,
            seed,
            culler: beat.lane.culler.clone(),
            oracle: beat.lane.oracle,
            seconds: beat.age().as_secs_f64(),
            failures: gate.failures(),
            replay: beat.lane.replay.clone(),
        }
    }

    /// The failures and, where it is known, the line that replays them.
    pub(super) fn lines(&self) -> Vec<String> {
        let replay = Some(&self.replay).filter(|replay| !replay.is_empty());
        let replay = replay.map(|replay| format!("replay: {replay}"));
        self.failures.iter().cloned().chain(replay).collect()
    }
}

/// Ends its thread when dropped.
pub(super) struct Watchdog {
    ends: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

impl Watchdog {
    /// Watches every lane of this process. `keep` is called once, before the process ends, and may say
    /// another line that replays it.
    pub(super) fn start(
        limit: &FrameLimit,
        mut keep: impl FnMut(&mut Hung) + Send + 'static,
    ) -> Self {
        let limit = *limit;
        let Some(time) = limit.time() else { return Self { ends: None, thread: None } };
        let (ends, end) = channel::<()>();
        let watch = move || {
            while end.recv_timeout(LOOKS_EVERY) == Err(RecvTimeoutError::Timeout) {
                if let Some(beat) = oldest_beat().filter(|beat| beat.age() > time) {
                    let mut hung = Hung::of(&beat, limit);
                    keep(&mut hung);
                    tell(&hung);
                    super::out_file::remove_partials();
                    std::process::exit(i32::from(EXIT_FAILED));
                }
            }
        };
        Self { ends: Some(ends), thread: Some(std::thread::spawn(watch)) }
    }
}

/// Says it on the process's own standard error: the streams of the verb are in the thread that hangs.
fn tell(hung: &Hung) {
    let mut text = format!(
        "FAILED: {} on {} in {}, seed {}\n",
        hung.culler, hung.oracle, hung.scene, hung.seed
    );
    for line in hung.lines() {
        text += &format!("  {line}\n");
    }
    // Nothing can be done where even this cannot be written.
    let _ = std::io::stderr().lock().write_all(text.as_bytes());
}

impl Drop for Watchdog {
    fn drop(&mut self) {
        drop(self.ends.take());
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// An output that a verb writes, and that its watchdog ends where the verb hangs.
pub(super) struct SharedFile<'a> {
    /// Standard output, where the output is it: a stream that only the verb's own thread may use.
    stream: Option<&'a mut dyn Write>,
    at_hang: AtHang,
}

/// The watchdog's end of a [`SharedFile`].
#[derive(Clone)]
pub(super) enum AtHang {
    /// There is no output.
    Nothing,
    /// The output is standard output, which a verb that hangs no longer writes to.
    StandardOutput,
    /// The output is a file.
    File(Arc<Mutex<Option<WholeFile>>>),
}

impl<'a> SharedFile<'a> {
    pub(super) fn new(file: Option<OutFile<'a>>) -> Self {
        match file {
            None => Self { stream: None, at_hang: AtHang::Nothing },
            Some(OutFile::Stream(stream)) => {
                Self { stream: Some(stream), at_hang: AtHang::StandardOutput }
            }
            Some(OutFile::File(file)) => {
                Self { stream: None, at_hang: AtHang::File(Arc::new(Mutex::new(Some(file)))) }
            }
        }
    }

    /// For the watchdog.
    pub(super) fn at_hang(&self) -> AtHang {
        self.at_hang.clone()
    }

    /// Adds a line, if there is an output.
    pub(super) fn line(&mut self, line: &str) -> Result<(), CliError> {
        match (&mut self.stream, &self.at_hang) {
            (Some(stream), _) => OutFile::Stream(&mut **stream).line(line),
            (None, AtHang::File(file)) => {
                locked(file).as_mut().map_or(Ok(()), |file| file.line(line))
            }
            (None, _) => Ok(()),
        }
    }

    /// Adds the rest and ends the output, if there is one that has not ended.
    pub(super) fn finish(&mut self, rest: &[u8]) -> Result<(), CliError> {
        match (self.stream.take(), &self.at_hang) {
            (Some(stream), _) => OutFile::Stream(stream).finish(rest),
            (None, AtHang::File(file)) => {
                let file = locked(file).take();
                file.map_or(Ok(()), |file| file.finish(rest))
            }
            (None, _) => Ok(()),
        }
    }
}

impl AtHang {
    /// Adds the rest and ends the output.
    pub(super) fn finish(&self, rest: &[u8]) {
        // The process ends as failed in any case.
        let _ = match self {
            Self::Nothing => return,
            Self::StandardOutput => std::io::stdout().lock().write_all(rest),
            Self::File(file) => {
                let file = locked(file).take();
                let _ = file.map(|file| file.finish(rest));
                return;
            }
        };
    }
}

/// An output is whole at every moment, also after a panic elsewhere.
fn locked(file: &Mutex<Option<WholeFile>>) -> MutexGuard<'_, Option<WholeFile>> {
    file.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_is_no_limit() {
        let limit = |text: &str| seconds(text).map(|frame_limit| FrameLimit { frame_limit });
        assert_eq!(limit("0").unwrap().time(), None);
        assert_eq!(limit("2.5").unwrap().time(), Some(Duration::from_millis(2500)));
        for bad in ["-1", "nan", "inf", "1e30", "soon"] {
            assert!(limit(bad).unwrap_err().contains("0 for no limit"), "{bad}");
        }
        let off = Watchdog::start(&limit("0").unwrap(), |_| {});
        assert!(off.thread.is_none(), "nobody watches");
        assert_eq!(FrameLimit::default().replay_flags(), "");
        assert_eq!(limit("2.5").unwrap().replay_flags(), " --frame-limit 2.5");
    }
}
