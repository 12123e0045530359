//! The gate on trial: every seeded fault is caught, and nothing is said of what is not broken. `plainsight
//! faults` does the same with more seeds, and runs unbroken cullers over every hard scene.

use insta::assert_snapshot;
use plainsight::fault::{Evidence, Fault, Harm, Trial, faults};
use rayon::prelude::*;

/// The trial of a fault's scenes in turn, up to the first that shows it.
fn evidence(fault: &Fault) -> Vec<Evidence> {
    let mut all = Vec::new();
    for scene in fault.scenes {
        let trial = Trial::new(fault, scene, 1, None).unwrap();
        all.push(trial.run(fault, &mut || true).unwrap());
        if all.iter().any(Evidence::caught) {
            break;
        }
    }
    all
}

#[test]
fn every_fault_is_caught_and_nothing_else() {
    let faults = faults();
    let tried: Vec<Vec<Evidence>> = faults.par_iter().map(evidence).collect();
    let mut table = String::new();
    for (fault, tried) in faults.iter().zip(&tried) {
        let alarms: Vec<&String> = tried.iter().flat_map(|e| &e.false_alarms).collect();
        assert!(alarms.is_empty(), "{}: {alarms:?}", fault.sound.name);
        let last = tried.last().expect("a fault has scenes");
        assert!(last.caught(), "{} got through: {}", fault.name, fault.summary);
        // Never by anything but what it does.
        let wrong = last.checks.iter().any(|check| ["set", "image", "partition"].contains(check));
        assert_eq!(wrong, fault.harm == Harm::Drops, "{}: {:?}", fault.name, last.lines);
        assert_eq!(last.picture.is_some(), wrong, "{}: a wrong picture has a pixel", fault.name);
        table += &format!("{:>2} {}: {}\n", fault.bug, fault.name, last.checks.join(" "));
    }
    assert_snapshot!(table);
}

/// The swarm finds faults by itself, and says how many seeds it takes.
#[test]
fn the_swarm_finds_faults_and_says_how_soon() {
    let run = |args: &[&str]| {
        let done = std::process::Command::new(env!("CARGO_BIN_EXE_plainsight"))
            .args(["faults", "--swarm"])
            .args(args)
            .output()
            .unwrap();
        (done.status.code(), String::from_utf8(done.stdout).unwrap())
    };
    let (code, said) = run(&["32", "--fault", "two-corners,late-answer"]);
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("the swarm caught 2 of 2"), "{said}");
    // Too few seeds for a rare one: it is said, and fails.
    let (code, said) = run(&["1", "--fault", "root-sticks-out"]);
    assert_eq!(code, Some(1), "{said}");
    assert!(said.contains("NEVER") && said.contains("caught 0 of 1"), "{said}");
}
