//! Oracles answer "would this contribute?": ask now, collect later. One oracle per file behind
//! [`Oracle`]; `always` is the stupid one. Only `wgpu/` names wgpu. An oracle must not know indexes
//! or cullers; it knows the parts it may be told to draw.
//!
//! # The contract
//! A frame is a command stream. Draws compare *less* and write depth; a question compares
//! *less-or-equal* against what was drawn **before it in the stream** and writes nothing. `submit`
//! ends a batch; `collect` waits for the oldest batch not yet collected and hands its answers over in
//! asking order, so that no culler sees arrival times. An answer may err only towards "visible".

mod always;
mod approximate;
mod batches;
mod cost;
mod device_limits;
mod fit;
pub mod hierarchical_z;
mod maxima;
mod proxy_mesh;
mod residency;
mod sim;
mod simulated;
mod tables;
mod tie;
#[cfg_attr(not(feature = "hardware"), path = "no_wgpu.rs")]
pub mod wgpu;

use std::sync::Arc;

use plainsight_reference::fast::Options;
use plainsight_reference::{Image, Tolerance};

use crate::math::{HULL_SUBPIXELS, Hull};
use crate::part::{PartId, Partition};
use crate::scene::{DepthOrder, Viewport};

pub use always::Always;
pub use approximate::{Approximate, BufferKnobs, DepthFormat};
pub use cost::{Amounts, CostModel};
pub use device_limits::{DeviceLimits, QUERIES_PER_PASS};
pub use fit::{FitError, Measurement};
pub use hierarchical_z::HierarchicalZ;
#[cfg(feature = "hardware")]
use proxy_mesh::{box_proxy_triangles, hull_proxy_triangles, rectangle_triangles};
use residency::Replayed;
pub use residency::{Memory, MemoryKnobs, Residency, Step, least_budget, mesh_bytes};
pub use sim::{Sim, part_draw, part_instance};
pub use simulated::{Clock, Latency, Misbehaviour, Schedule, Simulated, WATCHDOG_NS};
pub use tables::Tables;
pub use tie::Tie;

/// What an oracle is told at the start of a frame.
#[derive(Clone, Copy, Debug)]
pub struct FrameView<'a> {
    /// Frame number t.
    pub frame: u32,
    /// Object-to-clip matrix of each object, column-major, composed in f64 and rounded once.
    pub clip_from_object: &'a [[f32; 16]],
}

/// The conservative stand-in that is asked about in place of geometry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Proxy {
    /// A rectangle of whole pixels, columns `min[0]..max[0]`, rows `min[1]..max[1]` (row 0 on top),
    /// within the viewport and not empty, at one depth between the planes.
    Rectangle {
        /// First column and row.
        min: [u32; 2],
        /// One beyond the last column and row.
        max: [u32; 2],
        /// Depth of every sample.
        depth: f32,
    },
    /// A convex polygon at one depth between the planes. An oracle that answers rectangles alone takes the one
    /// around it, at the same depth: that errs towards "visible" only.
    Hull {
        /// The polygon, within the rectangle.
        hull: Hull,
        /// First column and row of the rectangle.
        min: [u32; 2],
        /// One beyond its last column and row.
        max: [u32; 2],
        /// Depth of every sample.
        depth: f32,
    },
    /// The twelve triangles of a box with interpolated depth.
    Box {
        /// Clip from the box's space, column-major.
        clip_from_box: [f32; 16],
        /// Smallest corner, already inflated.
        min: [f32; 3],
        /// Largest corner, already inflated.
        max: [f32; 3],
    },
}

/// Square sub-pixels of a hull's grid in a pixel.
const SQUARE_SUBPIXELS: u64 = (HULL_SUBPIXELS as u64) * (HULL_SUBPIXELS as u64);

impl Proxy {
    /// Samples that it covers; of a hull its area in pixels, rounded up, which is as many but for those
    /// along its outline; 0 for a box, whose fill is not known before it is projected.
    #[must_use]
    pub fn pixels(&self) -> u64 {
        match self {
            Self::Rectangle { min, max, .. } => {
                u64::from(max[0] - min[0]) * u64::from(max[1] - min[1])
            }
            Self::Hull { hull, .. } => hull.twice_area().div_ceil(2 * SQUARE_SUBPIXELS),
            Self::Box { .. } => 0,
        }
    }
}

/// A question's number in its frame, counted from zero in asking order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct QueryId(pub u32);

/// What came back for one question.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Answer {
    /// Which question of the frame.
    pub query: QueryId,
    /// Whether any sample passed.
    pub visible: bool,
}

/// Images that a device gave back. Row 0 is on top; `width × height` entries each.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadBack {
    /// Depth, that of the far plane where nothing was drawn.
    pub depth: Vec<f32>,
    /// Part id plus one, 0 where nothing was drawn. `None` where only depth was asked for.
    pub parts: Option<Vec<u32>>,
}

