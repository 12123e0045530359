//! An oracle with less than the truth: a depth buffer of fewer pixels, of a coarser format, of an earlier
//! frame, or that overlooks what is small. Each is what some engine does to save time, and each may say
//! "hidden" of what shows: not for a verdict, but to see what accuracy costs (Intel's masked software
//! occlusion culling rasterizes into a small buffer: Hasselgren, Andersson & Akenine-Möller 2016; asking the
//! last frame's depth and contribution culling are common practice).
//!
//! 1. What is drawn is rendered by the reference at the buffer's own size.
//! 2. A rectangle becomes the buffer's pixels that it meets, whole; a hull is asked about by the rectangle
//!    around it; a box counts as visible unasked.
//! 3. It is visible where more samples than the threshold are at its depth or beyond, a sample standing for
//!    as many as the buffer leaves out. Both depths are rounded to the format.

use std::collections::VecDeque;

use super::batches::Batches;
use super::{Answer, FrameView, Memory, Oracle, OracleError, Proxy, QueryId, ReadBack, Sim, Stage};
use crate::part::PartId;
use crate::scene::Viewport;

/// How a depth is stored.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthFormat {
    /// A float of 32 bits: every depth as it is.
    #[default]
    Float32,
    /// 2²⁴ − 1 steps from the near to the far plane.
    Unorm24,
    /// 2¹⁶ − 1 steps.
    Unorm16,
}

impl DepthFormat {
    /// The nearest depth that the format has, in [−1, 1].
    #[must_use]
    pub fn stored(self, depth: f32) -> f32 {
        let steps = match self {
            Self::Float32 => return depth,
            Self::Unorm24 => f64::from((1_u32 << 24) - 1),
            Self::Unorm16 => f64::from((1_u32 << 16) - 1),
        };
        ((f64::from(depth) * steps).round_ties_even() / steps) as f32
    }
}

/// What the buffer lacks; the default lacks nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BufferKnobs {
    /// Pixels of the view along a side of one of the buffer's, at least 1.
    pub divisor: u32,
    /// How depth is stored.
    pub format: DepthFormat,
    /// What shows no more pixels than this is hidden.
    pub threshold: u64,
    /// So many frames old is the depth that is asked. Before there is one, all is visible.
    pub age: u32,
}

impl Default for BufferKnobs {
    fn default() -> Self {
        Self { divisor: 1, format: DepthFormat::Float32, threshold: 0, age: 0 }
    }
}

/// The oracle.
pub struct Approximate {
    name: &'static str,
    /// Draws at the buffer's size.
    sim: Sim,
    knobs: BufferKnobs,
    width: u32,
    /// Depths as stored, of this frame up to the last question, or of the frame that is asked.
    buffer: Option<Vec<f32>>,
    /// Those of the last frames, the oldest first.
    past: VecDeque<Vec<f32>>,
    started: bool,
    answers: Batches,
}

impl Approximate {
    /// A buffer over the stage, for frames of one view: with several, ages count views.
    ///
    /// # Panics
    /// For a divisor of 0, and where the stage has not enough memory for its largest mesh.
    #[must_use]
    pub fn new(stage: Stage, knobs: BufferKnobs) -> Self {
        let Viewport { width, height } = stage.viewport;
        let [width, height] = [width, height].map(|side| side.div_ceil(knobs.divisor));
        let sim = Sim::new(Stage { viewport: Viewport { width, height }, ..stage });
        let (buffer, past) = (None, VecDeque::new());
        let (name, answers) = ("approximate", Batches::default());
        Self { name, sim, knobs, width, buffer, past, started: false, answers }
    }

    /// Answers from the depth that the frame before left, at full size: what engines do that do not wait.
    ///
    /// # Panics
    /// As [`Approximate::new`].
    #[must_use]
    pub fn last_frame(stage: Stage) -> Self {
        let knobs = BufferKnobs { age: 1, ..BufferKnobs::default() };
        Self { name: "last-frame", ..Self::new(stage, knobs) }
    }

    fn stored(&mut self) -> Vec<f32> {
        let format = self.knobs.format;
        let mut depths = self.sim.image().depths();
        depths.iter_mut().for_each(|depth| *depth = format.stored(*depth));
        depths
    }

    fn shows(&self, min: [u32; 2], max: [u32; 2], depth: f32) -> bool {
        let Some(buffer) = &self.buffer else { return true };
        let BufferKnobs { divisor, format, threshold, .. } = self.knobs;
        let depth = format.stored(depth);
        let columns = (min[0] / divisor) as usize..max[0].div_ceil(divisor) as usize;
        let rows = (min[1] / divisor) as usize..max[1].div_ceil(divisor) as usize;
        let needed = threshold / (u64::from(divisor) * u64::from(divisor)) + 1;
        let mut seen = 0;
        rows.into_iter().any(|row| {
            let from = row * self.width as usize;
            let row = &buffer[from + columns.start..from + columns.end];
            seen += row.iter().filter(|&&stored| stored >= depth).count() as u64;
            seen >= needed
        })
    }
}

impl Oracle for Approximate {
    fn name(&self) -> &'static str {
        self.name
    }

    fn memory(&self) -> Option<Memory> {
        self.sim.memory()
    }

    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError> {
        self.buffer = None;
        // A run begins, perhaps once more.
        if view.frame == 0 {
            self.past.clear();
            self.started = false;
        }
        if self.knobs.age > 0 {
            if self.started {
                let left = self.stored();
                self.past.push_back(left);
            }
            // After as many frames as the age, the oldest is the one to ask.
            if self.past.len() == self.knobs.age as usize {
                self.buffer = self.past.pop_front();
            }
        }
        self.started = true;
        self.answers.clear();
        self.sim.begin_frame(view)
    }

    fn draw_part(&mut self, part: PartId) {
        if self.knobs.age == 0 {
            self.buffer = None;
        }
        self.sim.draw_part(part);
    }

    fn ask(&mut self, proxies: &[Proxy]) -> QueryId {
        if self.knobs.age == 0 && self.buffer.is_none() && !proxies.is_empty() {
            self.buffer = Some(self.stored());
        }
        let visible = proxies.iter().any(|proxy| match *proxy {
            Proxy::Rectangle { min, max, depth } | Proxy::Hull { min, max, depth, .. } => {
                self.shows(min, max, depth)
            }
            Proxy::Box { .. } => true,
        });
        self.answers.answer(visible)
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        self.answers.submit();
        self.sim.submit()
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        self.answers.collect(answers);
        self.sim.collect(&mut Vec::new())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        // Its image is not the view's.
        Ok(None)
    }

    fn redraw(&mut self, _: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formats_round_to_their_steps() {
        let step = 1.0 / f64::from(u16::MAX);
        let under = (0.5 - step * 0.49) as f32;
        for format in [DepthFormat::Float32, DepthFormat::Unorm24, DepthFormat::Unorm16] {
            for end in [-1.0, 0.0, 1.0] {
                assert_eq!(format.stored(end), end);
            }
            assert!((format.stored(under) - under).abs() < step as f32);
            assert_eq!(format.stored(format.stored(under)), format.stored(under));
        }
        assert_eq!(DepthFormat::Float32.stored(under), under);
        let [fine, coarse] = [DepthFormat::Unorm24, DepthFormat::Unorm16];
        assert_ne!(coarse.stored(under), under);
        assert!((fine.stored(under) - under).abs() < (coarse.stored(under) - under).abs());
    }
}
