//! `calibrate` as a user meets it: the file it writes is the one that `--cost` reads, whole or not at
//! all. Its figures are this machine's and are compared with nothing.

use plainsight::oracle::CostModel;

use crate::cli::{SMALL, plainsight};

fn calibrate(more: &[&str]) -> (i32, String, String) {
    let fixed = ["calibrate", "--scene", "bunnies", "--workloads", "16", "--rounds", "1"];
    plainsight(&[&fixed, more, &SMALL].concat())
}

#[test]
fn the_file_is_written_and_read_back() {
    let folder = tempfile::tempdir().unwrap();
    for oracle in ["sim", "hardware", "pyramid"] {
        let path = folder.path().join(format!("{oracle} here.toml"));
        let file = path.to_str().unwrap();
        let (code, out, talk) = calibrate(&["--oracle", oracle, "--out", file]);
        assert_eq!((code, talk.as_str()), (0, ""), "{out}");
        for words in ["triangle", "pixel", "95th percentile", file] {
            assert!(out.contains(words), "{words} is missing in {out}");
        }
        let model = CostModel::open(file).unwrap();
        assert_eq!(model.name, format!("{oracle} here"));
        let says = ["16 workloads", "160 x 120", "bunnies seed 1", "in the median"];
        for words in says.iter().chain(&[oracle]) {
            assert!(model.source.contains(words), "{words} is missing in {}", model.source);
        }
        assert!(model.frame_ns + model.triangle_ns > 0.0, "{model:?}");
        let run = ["run", "--scene", "bunnies", "--culler", "full-adaptive", "--oracle", "sim"];
        let (code, out, talk) = plainsight(&[&run[..], &["--cost", file], &SMALL].concat());
        assert_eq!(code, 0, "{out}{talk}");
    }
    let left = std::fs::read_dir(folder.path()).unwrap().count();
    assert_eq!(left, 3, "nothing but the files");
}

#[test]
fn json_is_one_object_with_the_model_of_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.toml");
    let file = path.to_str().unwrap();
    let (code, out, _) = calibrate(&["--oracle", "sim", "--out", file, "--json"]);
    let said: serde_json::Value = serde_json::from_str(out.trim()).unwrap();
    assert_eq!((code, &said["measurements"], &said["rounds"]), (0, &16.into(), &1.into()));
    assert!(said["error_median"].as_f64() <= said["error_p95"].as_f64(), "{said}");
    let model: CostModel = serde_json::from_value(said["model"].clone()).unwrap();
    assert_eq!(
        (model.name.as_str(), model.source),
        ("mine", CostModel::open(file).unwrap().source)
    );
}

#[test]
fn bad_arguments_are_one_line_and_leave_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("cal.toml");
    let out = out.to_str().unwrap();
    let cases: [(&[&str], i32, &str); 9] = [
        (&["--oracle", "delphi"], 2, "no oracle is called 'delphi'"),
        (&["--oracle", "always"], 2, "--oracle always takes no time"),
        (&["--oracle", "sim", "--memory", "64"], 2, "no price for loading"),
        (&["--oracle", "sim", "--proxy", "box"], 2, "rectangles are measured"),
        (&["--oracle", "sim", "--proxy", "hull"], 2, "rectangles are measured"),
        (&["--oracle", "sim", "--cost", "other.toml"], 2, "none is read"),
        (&["--oracle", "sim", "--mesh", "missing.obj"], 2, "missing.obj"),
        (&["--oracle", "sim", "--index", "heap"], 2, "no index is called 'heap'"),
        (&["--adapter", "no such adapter"], 3, "no adapter is called"),
    ];
    for (args, exit, says) in cases {
        let (code, said, talk) = calibrate(&[args, &["--out", out]].concat());
        assert_eq!(code, exit, "{args:?}: {said}{talk}");
        assert!(talk.contains(says) && talk.lines().count() == 1, "{args:?} said {talk}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "{args:?}");
    }
    let (code, _, talk) = calibrate(&["--oracle", "sim", "--out", "/nonexistent/cal.toml"]);
    assert!(code == 2 && talk.contains("cannot write"), "{talk}");
    let few = ["calibrate", "--oracle", "sim", "--workloads", "3", "--out", out];
    assert_eq!(plainsight(&few).0, 2, "three workloads do not tell seven prices apart");
}
