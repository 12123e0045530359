//! `accuracy`: what accuracy costs in time, knob by knob.

use std::cell::RefCell;
use std::path::PathBuf;

use clap::Args;
use indicatif::ProgressBar;
use serde_json::{Value, json};

use super::args::SceneArgs;
use super::files::Files;
use super::progress::{counting_triangles, progress_bar};
use super::run::{Named, exit_of, matching, pick_cache, pick_cost};
use super::signals::{catch_interrupt, interrupted, stoppable};
use super::watchdog::Watchdog;
use super::{CliError, EXIT_HELD, OutFile, Outputs, Streams};
use crate::accuracy::{
    EffectPoint, KNOBS, Point, RendererPoint, Setting, Worlds, effects, findings, measure,
    renderers, settings,
};
use crate::check::Ruling;
use crate::effect::EFFECTS;
use crate::oracle::CostModel;
use crate::part::Cache;
use crate::report::{
    accuracy_chart, accuracy_table, effect_table, picture_png, renderer_table, wrapped,
};
use crate::run::{Canary, RunError, World};
use crate::scene::{Scene, Viewport};

/// Of the JSON lines.
const VERSION: u32 = 1;
/// What is looked at where nothing is said.
const SCENES: [&str; 4] = ["bunnies", "city", "powerplant", "rooms"];
/// Those that have a size of their own to be full.
pub(super) const FULL_SIZE_SCENES: [&str; 2] = ["powerplant", "bunnies"];
/// The quick size: a scale, frames and a viewport of every scene.
const QUICK_SCALE: f64 = 0.1;
const QUICK_FRAMES: u32 = 16;
const QUICK_VIEWPORT: Viewport = Viewport { width: 320, height: 240 };
/// Pictures of a scene that `renderers` makes in a round, at most.
const RENDERINGS: u64 = 6 * 4;

#[derive(Args, Clone)]
pub(super) struct AccuracyArgs {
    /// Scenes by name (`hard/*`: all that begin so), or scene files (default: bunnies city powerplant
    /// rooms, small and at 320x240).
    #[arg(long, value_name = "NAME|FILE.toml", num_args = 1.., value_delimiter = ',')]
    scene: Vec<String>,
    /// Knobs to turn (default: all, and some pairs).
    #[arg(long, value_name = "KNOB", num_args = 1.., value_delimiter = ',')]
    knob: Vec<String>,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// How often everything is run; wall times are the medians, with the least and the most.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..))]
    rounds: u32,
    /// One JSON object a setting on standard output in place of the tables.
    #[arg(long)]
    json: bool,
    /// Folder for the charts (SVG and PNG), the points (JSON lines) and the findings (Markdown).
    #[arg(long, value_name = "FOLDER", default_value = "accuracy")]
    out: PathBuf,
    /// Says what each knob does, and runs nothing.
    #[arg(long)]
    list: bool,
}

impl AccuracyArgs {
    pub(super) fn files(&self) -> Files {
        Files::of_scenes(&self.scene, &self.scene_args)
    }

    /// The scenes, in the quick size unless the user wants another.
    fn scenes(&self) -> Result<Vec<Scene>, CliError> {
        let names: Vec<&str> = match self.scene.is_empty() {
            true if self.scene_args.full_size => FULL_SIZE_SCENES.to_vec(),
            true => SCENES.to_vec(),
            false => self.scene.iter().map(String::as_str).collect(),
        };
        let mut args = self.scene_args.clone();
        if self.scene.is_empty() && !args.full_size {
            args.scale = args.scale.or(Some(QUICK_SCALE));
            args.frames = args.frames.or(Some(QUICK_FRAMES));
            args.viewport = args.viewport.or(Some(QUICK_VIEWPORT));
        }
        let open = |name: &String| {
            let scene = Named::open(name, &args)?.scene().clone();
            Ok(Scene { leaf_triangles: args.leaf_triangles(&scene), ..scene })
        };
        matching(&names)?.iter().map(open).collect()
    }
}

