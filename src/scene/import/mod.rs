//! Import of models, one format per file, each through a crate of its own and behind checks that name
//! the place of what is refused. Positions and triangles are taken, nothing else. No file, however
//! broken or hostile, makes it panic, or take more memory than some multiple of the file's size and, for
//! glTF, whose nodes may share meshes, of a number of vertices.

mod gltf;
mod obj;
mod ply;

use std::path::Path;

use super::{Mesh, SceneError};
use crate::math::Aabb;

/// What a model is written in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Wavefront OBJ; each group is a mesh.
    Obj,
    /// glTF 2.0, text or binary; each primitive of each node is a mesh, where the default scene puts it.
    Gltf,
    /// PLY, text or binary; one mesh.
    Ply,
}

/// Reads the meshes of a file; its name's ending says the [`Format`].
///
/// # Errors
/// [`SceneError::Read`] where the file cannot be read, [`SceneError::File`] with the place and the remedy
/// where it cannot be understood, or nothing is left to draw.
pub fn model(path: &Path) -> Result<Vec<Mesh>, SceneError> {
    let refuse = |what: String| SceneError::File { path: path.to_owned(), what };
    let ending = path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    let format = match ending.as_str() {
        "obj" => Format::Obj,
        "gltf" | "glb" => Format::Gltf,
        "ply" => Format::Ply,
        _ => {
            let what = "is no model that can be read; name a .obj, .gltf, .glb or .ply file";
            return Err(refuse(what.to_owned()));
        }
    };
    let bytes =
        std::fs::read(path).map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
    parse(format, &bytes, path.parent()).map_err(refuse)
}

/// The meshes in `bytes`, at least one. `folder` is where other files that a glTF file names are looked
/// for; without it, it may name none.
///
/// # Errors
/// One line: the place and the remedy.
pub fn parse(format: Format, bytes: &[u8], folder: Option<&Path>) -> Result<Vec<Mesh>, String> {
    let meshes = match format {
        Format::Obj => obj::parse(bytes),
        Format::Gltf => gltf::parse(bytes, folder),
        Format::Ply => ply::parse(bytes),
    };
    let meshes = meshes.map_err(|what| what.replace('\n', " "))?;
    if meshes.is_empty() {
        return Err("holds no faces; export the model with its polygons".to_owned());
    }
    Ok(meshes)
}

/// Enough of a word to know it by.
fn short(word: &str) -> String {
    word.chars().take(24).collect()
}

/// All meshes as one, its box centred at the origin and scaled so that the farthest corner of the box
/// is `radius` away.
///
/// # Errors
/// [`SceneError::Mesh`] where there are more vertices than an index can name.
pub fn merged(meshes: &[Mesh], radius: f64) -> Result<Mesh, SceneError> {
    let bounds = Aabb::of_points(meshes.iter().flat_map(|mesh| mesh.positions()));
    let half = bounds.size().length() * 0.5;
    let factor = if half > 0.0 { radius / half } else { 1.0 };
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for mesh in meshes {
        let first = u32::try_from(positions.len()).map_err(|_| SceneError::Mesh {
            mesh: mesh.name().to_owned(),
            what: "has more than 2³² vertices with those before it".to_owned(),
        })?;
        let moved = |p: &[f32; 3]| {
            let p = glam::DVec3::from_array(p.map(f64::from));
            ((p - bounds.center()) * factor).as_vec3().to_array()
        };
        positions.extend(mesh.positions().iter().map(moved));
        triangles.extend(mesh.triangles().iter().map(|t| t.map(|i| first + i)));
    }
    Mesh::new("merged", positions, triangles)
}
