//! Every reader, with what a fuzzer kept and with its good files gone bad byte by byte: a line of refusal
//! at worst.

#[path = "../../fuzz/reader.rs"]
mod reader;

use std::path::Path;

use plainsight::scene::generate::Knobs;
use plainsight::scene::import::{Format, parse};
use plainsight::scene::{Stream, file};

/// What there are readers of, as folders of the corpus.
const KINDS: [&str; 5] = ["obj", "ply", "gltf", "scene", "drawn"];
/// Spoilt copies of each good file.
const SPOILT: u32 = 1500;

/// Files of that kind that a fuzzer started from or kept, by name.
fn corpus(kind: &str) -> Vec<(String, Vec<u8>)> {
    let folder = format!("{}/fuzz/corpus/{kind}", env!("CARGO_MANIFEST_DIR"));
    let file = |entry: std::io::Result<std::fs::DirEntry>| {
        let entry = entry.unwrap();
        (entry.file_name().into_string().unwrap(), std::fs::read(entry.path()).unwrap())
    };
    let mut files: Vec<_> = std::fs::read_dir(&folder).unwrap().map(file).collect();
    files.sort();
    assert!(!files.is_empty(), "{folder} is empty");
    files
}

/// Those of them that hold what their format is for, and are read whole.
fn good(kind: &str) -> Vec<(String, Vec<u8>)> {
    let mut files = corpus(kind);
    files.retain(|(name, _)| name.starts_with("good"));
    assert!(!files.is_empty(), "no file of {kind} is good");
    files
}

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

fn read(kind: &str, bytes: &[u8]) {
    match kind {
        "obj" => reader::model(Format::Obj, bytes),
        "ply" => reader::model(Format::Ply, bytes),
        "gltf" => reader::model(Format::Gltf, bytes),
        "drawn" => reader::drawn(bytes),
        _ => reader::scene(bytes),
    }
}

#[test]
fn spoilt_files_are_refused_in_a_line_or_read() {
    for kind in KINDS {
        let mut stream = Stream::new(1, kind);
        for (_, good) in good(kind) {
            for _ in 0..SPOILT {
                read(kind, &spoil(&good, &mut stream));
            }
        }
    }
}

#[test]
fn the_good_files_are_good() {
    for (kind, format) in [("obj", Format::Obj), ("ply", Format::Ply), ("gltf", Format::Gltf)] {
        for (name, good) in good(kind) {
            let meshes =
                parse(format, &good, None).unwrap_or_else(|e| panic!("{kind}/{name}: {e}"));
            let triangles: usize = meshes.iter().map(|mesh| mesh.triangles().len()).sum();
            assert!(triangles >= 2, "{kind}/{name}");
        }
    }
    for (name, good) in good("scene") {
        let (text, path) = (String::from_utf8(good).unwrap(), Path::new(&name));
        let scene = file::parse(&text, path, &Knobs::default()).unwrap();
        let said = format!("leaf_triangles = {}\n", scene.leaf_triangles);
        assert!(scene.objects.len() == 1 && text.contains(&said), "{name}");
    }
    for (name, good) in good("drawn") {
        reader::drawn_whole(&good).unwrap_or_else(|e| panic!("{name}: {e}"));
    }
}

#[test]
fn what_a_fuzzer_kept() {
    for kind in KINDS {
        corpus(kind).iter().for_each(|(_, bytes)| read(kind, bytes));
    }
}
