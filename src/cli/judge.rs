//! `judge`: what a culler of another engine drew, before the same gate. It comes from a file, from standard
//! input, or from a process that is told each frame and asked what it draws. The format stands at the top
//! of `crate::foreign`.

use std::io::{BufReader, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use clap::Args;
use plainsight_reference::Tolerance;

use super::args::{SceneArgs, quoted};
use super::progress::progress_bar;
use super::run::{Named, catch_interrupt, interrupted, pick_cache};
use super::{CliError, EXIT_FAILED, EXIT_HELD, OutFile, Streams};
use crate::check::Gate;
use crate::foreign::{Drawn, ForeignError, frame_line, header_line};
use crate::part::PartId;
use crate::report::{JunitCase, Row, Shown, junit, part_picture, picture_png, table, top_view};
use crate::run::{
    FrameRecord, FrameState, LaneInfo, Moment, Observer, RunError, Trace, Truth, World,
    partition_difference, render, told,
};

/// Pixels along a side of the view from above.
const TOP_VIEW_SIDE: u32 = 1024;

#[derive(Args, Clone)]
pub(super) struct JudgeArgs {
    /// The scene, by name or file; with the same flags as it was exported.
    #[arg(long, value_name = "NAME|FILE.toml")]
    scene: String,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// What was drawn, JSON lines; `-` reads standard input.
    #[arg(long, value_name = "FILE.jsonl|-", required_unless_present = "pipe")]
    drawn: Option<PathBuf>,
    /// A command that is started, told each frame on its standard input, and read from its standard output.
    #[arg(long, value_name = "COMMAND", conflicts_with = "drawn")]
    pipe: Option<String>,
    /// Folder for pictures of the first bad frame: the truth, what was drawn, the view from above.
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
    /// One JSON object on standard output in place of the table.
    #[arg(long)]
    json: bool,
    /// Also write the result as JUnit XML to this file.
    #[arg(long, value_name = "FILE.xml")]
    junit: Option<PathBuf>,
}

impl From<ForeignError> for CliError {
    fn from(error: ForeignError) -> Self {
        Self::Usage(error.to_string())
    }
}

/// A started culler.
struct Process {
    child: Child,
    tell: Option<BufWriter<ChildStdin>>,
    command: String,
}

impl Process {
    fn start(command: &str) -> Result<(Self, ChildStdout), CliError> {
        let started = Command::new("sh")
            .args(["-c", command])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut child = started.map_err(|error| {
            CliError::Usage(format!("--pipe {}: cannot be started: {error}", quoted(command)))
        })?;
        let tell = child.stdin.take().map(BufWriter::new);
        let answers = child.stdout.take().expect("its output is piped");
        Ok((Self { child, tell, command: command.to_owned() }, answers))
    }

    /// Writes a line and sees that it gets there.
    fn tell(&mut self, line: &str) -> Result<(), CliError> {
        let tell = self.tell.as_mut().expect("nothing is told after the end");
        let told = tell.write_all(line.as_bytes()).and_then(|()| tell.write_all(b"\n"));
        told.and_then(|()| tell.flush()).map_err(|error| self.stopped(&error.to_string()))
    }

    fn stopped(&mut self, what: &str) -> CliError {
        // What it was asked to read is closed, so that it ends by itself if it has not.
        self.tell = None;
        let status = self.child.wait().map_or_else(|error| error.to_string(), |s| s.to_string());
        let command = quoted(&self.command);
        CliError::Usage(format!(
            "--pipe {command}: stopped before the last frame ({status}): {what}"
        ))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.tell = None;
        // After an error it may not have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The first bad frame with what was drawn in it.
type Worst = Option<(Moment, Vec<PartId>)>;

/// The gate, and what was drawn when it first failed.
struct Watch {
    gate: Gate,
    worst: Worst,
}

impl Observer for Watch {
    fn frame(&mut self, record: &FrameRecord<'_>) {
        self.gate.frame(record);
        if self.worst.is_none() && !self.gate.held() {
            self.worst = Some((record.state.moment, record.drawn.to_vec()));
        }
    }
}

pub(super) fn judge(args: &JudgeArgs, streams: &mut Streams<'_>) -> Result<u8, CliError> {
    let named = Named::open(&args.scene, &args.scene_args)?;
    let cache = pick_cache(&args.scene_args)?;
    let junit_file = args.junit.as_deref().map(OutFile::create).transpose()?;
    let (name, file) = match (&args.drawn, &args.pipe) {
        (Some(path), _) if path.as_os_str() != "-" => {
            let read = |source| crate::scene::SceneError::Read { path: path.clone(), source };
            (path.display().to_string(), Some(std::fs::File::open(path).map_err(read)?))
        }
        (Some(_), _) => ("standard input".to_owned(), None),
        _ => (format!("--pipe {}", quoted(args.pipe.as_deref().unwrap_or_default())), None),
    };
    catch_interrupt();
    let bar = progress_bar();
    let world = named.world(&args.scene_args, cache.as_ref(), &bar, streams);
    bar.finish_and_clear();
    let world = world?;
    let mut process = None;
    let mut drawn = match (file, &args.pipe) {
        (Some(file), _) => Drawn::new(BufReader::new(file), name),
        (None, Some(command)) => {
            let (started, answers) = Process::start(command)?;
            process = Some(started);
            Drawn::new(BufReader::new(answers), name)
        }
        (None, None) => Drawn::new(BufReader::new(std::io::stdin()), name),
    };
    let bar = progress_bar();
    bar.set_message(args.scene.clone());
    bar.inc_length(u64::from(world.scene.frames) * u64::from(world.views()));
    let judged = gate(args, &world, &mut drawn, process.as_mut(), &bar);
    bar.finish_and_clear();
    // Ctrl-C reaches the process as well: what it did not say then is no fault of its own.
    let stopped = |error| if interrupted() { RunError::Interrupted.into() } else { error };
    let (trace, gate, worst) = judged.map_err(stopped)?;
    tell(args, &world, (&trace, &gate), junit_file, streams)?;
    if let (Some(folder), Some((moment, drawn))) = (&args.pictures, worst) {
        pictures(&world, moment, &drawn, folder, streams)?;
    }
    Ok(if gate.held() { EXIT_HELD } else { EXIT_FAILED })
}

/// Tells and reads every frame, and has the gate look at it.
fn gate(
    args: &JudgeArgs,
    world: &World,
    drawn: &mut Drawn<'_>,
    mut process: Option<&mut Process>,
    bar: &indicatif::ProgressBar,
) -> Result<(Trace, Gate, Worst), CliError> {
    if let Some(process) = &mut process {
        process.tell(&header_line(world))?;
    }
    let culler = drawn.header()?;
    let info = LaneInfo {
        culler,
        oracle: "told",
        device: None,
        tolerance: Tolerance::EXACT,
        replay: replay(args, world),
    };
    let parts = world.partition.part_count();
    let mut watch = Watch { gate: Gate::forgiving(args.scene_args.late), worst: None };
    let mut says = |state: &FrameState| -> Result<Vec<PartId>, CliError> {
        if interrupted() {
            return Err(RunError::Interrupted.into());
        }
        if let Some(process) = &mut process {
            process.tell(&frame_line(world, state))?;
        }
        let said = drawn.at(state.moment, parts)?;
        bar.inc(1);
        Ok(said)
    };
    let trace = told(world, world.scene.frames, &info, &mut says, &mut watch)?;
    if let Some(process) = process {
        // It sees that nothing more comes, and has its last word.
        process.tell = None;
    }
    drawn.end()?;
    Ok((trace, watch.gate, watch.worst))
}

fn replay(args: &JudgeArgs, world: &World) -> String {
    let from = match (&args.drawn, &args.pipe) {
        (Some(path), _) => format!("--drawn {}", quoted(&path.display().to_string())),
        (None, pipe) => format!("--pipe {}", quoted(pipe.as_deref().unwrap_or_default())),
    };
    format!(
        "plainsight judge --scene {} --seed {} --frames {} {from}{}",
        quoted(&args.scene),
        world.scene.seed,
        world.scene.frames,
        args.scene_args.replay_flags()
    )
}

fn tell(
    args: &JudgeArgs,
    world: &World,
    (trace, gate): (&Trace, &Gate),
    junit_file: Option<OutFile>,
    streams: &mut Streams<'_>,
) -> Result<(), CliError> {
    let row = Row::new(world, trace, gate, partition_difference(world));
    if args.json {
        let line = serde_json::to_string(&row).expect("a row is plain data");
        writeln!(streams.out, "{line}")?;
    } else {
        write!(streams.out, "{}", table(std::slice::from_ref(&row)))?;
    }
    let failures = failure_lines(gate, trace);
    if !failures.is_empty() {
        writeln!(streams.talk, "FAILED: {}", trace.lane.culler)?;
        failures.iter().try_for_each(|line| writeln!(streams.talk, "  {line}"))?;
    }
    if let Some(file) = junit_file {
        file.finish(junit(&[junit_case(&row, failures)]).as_bytes())?;
    }
    Ok(())
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
pub(super) fn junit_case(row: &Row, failures: Vec<String>) -> JunitCase {
    JunitCase {
        scene: row.scene.clone(),
        name: format!("{}@{}", row.culler, row.oracle),
        seconds: row.wall_ms / 1000.0,
        failures,
    }
}

fn pictures(
    world: &World,
    moment: Moment,
    drawn: &[PartId],
    folder: &Path,
    streams: &mut Streams<'_>,
) -> Result<(), CliError> {
    std::fs::create_dir_all(folder)
        .map_err(|source| CliError::Write { path: folder.display().to_string(), source })?;
    let state = FrameState::at(world, moment);
    let truth = Truth::of(world, &state);
    let mut image = world.image();
    render(world, &state, drawn, &mut image);
    let top = top_view(world, &state, &Shown { drawn, truth: &truth }, TOP_VIEW_SIDE);
    for (name, picture) in [
        ("truth.png", part_picture(world, &truth.image)),
        ("drawn.png", part_picture(world, &image)),
        ("top.png", top),
    ] {
        OutFile::create(&folder.join(name))?.finish(&picture_png(&picture))?;
    }
    let folder = folder.display();
    writeln!(streams.talk, "pictures of {moment}: {folder}/truth.png, drawn.png, top.png")?;
    Ok(())
}
