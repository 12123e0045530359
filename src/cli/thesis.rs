//! `compare --thesis`: the trees of Wortel 2011 on its two scenes, beside its table and figures; and `tune`,
//! which finds their knobs again.

use clap::Args;
use serde_json::json;

use super::args::{CompareArgs, SceneArgs};
use super::progress::{counting_triangles, progress_bar};
use super::run::{Named, matching};
use super::signals::{catch_interrupt, interrupted, stoppable};
use super::{CliError, EXIT_HELD, OutFile, Outputs, Streams};
use crate::part::PartitionKnobs;
use crate::report::{
    claims, found_table, found_view, picture_png, time_table, work_table, wrapped,
};
use crate::run::{RunError, World};
use crate::survey::{
    Contender, MOST_FOUND, SCENES, Survey, SurveyKnobs, Tuned, beyond, contenders, look, survey,
    tune,
};

/// Of the JSON lines.
const VERSION: u32 = 1;
/// Frames where none are asked for.
const FRAMES: u32 = 60;
/// What is found is drawn, and held against a look at every box, once in so many frames.
const RENDER_EVERY: u32 = 10;
const CHECK_EVERY: u32 = 10;
/// Pixels along a side of the views from above.
const VIEW_SIDE: u32 = 640;
/// Figures 5.3 to 5.5 of the thesis.
const VIEWS: [(&str, &str); 3] = [("1", "octree-1"), ("list", "actual"), ("4", "octree-4")];

/// The scenes of the thesis, or those of them that are named.
fn scenes(names: &[String]) -> Result<Vec<&'static Tuned>, CliError> {
    let known = SCENES.iter().map(|tuned| tuned.scene).collect::<Vec<_>>();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let names = if names.is_empty() {
        known.iter().map(|&n| n.to_owned()).collect()
    } else {
        matching(&names)?
    };
    let find = |name: &String| {
        SCENES.iter().find(|tuned| tuned.scene == name).ok_or_else(|| {
            CliError::Usage(format!("--scene {name}: the thesis has {}", known.join(" and ")))
        })
    };
    names.iter().map(find).collect()
}

fn open(tuned: &Tuned, args: &SceneArgs, bar: &indicatif::ProgressBar) -> Result<World, CliError> {
    let mut args = args.clone();
    args.frames = args.frames.or(Some(FRAMES));
    let scene = Named::open(tuned.scene, &args)?.scene().clone();
    // Nothing is asked of parts: objects stay whole.
    let make = |progress: &(dyn Fn(u64, u64) + Sync)| {
        World::make(scene, PartitionKnobs::uncut(), None, progress)
    };
    Ok(stoppable(|| counting_triangles(bar, tuned.scene.to_owned(), make))?)
}

fn title(world: &World) -> String {
    format!(
        "{}, seed {}: {} objects, {} moving, {} frames",
        world.scene.name,
        world.scene.seed,
        world.partition.object_count(),
        world.moving_count(),
        world.scene.frames
    )
}

pub(super) fn compare(
    args: &CompareArgs,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let scenes = scenes(&args.scene)?;
    let out = outputs.folder("--out", &args.out)?;
    let mut lines = out.file(outputs, "surveys.jsonl")?;
    let mut files: Vec<[OutFile<'_>; 3]> = Vec::new();
    for tuned in &scenes {
        let mut file = |(_, view)| out.file(outputs, &format!("{}-{view}.png", tuned.scene));
        files.push([file(VIEWS[0])?, file(VIEWS[1])?, file(VIEWS[2])?]);
    }
    catch_interrupt();
    let bar = progress_bar();
    let mut done = 0;
    let ended = scenes.iter().zip(files).try_for_each(|(tuned, files)| {
        survey_scene(args, tuned, (&mut lines, files), &bar, streams)?;
        done += 1;
        Ok::<(), CliError>(())
    });
    bar.finish_and_clear();
    if ended.is_ok() || done > 0 {
        lines.finish(&[])?;
        let to = if args.json { &mut streams.talk } else { &mut streams.out };
        let folder = out.path().display();
        writeln!(to, "views from above and figures as JSON lines are in {folder}")?;
    }
    ended.map(|()| EXIT_HELD)
}

/// The tables, lines and views of one scene.
fn survey_scene(
    args: &CompareArgs,
    tuned: &Tuned,
    (lines, files): (&mut OutFile<'_>, [OutFile<'_>; 3]),
    bar: &indicatif::ProgressBar,
    streams: &mut Streams<'_>,
) -> Result<(), CliError> {
    let world = open(tuned, &args.scene_args, bar)?;
    let knobs = SurveyKnobs {
        frames: world.scene.frames,
        render_every: RENDER_EVERY,
        check_every: CHECK_EVERY,
    };
    let mut all = contenders(tuned, args.thesis_knobs);
    if args.beyond {
        all.extend(beyond(tuned));
    }
    bar.set_length(u64::from(knobs.frames) * all.len() as u64);
    bar.set_position(0);
    bar.reset_eta();
    let mut surveys: Vec<Survey> = Vec::new();
    for contender in &all {
        bar.set_message(format!("{} {}", tuned.scene, contender.name));
        let mut tick = || {
            bar.inc(1);
            !interrupted()
        };
        let done = survey(&world, contender, &knobs, &mut tick);
        surveys.push(done.ok_or(RunError::Interrupted)?);
    }
    for survey in &surveys {
        let mut line = serde_json::to_value(survey).unwrap_or_default();
        line["plainsight"] = json!("survey");
        line["version"] = json!(VERSION);
        if args.json {
            bar.suspend(|| writeln!(streams.out, "{line}"))?;
        }
        lines.line(&line.to_string())?;
    }
    if !args.json {
        let width = streams.width;
        let text = [
            wrapped(&title(&world), width),
            time_table(&surveys, width),
            found_table(&surveys, width),
            work_table(&surveys, width),
            claims(&surveys, width),
        ];
        bar.suspend(|| writeln!(streams.out, "{}\n", text.join("\n")))?;
    }
    for ((name, _), file) in VIEWS.into_iter().zip(files) {
        if let Some(contender) = all.iter().find(|contender| contender.name == name) {
            let picture = found_view(&look(&world, contender, 0), world.scene.viewport, VIEW_SIDE);
            file.finish(&picture_png(&picture))?;
        }
    }
    Ok(())
}

