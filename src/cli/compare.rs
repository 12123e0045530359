//! `compare`: cullers on the same frames, beside Table 1 and Figures 6 to 9 of the paper.

use std::path::Path;

use super::args::{CompareArgs, SceneArgs};
use super::progress::progress_bar;
use super::run::{
    Finished, Named, Oracles, Plan, exit_of, loud, matching, pick_cache, pick_cost, pick_cullers,
    pick_index, tell_failures,
};
use super::signals::catch_interrupt;
use super::watchdog::Watchdog;
use super::{CliError, OutFile, Outputs, Streams};
use crate::check::Ruling;
use crate::cull::CullerKind;
use crate::oracle::CostModel;
use crate::part::Made;
use crate::report::{Comparison, picture_png, wrapped};
use crate::run::{FrameState, Moment, Trace, World, depth_complexity};

/// The scenes of the paper.
const SCENES: [&str; 2] = ["powerplant", "bunnies"];
/// Leaf sizes at full size. The paper's text has 23 parts a bunny, its table about 75; its plant is cut
/// so that frustum culling draws 1,678 parts a frame, which comes nearest with 6144.
const FULL_LEAVES: [(&str, &[u32]); 2] = [("powerplant", &[6144]), ("bunnies", &[3072, 1600])];
/// The cullers of the paper's table, the one that weighs its questions and the one that asks least.
const CULLERS: [&str; 5] = ["full", "full-adaptive", "full-trusting", "simple", "vfc"];

/// One scene with one leaf size.
struct Case {
    named: Named,
    args: SceneArgs,
    label: String,
}

fn cases(args: &CompareArgs) -> Result<Vec<Case>, CliError> {
    let names: Vec<&str> = if args.scene.is_empty() {
        SCENES.to_vec()
    } else {
        args.scene.iter().map(String::as_str).collect()
    };
    let names = matching(&names)?;
    let mut cases: Vec<Case> = Vec::new();
    for name in &names {
        let known = FULL_LEAVES.iter().find(|(scene, _)| scene == name);
        let leaves = match known {
            Some((_, leaves)) if args.scene_args.full_size && args.leaves.is_empty() => {
                leaves.iter().copied().map(Some).collect()
            }
            _ if args.leaves.is_empty() => vec![args.scene_args.leaf],
            _ => args.leaves.iter().copied().map(Some).collect(),
        };
        let alone = leaves.len() == 1;
        for leaf in leaves {
            let scene_args = SceneArgs { leaf, ..args.scene_args.clone() };
            let named = Named::open(name, &scene_args)?;
            let mut label = label(name, &named, &scene_args);
            if !alone {
                label += &format!("-{}", scene_args.leaf_triangles(named.scene()));
            }
            // Files of the same stem in two folders, or a scene named twice.
            let (once, mut number) = (label.clone(), 1);
            while cases.iter().any(|case| case.label == label) {
                number += 1;
                label = format!("{once}-{number}");
            }
            cases.push(Case { named, args: scene_args, label });
        }
    }
    Ok(cases)
}

/// What tells a scene from others in tables and file names: its name or the stem of its file, and the
/// stem of the model it is made of. Letters that a file name or a CSV line might trip over go.
fn label(name: &str, named: &Named, args: &SceneArgs) -> String {
    let stem = |path: &Path| path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let mut label = stem(Path::new(name));
    if let Some(mesh) = args.mesh.as_ref().filter(|_| named.takes_a_mesh()) {
        label += &format!("-{}", stem(mesh));
    }
    label.replace(|c: char| !(c.is_alphanumeric() || "._-".contains(c)), "_")
}

/// The figures of a case: SVG and PNG of each.
type Figures<'a> = Vec<[OutFile<'a>; 2]>;

