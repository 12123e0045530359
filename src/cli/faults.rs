//! `faults`: the gate on trial. Every seeded fault must be caught, and nothing said of unbroken cullers.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use clap::Args;
use rayon::prelude::*;
use serde_json::json;

use super::blocks::{self, trial_in_swarm};
use super::files::Files;
use super::progress::progress_bar;
use super::run::exit_of;
use super::signals::{catch_interrupt, interrupted};
use super::watchdog::{FrameLimit, Hung, SharedFile, Watchdog};
use super::{CliError, Outputs, Streams};
use crate::check::Ruling;
use crate::fault::{self, Evidence, Fault, Harm, OTHERS, SOUND, Trial, faults as all_faults};
use crate::run::{Canary, World};
use crate::scene::generate::HARD;

/// Version of the JSON line.
const JSON_SCHEMA: u32 = 1;
/// Frames of a scene that unbroken rigs are run over for false alarms, where nothing is said; the long
/// run alone has more.
const MOST_SOUND_FRAMES: u32 = 1500;

#[derive(Args, Clone)]
pub(super) struct FaultsArgs {
    /// Faults by name (default: all of them).
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    fault: Vec<String>,
    /// Scenes to try them in (default: those of each fault).
    #[arg(long, value_name = "NAME", num_args = 1.., value_delimiter = ',')]
    scene: Vec<String>,
    /// The one seed to try (default: 1 to --seeds).
    #[arg(long, conflicts_with = "seeds")]
    seed: Option<u64>,
    /// How many seeds to try.
    #[arg(long, default_value_t = 3, value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Most frames of each scene (default: all of a fault's, 1500 for unbroken cullers).
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..))]
    frames: Option<u32>,
    /// Look for each fault in the worlds of `stress` instead, at most so many: how many seeds it takes.
    #[arg(long, value_name = "SEEDS", num_args = 0..=1, default_missing_value = "2000",
        value_parser = clap::value_parser!(u64).range(1..), conflicts_with_all = ["scene", "seed", "seeds", "frames"])]
    swarm: Option<u64>,
    /// With --swarm: over so many blocks of 1000 seeds each (0.., 1000.. and on), the median of how many
    /// seeds it takes until a fault is first caught.
    #[arg(long, value_name = "BLOCKS", requires = "swarm",
        value_parser = clap::value_parser!(u64).range(1..=1000))]
    blocks: Option<u64>,
    /// One JSON object a fault on standard output in place of the table.
    #[arg(long)]
    json: bool,
    /// Also write the JSON lines to this file; `-` is standard output, and the table goes to standard error.
    #[arg(long, value_name = "FILE|-")]
    out: Option<PathBuf>,
    #[command(flatten)]
    frame_limit: FrameLimit,
    /// Makes every unbroken rig wrong on purpose, to see that the false alarm arrives; see `run --canary`.
    #[arg(long, value_name = "CHECK")]
    canary: Option<Canary>,
}

impl FaultsArgs {
    pub(super) fn files(&self) -> Files {
        Files::default().writing("--out", self.out.as_deref()).json(self.json)
    }
}

/// One fault over its scenes and seeds.
struct Tried {
    fault: Fault,
    /// Scene, seed and what was seen.
    runs: Vec<(String, u64, Evidence)>,
}

impl Tried {
    fn caught(&self) -> impl Iterator<Item = &(String, u64, Evidence)> {
        self.runs.iter().filter(|(.., evidence)| evidence.caught())
    }

