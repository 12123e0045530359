//! `replay`: one lane again, frame by frame.

use serde_json::json;

use super::args::ReplayArgs;
use super::progress::progress_bar;
use super::run::{catch_interrupt, one_lane, tell_failures};
use super::{CliError, EXIT_FAILED, EXIT_HELD, Streams};
use crate::cull::CullerKind;
use crate::report::{JSON_SCHEMA, MemoryFigures};
use crate::run::FrameTrace;

pub(super) fn replay(
    args: &ReplayArgs,
    cullers: &[CullerKind],
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let (plan, named) =
        one_lane((&args.scene, &args.culler, &args.oracle), &args.scene_args, cullers, streams)?;
    catch_interrupt();
    let bar = progress_bar();
    let finished = plan.run(&named, &bar, streams);
    bar.finish_and_clear();
    let finished = finished?;
    let (trace, gate) = (&finished.traces[0], &finished.gates[0]);
    for frame in &trace.frames {
        let line = if args.json { json_line(frame) } else { text_line(frame) };
        writeln!(streams.out, "{line}")?;
    }
    let hash = format!("{:016x}", trace.hash());
    tell_failures(gate, trace, streams)?;
    let mut held = gate.held();
    if let Some(expected) = args.expect.as_ref().filter(|expected| **expected != hash) {
        writeln!(
            streams.talk,
            "trace hash {hash} is not the expected {expected}: another build, device or scene"
        )?;
        held = false;
    }
    if !args.json {
        writeln!(
            streams.out,
            "trace hash {hash}, verdict: {}",
            if held { "held" } else { "FAILED" }
        )?;
    }
    Ok(if held { EXIT_HELD } else { EXIT_FAILED })
}

fn json_line(frame: &FrameTrace) -> String {
    let mut line = json!({
        "schema": JSON_SCHEMA,
        "frame": frame.moment.frame,
        "view": frame.moment.view,
        "drawn_parts": frame.drawn_parts,
        "visible_parts": frame.visible_parts,
        "queries": frame.counts.queries,
        "visible_answers": frame.counts.visible_answers,
        "round_trips": frame.counts.round_trips,
        "events_hash": format!("{:016x}", frame.events_hash),
        "truth_hash": format!("{:016x}", frame.truth_hash),
        "image_hash": format!("{:016x}", frame.image_hash),
        "wall_ms": frame.wall_ns as f64 / 1e6,
    });
    if let Some(memory) = MemoryFigures::of(std::slice::from_ref(frame)) {
        line["memory"] = json!(memory);
    }
    line.to_string()
}

fn text_line(frame: &FrameTrace) -> String {
    let memory = MemoryFigures::of(std::slice::from_ref(frame));
    format!(
        "{:<10}: drew {:>5}, visible {:>5}, {:>5} queries, {:>4} trips, {:>7.1} ms, events {:016x}{}",
        frame.moment.to_string(),
        frame.drawn_parts,
        frame.visible_parts,
        frame.counts.queries,
        frame.counts.round_trips,
        frame.wall_ns as f64 / 1e6,
        frame.events_hash,
        memory.map_or_else(String::new, |m| format!("; {}", m.clause()))
    )
}