pub(super) fn compare(
    args: &CompareArgs,
    cullers: &[CullerKind],
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let names: Vec<String> = if args.culler.is_empty() {
        CULLERS.map(str::to_owned).to_vec()
    } else {
        args.culler.clone()
    };
    let chosen = pick_cullers(&names, cullers)?;
    let index = pick_index(&args.scene_args.index)?;
    Oracles::known(&args.oracle)?;
    let cost = pick_cost(&args.scene_args)?;
    let cases = cases(args)?;
    let out = outputs.folder("--out", &args.out)?;
    let mut csv = Csv { file: out.file(outputs, "series.csv")?, begun: false };
    let mut files: Vec<Figures<'_>> = Vec::new();
    for case in &cases {
        let mut file = |stem, kind| out.file(outputs, &format!("{}-{stem}.{kind}", case.label));
        let figures = Comparison::CHARTS.map(|stem| Ok([file(stem, "svg")?, file(stem, "png")?]));
        files.push(figures.into_iter().collect::<Result<_, CliError>>()?);
    }
    let cache = pick_cache(&args.scene_args)?;
    let adapter = args.scene_args.adapter.as_deref();
    let oracles =
        Oracles::open(&args.oracle, adapter, streams)?.simulating(&cost, &args.scene_args);
    let (cullers, with_bound, args_of) = (chosen, true, &args.scene_args);
    let repeat = args.repeat;
    let mut plan = Plan { cullers, index, oracles, cost, cache, repeat, with_bound, args: args_of };
    catch_interrupt();
    let bar = progress_bar();
    let watchdog = Watchdog::start(&args.scene_args.frame_limit, |_| {});
    let (mut ruling, mut done) = (Ruling::Held, 0);
    let ended = cases.iter().zip(files).try_for_each(|(case, figures)| {
        plan.args = &case.args;
        let finished = plan.run_after(&case.named, &bar, streams, &mut |world, streams| {
            let line = about(case, world);
            // Before any culler is measured, so that nobody can have chosen it by the outcome.
            let to = if args.json { &mut streams.talk } else { &mut streams.out };
            let width = streams.width.filter(|_| !args.json);
            writeln!(to, "{}", wrapped(&line, width))
        })?;
        let to = (figures, &mut csv, args.json);
        ruling = ruling.max(finished.ruling());
        tell_case(case, &finished, &plan.cost, to, streams, &bar)?;
        done += 1;
        Ok::<(), CliError>(())
    });
    drop(watchdog);
    bar.finish_and_clear();
    if ended.is_ok() || done > 0 {
        csv.file.finish(&[])?;
    }
    ended?;
    let to = if args.json { &mut streams.talk } else { &mut streams.out };
    writeln!(to, "verdict: {}; figures and series in {}", loud(ruling), out.path().display())?;
    Ok(exit_of(ruling))
}

/// The series of all cases, one head above them.
struct Csv<'a> {
    file: OutFile<'a>,
    begun: bool,
}

impl Csv<'_> {
    fn add(&mut self, lines: &str) -> Result<(), CliError> {
        let head = usize::from(std::mem::replace(&mut self.begun, true));
        lines.lines().skip(head).try_for_each(|line| self.file.line(line))
    }
}

/// Says what a case is.
fn about(case: &Case, world: &World) -> String {
    let state = FrameState::at(world, Moment { frame: world.scene.frames / 2, view: 0 });
    let complexity = depth_complexity(world, &state);
    format!(
        "{}: {} objects, {} moving, {} triangles, {} after the cut, {} parts (at most {} triangles each), {} frames; depth complexity {complexity:.1} in the middle frame; {} in {:.1} s{}",
        case.label,
        world.partition.object_count(),
        world.moving_count(),
        world.scene.triangle_count(),
        world.partition.fragment_count(),
        world.partition.part_count(),
        case.args.leaf_triangles(&world.scene),
        world.scene.frames,
        how_made(&world.made),
        world.build_seconds,
        peak_memory()
    )
}

/// Tables, failures and figures of one case.
fn tell_case(
    case: &Case,
    finished: &Finished,
    model: &CostModel,
    (figures, csv, json): (Figures<'_>, &mut Csv<'_>, bool),
    streams: &mut Streams<'_>,
    bar: &indicatif::ProgressBar,
) -> Result<(), CliError> {
    for lane in finished.lanes() {
        bar.suspend(|| tell_failures(lane, streams))?;
    }
    let mut oracles: Vec<&str> = Vec::new();
    for trace in &finished.traces {
        if !oracles.contains(&trace.lane.oracle) {
            oracles.push(trace.lane.oracle);
        }
    }
    let mut figures = Some(figures);
    for oracle in &oracles {
        let of: Vec<Trace> =
            finished.traces.iter().filter(|t| t.lane.oracle == *oracle).cloned().collect();
        let scene = &finished.world.scene.name;
        let comparison = Comparison { scene, label: &case.label, traces: &of, model };
        let said = if json {
            comparison.json_lines().join("\n")
        } else {
            format!("\non {oracle}:\n{}", comparison.table(streams.width))
        };
        bar.suspend(|| writeln!(streams.out, "{said}"))?;
        // Series and figures of the device where there is one: the last oracle.
        if oracles.last() == Some(oracle) {
            csv.add(&comparison.csv())?;
            let figures = figures.take().into_iter().flatten();
            for ([svg, png], (_, chart)) in figures.zip(comparison.charts()) {
                svg.finish(chart.svg().as_bytes())?;
                png.finish(&picture_png(&chart.png()))?;
            }
        }
    }
    Ok(())
}

/// How the object trees were come by.
fn how_made(made: &Made) -> String {
    match (made.cut, made.loaded) {
        (_, 0) => "object trees built".to_owned(),
        (0, _) => "object trees loaded".to_owned(),
        (cut, loaded) => format!("object trees of {cut} meshes built and of {loaded} loaded"),
    }
}

/// The most memory the process has held so far, where the system tells.
fn peak_memory() -> String {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let kib = line.and_then(|line| line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok());
    kib.map_or(String::new(), |kib| format!(", {} MiB at most so far", kib / 1024))
}
