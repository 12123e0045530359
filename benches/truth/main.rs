//! How quick the truth is: the fast renderer beside lavapipe on the same work in one run, and beside the
//! naive renderer. Images are compared before a time is printed.
//!
//! `cargo bench --bench truth` prints the table, with `-- --json` one object a line; `-- --help` has the
//! rest.

#![allow(clippy::print_stdout, clippy::print_stderr, clippy::disallowed_methods)]

mod lavapipe;
#[allow(dead_code, reason = "other benches use the rest")]
mod works;

use std::time::{Duration, Instant};

use clap::Parser;
use plainsight_reference::fast::{Options, SimdLevel};
use plainsight_reference::{Image, Viewport, fast, naive};
use serde::Serialize;

use lavapipe::Lavapipe;
use works::Work;

/// The fast renderer beside lavapipe and the naive renderer, on equal work.
#[derive(Parser)]
struct Args {
    /// Works to run, of A1, A100, A300, B, C1 and C2; all by default.
    #[arg(long = "work", value_name = "NAME")]
    works: Vec<String>,
    /// Timed frames of each, after one that is left out, or more where they are short; the median
    /// counts.
    #[arg(long, default_value_t = 7)]
    frames: usize,
    /// Frames of lavapipe, likewise.
    #[arg(long, default_value_t = 5)]
    peer_frames: usize,
    /// Vector instructions; the widest of the machine by default.
    #[arg(long)]
    simd: Option<SimdLevel>,
    /// Leaves lavapipe out.
    #[arg(long)]
    alone: bool,
    /// Leaves the naive renderer out; images are then compared among the fast ways only.
    #[arg(long)]
    no_naive: bool,
    /// Also how time grows with threads, work, pixels and vectors.
    #[arg(long)]
    scaling: bool,
    /// Only draws so many frames of the works, for a profiler; nothing is timed or compared.
    #[arg(long, value_name = "FRAMES")]
    profile: Option<usize>,
    /// With --profile: leaves hidden clusters out.
    #[arg(long)]
    skip: bool,
    /// With --profile: threads.
    #[arg(long, default_value_t = 1)]
    threads: usize,
    /// One JSON object a line on standard output.
    #[arg(long)]
    json: bool,
    /// Given by cargo; without meaning.
    #[arg(long, hide = true)]
    bench: bool,
}

/// Version of the JSON lines.
const SCHEMA: u32 = 1;

/// MaskedOcclusionCulling and lavapipe on two threads, as published with this bench's targets on another
/// machine; only their ratio is used, for orientation.
const MASKED: [(&str, f64, f64); 4] =
    [("A100", 76.0, 370.0), ("A300", 225.0, 970.0), ("C1", 26.0, 356.0), ("C2", 1.4, 135.0)];

/// One line of the table; times in milliseconds.
#[derive(Serialize)]
struct Row {
    schema: u32,
    kind: &'static str,
    work: &'static str,
    what: &'static str,
    triangles: usize,
    width: u32,
    height: u32,
    simd: String,
    covered: usize,
    hash: String,
    naive_ms: Option<f64>,
    lavapipe_ms: Option<f64>,
    /// Share of samples at which lavapipe shows another object.
    lavapipe_differs: Option<f64>,
    /// Two threads, every triangle.
    brute_ms: f64,
    /// One thread, every triangle.
    brute_one_thread_ms: f64,
    /// Two threads, hidden clusters left out.
    skip_ms: f64,
    triangles_processed_brute: u64,
    triangles_processed_skip: u64,
    times_lavapipe_brute: Option<f64>,
    times_lavapipe_skip: Option<f64>,
    times_masked_brute: Option<f64>,
    two_threads_over_one: f64,
    memory_mib: f64,
}

fn main() {
    let args = Args::parse();
    if let Err(error) = run(&args) {
        eprintln!("error: {error}");
        std::process::exit(2);
    }
}

