//! Every way from a failure to the exit code: each kind of failure, made alone, through each verb that judges.
//! A check that overlooks something, a campaign that drops what the gate said, a verdict that looks at one
//! check only: each is cut off here by a line of one of two tables. `tests/mutants.sh` runs this group.

mod replay;

use std::path::Path;

use plainsight::check::{Check, Gate, Ruling};
use plainsight::cli::{EXIT_DEVICE, EXIT_FAILED, EXIT_HELD, Streams, main};
use plainsight::cull::{CULLERS, CullerSetup, DrawAll, PerView, ProxyKind};
use plainsight::index::INDEXES;
use plainsight::oracle::{CostModel, Sim};
use plainsight::part::{PartId, PartitionKnobs};
use plainsight::run::{Canary, Lane, LaneInfo, Moment, Repeat, Trace, World, run as run_lanes};
use plainsight::scene::Viewport;
use plainsight::scene::generate::{Knobs, build};
use rayon::prelude::*;
use serde_json::{Value, json};

/// The kinds of failures, each alone: the check that must notice, how its line begins, the word, the exit code.
const KINDS: [(Canary, Check, &str, Ruling, u8); 10] = [
    (Canary::Set, Check::Set, "set: frame 0 part ", Ruling::Failed, EXIT_FAILED),
    (Canary::Image, Check::Image, "image: ", Ruling::Failed, EXIT_FAILED),
    (Canary::DeviceImage, Check::DeviceImage, "device image: ", Ruling::Failed, EXIT_FAILED),
    (Canary::Determinism, Check::Determinism, "determinism: frame 0 ", Ruling::Failed, EXIT_FAILED),
    (Canary::Counts, Check::Counts, "counts: frame 0 ", Ruling::Failed, EXIT_FAILED),
    (Canary::Truth, Check::Truth, "truth: the fast renderer and ", Ruling::Failed, EXIT_FAILED),
    (Canary::Panic, Check::Panic, "panic: frame 1: a canary", Ruling::Failed, EXIT_FAILED),
    (
        Canary::Unrepeatable,
        Check::Repeatable,
        "device not repeatable: frame 0",
        Ruling::NotRepeatable,
        EXIT_DEVICE,
    ),
    (Canary::Lost, Check::Lost, "oracle: frame 1: device lost: ", Ruling::Lost, EXIT_DEVICE),
    // A failure just before the device is lost: both are told, and the failure decides.
    (Canary::SetThenLost, Check::Set, "set: frame 0 part ", Ruling::Failed, EXIT_FAILED),
];

/// The command line in this process: exit code, and all that it says.
fn plainsight(line: &str) -> (u8, String) {
    let (mut out, mut talk) = (Vec::new(), Vec::new());
    let streams = Streams { out: &mut out, talk: &mut talk, width: None };
    let code = main(line.split(' ').map(Into::into), CULLERS, streams);
    (code, String::from_utf8(out).unwrap() + &String::from_utf8(talk).unwrap())
}

/// A lane, small enough for any test.
const SMALL: &str =
    "--scene rooms --seed 2 --scale 0.02 --frames 2 --viewport 97x61 --leaf 256 --oracle sim";

/// Runs a verb with these flags more; `folder` is its own. Exit code, and all that it says and leaves.
type Verb = fn(&Path, &str) -> (u8, String);

fn run(_: &Path, canary: &str) -> (u8, String) {
    plainsight(&format!("plainsight run {SMALL} --culler full vfc{canary}"))
}

fn run_as_json(folder: &Path, canary: &str) -> (u8, String) {
    let [out, junit] = ["rows", "junit.xml"].map(|name| folder.join(name).display().to_string());
    let line = format!("plainsight run {SMALL} --culler full --out {out} --junit {junit}{canary}");
    let (code, _) = plainsight(&line);
    let [out, junit] = [out, junit].map(|file| std::fs::read_to_string(file).unwrap());
    let row: Value = serde_json::from_str(&out).unwrap();
    let held = row["verdict"] == "held";
    assert_eq!(held, row.get("failures").is_none(), "{row}");
    let [failures, errors] = ["failures=\"1\"", "errors=\"1\""].map(|count| junit.contains(count));
    let expected = match code {
        EXIT_HELD => (false, false),
        EXIT_DEVICE => (false, true),
        _ => (true, false),
    };
    assert_eq!((failures, errors), expected, "{junit}");
    assert!(held || junit.contains("replay: plainsight replay"), "{junit}");
    // As text has it, so that one table serves all.
    (code, row["failures"].to_string().replace('"', "\n") + row["verdict"].as_str().unwrap())
}

