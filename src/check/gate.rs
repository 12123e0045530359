//! The gate: all checks of one lane, and the short way to put a culler of one's own through them.

use std::fmt;

use super::{Conservative, CountsCheck, Determinism, DeviceImage, Excess, ImageCheck, Invariants};
use crate::cull::{Culler, CullerSetup, PerView, ProxyKind};
use crate::index::INDEXES;
use crate::oracle::{CostModel, Oracle, Sim};
use crate::part::PartitionKnobs;
use crate::run::{
    self, FrameRecord, FrameTrace, Lane, LaneInfo, Moment, Observer, Repeat, RunError, Trace, World,
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
    /// Promises made on the way.
    pub invariants: Invariants,
    /// Whether parts may be missing for some frames: then pictures may lack them, and are not compared.
    late: bool,
}

impl Observer for Gate {
    fn frame(&mut self, record: &FrameRecord<'_>) {
        self.conservative.frame(record);
        if !self.late {
            self.image.frame(record);
            self.device_image.frame(record);
        }
        self.counts.frame(record);
        self.excess.frame(record);
    }

    fn broken(&mut self, moment: Moment, promise: &str) {
        self.invariants.broken(moment, promise);
    }

    fn repeated(&mut self, first: &FrameTrace, again: &FrameTrace) {
        self.determinism.repeated(first, again);
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

    /// The verdict in a word: `held`, `failed`, or `held late(k)` where parts that show were missing, for k
    /// frames at most, and that was allowed.
    #[must_use]
    pub fn word(&self) -> String {
        match (self.held(), self.conservative.latest()) {
            (false, _) => "failed".to_owned(),
            (true, 0) => "held".to_owned(),
            (true, latest) => format!("held late({latest})"),
        }
    }

    /// Whether everything held.
    #[must_use]
    pub fn held(&self) -> bool {
        self.failures().is_empty()
    }

    /// When something failed first; the counts' failure has no earlier time than its own frame.
    #[must_use]
    pub fn first_failure(&self) -> Option<Moment> {
        let misses = self.conservative.misses().iter().map(|miss| miss.moment);
        let images = self.image.differences().iter().chain(self.device_image.differences());
        let images = images.map(|difference| difference.moment);
        let others = [self.determinism.first_difference(), self.counts.overcounted()];
        let broken = self.invariants.first().map(|(moment, _)| moment);
        misses.chain(images).chain(others.into_iter().flatten()).chain(broken).min()
    }

    /// Each failure as a line: frame, part, pixel.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut lines = Vec::new();
        let misses = self.conservative.misses();
        for miss in misses.iter().take(NAMED_MISSES) {
            let [x, y] = miss.first_pixel;
            lines.push(format!(
                "set: {} part {} is visible in {} pixels, first at ({x}, {y}), and was not drawn",
                miss.moment, miss.part.0, miss.pixels
            ));
        }
        if misses.len() > NAMED_MISSES {
            lines.push(format!("set: {} more misses", misses.len() - NAMED_MISSES));
        }
        let images = [
            ("image", self.image.differences()),
            ("device image", self.device_image.differences()),
        ];
        for (check, differences) in images {
            if let Some(first) = differences.first() {
                let [x, y] = first.first_pixel;
                lines.push(format!(
                    "{check}: {} frames differ, first {} in {} pixels, first at ({x}, {y})",
                    differences.len(),
                    first.moment,
                    first.pixels
                ));
            }
        }
        if let Some(moment) = self.determinism.first_difference() {
            let event = self.determinism.first_event();
            lines.push(format!("determinism: {moment} left another trace when run again: {event}"));
        }
        if let Some(moment) = self.counts.overcounted() {
            lines.push(format!("counts: {moment} has more answers than questions"));
        }
        if let Some((moment, promise)) = self.invariants.first() {
            let count = self.invariants.count();
            lines.push(format!("invariant: {count} frames break one, first {moment}: {promise}"));
        }
        lines
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
/// What the oracle said; the simulated device never gives up.
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