fn run(args: &Args) -> Result<(), String> {
    let names: Vec<&str> = if args.works.is_empty() {
        Work::NAMES.to_vec()
    } else {
        args.works.iter().map(String::as_str).collect()
    };
    if let Some(wrong) = names.iter().find(|name| !Work::NAMES.contains(name)) {
        return Err(format!("no work {wrong:?}; the works are {}", Work::NAMES.join(", ")));
    }
    let level = args.simd.unwrap_or_else(SimdLevel::best);
    if !SimdLevel::available().contains(&level) {
        return Err(format!("this machine has no {level}"));
    }
    if let Some(frames) = args.profile {
        for name in names {
            let work = Work::named(name).expect("a known name");
            let (instances, mut image) = (work.instances(), Image::new(work.viewport));
            let options = Options { level, skip_hidden: args.skip };
            let start = Instant::now();
            let draw = || fast::render(&mut image, &instances, options);
            let done =
                pool(args.threads).install(|| std::iter::repeat_with(draw).nth(frames.max(1) - 1));
            let time = start.elapsed().as_secs_f64() * 1e3 / frames.max(1) as f64;
            println!("{name}: {time:.3} ms, {:?}", done.unwrap_or_default());
        }
        return Ok(());
    }
    if !args.json {
        println!(
            "{:<5}{:>12}{:>10}{:>10}{:>10}{:>10}{:>10}{:>8}{:>8}{:>8}{:>7}{:>8}",
            "work",
            "triangles",
            "naive",
            "lavapipe",
            "1 thread",
            "2 threads",
            "skip",
            "× lp",
            "skip ×",
            "× MOC",
            "2 / 1",
            "MiB"
        );
    }
    for name in names {
        let work = Work::named(name).expect("a known name");
        let row = measure(args, &work, level)?;
        if args.json {
            println!("{}", serde_json::to_string(&row).map_err(|e| e.to_string())?);
        } else {
            let or_dash = |value: Option<f64>, places: usize| {
                value.map_or_else(|| "–".to_owned(), |value| format!("{value:.places$}"))
            };
            println!(
                "{:<5}{:>12}{:>10}{:>10}{:>10.2}{:>10.2}{:>10.2}{:>8}{:>8}{:>8}{:>7.2}{:>8.1}",
                row.work,
                row.triangles,
                or_dash(row.naive_ms, 0),
                or_dash(row.lavapipe_ms, 1),
                row.brute_one_thread_ms,
                row.brute_ms,
                row.skip_ms,
                or_dash(row.times_lavapipe_brute, 1),
                or_dash(row.times_lavapipe_skip, 1),
                or_dash(row.times_masked_brute, 1),
                row.two_threads_over_one,
                row.memory_mib
            );
        }
    }
    if args.scaling {
        scaling(args, level)?;
    }
    Ok(())
}

fn pool(threads: usize) -> rayon::ThreadPool {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads start")
}

/// Short calls are repeated for this long, so that sleeping cores are awake and one interruption does
/// not count.
const AT_LEAST: Duration = Duration::from_millis(400);
/// But not more often than this.
const AT_MOST: usize = 500;