fn replay(_: &Path, canary: &str) -> (u8, String) {
    plainsight(&format!("plainsight replay {SMALL} --culler full{canary}"))
}

fn compare(folder: &Path, canary: &str) -> (u8, String) {
    let out = folder.join("comparison").display().to_string();
    plainsight(&format!("plainsight compare {SMALL} --culler full vfc --out {out}{canary}"))
}

fn report(folder: &Path, canary: &str) -> (u8, String) {
    let page = folder.join("page.html").display().to_string();
    let line =
        format!("plainsight report {SMALL} --culler full --no-pictures --out {page}{canary}");
    let (code, said) = plainsight(&line);
    (code, said + &std::fs::read_to_string(page).unwrap())
}

/// Everything is drawn in every frame.
fn judge(folder: &Path, canary: &str) -> (u8, String) {
    let file = folder.join("drawn.jsonl");
    let parts: Vec<u32> = (0..world(None).partition.part_count()).collect();
    let mut lines = vec![json!({ "plainsight": "drawn", "version": 1, "culler": "all" })];
    lines.extend((0..2).map(|frame| json!({ "frame": frame, "drawn": parts })));
    let lines: Vec<String> = lines.iter().map(ToString::to_string).collect();
    std::fs::write(&file, lines.join("\n")).unwrap();
    let small = SMALL.strip_suffix(" --oracle sim").unwrap();
    plainsight(&format!("plainsight judge {small} --drawn {}{canary}", file.display()))
}

fn stress(_: &Path, canary: &str) -> (u8, String) {
    plainsight(&format!("plainsight stress --seeds 1..4 --culler vfc{canary}"))
}

/// The lines of a sweep, merged and put on a page.
fn stress_merged(folder: &Path, canary: &str) -> (u8, String) {
    let [lines, page] = ["lines", "page.html"].map(|name| folder.join(name).display().to_string());
    let sweep = format!("plainsight stress --seeds 1..4 --culler vfc --out {lines}{canary}");
    let (code, _) = plainsight(&sweep);
    let (merged, said) = plainsight(&format!("plainsight stress --merge {lines}"));
    assert_eq!(merged, code, "{said}");
    let line = format!("plainsight report {SMALL} --culler vfc --no-pictures --out {page}");
    let (reported, _) = plainsight(&format!("{line} --stress {lines}"));
    assert_eq!(reported, code);
    (code, said + &std::fs::read_to_string(page).unwrap())
}

/// The fault is caught in frame 0 in any case; what is wrong with the unbroken rig is a false alarm.
fn faults(_: &Path, canary: &str) -> (u8, String) {
    plainsight(&format!("plainsight faults --fault {FAULT} --scene {FAULT_SCENE} --seed 1{canary}"))
}

fn faults_in_the_swarm(_: &Path, canary: &str) -> (u8, String) {
    plainsight(&format!("plainsight faults --fault {FAULT} --swarm 2{canary}"))
}

const FAULT: &str = "inverted-verdict";
const FAULT_SCENE: &str = "hard/layers";

fn accuracy(folder: &Path, canary: &str) -> (u8, String) {
    let small = "--scene rooms --seed 2 --scale 0.02 --frames 2 --viewport 31x23";
    let out = folder.display();
    let line = format!("plainsight accuracy {small} --knob latency --rounds 2 --out {out}{canary}");
    let (code, said) = plainsight(&line);
    (code, said + &std::fs::read_to_string(folder.join("points.jsonl")).unwrap())
}

/// The verbs that judge.
const VERBS: [(&str, Verb); 11] = [
    ("run", run),
    ("run as JSON and JUnit", run_as_json),
    ("replay", replay),
    ("compare", compare),
    ("report", report),
    ("judge", judge),
    ("stress", stress),
    ("stress, merged", stress_merged),
    ("faults", faults),
    ("faults in the swarm", faults_in_the_swarm),
    ("accuracy", accuracy),
];

