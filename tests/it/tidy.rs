//! The borders of the house, held: imports only from rooms above, module docs, file length, banned
//! words; and the versions that are fuzzed.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Rooms from the top; a room may import only those before it.
const ROOMS: [&str; 16] = [
    "math", "scene", "part", "effect", "index", "oracle", "cull", "run", "check", "fault",
    "stress", "accuracy", "survey", "foreign", "report", "cli",
];
/// Rooms that may not be imported although they stand above.
const FORBIDDEN: [(&str, &[&str]); 5] = [
    ("index", &["scene", "effect"]),
    ("oracle", &["index", "effect"]),
    ("part", &["effect"]),
    ("cull", &["effect", "run"]),
    ("foreign", &["check", "fault"]),
];
/// No file is longer.
const MOST_LINES: usize = 800;

fn sources(folder: &str) -> Vec<(PathBuf, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut found = Vec::new();
    let mut folders = vec![root.join(folder)];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).unwrap() {
            let path = entry.unwrap().path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") {
                let text = std::fs::read_to_string(&path).unwrap();
                found.push((path.strip_prefix(root).unwrap().to_owned(), text));
            }
        }
    }
    assert!(!found.is_empty(), "{folder} holds no sources");
    found
}

fn room(path: &Path) -> Option<usize> {
    let name = path.components().nth(1)?.as_os_str().to_str()?;
    ROOMS.iter().position(|room| *room == name)
}

#[test]
fn rooms_import_only_from_above() {
    for (path, text) in sources("src") {
        let Some(own) = room(&path) else { continue };
        for (place, other) in ROOMS.iter().enumerate() {
            let imported = text.contains(&format!("crate::{other}"));
            let forbidden = FORBIDDEN
                .iter()
                .any(|(room, others)| *room == ROOMS[own] && others.contains(other));
            // The viewport and the camera are words of `scene` that everything below it speaks.
            let words = ["Viewport", "Camera", "Camera, Viewport"];
            let only_words =
                text.lines().filter(|line| line.contains(&format!("crate::{other}"))).all(|line| {
                    words.iter().any(|w| {
                        line == format!("use crate::scene::{w};")
                            || line == format!("use crate::scene::{{{w}}};")
                    })
                });
            let wrong = place > own || (forbidden && !only_words);
            assert!(!(imported && wrong), "{} may not import {other}", path.display());
        }
    }
}

#[test]
fn only_one_folder_names_wgpu() {
    for (path, text) in sources("src") {
        let inside = path.starts_with("src/oracle/wgpu");
        let names =
            text.contains("wgpu::") && !text.replace("oracle::wgpu::", "").contains("wgpu::");
        assert!(inside || names || !text.contains("wgpu::"), "{} names wgpu", path.display());
    }
}

#[test]
fn the_reference_knows_nothing_of_plainsight() {
    for (path, text) in sources("reference/src") {
        for word in ["plainsight::", "glam"] {
            assert!(!text.contains(word), "{} names {word}", path.display());
        }
    }
}

#[test]
fn every_file_opens_with_its_doc_and_stays_short() {
    for folder in ["src", "reference/src", "tests", "examples"] {
        for (path, text) in sources(folder) {
            assert!(text.starts_with("//!"), "{} has no module doc", path.display());
            let lines = text.lines().count();
            assert!(lines <= MOST_LINES, "{} has {lines} lines", path.display());
        }
    }
}

#[test]
fn nothing_compared_sees_a_clock_or_hash_order() {
    for folder in ["src", "reference/src"] {
        for (path, text) in sources(folder) {
            for word in ["HashMap", "HashSet", "SystemTime", "thread_rng"] {
                assert!(!text.contains(word), "{} uses {word}", path.display());
            }
            // The wall clock is read in eight places: four for figures that are never compared, one
            // to measure what a cost model is fitted to, which runs see as a saved file alone, one
            // to end a sweep in time, and two to name a culler or process that does not come back.
            let timed = [
                "run/lane.rs",
                "run/frame.rs",
                "run/heartbeat.rs",
                "run/price.rs",
                "survey/measure.rs",
                "run/calibrate.rs",
                "cli/pipe.rs",
                "cli/stress.rs",
            ];
            let timed = timed.iter().any(|file| path.ends_with(file));
            let clock = text.contains("Instant") && !timed;
            assert!(!clock, "{} reads the clock", path.display());
        }
    }
}

/// What is fuzzed is what ships: the fuzzers' own lock file has the versions of ours.
#[test]
fn fuzzers_lock_what_ships() {
    let read = |path: &str| -> toml::Table {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(path);
        std::fs::read_to_string(path).unwrap().parse().unwrap()
    };
    let text = |value: &toml::Value| value.as_str().unwrap().to_owned();
    let versions = |lock: &toml::Table| -> BTreeSet<(String, String)> {
        let packages = lock["package"].as_array().unwrap().iter();
        packages.map(|one| (text(&one["name"]), text(&one["version"]))).collect()
    };
    let lock = read("fuzz/Cargo.lock");
    let (ours, theirs) = (versions(&read("Cargo.lock")), versions(&lock));
    for (name, version) in theirs.difference(&ours) {
        assert!(
            !ours.iter().any(|(known, _)| known == name),
            "{name} {version} is not what Cargo.lock has: in fuzz/, `cargo update -p {name} --precise ...`"
        );
    }
    let manifest = read("Cargo.toml");
    let dependencies = manifest["dependencies"].as_table().unwrap().iter();
    let wanted: BTreeSet<String> = dependencies
        .filter(|(_, one)| one.get("optional").is_none())
        .map(|(name, _)| name.clone())
        .collect();
    let mut packages = lock["package"].as_array().unwrap().iter();
    let us = packages.find(|one| text(&one["name"]) == "plainsight").unwrap();
    // With a version behind the name where there are several.
    let name = |one: &toml::Value| text(one).split(' ').next().unwrap_or_default().to_owned();
    let locked: BTreeSet<String> =
        us["dependencies"].as_array().unwrap().iter().map(name).collect();
    assert_eq!(locked, wanted, "run `cargo update --workspace` in fuzz/");
}
