//! One seed's world, run and judged.

use serde::{Deserialize, Serialize};

use super::beside::{Beside, go_on_alone};
use super::probe::{Probe, Watch};
use super::{Choice, Reached};
use crate::check::{Check, Gate, Ruling, TruthCheck};
use crate::cull::{CullerSetup, PerView};
use crate::oracle::{Memory, Misbehaviour, Oracle, OracleError, Questions, Stage};
use crate::part::PartId;
use crate::run::{
    Canary, Cause, FrameRecord, Lane, LaneInfo, Moment, Observer, Repeat, Repetition, RunError,
    Stop, Trace, World, run,
};
use crate::scene::{Lens, Scene, Stream};

/// One world in so many is run twice and compared, frame by frame, by a hash of every draw, question and
/// answer in order.
pub const REPEATED_ONE_IN: u64 = 20;
/// One frame in so many is drawn by the naive renderer too. That takes 4.4 times as long as all else of a frame
/// (300 worlds with `--canary truth`, where it draws every frame, beside the same without), so this is 1.7 % of
/// a sweep's time.
const NAIVE_ONE_IN: u32 = 256;

/// What became of a seed; a line of JSON, so that sweeps can be merged.
#[derive(Clone, Debug, Deserialize, Serialize, PartialEq)]
pub struct Outcome {
    /// The seed.
    pub seed: u64,
    /// What it picked.
    pub options: String,
    /// What is in the scene.
    pub scene: String,
    /// What it picked of each family, by name.
    pub members: Vec<String>,
    /// Frames times views.
    pub shots: u32,
    /// What failed, a line each; empty where all held.
    pub failures: Vec<String>,
    /// The gate's word: `held`, `failed`, `device not repeatable` or `device lost`.
    #[serde(default)]
    pub verdict: String,
    /// The frame in which something failed first.
    pub failed_in: Option<u32>,
    /// Names of the probes that were reached.
    pub reached: Vec<String>,
    /// Parts drawn, over all frames.
    pub drawn: u64,
    /// Parts that show.
    pub visible: u64,
    /// Questions asked.
    pub queries: u64,
    /// Virtual nanoseconds by the device's clock, or by the cost model where it has none.
    pub virtual_ns: u64,
    /// Whether it was run twice.
    pub repeated: bool,
    /// One number for all that must repeat, in hexadecimal digits.
    pub hash: String,
    /// The line that runs it again, where one is known.
    #[serde(default)]
    pub replay: String,
}

/// The gate, and who watches for probes.
struct Watched {
    gate: Gate,
    watch: Watch,
    beside: Beside,
    /// What was drawn when something failed first.
    wrong: Option<(Moment, Vec<PartId>)>,
    /// Frames and views seen.
    shots: u32,
    /// Whether the device is to go away, and whether it has.
    to_be_lost: bool,
    lost: bool,
}

impl Observer for Watched {
    fn frame(&mut self, record: &FrameRecord<'_>) {
        self.shots += 1;
        self.gate.frame(record);
        self.watch.frame(record);
        let moment = record.state.moment;
        if let Err(promise) = self.beside.frame(record) {
            self.gate.broken(moment, &promise);
        }
        self.watch.shape(self.beside.shape);
        if self.wrong.is_none() && self.gate.first_failure().is_some() {
            self.wrong = Some((record.state.moment, record.drawn.to_vec()));
        }
    }

    fn broken(&mut self, moment: Moment, promise: &str) {
        self.gate.broken(moment, promise);
    }

    fn repeated(&mut self, repetition: &Repetition<'_>) {
        self.gate.repeated(repetition);
    }

    fn stopped(&mut self, stop: &Stop) {
        // It must end so, and all frames before must be right.
        let lost = matches!(stop.cause, Cause::Oracle(OracleError::Lost(_)));
        if lost && self.to_be_lost {
            self.lost = true;
        } else {
            self.gate.stopped(stop);
        }
    }
}

/// Makes oracles of a real device.
pub type MakeReal<'a> = dyn Fn(&Stage, Questions) -> Result<Box<dyn Oracle>, OracleError> + 'a;

