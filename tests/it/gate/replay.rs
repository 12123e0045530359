//! Replay lines replay the failure: of each kind, by cullers, devices and worlds that are wrong on purpose,
//! the line at the end of the failure is run and must say the same.

use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

use plainsight::cli::{EXIT_DEVICE, EXIT_FAILED, EXIT_HELD, Streams, main};
use plainsight::cull::{CULLERS, Culler, CullerKind, CullerSetup, Pen, View};
use plainsight::oracle::{OracleError, Proxy};
use plainsight::part::PartId;
use plainsight::run::Canary;
use plainsight::scene::Viewport;

use crate::cli::plainsight as program;

/// What is wrong with [`Wrong`].
#[derive(Clone, Copy)]
enum Flaw {
    /// In frame 2 it draws in another order where it was made for a repetition.
    OtherOrder(bool),
    /// In frame 2 it asks another question where it was made for a repetition.
    OtherQuestion(bool),
    /// It panics in frame 1.
    Panics,
    /// It draws nothing from frame 1 on.
    DrawsNothing,
    /// It draws nothing in the second view of frame 1.
    SecondView,
}

/// Draws everything, but for its flaw.
struct Wrong(Flaw);

impl Culler for Wrong {
    fn name(&self) -> &str {
        "wrong"
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        let Viewport { width, height } = view.viewport;
        let mut all: Vec<u32> = (0..view.partition.part_count()).collect();
        let mut left = 0;
        match self.0 {
            Flaw::OtherOrder(true) if view.frame == 2 => all.reverse(),
            Flaw::OtherQuestion(true) if view.frame == 2 => left = 1,
            Flaw::Panics if view.frame == 1 => panic!("a message\n  of two lines"),
            Flaw::DrawsNothing if view.frame > 0 => all.clear(),
            Flaw::SecondView if (view.frame, view.view) == (1, 1) => all.clear(),
            _ => {}
        }
        pen.ask(&Proxy::Rectangle { min: [left, 0], max: [width, height], depth: 0.0 });
        pen.round_trip(&mut Vec::new())?;
        all.into_iter().for_each(|part| pen.draw(PartId(part)));
        Ok(())
    }
}

/// Whether this is the second, fourth … call: a lane is made once for the run and once for its repetition.
fn second(calls: &AtomicU32) -> bool {
    calls.fetch_add(1, Ordering::Relaxed) % 2 == 1
}

fn other_order(_: CullerSetup) -> Box<dyn Culler> {
    static CALLS: AtomicU32 = AtomicU32::new(0);
    Box::new(Wrong(Flaw::OtherOrder(second(&CALLS))))
}

fn other_question(_: CullerSetup) -> Box<dyn Culler> {
    static CALLS: AtomicU32 = AtomicU32::new(0);
    Box::new(Wrong(Flaw::OtherQuestion(second(&CALLS))))
}

const fn kind(name: &'static str, make: fn(CullerSetup) -> Box<dyn Culler>) -> CullerKind {
    CullerKind { name, summary: "wrong on purpose", asks: true, make }
}

const WRONG: [CullerKind; 6] = [
    kind("other-order", other_order),
    kind("other-question", other_question),
    kind("panics", |_| Box::new(Wrong(Flaw::Panics))),
    kind("draws-nothing", |_| Box::new(Wrong(Flaw::DrawsNothing))),
    kind("second-view", |_| Box::new(Wrong(Flaw::SecondView))),
    CULLERS[0],
];

/// The words of a line as a shell takes them, for lines that quote whole words.
fn words(line: &str) -> Vec<String> {
    let pieces = line.split('\'').enumerate();
    let words = pieces.flat_map(|(place, piece)| match place % 2 {
        1 => vec![piece.to_owned()],
        _ => piece.split_whitespace().map(str::to_owned).collect(),
    });
    words.collect()
}

/// The command line in this process: exit code, results, talk.
fn run(line: &str) -> (u8, String, String) {
    let (mut out, mut talk) = (Vec::new(), Vec::new());
    let streams = Streams { out: &mut out, talk: &mut talk, width: None };
    let code = main(words(line).into_iter().map(Into::into), &WRONG, streams);
    (code, String::from_utf8(out).unwrap(), String::from_utf8(talk).unwrap())
}

