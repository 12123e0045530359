//! `stress`: worlds by the thousand, each picked by its seed, each judged by every check.

use std::io::BufRead;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::args::quoted;
use super::progress::progress_bar;
use super::run::{Oracles, catch_interrupt, interrupted, pick_cullers};
use super::{CliError, EXIT_FAILED, EXIT_HELD, OutFile, Streams};
use crate::cull::{Culler, CullerKind, CullerSetup, Pen, View};
use crate::oracle::{Oracle, OracleError, Questions, Stage};
use crate::report::{difference_picture, picture_png};
use crate::run::{FrameState, RunError, Truth, render};
use crate::scene::{Scene, to_toml};
use crate::stress::{
    Choice, Judged, Outcome, Shard, Shrunk, Tally, VERSION, judged, judged_in, seed_of, shrink,
    size,
};

/// Seeds of a sweep where nothing is said.
const DEFAULT_SEEDS: (u64, u64) = (0, 1000);
/// Worlds between two looks at the clock and at Ctrl-C; they run on all cores.
const CHUNK: usize = 64;
/// Members and pairs of them that are named for coming up the least.
const RAREST: usize = 6;
/// Failing seeds said in full.
const SAID_FAILURES: usize = 5;
/// Seeds looked at for a world in which something shows.
const CANARIES: u64 = 100;
/// Shrinking ends with what it has after this time.
const SHRINK_TIME: Duration = Duration::from_secs(120);

#[derive(Args, Clone)]
pub(super) struct StressArgs {
    /// Seeds from A to B, B left out.
    #[arg(long, value_name = "A..B", value_parser = range, conflicts_with = "seed")]
    seeds: Option<(u64, u64)>,
    /// One seed: a number, or a commit's hash of 40 digits.
    #[arg(long, value_name = "SEED", value_parser = seed_of)]
    seed: Option<u64>,
    /// This machine's share of the seeds, i from 0 (default: what GitLab, CircleCI, Buildkite, Azure, Slurm
    /// arrays and Kubernetes' indexed jobs say, else all).
    #[arg(long, value_name = "i/n", conflicts_with = "seed")]
    shard: Option<Shard>,
    /// Start no world after this time: 90s, 10m, 2h.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    budget: Option<Duration>,
    /// Cullers to pick from (default: all).
    #[arg(long, value_name = "CULLER", num_args = 1.., value_delimiter = ',')]
    culler: Vec<String>,
    /// Real devices to pick from: hardware, pyramid, read-back (default: none; worlds run on sim,
    /// hierarchical-z or the simulated device).
    #[arg(long, value_name = "ORACLE", num_args = 1.., value_delimiter = ',')]
    oracle: Vec<String>,
    /// Part of the name of the Vulkan adapter to use.
    #[arg(long)]
    adapter: Option<String>,
    /// Fail as well where some situation was never reached, or some member or pair of members was picked too
    /// seldom.
    #[arg(long)]
    every_probe: bool,
    /// Make the first failing world as small as it goes, and leave it in this folder: a scene file that
    /// stands alone, a picture of the pixels that are missing, the line that runs it.
    #[arg(long, value_name = "FOLDER")]
    shrink: Option<PathBuf>,
    /// Add up the lines of these files, that sweeps wrote with --out, and run nothing.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["seeds", "seed", "shard", "budget", "out"])]
    merge: Vec<PathBuf>,
    /// One JSON object a world on standard output in place of the summary.
    #[arg(long)]
    json: bool,
    /// Also write the JSON lines to this file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

fn range(text: &str) -> Result<(u64, u64), String> {
    let ends = text.split_once("..").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    match ends {
        Some((from, to)) if from < to => Ok((from, to)),
        _ => Err("write A..B, A below B, as in 0..1000".to_owned()),
    }
}

fn duration(text: &str) -> Result<Duration, String> {
    let wrong = || "write a number with s, m or h, as in 90s, 10m or 2h".to_owned();
    let (number, unit) =
        text.split_at(text.len() - text.chars().next_back().map_or(0, char::len_utf8));
    let factor = match unit {
        "s" => 1.0,
        "m" => 60.0,
        "h" => 3600.0,
        _ => return Err(wrong()),
    };
    let number: f64 = number.parse().map_err(|_| wrong())?;
    Duration::try_from_secs_f64(number * factor).map_err(|_| wrong())
}

/// What ended a sweep.
#[derive(Clone, Copy, PartialEq)]
enum End {
    /// All seeds were run.
    Seeds,
    /// The budget.
    Time,
    /// Ctrl-C.
    Interrupted,
}

/// A sweep over seeds.
struct Sweep<'a> {
    args: &'a StressArgs,
    cullers: Vec<CullerKind>,
    real: Vec<Questions>,
    oracles: Oracles,
}