    /// The checks that noticed anywhere, in the order of the gate.
    fn checks(&self) -> Vec<&'static str> {
        let mut checks: Vec<&str> = Vec::new();
        for check in self.caught().flat_map(|(.., evidence)| &evidence.checks) {
            if !checks.contains(check) {
                checks.push(check);
            }
        }
        checks
    }

    fn moments(&self) -> [u32; 2] {
        let sum = |figure: fn(&Evidence) -> u32| self.runs.iter().map(|(.., e)| figure(e)).sum();
        [sum(|e| e.bad_moments), sum(|e| e.moments)]
    }

    /// Where the picture changes first, or what more is spent.
    fn difference(&self) -> String {
        let Some((scene, _, evidence)) = self.caught().next() else {
            return "none".to_owned();
        };
        match (self.fault.harm, evidence.picture) {
            (Harm::Drops, Some((moment, pixels))) => {
                format!("{pixels} pixels in {moment} of {scene}")
            }
            _ => {
                let ([drawn, more], [asked, other]) = (evidence.drawn, evidence.queries);
                format!("{scene}: {drawn} parts drawn become {more}, {asked} questions {other}")
            }
        }
    }

    fn replay(&self, args: &FaultsArgs) -> Option<String> {
        let (scene, seed, _) = self.caught().next().or(self.runs.first())?;
        let frames = args.frames.map_or(String::new(), |frames| format!(" --frames {frames}"));
        let name = self.fault.name;
        Some(format!("plainsight faults --fault {name} --scene {scene} --seed {seed}{frames}"))
    }

    fn json(&self, args: &FaultsArgs) -> String {
        let [bad, all] = self.moments();
        json!({
            "schema": JSON_SCHEMA,
            "fault": self.fault.name,
            "bug_class": self.fault.bug,
            "summary": self.fault.summary,
            "sound_rig": self.fault.sound.name,
            "harm": if self.fault.harm == Harm::Drops { "drops" } else { "overdraws" },
            "caught": self.caught().count() > 0,
            "checks": self.checks(),
            "bad_frames": bad,
            "frames": all,
            "runs_caught": self.caught().count(),
            "runs": self.runs.len(),
            "difference": self.difference(),
            "false_alarms": self.false_alarms(),
            "replay": self.replay(args),
        })
        .to_string()
    }

    /// What its false alarms come to.
    fn alarm(&self) -> Ruling {
        self.runs.iter().map(|(.., evidence)| evidence.alarm).max().unwrap_or_default()
    }

    fn false_alarms(&self) -> Vec<String> {
        let lines = |(scene, seed, evidence): &(String, u64, Evidence)| {
            let line =
                |line: &String| format!("{} in {scene} seed {seed}: {line}", self.fault.sound.name);
            evidence.false_alarms.iter().map(line).collect::<Vec<_>>()
        };
        self.runs.iter().flat_map(lines).collect()
    }
}

fn pick(names: &[String]) -> Result<Vec<Fault>, CliError> {
    let all = all_faults();
    if names.is_empty() {
        return Ok(all);
    }
    let find = |name: &String| {
        all.iter().find(|fault| fault.name == name).copied().ok_or_else(|| {
            let known: Vec<&str> = all.iter().map(|fault| fault.name).collect();
            CliError::Usage(format!("no fault is called '{name}'; there are {}", known.join(", ")))
        })
    };
    names.iter().map(find).collect()
}

fn try_fault(
    fault: &Fault,
    args: &FaultsArgs,
    tick: &mut dyn FnMut() -> bool,
) -> Result<Tried, CliError> {
    let scenes: Vec<&str> = if args.scene.is_empty() {
        fault.scenes.to_vec()
    } else {
        args.scene.iter().map(String::as_str).collect()
    };
    let seeds = args.seed.map_or(1..=args.seeds, |seed| seed..=seed);
    let mut runs = Vec::new();
    for scene in scenes {
        for seed in seeds.clone() {
            let trial = Trial::new(fault, scene, seed, args.frames)?.with_canary(args.canary);
            runs.push((scene.to_owned(), seed, trial.run(fault, tick)?));
        }
    }
    Ok(Tried { fault: *fault, runs })
}

/// What was run of unbroken rigs alone.
#[derive(Default)]
struct SoundRuns {
    frames: u64,
    alarms: Vec<String>,
    alarm: Ruling,
}

/// Every unbroken rig over every hard scene.
fn sound_runs(
    args: &FaultsArgs,
    tick: &mut dyn FnMut(&str) -> bool,
) -> Result<SoundRuns, CliError> {
    let mut runs = SoundRuns::default();
    let most = args.frames.unwrap_or(MOST_SOUND_FRAMES);
    for generator in HARD {
        let world: World = fault::world(generator.name, args.seed.unwrap_or(1), Some(most))?;
        let mut tick = || tick(generator.name);
        let shots = u64::from(world.scene.frames) * u64::from(world.views());
        runs.frames += shots * SOUND.len() as u64;
        let (alarms, alarm) =
            fault::false_alarms(&world.with_canary(args.canary), SOUND, &mut tick)?;
        runs.alarms.extend(alarms);
        runs.alarm = runs.alarm.max(alarm);
    }
    Ok(runs)
}

