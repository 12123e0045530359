//! Files that arguments name: what a verb reads, which no output may replace, and which of its outputs are
//! standard output.

use std::path::{Path, PathBuf};

use super::args::{SceneArgs, quoted};
use super::target::is_stream;
use crate::scene::{is_scene_file, sources};

/// The files of one command line.
#[derive(Default)]
pub(super) struct Files {
    /// Files that are read, with the flag that names them.
    pub(super) inputs: Vec<(String, PathBuf)>,
    /// Files that are written, with their flags.
    outputs: Vec<(&'static str, PathBuf)>,
    /// Whether JSON lines go to standard output.
    pub(super) json: bool,
}

impl Files {
    /// What scenes of these names, or of these files, are read from.
    pub(super) fn of_scenes(names: &[String], args: &SceneArgs) -> Self {
        let mut files = Self::default();
        for name in names.iter().filter(|name| is_scene_file(name)) {
            files
                .inputs
                .extend(sources(name).into_iter().map(|path| (label("--scene", name), path)));
        }
        if let Some(mesh) = &args.mesh {
            let name = mesh.display().to_string();
            files
                .inputs
                .extend(sources(&name).into_iter().map(|path| (label("--mesh", &name), path)));
        }
        // The name of a model is no file's, unless there is one.
        files.reading("--cost", [Path::new(&args.cost)])
    }

    /// Reads these files as well.
    pub(super) fn reading<'p>(
        mut self,
        flag: &'static str,
        paths: impl IntoIterator<Item = &'p Path>,
    ) -> Self {
        let named = |path: &Path| (label(flag, &path.display().to_string()), path.to_owned());
        self.inputs.extend(paths.into_iter().map(named));
        self
    }

    /// Writes this file as well, if one is named.
    pub(super) fn writing(mut self, flag: &'static str, path: Option<&Path>) -> Self {
        self.outputs.extend(path.map(|path| (flag, path.to_owned())));
        self
    }

    /// Whether JSON lines go to standard output.
    pub(super) fn json(self, json: bool) -> Self {
        Self { json, ..self }
    }

    /// The outputs that are standard output, as they were written.
    pub(super) fn streams(&self) -> impl Iterator<Item = String> {
        let streams = self.outputs.iter().filter(|(_, path)| is_stream(path));
        streams.map(|(flag, path)| label(flag, &path.display().to_string()))
    }
}

fn label(flag: &str, value: &str) -> String {
    format!("{flag} {}", quoted(value))
}
