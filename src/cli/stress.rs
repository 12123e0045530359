//! `stress`: worlds by the thousand, each picked by its seed, each judged by every check.

use std::io::Write;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use super::args::quoted;
use super::files::Files;
use super::merge::{self, Merged, merged};
use super::out_file::OutFolder;
use super::progress::progress_bar;
use super::run::{Oracles, exit_of, pick_cullers};
use super::signals::{catch_interrupt, interrupted};
use super::watchdog::{FrameLimit, Hung, SharedFile, Watchdog};
use super::{CliError, EXIT_FAILED, EXIT_HELD, EXIT_USAGE, Outputs, Streams};
use crate::check::{Check, Ruling};
use crate::cull::{Culler, CullerKind, CullerSetup, DrawAll, Pen, View};
use crate::oracle::{Oracle, OracleError, Questions, Stage};
use crate::report::{difference_picture, picture_png};
use crate::run::{Canary, FrameState, RunError, Truth, caught, render};
use crate::scene::{Scene, Viewport, to_toml};
use crate::stress::{
    Choice, Device, Judged, Outcome, REPEATED_ONE_IN, Shard, Shrunk, Source, Tally, judged,
    judged_in, seed_of, shrink, size,
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
    /// Add up the lines of these files, that sweeps wrote with --out, and run nothing. What is there twice is
    /// refused; what is missing is named, and the exit code is 2 at best.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with_all = ["seeds", "seed", "shard", "budget", "out"])]
    merge: Vec<PathBuf>,
    /// With --merge: missing shards and seeds are named, and the exit code is that of what is there.
    #[arg(long, requires = "merge")]
    partial: bool,
    /// One JSON object a world on standard output in place of the summary.
    #[arg(long)]
    json: bool,
    /// Also write the JSON lines to this file, once the sweep ends; `-` is standard output, which has each
    /// line as it comes, and the summary goes to standard error.
    #[arg(long, value_name = "FILE|-")]
    out: Option<PathBuf>,
    #[command(flatten)]
    frame_limit: FrameLimit,
    /// Makes every world wrong on purpose, to see that the failure arrives; see `run --canary`.
    #[arg(long, value_name = "CHECK")]
    canary: Option<Canary>,
}

impl StressArgs {
    pub(super) fn files(&self) -> Files {
        Files::default()
            .reading("--merge", self.merge.iter().map(PathBuf::as_path))
            .writing("--out", self.out.as_deref())
            .json(self.json)
    }

