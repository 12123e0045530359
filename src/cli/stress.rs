//! `stress`: worlds by the thousand, each picked by its seed, each judged by every check.

use std::io::{BufRead, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;
use serde_json::{Value, json};

use super::args::quoted;
use super::progress::progress_bar;
use super::run::{Oracles, catch_interrupt, exit_of, interrupted, pick_cullers};
use super::watchdog::{FrameLimit, Hung, SharedFile, Watchdog};
use super::{CliError, EXIT_FAILED, OutFile, Streams};
use crate::check::{Check, Ruling};
use crate::cull::{Culler, CullerKind, CullerSetup, DrawAll, Pen, View};
use crate::oracle::{Oracle, OracleError, Questions, Stage};
use crate::report::{difference_picture, picture_png};
use crate::run::{Canary, FrameState, Truth, caught, render};
use crate::scene::{Scene, Viewport, to_toml};
use crate::stress::{
    Choice, Device, Judged, Outcome, REPEATED_ONE_IN, Shard, Shrunk, Tally, VERSION, judged,
    judged_in, seed_of, shrink, size,
};

/// Seeds of a sweep where nothing is said.
const DEFAULT_SEEDS: (u64, u64) = (0, 1000);
/// Worlds between two looks at the clock and at Ctrl-C; they run on all cores.
const CHUNK: usize = 64;
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
    /// Fail as well where some situation was never reached.
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
    #[command(flatten)]
    frame_limit: FrameLimit,
    /// Makes every world wrong on purpose, to see that the failure arrives; see `run --canary`.
    #[arg(long, value_name = "CHECK")]
    canary: Option<Canary>,
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
    /// The device.
    Lost,
}

/// A sweep over seeds.
struct Sweep<'a> {
    args: &'a StressArgs,
    cullers: Vec<CullerKind>,
    real: Vec<Questions>,
    oracles: Oracles,
    /// What became of worlds of the chunk at hand, for a watchdog that ends the sweep.
    done: Arc<Mutex<Vec<Outcome>>>,
}

/// Locks outcomes: the list is whole at every moment, also after a panic elsewhere.
fn locked(done: &Mutex<Vec<Outcome>>) -> MutexGuard<'_, Vec<Outcome>> {
    done.lock().unwrap_or_else(PoisonError::into_inner)
}

/// What a seed picks among these cullers and devices.
fn choice(args: &StressArgs, seed: u64, cullers: &[CullerKind], real: &[Questions]) -> Choice {
    Choice { canary: args.canary, ..Choice::of(seed, cullers, real) }
}

impl Sweep<'_> {
    /// An oracle of the real device.
    fn real(&self, stage: &Stage, questions: Questions) -> Result<Box<dyn Oracle>, OracleError> {
        self.oracles.stage(stage, 0)?.make(questions.name())
    }

    /// The world of a choice; a panic in it, and a device that is not there, are outcomes like any other.
    fn judged(&self, choice: &Choice) -> Outcome {
        let real = |stage: &Stage, questions| self.real(stage, questions);
        match caught(|| judged(choice, &real)) {
            Ok(Ok(outcome)) => outcome,
            Ok(Err(error)) => Outcome::unrun(choice, Check::Lost, &error.to_string()),
            Err(said) => Outcome::unrun(choice, Check::Panic, &said),
        }
    }

    /// The world of a seed.
    fn world(&self, seed: u64) -> Outcome {
        let outcome = self.judged(&choice(self.args, seed, &self.cullers, &self.real));
        let outcome = Outcome { replay: replay(self.args, seed), ..outcome };
        locked(&self.done).push(outcome.clone());
        outcome
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
            let outcomes: Vec<Outcome> = match self.real.is_empty() {
                true => chunk.par_iter().map(|&seed| self.world(seed)).collect(),
                false => chunk.iter().map(|&seed| self.world(seed)).collect(),
            };
            locked(&self.done).clear();
            for outcome in outcomes {
                each(&outcome)?;
                bar.inc(1);
                if outcome.ruling() == Ruling::Lost {
                    return Ok(End::Lost);
                }
            }
        }
    }
}

