//! The command line as a user meets it: exit codes, one clear line, nothing half-written.

use assert_cmd::Command;

/// Exit code, standard output and standard error of the program.
pub(crate) fn plainsight(args: &[&str]) -> (i32, String, String) {
    let output = Command::cargo_bin("plainsight").unwrap().args(args).output().unwrap();
    let text = |bytes: Vec<u8>| String::from_utf8(bytes).unwrap();
    (output.status.code().unwrap(), text(output.stdout), text(output.stderr))
}

/// Flags that make any scene small enough for debug builds.
pub(crate) const SMALL: [&str; 8] =
    ["--scale", "0.02", "--frames", "3", "--viewport", "160x120", "--leaf", "256"];

fn run(more: &[&str]) -> (i32, String, String) {
    plainsight(&[&["run"], more, &SMALL].concat())
}

#[test]
fn bad_input_is_one_line_and_exit_2() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str, text: &str| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).unwrap();
        path.into_os_string().into_string().unwrap()
    };
    let empty = file("empty.obj", "");
    let nan = file("nan.obj", "v 0 0 0\nv NaN 0 0\nv 0 1 0\nf 1 2 3\n");
    let range = file("range.obj", "v 0 0 0\nv 1 0 0\nf 1 2 3\n");
    let broken = file("broken.toml", "version = 1\ngenerator = \n");
    let missing = folder.path().join("missing.obj").into_os_string().into_string().unwrap();
    let cases: [(&[&str], &str); 10] = [
        (&["--scene", "nowhere"], "no scene is called 'nowhere'"),
        (&["--scene", "bunnies", "--mesh", &empty], "empty.obj: holds no faces"),
        (&["--scene", "model", "--mesh", &nan], "nan.obj: line 2: 'NaN' is no finite number"),
        (&["--scene", "model", "--mesh", &range], "range.obj: line 3: face names vertex 3"),
        (&["--scene", "model", "--mesh", &missing], "missing.obj: "),
        (&["--scene", &broken], "broken.toml: line 2"),
        (&["--scene", "soup", "--culler", "nobody"], "no culler is called 'nobody'"),
        (&["--scene", "soup", "--oracle", "delphi"], "no oracle is called 'delphi'"),
        (&["--scene", "soup", "--index", "heap"], "no index is called 'heap'"),
        (&["--scene", "soup", "--out", "/nonexistent/x.json"], "cannot write"),
    ];
    for (args, says) in cases {
        let (code, out, talk) = run(args);
        assert_eq!(code, 2, "{args:?}: {out}{talk}");
        assert!(talk.contains(says), "{args:?} said {talk}");
        assert_eq!(talk.lines().count(), 1, "{args:?} said {talk}");
        assert!(out.is_empty(), "{args:?} wrote {out}");
    }
    let (code, _, talk) =
        plainsight(&["run", "--scene", "soup", "--frames", "0", "--oracle", "sim"]);
    assert!(code == 2 && talk.contains("--frames must be from 1"), "{talk}");
}

#[test]
fn a_failed_run_leaves_no_file() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("rows.json");
    let (code, _, _) = run(&["--scene", "nowhere", "--out", out.to_str().unwrap()]);
    assert_eq!(code, 2);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}

#[test]
fn json_lines_hold_the_promised_fields() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("rows.json");
    let (code, out, talk) = run(&["--scene", "rooms", "--json", "--out", file.to_str().unwrap()]);
    assert_eq!(code, 0, "{talk}");
    assert_eq!(std::fs::read_to_string(file).unwrap(), out);
    let rows: Vec<serde_json::Value> =
        out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(rows.len(), 6);
    for row in &rows {
        for field in
            "schema scene seed frames culler oracle device objects parts triangles must_missed \
            image_equal device_image_equal drawn_parts visible_parts queries round_trips wall_ms \
            trace_hash verdict"
                .split_ascii_whitespace()
        {
            assert!(row.get(field).is_some(), "{field} is missing in {row}");
        }
        let hardware = row["oracle"] == "hardware";
        assert_eq!(row["device"].is_string(), hardware, "{row}");
        assert_eq!(
            row["device_image_equal"],
            if hardware { true.into() } else { serde_json::Value::Null }
        );
        assert_eq!((&row["verdict"], &row["must_missed"]), (&"held".into(), &0.into()));
    }
}

