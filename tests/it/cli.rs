//! The command line as a user meets it: exit codes, one clear line, nothing half-written.

use assert_cmd::Command;

/// Exit code, standard output and standard error of the program. Without `XDG_RUNTIME_DIR`, as in most
/// CI, the driver's Wayland library puts a line of its own on standard error.
pub(crate) fn plainsight(args: &[&str]) -> (i32, String, String) {
    let mut program = Command::cargo_bin("plainsight").unwrap();
    if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
        program.env("XDG_RUNTIME_DIR", std::env::temp_dir());
    }
    let output = program.args(args).output().unwrap();
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

/// The plant's largest mesh takes six MiB and more in parts of so few triangles.
#[test]
fn too_small_a_budget_is_one_line_and_exit_2() {
    for verb in ["run", "replay", "picture", "compare"] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        let out = ["--out", out.to_str().unwrap()];
        let out: &[&str] = if verb == "replay" { &[] } else { &out };
        let scene = [verb, "--scene", "powerplant", "--memory", "1", "--oracle", "sim"];
        let small = SMALL.iter().copied().filter(|&word| verb != "picture" || word != "3");
        let small: Vec<&str> =
            small.filter(|&word| verb != "picture" || word != "--frames").collect();
        let (code, said, talk) = plainsight(&[&scene, &small[..], out].concat());
        assert_eq!(code, 2, "{verb}: {said}{talk}");
        let says = "--memory, powerplant: 1.00 MiB of device memory do not hold the largest mesh; give at least 5 MiB";
        assert!(talk.contains(says), "{verb} said {talk}");
        assert_eq!(talk.lines().count(), 1, "{verb} said {talk}");
        assert!(said.is_empty(), "{verb} wrote {said}");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0, "{verb} left a file");
    }
    let (code, _, talk) = run(&["--scene", "soup", "--prefetch", "1"]);
    assert!(code == 2 && talk.contains("--memory"), "{talk}");
}

/// Memory is told of where it is limited, in every report, and nowhere else.
#[test]
fn memory_is_told_where_it_is_limited() {
    let folder = tempfile::tempdir().unwrap();
    let figures = folder.path().join("figures");
    let scene = ["--scene", "powerplant", "--oracle", "sim", "--culler", "vfc"];
    let limit = ["--memory", "7", "--prefetch", "1"];
    let call = |verb: &str, more: &[&str]| {
        let (code, out, talk) = plainsight(&[&[verb], &scene[..], &SMALL, more].concat());
        assert_eq!(code, 0, "{out}{talk}");
        out
    };
    let (with, without) = (call("run", &limit), call("run", &[]));
    assert!(with.contains("most MiB") && with.contains("powerplant vfc sim"), "{with}");
    assert!(!without.contains("most MiB"), "{without}");
    let row = |out: &str| serde_json::from_str::<serde_json::Value>(out).unwrap();
    let with = row(&call("run", &[&limit[..], &["--json"]].concat()));
    assert_eq!(with["memory_budget_mib"], 7.0);
    for field in
        "most_resident_mib late_loads late_mib prefetches prefetched_mib prefetches_used evictions"
            .split(' ')
    {
        assert!(with["memory"][field].is_number(), "{field} is missing in {with}");
    }
    let most = with["memory"]["most_resident_mib"].as_f64().unwrap();
    assert!(most > 3.5 && most <= 7.0, "{with}");
    assert!(with["memory"]["late_loads"].as_u64() > Some(0), "{with}");
    let without = row(&call("run", &["--json"]));
    assert!(without.get("memory").is_none() && without.get("memory_budget_mib").is_none());
    let (with, without) = (call("replay", &limit), call("replay", &[]));
    let told = |line: &&str| line.contains("MiB resident at most");
    assert_eq!((with.lines().filter(told).count(), without.lines().filter(told).count()), (3, 0));
    let with = call("replay", &[&limit[..], &["--json"]].concat());
    assert!(with.lines().all(|line| row(line)["memory"]["late_loads"].is_u64()), "{with}");
    let out = ["--out", figures.to_str().unwrap()];
    let series = || std::fs::read_to_string(figures.join("series.csv")).unwrap();
    assert!(!call("compare", &out).contains("most MiB"));
    let before = series();
    assert!(call("compare", &[&out[..], &limit].concat()).contains("most MiB"));
    let after = series();
    assert!(before.lines().next().unwrap().ends_with("round_trips"));
    let columns = |line: &str| line.split(',').count();
    let mut lines = before.lines().zip(after.lines());
    assert!(lines.all(|(a, b)| columns(a) + 7 == columns(b)), "{after}");
    let line = call("compare", &[&out[..], &limit, &["--json"]].concat());
    assert!(row(line.trim())["memory"]["evictions"].is_u64(), "{line}");
}

