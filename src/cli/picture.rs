//! `picture`: one frame as PNG.

use std::path::{Path, PathBuf};

use super::args::{Layer, PictureArgs};
use super::progress::progress_bar;
use super::repeat::RepeatArgs;
use super::run::one_lane;
use super::signals::catch_interrupt;
use super::{CliError, EXIT_HELD, Outputs, Streams};
use crate::cull::CullerKind;
use crate::part::PartId;
use crate::report::{Shown, depth_picture, part_picture, picture_png, top_view};
use crate::run::{FrameState, Moment, Truth, World, render};

/// Pixels along a side of the view from above.
const TOP_VIEW_SIDE: u32 = 1024;

/// The name of a file about a scene: its own without folder and ending, a dash, `rest`.
pub(super) fn named_after(scene: &str, rest: &str) -> PathBuf {
    let stem = Path::new(scene).file_stem().unwrap_or_default().to_string_lossy();
    format!("{stem}-{rest}").into()
}

/// The moment of that frame and view, if the scene has such a view.
pub(super) fn moment_of(
    world: &World,
    scene: &str,
    (frame, view): (u32, u32),
) -> Result<Moment, CliError> {
    let views = world.views();
    if view >= views {
        let what = format!("--view {view}: {scene} has {views} views, counted from 0");
        return Err(CliError::Usage(what));
    }
    Ok(Moment { frame, view })
}

pub(super) fn picture(
    args: &PictureArgs,
    cullers: &[CullerKind],
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let layer = match args.layer {
        Layer::Parts => "parts",
        Layer::Depth => "depth",
        Layer::Culled => "culled",
        Layer::Top => "top",
    };
    let own_name = || named_after(&args.scene, &format!("{}-{layer}.png", args.frame));
    let path = args.out.clone().unwrap_or_else(own_name);
    let out = outputs.file("--out", &path)?;
    let mut scene_args = args.scene_args.clone();
    // A culler's history reaches back, so the frames before are run as well; the truth needs none.
    let needs_culler = matches!(args.layer, Layer::Culled | Layer::Top);
    if scene_args.frames.is_none_or(|frames| frames <= args.frame) {
        scene_args.frames = Some(args.frame.saturating_add(1).max(24));
    }
    let lane = (args.scene.as_str(), &args.culler, &args.oracle);
    let (plan, named) = one_lane(lane, (&scene_args, RepeatArgs::default()), cullers, streams)?;
    catch_interrupt();
    let bar = progress_bar();
    let world = named.world(&scene_args, plan.cache.as_ref(), &bar, streams);
    bar.finish_and_clear();
    let world = world?;
    let moment = moment_of(&world, &args.scene, (args.frame, args.view))?;
    let state = FrameState::at(&world, moment);
    let truth = Truth::of(&world, &state);
    let drawn: Vec<PartId> = if needs_culler {
        let bar = progress_bar();
        let drawn = plan.drawn_in(&world, moment, &bar);
        bar.finish_and_clear();
        drawn?
    } else {
        Vec::new()
    };
    let picture = match args.layer {
        Layer::Parts => part_picture(&world, &truth.image),
        Layer::Depth => depth_picture(&truth.image),
        Layer::Culled => {
            let mut image = world.image();
            render(&world, &state, &drawn, &mut image);
            part_picture(&world, &image)
        }
        Layer::Top => {
            top_view(&world, &state, &Shown { drawn: &drawn, truth: &truth }, TOP_VIEW_SIDE)
        }
    };
    out.finish(&picture_png(&picture))?;
    writeln!(streams.out, "{}", path.display())?;
    Ok(EXIT_HELD)
}
