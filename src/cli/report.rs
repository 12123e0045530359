//! `report`: what runs came to, as one HTML page.

use std::path::{Path, PathBuf};

use clap::Args;

use super::accuracy::FULL_SIZE_SCENES;
use super::args::SceneArgs;
use super::files::Files;
use super::merge::{Merged, merged};
use super::progress::progress_bar;
use super::repeat::RepeatArgs;
use super::run::{
    Finished, Named, Oracles, Plan, exit_of, matching, pick_cache, pick_cost, pick_cullers,
    pick_index,
};
use super::signals::catch_interrupt;
use super::watchdog::Watchdog;
use super::{CliError, Outputs, Streams};
use crate::cull::CullerKind;
use crate::report::{
    Chart, Page, PageAccuracy, PageLane, PagePictures, PageScene, PageSweep, Series, Shown,
    difference_picture, part_picture, picture_png, top_view,
};
use crate::run::{FrameRecord, FrameTrace, Moment, Trace, render};
use crate::scene::Viewport;
use crate::stress::Outcome;

/// What is run where nothing is said, small enough for a page.
const SCENES: [&str; 4] = ["bunnies", "city", "rooms", "soup"];
const SCALE: f64 = 0.1;
const FRAMES: u32 = 24;
const VIEWPORT: Viewport = Viewport { width: 320, height: 240 };
/// Frames with pictures, at most; of a longer run, evenly picked ones have them.
const MOST_PICTURES: usize = 48;
/// Pixels along a side of the view from above.
const TOP_VIEW_SIDE: u32 = 320;
/// Failing seeds that the page names.
const NAMED_FAILURES: usize = 20;

#[derive(Args, Clone)]
pub(super) struct ReportArgs {
    /// Scenes by name (`hard/*`: all that begin so), or scene files (default: bunnies city rooms soup, small
    /// and at 320x240).
    #[arg(long, value_name = "NAME|FILE.toml", num_args = 1.., value_delimiter = ',')]
    scene: Vec<String>,
    /// Cullers (default: full simple vfc).
    #[arg(long, num_args = 1.., value_delimiter = ',')]
    culler: Vec<String>,
    /// Oracles: sim, hierarchical-z, hardware, pyramid, read-back, always (default: sim, and hardware where a
    /// Vulkan device is found).
    #[arg(long, num_args = 1.., value_delimiter = ',')]
    oracle: Vec<String>,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// Lines of sweeps, that `stress --out` wrote.
    #[arg(long, value_name = "FILE", num_args = 1..)]
    stress: Vec<PathBuf>,
    /// The folder that `accuracy` left.
    #[arg(long, value_name = "FOLDER")]
    accuracy: Option<PathBuf>,
    /// Leave out pictures: a page of some kilobytes.
    #[arg(long)]
    no_pictures: bool,
    /// The page; `-` is standard output.
    #[arg(long, value_name = "FILE.html|-", default_value = "report.html")]
    out: PathBuf,
}

impl ReportArgs {
    pub(super) fn files(&self) -> Files {
        let charts = self.accuracy.as_deref().and_then(|folder| charts(folder).ok());
        let findings = self.accuracy.iter().map(|folder| folder.join(FINDINGS));
        let accuracy: Vec<PathBuf> = charts.into_iter().flatten().chain(findings).collect();
        Files::of_scenes(&self.scene, &self.scene_args)
            .reading("--stress", self.stress.iter().map(PathBuf::as_path))
            .reading("--accuracy", accuracy.iter().map(PathBuf::as_path))
            .writing("--out", Some(&self.out))
    }
}

