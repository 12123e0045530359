//! What accuracy costs: settings that take nothing lose nothing, others lose what they must, figures
//! repeat, and the verb says so.

use std::process::Command;

use plainsight::accuracy::{Point, Worlds, findings, measure, renderers, settings};
use plainsight::oracle::CostModel;
use plainsight::report::accuracy_table;
use plainsight::run::World;
use plainsight::scene::generate::{Knobs, build};
use plainsight::scene::{Scene, Viewport};

fn rooms() -> Scene {
    let viewport = Some(Viewport { width: 160, height: 120 });
    let knobs =
        Knobs { scale: Some(0.05), frames: Some(8), viewport, seed: Some(1), ..Knobs::default() };
    build("rooms", &knobs).unwrap()
}

fn points(knobs: &[&str], rounds: u32) -> Vec<Point> {
    let names: Vec<String> = knobs.iter().map(|name| (*name).to_owned()).collect();
    let settings = settings(&names).unwrap();
    let worlds = Worlds::new(rooms(), &World::new);
    measure(&worlds, &CostModel::lavapipe(), rounds, &settings, &mut || true).unwrap()
}

/// Every knob and every pair. The snapshot holds what is deterministic.
#[test]
fn what_takes_nothing_loses_nothing() {
    let all = points(&[], 1);
    for point in &all {
        let lost = point.missed_parts + point.missed_pixels + point.wrong_pixels;
        assert!(!point.sound || lost == 0 && point.late == 0, "{point:?}");
        assert!(point.failures.is_empty(), "{point:?}");
        assert_eq!(point.missed_parts == 0, point.wrong_pixels == 0, "{point:?}");
        assert!(point.missed_pixels <= point.wrong_pixels, "{point:?}");
    }
    assert!(all.iter().any(|point| !point.sound && point.wrong_pixels > 0));
    // Two settings of one name would be one line; walls are the clock's.
    let figures: Vec<Point> = all.into_iter().map(|p| Point { wall_ns: [0; 3], ..p }).collect();
    insta::assert_snapshot!(accuracy_table(&figures, None));
}

#[test]
fn figures_repeat_and_rounds_leave_them() {
    let knobs = ["resolution", "staleness", "latency"];
    let figures = |rounds: u32| -> Vec<Point> {
        points(&knobs, rounds).into_iter().map(|p| Point { wall_ns: [0; 3], ..p }).collect()
    };
    let once = figures(1);
    assert_eq!(once, figures(3));
    let words = |points: &[Point]| findings(points, &[]).join("\n");
    assert_eq!(words(&once), words(&figures(1)));
    let default = &once[0];
    let spiky = once.iter().find(|point| point.value == "spiky").unwrap();
    assert_eq!(spiky.queries, default.queries, "latency moves no decision");
    assert!(spiky.waited_ns > default.waited_ns);
}

/// The exact renderer in the written transform is the truth; the others are near it.
#[test]
fn renderers_stand_beside_the_truth() {
    let all = renderers(&Worlds::new(rooms(), &World::new), 1, &mut || true);
    assert_eq!(all.len(), 6);
    assert_eq!((all[0].wrong_pixels, all[0].other_depths, all[0].missed_parts), (0, 0, 0));
    let f32_plane = &all[2];
    assert!(f32_plane.other_depths > 0 && f32_plane.depth_error < 1e-4, "{f32_plane:?}");
    let double = &all[3];
    assert!(double.other_depths > 0 && double.wrong_pixels < double.samples / 100, "{double:?}");
    assert_eq!(
        renderers(&Worlds::new(rooms(), &World::new), 1, &mut || false).len(),
        0,
        "it stops where it is told"
    );
}

#[test]
fn the_verb_leaves_charts_points_and_findings() {
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().join("accuracy");
    let run = |args: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_plainsight"))
            .args(["accuracy", "--scene", "rooms", "--scale", "0.05", "--frames", "3"])
            .args(["--viewport", "96x64", "--rounds", "1", "--out"])
            .arg(&folder)
            .args(args)
            .output()
            .unwrap()
    };
    let done = run(&["--knob", "threshold", "--json"]);
    assert!(done.status.success(), "{done:?}");
    let lines = String::from_utf8(done.stdout).unwrap();
    let values: Vec<serde_json::Value> =
        lines.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(values.len(), 5 + 6 + 2, "values of the threshold, renderers, choices of effects");
    assert!(values.iter().all(|value| value["version"] == 1));
    for file in ["rooms.svg", "rooms.png", "points.jsonl", "findings.md"] {
        assert!(folder.join(file).is_file(), "{file}");
    }
    let words = std::fs::read_to_string(folder.join("findings.md")).unwrap();
    assert!(words.contains("## rooms, seed 1") && words.contains("threshold: "), "{words}");
    let refused = run(&["--knob", "speed"]);
    assert_eq!(refused.status.code(), Some(2));
    let said = String::from_utf8(refused.stderr).unwrap();
    assert!(said.contains("no knob is called 'speed'; there are resolution"), "{said}");
}
