//! Import of glTF 2.0, text and binary: the `gltf` crate reads and checks the description, accessors are
//! read here, because a hostile one must not be able to panic. Every triangle primitive of every node of
//! the default scene becomes a mesh where the scene puts it; animations and skins are at rest.

use std::io::Read as _;
use std::path::{Component, Path};

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::{DMat4, DVec3, DVec4};
use gltf::accessor::{DataType, Dimensions};
use gltf::buffer::Source;
use gltf::mesh::Mode;
use gltf::{Accessor, Document, Gltf, Node, Primitive, Semantic};

use super::short;
use crate::scene::Mesh;

/// Most vertices of all meshes where the scene puts them, and most indices. Any number of nodes may show
/// one mesh, and any number of primitives one accessor: a small file could ask for all memory there is.
const MOST_VERTICES: usize = 1 << 27;

/// Bytes of a binary file's header: magic, version, and the length of the whole file with it (glTF 2.0, 4.4.2).
const HEADER: u32 = 12;

/// Reads the buffers beside the file as well, where there is a folder to look in.
pub(super) fn parse(bytes: &[u8], folder: Option<&Path>) -> Result<Vec<Mesh>, String> {
    let said = |error: gltf::Error| format!("not a glTF file that can be read: {error}");
    // The crate takes the header off this length unasked, and panics where overflow is checked.
    if let [b'g', b'l', b'T', b'F', _, _, _, _, a, b, c, d, ..] = *bytes {
        let length = u32::from_le_bytes([a, b, c, d]);
        if length < HEADER {
            return Err(format!(
                "its header says {length} bytes in all, and is {HEADER} itself; export it again"
            ));
        }
    }
    let Gltf { document, mut blob } = Gltf::from_slice_without_validation(bytes).map_err(said)?;
    // The crate's own checks take this one for granted, and panic.
    let root = document.into_json();
    for (number, mesh) in root.meshes.iter().enumerate() {
        let indices = mesh.primitives.iter().flat_map(|primitive| primitive.attributes.values());
        if let Some(index) = indices.map(|i| i.value()).find(|&i| i >= root.accessors.len()) {
            let there_are = root.accessors.len();
            return Err(format!("mesh {number} names accessor {index}, there are {there_are}"));
        }
    }
    let document = Document::from_json(root).map_err(said)?;
    let mut buffers = Vec::new();
    for buffer in document.buffers() {
        let number = buffer.index();
        let data = match buffer.source() {
            // There is one such chunk in a file, for one buffer.
            Source::Bin => blob.take().unwrap_or_default(),
            Source::Uri(uri) => match uri.strip_prefix("data:") {
                Some(data) => inline(data),
                None => beside(folder, uri, buffer.length()),
            }
            .map_err(|what| format!("buffer {number}: {what}"))?,
        };
        if data.len() < buffer.length() {
            let (has, wants) = (data.len(), buffer.length());
            return Err(format!("buffer {number} has {has} of {wants} bytes; export it again"));
        }
        buffers.push(data);
    }
    placed(&document, &buffers, MOST_VERTICES)
}

/// The first `length` bytes of the file of that name in `folder`. A model may name neighbours and what is
/// below them, nothing else on the machine, and nothing that has no end.
fn beside(folder: Option<&Path>, uri: &str, length: usize) -> Result<Vec<u8>, String> {
    let Some(folder) = folder else { return Err(format!("'{}' is another file", short(uri))) };
    let plain = |part: Component<'_>| matches!(part, Component::Normal(_) | Component::CurDir);
    if !Path::new(uri).components().all(plain) {
        return Err(format!("'{}' is not beside the model; put it there", short(uri)));
    }
    let path = folder.join(uri);
    let said = |error: std::io::Error| format!("'{}': {error}", short(uri));
    if !std::fs::metadata(&path).map_err(said)?.is_file() {
        return Err(format!("'{}' is no file", short(uri)));
    }
    let (mut data, file) = (Vec::new(), std::fs::File::open(&path).map_err(said)?);
    file.take(length as u64).read_to_end(&mut data).map_err(said)?;
    Ok(data)
}

/// What a data URI holds, after `data:`.
fn inline(data: &str) -> Result<Vec<u8>, String> {
    let Some((_, coded)) = data.split_once(";base64,") else {
        return Err(format!("'data:{}' is not coded in base 64", short(data)));
    };
    STANDARD.decode(coded).map_err(|error| error.to_string())
}

