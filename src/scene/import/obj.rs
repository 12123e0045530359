//! Import of Wavefront OBJ through `tobj`, behind a scan of our own that names the line of what it
//! refuses. Only positions and faces are taken; each group or object becomes a mesh, polygons are
//! fanned into triangles.

use std::path::Path;

use super::short;
use crate::scene::Mesh;

/// Groups without faces are left out.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Mesh>, String> {
    let text = String::from_utf8_lossy(bytes);
    scan(&text)?;
    let text = positions_alone(&text);
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    // Materials are never wanted; tobj reports their absence beside the models.
    let no_materials = |_: &Path| Err(tobj::LoadError::OpenFileFailed);
    let (models, _) = tobj::load_obj_buf(&mut text.as_bytes(), &options, no_materials)
        .map_err(|error| format!("not an OBJ file that can be read: {error}"))?;
    let mut meshes = Vec::new();
    for model in models {
        let triple = |c: &[f32]| [c[0], c[1], c[2]];
        let positions = model.mesh.positions.chunks_exact(3).map(triple).collect();
        let triangles: Vec<[u32; 3]> =
            model.mesh.indices.chunks_exact(3).map(|i| [i[0], i[1], i[2]]).collect();
        if !triangles.is_empty() {
            let mesh = Mesh::new(model.name, positions, triangles);
            meshes.push(mesh.map_err(|error| error.to_string())?);
        }
    }
    Ok(meshes)
}

/// The lines that are taken, faces without texture and normal indices: the crate multiplies with those,
/// and with those of lines and points, unchecked.
fn positions_alone(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    for line in text.lines() {
        match line.split_ascii_whitespace().next() {
            Some("v" | "g" | "o") => kept.push_str(line),
            Some("f") => {
                kept.push('f');
                for word in line.split_ascii_whitespace().skip(1) {
                    kept.push(' ');
                    kept.push_str(word.split('/').next().unwrap_or(""));
                }
            }
            _ => continue,
        }
        kept.push('\n');
    }
    kept
}

/// Checks every vertex and face line; `tobj` takes NaN for a number and names no lines.
fn scan(text: &str) -> Result<(), String> {
    let mut vertices = 0_i64;
    for (number, line) in text.lines().enumerate() {
        let number = number + 1;
        let mut words = line.split_ascii_whitespace();
        match words.next() {
            Some("v") => {
                let mut coordinates = 0;
                for word in words.take(3) {
                    let finite = word.parse::<f32>().is_ok_and(f32::is_finite);
                    if !finite {
                        return Err(format!(
                            "line {number}: '{}' is no finite number",
                            short(word)
                        ));
                    }
                    coordinates += 1;
                }
                if coordinates < 3 {
                    return Err(format!("line {number}: a vertex needs three coordinates"));
                }
                vertices += 1;
            }
            Some("f") => {
                for word in words {
                    let index = word.split('/').next().unwrap_or("");
                    let Ok(index) = index.parse::<i64>() else {
                        return Err(format!("line {number}: '{}' is no vertex index", short(word)));
                    };
                    let place = if index < 0 { vertices + index + 1 } else { index };
                    if !(1..=vertices).contains(&place) {
                        return Err(format!(
                            "line {number}: face names vertex {index}, there are {vertices} so far"
                        ));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn import(text: &str) -> Result<Vec<Mesh>, String> {
        crate::scene::import::parse(crate::scene::import::Format::Obj, text.as_bytes(), None)
    }

    #[test]
    fn groups_become_meshes_and_polygons_triangles() {
        let meshes =
            import("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\ng a\nf 1 2 3 4\ng b\nf -1 -2 -3\n");
        let meshes = meshes.unwrap();
        let counts: Vec<usize> = meshes.iter().map(|m| m.triangles().len()).collect();
        assert_eq!(counts, [2, 1]);
    }

    #[test]
    fn refusals_name_the_line() {
        for (text, says) in [
            ("", "holds no faces"),
            ("v 0 0 0\nv nan 0 0\n", "line 2: 'nan' is no finite number"),
            ("v 0 0 1e39\n", "line 1: '1e39' is no finite number"),
            ("v 0 0\n", "line 1: a vertex needs three coordinates"),
            ("v 0 0 0\nf 1 1 2\n", "line 2: face names vertex 2, there are 1 so far"),
            ("v 0 0 0\nf 1 1 0\n", "line 2: face names vertex 0"),
            ("v 0 0 0\nf 1 x 1\n", "line 2: 'x' is no vertex index"),
        ] {
            let error = import(text).unwrap_err();
            assert!(error.contains(says), "{text:?} said {error}");
        }
    }
}