fn line<T: serde::Serialize>(kind: &str, point: &T) -> String {
    let mut line = serde_json::to_value(point).unwrap_or(Value::Null);
    line["plainsight"] = json!(kind);
    line["version"] = json!(VERSION);
    line.to_string()
}

/// One scene's figures.
struct Figures {
    points: Vec<Point>,
    renderers: Vec<RendererPoint>,
    effects: Vec<EffectPoint>,
}

/// Names for files about scenes: each scene's own, with a number where two are called alike.
fn stems(scenes: &[Scene]) -> Vec<String> {
    let mut stems: Vec<String> = Vec::new();
    for scene in scenes {
        let stem = scene.name.replace(|c: char| !(c.is_alphanumeric() || "._-".contains(c)), "_");
        let numbered = (2..).map(|number| format!("{stem}-{number}"));
        let mut names = std::iter::once(stem.clone()).chain(numbered);
        stems.extend(names.find(|name| !stems.contains(name)));
    }
    stems
}

pub(super) fn accuracy(
    args: &AccuracyArgs,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    if args.list {
        for knob in KNOBS {
            let values: Vec<&str> = knob.values.iter().map(|value| value.0).collect();
            let text = format!("{:<13} {}: {}", knob.name, knob.summary, values.join(", "));
            writeln!(streams.out, "{}", wrapped(&text, streams.width))?;
        }
        return Ok(EXIT_HELD);
    }
    let settings = settings(&args.knob).map_err(CliError::Usage)?;
    let (cost, cache) = (pick_cost(&args.scene_args)?, pick_cache(&args.scene_args)?);
    let scenes = args.scenes()?;
    let out = outputs.folder("--out", &args.out)?;
    let mut lines = out.file(outputs, "points.jsonl")?;
    let findings = out.file(outputs, "findings.md")?;
    let mut file = |stem: &str, kind| out.file(outputs, &format!("{stem}.{kind}"));
    let charts =
        stems(&scenes).into_iter().map(|stem| Ok([file(&stem, "svg")?, file(&stem, "png")?]));
    let charts = charts.collect::<Result<Vec<[OutFile<'_>; 2]>, CliError>>()?;
    catch_interrupt();
    let bar = progress_bar();
    let rounds = u64::from(args.rounds);
    let shots = |scene: &Scene| u64::from(scene.frames) * scene.cameras.len() as u64;
    let of_scene = |scene: &Scene| {
        let declared = EFFECTS.iter().filter(|kind| (kind.declared)(scene)).count();
        // As it is, without each, and without all.
        let variants = 1 + declared + usize::from(declared > 1);
        (shots(scene) * (settings.len() + variants) as u64 + RENDERINGS) * rounds
    };
    bar.set_length(scenes.iter().map(of_scene).sum());
    let mut words = format!("# What accuracy costs in time\n\nCost model: {}.\n", cost.name);
    let (mut ruling, mut done) = (Ruling::Held, 0);
    let watchdog = Watchdog::start(&args.scene_args.frame_limit, |_| {});
    let ended = scenes.iter().zip(charts).try_for_each(|(scene, [svg, png])| {
        let (cost, settings, cache) = (&cost, &settings, cache.as_ref());
        let plan =
            Plan { cost, settings, cache, rounds: args.rounds, canary: args.scene_args.canary };
        let figures = stoppable(|| plan.measure(scene, &bar, streams))??;
        ruling = ruling.max(bar.suspend(|| tell(args, scene, &figures, &mut words, streams))?);
        let Figures { points, renderers, effects } = &figures;
        points.iter().try_for_each(|point| lines.line(&line("accuracy", point)))?;
        renderers.iter().try_for_each(|point| lines.line(&line("accuracy renderer", point)))?;
        effects.iter().try_for_each(|point| lines.line(&line("accuracy effects", point)))?;
        let chart = accuracy_chart(points);
        svg.finish(chart.svg().as_bytes())?;
        png.finish(&picture_png(&chart.png()))?;
        done += 1;
        Ok::<(), CliError>(())
    });
    drop(watchdog);
    bar.finish_and_clear();
    if ended.is_ok() || done > 0 {
        lines.finish(&[])?;
        findings.finish(words.as_bytes())?;
    }
    ended?;
    let to = if args.json { &mut streams.talk } else { &mut streams.out };
    let word = match ruling {
        Ruling::Failed => {
            "FAILED: a setting that takes nothing lost something, or some other broke"
        }
        other => other.word(),
    };
    let seconds = bar.elapsed().as_secs_f64();
    writeln!(
        to,
        "verdict: {word}; {} settings of {} scenes in {seconds:.1} s; charts, points and findings in {}",
        settings.len(),
        scenes.len(),
        out.path().display()
    )?;
    Ok(exit_of(ruling))
}

/// What stays the same from scene to scene.
struct Plan<'a> {
    cost: &'a CostModel,
    settings: &'a [Setting],
    cache: Option<&'a Cache>,
    rounds: u32,
    canary: Option<Canary>,
}