#[derive(Args, Clone)]
pub(super) struct TuneArgs {
    /// Scenes of the thesis (default: city250k spheres200k).
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    scene: Vec<String>,
    /// Contenders by name, as `compare --thesis --beyond` lists them (default: those of the thesis).
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    contender: Vec<String>,
    /// How many of the best to list.
    #[arg(long, default_value_t = 3)]
    best: usize,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// One JSON object a trial on standard output in place of the table.
    #[arg(long)]
    json: bool,
}

/// Frames of a trial where none are asked for.
const TUNE_FRAMES: u32 = 8;

pub(super) fn tune_verb(args: &TuneArgs, streams: &mut Streams<'_>) -> Result<u8, CliError> {
    catch_interrupt();
    let bar = progress_bar();
    let scenes = scenes(&args.scene)?;
    let all_of = |tuned: &Tuned| [contenders(tuned, false), beyond(tuned)].concat();
    for name in &args.contender {
        let all: Vec<Contender> = scenes.iter().flat_map(|tuned| all_of(tuned)).collect();
        if all.iter().all(|contender| contender.name != name) {
            let mut names: Vec<&str> = all.iter().map(|contender| contender.name).collect();
            names.sort_unstable();
            names.dedup();
            let known = names.join(", ");
            return Err(CliError::Usage(format!("--contender {name}: there are {known}")));
        }
    }
    for tuned in scenes {
        let mut scene_args = args.scene_args.clone();
        scene_args.frames = scene_args.frames.or(Some(TUNE_FRAMES));
        let world = open(tuned, &scene_args, &bar)?;
        if !args.json {
            bar.suspend(|| writeln!(streams.out, "{}", wrapped(&title(&world), streams.width)))?;
        }
        let mut all = contenders(tuned, false);
        if !args.contender.is_empty() {
            all = all_of(tuned);
            all.retain(|contender| args.contender.iter().any(|wanted| wanted == contender.name));
        }
        for contender in all {
            bar.set_message(format!("{} {}", tuned.scene, contender.name));
            bar.set_position(0);
            let trials = tune(&world, &contender, world.scene.frames, &mut |count| {
                bar.set_length(count as u64);
                bar.inc(1);
                !interrupted()
            });
            if interrupted() {
                return Err(RunError::Interrupted.into());
            }
            bar.suspend(|| {
                for trial in trials.iter().take(args.best.max(1)) {
                    if args.json {
                        let mut line = serde_json::to_value(trial).unwrap_or_default();
                        line["plainsight"] = json!("tune");
                        line["version"] = json!(VERSION);
                        line["scene"] = json!(tuned.scene);
                        line["contender"] = json!(contender.name);
                        writeln!(streams.out, "{line}")?;
                    } else {
                        let over = if trial.ratio() > MOST_FOUND { ", above the rule" } else { "" };
                        writeln!(
                            streams.out,
                            "{:<13} {:<44} finds {:.3}, costs {:.3} ms{over}",
                            contender.name,
                            trial.knobs,
                            trial.ratio(),
                            trial.cost_ns / 1e6
                        )?;
                    }
                }
                Ok::<(), std::io::Error>(())
            })?;
        }
    }
    bar.finish_and_clear();
    Ok(EXIT_HELD)
}