    /// The flags that decide what a seed is, each preceded by a space.
    fn flags(&self) -> String {
        let mut flags = String::new();
        let mut add = |name: &str, values: &[String]| {
            if !values.is_empty() {
                flags += &format!(" --{name} {}", quoted(&values.join(",")));
            }
        };
        add("culler", &self.culler);
        add("oracle", &self.oracle);
        add("adapter", self.adapter.as_slice());
        add(
            "canary",
            &self.canary.map(|canary| canary.to_string()).into_iter().collect::<Vec<_>>(),
        );
        flags
    }
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
    /// A signal.
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
            // A signal does not wait for the worlds that are still to come.
            let world = |&seed: &u64| (!interrupted()).then(|| self.world(seed));
            let outcomes: Vec<Option<Outcome>> = match self.real.is_empty() {
                true => chunk.par_iter().map(world).collect(),
                false => chunk.iter().map(world).collect(),
            };
            locked(&self.done).clear();
            for outcome in outcomes.into_iter().flatten() {
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
    fn shrink(
        &self,
        seed: u64,
        (folder, outputs): (&OutFolder, &mut Outputs<'_>),
        to: &mut dyn Write,
    ) -> Result<(), CliError> {
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
        let name = format!("seed-{seed}.toml");
        folder.file(outputs, &name)?.finish(to_toml(&small).as_bytes())?;
        let file = folder.path().join(name);
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
            let name = format!("seed-{seed}.png");
            folder.file(outputs, &name)?.finish(&picture_png(&missing))?;
            outcome.failures.iter().try_for_each(|line| writeln!(to, "  {line}"))?;
            writeln!(to, "  picture: {}", picture.display())?;
        }
        let file = quoted(&file.display().to_string());
        match choice.beyond_flags().as_slice() {
            [] => {
                // What was run twice may be what failed.
                let twice = if seed.is_multiple_of(REPEATED_ONE_IN) { " --rounds 2" } else { "" };
                writeln!(to, "  replay: plainsight run --scene {file}{}{twice}", choice.flags())?;
            }
            // The scene file stands alone, but no flag of `run` sets these.
            needed => writeln!(
                to,
                "  replay: {} (fails by {} alone, for which run has no flags)",
                replay(self.args, seed),
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

/// The line that runs a seed again.
fn replay(args: &StressArgs, seed: u64) -> String {
    format!("plainsight stress --seed {seed}{}{}", args.flags(), args.frame_limit.replay_flags())
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
            device: Device::Plain(Source::Sim),
            scale: 1.0,
            memory: None,
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
            let code = conclude((false, false), &tally, &[], &mut std::io::sink())?;
            if !said || code != exit_of(check.ruling()) {
                return Ok(Some(name));
            }
        }
        Ok(None)
    }
}

/// Adds up what others ran.
fn merge_files(args: &StressArgs, streams: &mut Streams<'_>) -> Result<u8, CliError> {
    let Merged { tally, missing } = merged(&args.merge)?;
    let code = conclude((args.every_probe, args.partial), &tally, &missing, streams.out)?;
    Ok(if code == EXIT_HELD && !missing.is_empty() && !args.partial { EXIT_USAGE } else { code })
}

pub(super) fn stress(
    args: &StressArgs,
    cullers: &[CullerKind],
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    if !args.merge.is_empty() {
        return merge_files(args, streams);
    }
    let out = args.out.as_deref().map(|path| outputs.file("--out", path)).transpose()?;
    let mut out = SharedFile::new(out);
    let folder = args.shrink.as_deref().map(|path| outputs.folder("--shrink", path)).transpose()?;
    let (sweep, whole, shard) = chosen(args, cullers, streams)?;
    catch_interrupt();
    let bar = progress_bar();
    bar.set_style(
        ProgressStyle::with_template(
            "{msg:<20} {bar:30} {human_pos}/{human_len} worlds, {per_sec}, {eta} left",
        )
        .unwrap_or_else(|_| ProgressStyle::default_bar()),
    );
    bar.set_length((whole.last - whole.first) / shard.count + 1);
    let watchdog = sweep.watched(&whole, &out);
    if let Some(canary) = sweep.silent_canary()? {
        writeln!(streams.out, "FAILED: the canary, {canary}, was not reported")?;
        return Ok(EXIT_FAILED);
    }
    let (mut tally, start) = (Tally::default(), Instant::now());
    let own = (whole.first..=whole.last).skip(shard.index as usize).step_by(shard.count as usize);
    let ran = sweep.run(own, &bar, &mut |outcome| {
        tally.add(outcome);
        if tally.failed > 0 {
            bar.set_message(format!("{} FAILED", tally.failed));
        }
        let line = whole.line(outcome);
        if args.json {
            bar.suspend(|| writeln!(streams.out, "{line}"))?;
        }
        bar.suspend(|| out.line(&line))
    });
    drop(watchdog);
    bar.finish_and_clear();
    // Whatever ended it, what was run is kept.
    if tally.worlds > 0 {
        out.finish(&[])?;
    }
    let end = ran?;
    let seconds = start.elapsed().as_secs_f64();
    let to_talk = &mut *streams.talk;
    let sink: &mut dyn Write = if args.json { to_talk } else { &mut *streams.out };
    let rest = match end {
        End::Interrupted if tally.worlds == 0 => return Err(RunError::Interrupted.into()),
        End::Time if tally.worlds == 0 => {
            let what = "--budget: the time was up before the first world was run; give it more";
            return Err(CliError::Usage(what.to_owned()));
        }
        End::Seeds => "",
        End::Time => "; the time was up before all seeds were run",
        End::Interrupted => "; interrupted",
        End::Lost => "; the device was lost",
    };
    writeln!(
        sink,
        "{}, shard {shard}: {} worlds in {seconds:.1} s, {:.0} a second{rest}",
        merge::seeds(whole.first, whole.last),
        tally.worlds,
        tally.worlds as f64 / seconds.max(1e-9)
    )?;
    if args.seed.is_some()
        && let Some(only) = &tally.worst_excess
    {
        writeln!(sink, "seed {}: {}; {}", only.seed, only.scene, only.options)?;
    }
    let code = conclude((args.every_probe, false), &tally, &[], sink)?;
    if end == End::Interrupted {
        return Err(RunError::Interrupted.into());
    }
    let failure = tally.failures.first().filter(|outcome| outcome.ruling() == Ruling::Failed);
    if let (Some(folder), Some(failure)) = (&folder, failure) {
        sweep.shrink(failure.seed, (folder, outputs), sink)?;
    }
    Ok(code)
}

/// What the arguments ask for: the sweep, what its lines say of it, and this machine's share.
fn chosen<'a>(
    args: &'a StressArgs,
    cullers: &[CullerKind],
    streams: &mut Streams<'_>,
) -> Result<(Sweep<'a>, merge::Sweep, Shard), CliError> {
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
    let (first, last) = match args.seed {
        Some(seed) => (seed, seed),
        None => args.seeds.map_or((DEFAULT_SEEDS.0, DEFAULT_SEEDS.1 - 1), |(a, b)| (a, b - 1)),
    };
    let shard = match args.shard {
        Some(shard) => shard,
        None if args.seed.is_some() => Shard::WHOLE,
        None => Shard::of_environment(|name| std::env::var(name).ok())
            .map_err(|error| CliError::Usage(error.to_string()))?,
    };
    if shard.index > last - first {
        let seeds = merge::seeds(first, last);
        return Err(CliError::Usage(format!(
            "shard {shard} of {seeds} is empty: there are fewer seeds than shards; ask for fewer shards"
        )));
    }
    // No real device is opened where none is asked for.
    let names = if real.is_empty() { vec!["sim".to_owned()] } else { args.oracle.clone() };
    let adapter = args.adapter.as_deref().filter(|_| !real.is_empty());
    let oracles = Oracles::open(&names, adapter, streams)?;
    let flags = args.flags().trim_start().to_owned();
    let whole = merge::Sweep { flags, first, last, shards: shard.count, shard: shard.index };
    Ok((Sweep { args, cullers, real, oracles, done: Arc::default() }, whole, shard))
}

impl Sweep<'_> {
    /// A watchdog over the sweep: where a world hangs, the lines of the others are kept, with its own.
    fn watched(&self, whole: &merge::Sweep, out: &SharedFile<'_>) -> Watchdog {
        let (args, cullers, real) = (self.args.clone(), self.cullers.clone(), self.real.clone());
        let (done, whole, out) = (Arc::clone(&self.done), whole.clone(), out.at_hang());
        let keep = move |hung: &mut Hung| {
            hung.replay = replay(&args, hung.seed);
            let choice = choice(&args, hung.seed, &cullers, &real);
            let failures = hung.failures.clone();
            let own = Outcome::unrun(&choice, Check::Hang, "");
            let own = Outcome { failures, replay: hung.replay.clone(), ..own };
            let mut outcomes = locked(&done).clone();
            outcomes.sort_by_key(|outcome| outcome.seed);
            let lines = outcomes.iter().chain([&own]).map(|outcome| whole.line(outcome) + "\n");
            let lines: String = lines.collect();
            if args.json {
                // The process ends as failed in any case.
                let _ = std::io::stdout().write_all(lines.as_bytes());
            }
            out.finish(lines.as_bytes());
        };
        Watchdog::start(&self.args.frame_limit, keep)
    }
}

/// What a sweep came to.
fn conclude(
    (every_probe, partial): (bool, bool),
    tally: &Tally,
    missing: &[String],
    to: &mut dyn Write,
) -> Result<u8, CliError> {
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
        let word = failure.ruling().word().to_uppercase();
        writeln!(to, "{word}: seed {}: {}; {}", failure.seed, failure.scene, failure.options)?;
        failure.failures.iter().try_for_each(|line| writeln!(to, "  {line}"))?;
        writeln!(to, "  replay: {}", failure.replay)?;
    }
    let (never, rare) = (tally.never_reached(), tally.rare());
    if every_probe {
        never.iter().try_for_each(|probe| writeln!(to, "NEVER REACHED: {probe}"))?;
        rare.iter().try_for_each(|line| writeln!(to, "TOO RARE: {line}"))?;
    }
    missing.iter().try_for_each(|what| writeln!(to, "MISSING: {what}"))?;
    let reached = never.is_empty() && rare.is_empty();
    let ruling = if every_probe && !reached { Ruling::Failed } else { tally.ruling };
    let word = match (ruling, missing) {
        (Ruling::Held, [_, ..]) if partial => "held as far as it goes",
        (Ruling::Held, [_, ..]) => "incomplete; --partial judges what is there",
        (ruling, _) => ruling.word(),
    };
    writeln!(
        to,
        "verdict: {word} ({} of {} worlds held)",
        tally.worlds - tally.failed - tally.device_at_fault,
        tally.worlds
    )?;
    Ok(exit_of(ruling))
}