/// The failure lines, and the line that replays them.
fn failure(talk: &str) -> (Vec<String>, String) {
    let lines = talk.lines().filter_map(|line| line.strip_prefix("  "));
    let (told, failures): (Vec<&str>, Vec<&str>) =
        lines.partition(|line| line.starts_with("replay: ") || line.starts_with("why: "));
    let replay = told.iter().find_map(|line| line.strip_prefix("replay: "));
    let replay = replay.unwrap_or_else(|| panic!("no replay line in {talk}")).to_owned();
    (failures.into_iter().map(str::to_owned).collect(), replay)
}

const SMALL: &str = "--scene rooms --seed 2 --scale 0.02 --frames 3 --viewport 97x61 --leaf 256";

#[test]
fn every_failure_is_replayed() {
    let canaries = Canary::ALL.into_iter().filter(|canary| *canary != Canary::Hang);
    let canaries = canaries.map(|canary| format!("--culler full --oracle sim --canary {canary}"));
    let repeated =
        ["--repeat 3", "--rounds 2", "--repeat 3 --rounds 2"].into_iter().flat_map(|how| {
            ["other-order", "other-question"]
                .map(|name| format!("--culler {name} --oracle sim {how}"))
        });
    let others = [
        "--culler panics --oracle hierarchical-z",
        "--culler draws-nothing --oracle simulated --late 1 --frames 5 --latency spiky",
        "--culler draws-nothing --oracle simulated --doubt 0.5 --index list --proxy box",
        "--culler draws-nothing --oracle hardware --parts whole --depth reversed",
        "--culler full --oracle last-frame --every-triangle --scene city",
        "--culler full --oracle simulated --misbehave flips=353 --repeat 2",
        "--culler full --oracle simulated --misbehave lost=2 --memory 64 --prefetch 1",
    ];
    for what in canaries.chain(repeated).chain(others.map(str::to_owned)) {
        // A flag that is given twice counts as it is given here.
        let kept = |flag: &&str| !what.contains(&format!("--{}", flag.split(' ').next().unwrap()));
        let small: Vec<&str> = SMALL[2..].split(" --").filter(kept).collect();
        let line = format!("plainsight run --{} {what}", small.join(" --"));
        let (code, out, talk) = run(&line);
        let (failures, replay) = failure(&talk);
        assert!(code == EXIT_FAILED || code == EXIT_DEVICE, "{line}: {out}{talk}");
        assert!(!failures.is_empty(), "{line}: {talk}");
        let (again, out, talk) = run(&replay);
        assert!(!talk.contains("is not the expected"), "{replay}: {talk}");
        assert_eq!((again, &failure(&talk).0), (code, &failures), "{line}\n{replay}: {out}{talk}");
    }
}

/// Where a frame has several views, the view is named and `why` is asked about it.
#[test]
fn why_is_asked_about_the_view() {
    let (code, _, talk) = run(
        "plainsight run --scene hard/stereo --frames 2 --viewport 97x61 --culler second-view --oracle sim",
    );
    assert_eq!(code, EXIT_FAILED, "{talk}");
    let (failures, replay) = failure(&talk);
    let (_, _, again) = run(&replay);
    assert_eq!(failure(&again).0, failures, "{replay}: {again}");
    let why = talk.lines().find_map(|line| line.strip_prefix("  why: ")).unwrap().to_owned();
    assert!(
        why.contains("--viewport 97x61") && why.contains("--frame 1 --view 1 --part "),
        "{why}"
    );
    let folder = tempfile::tempdir().unwrap();
    let (code, out, talk) = run(&format!("{why} --out {}/why.png", folder.path().display()));
    assert_eq!(code, EXIT_HELD, "{out}{talk}");
}

