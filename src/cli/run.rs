//! `run`: scenes × cullers × oracles, side by side under one truth.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::json;

use super::args::{RunArgs, quoted};
use super::progress::progress_bar;
use super::signals::catch_interrupt;
use super::watchdog::{AtHang, Hung, SharedFile, Watchdog};
use super::{CliError, EXIT_FAILED, Outputs, Streams};
use crate::check::Ruling;
use crate::cull::CullerKind;
use crate::report::{JSON_SCHEMA, JunitCase, JunitEnd, Row, junit, table};
use crate::run::{caught, partition_difference};

pub(super) use super::oracles::{Oracles, StagedOracles};
pub(super) use super::plan::{
    Finished, Named, Plan, matching, one_lane, pick_cache, pick_cost, pick_cullers, pick_index,
};
pub(super) use super::tell::{error_case, exit_of, failure_lines, junit_case, loud, tell_failures};

/// The scenes of the default run.
const DEFAULT_SCENES: [&str; 4] = ["bunnies", "city", "rooms", "soup"];
/// Frames of the default run: 24 at full size take over two minutes on two cores, and the default
/// is to answer within one. Naming a scene or `--frames` lifts the cut.
const DEFAULT_RUN_FRAMES: u32 = 6;

/// What a run came to so far: all that was finished is in it.
#[derive(Default)]
struct Told {
    rows: Vec<Row>,
    ruling: Ruling,
    /// A lane each; the watchdog has them as well.
    cases: Arc<Mutex<Vec<JunitCase>>>,
}

/// Locks the cases: they are whole at every moment, also after a panic elsewhere.
fn locked(cases: &Mutex<Vec<JunitCase>>) -> MutexGuard<'_, Vec<JunitCase>> {
    cases.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends the outputs of a run in which a lane hangs.
fn keep_at_hang(hung: &Hung, cases: &Mutex<Vec<JunitCase>>, out: &AtHang, junit_file: &AtHang) {
    let line = json!({
        "schema": JSON_SCHEMA,
        "scene": hung.scene,
        "seed": hung.seed,
        "culler": hung.culler,
        "oracle": hung.oracle,
        "verdict": Ruling::Failed.word(),
        "failures": hung.failures,
    });
    out.finish(format!("{line}\n").as_bytes());
    let mut cases = locked(cases);
    cases.push(JunitCase {
        scene: hung.scene.clone(),
        name: format!("{}@{}", hung.culler, hung.oracle),
        seconds: hung.seconds,
        end: JunitEnd::Failure,
        failures: hung.lines(),
    });
    junit_file.finish(junit(&cases).as_bytes());
}

/// The line that runs a scene's lanes again.
fn run_line(args: &RunArgs, plan: &Plan<'_>, scene: &Named) -> String {
    let mut line = format!("plainsight run --scene {}", quoted(scene.name()));
    for (name, values) in [("culler", &args.culler), ("oracle", &args.oracle)] {
        if !values.is_empty() {
            line += &format!(" --{name} {}", quoted(&values.join(",")));
        }
    }
    line + &plan.args.replay_flags(scene.scene()) + &plan.repeat.replay_flags()
}

pub(super) fn run(
    args: &RunArgs,
    cullers: &[CullerKind],
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let junit_file = args.junit.as_deref().map(|path| outputs.file("--junit", path)).transpose()?;
    let mut junit_file = SharedFile::new(junit_file);
    let mut told = Told::default();
    // A panic leaves the file as well.
    let code =
        caught(|| run_scenes(args, cullers, (&mut told, &junit_file.at_hang()), outputs, streams))
            .unwrap_or_else(|said| {
                Err(CliError::Panicked { place: format!("replay: {}", outputs.again()), said })
            });
    if matches!(&code, Err(error) if error.is_bad_input()) {
        return code;
    }
    let mut cases = locked(&told.cases);
    if let Err(error) = &code {
        cases.push(error_case("plainsight", "run", error, outputs.again()));
    }
    let written = junit_file.finish(junit(&cases).as_bytes());
    code.and_then(|code| written.map(|()| code))
}

