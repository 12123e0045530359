//! `why`: what decided over one part in one frame, in words and as a picture.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::args::SceneArgs;
use super::files::Files;
use super::picture::{moment_of, named_after};
use super::progress::progress_bar;
use super::repeat::RepeatArgs;
use super::run::one_lane;
use super::signals::{catch_interrupt, interrupted};
use super::{CliError, EXIT_HELD, Outputs, Streams};
use crate::cull::CullerKind;
use crate::part::PartId;
use crate::report::{
    account_picture, decision_line, item_name, picture_png, step_line, truth_line,
};
use crate::run::{FrameState, Moment, Truth, World, account};

/// Version of the JSON line.
const JSON_SCHEMA: u32 = 1;

#[derive(Args, Clone)]
pub(super) struct WhyArgs {
    /// The scene, by name or file.
    #[arg(long, value_name = "NAME|FILE.toml")]
    scene: String,
    /// Which frame, from 0; the frames before it are run too.
    #[arg(long)]
    frame: u32,
    /// Which of the frame's views, from 0.
    #[arg(long, default_value_t = 0)]
    view: u32,
    /// The part, by its id, as failures name it.
    #[arg(long, value_name = "ID", required_unless_present = "pixel")]
    part: Option<u32>,
    /// The part that this pixel shows, in place of an id; row 0 is on top.
    #[arg(long, value_name = "X,Y", value_parser = pixel, conflicts_with = "part")]
    pixel: Option<[u32; 2]>,
    /// The culler.
    #[arg(long, default_value = "full")]
    culler: String,
    /// The oracle.
    #[arg(long, default_value = "sim")]
    oracle: String,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// One JSON object in place of the text.
    #[arg(long)]
    json: bool,
    /// The PNG file (default: SCENE-FRAME-part-ID.png); `-` is standard output, and the text goes to
    /// standard error.
    #[arg(long, value_name = "FILE.png|-")]
    out: Option<PathBuf>,
}

impl WhyArgs {
    pub(super) fn files(&self) -> Files {
        Files::of_scenes(std::slice::from_ref(&self.scene), &self.scene_args)
            .writing("--out", self.out.as_deref())
            .json(self.json)
    }
}

fn pixel(text: &str) -> Result<[u32; 2], String> {
    let parse = |word: &str| word.trim().parse::<u32>().ok();
    text.split_once(',')
        .and_then(|(x, y)| Some([parse(x)?, parse(y)?]))
        .ok_or_else(|| "write it as X,Y, for example 120,88".to_owned())
}

pub(super) fn why(
    args: &WhyArgs,
    cullers: &[CullerKind],
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let named_file = args.out.as_deref().map(|path| outputs.file("--out", path)).transpose()?;
    let scene_args = args.scene_args.clone();
    let lane = (args.scene.as_str(), &args.culler, &args.oracle);
    let (plan, named) = one_lane(lane, (&scene_args, RepeatArgs::default()), cullers, streams)?;
    catch_interrupt();
    let bar = progress_bar();
    let world = named.world(&scene_args, plan.cache.as_ref(), &bar, streams);
    bar.finish_and_clear();
    let world = world?;
    let moment = moment_of(&world, &args.scene, (args.frame, args.view))?;
    let part = part_of(args, &world, moment)?;
    let own_name = || named_after(&args.scene, &format!("{}-part-{}.png", args.frame, part.0));
    let path = args.out.clone().unwrap_or_else(own_name);
    let out = named_file.map_or_else(|| outputs.file("--out", &path), Ok)?;
    let bar = progress_bar();
    bar.inc_length((u64::from(moment.frame) + 1) * u64::from(world.views()));
    let mut tick = || {
        bar.inc(1);
        !interrupted()
    };
    let told = plan.with_lane(&world, |culler, oracle| {
        account(&world, (moment, part), culler, oracle, &mut tick)
    });
    bar.finish_and_clear();
    let told = told?;
    out.finish(&picture_png(&account_picture(&world, &told)))?;
    let (object, local) = world.partition.locate(part);
    let steps: Vec<String> = told.steps.iter().map(|step| step_line(step, moment.frame)).collect();
    if args.json {
        let line = json!({
            "schema": JSON_SCHEMA,
            "scene": world.scene.name,
            "seed": world.scene.seed,
            "frame": moment.frame,
            "view": moment.view,
            "part": part.0,
            "object": object.0,
            "culler": args.culler,
            "oracle": args.oracle,
            "drawn": told.drawn,
            "decision": decision_line(&told),
            "decided_at": told.decisive().map(|step| item_name(step.item)),
            "truth": truth_line(&told.truth),
            "steps": steps,
            "picture": path.display().to_string(),
        });
        writeln!(streams.out, "{line}")?;
        return Ok(EXIT_HELD);
    }
    let mesh = world.partition.mesh(object);
    writeln!(
        streams.out,
        "{}, {moment}, part {}: part {local} of {} of object {}, {} triangles; {} on {}",
        world.scene.name,
        part.0,
        mesh.parts.len(),
        object.0,
        world.partition.part(part).triangle_count,
        args.culler,
        args.oracle
    )?;
    writeln!(streams.out, "truth: {}", truth_line(&told.truth))?;
    writeln!(streams.out, "{}", decision_line(&told))?;
    steps.iter().try_for_each(|line| writeln!(streams.out, "  {line}"))?;
    writeln!(
        streams.out,
        "{}: yellow shows, magenta is behind something, white was asked about, the cross is where it comes nearest",
        path.display()
    )?;
    Ok(EXIT_HELD)
}

/// The part that was meant.
fn part_of(args: &WhyArgs, world: &World, moment: Moment) -> Result<PartId, CliError> {
    let usage = |what: String| CliError::Usage(what);
    let Some([x, y]) = args.pixel else {
        let (part, count) = (args.part.unwrap_or(0), world.partition.part_count());
        return if part < count {
            Ok(PartId(part))
        } else {
            Err(usage(format!("--part {part}: {} has {count} parts, counted from 0", args.scene)))
        };
    };
    let viewport = world.scene.viewport;
    if x >= viewport.width || y >= viewport.height {
        let (width, height) = (viewport.width, viewport.height);
        return Err(usage(format!("--pixel {x},{y}: the picture is {width} x {height} pixels")));
    }
    let state = FrameState::at(world, moment);
    let truth = Truth::of(world, &state);
    truth
        .part_at(world, (y * viewport.width + x) as usize)
        .ok_or_else(|| usage(format!("--pixel {x},{y}: nothing shows there in {moment}")))
}