#[test]
fn threads_do_not_move_the_trace_hash() {
    let hash = |threads: &str| {
        let output = Command::cargo_bin("plainsight")
            .unwrap()
            .env("RAYON_NUM_THREADS", threads)
            .args(["run", "--scene", "soup", "--json"])
            .args(SMALL)
            .output()
            .unwrap();
        let out = String::from_utf8(output.stdout).unwrap();
        let row = |line: &str| serde_json::from_str::<serde_json::Value>(line).unwrap();
        out.lines().map(|line| row(line)["trace_hash"].to_string()).collect::<Vec<_>>()
    };
    assert_eq!(hash("1"), hash("2"));
    assert_eq!(hash("2").len(), 6);
}

#[test]
fn without_a_device_the_default_says_so_and_hardware_exits_3() {
    let without = |args: &[&str]| {
        Command::cargo_bin("plainsight")
            .unwrap()
            .env("VK_DRIVER_FILES", "/nonexistent.json")
            .env_remove("VK_ICD_FILENAMES")
            .args(args)
            .args(SMALL)
            .output()
            .unwrap()
    };
    let output = without(&["run", "--scene", "soup"]);
    let talk = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(0), "{talk}");
    assert!(talk.contains("WARNING: no Vulkan device"), "{talk}");
    let output = without(&["run", "--scene", "soup", "--oracle", "hardware"]);
    assert_eq!(output.status.code(), Some(3));
    assert!(String::from_utf8(output.stderr).unwrap().contains("mesa-vulkan-drivers"));
}

#[test]
fn list_and_help_are_results() {
    let (code, out, _) = plainsight(&["list"]);
    assert!(code == 0 && out.contains("bunnies") && out.contains("two-level-bsp"));
    let (code, out, _) = plainsight(&["--help"]);
    assert!(code == 0 && out.contains("Exit codes"));
    let (code, _, talk) = plainsight(&["rum"]);
    assert!(code == 2 && talk.contains("run"), "{talk}");
}

#[test]
fn compare_sets_the_paper_beside_its_own_and_draws_the_figures() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("figures");
    let args = |oracle: &'static str, more: &[&'static str]| {
        let fixed = ["compare", "--scene", "bunnies", "--oracle", oracle, "--out"];
        [&fixed[..], &[out.to_str().unwrap()], &SMALL, more]
            .concat()
            .iter()
            .map(|&word| word.to_owned())
            .collect::<Vec<String>>()
    };
    let call = |args: Vec<String>| plainsight(&args.iter().map(String::as_str).collect::<Vec<_>>());
    let (code, said, talk) = call(args("sim", &[]));
    assert_eq!(code, 0, "{talk}");
    for words in ["depth complexity", "826", "14408", "ceiling", "simple ÷ full in queries"] {
        assert!(said.contains(words), "{words} is missing in {said}");
    }
    for stem in ["time", "fps", "parts", "queries"] {
        let svg = std::fs::read_to_string(out.join(format!("bunnies-{stem}.svg"))).unwrap();
        assert!(svg.starts_with("<svg") && svg.contains("simple") && svg.ends_with("</svg>\n"));
        let png = image::open(out.join(format!("bunnies-{stem}.png"))).unwrap();
        assert!(png.width() >= 600);
    }
    let series = std::fs::read_to_string(out.join("series.csv")).unwrap();
    assert_eq!(series.lines().count(), 1 + 3 * 3, "a head, three cullers, three frames");
    let (code, said, _) = call(args("sim", &["--json", "--culler", "vfc"]));
    let row: serde_json::Value = serde_json::from_str(said.trim()).unwrap();
    assert_eq!((code, &row["paper_parts"]), (0, &22344.0.into()), "{row}");
    let (code, _, talk) = call(args("sim", &["--cost", "nowhere.toml"]));
    assert!(code == 2 && talk.contains("nowhere.toml"), "{talk}");
    let (code, _, talk) = call(args("sim", &["--full-size"]));
    assert!(code == 2 && talk.contains("--full-size"), "--scale excludes it: {talk}");
}