impl Sweep<'_> {
    /// An oracle of the real device.
    fn real(&self, stage: &Stage, questions: Questions) -> Result<Box<dyn Oracle>, OracleError> {
        self.oracles.stage(stage, 0)?.make(questions.name())
    }

    /// The world of a seed; a panic in it is a failure like any other.
    fn world(&self, seed: u64) -> Result<Outcome, RunError> {
        let choice = Choice::of(seed, &self.cullers, &self.real);
        let real = |stage: &Stage, questions| self.real(stage, questions);
        catch_unwind(AssertUnwindSafe(|| judged(&choice, &real))).unwrap_or_else(|panic| {
            let said = panic
                .downcast_ref::<String>()
                .map(String::as_str)
                .or_else(|| panic.downcast_ref::<&str>().copied())
                .unwrap_or("without a word");
            let said = said.lines().next().unwrap_or("");
            Ok(Outcome::panicked(&choice, said))
        })
    }

    fn replay(&self, seed: u64) -> String {
        let mut line = format!("plainsight stress --seed {seed}");
        let mut add = |name: &str, values: &[String]| {
            if !values.is_empty() {
                line += &format!(" --{name} {}", quoted(&values.join(",")));
            }
        };
        add("culler", &self.args.culler);
        add("oracle", &self.args.oracle);
        add("adapter", self.args.adapter.as_slice());
        line
    }

    fn line(outcome: &Outcome) -> String {
        let mut line = serde_json::to_value(outcome).unwrap_or(Value::Null);
        line["plainsight"] = json!("stress");
        line["version"] = json!(VERSION);
        line.to_string()
    }

    /// Runs the seeds in order, chunk by chunk, until they, the time or the user's patience end.
    fn run(
        &self,
        mut seeds: impl Iterator<Item = u64>,
        bar: &ProgressBar,
        each: &mut dyn FnMut(&Outcome) -> Result<(), CliError>,
    ) -> Result<End, CliError> {
        let start = Instant::now();
        loop {
            if interrupted() {
                return Ok(End::Interrupted);
            }
            if self.args.budget.is_some_and(|budget| start.elapsed() >= budget) {
                return Ok(End::Time);
            }
            // A real device is one: its worlds run one after the other.
            let size = if self.real.is_empty() { CHUNK } else { 1 };
            let chunk: Vec<u64> = seeds.by_ref().take(size).collect();
            if chunk.is_empty() {
                return Ok(End::Seeds);
            }
            let outcomes: Vec<Result<Outcome, RunError>> = match self.real.is_empty() {
                true => chunk.par_iter().map(|&seed| self.world(seed)).collect(),
                false => chunk.iter().map(|&seed| self.world(seed)).collect(),
            };
            for outcome in outcomes {
                let outcome = outcome?;
                let replay = self.replay(outcome.seed);
                each(&Outcome { replay, ..outcome })?;
                bar.inc(1);
            }
        }
    }
}