pub(super) fn report(
    args: &ReportArgs,
    cullers: &[CullerKind],
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let out = outputs.file("--out", &args.out)?;
    let names: Vec<&str> = match args.scene.is_empty() {
        true if args.scene_args.full_size => FULL_SIZE_SCENES.to_vec(),
        true => SCENES.to_vec(),
        false => args.scene.iter().map(String::as_str).collect(),
    };
    let mut scene_args = args.scene_args.clone();
    if args.scene.is_empty() && !scene_args.full_size {
        scene_args.scale = scene_args.scale.or(Some(SCALE));
        scene_args.frames = scene_args.frames.or(Some(FRAMES));
        scene_args.viewport = scene_args.viewport.or(Some(VIEWPORT));
    }
    let chosen = pick_cullers(&args.culler, cullers)?;
    let index = pick_index(&scene_args.index)?;
    Oracles::known(&args.oracle)?;
    let cost = pick_cost(&scene_args)?;
    let open = |name: &String| Named::open(name, &scene_args);
    let scenes: Vec<Named> = matching(&names)?.iter().map(open).collect::<Result<_, CliError>>()?;
    let sweep = match args.stress.as_slice() {
        [] => None,
        files => {
            let merged = merged(files)?;
            for what in &merged.missing {
                writeln!(streams.talk, "WARNING: --stress: missing: {what}")?;
            }
            Some(sweep(&merged))
        }
    };
    let accuracy = args.accuracy.as_deref().map(accuracy).transpose()?;
    let cache = pick_cache(&scene_args)?;
    let adapter = scene_args.adapter.as_deref();
    let oracles = Oracles::open(&args.oracle, adapter, streams)?.simulating(&cost, &scene_args);
    let (cullers, repeat, with_bound) = (chosen, RepeatArgs::default(), false);
    let plan = Plan { cullers, index, oracles, cost, cache, repeat, with_bound, args: &scene_args };
    catch_interrupt();
    let bar = progress_bar();
    let mut page = Page {
        title: "plainsight: what was culled, and what it cost".to_owned(),
        made_by: made_by(args),
        scenes: Vec::new(),
        sweep,
        accuracy,
    };
    // A page of some lanes is none: where one hangs, what stood there before stays.
    let watchdog = Watchdog::start(&scene_args.frame_limit, |_| {});
    for named in &scenes {
        let shots = named.scene().frames as usize * named.scene().cameras.len();
        let every =
            if args.no_pictures { usize::MAX } else { shots.div_ceil(MOST_PICTURES).max(1) };
        let mut pictures: Vec<(usize, PagePictures)> = Vec::new();
        let mut seen = 0;
        let finished =
            plan.run_watched(named, &bar, streams, &mut |_, _| Ok(()), &mut |lane, record| {
                if lane == 0 {
                    if every < usize::MAX && seen % every == 0 {
                        pictures.push((seen, of_frame(record)));
                    }
                    seen += 1;
                }
            })?;
        page.scenes.push(scene(finished, pictures));
    }
    drop(watchdog);
    bar.finish_and_clear();
    let html = page.html();
    out.finish(html.as_bytes())?;
    let (held, lanes) = page.held();
    let word = page.ruling();
    writeln!(
        streams.out,
        "verdict: {word} ({held} of {lanes} lanes held); {:.1} MiB in {}",
        html.len() as f64 / (1 << 20) as f64,
        args.out.display()
    )?;
    Ok(exit_of(page.ruling()))
}

/// The command, as far as it says what was run.
fn made_by(args: &ReportArgs) -> String {
    let mut line = "plainsight report".to_owned();
    for (name, values) in
        [("scene", &args.scene), ("culler", &args.culler), ("oracle", &args.oracle)]
    {
        if !values.is_empty() {
            line += &format!(" --{name} {}", super::args::quoted(&values.join(",")));
        }
    }
    if let Some(seed) = args.scene_args.seed {
        line += &format!(" --seed {seed}");
    }
    line
}

fn of_frame(record: &FrameRecord<'_>) -> PagePictures {
    let (world, state, truth) = (record.world, record.state, record.truth);
    let mut image = world.image();
    render(world, state, record.drawn, &mut image);
    let shown = Shown { drawn: record.drawn, truth };
    let layers = [
        part_picture(world, &truth.image),
        part_picture(world, &image),
        difference_picture(world, &truth.image, &image),
        top_view(world, state, &shown, TOP_VIEW_SIDE),
    ];
    PagePictures { layers: layers.map(|layer| picture_png(&layer)) }
}

fn figures(frame: &FrameTrace) -> [f64; 6] {
    let (drawn, visible) = (f64::from(frame.drawn_parts), f64::from(frame.visible_parts));
    [
        drawn,
        visible,
        (drawn - visible).max(0.0),
        frame.counts.queries as f64,
        frame.counts.round_trips as f64,
        frame.wall_ns as f64 / 1e6,
    ]
}

fn scene(finished: Finished, pictures: Vec<(usize, PagePictures)>) -> PageScene {
    let Finished { world, traces, gates, .. } = finished;
    // A lane that ended early has fewer.
    let shots = Moment::all(&world, world.scene.frames).map(|m| [m.frame, m.view]);
    let shots: Vec<[u32; 2]> = shots.collect();
    // A shot without pictures shows those of the one before.
    let shown = |shot: usize| pictures.iter().rfind(|(place, _)| *place <= shot);
    let pictures: Vec<PagePictures> =
        (0..shots.len()).filter_map(|shot| shown(shot).map(|(_, these)| these.clone())).collect();
    let lanes = traces.iter().zip(&gates).map(|(trace, gate)| PageLane {
        culler: trace.lane.culler.clone(),
        oracle: trace.lane.oracle.to_owned(),
        ruling: gate.ruling(),
        failures: gate.failures(),
        replay: trace.lane.replay.clone(),
        frames: trace.frames.iter().map(figures).collect(),
    });
    let Viewport { width, height } = world.scene.viewport;
    let device = traces.iter().find_map(|trace| trace.lane.device.as_ref());
    let device = device.map_or(String::new(), |device| format!("; device: {device}"));
    PageScene {
        name: world.scene.name.clone(),
        line: format!(
            "seed {}, {} objects ({} moving), {} triangles, {} parts, {} frames of {width}x{height}{device}",
            world.scene.seed,
            world.partition.object_count(),
            world.moving_count(),
            world.scene.triangle_count(),
            world.partition.part_count(),
            world.scene.frames
        ),
        views: world.views(),
        charts: lane_charts(&world.scene.name, &traces),
        lanes: lanes.collect(),
        shots,
        pictures,
    }
}