/// The deterministic twin of a device that answers one question in two ways.
#[test]
fn a_device_that_does_not_repeat_is_told_as_such() {
    let line = format!("plainsight run {SMALL} --culler full --oracle simulated");
    let (code, out, _) = run(&line);
    assert_eq!(code, EXIT_HELD, "{out}");
    // The run asks 736 questions, so this is one of the repetition.
    let (code, out, talk) = run(&format!("{line} --misbehave flips=1149"));
    assert_eq!(code, EXIT_DEVICE, "{out}{talk}");
    assert!(out.contains("  device not repeatable\n"), "{out}");
    assert!(out.contains("verdict: device not repeatable (0 of 1 lanes held"), "{out}");
    let flags =
        "--seed 2 --frames 3 --scale 0.02 --viewport 97x61 --leaf 256 --misbehave flips=1149";
    let told = [
        "DEVICE NOT REPEATABLE: simulated under full",
        "  device not repeatable: frame 0, event 5813: question 413 was answered \"hidden\" and, run again, \"visible\"; all events before it were the same; the nearest of its 4 proxies is columns 33..38, rows 40..49 at depth 0.9902714, and the nearest tie with what was drawn before it is 2.1636486053466797e-4 (3630 ulps) away, at (33, 40)",
        &format!(
            "  replay: plainsight replay --scene rooms --culler full --oracle simulated {flags}"
        ),
    ];
    assert_eq!(talk.lines().collect::<Vec<_>>(), told);
    let (code, row, _) = run(&format!("{line} --misbehave flips=1149 --json"));
    let row: serde_json::Value = serde_json::from_str(row.trim()).unwrap();
    assert_eq!((code, &row["verdict"]), (EXIT_DEVICE, &"device not repeatable".into()));
    // A question that is asked once only has nothing to differ from; one of a repeated frame has.
    assert_eq!(run(&format!("{line} --misbehave flips=600")).0, EXIT_HELD);
    assert_eq!(run(&format!("{line} --misbehave flips=353 --repeat 2")).0, EXIT_DEVICE);
    let junit = tempfile::tempdir().unwrap();
    let file = junit.path().join("junit.xml").display().to_string();
    let replay = failure(&talk).1.replace("replay ", "run ") + &format!(" --junit {file}");
    assert_eq!(run(&replay).0, EXIT_DEVICE);
    let text = std::fs::read_to_string(file).unwrap();
    assert!(text.contains("failures=\"0\" errors=\"1\""), "{text}");
    assert!(text.contains("<error message=\"device not repeatable: frame 0, event "), "{text}");
}

/// A lost device leaves JUnit with an error and the replay line, beside what was finished.
#[test]
fn a_lost_device_leaves_its_report() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).display().to_string();
    let [junit, rows] = ["junit.xml", "rows"].map(file);
    let line = format!(
        "plainsight run {SMALL} --culler full --oracle sim,simulated --misbehave lost=2 --junit {junit} --out {rows}"
    );
    let (code, out, talk) = run(&line);
    assert_eq!(code, EXIT_DEVICE, "{out}{talk}");
    assert!(talk.starts_with("DEVICE LOST: simulated under full\n"), "{talk}");
    assert!(out.contains("verdict: device lost (1 of 2 lanes held"), "{out}");
    let text = std::fs::read_to_string(junit).unwrap();
    assert!(text.contains("tests=\"2\" failures=\"0\" errors=\"1\""), "{text}");
    assert!(text.contains("<error message=\"oracle: frame 0: device lost: "), "{text}");
    assert!(text.contains("replay: plainsight replay --scene rooms "), "{text}");
    assert_eq!(std::fs::read_to_string(rows).unwrap().lines().count(), 2);
}