/// How often a fault is found in the swarm before its median is told.
const FINDS: usize = 11;
/// Worlds that run side by side before the next look at what was found.
const CHUNK: u64 = 32;

/// What looking for a fault in the swarm came to.
struct Hunt {
    fault: Fault,
    /// Seeds in which it was caught.
    found: Vec<u64>,
    /// Seeds that were run, from 0 on.
    run: u64,
    /// What the gate said of the unbroken rig, and what that comes to.
    false_alarms: Vec<String>,
    alarm: Ruling,
}

impl Hunt {
    /// Looks at seeds from 0 on until the fault was caught often enough or `most` seeds are run.
    fn new(fault: Fault, most: u64, canary: Option<Canary>) -> Result<Self, CliError> {
        let (found, false_alarms, alarm) = (Vec::new(), Vec::new(), Ruling::Held);
        let mut hunt = Self { fault, found, run: 0, false_alarms, alarm };
        while hunt.run < most && hunt.found.len() < FINDS {
            let seeds: Vec<u64> = (hunt.run..(hunt.run + CHUNK).min(most)).collect();
            let evidence: Vec<Result<Evidence, CliError>> =
                seeds.par_iter().map(|&seed| trial_in_swarm(&fault, seed, canary)).collect();
            for (seed, evidence) in seeds.into_iter().zip(evidence) {
                let evidence = evidence?;
                if evidence.caught() {
                    hunt.found.push(seed);
                }
                hunt.alarm = hunt.alarm.max(evidence.alarm);
                let alarms = evidence.false_alarms.into_iter();
                hunt.false_alarms.extend(alarms.map(|line| format!("seed {seed}: {line}")));
                hunt.run = seed + 1;
            }
        }
        Ok(hunt)
    }

    /// The median number of seeds until it is caught, over the finds; `None` where it never was.
    fn median(&self) -> Option<u64> {
        let mut from = 0;
        let mut waits: Vec<u64> = self
            .found
            .iter()
            .map(|&seed| std::mem::replace(&mut from, seed + 1))
            .zip(&self.found)
            .map(|(from, &seed)| seed + 1 - from)
            .collect();
        waits.sort_unstable();
        waits.get(waits.len().saturating_sub(1) / 2).copied()
    }

    fn json(&self) -> String {
        json!({
            "schema": JSON_SCHEMA,
            "fault": self.fault.name,
            "bug_class": self.fault.bug,
            "summary": self.fault.summary,
            "caught": !self.found.is_empty(),
            "seeds_run": self.run,
            "seeds_caught": self.found,
            "median_seeds": self.median(),
            "false_alarms": self.false_alarms,
        })
        .to_string()
    }
}

/// Looks for each fault in at most `most` worlds of the swarm.
fn hunt(
    args: &FaultsArgs,
    most: u64,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    let out = args.out.as_deref().map(|path| outputs.file("--out", path)).transpose()?;
    let mut out = SharedFile::new(out);
    let chosen = pick(&args.fault)?;
    catch_interrupt();
    let bar = progress_bar();
    bar.set_length(chosen.len() as u64);
    let (now, watchdog) = watched(args, &out);
    let wide = chosen.iter().map(|fault| fault.name.len()).max().unwrap_or(0).max(5);
    if !args.json {
        writeln!(streams.out, "{:<wide$} class  median seeds  caught in", "fault")?;
    }
    let (mut caught, mut alarms, mut medians) = (0, 0, Vec::new());
    let (mut ruling, mut done) = (Ruling::Held, 0);
    let ended = chosen.iter().try_for_each(|&fault| {
        bar.set_message(fault.name);
        set(&now, fault.name);
        let hunt = Hunt::new(fault, most, args.canary)?;
        bar.inc(1);
        let line = hunt.json();
        bar.suspend(|| out.line(&line))?;
        let median = hunt.median().map_or("NEVER".to_owned(), |median| median.to_string());
        let (found, run) = (hunt.found.len(), hunt.run);
        let text = match args.json {
            true => line,
            false => {
                format!("{:<wide$} {:>5}  {median:>12}  {found} of {run}", fault.name, fault.bug)
            }
        };
        bar.suspend(|| writeln!(streams.out, "{text}"))?;
        for alarm in &hunt.false_alarms {
            bar.suspend(|| writeln!(streams.talk, "FALSE ALARM: {} {alarm}", fault.sound.name))?;
        }
        alarms += hunt.false_alarms.len();
        ruling = ruling.max(hunt.alarm);
        caught += usize::from(!hunt.found.is_empty());
        medians.extend(hunt.median());
        done += 1;
        Ok::<(), CliError>(())
    });
    drop(watchdog);
    bar.finish_and_clear();
    // What was finished is kept; where nothing was, what stood there before stays.
    if ended.is_ok() || done > 0 {
        out.finish(&[])?;
    }
    ended?;
    medians.sort_unstable();
    let half = medians.get(medians.len().saturating_sub(1) / 2).copied().unwrap_or(0);
    let to = if args.json { &mut streams.talk } else { &mut streams.out };
    writeln!(
        to,
        "faults: the swarm caught {caught} of {}; half of them within a median of {half} seeds, all of those caught within {}; false alarms {alarms}",
        chosen.len(),
        medians.last().copied().unwrap_or(0)
    )?;
    Ok(exit_of(if caught == chosen.len() { ruling } else { Ruling::Failed }))
}