impl Sweep<'_> {
    /// Makes the world of a failing seed smaller and leaves it in `folder`.
    fn shrink(
        &self,
        seed: u64,
        folder: &Path,
        to: &mut dyn std::io::Write,
    ) -> Result<(), CliError> {
        let mut choice = Choice::of(seed, &self.cullers, &self.real);
        let real = |stage: &Stage, questions| self.real(stage, questions);
        let scene = choice.scene()?;
        let start = Instant::now();
        let first_failure = |choice: &Choice, scene: &Scene| {
            let late = start.elapsed() >= SHRINK_TIME || interrupted();
            let run = || judged_in(choice, scene.clone(), &real);
            match (late, catch_unwind(AssertUnwindSafe(run))) {
                (true, _) => None,
                (false, Ok(judged)) => judged.ok().and_then(|judged| judged.outcome.failed_in),
                // A panic comes no earlier than it comes.
                (false, Err(_)) => Some(scene.frames - 1),
            }
        };
        let mut step = 0;
        while let Some(simpler) = choice.simpler(step) {
            if first_failure(&simpler, &scene).is_some() {
                choice = simpler;
            }
            step += 1;
        }
        let mut fails = |scene: &Scene| first_failure(&choice, scene);
        let Some(Shrunk { scene: small, tried }) = shrink(&scene, &mut fails) else {
            writeln!(to, "seed {seed} does not fail when run again: nothing to shrink")?;
            return Ok(());
        };
        let leaf_triangles = choice.partition.leaf_triangles;
        let small = Scene { name: format!("seed-{seed}"), leaf_triangles, ..small };
        std::fs::create_dir_all(folder)
            .map_err(|source| CliError::Write { path: folder.display().to_string(), source })?;
        let file = folder.join(format!("seed-{seed}.toml"));
        OutFile::create(&file)?.finish(to_toml(&small).as_bytes())?;
        let [before, after] = [&scene, &small].map(size);
        writeln!(
            to,
            "shrunk from {} objects, {} frames, {} triangles to {}, {}, {} in {tried} tries and {:.1} s: {}",
            before.0,
            before.1,
            before.2,
            after.0,
            after.1,
            after.2,
            start.elapsed().as_secs_f64(),
            file.display()
        )?;
        let judged = catch_unwind(AssertUnwindSafe(|| judged_in(&choice, small, &real)));
        if let Ok(Ok(Judged { outcome, world, wrong: Some((moment, drawn)) })) = judged {
            let state = FrameState::at(&world, moment);
            let truth = Truth::of(&world, &state);
            let mut image = world.image();
            render(&world, &state, &drawn, &mut image);
            let picture = file.with_extension("png");
            let missing = difference_picture(&world, &truth.image, &image);
            OutFile::create(&picture)?.finish(&picture_png(&missing))?;
            outcome.failures.iter().try_for_each(|line| writeln!(to, "  {line}"))?;
            writeln!(to, "  picture: {}", picture.display())?;
        }
        let file = quoted(&file.display().to_string());
        match choice.beyond_flags().as_slice() {
            [] => writeln!(to, "  replay: plainsight run --scene {file}{}", choice.flags())?,
            // The scene file stands alone, but no flag of `run` sets these.
            needed => writeln!(
                to,
                "  replay: {} (fails by {} alone, for which run has no flags)",
                self.replay(seed),
                needed.join(", ")
            )?,
        }
        Ok(())
    }
}

/// A culler that draws nothing.
struct Blind;

impl Culler for Blind {
    fn name(&self) -> &str {
        "blind"
    }

    fn frame(&mut self, _: &View<'_>, _: &mut Pen<'_>) -> Result<(), OracleError> {
        Ok(())
    }
}

/// Worlds that must fail, and do if failures are reported at all: a culler that draws nothing, where
/// something shows. The first seeds in which nothing shows prove nothing and are passed over.
fn canary() -> Result<bool, CliError> {
    let make = |_: CullerSetup| Box::new(Blind) as Box<dyn Culler>;
    let blind = CullerKind { name: "blind", summary: "draws nothing", asks: false, make };
    for seed in 0..CANARIES {
        let choice = Choice::of(seed, &[blind], &[]);
        let outcome = judged(&choice, &|_, _| unreachable!("no real device is named"))?;
        if outcome.visible > 0 {
            return Ok(!outcome.failures.is_empty());
        }
    }
    Ok(false)
}

