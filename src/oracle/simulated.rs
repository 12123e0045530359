//! The simulated device, whole: the reference rasterizer (or another oracle) behind a command stream with a virtual clock.
//! Draws and questions take the time that a cost model says, batches one after the other; answers come
//! back after a latency drawn from a seed, so that a later batch may be back before an earlier one. A
//! [`Schedule`] says what else the device does to its user: legally, some hidden answers come back as
//! "visible" (WebGPU promises zero or not zero, and a device may over-count); illegally, it is lost, hangs,
//! leaves an entry unwritten or answers one question otherwise than it should. The first two end in an
//! error, the third in "visible": WebGPU reads such an entry as zero, that is "occluded", so an oracle must
//! know which of its entries were written. The last is "visible" in the place of "hidden", once: where that
//! is in a frame that is run twice, the device did not repeat.
//!
//! Counts are no part of the contract: what comes back is a boolean, as from a device that answers
//! 1 for any sample. Everything is a function of the schedule and of what is asked, so that it replays.

use std::collections::VecDeque;
use std::fmt;
use std::str::FromStr;

use plainsight_reference::Image;

use super::{
    Answer, CostModel, FrameView, Memory, Oracle, OracleError, Proxy, QueryId, ReadBack, Sim, Stage,
};
use crate::part::PartId;
use crate::scene::Stream;

/// How long the device may be silent, virtual nanoseconds: what Windows gives a driver before it resets it,
/// two seconds.
pub const WATCHDOG_NS: u64 = 2_000_000_000;

/// How late answers are, beyond the work itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Latency {
    /// As the cost model has it.
    #[default]
    Even,
    /// From nothing to four times that, each batch by itself.
    Jittery,
    /// Mostly that, and one batch in eight fifty times as late: others overtake it.
    Spiky,
}

impl Latency {
    /// Its name in flags and reports.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Even => "even",
            Self::Jittery => "jittery",
            Self::Spiky => "spiky",
        }
    }
}

/// What no device may do, once in a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Misbehaviour {
    /// The device goes away at the given submit, counted from 0 over the run.
    Lost(u32),
    /// The given submit never ends.
    Hangs(u32),
    /// The answer to the given question, counted from 0 over the run, is never written.
    Unwritten(u32),
    /// A hidden answer comes back as "visible", and does not where the frame is run another time: that to the
    /// given question, counted from 0 over the run and its repetitions.
    Flips(u32),
}

impl Misbehaviour {
    /// Whether it ends the run in an error.
    #[must_use]
    pub const fn is_fatal(self) -> bool {
        matches!(self, Self::Lost(_) | Self::Hangs(_))
    }
}

impl fmt::Display for Misbehaviour {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Lost(submit) => write!(f, "lost={submit}"),
            Self::Hangs(submit) => write!(f, "hangs={submit}"),
            Self::Unwritten(question) => write!(f, "unwritten={question}"),
            Self::Flips(question) => write!(f, "flips={question}"),
        }
    }
}

impl FromStr for Misbehaviour {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            format!(
                "'{text}' is none: write lost=N or hangs=N (a submit, counted from 0 over the run), unwritten=N or flips=N (a question)"
            )
        };
        let (kind, number) = text.split_once('=').ok_or_else(wrong)?;
        let number = number.parse().map_err(|_| wrong())?;
        match kind {
            "lost" => Ok(Self::Lost(number)),
            "hangs" => Ok(Self::Hangs(number)),
            "unwritten" => Ok(Self::Unwritten(number)),
            "flips" => Ok(Self::Flips(number)),
            _ => Err(wrong()),
        }
    }
}

/// What the device does, a function of its seed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Schedule {
    /// Seed of its streams.
    pub seed: u64,
    /// When answers come.
    pub latency: Latency,
    /// Share of hidden answers that come back as "visible", in [0, 1].
    pub doubt: f64,
    /// What goes wrong.
    pub misbehaviour: Option<Misbehaviour>,
}

/// What the virtual clock says of a run so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Clock {
    /// Nanoseconds since the run began, as the user's side sees them.
    pub now_ns: u64,
    /// Nanoseconds of these that it waited for answers.
    pub waited_ns: u64,
    /// Batches that were back before an earlier one.
    pub overtakes: u32,
    /// Answers that were "visible" without cause.
    pub false_visible: u32,
    /// Answers that were never written and taken for "visible".
    pub unwritten: u32,
}

/// A batch on its way.
struct Flight {
    arrives_ns: Option<u64>,
}

/// The device.
pub struct Simulated {
    /// What answers.
    sim: Box<dyn Oracle>,
    stage: Stage,
    model: CostModel,
    schedule: Schedule,
    latency: Stream,
    doubt: Stream,
    clock: Clock,
    /// When the device has done all that was submitted.
    busy_until_ns: u64,
    /// Work since the last submit.
    open_ns: f64,
    flights: VecDeque<Flight>,
    submits: u32,
    questions: u32,
    lost: bool,
}

impl Simulated {
    /// An oracle of its own over the stage.
    ///
    /// # Panics
    /// Where the stage has not enough memory for its largest mesh.
    #[must_use]
    pub fn new(stage: Stage, model: CostModel, schedule: Schedule) -> Self {
        Self::over(Box::new(Sim::new(stage.clone())), stage, model, schedule)
    }