#[test]
fn every_failure_reaches_every_exit_code() {
    let mut all: Vec<_> = VERBS.iter().map(|verb| (verb, None)).collect();
    for verb in &VERBS {
        // Nothing is run again of what another engine drew.
        let told = |canary: Canary| verb.0 == "judge" && canary.wants_repetition();
        all.extend(KINDS.iter().filter(|kind| !told(kind.0)).map(|kind| (verb, Some(kind))));
    }
    all.par_iter().for_each(|((name, verb), kind)| {
        let folder = tempfile::tempdir().unwrap();
        let Some((canary, check, begins, ruling, exit)) = kind else {
            let (code, said) = verb(folder.path(), "");
            assert_eq!(code, EXIT_HELD, "{name}: {said}");
            return;
        };
        let (code, said) = verb(folder.path(), &format!(" --canary {canary}"));
        assert_eq!(code, *exit, "{name}, {canary}: {said}");
        // In the words of a page as well.
        let said = said.replace("&quot;", "\"");
        let begins = match *name {
            // What a seed has in which frame is its own.
            "stress" | "stress, merged" | "faults in the swarm" => check.name(),
            _ => begins,
        };
        assert!(said.contains(begins), "{name}, {canary} lacks '{begins}': {said}");
        if *canary == Canary::SetThenLost {
            assert!(said.contains("oracle: frame 1: device lost"), "{name} loses the loss: {said}");
        }
        let word = said.to_lowercase();
        let alarm = word.contains("false alarm");
        assert!(alarm || word.contains(ruling.word()), "{name}, {canary}: {said}");
        assert!(!said.contains("verdict: held"), "{name}, {canary}: {said}");
    });
}

/// A world in which some part shows at a single sample.
fn world(canary: Option<Canary>) -> World {
    let knobs = Knobs {
        seed: Some(2),
        scale: Some(0.02),
        frames: Some(2),
        viewport: Some(Viewport { width: 97, height: 61 }),
        ..Knobs::default()
    };
    let knobs_of = PartitionKnobs { leaf_triangles: 256, ..PartitionKnobs::default() };
    World::new(build("rooms", &knobs).unwrap(), knobs_of).with_canary(canary)
}

/// Everything drawn, before this gate.
fn before(mut gate: Gate, canary: Option<Canary>) -> (Gate, Trace) {
    let world = world(canary);
    let entries = world.entries();
    let oracle = Box::new(Sim::new(world.stage()));
    let info = LaneInfo::of("all", oracle.as_ref(), String::new());
    let make = || {
        PerView::over(world.views(), || {
            Box::new(DrawAll::new(CullerSetup {
                partition: world.partition.clone(),
                index: (INDEXES[0].build)(&entries),
                proxy: ProxyKind::Rectangle,
                cost: CostModel::lavapipe(),
            }))
        })
    };
    let (culler, observer) = (Box::new(make), &mut gate);
    let lane = Lane { info, culler, oracle, observer, with_bound: false, audited: false };
    let mut traces = run_lanes(&world, 2, Repeat::first(1), &mut [lane], &mut || true).unwrap();
    (gate, traces.pop().unwrap())
}

#[test]
fn each_check_alone_decides() {
    let (gate, trace) = before(Gate::default(), None);
    assert!(gate.held() && gate.findings().is_empty() && trace.stop.is_none());
    assert_eq!((gate.word().as_str(), gate.first_failure()), ("held", None));
    assert_eq!(gate.truth.checked(), 0, "nothing failed, nothing is doubted");
    for (canary, check, begins, ruling, _) in KINDS {
        let (gate, trace) = before(Gate::default(), Some(canary));
        assert!(!gate.held(), "{canary}");
        assert_eq!((gate.ruling(), gate.word().as_str()), (ruling, ruling.word()), "{canary}");
        let expected: &[Check] = match canary {
            Canary::SetThenLost => &[Check::Set, Check::Lost],
            _ => &[check],
        };
        assert_eq!(gate.checks(), expected, "{canary}: {:?}", gate.failures());
        assert!(gate.failures()[0].starts_with(begins), "{canary}: {:?}", gate.failures());
        let stops = matches!(canary, Canary::Panic | Canary::Lost | Canary::SetThenLost);
        assert_eq!(trace.stop.is_some(), stops, "{canary}");
        assert_eq!(trace.frames.len(), if stops { 1 } else { 2 }, "{canary}");
        let first = Moment { frame: u32::from(stops && canary != Canary::SetThenLost), view: 0 };
        assert_eq!(gate.first_failure(), Some(first), "{canary}");
        assert_eq!(gate.only_truth_failed(), canary == Canary::Truth, "{canary}");
    }
}

/// A single part that shows at a single sample is missed, a single sample of a picture is wrong.
#[test]
fn one_pixel_is_enough() {
    let (gate, _) = before(Gate::default(), Some(Canary::Set));
    let pixels: Vec<u32> = gate.conservative.misses().iter().map(|miss| miss.pixels).collect();
    assert_eq!(pixels, [1, 1], "choose a world in which some part shows at one sample");
    for canary in [Canary::Image, Canary::DeviceImage] {
        let (gate, _) = before(Gate::default(), Some(canary));
        let all = [gate.image.differences(), gate.device_image.differences()].concat();
        let found: Vec<_> = all.iter().map(|d| (d.pixels, d.first_pixel)).collect();
        assert_eq!(found, [(1, [0, 0]); 2], "{canary}");
    }
}

