//! How many instructions the fast renderer takes for three small fixed works, counted by valgrind's
//! callgrind, and held against the committed counts within one per cent either way. Unlike a time it can
//! gate every change: the count is the same on a busy machine.
//!
//! `cargo bench --bench instructions` compares, with `-- --renew` it writes the counts anew. Exit codes:
//! 0 within the band, 1 outside it, 3 no valgrind or no AVX2.

#![allow(clippy::print_stdout, clippy::print_stderr, clippy::disallowed_methods)]

#[allow(dead_code, reason = "the other bench uses the rest")]
#[path = "../truth/works.rs"]
mod works;

use std::collections::BTreeMap;
use std::process::{Command, ExitCode};

use plainsight_reference::fast::{Options, SimdLevel};
use plainsight_reference::{Image, fast};
use works::Work;

/// Forced, because valgrind knows nothing wider.
const LEVEL: SimdLevel = SimdLevel::Avx2;
/// Share by which a count may differ from the committed one.
const BAND: f64 = 0.01;
const COUNTS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/instructions/counts.json");
const NAMES: [&str; 3] = ["blob", "street", "triangles"];

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    if let [flag, name] = args.as_slice()
        && flag == "--count"
    {
        draw(name);
        return ExitCode::SUCCESS;
    }
    let renew = args.iter().any(|arg| arg == "--renew");
    match compare(renew) {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(3)
        }
    }
}

fn work(name: &str) -> Work {
    match name {
        "blob" => works::blobs("blob", 1),
        "street" => works::street(2_000),
        _ => works::mixed_triangles(20_000, 40),
    }
}

/// What is counted: from both ways of drawing, everything but the building of meshes and images.
fn draw(name: &str) {
    let work = work(name);
    let (instances, mut image) = (work.instances(), Image::new(work.viewport));
    // Everything on this thread, so that no waiting is counted.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    pool.expect("a thread").install(|| {
        for skip_hidden in [true, false] {
            counted_render(&mut image, &instances, Options { level: LEVEL, skip_hidden });
        }
    });
    assert!(image.draw_indices().flatten().count() > 0, "nothing was drawn");
}

#[inline(never)]
fn counted_render(image: &mut Image, instances: &[fast::Instance<'_>], options: Options) {
    fast::render(image, instances, options);
}

fn compare(renew: bool) -> Result<bool, String> {
    if !SimdLevel::available().contains(&LEVEL) {
        return Err(format!("this machine has no {LEVEL}"));
    }
    let mut counts = BTreeMap::new();
    for name in NAMES {
        counts.insert(name.to_owned(), count(name)?);
    }
    if renew {
        let text = serde_json::to_string_pretty(&counts).map_err(|e| e.to_string())? + "\n";
        std::fs::write(COUNTS, text).map_err(|error| format!("{COUNTS}: {error}"))?;
    }
    let text = std::fs::read_to_string(COUNTS).map_err(|error| format!("{COUNTS}: {error}"))?;
    let committed: BTreeMap<String, u64> =
        serde_json::from_str(&text).map_err(|error| format!("{COUNTS}: {error}"))?;
    let mut within = true;
    for (name, &count) in &counts {
        let before = *committed.get(name).ok_or_else(|| format!("{COUNTS}: no {name}"))?;
        let change = count as f64 / before as f64 - 1.0;
        let good = change.abs() <= BAND;
        within &= good;
        let percent = change * 100.0;
        let verdict = if good { "within 1 %" } else { "OUTSIDE 1 %" };
        println!(
            "{name:<10}{count:>12} instructions, committed {before:>12}: {percent:+.3} %, {verdict}"
        );
    }
    if !within {
        println!(
            "find out why; where the change is meant, cargo bench --bench instructions -- --renew"
        );
    }
    Ok(within)
}

/// Instructions that callgrind counts in `counted_render` of one work.
fn count(name: &str) -> Result<u64, String> {
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--callgrind-out-file=/dev/null"])
        .arg("--toggle-collect=*counted_render*")
        .arg(own)
        .args(["--count", name])
        .output()
        .map_err(|error| format!("valgrind: {error}; install it (Debian: valgrind)"))?;
    let talk = String::from_utf8_lossy(&output.stderr);
    if !output.status.success() {
        return Err(format!("valgrind ended with {}: {talk}", output.status));
    }
    let collected = talk.lines().find_map(|line| line.split_once("Collected : "));
    let number = collected.and_then(|(_, number)| number.trim().parse().ok());
    number.filter(|&n| n > 0).ok_or_else(|| format!("valgrind counted nothing: {talk}"))
}
