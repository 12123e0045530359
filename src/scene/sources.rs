//! Which files a scene or a model is read from, so that nothing is written over them.

use std::path::{Path, PathBuf};

use serde::Deserialize;

/// Of a scene file what names other files.
#[derive(Deserialize)]
struct SceneFile {
    mesh: Option<PathBuf>,
}

/// Of a glTF file what names other files.
#[derive(Deserialize)]
struct Gltf {
    #[serde(default)]
    buffers: Vec<Buffer>,
}

#[derive(Deserialize)]
struct Buffer {
    uri: Option<String>,
}

/// The files behind the name of a scene or a model: a scene file with the model that it names, a glTF file
/// with its buffers, any other file alone. None for the name of a generator. A file that cannot be read
/// stands alone: whoever reads it says what is wrong.
#[must_use]
pub fn sources(name_or_file: &str) -> Vec<PathBuf> {
    let path = PathBuf::from(name_or_file);
    if !path.is_file() {
        return Vec::new();
    }
    let beside = |name: &Path| path.parent().unwrap_or(Path::new("")).join(name);
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let more = match ending.as_str() {
        "toml" => {
            let text = std::fs::read_to_string(&path).unwrap_or_default();
            let model = toml::from_str::<SceneFile>(&text).ok().and_then(|file| file.mesh);
            model.map_or(Vec::new(), |model| sources(&beside(&model).to_string_lossy()))
        }
        "gltf" => {
            let bytes = std::fs::read(&path).unwrap_or_default();
            let buffers =
                serde_json::from_slice::<Gltf>(&bytes).map_or(Vec::new(), |gltf| gltf.buffers);
            let names = buffers.into_iter().filter_map(|buffer| buffer.uri);
            let files = names.filter(|uri| !uri.starts_with("data:"));
            files.map(|uri| beside(Path::new(&uri))).collect()
        }
        _ => Vec::new(),
    };
    std::iter::once(path).chain(more).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_that_files_name_are_sources() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path
        };
        let buffer = r#"{"buffers": [{"uri": "b.bin"}, {"uri": "data:x;base64,AA=="}, {}]}"#;
        let (scene, model) =
            (file("a.toml", "version = 1\nmesh = \"b.gltf\"\n"), file("b.gltf", buffer));
        let found = sources(scene.to_str().unwrap());
        assert_eq!(found, [scene, model, folder.path().join("b.bin")]);
        assert!(sources("city").is_empty());
        let broken = file("broken.toml", "mesh = ");
        assert_eq!(sources(broken.to_str().unwrap()), [broken]);
    }
}
