//! Faults between a culler and its answers: a sound oracle whose questions, draws or answers are handed on
//! wrongly, asked by two-pass culling.

use std::sync::Arc;

use super::{Fault, Rig, two_pass};
use crate::oracle::{
    Answer, FrameView, Memory, Oracle, OracleError, Proxy, QueryId, ReadBack, Sim, Stage,
};
use crate::part::{PartId, Partition};

/// What is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flaw {
    /// Zero is taken for visible.
    Inverted,
    /// A query counts the next one's draw as well.
    NextDraw,
    /// Objects and query slots are one apart.
    SlotsDrift,
    /// A slot hands out the verdict of whoever had it before.
    RecycledSlot,
    /// The query draws less than the box that stands for the part.
    TighterQuery,
    /// Slots beyond the first few of a batch are never written and read as zero.
    NeverWritten,
    /// Questions are answered before the draws of their own batch are in the buffer.
    WithoutNearer,
    /// Triangles that clipping makes do not fit the queue, and their part is dropped as an occluder.
    ShortClipQueue,
}

/// Slots that are written where others are not.
const WRITTEN: usize = 48;
/// Clipped triangles of one part that fit the queue.
const CLIP_QUEUE: usize = 4;

struct Wrong {
    inner: Sim,
    partition: Arc<Partition>,
    flaw: Flaw,
    matrices: Vec<[f32; 16]>,
    /// Draws that are not handed on yet.
    held: Vec<PartId>,
    /// The verdict of each slot, as it was last used.
    slots: Vec<bool>,
}

impl Wrong {
    fn new(stage: Stage, flaw: Flaw) -> Self {
        let partition = Arc::clone(&stage.partition);
        let (matrices, held, slots) = (Vec::new(), Vec::new(), Vec::new());
        Self { inner: Sim::new(stage), partition, flaw, matrices, held, slots }
    }

    fn overflows_queue(&self, part: PartId) -> bool {
        let (object, local) = self.partition.locate(part);
        let mesh = self.partition.mesh(object);
        let this = &mesh.parts[local as usize];
        let m = &self.matrices[object.0 as usize];
        let before = |[x, y, z]: [f32; 3]| m[2] * x + m[6] * y + m[10] * z + m[14] < 0.0;
        let positions = mesh.positions_of(this);
        let crosses = |triangle: &&[u32; 3]| {
            let count = triangle.iter().filter(|&&v| before(positions[v as usize])).count();
            (1..3).contains(&count)
        };
        mesh.triangles_of(this).0.iter().filter(crosses).count() > CLIP_QUEUE
    }
}

impl Oracle for Wrong {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn memory(&self) -> Option<Memory> {
        self.inner.memory()
    }

    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError> {
        self.matrices = view.clip_from_object.to_vec();
        self.held.clear();
        self.inner.begin_frame(view)
    }

    fn draw_part(&mut self, part: PartId) {
        match self.flaw {
            Flaw::WithoutNearer => self.held.push(part),
            Flaw::ShortClipQueue if self.overflows_queue(part) => {}
            _ => self.inner.draw_part(part),
        }
    }

    fn ask(&mut self, proxies: &[Proxy]) -> QueryId {
        if self.flaw != Flaw::TighterQuery {
            return self.inner.ask(proxies);
        }
        let tighter = |proxy: &Proxy| match *proxy {
            Proxy::Rectangle { min, max, depth } => {
                let quarter = |axis: usize| (max[axis] - min[axis]) / 4;
                let min = [min[0] + quarter(0), min[1] + quarter(1)];
                let max = [max[0] - quarter(0), max[1] - quarter(1)];
                Proxy::Rectangle { min, max, depth }
            }
            other => other,
        };
        self.inner.ask(&proxies.iter().map(tighter).collect::<Vec<_>>())
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        self.held.drain(..).for_each(|part| self.inner.draw_part(part));
        self.inner.submit()
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        let first = answers.len();
        self.inner.collect(answers)?;
        let mine = &mut answers[first..];
        let said: Vec<bool> = mine.iter().map(|answer| answer.visible).collect();
        for (slot, answer) in mine.iter_mut().enumerate() {
            answer.visible = match self.flaw {
                Flaw::Inverted => !said[slot],
                Flaw::NextDraw => said[slot] || said.get(slot + 1).copied().unwrap_or(false),
                Flaw::SlotsDrift => said[slot.saturating_sub(1)],
                Flaw::RecycledSlot => self.slots.get(slot).copied().unwrap_or(said[slot]),
                Flaw::NeverWritten => said[slot] && slot < WRITTEN,
                _ => said[slot],
            };
        }
        if !said.is_empty() {
            self.slots = said;
        }
        Ok(())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        self.inner.read_back()
    }

    fn redraw(&mut self, parts: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        self.inner.redraw(parts)
    }
}

macro_rules! with {
    ($flaw:ident) => {
        Rig { oracle: |stage| Box::new(Wrong::new(stage, Flaw::$flaw)), ..two_pass::EXACT }
    };
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::overdraws(
        ("short-clip-queue", 31),
        "clipped triangles do not fit the queue, and their part hides nothing",
        &["hard/near-plane", "hard/eye-on-box"],
        (two_pass::EXACT, with!(ShortClipQueue)),
    ),
    Fault::drops(
        ("inverted-verdict", 32),
        "zero samples are taken for visible",
        &["hard/orthographic", "hard/layers"],
        (two_pass::EXACT, with!(Inverted)),
    ),
    Fault::overdraws(
        ("scope-includes-next", 33),
        "a query's scope includes the next draw",
        &["hard/orthographic", "hard/layers"],
        (two_pass::EXACT, with!(NextDraw)),
    ),
    Fault::drops(
        ("slots-drift", 34),
        "drawn objects and query slots are one apart",
        &["hard/orthographic", "hard/layers"],
        (two_pass::EXACT, with!(SlotsDrift)),
    ),
    Fault::drops(
        ("recycled-slot", 35),
        "a recycled slot keeps its old verdict",
        &["hard/teleports", "hard/ping-pong"],
        (two_pass::EXACT, with!(RecycledSlot)),
    ),
    Fault::drops(
        ("tighter-query", 37),
        "the query draws less than the box that is tested",
        &["hard/orthographic", "hard/layers"],
        (two_pass::EXACT, with!(TighterQuery)),
    ),
    Fault::drops(
        ("never-written", 41),
        "slots that were never written read as occluded",
        &["hard/orthographic", "hard/many"],
        (two_pass::EXACT, with!(NeverWritten)),
    ),
    Fault::overdraws(
        ("without-nearer", 57),
        "a question is answered against a buffer without the nearer one of its batch",
        &["hard/orthographic", "hard/layers"],
        (two_pass::EXACT, with!(WithoutNearer)),
    ),
];