/// The meshes of the default scene, of the first one, or of all nodes without a parent.
fn placed(document: &Document, buffers: &[Vec<u8>], most: usize) -> Result<Vec<Mesh>, String> {
    let mut stack: Vec<(Node<'_>, DMat4)> = Vec::new();
    match document.default_scene().or_else(|| document.scenes().next()) {
        Some(scene) => stack.extend(scene.nodes().map(|node| (node, DMat4::IDENTITY))),
        None => {
            let mut roots = vec![true; document.nodes().len()];
            document
                .nodes()
                .flat_map(|node| node.children())
                .for_each(|c| roots[c.index()] = false);
            let root = |node: &Node<'_>| roots[node.index()];
            stack.extend(document.nodes().filter(root).map(|node| (node, DMat4::IDENTITY)));
        }
    }
    stack.reverse();
    let (mut seen, mut meshes) = (vec![false; document.nodes().len()], Vec::new());
    let mut left = most;
    while let Some((node, from_parent)) = stack.pop() {
        if std::mem::replace(&mut seen[node.index()], true) {
            return Err(format!("node {} has two parents; nodes must form a tree", node.index()));
        }
        let columns = node.transform().matrix().map(|column| DVec4::from(column.map(f64::from)));
        let matrix = from_parent * DMat4::from_cols(columns[0], columns[1], columns[2], columns[3]);
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives() {
                let what = |what: String| {
                    format!("mesh {}, primitive {}: {what}", mesh.index(), primitive.index())
                };
                let counts = [primitive.get(&Semantic::Positions), primitive.indices()];
                let count = counts.iter().flatten().map(Accessor::count).max().unwrap_or(0);
                left = left.checked_sub(count).ok_or_else(|| {
                    format!("has more than {most} vertices or indices in all; split it")
                })?;
                if let Some(read) = triangles(&primitive, buffers).map_err(what)? {
                    let name =
                        mesh.name().map_or_else(|| format!("mesh {}", mesh.index()), str::to_owned);
                    let (positions, triangles) = read;
                    let moved = |p: [f32; 3]| {
                        matrix.transform_point3(DVec3::from(p.map(f64::from))).as_vec3().to_array()
                    };
                    let positions = positions.into_iter().map(moved).collect();
                    let mesh = Mesh::new(name, positions, triangles);
                    meshes.push(mesh.map_err(|error| what(error.to_string()))?);
                }
            }
        }
        let children: Vec<_> = node.children().map(|child| (child, matrix)).collect();
        stack.extend(children.into_iter().rev());
    }
    Ok(meshes)
}

/// Positions and triangles of a primitive; `None` for points and lines, and without positions.
type Read = Option<(Vec<[f32; 3]>, Vec<[u32; 3]>)>;

fn triangles(primitive: &Primitive<'_>, buffers: &[Vec<u8>]) -> Result<Read, String> {
    let mode = primitive.mode();
    if !matches!(mode, Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        return Ok(None);
    }
    let Some(accessor) = primitive.get(&Semantic::Positions) else { return Ok(None) };
    if (accessor.data_type(), accessor.dimensions()) != (DataType::F32, Dimensions::Vec3) {
        return Err(
            "positions are no vectors of three floats; export it without compression".to_owned()
        );
    }
    let float = |bytes: &[u8], i: usize| {
        f32::from_le_bytes([bytes[4 * i], bytes[4 * i + 1], bytes[4 * i + 2], bytes[4 * i + 3]])
    };
    let position = |bytes: &[u8]| [float(bytes, 0), float(bytes, 1), float(bytes, 2)];
    let positions: Vec<[f32; 3]> = elements(&accessor, buffers)?.map(position).collect();
    let indices: Vec<u32> = match primitive.indices() {
        None => (0..positions.len() as u32).collect(),
        Some(accessor) => {
            let index: fn(&[u8]) -> u32 = match (accessor.data_type(), accessor.dimensions()) {
                (DataType::U8, Dimensions::Scalar) => |bytes| u32::from(bytes[0]),
                (DataType::U16, Dimensions::Scalar) => {
                    |bytes| u32::from(u16::from_le_bytes([bytes[0], bytes[1]]))
                }
                (DataType::U32, Dimensions::Scalar) => {
                    |bytes| u32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]])
                }
                _ => return Err("indices are no whole numbers".to_owned()),
            };
            elements(&accessor, buffers)?.map(index).collect()
        }
    };
    let three = |i: &[u32]| [i[0], i[1], i[2]];
    let triangles = match mode {
        Mode::TriangleStrip => {
            // Every second one is turned about, which nothing here minds.
            indices.windows(3).map(three).collect()
        }
        Mode::TriangleFan => {
            let fan = indices.get(1..).unwrap_or(&[]).windows(2);
            fan.map(|pair| [indices[0], pair[0], pair[1]]).collect()
        }
        _ => indices.chunks_exact(3).map(three).collect(),
    };
    Ok(Some((positions, triangles)))
}