pub(super) fn faults(
    args: &FaultsArgs,
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    match (args.swarm, args.blocks) {
        (Some(most), Some(blocks)) => {
            let out = args.out.as_deref().map(|path| outputs.file("--out", path)).transpose()?;
            let mut out = SharedFile::new(out);
            let (now, watchdog) = watched(args, &out);
            let seen = &mut |fault: &Fault| set(&now, fault.name);
            let (blocks, to) = ((blocks, most, args.canary), (args.json, &mut out));
            let code = blocks::hunt(&pick(&args.fault)?, blocks, seen, to, streams);
            drop(watchdog);
            return code;
        }
        (Some(most), None) => return hunt(args, most, outputs, streams),
        (None, _) => {}
    }
    let out = args.out.as_deref().map(|path| outputs.file("--out", path)).transpose()?;
    let mut out = SharedFile::new(out);
    let chosen = pick(&args.fault)?;
    catch_interrupt();
    let (now, watchdog) = watched(args, &out);
    let bar = progress_bar();
    let steps = if args.fault.is_empty() { chosen.len() + HARD.len() } else { chosen.len() };
    bar.set_length(steps as u64);
    let mut tried = Vec::new();
    let mut ended = chosen.iter().try_for_each(|fault| {
        bar.set_message(fault.name);
        set(&now, fault.name);
        let one = try_fault(fault, args, &mut || !interrupted())?;
        bar.inc(1);
        let line = one.json(args);
        if args.json {
            bar.suspend(|| writeln!(streams.out, "{line}"))?;
        }
        bar.suspend(|| out.line(&line))?;
        tried.push(one);
        Ok(())
    });
    set(&now, "");
    let mut sound = SoundRuns::default();
    if args.fault.is_empty() && ended.is_ok() {
        let mut last = String::new();
        let ran = sound_runs(args, &mut |scene| {
            if scene != last {
                bar.set_message(format!("unbroken: {scene}"));
                bar.inc(1);
                last = scene.to_owned();
            }
            !interrupted()
        });
        ended = ran.map(|runs| sound = runs);
    }
    drop(watchdog);
    bar.finish_and_clear();
    // What was finished is kept; where nothing was, what stood there before stays.
    if ended.is_ok() || !tried.is_empty() {
        out.finish(&[])?;
    }
    ended?;
    let ruling = conclude(args, &tried, &sound, streams)?;
    Ok(exit_of(ruling))
}