/// What an oracle works on, fixed for a run.
#[derive(Clone, Debug)]
pub struct Stage {
    /// The parts that may be drawn.
    pub partition: Arc<Partition>,
    /// Pixels.
    pub viewport: Viewport,
    /// Which way depth runs.
    pub depth: DepthOrder,
    /// How an oracle that is a reference renderer draws; no answer depends on it.
    pub render: Options,
    /// The memory that each oracle's device has for meshes; `None` holds all of them.
    pub memory: Option<MemoryKnobs>,
}

impl Stage {
    /// Drawn in the default way, depth forward, with memory for everything.
    #[must_use]
    pub fn new(partition: Arc<Partition>, viewport: Viewport) -> Self {
        Self {
            partition,
            viewport,
            depth: DepthOrder::Forward,
            render: Options::default(),
            memory: None,
        }
    }
}

/// How questions are put to a real device. The answers are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Questions {
    /// An occlusion query object each.
    #[default]
    Queries,
    /// Rectangles by maxima of the depth target on the device. A hull is asked about by the rectangle
    /// around it. A box has none: it counts as visible unasked.
    Pyramid,
    /// The same by maxima on this side, of depth that is read back.
    ReadBack,
}

impl Questions {
    /// All there are.
    pub const ALL: [Self; 3] = [Self::Queries, Self::Pyramid, Self::ReadBack];

    /// The name of the oracle that asks so.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Queries => "hardware",
            Self::Pyramid => "pyramid",
            Self::ReadBack => "read-back",
        }
    }

    /// The way of the oracle of that name; `None` for one that is no real device.
    #[must_use]
    pub fn of(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|questions| questions.name() == name)
    }
}

/// Bytes of a MiB.
pub const MIB: u64 = 1 << 20;

/// Why an oracle could not go on.
#[derive(Clone, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OracleError {
    /// No device was found where one was required.
    #[error("no Vulkan device: {0}")]
    NoDevice(String),
    /// The device went away or refused in the middle of a run.
    #[error("device lost: {0}")]
    Lost(String),
    /// A mesh does not fit the memory that devices are given.
    #[error(
        "{:.2} MiB of device memory do not hold the largest mesh; give at least {} MiB",
        *budget as f64 / MIB as f64,
        least.div_ceil(MIB)
    )]
    Budget {
        /// Bytes given.
        budget: u64,
        /// Bytes of the largest mesh.
        least: u64,
    },
}

/// Answers visibility questions about a frame while it is being drawn.
pub trait Oracle {
    /// Name for reports: `always`, `sim`, or one of [`Questions`].
    fn name(&self) -> &'static str;

    /// The adapter's name where a real device draws.
    fn device(&self) -> Option<String> {
        None
    }

    /// How far its images may stand from the reference's: what the device declares, to be held to.
    fn tolerance(&self) -> Tolerance {
        Tolerance::EXACT
    }

    /// What the frame so far meant for the device's memory, where that is limited.
    fn memory(&self) -> Option<Memory> {
        None
    }

    /// What its virtual clock says, where it has one.
    fn clock(&self) -> Option<Clock> {
        None
    }

    /// Clears depth to the far plane's and forgets all questions.
    ///
    /// # Errors
    /// Where the device is lost.
    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError>;

    /// Draws one part into the frame, at this point of the stream.
    fn draw_part(&mut self, part: PartId);

    /// Asks, at this point of the stream, whether any sample of any of `proxies` would pass: one
    /// question about all of them. About none the answer is "hidden".
    fn ask(&mut self, proxies: &[Proxy]) -> QueryId;

    /// Ends the batch: everything since the last submit goes to the device, even if nothing asks.
    ///
    /// # Errors
    /// Where the device is lost.
    fn submit(&mut self) -> Result<(), OracleError>;

    /// Waits for the oldest batch not yet collected and appends its answers in asking order.
    /// Appends nothing where no batch is outstanding.
    ///
    /// # Errors
    /// Where the device is lost.
    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError>;

    /// The depth that the frame's own draws left, after an implied submit. `None` where the oracle
    /// keeps no image.
    ///
    /// # Errors
    /// Where the device is lost.
    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError>;

    /// What the frame's own draws left, where the oracle is a reference renderer, complete after
    /// [`Oracle::submit`]: then nobody need render the drawn parts once more to compare them.
    fn reference_image(&self) -> Option<&Image> {
        None
    }

    /// Whether every promise of its own books holds (tables over depths, meshes in memory), to be asked after
    /// a frame; slow.
    ///
    /// # Errors
    /// The first broken promise, in words.
    fn check(&self) -> Result<(), String> {
        Ok(())
    }

    /// Draws `parts` (ascending) from scratch in draw-index order under the frame's matrices, into
    /// images of its own, and reads depth and part ids back. The frame's own images stay. `None`
    /// where no real device draws.
    ///
    /// # Errors
    /// Where the device is lost.
    fn redraw(&mut self, parts: &[PartId]) -> Result<Option<ReadBack>, OracleError>;
}
