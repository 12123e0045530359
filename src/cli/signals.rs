//! Signals: Ctrl-C (SIGINT), SIGTERM and SIGHUP, which Slurm, Kubernetes and closing terminals send. The first
//! one ends a verb at its next frame, so that what was finished is written; the second one ends the
//! process at once. The exit code is 128 and the signal's number, as shells count it.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicI32, Ordering};

use crate::run::RunError;

/// Shells add a signal's number to this.
const EXIT_SIGNAL: i32 = 128;
/// The first signal that was caught; 0 for none.
static CAUGHT: AtomicI32 = AtomicI32::new(0);

/// Whether the user, or whoever started the process, asked it to stop.
pub(super) fn interrupted() -> bool {
    CAUGHT.load(Ordering::Relaxed) != 0
}

/// The exit code of a verb that was stopped.
pub(super) fn exit_interrupted() -> u8 {
    match CAUGHT.load(Ordering::Relaxed) {
        0 => super::EXIT_INTERRUPTED,
        signal => (EXIT_SIGNAL + signal) as u8,
    }
}

/// Has signals end the verb at its next frame, from here on. Signals that whoever started the process has it
/// ignore stay ignored: SIGHUP under `nohup`, SIGINT of a script's background jobs.
#[cfg(unix)]
pub(super) fn catch_interrupt() {
    use std::sync::{Once, mpsc};

    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    static CATCHING: Once = Once::new();
    let watch = |ready: mpsc::Sender<()>| {
        let ignored = ignored();
        let wanted = [SIGINT, SIGTERM, SIGHUP].into_iter();
        let wanted = wanted.filter(|signal| ignored >> (signal - 1) & 1 == 0);
        let signals = Signals::new(wanted);
        drop(ready);
        // Where no handler can be set, signals end the process as they always do.
        let Ok(mut signals) = signals else { return };
        for signal in signals.forever() {
            let first = CAUGHT.compare_exchange(0, signal, Ordering::Relaxed, Ordering::Relaxed);
            if first.is_err() {
                super::out_file::remove_partials();
                // Nothing is cleaned up: a driver's own clean-up may wait for the thread that hangs.
                signal_hook::low_level::exit(EXIT_SIGNAL + signal);
            }
        }
    };
    CATCHING.call_once(|| {
        let (ready, set) = mpsc::channel();
        let started =
            std::thread::Builder::new().name("signals".to_owned()).spawn(move || watch(ready));
        if started.is_ok() {
            // Comes back when the other end is dropped: the handlers are set.
            let _ = set.recv();
        }
    });
}

/// Signals end the process as they always do.
#[cfg(not(unix))]
pub(super) fn catch_interrupt() {}

/// The signals that the process ignores, bit n - 1 for signal n; none where the system does not tell.
#[cfg(unix)]
fn ignored() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// What unwinds out of work that has no other way to stop.
struct Stopped;

/// Unwinds to [`stoppable`] where a signal was caught: for callbacks of work that cannot be told to stop.
pub(super) fn stop_where_interrupted() {
    if interrupted() {
        // No panic: no hook is called, nothing is said.
        resume_unwind(Box::new(Stopped));
    }
}

/// Does work that [`stop_where_interrupted`] may stop.
///
/// # Errors
/// [`RunError::Interrupted`] where it did.
pub(super) fn stoppable<T>(work: impl FnOnce() -> T) -> Result<T, RunError> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| {
        if payload.is::<Stopped>() { RunError::Interrupted } else { resume_unwind(payload) }
    })
}