impl Sweep<'_> {
    /// Makes the world of a failing seed smaller and leaves it in `folder`.
    fn shrink(&self, seed: u64, folder: &Path, to: &mut dyn Write) -> Result<(), CliError> {
        let mut choice = choice(self.args, seed, &self.cullers, &self.real);
        let real = |stage: &Stage, questions| self.real(stage, questions);
        let scene = choice.scene()?;
        let start = Instant::now();
        let first_failure = |choice: &Choice, scene: &Scene| {
            let late = start.elapsed() >= SHRINK_TIME || interrupted();
            let run = || judged_in(choice, scene.clone(), &real);
            match (late, caught(run)) {
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
        let judged = caught(|| judged_in(&choice, small, &real));
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
        match choice.policy {
            None => {
                // What was run twice may be what failed.
                let twice = if seed.is_multiple_of(REPEATED_ONE_IN) { " --rounds 2" } else { "" };
                writeln!(to, "  replay: plainsight run --scene {file}{}{twice}", choice.flags())?;
            }
            // The scene file stands alone, but no flag of `run` sets a policy of `full`.
            Some(_) => writeln!(
                to,
                "  replay: {} (fails by the policy of full alone, for which run has no flags)",
                replay(self.args, seed)
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

/// The line that runs a seed again.
fn replay(args: &StressArgs, seed: u64) -> String {
    let mut line = format!("plainsight stress --seed {seed}");
    let mut add = |name: &str, values: &[String]| {
        if !values.is_empty() {
            line += &format!(" --{name} {}", quoted(&values.join(",")));
        }
    };
    add("culler", &args.culler);
    add("oracle", &args.oracle);
    add("adapter", args.adapter.as_slice());
    add("canary", &args.canary.map(|canary| canary.to_string()).into_iter().collect::<Vec<_>>());
    line + &args.frame_limit.replay_flags()
}

/// What must come of each canary but those that hang or look like others.
const CANARY_RULINGS: [(Canary, Check); 10] = [
    (Canary::Set, Check::Set),
    (Canary::Image, Check::Image),
    (Canary::DeviceImage, Check::DeviceImage),
    (Canary::Determinism, Check::Determinism),
    (Canary::Counts, Check::Counts),
    (Canary::Truth, Check::Truth),
    (Canary::Panic, Check::Panic),
    (Canary::Unrepeatable, Check::Repeatable),
    (Canary::Lost, Check::Lost),
    (Canary::SetThenLost, Check::Set),
];

impl Sweep<'_> {
    /// Runs worlds that must fail, and do if failures are reported at all: a culler that draws nothing, where
    /// something shows, and one for each check, that is wrong in one way only. Each goes where the sweep's own
    /// worlds go, up to the exit code. Says the first that was not reported.
    fn silent_canary(&self) -> Result<Option<String>, CliError> {
        let blind = |_: CullerSetup| Box::new(Blind) as Box<dyn Culler>;
        let whole = |setup: CullerSetup| Box::new(DrawAll::new(setup)) as Box<dyn Culler>;
        let kind = |name, make| CullerKind { name, summary: "", asks: false, make };
        // Small, plain, and so that something shows: seeds in which nothing does prove nothing.
        let plain = |seed: u64, culler: CullerKind| Choice {
            frames: 3,
            viewport: Viewport { width: 97, height: 61 },
            device: Device::Sim,
            ..Choice::of(seed, &[culler], &[])
        };
        let seed = (0..CANARIES)
            .find(|&seed| self.judged(&plain(seed, kind("blind", blind))).visible > 0)
            .ok_or_else(|| CliError::Usage("no world of the swarm shows anything".to_owned()))?;
        let own = |(canary, check): (Canary, Check)| {
            let choice = Choice { canary: Some(canary), ..plain(seed, kind("whole", whole)) };
            (format!("one wrong by '{canary}'"), choice, check)
        };
        let blind = plain(seed, kind("blind", blind));
        let blind = ("a culler that draws nothing".to_owned(), blind, Check::Set);
        for (name, choice, check) in [blind].into_iter().chain(CANARY_RULINGS.map(own)) {
            let outcome = self.judged(&choice);
            let named = format!("{}: ", check.name());
            let said = outcome.failures.iter().any(|line| line.starts_with(&named));
            let mut tally = Tally::default();
            tally.add(&outcome);
            let code = conclude(false, &tally, &mut std::io::sink())?;
            if !said || code != exit_of(check.ruling()) {
                return Ok(Some(name));
            }
        }
        Ok(None)
    }
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
        return conclude(args.every_probe, &tally, streams.out);
    }
    let out = SharedFile::new(args.out.as_deref().map(OutFile::create).transpose()?);
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
    let sweep = Sweep { args, cullers, real, oracles, done: Arc::default() };
    let watchdog = sweep.watched(&out);
    if let Some(canary) = sweep.silent_canary()? {
        writeln!(streams.out, "FAILED: the canary, {canary}, was not reported")?;
        return Ok(EXIT_FAILED);
    }
    let (mut tally, start) = (Tally::default(), Instant::now());
    let ran = sweep.run(shard.seeds(from, to), &bar, &mut |outcome| {
        tally.add(outcome);
        if tally.failed > 0 {
            bar.set_message(format!("{} FAILED", tally.failed));
        }
        let line = Sweep::line(outcome);
        if args.json {
            bar.suspend(|| writeln!(streams.out, "{line}"))?;
        }
        out.line(&line)
    });
    drop(watchdog);
    bar.finish_and_clear();
    let end = ran?;
    let seconds = start.elapsed().as_secs_f64();
    let to_talk = &mut *streams.talk;
    let sink: &mut dyn Write = if args.json { to_talk } else { &mut *streams.out };
    let rest = match end {
        End::Seeds => "",
        End::Time => "; the time was up before all seeds were run",
        End::Interrupted => "; interrupted",
        End::Lost => "; the device was lost",
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
    let code = conclude(args.every_probe, &tally, sink)?;
    let failure = tally.failures.first().filter(|outcome| outcome.ruling() == Ruling::Failed);
    if let (Some(folder), Some(failure)) = (&args.shrink, failure) {
        sweep.shrink(failure.seed, folder, sink)?;
    }
    out.finish(b"")?;
    Ok(if end == End::Interrupted { super::EXIT_INTERRUPTED } else { code })
}

impl Sweep<'_> {
    /// A watchdog over the sweep: where a world hangs, the lines of the others are kept, with its own.
    fn watched(&self, out: &SharedFile) -> Watchdog {
        let (args, cullers, real) = (self.args.clone(), self.cullers.clone(), self.real.clone());
        let (done, out) = (Arc::clone(&self.done), out.clone());
        let keep = move |hung: &mut Hung| {
            hung.replay = replay(&args, hung.seed);
            let choice = choice(&args, hung.seed, &cullers, &real);
            let failures = hung.failures.clone();
            let own = Outcome::unrun(&choice, Check::Hang, "");
            let own = Outcome { failures, replay: hung.replay.clone(), ..own };
            let mut outcomes = locked(&done).clone();
            outcomes.sort_by_key(|outcome| outcome.seed);
            for outcome in outcomes.iter().chain([&own]) {
                let line = Sweep::line(outcome);
                // The process ends as failed in any case.
                if args.json {
                    let _ = writeln!(std::io::stdout(), "{line}");
                }
                let _ = out.line(&line);
            }
            let _ = out.finish(b"");
        };
        Watchdog::start(&self.args.frame_limit, keep)
    }
}

/// What a sweep came to.
fn conclude(every_probe: bool, tally: &Tally, to: &mut dyn Write) -> Result<u8, CliError> {
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
        let word = failure.ruling().word().to_uppercase();
        writeln!(to, "{word}: seed {}: {}; {}", failure.seed, failure.scene, failure.options)?;
        failure.failures.iter().try_for_each(|line| writeln!(to, "  {line}"))?;
        writeln!(to, "  replay: {}", failure.replay)?;
    }
    let never = tally.never_reached();
    if every_probe {
        never.iter().try_for_each(|probe| writeln!(to, "NEVER REACHED: {probe}"))?;
    }
    let missing = every_probe && !never.is_empty();
    let ruling = if missing { Ruling::Failed } else { tally.ruling };
    writeln!(
        to,
        "verdict: {ruling} ({} of {} worlds held)",
        tally.worlds - tally.failed - tally.device_at_fault,
        tally.worlds
    )?;
    Ok(exit_of(ruling))
}
