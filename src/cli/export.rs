//! `export`: a scene for cullers of other engines: meshes as glTF, and a line of JSON for each view of each
//! frame. The format stands at the top of `crate::foreign`.

use std::path::PathBuf;

use clap::Args;

use super::args::SceneArgs;
use super::progress::progress_bar;
use super::run::{Named, catch_interrupt, interrupted, pick_cache};
use super::{CliError, EXIT_HELD, OutFile, Streams};
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

pub(super) fn export(args: &ExportArgs, streams: &mut Streams<'_>) -> Result<u8, CliError> {
    let named = Named::open(&args.scene, &args.scene_args)?;
    let cache = pick_cache(&args.scene_args)?;
    let to_stream = args.out.as_os_str() == "-";
    let write = |path: &std::path::Path| {
        let path = path.display().to_string();
        move |source| CliError::Write { path, source }
    };
    let files = if to_stream {
        None
    } else {
        std::fs::create_dir_all(&args.out).map_err(write(&args.out))?;
        let file = |name: &str| OutFile::create(&args.out.join(name));
        Some((file("scene.gltf")?, file("scene.bin")?, file("frames.jsonl")?))
    };
    catch_interrupt();
    let bar = progress_bar();
    let world = named.world(&args.scene_args, cache.as_ref(), &bar, streams);
    bar.finish_and_clear();
    let world = world?;
    let mut lines = Vec::new();
    let mut put = |line: String, streams: &mut Streams<'_>| -> std::io::Result<()> {
        if to_stream {
            // Whoever reads is waiting for it.
            writeln!(streams.out, "{line}")?;
            return streams.out.flush();
        }
        lines.extend_from_slice(line.as_bytes());
        lines.push(b'\n');
        Ok(())
    };
    put(header_line(&world), streams)?;
    for moment in Moment::all(&world, world.scene.frames) {
        if interrupted() {
            return Err(RunError::Interrupted.into());
        }
        put(frame_line(&world, &FrameState::at(&world, moment)), streams)?;
    }
    if let Some((text, binary, frames)) = files {
        let gltf = gltf_file(&world, "scene.bin");
        binary.finish(&gltf.binary)?;
        text.finish(gltf.json.as_bytes())?;
        frames.finish(&lines)?;
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
