//! Cullers of other engines: what `export` writes reads back, what they draw comes before the same gate.

use std::path::Path;

use plainsight::cli::{EXIT_FAILED, EXIT_HELD, EXIT_USAGE, Streams, main};
use plainsight::cull::{CULLERS, ProxyKind};
use plainsight::foreign::{frame_line, header_line};
use plainsight::index::INDEXES;
use plainsight::part::{ObjectId, PartitionKnobs};
use plainsight::run::{
    FrameRecord, FrameState, Lane, LaneInfo, Moment, Observer, Repeat, World, run as run_lanes,
};
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::import;
use serde_json::{Value, json};

use crate::common::oracle;

const SCENE: &str = "hard/stereo";
const FRAMES: u32 = 2;

fn world() -> World {
    let scene = build(SCENE, &Knobs { frames: Some(FRAMES), ..Knobs::default() }).unwrap();
    let leaf_triangles = scene.leaf_triangles;
    World::new(scene, PartitionKnobs { leaf_triangles, ..PartitionKnobs::default() })
}

fn run(words: &[&str]) -> (u8, String, String) {
    let (mut out, mut talk) = (Vec::new(), Vec::new());
    let args = std::iter::once("plainsight").chain(words.iter().copied()).map(Into::into);
    let code = main(args, CULLERS, Streams { out: &mut out, talk: &mut talk, width: None });
    (code, String::from_utf8(out).unwrap(), String::from_utf8(talk).unwrap())
}

/// The words of a line as a shell takes them, for lines that quote whole words.
fn words(line: &str) -> Vec<String> {
    let mut words = Vec::new();
    for (place, run) in line.split('\'').enumerate() {
        if place % 2 == 1 {
            words.push(run.to_owned());
        } else {
            words.extend(run.split_whitespace().map(str::to_owned));
        }
    }
    words
}

#[test]
fn an_export_reads_back() {
    let (world, folder) = (world(), tempfile::tempdir().unwrap());
    let out = folder.path().to_str().unwrap();
    let frames = FRAMES.to_string();
    let (code, _, talk) = run(&["export", "--scene", SCENE, "--frames", &frames, "--out", out]);
    assert_eq!(code, EXIT_HELD, "{talk}");
    // Every primitive of every node, in the order of the parts, where the object stands in frame 0.
    let read = import::model(&folder.path().join("scene.gltf")).unwrap();
    let count = world.partition.part_count();
    assert_eq!(read.len() as u32, count);
    for (mesh, part) in read.iter().zip((0..count).map(plainsight::part::PartId)) {
        let (object, local) = world.partition.locate(part);
        let parted = world.partition.mesh(object);
        let this = &parted.parts[local as usize];
        assert_eq!(mesh.triangles(), parted.triangles_of(this).0);
        let placed = world.world_from_object(object, 0);
        for (read, own) in mesh.positions().iter().zip(parted.positions_of(this)) {
            let own = placed.transform_point3(glam::Vec3::from(*own).as_dvec3());
            // The importer's own arithmetic is in f32.
            assert!(own.distance(glam::Vec3::from(*read).as_dvec3()) < 1e-5, "{own} {read:?}");
        }
    }
    let text = std::fs::read_to_string(folder.path().join("frames.jsonl")).unwrap();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len() as u32, 1 + FRAMES * 2);
    assert_eq!(lines[0], header_line(&world));
    for (line, moment) in lines[1..].iter().zip(Moment::all(&world, FRAMES)) {
        let state = FrameState::at(&world, moment);
        assert_eq!(*line, frame_line(&world, &state));
        let said: Value = serde_json::from_str(line).unwrap();
        let bits = |value: &Value| -> Vec<u64> {
            value.as_array().unwrap().iter().map(|n| n.as_f64().unwrap().to_bits()).collect()
        };
        let clip = state.clip_from_world.to_cols_array().map(f64::to_bits);
        assert_eq!(bits(&said["clip_from_world"]), clip);
        for moved in said["moved"].as_array().unwrap() {
            let object = ObjectId(moved["object"].as_u64().unwrap() as u32);
            let own = world.world_from_object(object, moment.frame).to_cols_array();
            assert_eq!(bits(&moved["world_from_object"]), own.map(f64::to_bits));
        }
        let all = world.partition.object_count() as usize;
        let moved = said["moved"].as_array().unwrap().len();
        assert!(if moment.frame == 0 { moved == all } else { moved < all && moved > 0 });
    }
}

