//! `replay`: one lane again, frame by frame.

use serde_json::json;

use super::args::ReplayArgs;
use super::progress::progress_bar;
use super::run::{exit_of, one_lane, tell_failures};
use super::signals::catch_interrupt;
use super::tell::loud;
use super::watchdog::Watchdog;
use super::{CliError, Streams};
use crate::check::Ruling;
use crate::cull::CullerKind;
use crate::report::{JSON_SCHEMA, MemoryFigures};
use crate::run::FrameTrace;

pub(super) fn replay(
    args: &ReplayArgs,
    cullers: &[CullerKind],
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let lane = (args.scene.as_str(), &args.culler, &args.oracle);
    let (plan, named) = one_lane(lane, (&args.scene_args, args.repeat), cullers, streams)?;
    catch_interrupt();
    let bar = progress_bar();
    let watchdog = Watchdog::start(&args.scene_args.frame_limit, |_| {});
    let finished = plan.run(&named, &bar, streams);
    drop(watchdog);
    bar.finish_and_clear();
    let finished = finished?;
    let (trace, gate, why) = (&finished.traces[0], &finished.gates[0], &finished.whys[0]);
    for frame in &trace.frames {
        let line = if args.json { json_line(frame) } else { text_line(frame) };
        writeln!(streams.out, "{line}")?;
    }
    let hash = format!("{:016x}", trace.hash());
    tell_failures((gate, trace, why), streams)?;
    let mut ruling = gate.ruling();
    if let Some(expected) = args.expect.as_ref().filter(|expected| **expected != hash) {
        writeln!(
            streams.talk,
            "trace hash {hash} is not the expected {expected}: another build, device or scene"
        )?;
        ruling = Ruling::Failed;
    }
    if !args.json {
        writeln!(streams.out, "trace hash {hash}, verdict: {}", loud(ruling))?;
    }
    Ok(exit_of(ruling))
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