/// Runs scene after scene; what was finished is in `told`, and written, also where one ends in an error.
fn run_scenes(
    args: &RunArgs,
    cullers: &[CullerKind],
    (told, junit_file): (&mut Told, &AtHang),
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let out = args.out.as_deref().map(|path| outputs.file("--out", path)).transpose()?;
    let mut out = SharedFile::new(out);
    let names: Vec<&str> = if args.scene.is_empty() {
        DEFAULT_SCENES.to_vec()
    } else {
        args.scene.iter().map(String::as_str).collect()
    };
    let names = matching(&names)?;
    let mut scene_args = args.scene_args.clone();
    if args.scene.is_empty() {
        scene_args.frames = scene_args.frames.or(Some(DEFAULT_RUN_FRAMES));
    }
    let open = |name: &String| Named::open(name, &scene_args);
    let (chosen, index) =
        (pick_cullers(&args.culler, cullers)?, pick_index(&args.scene_args.index)?);
    Oracles::known(&args.oracle)?;
    let scenes = names.iter().map(open).collect::<Result<Vec<Named>, CliError>>()?;
    let adapter = args.scene_args.adapter.as_deref();
    let cost = pick_cost(&scene_args)?;
    let plan = Plan {
        cullers: chosen,
        index,
        cache: pick_cache(&scene_args)?,
        oracles: Oracles::open(&args.oracle, adapter, streams)?.simulating(&cost, &scene_args),
        cost,
        repeat: args.repeat,
        with_bound: false,
        args: &scene_args,
    };
    catch_interrupt();
    let bar = progress_bar();
    let (cases, at_out, at_junit) = (Arc::clone(&told.cases), out.at_hang(), junit_file.clone());
    let watchdog = Watchdog::start(&scene_args.frame_limit, move |hung| {
        keep_at_hang(hung, &cases, &at_out, &at_junit);
    });
    let ended = scenes.iter().try_for_each(|named| {
        let finished = plan.run(named, &bar, streams).map_err(|error| (Some(named), error))?;
        bar.suspend(|| tell_scene(args, &finished, told, &mut out, streams))
            .map_err(|error| (None, error))
    });
    drop(watchdog);
    bar.finish_and_clear();
    if !args.json {
        let cut = args.scene.is_empty() && args.scene_args.frames.is_none();
        match &ended {
            Ok(()) => tell_table(&told.rows, cut, streams)?,
            // No verdict over a part of what was asked for.
            Err(_) if told.rows.is_empty() => {}
            Err(_) => write!(streams.out, "{}", table(&told.rows))?,
        }
    }
    // What stood there before stays where nothing was finished.
    if ended.is_ok() || !told.rows.is_empty() {
        out.finish(&[])?;
    }
    let Err((scene, error)) = ended else { return Ok(exit_of(told.ruling)) };
    if let Some(scene) = scene.filter(|_| !error.is_bad_input()) {
        let replay = run_line(args, &plan, scene);
        writeln!(streams.talk, "replay: {replay}")?;
        locked(&told.cases).push(error_case(scene.name(), "all lanes", &error, &replay));
    }
    // What failed before is worse than how the run ended.
    if told.ruling == Ruling::Failed {
        writeln!(streams.talk, "plainsight: {error}")?;
        return Ok(EXIT_FAILED);
    }
    Err(error)
}

/// A scene's lanes: their rows, cases and failures.
fn tell_scene(
    args: &RunArgs,
    finished: &Finished,
    told: &mut Told,
    out: &mut SharedFile<'_>,
    streams: &mut Streams<'_>,
) -> Result<(), CliError> {
    told.ruling = told.ruling.max(finished.ruling());
    let difference = partition_difference(&finished.world);
    for (gate, trace, why) in finished.lanes() {
        let row = Row::new(&finished.world, trace, gate, difference);
        let line = serde_json::to_string(&row).expect("a row is plain data");
        if args.json {
            writeln!(streams.out, "{line}")?;
        }
        out.line(&line)?;
        locked(&told.cases).push(junit_case(&row, gate.ruling(), failure_lines(gate, trace)));
        told.rows.push(row);
        tell_failures((gate, trace, why), streams)?;
    }
    Ok(())
}

fn tell_table(rows: &[Row], cut: bool, streams: &mut Streams<'_>) -> Result<(), CliError> {
    write!(streams.out, "{}", table(rows))?;
    let mut said = Vec::new();
    for row in rows {
        if !said.contains(&&row.scene) {
            said.push(&row.scene);
            writeln!(
                streams.out,
                "{}: seed {}, {} frames{}, {} objects, {} triangles cut into {} in {} parts ({} pixels differ from the uncut scene)",
                row.scene,
                row.seed,
                row.frames,
                if row.views > 1 { format!(" of {} views", row.views) } else { String::new() },
                row.objects,
                row.triangles,
                row.fragments,
                row.parts,
                row.partition_difference_pixels
            )?;
        }
    }
    if let Some(device) = rows.iter().find_map(|row| row.device.as_ref()) {
        writeln!(streams.out, "hardware: {device}")?;
    }
    for row in rows.iter().filter(|row| row.may_missed > 0) {
        writeln!(
            streams.out,
            "tolerance: {} {} {}: {} times a part was not drawn that shows exactly and need not show on the device",
            row.scene, row.culler, row.oracle, row.may_missed
        )?;
    }
    if cut {
        writeln!(
            streams.out,
            "frames: cut to {DEFAULT_RUN_FRAMES} of 24 to answer within a minute; --frames 24 runs them all"
        )?;
    }
    let held = rows.iter().filter(|row| row.ruling() == Ruling::Held).count();
    let word = loud(rows.iter().map(Row::ruling).max().unwrap_or_default());
    writeln!(
        streams.out,
        "verdict: {word} ({held} of {} lanes held; figures per frame)",
        rows.len()
    )?;
    Ok(())
}
