//! `run`: scenes × cullers × oracles, side by side under one truth.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use serde_json::json;

use super::args::{RunArgs, quoted};
use super::progress::progress_bar;
use super::watchdog::{Hung, Watchdog};
use super::{CliError, EXIT_FAILED, EXIT_INTERRUPTED, EXIT_USAGE, OutFile, Streams};
use crate::check::Ruling;
use crate::cull::CullerKind;
use crate::report::{JSON_SCHEMA, JunitCase, JunitEnd, Row, junit, table};
use crate::run::partition_difference;

pub(super) use super::oracles::{Oracles, StagedOracles};
pub(super) use super::plan::{
    Finished, Named, Plan, matching, one_lane, pick_cache, pick_cost, pick_cullers, pick_index,
};
pub(super) use super::tell::{exit_of, failure_lines, junit_case, loud, tell_failures};

/// The scenes of the default run.
const DEFAULT_SCENES: [&str; 4] = ["bunnies", "city", "rooms", "soup"];
/// Frames of the default run: 24 at full size take over two minutes on two cores, and the default
/// is to answer within one. Naming a scene or `--frames` lifts the cut.
const DEFAULT_RUN_FRAMES: u32 = 6;

/// Set by Ctrl-C; a run looks at it after every frame of every lane.
static INTERRUPTED: AtomicBool = AtomicBool::new(false);

/// Whether the user asked to stop.
pub(super) fn interrupted() -> bool {
    INTERRUPTED.load(Ordering::Relaxed)
}

/// Lets Ctrl-C end the run at the next frame. A second handler in one process changes nothing.
pub(super) fn catch_interrupt() {
    let _ = ctrlc::set_handler(|| {
        if INTERRUPTED.swap(true, Ordering::Relaxed) {
            // Asked twice: at once.
            std::process::exit(i32::from(super::EXIT_INTERRUPTED));
        }
    });
}

/// What is left behind of a run, whole or cut short: by then all that was finished is in it.
#[derive(Default)]
struct Kept {
    /// JSON, a lane each.
    lines: String,
    cases: Vec<JunitCase>,
    out: Option<OutFile>,
    junit: Option<OutFile>,
}

impl Kept {
    /// Writes the files.
    fn finish(&mut self) -> Result<(), CliError> {
        if let Some(out) = self.out.take() {
            out.finish(self.lines.as_bytes())?;
        }
        self.junit.take().map_or(Ok(()), |file| file.finish(junit(&self.cases).as_bytes()))
    }

    /// Adds a lane that hangs, and writes the files.
    fn hung(&mut self, hung: &Hung) {
        let line = json!({
            "schema": JSON_SCHEMA,
            "scene": hung.scene,
            "seed": hung.seed,
            "culler": hung.culler,
            "oracle": hung.oracle,
            "verdict": Ruling::Failed.word(),
            "failures": hung.failures,
        });
        self.lines += &format!("{line}\n");
        self.cases.push(JunitCase {
            scene: hung.scene.clone(),
            name: format!("{}@{}", hung.culler, hung.oracle),
            seconds: hung.seconds,
            end: JunitEnd::Failure,
            failures: hung.lines(),
        });
        // The process ends as failed in any case.
        let _ = self.finish();
    }

    /// Adds a scene that could not be run to its end.
    fn broken_off(&mut self, scene: &Named, replay: &str, error: &CliError) {
        let end = match error.exit() {
            EXIT_FAILED => JunitEnd::Failure,
            _ => JunitEnd::Error,
        };
        self.cases.push(JunitCase {
            scene: scene.scene().name.clone(),
            name: "all lanes".to_owned(),
            seconds: 0.0,
            end,
            failures: vec![error.to_string(), format!("replay: {replay}")],
        });
    }
}

/// Locks what is kept: it is whole at every moment, also after a panic elsewhere.
fn locked(kept: &Mutex<Kept>) -> MutexGuard<'_, Kept> {
    kept.lock().unwrap_or_else(PoisonError::into_inner)
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
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let out = args.out.as_deref().map(OutFile::create).transpose()?;
    let junit = args.junit.as_deref().map(OutFile::create).transpose()?;
    let kept = Arc::new(Mutex::new(Kept { out, junit, ..Kept::default() }));
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
    let at_hang = Arc::clone(&kept);
    let watchdog =
        Watchdog::start(&scene_args.frame_limit, move |hung| locked(&at_hang).hung(hung));
    let (mut rows, mut ruling) = (Vec::new(), Ruling::Held);
    let mut ended = Ok(());
    for named in &scenes {
        let finished = plan.run(named, &bar, streams);
        match finished {
            Ok(finished) => {
                ruling = ruling.max(finished.ruling());
                let mut kept = locked(&kept);
                bar.suspend(|| tell_scene(args, &finished, &mut kept, &mut rows, streams))?;
            }
            // Bad input leaves nothing behind.
            Err(error) if error.exit() == EXIT_USAGE => {
                bar.finish_and_clear();
                return Err(error);
            }
            Err(error) => {
                if error.exit() != EXIT_INTERRUPTED {
                    let replay = run_line(args, &plan, named);
                    bar.suspend(|| writeln!(streams.talk, "replay: {replay}"))?;
                    locked(&kept).broken_off(named, &replay, &error);
                }
                ended = Err(error);
                break;
            }
        }
    }
    drop(watchdog);
    bar.finish_and_clear();
    if !args.json && (ended.is_ok() || !rows.is_empty()) {
        let cut = args.scene.is_empty() && args.scene_args.frames.is_none();
        tell_table(&rows, cut, streams)?;
    }
    locked(&kept).finish()?;
    match ended {
        // What failed before is worse than how the run ended.
        Err(error) if ruling != Ruling::Failed => Err(error),
        Err(error) => {
            writeln!(streams.talk, "plainsight: {error}")?;
            Ok(EXIT_FAILED)
        }
        Ok(()) => Ok(exit_of(ruling)),
    }
}

/// A scene's lanes: their rows, cases and failures.
fn tell_scene(
    args: &RunArgs,
    finished: &Finished,
    kept: &mut Kept,
    rows: &mut Vec<Row>,
    streams: &mut Streams<'_>,
) -> Result<(), CliError> {
    let difference = partition_difference(&finished.world);
    for (gate, trace, why) in finished.lanes() {
        let row = Row::new(&finished.world, trace, gate, difference);
        let line = serde_json::to_string(&row).expect("a row is plain data");
        if args.json {
            writeln!(streams.out, "{line}")?;
        }
        kept.lines += &format!("{line}\n");
        kept.cases.push(junit_case(&row, gate.ruling(), failure_lines(gate, trace)));
        rows.push(row);
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
