//! `judge`: what a culler of another engine drew, before the same gate. It comes from a file, from standard
//! input, or from a process that is told each frame and asked what it draws. The format stands at the top
//! of `crate::foreign`.

use std::io::{BufReader, BufWriter, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

use clap::Args;
use plainsight_reference::Tolerance;

use super::args::{SceneArgs, quoted};
use super::files::Files;
use super::out_file::OutFolder;
use super::progress::progress_bar;
use super::run::{Named, catch_interrupt, interrupted, pick_cache};
use super::waiting::Waiting;
use super::{CliError, EXIT_FAILED, EXIT_HELD, OutFile, Outputs, Streams};
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
    /// Also write the result as JUnit XML to this file, or to standard output for `-`.
    #[arg(long, value_name = "FILE.xml|-")]
    junit: Option<PathBuf>,
}

impl JudgeArgs {
    pub(super) fn files(&self) -> Files {
        let drawn = self.drawn.as_deref().filter(|path| path.as_os_str() != "-");
        Files::of_scenes(std::slice::from_ref(&self.scene), &self.scene_args)
            .reading("--drawn", drawn)
            .writing("--junit", self.junit.as_deref())
            .json(self.json)
    }
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

pub(super) fn judge(
    args: &JudgeArgs,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let junit_file = args.junit.as_deref().map(|path| outputs.file("--junit", path)).transpose()?;
    let mut cases = Vec::new();
    let code = judge_lane(args, &mut cases, outputs, streams);
    let Some(file) = junit_file else { return code };
    if let Err(error) = &code {
        cases.push(error_case(&args.scene, "judge", error, outputs.again()));
    }
    let written = file.finish(junit(&cases).as_bytes());
    code.and_then(|code| written.map(|()| code))
}

fn judge_lane(
    args: &JudgeArgs,
    cases: &mut Vec<JunitCase>,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let folder = args.pictures.as_deref().map(|path| outputs.folder("--pictures", path));
    let folder = folder.transpose()?;
    let files = folder.as_ref().map(|folder| PictureFiles::new(folder, outputs)).transpose()?;
    let named = Named::open(&args.scene, &args.scene_args)?;
    let cache = pick_cache(&args.scene_args)?;
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
    // What a culler says may come late or never: a signal is not kept waiting.
    let answers = match (file, &args.pipe) {
        (Some(file), _) => Waiting::new(file),
        (None, Some(command)) => {
            let (started, answers) = Process::start(command)?;
            process = Some(started);
            Waiting::new(answers)
        }
        (None, None) => Waiting::new(std::io::stdin()),
    };
    let mut drawn = Drawn::new(BufReader::new(answers), name);
    let bar = progress_bar();
    bar.set_message(args.scene.clone());
    bar.inc_length(u64::from(world.scene.frames) * u64::from(world.views()));
    let judged = gate(args, &world, &mut drawn, process.as_mut(), &bar);
    bar.finish_and_clear();
    // Ctrl-C reaches the process as well: what it did not say then is no fault of its own.
    let stopped = |error| if interrupted() { RunError::Interrupted.into() } else { error };
    let (trace, gate, worst) = judged.map_err(stopped)?;
    cases.push(tell(args, &world, (&trace, &gate), streams)?);
    if let (Some(files), Some((moment, drawn))) = (files, worst) {
        pictures(&world, moment, &drawn, files, streams)?;
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
    streams: &mut Streams<'_>,
) -> Result<JunitCase, CliError> {
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
    Ok(junit_case(&row, failures))
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
        errors: Vec::new(),
    }
}

/// A case that came to no verdict: why, and the line that runs it again.
pub(super) fn error_case(scene: &str, name: &str, error: &CliError, again: &str) -> JunitCase {
    JunitCase {
        scene: scene.to_owned(),
        name: name.to_owned(),
        seconds: 0.0,
        failures: Vec::new(),
        errors: vec![error.to_string(), format!("replay: {again}")],
    }
}

/// The pictures of a bad frame.
struct PictureFiles<'a> {
    folder: String,
    /// The truth, what was drawn, the view from above.
    files: [OutFile<'a>; 3],
}

impl<'a> PictureFiles<'a> {
    fn new(folder: &OutFolder, outputs: &mut Outputs<'a>) -> Result<Self, CliError> {
        let mut file = |name: &str| folder.file(outputs, name);
        let files = [file("truth.png")?, file("drawn.png")?, file("top.png")?];
        Ok(Self { folder: folder.path().display().to_string(), files })
    }
}

fn pictures(
    world: &World,
    moment: Moment,
    drawn: &[PartId],
    PictureFiles { folder, files }: PictureFiles<'_>,
    streams: &mut Streams<'_>,
) -> Result<(), CliError> {
    let state = FrameState::at(world, moment);
    let truth = Truth::of(world, &state);
    let mut image = world.image();
    render(world, &state, drawn, &mut image);
    let top = top_view(world, &state, &Shown { drawn, truth: &truth }, TOP_VIEW_SIDE);
    let pictures = [part_picture(world, &truth.image), part_picture(world, &image), top];
    for (file, picture) in files.into_iter().zip(pictures) {
        file.finish(&picture_png(&picture))?;
    }
    writeln!(streams.talk, "pictures of {moment}: {folder}/truth.png, drawn.png, top.png")?;
    Ok(())
}