    /// The same over another oracle than the reference, which answers at once.
    #[must_use]
    pub fn over(sim: Box<dyn Oracle>, stage: Stage, model: CostModel, schedule: Schedule) -> Self {
        Self {
            sim,
            stage,
            model,
            schedule,
            latency: Stream::new(schedule.seed, "latency"),
            doubt: Stream::new(schedule.seed, "doubt"),
            clock: Clock::default(),
            busy_until_ns: 0,
            open_ns: 0.0,
            flights: VecDeque::new(),
            submits: 0,
            questions: 0,
            lost: false,
        }
    }

    fn still_there(&self) -> Result<(), OracleError> {
        if self.lost {
            return Err(OracleError::Lost("the simulated device went away".to_owned()));
        }
        Ok(())
    }

    /// How long after its work a batch's answers are back.
    fn latency_ns(&mut self) -> f64 {
        let usual = self.model.trip_ns;
        match self.schedule.latency {
            Latency::Even => usual,
            Latency::Jittery => usual * self.latency.range(0.0, 4.0),
            Latency::Spiky if self.latency.below(8) == 0 => usual * 50.0,
            Latency::Spiky => usual,
        }
    }
}

impl Oracle for Simulated {
    fn name(&self) -> &'static str {
        "simulated"
    }

    fn memory(&self) -> Option<Memory> {
        self.sim.memory()
    }

    fn clock(&self) -> Option<Clock> {
        Some(self.clock)
    }

    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError> {
        self.still_there()?;
        self.flights.clear();
        // Each frame has streams of its own, so that one run again meets the same device.
        let stream =
            |name: &str| Stream::new(self.schedule.seed, &format!("{name} {}", view.frame));
        (self.latency, self.doubt) = (stream("latency"), stream("doubt"));
        // What the frame costs beside its draws and questions is the user's own time.
        self.clock.now_ns += self.model.frame_ns as u64;
        self.open_ns = 0.0;
        self.sim.begin_frame(view)
    }

    fn draw_part(&mut self, part: PartId) {
        let triangles = f64::from(self.stage.partition.part(part).triangle_count);
        self.open_ns += self.model.part_ns + self.model.triangle_ns * triangles;
        self.sim.draw_part(part);
    }

    fn ask(&mut self, proxies: &[Proxy]) -> QueryId {
        let pixels: u64 = proxies.iter().map(Proxy::pixels).sum();
        self.open_ns += self.model.query_ns
            + self.model.proxy_ns * proxies.len() as f64
            + self.model.pixel_ns * pixels as f64;
        self.sim.ask(proxies)
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        self.still_there()?;
        let (number, misbehaviour) = (self.submits, self.schedule.misbehaviour);
        self.submits += 1;
        if misbehaviour == Some(Misbehaviour::Lost(number)) {
            self.lost = true;
        }
        self.still_there()?;
        let begins = self.busy_until_ns.max(self.clock.now_ns);
        self.busy_until_ns = begins + self.open_ns as u64;
        self.open_ns = 0.0;
        let back = self.busy_until_ns + self.latency_ns() as u64;
        let arrives_ns = (misbehaviour != Some(Misbehaviour::Hangs(number))).then_some(back);
        let overtakes = |flight: &Flight| flight.arrives_ns.is_none_or(|earlier| back < earlier);
        self.clock.overtakes += u32::from(self.flights.iter().any(overtakes));
        self.flights.push_back(Flight { arrives_ns });
        self.sim.submit()
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        self.still_there()?;
        let Some(Flight { arrives_ns }) = self.flights.pop_front() else { return Ok(()) };
        let silent = |until: u64| until.saturating_sub(self.clock.now_ns) > WATCHDOG_NS;
        let Some(arrives_ns) = arrives_ns.filter(|&until| !silent(until)) else {
            self.lost = true;
            let seconds = WATCHDOG_NS / 1_000_000_000;
            let what = format!("the simulated device gave no answer for {seconds} s");
            return Err(OracleError::Lost(what));
        };
        let waits = arrives_ns.saturating_sub(self.clock.now_ns);
        self.clock.waited_ns += waits;
        self.clock.now_ns += waits;
        let before = answers.len();
        self.sim.collect(answers)?;
        for answer in &mut answers[before..] {
            let number = self.questions;
            self.questions += 1;
            if self.schedule.misbehaviour == Some(Misbehaviour::Unwritten(number)) {
                self.clock.unwritten += 1;
                answer.visible = true;
            }
            answer.visible |= self.schedule.misbehaviour == Some(Misbehaviour::Flips(number));
            // Drawn for every answer, so that what is drawn for the next does not depend on this one.
            let doubted = self.doubt.unit() < self.schedule.doubt;
            if doubted && !answer.visible {
                self.clock.false_visible += 1;
                answer.visible = true;
            }
        }
        Ok(())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        self.still_there()?;
        self.sim.read_back()
    }

    fn check(&self) -> Result<(), String> {
        self.sim.check()
    }

    fn reference_image(&self) -> Option<&Image> {
        self.sim.reference_image()
    }

    fn redraw(&mut self, parts: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        self.still_there()?;
        self.sim.redraw(parts)
    }
}
