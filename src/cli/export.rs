//! `export`: a scene for cullers of other engines: meshes as glTF, and a line of JSON for each view of each
//! frame. The format stands at the top of `crate::foreign`.

use std::path::PathBuf;

use clap::Args;

use super::args::SceneArgs;
use super::files::Files;
use super::progress::progress_bar;
use super::run::{Named, pick_cache};
use super::signals::{catch_interrupt, interrupted};
use super::target::is_stream;
use super::{CliError, EXIT_HELD, Outputs, Streams};
use crate::foreign::{frame_line, gltf_file, header_line};
use crate::run::{FrameState, Moment, RunError};

#[derive(Args, Clone)]
pub(super) struct ExportArgs {
    /// The scene, by name or file.
    #[arg(long, value_name = "NAME|FILE.toml")]
    scene: String,
    #[command(flatten)]
    scene_args: SceneArgs,
    /// Folder for scene.gltf, scene.bin and frames.jsonl; `-` streams the frames to standard output, one
    /// line at a time, and writes no meshes.
    #[arg(long, value_name = "FOLDER|-", default_value = "export")]
    out: PathBuf,
}

impl ExportArgs {
    pub(super) fn files(&self) -> Files {
        let stream = Some(self.out.as_path()).filter(|path| is_stream(path));
        Files::of_scenes(std::slice::from_ref(&self.scene), &self.scene_args)
            .writing("--out", stream)
    }
}

pub(super) fn export(
    args: &ExportArgs,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let named = Named::open(&args.scene, &args.scene_args)?;
    let cache = pick_cache(&args.scene_args)?;
    let (folder, mut frames, meshes) = if is_stream(&args.out) {
        (None, outputs.file("--out", &args.out)?, None)
    } else {
        let folder = outputs.folder("--out", &args.out)?;
        let mut file = |name: &str| folder.file(outputs, name);
        let (frames, meshes) = (file("frames.jsonl")?, (file("scene.gltf")?, file("scene.bin")?));
        (Some(folder), frames, Some(meshes))
    };
    catch_interrupt();
    let bar = progress_bar();
    let world = named.world(&args.scene_args, cache.as_ref(), &bar, streams);
    bar.finish_and_clear();
    let world = world?;
    frames.line(&header_line(&world))?;
    for moment in Moment::all(&world, world.scene.frames) {
        if interrupted() {
            return Err(RunError::Interrupted.into());
        }
        // Whoever reads a stream is waiting for it.
        frames.line(&frame_line(&world, &FrameState::at(&world, moment)))?;
    }
    if let Some((text, binary)) = meshes {
        let gltf = gltf_file(&world, "scene.bin");
        binary.finish(&gltf.binary)?;
        text.finish(gltf.json.as_bytes())?;
    }
    frames.finish(&[])?;
    if folder.is_some() {
        writeln!(
            streams.out,
            "{}: scene.gltf and scene.bin ({} parts of {} objects), frames.jsonl ({} frames, {} views each)",
            args.out.display(),
            world.partition.part_count(),
            world.partition.object_count(),
            world.scene.frames,
            world.views()
        )?;
    }
    Ok(EXIT_HELD)
}
