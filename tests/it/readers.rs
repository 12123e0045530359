//! Every reader, with what a fuzzer kept and with good files that go bad byte by byte: a line of refusal
//! at worst.

#[path = "../../fuzz/reader.rs"]
mod reader;

use plainsight::scene::Stream;
use plainsight::scene::import::Format;

/// Spoilt copies of each good file.
const SPOILT: u32 = 1500;

const OBJ: &str = "# a square\nv 0 0 0\nv 1 0 0.5\nv 1 1 -2e3\nv 0 1 1e-9\ng a\nf 1 2 3 4\ng b\nf -1/1/1 -2//2 -3\n";
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\n\
    property double z\nelement face 2\nproperty list uchar int vertex_indices\nend_header\n\
    0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n3 0 1 2\n";
const GLTF: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0,"children":[1]},{"mesh":0,"rotation":[0,0,0,1]}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1,"mode":4}]}],"buffers":[{"byteLength":42,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAAAAABAAIA"}],"bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},{"bufferView":1,"componentType":5123,"count":3,"type":"SCALAR"}]}"#;
const SCENE: &str = "version = 1\nframes = 3\nviewport = [64, 48]\nleaf_triangles = 2\n[[objects]]\n\
    positions = [[0,0,0],[1,0,0],[0,1,0]]\ntriangles = [[0,1,2]]\nscale = [1, -2, 0.5]\nshear = [1, 0, 0]\n\
    reflect = { velocity = [1, 0, 0], min = [0, 0, 0], max = [5, 5, 5] }\n\
    jumps = { offsets = [[0, 0, 0], [1, 2, 3]], period = 2 }\n\
    [camera_path]\nposes = [{ eye = [0,0,5], target = [0,0,0] }]\ntravel = \"jump\"\n\
    fov_y_degrees = 60\nshift = [0.1, 0]\nnear = 0.1\nfar = inf\n";

const DRAWN: &str = include_str!("../../fuzz/corpus/drawn/good");

/// One to four changes: a byte changed, a stretch left out, doubled, or cut off.
fn spoil(good: &[u8], stream: &mut Stream) -> Vec<u8> {
    let mut bytes = good.to_vec();
    for _ in 0..=stream.below(4) {
        let length = bytes.len() as u32;
        if length == 0 {
            break;
        }
        let at = stream.below(length) as usize;
        let end = (at + stream.below(12) as usize).min(bytes.len());
        match stream.below(8) {
            0 => bytes[at] = stream.below(256) as u8,
            1 => drop(bytes.drain(at..end)),
            2 => {
                let again = bytes[at..end].to_vec();
                bytes.splice(at..at, again);
            }
            3 => bytes.truncate(at),
            4..=6 => bytes[at] = b"0123456789-.e[]{},\"\n nainf"[stream.below(25) as usize],
            _ => {
                let number =
                    ["1e39", "-1", "99999999999", "18446744073709551615", "nan", "4294967295"];
                bytes.splice(at..end, number[stream.below(6) as usize].bytes());
            }
        }
    }
    bytes
}

fn read(name: &str, bytes: &[u8]) {
    match name {
        "obj" => reader::model(Format::Obj, bytes),
        "ply" => reader::model(Format::Ply, bytes),
        "gltf" => reader::model(Format::Gltf, bytes),
        "drawn" => reader::drawn(bytes),
        _ => reader::scene(bytes),
    }
}

#[test]
fn spoilt_files_are_refused_in_a_line_or_read() {
    for (name, good) in
        [("obj", OBJ), ("ply", PLY), ("gltf", GLTF), ("scene", SCENE), ("drawn", DRAWN)]
    {
        read(name, good.as_bytes());
        let mut stream = Stream::new(1, name);
        for _ in 0..SPOILT {
            read(name, &spoil(good.as_bytes(), &mut stream));
        }
    }
}

#[test]
fn the_good_files_are_good() {
    use plainsight::scene::import::parse;
    for (format, good) in [(Format::Obj, OBJ), (Format::Ply, PLY), (Format::Gltf, GLTF)] {
        let meshes = parse(format, good.as_bytes(), None).unwrap();
        let triangles: usize = meshes.iter().map(|mesh| mesh.triangles().len()).sum();
        assert!(triangles >= 2, "{format:?}");
    }
    let knobs = plainsight::scene::generate::Knobs::default();
    let scene = plainsight::scene::file::parse(SCENE, "scene.toml".as_ref(), &knobs).unwrap();
    assert_eq!((scene.objects.len(), scene.leaf_triangles), (1, 2));
}

#[test]
fn what_a_fuzzer_kept() {
    for name in ["obj", "ply", "gltf", "scene", "drawn"] {
        let folder = format!("{}/fuzz/corpus/{name}", env!("CARGO_MANIFEST_DIR"));
        let mut paths: Vec<_> =
            std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        assert!(!paths.is_empty(), "{folder} is empty");
        paths.iter().for_each(|path| read(name, &std::fs::read(path).unwrap()));
    }
}