impl Plan<'_> {
    /// Runs every setting over a scene. It may be unwound by a signal, as [`stoppable`] says.
    fn measure(
        &self,
        scene: &Scene,
        bar: &ProgressBar,
        streams: &mut Streams<'_>,
    ) -> Result<Figures, CliError> {
        bar.set_message(scene.name.clone());
        let mut tick = || {
            bar.inc(1);
            !interrupted()
        };
        let warnings = RefCell::new(Vec::new());
        let make = |scene: Scene, knobs| {
            let name = scene.name.clone();
            let world = counting_triangles(bar, format!("{name}: object trees"), |progress| {
                World::make(scene, knobs, self.cache, progress)
            });
            warnings.borrow_mut().extend(world.made.warnings.iter().cloned());
            bar.set_message(name);
            world.with_canary(self.canary)
        };
        let worlds = Worlds::new(scene.clone(), &make);
        let points = measure(&worlds, self.cost, self.rounds, self.settings, &mut tick)?;
        let renderers = renderers(&worlds, self.rounds, &mut tick);
        if interrupted() {
            return Err(RunError::Interrupted.into());
        }
        let effects = effects(&worlds, self.cost, self.rounds, &mut tick)?;
        for line in warnings.take() {
            bar.suspend(|| writeln!(streams.talk, "WARNING: {line}"))?;
        }
        Ok(Figures { points, renderers, effects })
    }
}

/// The tables of a scene and its findings; what the worst of its settings came to.
fn tell(
    args: &AccuracyArgs,
    scene: &Scene,
    Figures { points, renderers, effects }: &Figures,
    words: &mut String,
    streams: &mut Streams<'_>,
) -> Result<Ruling, CliError> {
    let Viewport { width, height } = scene.viewport;
    let title = format!(
        "{}, seed {}: {} objects, {} triangles, {} frames of {width}x{height}",
        scene.name,
        scene.seed,
        scene.objects.len(),
        scene.triangle_count(),
        scene.frames
    );
    let findings = findings(points, renderers);
    *words += &format!("\n## {title}\n\n{}\n", findings.join("\n\n"));
    if args.json {
        for point in points {
            writeln!(streams.out, "{}", line("accuracy", point))?;
        }
        for point in renderers {
            writeln!(streams.out, "{}", line("accuracy renderer", point))?;
        }
        for point in effects {
            writeln!(streams.out, "{}", line("accuracy effects", point))?;
        }
    } else {
        let width = streams.width;
        writeln!(streams.out, "{}\n{}", wrapped(&title, width), accuracy_table(points, width))?;
        writeln!(streams.out, "{}", renderer_table(renderers, width))?;
        writeln!(streams.out, "{}", effect_table(effects, width))?;
        for finding in &findings[..2.min(findings.len())] {
            writeln!(streams.out, "{}\n", wrapped(finding, width))?;
        }
    }
    let mut ruling = Ruling::Held;
    for point in points.iter().filter(|point| !point.failures.is_empty()) {
        ruling = ruling.max(Ruling::of(&point.verdict).unwrap_or(Ruling::Failed));
        for failure in &point.failures {
            writeln!(streams.talk, "{} {} {}: {failure}", scene.name, point.knob, point.value)?;
        }
    }
    Ok(ruling)
}