/// Parts and questions by frame, of the lanes of the first oracle.
fn lane_charts(scene: &str, traces: &[Trace]) -> Vec<(String, String)> {
    let oracle = traces[0].lane.oracle;
    let of = || traces.iter().filter(|trace| trace.lane.oracle == oracle);
    let series = |figure: usize| -> Vec<Series> {
        of().map(|trace| Series {
            name: trace.lane.culler.clone(),
            values: trace.frames.iter().map(|frame| figures(frame)[figure]).collect(),
        })
        .collect()
    };
    let mut parts = series(0);
    let values = traces[0].frames.iter().map(|frame| f64::from(frame.visible_parts)).collect();
    parts.push(Series { name: "visible".to_owned(), values });
    let chart = |what: &str, unit: &str, series: Vec<Series>| {
        let title = format!("{scene}: {what}, on {oracle}");
        let chart = Chart { title, unit: unit.to_owned(), series, logarithmic: false };
        (format!("{what} by frame"), chart.svg())
    };
    vec![
        chart("parts drawn", "parts a frame", parts),
        chart("questions", "questions a frame", series(3)),
    ]
}

fn sweep(Merged { tally, missing }: &Merged) -> PageSweep {
    let named = |why: String, o: &Outcome| {
        [why, o.seed.to_string(), format!("{}; {}", o.scene, o.options), o.replay.clone()]
    };
    let a_frame = |sum: u64, o: &Outcome| sum as f64 / f64::from(o.shots.max(1));
    let mut worst: Vec<[String; 4]> = tally
        .failures
        .iter()
        .take(NAMED_FAILURES)
        .map(|o| named(format!("{}: {}", o.ruling(), o.failures.join("; ")), o))
        .collect();
    worst.extend(tally.worst_excess.iter().map(|o| {
        let vain = a_frame(o.drawn.saturating_sub(o.visible), o);
        named(format!("most parts in vain: {vain:.1} a frame"), o)
    }));
    worst.extend(
        tally
            .most_queries
            .iter()
            .map(|o| named(format!("most questions: {:.1} a frame", a_frame(o.queries, o)), o)),
    );
    PageSweep {
        line: format!(
            "{} worlds, {} frames, {} worlds run twice, {} failed{}",
            tally.worlds,
            tally.shots,
            tally.repeated,
            tally.failed,
            missing.iter().map(|what| format!("; missing: {what}")).collect::<String>()
        ),
        ruling: tally.ruling,
        situations: tally
            .probes()
            .into_iter()
            .map(|(probe, count)| (probe.to_string(), count))
            .collect(),
        worst,
    }
}

/// The words that `accuracy` leaves.
const FINDINGS: &str = "findings.md";

/// The charts in a folder, by name.
fn charts(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(folder)?.map(|entry| Ok(entry?.path()));
    let mut files = entries.collect::<std::io::Result<Vec<PathBuf>>>()?;
    files.retain(|path| path.extension().is_some_and(|extension| extension == "svg"));
    files.sort();
    Ok(files)
}

/// The charts and findings of a folder.
fn accuracy(folder: &Path) -> Result<PageAccuracy, CliError> {
    let refuse = |path: &Path, error: std::io::Error| {
        CliError::Usage(format!(
            "{}: {error}; give a folder that `plainsight accuracy --out` left",
            path.display()
        ))
    };
    let words = folder.join(FINDINGS);
    let findings = std::fs::read_to_string(&words).map_err(|error| refuse(&words, error))?;
    let files = charts(folder).map_err(|error| refuse(folder, error))?;
    if files.is_empty() {
        return Err(refuse(folder, std::io::Error::other("there is no chart in it")));
    }
    let chart = |path: &PathBuf| {
        let svg = std::fs::read_to_string(path).map_err(|error| refuse(path, error))?;
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        Ok((name, svg))
    };
    let charts = files.iter().map(chart).collect::<Result<_, CliError>>()?;
    Ok(PageAccuracy { charts, findings })
}
