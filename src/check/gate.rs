//! The gate: all checks of one lane, and the short way to put a culler of one's own through them.

use std::fmt;

use super::{
    Check, Conservative, CountsCheck, Determinism, DeviceImage, Excess, Failure, ImageCheck,
    Invariants, Ruling, TruthCheck,
};
use crate::cull::{Culler, CullerSetup, PerView, ProxyKind};
use crate::index::INDEXES;
use crate::oracle::{CostModel, Oracle, Sim};
use crate::part::PartitionKnobs;
use crate::run::{
    self, Cause, FrameRecord, Lane, LaneInfo, Moment, Observer, Repeat, Repetition, RunError, Stop,
    Trace, World,
};
use crate::scene::Scene;

/// Misses named in full before the rest is only counted.
const NAMED_MISSES: usize = 8;
/// What [`judge`] runs a second time.
const REPEAT: Repeat = Repeat::first(2);

/// Every check of one lane.
#[derive(Default)]
pub struct Gate {
    /// No visible part is missing.
    pub conservative: Conservative,
    /// The reference's images are equal.
    pub image: ImageCheck,
    /// The device's images are equal.
    pub device_image: DeviceImage,
    /// Repetition leaves the same trace.
    pub determinism: Determinism,
    /// What was spent.
    pub counts: CountsCheck,
    /// What was drawn in vain.
    pub excess: Excess,
    /// The truth itself is right.
    pub truth: TruthCheck,
    /// Why the lane ended early.
    stop: Option<Stop>,
    /// Promises made on the way.
    pub invariants: Invariants,
    /// Whether parts may be missing for some frames: then pictures may lack them, and are not compared.
    late: bool,
}

impl Observer for Gate {
    fn frame(&mut self, record: &FrameRecord<'_>) {
        let picked = self.truth.picks();
        // Taken back where the naive renderer decides otherwise.
        let before = (picked || self.truth.doubts()).then(|| self.conservative.clone());
        let counts = [self.image.differences().len(), self.device_image.differences().len()];
        let misses = self.conservative.misses().len();
        self.conservative.frame(record);
        if !self.late {
            self.image.frame(record);
            self.device_image.frame(record);
        }
        self.counts.frame(record);
        self.excess.frame(record);
        let failing = misses < self.conservative.misses().len()
            || counts != [self.image.differences().len(), self.device_image.differences().len()];
        if (picked || (failing && self.truth.doubts()))
            && let Some(naive) = self.truth.frame(record, failing)
            && let Some(before) = before
        {
            let record = record.beside(&naive.truth, &naive.drawn);
            self.conservative = before;
            self.conservative.frame(&record);
            if !self.late {
                self.image.look_again(&record);
            }
        }
    }

    fn broken(&mut self, moment: Moment, promise: &str) {
        self.invariants.broken(moment, promise);
    }

    fn repeated(&mut self, repetition: &Repetition<'_>) {
        self.determinism.repeated(repetition);
    }

    fn stopped(&mut self, stop: &Stop) {
        self.stop = Some(stop.clone());
    }
}

impl Gate {
    /// One that lets a part that shows be missing for `frames` frames in a row, and compares no pictures if
    /// that is any.
    #[must_use]
    pub fn forgiving(frames: u32) -> Self {
        let conservative = Conservative::forgiving(frames);
        Self { conservative, late: frames > 0, ..Self::default() }
    }

    /// The same, with the naive renderer drawing a frame now and then; see [`TruthCheck::sampling`].
    #[must_use]
    pub fn sampling(self, truth: TruthCheck) -> Self {
        Self { truth, ..self }
    }

    /// What the lane comes to.
    #[must_use]
    pub fn ruling(&self) -> Ruling {
        let rulings = self.findings().into_iter().map(|failure| failure.check.ruling());
        rulings.max().unwrap_or_default()
    }

    /// The verdict in a word: that of [`Gate::ruling`], or `held late(k)` where parts that show were missing,
    /// for k frames at most, and that was allowed.
    #[must_use]
    pub fn word(&self) -> String {
        match (self.ruling(), self.conservative.latest()) {
            (Ruling::Held, latest) if latest > 0 => format!("held late({latest})"),
            (ruling, _) => ruling.word().to_owned(),
        }
    }

    /// Whether everything held.
    #[must_use]
    pub fn held(&self) -> bool {
        self.ruling() == Ruling::Held
    }

    /// Whether all that is wrong is the truth.
    #[must_use]
    pub fn only_truth_failed(&self) -> bool {
        let findings = self.findings();
        !findings.is_empty() && findings.iter().all(|failure| failure.check == Check::Truth)
    }

    /// When something failed first.
    #[must_use]
    pub fn first_failure(&self) -> Option<Moment> {
        self.findings().into_iter().filter_map(|failure| failure.moment).min()
    }

    /// The checks that noticed something, each once, in their order.
    #[must_use]
    pub fn checks(&self) -> Vec<Check> {
        let mut checks: Vec<Check> = self.findings().into_iter().map(|f| f.check).collect();
        checks.sort_unstable();
        checks.dedup();
        checks
    }

