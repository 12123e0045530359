//! What verbs say of lanes that did not hold, and the exit code that it comes to.

use super::{CliError, EXIT_DEVICE, EXIT_FAILED, EXIT_HELD, Streams};
use crate::check::{Check, Gate, Ruling};
use crate::report::{JunitCase, JunitEnd, Row};
use crate::run::{Moment, Trace};

/// The exit code of what all lanes came to: a failure is told before a device that is at fault.
pub(super) fn exit_of(ruling: Ruling) -> u8 {
    match ruling {
        Ruling::Held => EXIT_HELD,
        Ruling::NotRepeatable | Ruling::Lost => EXIT_DEVICE,
        Ruling::Failed => EXIT_FAILED,
    }
}

/// The word of the last line, as it is shouted where something failed.
pub(super) fn loud(ruling: Ruling) -> &'static str {
    match ruling {
        Ruling::Failed => "FAILED",
        other => other.word(),
    }
}

/// What the gate says of a lane, the line that replays it last; nothing where it held.
pub(super) fn failure_lines(gate: &Gate, trace: &Trace) -> Vec<String> {
    let mut lines = gate.failures();
    if !lines.is_empty() {
        lines.push(format!("replay: {}", trace.lane.replay));
    }
    lines
}

/// The lane of a row.
pub(super) fn junit_case(row: &Row, ruling: Ruling, failures: Vec<String>) -> JunitCase {
    JunitCase {
        scene: row.scene.clone(),
        name: format!("{}@{}", row.culler, row.oracle),
        seconds: row.wall_ms / 1000.0,
        end: junit_end(ruling),
        failures,
    }
}

/// A case that came to no verdict: why, and the line that runs it again. A panic is a failure of what was
/// tested.
pub(super) fn error_case(scene: &str, name: &str, error: &CliError, again: &str) -> JunitCase {
    let end = if error.exit() == EXIT_FAILED { JunitEnd::Failure } else { JunitEnd::Error };
    JunitCase {
        scene: scene.to_owned(),
        name: name.to_owned(),
        seconds: 0.0,
        end,
        failures: vec![error.to_string(), format!("replay: {again}")],
    }
}

/// A failure is one of what was tested; a device at fault is an error of the test.
pub(super) fn junit_end(ruling: Ruling) -> JunitEnd {
    match ruling {
        Ruling::Held => JunitEnd::Held,
        Ruling::Failed => JunitEnd::Failure,
        Ruling::NotRepeatable | Ruling::Lost => JunitEnd::Error,
    }
}

/// The heading over a lane's failures: who did not hold.
pub(super) fn heading(gate: &Gate, culler: &str, oracle: &str) -> String {
    match gate.ruling() {
        Ruling::Failed if gate.only_truth_failed() => {
            format!("FAILED: the truth, found beside {culler} on {oracle}")
        }
        Ruling::Failed => format!("FAILED: {culler} on {oracle}"),
        other => format!("{}: {oracle} under {culler}", other.word().to_uppercase()),
    }
}

/// What failed, the line that replays it, and, where a part was missed, the line that says why: `why` as far as
/// it does not depend on the part.
pub(super) fn tell_failures(
    (gate, trace, why): (&Gate, &Trace, &str),
    streams: &mut Streams<'_>,
) -> std::io::Result<()> {
    if gate.held() {
        return Ok(());
    }
    let lane = &trace.lane;
    writeln!(streams.talk, "{}", heading(gate, &lane.culler, lane.oracle))?;
    gate.failures().iter().try_for_each(|line| writeln!(streams.talk, "  {line}"))?;
    // Where a culler or device did not repeat or a device did not stay, no hash can be expected of it.
    let repeats = |check: &Check| {
        check.ruling() == Ruling::Failed && !matches!(check, Check::Determinism | Check::Hang)
    };
    let expect = if gate.checks().iter().all(repeats) {
        format!(" --expect {:016x}", trace.hash())
    } else {
        String::new()
    };
    writeln!(streams.talk, "  replay: {}{expect}", lane.replay)?;
    if let Some(miss) = gate.conservative.misses().first() {
        let Moment { frame, view } = miss.moment;
        let view = if view > 0 { format!(" --view {view}") } else { String::new() };
        writeln!(streams.talk, "  why: {why} --frame {frame}{view} --part {}", miss.part.0)?;
    }
    Ok(())
}