/// Runs the world of a choice. `real` makes oracles of a real device and is asked only where the choice names
/// one.
///
/// # Errors
/// Where no oracle can be made. A device that goes away later is in the outcome, and so is a panic of the
/// culler.
pub fn judged(choice: &Choice, real: &MakeReal<'_>) -> Result<Outcome, RunError> {
    let scene = choice.scene().expect("the swarm has a scene for every seed");
    judged_in(choice, scene, real).map(|judged| judged.outcome)
}

/// A world run and judged, with what there is to look at where something failed.
pub struct Judged {
    /// What became of it.
    pub outcome: Outcome,
    /// The world.
    pub world: World,
    /// When something failed first, and the parts drawn then.
    pub wrong: Option<(Moment, Vec<PartId>)>,
}

/// The same in another scene than the choice's own.
///
/// # Errors
/// As [`judged`].
pub fn judged_in(choice: &Choice, scene: Scene, real: &MakeReal<'_>) -> Result<Judged, RunError> {
    let (said, frames) = (summary(&scene), scene.frames);
    let world = World::new(scene, choice.partition).with_canary(choice.canary);
    let cut = world.partition.check();
    let world = match choice.memory_knobs(&world.partition) {
        Some(memory) => world.within(memory)?,
        None => world,
    };
    let oracle = choice.oracle(world.stage(), real)?;
    let entries = world.entries();
    let make = || {
        let setup = CullerSetup {
            partition: world.partition.clone(),
            index: choice.build(&entries),
            proxy: choice.proxy,
            cost: choice.cost.clone(),
        };
        choice.make(setup)
    };
    // What goes wrong goes wrong once, and not again in a repetition.
    let wrong = choice.misbehaviour();
    let to_be_lost = wrong.is_some_and(Misbehaviour::is_fatal);
    let truth = TruthCheck::sampling(Stream::new(choice.seed, "naive"), NAIVE_ONE_IN);
    let mut watched = Watched {
        gate: Gate::default().sampling(truth),
        watch: Watch::default(),
        beside: Beside::new(choice, &world, entries.clone()),
        wrong: None,
        shots: 0,
        to_be_lost,
        lost: false,
    };
    if let Err(promise) = cut {
        watched.gate.broken(Moment { frame: 0, view: 0 }, &promise);
    }
    let info = LaneInfo::of(choice.culler.name, oracle.as_ref(), String::new());
    let culler = Box::new(|| PerView::over(world.views(), make));
    // What a real device's tolerance makes of an answer the audit does not know.
    let audited = oracle.device().is_none();
    let observer = &mut watched;
    let lane = Lane { info, culler, oracle, observer, with_bound: false, audited };
    let wanted = choice.canary.is_some_and(Canary::wants_repetition);
    let repeated = wanted || choice.seed.is_multiple_of(REPEATED_ONE_IN) && wrong.is_none();
    let repeat = if repeated { Repeat::first(frames) } else { Repeat::NONE };
    let traces = run(&world, frames, repeat, &mut [lane], &mut || true)?;
    if choice.is_large()
        && let Err((frame, promise)) = go_on_alone(choice, &world)
    {
        watched.gate.broken(Moment { frame, view: 0 }, &promise);
    }
    let outcome = match wrong.filter(|_| watched.lost) {
        Some(wrong) => ended(choice, said, wrong, &mut watched),
        None => outcome(choice, said, &traces[0], &mut watched, repeated),
    };
    Ok(Judged { outcome, wrong: watched.wrong, world })
}

/// What became of a world whose device went away as it was told to.
fn ended(choice: &Choice, scene: String, wrong: Misbehaviour, watched: &mut Watched) -> Outcome {
    let Watched { gate, watch, shots, .. } = watched;
    let reached: &mut Reached = &mut watch.reached;
    reached.note(Probe::Lost, matches!(wrong, Misbehaviour::Lost(_)));
    reached.note(Probe::Hung, matches!(wrong, Misbehaviour::Hangs(_)));
    Outcome {
        seed: choice.seed,
        options: choice.to_string(),
        scene,
        members: choice.names(),
        shots: *shots,
        failures: gate.failures(),
        verdict: gate.word(),
        failed_in: gate.first_failure().map(|moment| moment.frame),
        reached: reached.probes().iter().map(Probe::to_string).collect(),
        drawn: gate.excess.drawn(),
        visible: gate.excess.visible(),
        queries: gate.counts.total().queries,
        virtual_ns: 0,
        repeated: false,
        hash: String::new(),
        replay: String::new(),
    }
}