/// Adds up the lines of files.
pub(super) fn merged(files: &[PathBuf]) -> Result<Tally, CliError> {
    let mut tally = Tally::default();
    for path in files {
        let refuse = |place: &str, what: String| {
            CliError::Usage(format!("{}{place}: {what}", path.display()))
        };
        let file = std::fs::File::open(path).map_err(|error| refuse("", error.to_string()))?;
        for (number, line) in (1..).zip(std::io::BufReader::new(file).lines()) {
            let place = format!(" line {number}");
            let line = line.map_err(|error| refuse(&place, error.to_string()))?;
            let value: Value = serde_json::from_str(&line).map_err(|_| {
                refuse(&place, "is no JSON; give files that stress --out wrote".to_owned())
            })?;
            if value["plainsight"] != json!("stress") || value["version"] != json!(VERSION) {
                let what = format!(
                    "is no line of stress, version {VERSION}; give files that stress --out wrote"
                );
                return Err(refuse(&place, what));
            }
            let outcome: Outcome =
                serde_json::from_value(value).map_err(|error| refuse(&place, error.to_string()))?;
            tally.add(&outcome);
        }
    }
    Ok(tally)
}

pub(super) fn stress(
    args: &StressArgs,
    cullers: &[CullerKind],
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    if !args.merge.is_empty() {
        let tally = merged(&args.merge)?;
        return conclude(args, &tally, streams.out);
    }
    let mut out = args.out.as_deref().map(OutFile::create).transpose()?;
    Oracles::known(&args.oracle)?;
    let real: Vec<Questions> = args.oracle.iter().filter_map(|name| Questions::of(name)).collect();
    if real.len() < args.oracle.len() {
        return Err(CliError::Usage(
            "--oracle names real devices here: hardware, pyramid, read-back; without it worlds run on the others".to_owned(),
        ));
    }
    let cullers = match args.culler.is_empty() {
        true => cullers.to_vec(),
        false => pick_cullers(&args.culler, cullers)?,
    };
    // No real device is opened where none is asked for.
    let names = if real.is_empty() { vec!["sim".to_owned()] } else { args.oracle.clone() };
    let adapter = args.adapter.as_deref().filter(|_| !real.is_empty());
    let oracles = Oracles::open(&names, adapter, streams)?;
    let shard = match args.shard {
        Some(shard) => shard,
        None => Shard::of_environment(|name| std::env::var(name).ok())
            .map_err(|error| CliError::Usage(error.to_string()))?,
    };
    let (from, to) = match args.seed {
        Some(seed) => (seed, seed + 1),
        None => args.seeds.unwrap_or(DEFAULT_SEEDS),
    };
    let shard = if args.seed.is_some() { Shard::WHOLE } else { shard };
    catch_interrupt();
    let bar = progress_bar();
    bar.set_style(
        ProgressStyle::with_template(
            "{msg:<20} {bar:30} {human_pos}/{human_len} worlds, {per_sec}, {eta} left",
        )
        .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar.set_length((to - from).div_ceil(shard.count));
    let sweep = Sweep { args, cullers, real, oracles };
    if !canary()? {
        writeln!(streams.out, "FAILED: the canary, a culler that draws nothing, was not reported")?;
        return Ok(EXIT_FAILED);
    }
    let (mut tally, start) = (Tally::default(), Instant::now());
    let ran = sweep.run(shard.seeds(from, to), &bar, &mut |outcome| {
        tally.add(outcome);
        if !outcome.failures.is_empty() {
            bar.set_message(format!("{} FAILED", tally.failed));
        }
        let line = Sweep::line(outcome);
        if args.json {
            bar.suspend(|| writeln!(streams.out, "{line}"))?;
        }
        if let Some(out) = &mut out {
            out.line(&line)?;
        }
        Ok(())
    });
    bar.finish_and_clear();
    let end = ran?;
    let seconds = start.elapsed().as_secs_f64();
    let to_talk = &mut *streams.talk;
    let sink: &mut dyn std::io::Write = if args.json { to_talk } else { &mut *streams.out };
    let rest = match end {
        End::Seeds => "",
        End::Time => "; the time was up before all seeds were run",
        End::Interrupted => "; interrupted",
    };
    writeln!(
        sink,
        "seeds {from}..{to}, shard {shard}: {} worlds in {seconds:.1} s, {:.0} a second{rest}",
        tally.worlds,
        tally.worlds as f64 / seconds.max(1e-9)
    )?;
    if args.seed.is_some()
        && let Some(only) = &tally.worst_excess
    {
        writeln!(sink, "seed {}: {}; {}", only.seed, only.scene, only.options)?;
    }
    let code = conclude(args, &tally, sink)?;
    if let (Some(folder), Some(failure)) = (&args.shrink, tally.failures.first()) {
        sweep.shrink(failure.seed, folder, sink)?;
    }
    if let Some(out) = out {
        out.finish(b"")?;
    }
    Ok(if end == End::Interrupted { super::EXIT_INTERRUPTED } else { code })
}

/// What a sweep came to.
fn conclude(args: &StressArgs, tally: &Tally, to: &mut dyn std::io::Write) -> Result<u8, CliError> {
    writeln!(
        to,
        "{} worlds, {} frames, {} worlds run twice",
        tally.worlds, tally.shots, tally.repeated
    )?;
    writeln!(to, "situations, with the worlds that reached them:")?;
    // Of a single world what it did not reach says nothing.
    let said = |count: u64| count > 0 || tally.worlds > 1;
    for (probe, count) in tally.probes().into_iter().filter(|&(_, count)| said(count)) {
        writeln!(to, "  {count:>9}  {probe}")?;
    }
    if tally.worlds > 1 {
        let members = tally.members();
        let said = members.iter().take(RAREST).map(|(count, member)| format!("{member} {count}"));
        let said = said.collect::<Vec<_>>().join(", ");
        writeln!(to, "rarest of {} members: {said}", members.len())?;
        let pairs = tally.pairs();
        let said = pairs.iter().take(RAREST).map(|(n, [a, b])| format!("{a} with {b} {n}"));
        let said = said.collect::<Vec<_>>().join(", ");
        writeln!(to, "rarest of {} pairs: {said}", pairs.len())?;
    }
    let mut worst = |what: &str, outcome: &Option<Outcome>, figure: &dyn Fn(&Outcome) -> f64| {
        outcome.as_ref().map_or(Ok(()), |o| {
            writeln!(
                to,
                "{what}: seed {}, {:.1} a frame: {}; {}",
                o.seed,
                figure(o),
                o.scene,
                o.options
            )
        })
    };
    let a_frame = |sum: u64, o: &Outcome| sum as f64 / f64::from(o.shots.max(1));
    worst("most parts in vain", &tally.worst_excess, &|o| {
        a_frame(o.drawn.saturating_sub(o.visible), o)
    })?;
    worst("most questions", &tally.most_queries, &|o| a_frame(o.queries, o))?;
    for failure in tally.failures.iter().take(SAID_FAILURES) {
        writeln!(to, "FAILED: seed {}: {}; {}", failure.seed, failure.scene, failure.options)?;
        failure.failures.iter().try_for_each(|line| writeln!(to, "  {line}"))?;
        writeln!(to, "  replay: {}", failure.replay)?;
    }
    let (never, rare) = (tally.never_reached(), tally.rare());
    if args.every_probe {
        never.iter().try_for_each(|probe| writeln!(to, "NEVER REACHED: {probe}"))?;
        rare.iter().try_for_each(|line| writeln!(to, "TOO RARE: {line}"))?;
    }
    let reached = never.is_empty() && rare.is_empty();
    let held = tally.failed == 0 && (reached || !args.every_probe);
    let word = if held { "held" } else { "failed" };
    writeln!(
        to,
        "verdict: {word} ({} of {} worlds held)",
        tally.worlds - tally.failed,
        tally.worlds
    )?;
    Ok(if held { EXIT_HELD } else { EXIT_FAILED })
}
