//! Import of PLY, ASCII and binary, through `ply-rs-bw`: the properties `x`, `y`, `z` of `vertex` and
//! `vertex_indices` (or `vertex_index`) of `face`; polygons are fanned into triangles. What else there
//! is gets read over.

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{Property, PropertyAccess, PropertyAccessResult};

use crate::scene::Mesh;

/// A line of any element.
struct Row {
    position: [f32; 3],
    corners: Vec<u32>,
}

impl PropertyAccess for Row {
    fn new() -> Self {
        Self { position: [f32::NAN; 3], corners: Vec::new() }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let axis = match name {
            "x" => 0,
            "y" => 1,
            "z" => 2,
            "vertex_indices" | "vertex_index" => {
                let Some(corners) = property.to_u32_list() else {
                    return PropertyAccessResult::UnsupportedType;
                };
                self.corners = corners;
                return PropertyAccessResult::Set;
            }
            _ => return PropertyAccessResult::Ignored,
        };
        let Some(value) = property.to_f32_lossy() else {
            return PropertyAccessResult::UnsupportedType;
        };
        self.position[axis] = value;
        PropertyAccessResult::Set
    }
}

/// No mesh where there are no faces.
pub(super) fn parse(bytes: &[u8]) -> Result<Vec<Mesh>, String> {
    let said = |error: &dyn std::fmt::Display| format!("not a PLY file that can be read: {error}");
    let parser = Parser::<Row>::new();
    let mut reader = Reader::new(bytes);
    let header = parser.read_header(&mut reader).map_err(|error| said(&error))?;
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (element, definition) in &header.elements {
        // Each takes a byte at least; what has no properties would take none, however many there are.
        if definition.count > bytes.len() {
            let (count, size) = (definition.count, bytes.len());
            return Err(format!(
                "cannot hold {count} of '{element}' in {size} bytes; export it again"
            ));
        }
        let rows = parser
            .read_payload_for_element(&mut reader, definition, &header)
            .map_err(|error| said(&error))?;
        match element.as_str() {
            "vertex" => positions = rows.into_iter().map(|row| row.position).collect(),
            "face" => {
                for row in &rows {
                    let fan = row.corners.get(1..).unwrap_or(&[]).windows(2);
                    triangles.extend(fan.map(|pair| [row.corners[0], pair[0], pair[1]]));
                }
            }
            _ => {}
        }
    }
    if triangles.is_empty() {
        return Ok(Vec::new());
    }
    let mesh = Mesh::new("ply", positions, triangles).map_err(|error| error.to_string())?;
    Ok(vec![mesh])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::import::{Format, parse};

    const HEADER: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\n\
        end_header\n";
    const BODY: &str = "0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n4 0 1 2 3\n";

    fn import(text: &str) -> Result<Mesh, String> {
        parse(Format::Ply, text.as_bytes(), None).map(|mut meshes| meshes.remove(0))
    }

    #[test]
    fn polygons_become_triangles() {
        let mesh = import(&format!("{HEADER}{BODY}")).unwrap();
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.positions()[2], [1.0, 1.0, 0.0]);
    }

    #[test]
    fn binary_is_read_too() {
        let header = HEADER.replace("ascii", "binary_little_endian");
        let mut bytes = header.into_bytes();
        for (x, y) in [(0.0_f32, 0.0_f32), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            [x, y, 0.0].map(f32::to_le_bytes).iter().for_each(|c| bytes.extend(c));
            bytes.push(9);
        }
        bytes.push(4);
        [0_i32, 1, 2, 3].map(i32::to_le_bytes).iter().for_each(|i| bytes.extend(i));
        assert_eq!(parse(Format::Ply, &bytes, None).unwrap()[0].triangles().len(), 2);
    }

    #[test]
    fn refusals_are_one_line() {
        let whole = format!("{HEADER}{BODY}");
        for (text, says) in [
            (String::new(), "not a PLY file"),
            (HEADER.to_owned(), "not a PLY file"),
            (whole.replace("4 0 1 2 3", "4 0 1 2 7"), "vertex beyond the 4"),
            (whole.replace("4 0 1 2 3", "4 0 1 2 -3"), "not a PLY file"),
            (whole.replace("4 0 1 2 3", "2 0 1"), "no faces"),
            (whole.replace("1 1 0 3", "nan 1 0 3"), "Line 13"),
            (whole.replace("1 1 0 3", "1e39 1 0 3"), "not finite"),
            (whole.replace("property float z\n", "").replace(" 0 ", " "), "not"),
            (whole.replace("vertex 4", "vertex 99999999999"), "99999999999 of 'vertex'"),
            (whole.replace("vertex 4", "vertex 99999999999999999999999"), "not a PLY file"),
        ] {
            let error = import(&text).unwrap_err();
            assert!(error.contains(says) && !error.contains('\n'), "{text:?} said {error}");
        }
    }
}