/// A culler that hangs is named and ends the process; what was finished before is kept.
#[test]
fn a_culler_that_hangs_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).display().to_string();
    // Seed 2 ends, seed 1 hangs.
    for seed in [2, 1] {
        let text = format!(
            "version = 1\ngenerator = \"rooms\"\nseed = {seed}\nscale = 0.02\nframes = 2\n"
        );
        std::fs::write(Path::new(&file(&format!("{seed}.toml"))), text).unwrap();
    }
    let [first, second, junit, rows] = ["2.toml", "1.toml", "junit.xml", "rows"].map(file);
    let args = [
        "run",
        "--scene",
        &first,
        &second,
        "--viewport",
        "97x61",
        "--culler",
        "vfc",
        "--oracle",
        "sim",
        "--canary",
        "hang",
        "--frame-limit",
        "1.5",
        "--junit",
        &junit,
        "--out",
        &rows,
    ];
    let (code, _, talk) = program(&args);
    assert_eq!(code, i32::from(EXIT_FAILED), "{talk}");
    let (failures, replay) = failure(&talk);
    assert!(talk.contains("FAILED: vfc on sim in rooms, seed 1\n"), "{talk}");
    assert_eq!(failures, ["hang: frame 1: did not end within 1.5 s"]);
    let rows = std::fs::read_to_string(rows).unwrap();
    let rows: Vec<serde_json::Value> =
        rows.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let verdicts: Vec<_> = rows.iter().map(|row| row["verdict"].as_str().unwrap()).collect();
    assert_eq!(verdicts, ["held", "failed"]);
    let junit = std::fs::read_to_string(junit).unwrap();
    assert!(junit.contains("tests=\"2\" failures=\"1\" errors=\"0\""), "{junit}");
    assert!(junit.contains("<failure message=\"hang: frame 1: ") && junit.contains(&replay));
    let replay: Vec<String> = words(&replay).into_iter().skip(1).collect();
    let replay: Vec<&str> = replay.iter().map(String::as_str).collect();
    let (code, _, talk) = program(&replay);
    assert_eq!((code, failure(&talk).0), (i32::from(EXIT_FAILED), failures), "{talk}");
    // No half of a file is left: two scenes and two results.
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
}

/// Of a sweep in which a world hangs the lines of the others are kept, and it is told by its seed.
#[test]
fn a_world_that_hangs_is_told_by_its_seed() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("lines").display().to_string();
    let args =
        ["stress", "--seeds", "0..2", "--canary", "hang", "--frame-limit", "2", "--out", &file];
    let (code, _, talk) = program(&args);
    assert_eq!(code, i32::from(EXIT_FAILED), "{talk}");
    let (failures, replay) = failure(&talk);
    assert_eq!(failures, ["hang: frame 1: did not end within 2 s"]);
    assert_eq!(replay, "plainsight stress --seed 1 --canary hang --frame-limit 2");
    let (code, out, _) = program(&["stress", "--merge", &file]);
    assert_eq!(code, i32::from(EXIT_FAILED), "{out}");
    assert!(out.contains("verdict: failed (1 of 2 worlds held)"), "{out}");
    assert!(out.contains(&format!("  replay: {replay}\n")), "{out}");
}

/// A process behind a pipe that stops answering is named and judged as far as it came.
#[test]
fn a_process_that_stops_answering_is_named() {
    let header = r#"{"plainsight":"drawn","version":1,"culler":"sleepy"}"#;
    let frame = r#"{"frame":0,"drawn":[]}"#;
    let hang = "hang: frame 1: did not end within 1 s";
    for (answers, begins) in
        [(format!("echo '\"'{header}'\"'; echo '\"'{frame}'\"'; "), "sleepy"), (String::new(), "")]
    {
        // Words of a shell within a word of a shell: the tests' splitter knows no quotes within quotes.
        let command = answers.replace("'\"'", "'") + "exec sleep 60";
        let args = ["plainsight", "judge", "--scene", "rooms", "--scale", "0.02", "--frames", "3"];
        let more = ["--viewport", "97x61", "--frame-limit", "1", "--pipe", &command];
        let (mut out, mut talk) = (Vec::new(), Vec::new());
        let streams = Streams { out: &mut out, talk: &mut talk, width: None };
        let code = main(args.iter().chain(&more).map(Into::into), &WRONG, streams);
        let [out, talk] = [out, talk].map(|text| String::from_utf8(text).unwrap());
        assert_eq!(code, EXIT_FAILED, "{out}{talk}");
        assert!(talk.starts_with(&format!("FAILED: {begins}")), "{talk}");
        let hang =
            if begins.is_empty() { hang.replace("frame 1", "frame 0") } else { hang.to_owned() };
        assert!(talk.contains(&format!("  {hang}\n")), "{talk}");
        assert!(talk.contains("--frame-limit 1"), "{talk}");
        assert_eq!(talk.contains("set: frame 0 part "), !begins.is_empty(), "{talk}");
    }
}