/// A watchdog over a trial, and where it is told the fault that is on trial; none while unbroken rigs run.
fn watched(args: &FaultsArgs, out: &SharedFile<'_>) -> (Arc<Mutex<String>>, Watchdog) {
    let now = Arc::new(Mutex::new(String::new()));
    let (fault, out) = (Arc::clone(&now), out.at_hang());
    let (swarm, blocks, limit) = (args.swarm, args.blocks, args.frame_limit);
    let keep = move |hung: &mut Hung| {
        let fault = fault.lock().unwrap_or_else(PoisonError::into_inner).clone();
        let mut line = "plainsight faults".to_owned();
        if !fault.is_empty() {
            line += &format!(" --fault {fault}");
        }
        line += &match swarm {
            Some(most) => {
                let blocks = blocks.map_or(String::new(), |blocks| format!(" --blocks {blocks}"));
                format!(" --swarm {most}{blocks}")
            }
            None => format!(" --scene {} --seed {}", hung.scene, hung.seed),
        };
        hung.replay = line + &limit.replay_flags();
        let line = json!({
            "schema": JSON_SCHEMA,
            "fault": fault,
            "rig": hung.culler,
            "scene": hung.scene,
            "seed": hung.seed,
            "verdict": Ruling::Failed.word(),
            "failures": hung.failures,
            "replay": hung.replay,
        });
        // The process ends as failed in any case.
        out.finish(format!("{line}\n").as_bytes());
    };
    (now, Watchdog::start(&args.frame_limit, keep))
}

/// Says what is on trial.
fn set(now: &Mutex<String>, fault: &str) {
    fault.clone_into(&mut now.lock().unwrap_or_else(PoisonError::into_inner));
}

/// The table, the failures, the sums; what all comes to.
fn conclude(
    args: &FaultsArgs,
    tried: &[Tried],
    sound: &SoundRuns,
    streams: &mut Streams<'_>,
) -> Result<Ruling, CliError> {
    let to: &mut dyn std::io::Write =
        if args.json { &mut *streams.talk } else { &mut *streams.out };
    if !args.json {
        table(args, tried, to)?;
    }
    let mut alarms: Vec<String> = tried.iter().flat_map(Tried::false_alarms).collect();
    alarms.extend(sound.alarms.iter().cloned());
    for alarm in &alarms {
        writeln!(to, "FALSE ALARM: {alarm}")?;
    }
    let caught = tried.iter().filter(|one| one.caught().count() > 0).count();
    for missed in tried.iter().filter(|one| one.caught().count() == 0) {
        writeln!(to, "NOT CAUGHT: {}: {}", missed.fault.name, missed.fault.summary)?;
    }
    let beside: u64 = tried.iter().map(|one| u64::from(one.moments()[1])).sum();
    if args.fault.is_empty() {
        writeln!(to, "not seeded:")?;
        for (bug, what) in OTHERS {
            writeln!(to, "  class {bug:>2}: {what}")?;
        }
    }
    let mut classes: Vec<u8> = tried.iter().map(|one| one.fault.bug).collect();
    classes.dedup();
    writeln!(
        to,
        "faults: caught {caught} of {} seeded, of {} bug classes; false alarms {} in {} frames of unbroken cullers",
        tried.len(),
        classes.len(),
        alarms.len(),
        beside + sound.frames
    )?;
    let alarm = tried.iter().map(Tried::alarm).max().unwrap_or_default().max(sound.alarm);
    Ok(if caught == tried.len() { alarm } else { Ruling::Failed })
}

fn table(args: &FaultsArgs, tried: &[Tried], to: &mut dyn std::io::Write) -> std::io::Result<()> {
    let wide = tried.iter().map(|one| one.fault.name.len()).max().unwrap_or(0).max(5);
    writeln!(to, "{:<wide$} class  caught by      frames     runs  difference", "fault")?;
    for one in tried {
        let checks = one.checks();
        let by = if checks.is_empty() { "NOTHING".to_owned() } else { checks.join(" ") };
        let [bad, all] = one.moments();
        let runs = format!("{}/{}", one.caught().count(), one.runs.len());
        let frames = format!("{bad}/{all}");
        let (name, bug, difference) = (one.fault.name, one.fault.bug, one.difference());
        writeln!(to, "{name:<wide$} {bug:>5}  {by:<12} {frames:>8} {runs:>8}  {difference}")?;
        if let Some(replay) = one.replay(args) {
            writeln!(to, "{:<wide$}        {replay}", "")?;
        }
        if tried.len() == 1 {
            one.runs.iter().try_for_each(|(scene, seed, evidence)| {
                writeln!(to, "{scene} seed {seed}, {}:", one.fault.summary)?;
                evidence.lines.iter().try_for_each(|line| writeln!(to, "  {line}"))
            })?;
        }
    }
    Ok(())
}