/// Writes down what a culler draws.
struct Scribe(Vec<String>);

impl Observer for Scribe {
    fn frame(&mut self, record: &FrameRecord<'_>) {
        let Moment { frame, view } = record.state.moment;
        let drawn: Vec<u32> = record.drawn.iter().map(|part| part.0).collect();
        self.0.push(json!({ "frame": frame, "view": view, "drawn": drawn }).to_string());
    }
}

/// The lines of `vfc`.
fn drawn_by_vfc(world: &World) -> Vec<String> {
    let header = json!({ "plainsight": "drawn", "version": 1, "culler": "theirs" });
    let mut scribe = Scribe(vec![header.to_string()]);
    let entries = world.entries();
    let vfc = CULLERS.iter().find(|culler| culler.name == "vfc").unwrap();
    let make = || {
        plainsight::cull::PerView::over(world.views(), || {
            (vfc.make)(plainsight::cull::CullerSetup {
                partition: world.partition.clone(),
                index: (INDEXES[0].build)(&entries),
                proxy: ProxyKind::Rectangle,
                cost: plainsight::oracle::CostModel::lavapipe(),
            })
        })
    };
    let oracle = oracle("always", world);
    let info = LaneInfo::of("vfc", oracle.as_ref(), String::new());
    let (culler, observer) = (Box::new(make), &mut scribe);
    let lane = Lane { info, culler, oracle, observer, with_bound: false, audited: false };
    run_lanes(world, FRAMES, Repeat::NONE, &mut [lane], &mut || true).unwrap();
    scribe.0
}

fn judge(file: &Path, more: &[&str]) -> (u8, String, String) {
    let frames = FRAMES.to_string();
    let own = ["judge", "--scene", SCENE, "--frames", &frames, "--drawn", file.to_str().unwrap()];
    run(&[&own, more].concat())
}

