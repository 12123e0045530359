//! `judge`: what a culler of another engine drew, before the same gate. It comes from a file, from standard
//! input, or from a process that is told each frame and asked what it draws. The format stands at the top
//! of `crate::foreign`.

use std::io::BufReader;
use std::path::PathBuf;

use clap::Args;
use plainsight_reference::Tolerance;

use super::args::{SceneArgs, quoted};
use super::files::Files;
use super::out_file::OutFolder;
use super::pipe::Process;
use super::progress::progress_bar;
use super::run::{Named, error_case, exit_of, failure_lines, junit_case, pick_cache};
use super::signals::{catch_interrupt, interrupted};
use super::tell::heading;
use super::waiting::Waiting;
use super::{CliError, OutFile, Outputs, Streams};
use crate::check::Gate;
use crate::foreign::{Drawn, ForeignError, frame_line, header_line};
use crate::part::PartId;
use crate::report::{JunitCase, Row, Shown, junit, part_picture, picture_png, table, top_view};
use crate::run::{
    Cause, FrameRecord, FrameState, LaneInfo, Moment, Observer, RunError, Said, Stop, Trace, Truth,
    World, caught, partition_difference, render, told,
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

    fn stopped(&mut self, stop: &Stop) {
        self.gate.stopped(stop);
    }
}

pub(super) fn judge(
    args: &JudgeArgs,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let junit_file = args.junit.as_deref().map(|path| outputs.file("--junit", path)).transpose()?;
    let mut cases = Vec::new();
    // A panic leaves the file as well.
    let code = caught(|| judge_lane(args, &mut cases, outputs, streams)).unwrap_or_else(|said| {
        Err(CliError::Panicked { place: format!("replay: {}", outputs.again()), said })
    });
    let Some(file) = junit_file else { return code };
    if matches!(&code, Err(error) if error.is_bad_input()) {
        return code;
    }
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
    // Answers may come late or never: a signal is not kept waiting.
    let mut drawn = match (file, &args.pipe) {
        (Some(file), _) => Drawn::new(BufReader::new(Waiting::new(file)), name),
        (None, Some(command)) => {
            let limit = args.scene_args.frame_limit.time();
            let (started, answers) = Process::start(command, limit)?;
            process = Some(started);
            Drawn::new(BufReader::new(answers), name)
        }
        (None, None) => Drawn::new(BufReader::new(Waiting::new(std::io::stdin())), name),
    };
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
    Ok(exit_of(gate.ruling()))
}

/// Tells and reads every frame, and has the gate look at it.
fn gate(
    args: &JudgeArgs,
    world: &World,
    drawn: &mut Drawn<'_>,
    mut process: Option<&mut Process>,
    bar: &indicatif::ProgressBar,
) -> Result<(Trace, Gate, Worst), CliError> {
    let hang = || Cause::Hang(args.scene_args.frame_limit.frame_limit);
    if let Some(process) = &process {
        process.tell(header_line(world));
    }
    let culler = match drawn.header() {
        Ok(culler) => culler,
        // It is named by its command, and ends in frame 0.
        Err(_) if process.as_ref().is_some_and(|process| process.is_late()) => {
            args.pipe.clone().unwrap_or_default()
        }
        Err(error) => return Err(explained(error, process)),
    };
    let info = LaneInfo {
        culler,
        oracle: "told",
        device: None,
        tolerance: Tolerance::EXACT,
        replay: replay(args, world),
    };
    let parts = world.partition.part_count();
    let mut watch = Watch { gate: Gate::forgiving(args.scene_args.late), worst: None };
    let mut says = |state: &FrameState| -> Said<CliError> {
        if interrupted() {
            return Err(RunError::Interrupted.into());
        }
        if let Some(process) = &process {
            if process.is_late() {
                return Ok(Err(hang()));
            }
            process.tell(frame_line(world, state));
            process.waits();
        }
        let said = match drawn.at(state.moment, parts) {
            Ok(said) => said,
            Err(_) if process.as_ref().is_some_and(|process| process.is_late()) => {
                return Ok(Err(hang()));
            }
            Err(error) => return Err(explained(error, process.as_deref_mut())),
        };
        bar.inc(1);
        Ok(Ok(said))
    };
    let mut trace = told(world, world.scene.frames, &info, &mut says, &mut watch)?;
    if trace.stop.is_some() {
        return Ok((trace, watch.gate, watch.worst));
    }
    if let Some(process) = &mut process {
        // It has its last word.
        process.end();
    }
    let ended = drawn.end();
    if ended.is_err() && process.as_ref().is_some_and(|process| process.is_late()) {
        let moment = trace.frames.last().map(|frame| frame.moment);
        let stop = Stop { moment, again: false, cause: hang() };
        watch.stopped(&stop);
        trace.stop = Some(stop);
    } else {
        ended?;
    }
    Ok((trace, watch.gate, watch.worst))
}

/// The error, or that the process ended before its time, if it did.
fn explained(error: ForeignError, process: Option<&mut Process>) -> CliError {
    match process {
        Some(process) => process.explained(error),
        None => error.into(),
    }
}

fn replay(args: &JudgeArgs, world: &World) -> String {
    let from = match (&args.drawn, &args.pipe) {
        (Some(path), _) => format!("--drawn {}", quoted(&path.display().to_string())),
        (None, pipe) => format!("--pipe {}", quoted(pipe.as_deref().unwrap_or_default())),
    };
    format!(
        "plainsight judge --scene {} {from}{}",
        quoted(&args.scene),
        args.scene_args.replay_flags(&world.scene)
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
        writeln!(streams.talk, "{}", heading(gate, &trace.lane.culler, trace.lane.oracle))?;
        failures.iter().try_for_each(|line| writeln!(streams.talk, "  {line}"))?;
    }
    Ok(junit_case(&row, gate.ruling(), failures))
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
