//! What `compare` counts, at a size for debug builds: the paper's scenes, both ways to cut a mesh,
//! the cullers that are set beside one another, on the simulated and a real device. Every figure is
//! deterministic: a change in what a culler spends is seen here, and by how much. Beside it, the
//! sample models that users bring.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use plainsight::cli::{EXIT_HELD, Streams, main};
use plainsight::cull::{CULLERS, CullerKind, ProxyKind};
use plainsight::index::INDEXES;
use plainsight::oracle::CostModel;
use plainsight::part::{Crossing, PartitionKnobs};
use plainsight::run::{FrameTrace, Trace, World};
use plainsight::scene::Viewport;
use plainsight::scene::generate::{Knobs, build};

use crate::cli::{SMALL, plainsight};
use crate::common::gate;

const NAMES: [&str; 7] = ["full", "full-adaptive", "full-waits", "simple", "vfc", "chc", "chc++"];
/// A scene, its scale and most triangles in a part: each some hundreds of parts.
const CASES: [(&str, f64, u32); 2] = [("powerplant", 0.02, 2048), ("bunnies", 0.04, 256)];
const FRAMES: u32 = 4;

fn small(scene: &str, scale: f64, leaf_triangles: u32, crossing: Crossing) -> World {
    let knobs = Knobs {
        scale: Some(scale),
        frames: Some(FRAMES),
        viewport: Some(Viewport { width: 192, height: 144 }),
        ..Knobs::default()
    };
    World::new(build(scene, &knobs).unwrap(), PartitionKnobs { leaf_triangles, crossing })
}

fn culler(name: &str) -> CullerKind {
    *CULLERS.iter().find(|kind| kind.name == name).unwrap()
}

/// Counts a frame, and virtual time, as `compare` has them.
fn line(trace: &Trace, model: &CostModel) -> String {
    let frames = trace.frames.len() as f64;
    let mean = |figure: &dyn Fn(&FrameTrace) -> u64| trace.sum(figure) as f64 / frames;
    format!(
        "{:<13} {:<8} {:>7.1} {:>9.1} {:>7.1} {:>7.1} {:>9.1} {:>6.1} {:>8.2}",
        trace.lane.culler,
        trace.lane.oracle,
        mean(&|f| u64::from(f.drawn_parts)),
        mean(&|f| f.counts.triangles),
        mean(&|f| f.counts.queries),
        mean(&|f| f.counts.proxies),
        mean(&|f| f.counts.pixels),
        mean(&|f| f.counts.round_trips),
        mean(&|f| model.frame_total_ns(f.amounts())) / 1e6,
    )
}

#[test]
fn counts_of_the_papers_scenes() {
    let model = CostModel::lavapipe();
    let mut lines = vec![format!(
        "{:<13} {:<8} {:>7} {:>9} {:>7} {:>7} {:>9} {:>6} {:>8}",
        "a frame", "on", "parts", "triangles", "queries", "proxies", "pixels", "trips", "virtual"
    )];
    for (scene, scale, leaf) in CASES {
        for (word, crossing) in [("split", Crossing::Split), ("whole", Crossing::Whole)] {
            let world = small(scene, scale, leaf, crossing);
            lines.push(format!(
                "\n{scene}, parts {word}: {} parts, {} triangles",
                world.partition.part_count(),
                world.partition.fragment_count()
            ));
            for name in NAMES {
                for oracle in ["sim", "hardware"] {
                    let kind = culler(name);
                    let (trace, gate) =
                        gate(&world, kind, INDEXES[0], oracle, ProxyKind::Rectangle);
                    assert!(gate.held(), "{scene} {word} {name} {oracle}: {:?}", gate.failures());
                    lines.push(line(&trace, &model));
                }
            }
        }
    }
    insta::assert_snapshot!(lines.join("\n"));
}

/// The folder of the sample models: `PLAINSIGHT_MODELS`, else `shared/models` beside the checkout.
fn models() -> Option<PathBuf> {
    let named = std::env::var_os("PLAINSIGHT_MODELS").map(PathBuf::from);
    if let Some(folder) = &named {
        assert!(folder.is_dir(), "PLAINSIGHT_MODELS is {}: no folder", folder.display());
    }
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/models");
    named.or_else(|| beside.is_dir().then_some(beside))
}

/// Models are no part of the project, so a checkout alone passes without them.
#[test]
#[expect(clippy::print_stderr, reason = "who reads the test's output must see what was not run")]
fn sample_models_run_and_are_told_apart() {
    let Some(folder) = models() else {
        eprintln!(
            "NOT RUN: no sample models; name their folder by PLAINSIGHT_MODELS to compare cullers on them"
        );
        return;
    };
    let out = tempfile::tempdir().unwrap();
    for (stem, camera) in
        [("stanford-bunny", "orbit"), ("nefertiti", "orbit"), ("sponza-dabrovic", "inside")]
    {
        let mesh = folder.join(format!("{stem}.obj"));
        let (code, said, talk) = plainsight(&[
            "compare",
            "--scene",
            "model",
            "--mesh",
            mesh.to_str().unwrap(),
            "--camera",
            camera,
            "--frames",
            "2",
            "--viewport",
            "160x120",
            "--oracle",
            "sim,hardware",
            "--out",
            out.path().to_str().unwrap(),
        ]);
        assert_eq!(code, 0, "{stem}: {said}{talk}");
        let label = format!("model-{stem}");
        assert!(said.contains(&format!("\n{label} ")), "the tables name the model: {said}");
        let series = std::fs::read_to_string(out.path().join("series.csv")).unwrap();
        assert!(series.lines().skip(1).all(|line| line.starts_with(&format!("{label},"))));
        assert!(out.path().join(format!("{label}-parts.svg")).exists());
    }
    let files = std::fs::read_dir(out.path()).unwrap().count();
    assert_eq!(files, 3 * 8 + 1, "each model has figures of its own");
}

/// On a terminal no line is broken in the middle of a row; elsewhere a row is one line.
#[test]
fn tables_fit_the_terminal() {
    let lines = |width: Option<usize>| {
        let out_folder = tempfile::tempdir().unwrap();
        let folder = out_folder.path().as_os_str();
        let fixed = ["plainsight", "compare", "--scene", "rooms", "--oracle", "sim", "--out"];
        let args = fixed.iter().map(OsString::from).chain([folder.to_owned()]);
        let args = args.chain(SMALL.iter().map(OsString::from));
        let (mut out, mut talk) = (Vec::new(), Vec::new());
        let code = main(args, CULLERS, Streams { out: &mut out, talk: &mut talk, width });
        assert_eq!(code, EXIT_HELD, "{}", String::from_utf8_lossy(&talk));
        let said = String::from_utf8(out).unwrap();
        said.lines().map(str::to_owned).collect::<Vec<String>>()
    };
    let rows_of = |lines: &[String], name: &str| {
        lines.iter().filter(|line| line.starts_with(&format!("{name} "))).count()
    };
    let wide = lines(None);
    assert!(wide.iter().any(|line| line.starts_with("rooms ") && line.ends_with("triangles")));
    let simple = rows_of(&wide, "simple");
    assert_eq!((rows_of(&wide, "rooms"), simple), (1, 4), "a row, and a ratio to each of three");
    let narrow = lines(Some(80));
    // The last line names a folder, which may be of any length.
    for line in &narrow[..narrow.len() - 1] {
        assert!(line.chars().count() <= 80, "{line}");
    }
    assert_eq!((rows_of(&narrow, "rooms"), rows_of(&narrow, "full")), (2, 2), "{narrow:#?}");
}