/// Milliseconds of the median of at least `frames` calls after a first one.
fn median(frames: usize, mut call: impl FnMut()) -> f64 {
    call();
    let begin = Instant::now();
    let mut times = Vec::new();
    while times.len() < frames.max(1) || (begin.elapsed() < AT_LEAST && times.len() < AT_MOST) {
        let start = Instant::now();
        call();
        times.push(start.elapsed().as_secs_f64() * 1e3);
    }
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn measure(args: &Args, work: &Work, level: SimdLevel) -> Result<Row, String> {
    let instances = work.instances();
    let (one, two) = (pool(1), pool(2));
    let brute = Options { level, skip_hidden: false };
    let skip = Options { level, skip_hidden: true };
    let before = memory::reset();
    let mut image = Image::new(work.viewport);
    let done = two.install(|| fast::render(&mut image, &instances, brute));
    let memory_mib = memory::peak_since(before);
    let (hash, covered) = (image.hash(), image.draw_indices().flatten().count());
    // The counts and hashes first.
    if covered == 0 || done.triangles + done_outside(&done) < work.triangle_count() as u64 {
        return Err(format!("{}: not every triangle was processed: {done:?}", work.name));
    }
    let mut other = Image::new(work.viewport);
    let less = two.install(|| fast::render(&mut other, &instances, skip));
    let same = |image: &Image, way: &str| {
        let equal = image.hash() == hash;
        equal.then_some(()).ok_or_else(|| format!("{}: {way} draws another image", work.name))
    };
    same(&other, "leaving hidden clusters out")?;
    one.install(|| fast::render(&mut other, &instances, brute));
    same(&other, "one thread")?;
    let naive_ms = if args.no_naive {
        None
    } else {
        let start = Instant::now();
        other.clear();
        work.draws().for_each(|draw| naive::draw(&mut other, &draw));
        let time = start.elapsed().as_secs_f64() * 1e3;
        same(&other, "naive")?;
        Some(time)
    };
    let mut lavapipe_ms = None;
    let mut lavapipe_differs = None;
    if !args.alone {
        let peer = Lavapipe::new(work)?;
        let per_object = work.triangles.len() as u32;
        let objects = peer.objects()?;
        let ours = image.draw_indices().map(|draw| draw.map_or(0, |draw| draw / per_object + 1));
        let differ = ours.zip(&objects).filter(|(ours, theirs)| ours != *theirs).count();
        let share = differ as f64 / objects.len() as f64;
        if share > 0.01 {
            return Err(format!("{}: lavapipe differs at {differ} samples", work.name));
        }
        lavapipe_differs = Some(share);
        let mut trouble = Ok(());
        lavapipe_ms = Some(median(args.peer_frames, || {
            if let Err(error) = peer.frame() {
                trouble = Err(error);
            }
        }));
        trouble?;
        if !args.json {
            eprintln!("{}: {}, differs at {differ} samples", work.name, peer.name);
        }
    }
    let time = |pool: &rayon::ThreadPool, options: Options, image: &mut Image| {
        pool.install(|| {
            median(args.frames, || {
                fast::render(image, &instances, options);
            })
        })
    };
    let brute_one_thread_ms = time(&one, brute, &mut image);
    let brute_ms = time(&two, brute, &mut image);
    let skip_ms = time(&two, skip, &mut image);
    let masked = MASKED.iter().find(|(name, ..)| *name == work.name);
    Ok(Row {
        schema: SCHEMA,
        kind: "work",
        work: work.name,
        what: work.what,
        triangles: work.triangle_count(),
        width: work.viewport.width,
        height: work.viewport.height,
        simd: level.to_string(),
        covered,
        hash: format!("{hash:016x}"),
        naive_ms,
        lavapipe_ms,
        lavapipe_differs,
        brute_ms,
        brute_one_thread_ms,
        skip_ms,
        triangles_processed_brute: done.triangles,
        triangles_processed_skip: less.triangles,
        times_lavapipe_brute: lavapipe_ms.map(|ms| ms / brute_ms),
        times_lavapipe_skip: lavapipe_ms.map(|ms| ms / skip_ms),
        times_masked_brute: masked
            .and_then(|(_, moc, lp)| lavapipe_ms.map(|ms| ms * moc / lp / brute_ms)),
        two_threads_over_one: brute_one_thread_ms / brute_ms,
        memory_mib,
    })
}

/// Triangles of clusters outside the view, at least.
fn done_outside(work: &fast::Work) -> u64 {
    work.clusters_outside * 80
}

fn scaling(args: &Args, level: SimdLevel) -> Result<(), String> {
    let line = |what: String, work: &Work, level: SimdLevel, threads: usize| {
        let instances = work.instances();
        let mut image = Image::new(work.viewport);
        let options = |skip_hidden| Options { level, skip_hidden };
        let pool = pool(threads);
        let mut time = |skip| {
            let mut call = || {
                fast::render(&mut image, &instances, options(skip));
            };
            pool.install(|| median(args.frames, &mut call))
        };
        let (brute_ms, skip_ms) = (time(false), time(true));
        if args.json {
            let row = serde_json::json!({
                "schema": SCHEMA, "kind": "scaling", "what": what, "work": work.name,
                "triangles": work.triangle_count(), "width": work.viewport.width,
                "height": work.viewport.height, "simd": level.to_string(), "threads": threads,
                "brute_ms": brute_ms, "skip_ms": skip_ms,
            });
            println!("{row}");
        } else {
            println!("{what:<28}{brute_ms:>10.2} ms every triangle{skip_ms:>10.2} ms skipping");
        }
    };
    for name in ["A300", "B", "C1", "C2"] {
        let work = Work::named(name).ok_or("a known name")?;
        for threads in [1, 2] {
            line(format!("{name}, {threads} thread(s)"), &work, level, threads);
        }
        for level in SimdLevel::available() {
            line(format!("{name}, {level}"), &work, level, 2);
        }
    }
    for (name, count) in [("work × 1", 3), ("work × 10", 30), ("work × 100", 300)] {
        line(format!("{name}: {count} blobs"), &works::blobs("blobs", count), level, 2);
    }
    for times in [1, 2, 4] {
        let mut work = works::blobs("A100", 100);
        work.viewport = Viewport { width: 640 * times, height: 512 * times };
        line(format!("pixels × {}: A100", times * times), &work, level, 2);
    }
    Ok(())
}

/// Resident memory, where the system tells (Linux).
mod memory {
    fn field(name: &str) -> Option<f64> {
        let status = std::fs::read_to_string("/proc/self/status").ok()?;
        let line = status.lines().find(|line| line.starts_with(name))?;
        line.split_whitespace().nth(1)?.parse().ok()
    }

    /// Forgets the peak so far; KiB resident now.
    pub(super) fn reset() -> Option<f64> {
        std::fs::write("/proc/self/clear_refs", "5").ok()?;
        field("VmRSS:")
    }

    /// MiB that the peak lies above `before`; 0 where the system does not tell.
    pub(super) fn peak_since(before: Option<f64>) -> f64 {
        let peak = before.and_then(|before| Some(field("VmHWM:")? - before));
        peak.unwrap_or(0.0).max(0.0) / 1024.0
    }
}