/// Lateness forgives a part that is missing for a time, and nothing else.
#[test]
fn lateness_forgives_no_more_than_it_says() {
    for (canary, _, _, ruling, _) in KINDS {
        let (gate, _) = before(Gate::forgiving(9), Some(canary));
        let expected = match canary {
            Canary::Set => "held late(2)",
            // Pictures are not compared, and so nothing fails in which the truth would be doubted.
            Canary::Image | Canary::DeviceImage | Canary::Truth => "held",
            Canary::SetThenLost => "device lost",
            _ => ruling.word(),
        };
        assert_eq!(gate.word(), expected, "{canary}");
    }
}

/// Where the fast renderer's picture is wrong, nothing is said of the culler by it: not that it missed what
/// only the wrong picture shows, and not that its picture differs. What it did miss is still said.
#[test]
fn the_naive_renderer_decides() {
    let (gate, _) = before(Gate::default(), Some(Canary::Truth));
    let wrong = gate.truth.wrong();
    assert_eq!(wrong.len(), 2, "once found wrong it is doubted in every failing frame");
    assert_eq!((wrong[0].pixels, wrong[0].first_pixel, wrong[0].of_drawn), (1, [0, 0], false));
    assert!(gate.conservative.misses().is_empty() && gate.image.differences().is_empty());
    // The truth was right in the first frame that failed: it is doubted no more.
    let (gate, _) = before(Gate::default(), Some(Canary::Image));
    assert_eq!((gate.truth.checked(), gate.truth.wrong().len()), (1, 0));
}

/// A draw or a question that differs is the culler's; an answer is the device's, and so is all that follows.
#[test]
fn the_first_event_tells_whose_doing_it_is() {
    use plainsight::check::Determinism;
    use plainsight::cull::Event;
    use plainsight::oracle::{Answer, QueryId};
    use plainsight::run::{FrameState, Repetition};

    let (_, trace) = before(Gate::default(), None);
    let (world, lane) = (world(None), &trace.lane);
    let answer = |query: u32, visible| Event::answer(Answer { query: QueryId(query), visible });
    let frame = |number: usize, events: &[Event]| {
        let mut frame = trace.frames[number].clone();
        (frame.events, frame.events_hash) = (events.to_vec(), Event::hash(events));
        frame
    };
    let (draw, other, ask) =
        (Event::draw(PartId(1)), Event::draw(PartId(2)), Event::ask(QueryId(0)));
    let (hidden, visible) = (answer(0, false), answer(0, true));
    let first = [draw, ask, hidden, other];
    let judged = |pairs: &[(usize, &[Event])]| {
        let mut check = Determinism::default();
        for &(number, events) in pairs {
            let state = FrameState::at(&world, Moment { frame: number as u32, view: 0 });
            let (first, again) = (&frame(number, &first), &frame(number, events));
            let (world, state) = (&world, &state);
            check.repeated(&Repetition { lane, world, state, first, again });
        }
        assert_eq!(check.compared() as usize, pairs.len());
        (check.first_difference().is_some(), check.device().is_some())
    };
    let (culler, device) = ((true, false), (false, true));
    let answered: &[Event] = &[draw, ask, visible, draw];
    assert_eq!(judged(&[(0, &first), (1, &first)]), (false, false));
    assert_eq!(judged(&[(0, answered)]), device);
    assert_eq!(judged(&[(0, &[draw, ask, answer(1, false), other])]), device);
    assert_eq!(judged(&[(0, &[other, ask, hidden, other])]), culler);
    assert_eq!(judged(&[(0, &[draw, ask, hidden, draw])]), culler);
    assert_eq!(judged(&[(0, &[draw, ask, hidden])]), culler);
    // The device gave one answer, the culler did not wait for it.
    assert_eq!(judged(&[(0, &[draw, ask, other])]), culler);
    // What comes after an answer that differed follows from it, in this round alone.
    assert_eq!(judged(&[(0, answered), (1, &[other])]), device);
    assert_eq!(judged(&[(0, &[other]), (1, answered)]), culler);
    assert_eq!(judged(&[(0, answered), (1, &first), (0, &first), (1, &[other])]), (true, true));
    assert_eq!(judged(&[(0, answered), (0, &[other])]), (true, true));
}