#[test]
fn a_cache_is_filled_used_and_repaired() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("trees");
    let figures = folder.path().join("figures");
    let cached = ["--cache", cache.to_str().unwrap()];
    let scene = ["--scene", "city", "--oracle", "sim", "--culler", "vfc"];
    let row = |more: &[&str]| {
        let (code, out, talk) = run(&[&scene[..], &["--json"], more].concat());
        assert_eq!(code, 0, "{talk}");
        let row: serde_json::Value = serde_json::from_str(&out).unwrap();
        (row["trace_hash"].to_string(), talk)
    };
    let (hash, talk) = row(&[]);
    assert!(talk.is_empty() && !cache.exists(), "{talk}");
    assert_eq!(row(&cached), (hash.clone(), String::new()));
    let first = std::fs::read_dir(&cache).unwrap().next().unwrap().unwrap().path();
    assert_eq!(row(&cached), (hash.clone(), String::new()));
    std::fs::write(&first, "damaged").unwrap();
    let (again, talk) = row(&cached);
    assert_eq!(again, hash);
    assert!(talk.starts_with("WARNING: ") && talk.ends_with("; cut and written anew\n"), "{talk}");
    assert_eq!(talk.lines().count(), 1, "{talk}");
    assert_eq!(row(&cached), (hash, String::new()));
    let out = ["--out", figures.to_str().unwrap()];
    for (more, says) in
        [(&cached[..], "; object trees loaded in "), (&[], "; object trees built in ")]
    {
        let (code, said, talk) =
            plainsight(&[&["compare"], &scene[..], &SMALL, &out, more].concat());
        assert!(code == 0 && said.contains(says), "{said}{talk}");
    }
    let file = folder.path().join("file");
    std::fs::write(&file, "").unwrap();
    for verb in ["run", "replay", "picture", "compare"] {
        let (code, said, talk) = plainsight(&[
            verb,
            "--scene",
            "soup",
            "--scale",
            "0.02",
            "--cache",
            file.to_str().unwrap(),
        ]);
        assert_eq!(code, 2, "{verb}: {said}{talk}");
        let says = format!("{}: cannot write object trees there: ", file.display());
        assert!(talk.contains(&says) && talk.ends_with("; choose another --cache\n"), "{talk}");
        assert_eq!((talk.lines().count(), said.as_str()), (1, ""), "{verb} said {talk}");
    }
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
    assert_eq!(series.lines().count(), 1 + 5 * 3, "a head, five cullers, three frames");
    let (code, again, talk) = call(args("sim", &["--rounds", "3", "--culler", "vfc", "--json"]));
    assert_eq!(code, 0, "{talk}");
    let (code, _, talk) = call(args("sim", &["--rounds", "0"]));
    assert!(code == 2 && talk.contains("--rounds"), "{talk}");
    let (code, said, _) = call(args("sim", &["--json", "--culler", "vfc"]));
    let row: serde_json::Value = serde_json::from_str(said.trim()).unwrap();
    assert_eq!((code, &row["paper_parts"]), (0, &22344.0.into()), "{row}");
    let again: serde_json::Value = serde_json::from_str(again.trim()).unwrap();
    assert_eq!(row["trace_hash"], again["trace_hash"], "rounds repeat what one round does");
    let (code, _, talk) = call(args("sim", &["--cost", "nowhere.toml"]));
    assert!(code == 2 && talk.contains("nowhere.toml"), "{talk}");
    let (code, _, talk) = call(args("sim", &["--full-size"]));
    assert!(code == 2 && talk.contains("--full-size"), "--scale excludes it: {talk}");
}

/// What a stale "hidden" costs is a failure, unless it is declared; a device that goes wrong ends the run.
#[test]
fn lateness_is_declared_and_a_device_that_goes_away_is_exit_3() {
    let scene = |more: &[&str]| {
        let city = ["run", "--scene", "city", "--scale", "0.05", "--frames", "12"];
        let full = ["--viewport", "160x120", "--culler", "full", "--oracle"];
        plainsight(&[&city[..], &full, more].concat())
    };
    let (code, out, _) = scene(&["last-frame"]);
    assert_eq!(code, 1, "{out}");
    let (code, out, _) = scene(&["last-frame", "--late", "12", "--json"]);
    assert_eq!(code, 0, "{out}");
    assert!(out.contains("\"verdict\":\"held late("), "{out}");
    let (code, out, _) = scene(&["sim", "--late", "12", "--json"]);
    assert_eq!((code, out.contains("\"verdict\":\"held\"")), (0, true), "{out}");
    for (what, said) in [("lost=1", "went away"), ("hangs=1", "no answer for 2 s")] {
        let (code, _, err) = scene(&["simulated", "--misbehave", what]);
        assert_eq!(code, 3, "{err}");
        assert!(err.contains(said), "{err}");
    }
    assert_eq!(scene(&["simulated", "--misbehave", "unwritten=2"]).0, 0);
    let (code, _, err) = scene(&["simulated", "--misbehave", "sulks"]);
    assert_eq!(code, 2);
    assert!(err.contains("write lost=N"), "{err}");
}