impl Outcome {
    /// Of a world that could not be run to any end, for what `check` says.
    #[must_use]
    pub fn unrun(choice: &Choice, check: Check, said: &str) -> Self {
        Self {
            seed: choice.seed,
            options: choice.to_string(),
            scene: choice.scene().map_or_else(|error| error.to_string(), |scene| summary(&scene)),
            members: choice.names(),
            shots: 0,
            failures: vec![format!("{}: {said}", check.name())],
            verdict: check.ruling().word().to_owned(),
            failed_in: None,
            reached: Vec::new(),
            drawn: 0,
            visible: 0,
            queries: 0,
            virtual_ns: 0,
            repeated: false,
            hash: String::new(),
            replay: String::new(),
        }
    }

    /// What the world came to. A line without a verdict was written before there were several.
    #[must_use]
    pub fn ruling(&self) -> Ruling {
        match self.failures.is_empty() {
            true => Ruling::Held,
            false => Ruling::of(&self.verdict).unwrap_or(Ruling::Failed).max(Ruling::NotRepeatable),
        }
    }
}

fn outcome(
    choice: &Choice,
    scene: String,
    trace: &Trace,
    Watched { gate, watch, .. }: &mut Watched,
    repeated: bool,
) -> Outcome {
    let reached: &mut Reached = &mut watch.reached;
    reached.note(Probe::Large, choice.is_large());
    trace.frames.iter().for_each(|frame| reached.note_situations(frame.situations));
    let memory = || trace.frames.iter().filter_map(|frame| frame.memory);
    let some = |figure: fn(&Memory) -> u64| memory().any(|memory| figure(&memory) > 0);
    reached.note(Probe::LoadedLate, some(|memory| memory.late_loads));
    reached.note(Probe::LoadedAhead, some(|memory| memory.prefetches_used));
    reached.note(Probe::ThrownOut, some(|memory| memory.evictions));
    let clock = trace.frames.iter().filter_map(|frame| frame.clock).next_back();
    if let Some(clock) = clock {
        reached.note(Probe::FalseVisible, clock.false_visible > 0);
        reached.note(Probe::Overtaken, clock.overtakes > 0);
        reached.note(Probe::Unwritten, clock.unwritten > 0);
    }
    let modelled = || trace.sum(|frame| choice.cost.frame_total_ns(frame.amounts()));
    Outcome {
        seed: choice.seed,
        options: choice.to_string(),
        scene,
        members: choice.names(),
        shots: trace.frames.len() as u32,
        failures: gate.failures(),
        verdict: gate.word(),
        failed_in: gate.first_failure().map(|moment| moment.frame),
        reached: reached.probes().iter().map(Probe::to_string).collect(),
        drawn: trace.sum(|frame| u64::from(frame.drawn_parts)),
        visible: trace.sum(|frame| u64::from(frame.visible_parts)),
        queries: trace.sum(|frame| frame.counts.queries),
        virtual_ns: clock.map_or_else(modelled, |clock| clock.now_ns),
        repeated,
        hash: format!("{:016x}", trace.hash()),
        replay: String::new(),
    }
}

/// What is in a scene, in a line.
fn summary(scene: &Scene) -> String {
    let moving = scene.effects.motion.as_ref().map_or(0, |motion| motion.movers.len());
    let figures = scene.effects.articulated.iter().flat_map(|all| &all.figures);
    let moving = moving + figures.map(|figure| figure.limbs.len()).sum::<usize>();
    let jumping = scene.effects.teleport.as_ref().map_or(0, |teleport| teleport.jumpers.len());
    let lens = match scene.cameras[0].lens {
        Lens::Perspective { fov_y, .. } => format!("{:.0}°", fov_y.to_degrees()),
        Lens::Orthographic { .. } => "orthographic".to_owned(),
    };
    format!(
        "{} objects, {} triangles, {moving} moving, {jumping} jumping, {lens}, {} views",
        scene.objects.len(),
        scene.triangle_count(),
        scene.cameras.len()
    )
}
