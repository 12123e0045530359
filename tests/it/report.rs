//! The report page, opened in a headless Chromium as a user would: its figures are those of the run, its
//! scrubber moves them, and it looks like something.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Names that browsers go by; `tests/run.sh` installs the first with apt.
const BROWSERS: [&str; 6] = [
    "chromium-headless-shell",
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "headless_shell",
];
/// Names another browser.
const BROWSER: &str = "PLAINSIGHT_CHROMIUM";

fn browser() -> PathBuf {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let named = std::env::var_os(BROWSER).map(PathBuf::from);
    let found = std::env::split_paths(&path)
        .flat_map(|folder| BROWSERS.map(|name| folder.join(name)))
        .find(|file| file.is_file());
    named.or(found).unwrap_or_else(|| {
        panic!(
            "no Chromium is found; install one (Debian, Ubuntu: apt-get install chromium-headless-shell, \
or chromium) or name it with {BROWSER}; tests/run.sh does"
        )
    })
}

/// What the browser prints, with more arguments, of a page.
fn browse(url: &str, more: &[&str]) -> String {
    let profile = tempfile::tempdir().unwrap();
    let done = Command::new(browser())
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"])
        .arg(format!("--user-data-dir={}", profile.path().display()))
        .args(more)
        .arg(url)
        .output()
        .unwrap();
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    String::from_utf8(done.stdout).unwrap()
}

fn report(folder: &Path, args: &[&str]) -> (i32, String) {
    let done = Command::new(env!("CARGO_BIN_EXE_plainsight"))
        .args(["report", "--scene", "rooms", "--scale", "0.05", "--frames", "4"])
        .args(["--viewport", "96x64", "--oracle", "sim", "--out"])
        .arg(folder.join("report.html"))
        .args(args)
        .output()
        .unwrap();
    let said = String::from_utf8(done.stdout).unwrap() + &String::from_utf8(done.stderr).unwrap();
    (done.status.code().unwrap(), said)
}

/// The JSON in the page of the one scene.
fn data(html: &str) -> serde_json::Value {
    let from = html.split("class=\"data\">").nth(1).unwrap();
    serde_json::from_str(from.split("</script>").next().unwrap()).unwrap()
}

/// The figures that a lane's row shows.
fn shown(dom: &str, lane: usize) -> Vec<String> {
    let row = dom.split(&format!("<tr data-lane=\"{lane}\">")).nth(1).unwrap();
    let row = row.split("</tr>").next().unwrap();
    let cells = row.split("<td data-figure=\"\">").skip(1);
    cells.map(|cell| cell.split("</td>").next().unwrap().to_owned()).collect()
}

#[test]
fn the_page_shows_the_runs_figures_and_scrubs() {
    let folder = tempfile::tempdir().unwrap();
    let (code, said) = report(folder.path(), &[]);
    assert_eq!(code, 0, "{said}");
    assert!(said.contains("held (3 of 3 lanes held)"), "{said}");
    let file = folder.path().join("report.html");
    let html = std::fs::read_to_string(&file).unwrap();
    assert!(
        !html.contains("http://")
            || html.matches("http://").count()
                == html.matches("http://www.w3.org/2000/svg").count(),
        "it loads nothing"
    );
    let data = data(&html);
    let url = format!("file://{}", file.display());
    for frame in [0, 3] {
        let dom = browse(&format!("{url}#rooms@{frame}"), &["--dump-dom"]);
        assert!(dom.contains(&format!("frame {frame}</output>")), "the scrubber is at {frame}");
        for lane in 0..3 {
            let figures = &data["lanes"][lane]["frames"][frame];
            let expected: Vec<&str> =
                figures.as_array().unwrap().iter().map(|figure| figure.as_str().unwrap()).collect();
            assert_eq!(shown(&dom, lane), expected, "lane {lane} frame {frame}");
        }
        let picture = data["pictures"][frame]["truth"].as_str().unwrap();
        let source = format!("src=\"data:image/png;base64,{picture}\"");
        assert!(dom.contains(&source), "the truth of frame {frame} is shown");
    }
    // The same figures as the run's own lines.
    let run = Command::new(env!("CARGO_BIN_EXE_plainsight"))
        .args(["run", "--scene", "rooms", "--scale", "0.05", "--frames", "4", "--json"])
        .args(["--viewport", "96x64", "--oracle", "sim", "--culler", "full"])
        .output()
        .unwrap();
    let line = String::from_utf8(run.stdout).unwrap();
    let row: serde_json::Value = serde_json::from_str(line.lines().next().unwrap()).unwrap();
    let frames = data["lanes"][0]["frames"].as_array().unwrap();
    let sum = |figure: usize| -> u64 {
        frames.iter().map(|f| f[figure].as_str().unwrap().parse::<u64>().unwrap()).sum()
    };
    assert_eq!(row["queries"].as_u64(), Some(sum(3)), "{row}");
}

/// A screenshot has the verdict's green, and pictures of many colours, on a wide and on a narrow screen.
#[test]
fn the_page_looks_like_something() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(report(folder.path(), &[]).0, 0);
    let url = format!("file://{}", folder.path().join("report.html").display());
    for (width, height) in [(1200, 900), (400, 1600)] {
        let picture = folder.path().join("screen.png");
        let (size, to) = (
            format!("--window-size={width},{height}"),
            format!("--screenshot={}", picture.display()),
        );
        browse(&url, &[&size, &to]);
        let screen = image::open(&picture).unwrap().to_rgb8();
        assert_eq!(screen.dimensions(), (width, height));
        let green = screen.pixels().filter(|p| p.0 == [0x13, 0x73, 0x33]).count();
        assert!(green > 20, "{green} pixels of the verdict's green at {width}");
        let mut colors: Vec<[u8; 3]> = screen.pixels().map(|p| p.0).collect();
        colors.sort_unstable();
        colors.dedup();
        assert!(colors.len() > 100, "{} colours at {width}", colors.len());
    }
}

#[test]
fn sweeps_and_accuracy_are_gathered_and_bad_input_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let lines = folder.path().join("sweep.jsonl");
    let swept = Command::new(env!("CARGO_BIN_EXE_plainsight"))
        .args(["stress", "--seeds", "0..20", "--out"])
        .arg(&lines)
        .output()
        .unwrap();
    assert!(swept.status.success());
    std::fs::write(folder.path().join("findings.md"), "# Words <of> findings").unwrap();
    std::fs::write(folder.path().join("rooms.svg"), "<svg class=\"own\"></svg>").unwrap();
    let (sweep, own) = (lines.display().to_string(), folder.path().display().to_string());
    let args = ["--no-pictures", "--stress", &sweep, "--accuracy", &own];
    let (code, said) = report(folder.path(), &args);
    assert_eq!(code, 0, "{said}");
    let html = std::fs::read_to_string(folder.path().join("report.html")).unwrap();
    for part in
        ["20 worlds", "most questions", "plainsight stress --seed", "Words &lt;of&gt; findings"]
    {
        assert!(html.contains(part), "{part}");
    }
    assert!(html.contains("<svg class=\"own\">") && !html.contains("<img"));
    let (code, said) = report(folder.path(), &["--accuracy", "nowhere"]);
    assert_eq!(code, 2);
    assert!(
        said.contains("nowhere/findings.md") && said.contains("plainsight accuracy --out"),
        "{said}"
    );
}