    /// Each failure as a line: frame, part, pixel.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        self.findings().into_iter().map(|failure| failure.line).collect()
    }

    /// Everything that is wrong. All else that a gate says of failures is taken from here.
    #[must_use]
    pub fn findings(&self) -> Vec<Failure> {
        let mut found = Vec::new();
        if let Some(wrong) = self.truth.wrong().first() {
            let [x, y] = wrong.first_pixel;
            let what = if wrong.of_drawn { " of what was drawn" } else { "" };
            let said = format!(
                "the fast renderer and the naive one disagree in {} pixels{what}, first at ({x}, {y}), {}; the naive renderer decides",
                wrong.pixels, wrong.moment
            );
            found.push(Failure::new(Check::Truth, Some(wrong.moment), said));
        }
        let misses = self.conservative.misses();
        found.extend(misses.iter().take(NAMED_MISSES).map(|miss| {
            let [x, y] = miss.first_pixel;
            let said = format!(
                "{} part {} is visible in {} pixels, first at ({x}, {y}), and was not drawn",
                miss.moment, miss.part.0, miss.pixels
            );
            Failure::new(Check::Set, Some(miss.moment), said)
        }));
        if let Some(next) = misses.get(NAMED_MISSES) {
            let said = format!("{} more misses", misses.len() - NAMED_MISSES);
            found.push(Failure::new(Check::Set, Some(next.moment), said));
        }
        let images = [
            (Check::Image, self.image.differences()),
            (Check::DeviceImage, self.device_image.differences()),
        ];
        for (check, differences) in images {
            if let Some(first) = differences.first() {
                let [x, y] = first.first_pixel;
                let said = format!(
                    "{} frames differ, first {} in {} pixels, first at ({x}, {y})",
                    differences.len(),
                    first.moment,
                    first.pixels
                );
                found.push(Failure::new(check, Some(first.moment), said));
            }
        }
        if let Some(moment) = self.determinism.first_difference() {
            let event = self.determinism.first_event();
            let said = format!("{moment} left another trace when run again: {event}");
            found.push(Failure::new(Check::Determinism, Some(moment), said));
        }
        if let Some(moment) = self.counts.overcounted() {
            let said = format!("{moment} has more answers than questions");
            found.push(Failure::new(Check::Counts, Some(moment), said));
        }
        if let Some((moment, promise)) = self.invariants.first() {
            let count = self.invariants.count();
            let said = format!("{count} frames break one, first {moment}: {promise}");
            found.push(Failure::new(Check::Invariant, Some(moment), said));
        }
        if let Some((moment, said)) = self.determinism.device() {
            found.push(Failure::new(Check::Repeatable, Some(moment), said));
        }
        if let Some(stop) = &self.stop {
            let check = match stop.cause {
                Cause::Panic(_) => Check::Panic,
                Cause::Hang(_) => Check::Hang,
                Cause::Oracle(_) => Check::Lost,
            };
            found.push(Failure::new(check, stop.moment, stop));
        }
        found
    }
}

/// What the gate says of one lane; prints as a few lines.
pub struct Verdict {
    /// The record.
    pub trace: Trace,
    /// The checks.
    pub gate: Gate,
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let lane = &self.trace.lane;
        let word = self.gate.word();
        let (drawn, visible) = (self.gate.excess.drawn(), self.gate.excess.visible());
        let queries = self.gate.counts.total().queries;
        write!(
            f,
            "{word}: {} on {}, {} frames, drew {drawn} parts where {visible} are visible, {queries} queries",
            lane.culler,
            lane.oracle,
            self.trace.frames.len()
        )?;
        self.gate.failures().iter().try_for_each(|line| write!(f, "\n  {line}"))
    }
}

/// Puts a culler through the gate: every frame of `scene` on the simulated device, over the first
/// index of [`INDEXES`], the first frames twice.
///
/// # Errors
/// None: nobody interrupts it, and what a culler or the device does is in the verdict.
pub fn judge(
    scene: Scene,
    make: impl Fn(CullerSetup) -> Box<dyn Culler>,
) -> Result<Verdict, RunError> {
    let frames = scene.frames;
    let world = World::new(scene, PartitionKnobs::default());
    let entries = world.entries();
    let culler = || {
        PerView::over(world.views(), || {
            make(CullerSetup {
                partition: world.partition.clone(),
                index: (INDEXES[0].build)(&entries),
                proxy: ProxyKind::Rectangle,
                cost: CostModel::lavapipe(),
            })
        })
    };
    let stage = world.stage();
    let oracle: Box<dyn Oracle> = Box::new(Sim::new(stage));
    let name = culler().name().to_owned();
    let replay = format!("scene {} seed {} culler {name}", world.scene.name, world.scene.seed);
    let info = LaneInfo::of(name, oracle.as_ref(), replay);
    let mut gate = Gate::default();
    let (culler, observer) = (Box::new(culler), &mut gate);
    let lane = Lane { info, culler, oracle, observer, with_bound: false, audited: true };
    let mut traces = run::run(&world, frames, REPEAT, &mut [lane], &mut || true)?;
    let trace = traces.pop().expect("one lane leaves one trace");
    Ok(Verdict { trace, gate })
}