/// The bytes of each element of an accessor.
fn elements<'a>(
    accessor: &Accessor<'_>,
    buffers: &'a [Vec<u8>],
) -> Result<impl Iterator<Item = &'a [u8]> + use<'a>, String> {
    let number = accessor.index();
    if accessor.sparse().is_some() {
        return Err(format!("accessor {number} is sparse, which is not read; export it dense"));
    }
    let Some(view) = accessor.view() else {
        return Err(format!("accessor {number} has no data; export it without compression"));
    };
    let (size, count) = (accessor.size(), accessor.count());
    let stride = view.stride().unwrap_or(size).max(size);
    // The last element ends at offset + (count − 1)·stride + size.
    let length =
        count.checked_sub(1).map_or(Some(0), |steps| steps.checked_mul(stride)?.checked_add(size));
    let reach = length.and_then(|length| length.checked_add(accessor.offset()));
    let begin = view.offset().checked_add(accessor.offset());
    let data = match (begin, length, reach.filter(|reach| *reach <= view.length())) {
        (Some(begin), Some(length), Some(_)) => begin
            .checked_add(length)
            .and_then(|end| buffers.get(view.buffer().index())?.get(begin..end)),
        _ => None,
    };
    let Some(data) = data else {
        return Err(format!("accessor {number} reaches beyond its data; export it again"));
    };
    Ok((0..count).map(move |i| &data[i * stride..i * stride + size]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle and its indices, inline.
    fn text() -> String {
        let mut data = Vec::new();
        for c in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0] {
            data.extend(c.to_le_bytes());
        }
        for i in [0_u16, 1, 2] {
            data.extend(i.to_le_bytes());
        }
        let data = STANDARD.encode(data);
        format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],
            "nodes":[{{"children":[1],"translation":[5,0,0]}},{{"mesh":0,"scale":[2,2,2]}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"indices":1}}]}}],
            "buffers":[{{"byteLength":42,"uri":"data:application/octet-stream;base64,{data}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":36}},{{"buffer":0,"byteOffset":36,"byteLength":6}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
            {{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}}]}}"#
        )
    }

    fn import(text: &str) -> Result<Vec<Mesh>, String> {
        crate::scene::import::parse(crate::scene::import::Format::Gltf, text.as_bytes(), None)
    }

    #[test]
    fn nodes_place_their_meshes() {
        let meshes = import(&text()).unwrap();
        assert_eq!(meshes.len(), 1);
        assert_eq!(meshes[0].positions()[1], [7.0, 0.0, 0.0]);
        assert_eq!(meshes[0].triangles(), [[0, 1, 2]]);
    }

    /// A length under the header's own, at it, and over what is there: none is taken off unasked.
    #[test]
    fn binary_lengths_are_not_trusted() {
        let of = |length: u32| {
            let bytes =
                [&b"glTF\x02\0\0\0"[..], &length.to_le_bytes(), b"\x02\0\0\0JSON{}"].concat();
            parse(&bytes, None).unwrap_err()
        };
        assert_eq!(of(11), "its header says 11 bytes in all, and is 12 itself; export it again");
        assert!(of(0).starts_with("its header says 0 bytes in all"));
        for length in [12, 22, 23, u32::MAX] {
            assert!(of(length).starts_with("not a glTF file that can be read: "), "{length}");
        }
    }

    #[test]
    fn what_many_nodes_share_counts_for_each() {
        let gltf = Gltf::from_slice(text().as_bytes()).unwrap();
        let (document, data) = (gltf.document, vec![vec![0; 42]]);
        assert_eq!(placed(&document, &data, 3).unwrap().len(), 1);
        assert!(placed(&document, &data, 2).unwrap_err().contains("more than 2 vertices"));
    }

    #[test]
    fn buffers_come_from_beside_the_model_alone() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("data.bin"), [7; 9]).unwrap();
        std::fs::create_dir(folder.path().join("sub")).unwrap();
        let beside = |uri: &str, length| beside(Some(folder.path()), uri, length);
        assert_eq!(beside("data.bin", 4).unwrap(), [7; 4]);
        assert_eq!(beside("./data.bin", 99).unwrap().len(), 9);
        for (uri, says) in [
            ("/dev/zero", "not beside"),
            ("../data.bin", "not beside"),
            ("sub/../../x", "not beside"),
            ("sub", "is no file"),
            ("gone.bin", "'gone.bin': "),
        ] {
            assert!(beside(uri, 4).unwrap_err().contains(says), "{uri}");
        }
        assert!(super::beside(None, "data.bin", 4).unwrap_err().contains("another file"));
    }

    #[test]
    fn refusals_are_one_line() {
        let text = text();
        for (text, says) in [
            (String::new(), "not a glTF file"),
            (
                text.replace(r#""count":3,"type":"VEC3""#, r#""count":4,"type":"VEC3""#),
                "accessor 0 reaches",
            ),
            (
                text.replace(
                    r#""count":3,"type":"SCALAR""#,
                    r#""count":18446744073709551615,"type":"SCALAR""#,
                ),
                "more than 134217728 vertices",
            ),
            (text.replace("\"byteLength\":42", "\"byteLength\":420"), "buffer 0 has 42 of 420"),
            (text.replace(";base64,", ";base64,*"), "buffer 0: "),
            (text.replace(";base64,", ","), "not coded in base 64"),
            (text.replace("\"mesh\":0,", "\"mesh\":0,\"children\":[0],"), "tree"),
            (text.replace("\"mesh\":0,", ""), "no faces"),
            (text.replace("\"mesh\":0,", "\"mesh\":7,"), "not a glTF file"),
            (
                text.replace(r#""bufferView":0,"componentType":5126"#, r#""componentType":5126"#),
                "Missing data",
            ),
        ] {
            let error = import(&text).unwrap_err();
            assert!(
                error.contains(says) && !error.contains('\n'),
                "{says} was to be said, not {error}"
            );
        }
    }
}