#[test]
fn what_is_missing_is_named_drawn_and_replays() {
    let (world, folder) = (world(), tempfile::tempdir().unwrap());
    let (file, junit) = (folder.path().join("drawn.jsonl"), folder.path().join("junit.xml"));
    let pictures = folder.path().join("pictures");
    let more = ["--junit", junit.to_str().unwrap(), "--pictures", pictures.to_str().unwrap()];
    let lines = drawn_by_vfc(&world);
    std::fs::write(&file, lines.join("\n")).unwrap();
    let (code, out, talk) = judge(&file, &more);
    assert_eq!((code, talk.as_str()), (EXIT_HELD, ""), "{out}");
    assert!(out.contains("theirs") && out.contains("held"), "{out}");
    let held = std::fs::read_to_string(&junit).unwrap();
    assert!(held.contains("failures=\"0\"") && !held.contains("<failure"), "{held}");
    assert!(!pictures.exists(), "there is nothing bad to draw");

    // The posts are before everything; the last is seen by both eyes.
    let post = world.partition.part_count() - 1;
    let mut wrong = lines.clone();
    let mut line: Value = serde_json::from_str(&wrong[2]).unwrap();
    line["drawn"].as_array_mut().unwrap().retain(|part| part.as_u64() != Some(post.into()));
    wrong[2] = line.to_string();
    std::fs::write(&file, wrong.join("\n")).unwrap();
    let (code, out, talk) = judge(&file, &more);
    assert_eq!(code, EXIT_FAILED, "{out}{talk}");
    assert!(talk.contains(&format!("set: frame 0 view 1 part {post} is visible in ")), "{talk}");
    assert!(talk.contains("image: 1 frames differ, first frame 0 view 1 in "), "{talk}");
    let failed = std::fs::read_to_string(&junit).unwrap();
    assert!(failed.contains("failures=\"1\"") && failed.contains("replay: plainsight"), "{failed}");
    let png = |name: &str| image::open(pictures.join(name)).unwrap().to_rgb8();
    assert_ne!(png("truth.png"), png("drawn.png"));
    let missed = |pixel: &&image::Rgb<u8>| pixel.0[0] > 180 && pixel.0[1] < 130 && pixel.0[2] < 130;
    assert!(png("top.png").pixels().filter(missed).count() > 10, "what is missed is red");
    let replay = talk.lines().find_map(|line| line.trim().strip_prefix("replay: ")).unwrap();
    let replay = words(replay.strip_prefix("plainsight ").unwrap());
    let (code, _, again) = run(&replay.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(code, EXIT_FAILED);
    assert!(talk.starts_with(&again), "{again}");
}

#[test]
fn what_cannot_be_judged_is_one_line_and_leaves_nothing() {
    let (world, folder) = (world(), tempfile::tempdir().unwrap());
    let (file, junit) = (folder.path().join("drawn.jsonl"), folder.path().join("junit.xml"));
    let lines = drawn_by_vfc(&world);
    for (text, says) in [
        (lines[..3].join("\n"), "drawn.jsonl, line 4: ends before frame 1"),
        (lines[1..].join("\n"), "line 1: missing field `plainsight`"),
        (format!("{}\n{}", lines.join("\n"), lines[4]), "line 6: comes after the last frame"),
    ] {
        std::fs::write(&file, &text).unwrap();
        let (code, out, talk) = judge(&file, &["--junit", junit.to_str().unwrap()]);
        assert_eq!((code, out.as_str()), (EXIT_USAGE, ""), "{talk}");
        assert!(talk.contains(says) && talk.lines().count() == 1, "{talk}");
        assert!(!junit.exists(), "nothing is half-written");
    }
    let (code, _, talk) = judge(&folder.path().join("none.jsonl"), &[]);
    assert!(code == EXIT_USAGE && talk.contains("check the path"), "{talk}");
    for (command, says) in [("exit 3", "stopped before the last frame"), ("echo no", "--pipe")] {
        let (code, out, talk) = run(&["judge", "--scene", SCENE, "--pipe", command]);
        assert_eq!((code, out.as_str()), (EXIT_USAGE, ""), "{talk}");
        assert!(talk.contains(says) && talk.lines().count() == 1, "{talk}");
    }
}

/// The example in another language, behind a pipe. It wants python3 (`apt-get install python3`).
#[test]
fn a_culler_in_python_holds_and_one_that_drops_a_part_fails() {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/foreign/frustum_cull.py");
    let found = std::process::Command::new("python3").arg("--version").output();
    assert!(found.is_ok(), "no python3; install it: apt-get install python3");
    let own = ["judge", "--scene", SCENE, "--frames", "2", "--json", "--pipe"];
    let (code, out, talk) = run(&[&own[..], &[&format!("python3 '{script}'")]].concat());
    assert_eq!(code, EXIT_HELD, "{out}{talk}");
    let row: Value = serde_json::from_str(&out).unwrap();
    assert_eq!((&row["culler"], &row["verdict"]), (&"python-frustum".into(), &"held".into()));
    // It culls as much as ours, part by part, or a little less.
    let world = world();
    let ids = |line: &String| {
        serde_json::from_str::<Value>(line).unwrap()["drawn"].as_array().unwrap().len() as u64
    };
    let ours: u64 = drawn_by_vfc(&world)[1..].iter().map(ids).sum();
    let theirs = row["drawn_parts"].as_u64().unwrap();
    assert!(theirs < u64::from(world.partition.part_count()) * 4 && theirs + 40 > ours, "{theirs}");
    let command = format!("python3 '{script}' --drop-part 1447");
    let (code, _, talk) = run(&[&own[..], &[&command]].concat());
    assert_eq!(code, EXIT_FAILED);
    assert!(talk.contains("set: frame 0 part 1447 is visible in 1307 pixels"), "{talk}");
}
