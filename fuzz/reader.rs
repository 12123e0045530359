//! One case: bytes for a reader. It may refuse them, in one line; it must not panic. What it takes is
//! built into parts and projected, so that a mesh no reader should let through is found as well.
#![allow(dead_code)] // each fuzz target reads one kind of file

use std::path::Path;

use plainsight::foreign::{Drawn, ForeignError};
use plainsight::part::PartitionKnobs;
use plainsight::run::{FrameState, Moment, World};
use plainsight::scene::generate::Knobs;
use plainsight::scene::import::{Format, parse};
use plainsight::scene::{Mesh, Scene, SceneError, file};

/// Larger scenes than this are not built: cutting them would be what is measured.
const MOST_TRIANGLES: u64 = 20_000;

fn one_line(error: &str) {
    assert!(!error.is_empty() && !error.contains('\n'), "{error:?} is not one line");
}

/// Reads `bytes` in that format.
pub(super) fn model(format: Format, bytes: &[u8]) {
    match parse(format, bytes, None) {
        Ok(meshes) => {
            assert!(!meshes.is_empty());
            for mesh in &meshes {
                let count = mesh.positions().len() as u32;
                assert!(mesh.positions().iter().flatten().all(|c| c.is_finite()));
                assert!(mesh.triangles().iter().flatten().all(|&i| i < count));
            }
            let _: Vec<Mesh> = meshes;
        }
        Err(error) => one_line(&error),
    }
}

/// Reads `bytes` as what a culler of another engine drew.
pub(super) fn drawn(bytes: &[u8]) {
    if let Err(error) = drawn_whole(bytes) {
        one_line(&error.to_string());
    }
}

/// Reads all of `bytes` as what a culler of another engine drew in two frames of two views of nine parts.
pub(super) fn drawn_whole(bytes: &[u8]) -> Result<(), ForeignError> {
    let mut drawn = Drawn::new(bytes, "drawn.jsonl");
    let name = drawn.header()?;
    assert!(!name.chars().any(char::is_control));
    for (frame, view) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
        let parts = drawn.at(Moment { frame, view }, 9)?;
        assert!(parts.iter().all(|part| part.0 < 9));
    }
    drawn.end()
}

/// Reads `bytes` as a scene file.
pub(super) fn scene(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    // A generator at its size is no reader's matter.
    if text.contains("generator") {
        return;
    }
    let read: Result<Scene, SceneError> =
        file::parse(text, Path::new("scene.toml"), &Knobs::default());
    match read {
        Ok(scene) if scene.triangle_count() <= MOST_TRIANGLES => {
            let knobs = PartitionKnobs {
                leaf_triangles: scene.leaf_triangles,
                ..PartitionKnobs::default()
            };
            let world = World::new(scene, knobs);
            for frame in [0, 1, 999_999] {
                for view in 0..world.views() {
                    let _ = FrameState::at(&world, Moment { frame, view });
                }
            }
        }
        Ok(_) => {}
        Err(error) => one_line(&error.to_string()),
    }
}
