//! Tables of maxima over the reference's depth: the questions of `read-back`, without a device. The depth so far
//! is laid out as a device hands it back, rows padded to [`ROW_SAMPLES`], and rectangles are answered by
//! `maxima`, exactly. A hull is asked about by the rectangle around it; a box counts as visible unasked.

use super::batches::Batches;
use super::maxima::{DepthMaxima, DepthRows};
use super::{Answer, FrameView, Memory, Oracle, OracleError, Proxy, QueryId, ReadBack, Sim, Stage};
use crate::part::PartId;

/// Rows of a picture that is read back begin at multiples of so many samples: WebGPU asks for 256 bytes.
const ROW_SAMPLES: usize = 64;
/// Depth of the samples that pad a row, no depth of a picture: one that looks at them says so.
const PADDING: f32 = f32::INFINITY;

/// The oracle.
pub struct Tables {
    /// Draws; is never asked.
    sim: Sim,
    width: usize,
    stride: usize,
    samples: Vec<f32>,
    maxima: DepthMaxima,
    /// Whether the tables are those of all that is drawn.
    current: bool,
    answers: Batches,
}

impl Tables {
    /// An image of its own over the stage.
    ///
    /// # Panics
    /// Where the stage has not enough memory for its largest mesh.
    #[must_use]
    pub fn new(stage: Stage) -> Self {
        let width = stage.viewport.width as usize;
        Self {
            sim: Sim::new(stage),
            width,
            stride: width.next_multiple_of(ROW_SAMPLES),
            samples: Vec::new(),
            maxima: DepthMaxima::default(),
            current: false,
            answers: Batches::default(),
        }
    }

    fn rows(&self) -> DepthRows<'_> {
        let (width, stride) = (self.width, self.stride);
        DepthRows { samples: &self.samples, stride, width, height: self.samples.len() / stride }
    }

    fn may_show(&mut self, min: [u32; 2], max: [u32; 2], depth: f32) -> bool {
        if !self.current {
            self.samples.clear();
            for row in self.sim.image().depths().chunks(self.width) {
                self.samples.extend_from_slice(row);
                self.samples.resize(self.samples.len().next_multiple_of(self.stride), PADDING);
            }
            let mut maxima = std::mem::take(&mut self.maxima);
            maxima.renew(self.rows());
            self.maxima = maxima;
            self.current = true;
        }
        self.maxima.any(self.rows(), min, max, depth)
    }
}

impl Oracle for Tables {
    fn name(&self) -> &'static str {
        "tables"
    }

    fn memory(&self) -> Option<Memory> {
        self.sim.memory()
    }

    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError> {
        self.current = false;
        self.answers.clear();
        self.sim.begin_frame(view)
    }

    fn draw_part(&mut self, part: PartId) {
        self.current = false;
        self.sim.draw_part(part);
    }

    fn ask(&mut self, proxies: &[Proxy]) -> QueryId {
        let visible = proxies.iter().any(|proxy| match *proxy {
            Proxy::Rectangle { min, max, depth } | Proxy::Hull { min, max, depth, .. } => {
                self.may_show(min, max, depth)
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
        self.sim.read_back()
    }

    fn check(&self) -> Result<(), String> {
        if self.current {
            self.maxima.check(self.rows())?;
        }
        self.sim.check()
    }

    fn reference_image(&self) -> Option<&plainsight_reference::Image> {
        self.sim.reference_image()
    }

    fn redraw(&mut self, _: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        Ok(None)
    }
}
