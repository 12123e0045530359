//! Surveys of indexes over moving objects at reduced size: operations and findings are snapshots, what is
//! found is never less than there is, knobs come out of the search again, and the verbs say so.

use std::process::Command;

use plainsight::part::PartitionKnobs;
use plainsight::run::World;
use plainsight::scene::generate::{Knobs, build};
use plainsight::survey::{
    MOST_FOUND, SCENES, SurveyKnobs, Tuned, beyond, contenders, survey, tune,
};

/// Some 6,000 objects.
fn small(tuned: &Tuned) -> World {
    let scale = if tuned.scene == "city250k" { 0.025 } else { 0.03 };
    let knobs = Knobs { scale: Some(scale), frames: Some(12), ..Knobs::default() };
    World::new(build(tuned.scene, &knobs).unwrap(), PartitionKnobs::uncut())
}

/// Every contender with either set of knobs; each frame is held against a look at every box.
#[test]
fn operations_are_as_they_were() {
    let knobs = SurveyKnobs { frames: 12, render_every: 0, check_every: 1 };
    let mut lines = String::new();
    for tuned in SCENES {
        let world = small(tuned);
        for (words, all) in [
            ("thesis", contenders(tuned, true)),
            ("tuned", contenders(tuned, false)),
            ("beyond", beyond(tuned)),
        ] {
            lines += &format!("{} {words}\n", tuned.scene);
            for contender in all {
                let this = survey(&world, &contender, &knobs, &mut || true).unwrap();
                let work = this.work;
                lines += &format!(
                    "  {:<14} found {:>5} of {} nodes {:>5} ok {:>6} updates {:>5} steps {:>6} checks {:>6} {:>6} lowered {:>5}\n",
                    this.contender,
                    this.found,
                    this.actual,
                    this.nodes,
                    work.ok,
                    work.updates,
                    work.steps,
                    work.node_checks,
                    work.object_checks,
                    work.lowered
                );
            }
        }
    }
    insta::assert_snapshot!("survey_work", lines);
}

/// The best trial keeps the rule where any does, and costs the least of those.
#[test]
fn the_search_keeps_the_rule() {
    let tuned = &SCENES[0];
    let world = small(tuned);
    let all = contenders(tuned, false);
    for name in ["2", "3bR DR/OCL", "4"] {
        let contender = all.iter().find(|contender| contender.name == name).unwrap();
        let trials = tune(&world, contender, 4, &mut |_| true);
        assert!(trials.len() > 10, "{name}");
        let (best, kept): (_, Vec<_>) =
            (&trials[0], trials.iter().filter(|trial| trial.ratio() <= MOST_FOUND).collect());
        assert!(best.ratio() <= MOST_FOUND && best.ratio() >= 1.0, "{name}: {}", best.ratio());
        assert!(kept.iter().all(|trial| trial.cost_ns >= best.cost_ns), "{name}");
        assert!(kept.len() < trials.len() || name == "3bR DR/OCL", "{name}: nothing breaks it");
    }
}

fn plainsight(args: &[&str], folder: &std::path::Path) -> (Option<i32>, String, String) {
    let done = Command::new(env!("CARGO_BIN_EXE_plainsight"))
        .args(args)
        .current_dir(folder)
        .output()
        .unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (done.status.code(), text(&done.stdout), text(&done.stderr))
}

#[test]
fn the_verbs_say_so() {
    let folder = tempfile::tempdir().unwrap();
    let small = ["--scale", "0.01", "--frames", "6"];
    let (code, out, talk) =
        plainsight(&[&["compare", "--thesis"], &small[..]].concat(), folder.path());
    assert_eq!(code, Some(0), "{out}{talk}");
    for words in
        ["city250k, seed 1", "4 DR/OCL", "83.47", "lazy grid", "spheres200k", "always finds"]
    {
        assert!(out.contains(words), "{words}: {out}");
    }
    let pictures = ["octree-1", "actual", "octree-4"].map(|name| format!("spheres200k-{name}.png"));
    for name in pictures.iter().map(String::as_str).chain(["surveys.jsonl"]) {
        assert!(folder.path().join("comparison").join(name).exists(), "{name}");
    }
    let few = ["tune", "--scene", "city250k", "--contender", "1", "--json"];
    let (code, out, talk) = plainsight(&[&few[..], &small].concat(), folder.path());
    assert_eq!(code, Some(0), "{talk}");
    let line: serde_json::Value = serde_json::from_str(out.lines().next().unwrap()).unwrap();
    assert_eq!((&line["plainsight"], &line["contender"]), (&"tune".into(), &"1".into()));
    for (args, says) in [
        (&["tune", "--contender", "5"][..], "there are 1, 1 DR, 1 LB, 2"),
        (&["compare", "--thesis", "--scene", "rooms"], "the thesis has city250k and spheres200k"),
        (&["compare", "--thesis", "--culler", "full"], "cannot be used with"),
        (&["compare", "--thesis-knobs"], "--thesis"),
    ] {
        let (code, out, talk) = plainsight(args, folder.path());
        assert_eq!((code, out.as_str()), (Some(2), ""), "{args:?}");
        assert!(talk.contains(says), "{args:?}: {talk}");
    }
}
