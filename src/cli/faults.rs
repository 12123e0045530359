//! `faults`: the gate on trial. Every seeded fault must be caught, and nothing said of unbroken cullers.

use std::path::PathBuf;

use clap::Args;
use serde_json::json;

use super::progress::progress_bar;
use super::run::{catch_interrupt, interrupted};
use super::{CliError, EXIT_FAILED, EXIT_HELD, OutFile, Streams};
use crate::fault::{self, Evidence, Fault, Harm, OTHERS, SOUND, Trial, faults as all_faults};
use crate::run::World;
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
    /// One JSON object a fault on standard output in place of the table.
    #[arg(long)]
    json: bool,
    /// Also write the JSON lines to this file.
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
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
            let trial = Trial::new(fault, scene, seed, args.frames)?;
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
        runs.alarms.extend(fault::false_alarms(&world, SOUND, &mut tick)?);
        let shots = u64::from(world.scene.frames) * u64::from(world.views());
        runs.frames += shots * SOUND.len() as u64;
    }
    Ok(runs)
}

pub(super) fn faults(args: &FaultsArgs, streams: &mut Streams<'_>) -> Result<u8, CliError> {
    let out = args.out.as_deref().map(OutFile::create).transpose()?;
    let chosen = pick(&args.fault)?;
    catch_interrupt();
    let bar = progress_bar();
    let steps = if args.fault.is_empty() { chosen.len() + HARD.len() } else { chosen.len() };
    bar.set_length(steps as u64);
    let (mut tried, mut lines) = (Vec::new(), String::new());
    for fault in &chosen {
        bar.set_message(fault.name);
        let one = try_fault(fault, args, &mut || !interrupted());
        if one.is_err() {
            bar.finish_and_clear();
        }
        let one = one?;
        bar.inc(1);
        let line = one.json(args);
        if args.json {
            bar.suspend(|| writeln!(streams.out, "{line}"))?;
        }
        lines += &format!("{line}\n");
        tried.push(one);
    }
    let mut sound = SoundRuns::default();
    if args.fault.is_empty() {
        let mut last = String::new();
        let ran = sound_runs(args, &mut |scene| {
            if scene != last {
                bar.set_message(format!("unbroken: {scene}"));
                bar.inc(1);
                last = scene.to_owned();
            }
            !interrupted()
        });
        if ran.is_err() {
            bar.finish_and_clear();
        }
        sound = ran?;
    }
    bar.finish_and_clear();
    let held = conclude(args, &tried, &sound, streams)?;
    if let Some(out) = out {
        out.finish(lines.as_bytes())?;
    }
    Ok(if held { EXIT_HELD } else { EXIT_FAILED })
}

/// The table, the failures, the sums; whether all is as it must be.
fn conclude(
    args: &FaultsArgs,
    tried: &[Tried],
    sound: &SoundRuns,
    streams: &mut Streams<'_>,
) -> Result<bool, CliError> {
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
    Ok(caught == tried.len() && alarms.is_empty())
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
