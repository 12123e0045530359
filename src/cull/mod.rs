//! Cullers: the per-frame algorithms. Each walks an index (or nothing) by its own policy, asks an
//! oracle through the [`Pen`], and draws the parts it takes for visible. One frame loop per file
//! behind [`Culler`]; `draw_all` is the stupid one. A culler must not know the truth.

mod adaptive;
mod chc;
mod chc_plus;
mod draw_all;
mod event;
pub mod full;
mod full_waits;
pub mod group;
mod journal;
mod layers;
mod opened;
mod pen;
mod per_view;
mod pipelined;
mod postponement;
mod scenery;
mod simple;
mod situation;
mod view;
mod view_frustum;

use std::sync::Arc;

use crate::index::Index;
use crate::math::Aabb;
use crate::oracle::{CostModel, OracleError};
use crate::part::Partition;

pub use adaptive::{Adaptive, AdaptiveKnobs};
pub use chc::Chc;
pub use chc_plus::{ChcPlus, ChcPlusKnobs};
pub use draw_all::DrawAll;
pub use event::{Asked, Event};
pub use full::{AfterGroup, Full, FullKnobs};
pub use full_waits::{FullWaits, FullWaitsKnobs};
pub use journal::{Journal, Question};
pub use pen::{Counts, Finished, Pen};
pub use per_view::PerView;
pub use pipelined::{Pipelined, PipelinedKnobs};
pub use postponement::Postponement;
pub use scenery::{Appearance, Item, NodeHistory, Scenery, SceneryKnobs, Weight};
pub use simple::Simple;
pub use situation::{Situation, Situations};
pub use view::{ObjectView, View};
pub use view_frustum::ViewFrustum;

/// Which stand-in is asked about.
///
/// What each costs, by `plainsight run --scene powerplant --scale 0.1 --frames 10 --culler full simple
/// --proxy …` and the same of `bunnies` at 0.1, `city` and `rooms` at 0.3; parts drawn and questions a
/// frame on the simulated device:
///
/// | | visible | rectangle | hull | box |
/// |---|---|---|---|---|
/// | powerplant, full | 41.9 | 58.5, 88.5 | 57.2, 84.0 | 68.9, 96.9 |
/// | powerplant, simple | | 57.6, 129.1 | 55.0, 122.4 | 58.6, 125.5 |
/// | bunnies, full | 64.5 | 78.3, 45.3 | 77.6, 46.8 | 78.0, 46.5 |
/// | bunnies, simple | | 75.5, 146.9 | 73.9, 145.9 | 73.6, 145.7 |
/// | city, full | 46.8 | 60.7, 91.1 | 60.5, 88.6 | 61.0, 89.5 |
/// | rooms, full | 26.1 | 38.8, 59.3 | 38.7, 59.7 | 38.0, 60.0 |
///
/// So a hull saves up to a twentieth of the parts and questions where boxes are seen at a slant, next to
/// nothing where they stand upright, and its questions are dearer to a reference renderer. The box, tightest
/// in theory, draws more than the hull in most scenes: it grows by a pixel on each side where a hull grows
/// by a quarter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ProxyKind {
    /// The projected corners' rectangle at the nearest depth: the provable one.
    #[default]
    Rectangle,
    /// The convex hull of the projected corners at that depth.
    Hull,
    /// The box itself, inflated, with interpolated depth.
    Box,
}

/// A per-frame culling algorithm.
pub trait Culler {
    /// Name for reports and replay lines.
    fn name(&self) -> &str;

    /// Draws one frame: every part that may be visible goes to [`Pen::draw`]. Frames come in order,
    /// from 0 on.
    ///
    /// # Errors
    /// What the oracle said, passed on.
    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError>;

    /// Whether every structural promise of the culler and its index holds, with the objects in these
    /// world boxes.
    ///
    /// # Errors
    /// The first broken promise, in words.
    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        let _ = boxes;
        Ok(())
    }

    /// The two levels as this culler walks them in one of the frame's views, so that others can say why it
    /// did what it did. `None` for one without; then no more is known of it than what it drew.
    fn scenery(&self, view: u32) -> Option<&Scenery> {
        let _ = view;
        None
    }

    /// What it remembers of a node after the frame of `view`, in words for people; `None` for nothing.
    fn recall(&self, view: &View<'_>, item: Item) -> Option<String> {
        let _ = (view, item);
        None
    }
}

/// What a culler is made from.
pub struct CullerSetup {
    /// The parts of the scene's objects.
    pub partition: Arc<Partition>,
    /// An index over the objects of frame 0.
    pub index: Box<dyn Index>,
    /// What to ask about.
    pub proxy: ProxyKind,
    /// What work costs the device, for cullers that weigh it.
    pub cost: CostModel,
}

/// A member of the family.
#[derive(Clone, Copy, Debug)]
pub struct CullerKind {
    /// Name for flags and reports.
    pub name: &'static str,
    /// One line for `list`.
    pub summary: &'static str,
    /// Whether it ever asks; one that does not needs no oracle of its own.
    pub asks: bool,
    /// Makes one.
    pub make: fn(CullerSetup) -> Box<dyn Culler>,
}

/// Every culler there is.
pub const CULLERS: &[CullerKind] = &[
    CullerKind {
        name: "full",
        summary: "Kovalčík & Sochor 2006: parallel queries, recent results postpone the next query",
        asks: true,
        make: |setup| Box::new(Full::new(setup, FullKnobs::default())),
    },
    CullerKind {
        name: "simple",
        summary: "a query for every node in the frustum, one at a time",
        asks: true,
        make: |setup| Box::new(Simple::new(setup)),
    },
    CullerKind {
        name: "vfc",
        summary: "view-frustum culling over the same trees, no queries",
        asks: false,
        make: |setup| Box::new(ViewFrustum::new(setup)),
    },
    CullerKind {
        name: "full-adaptive",
        summary: "full, weighing every question by a cost model (--cost): never far over vfc",
        asks: true,
        make: |setup| Box::new(Adaptive::new(setup, AdaptiveKnobs::default())),
    },
    CullerKind {
        name: "full-trusting",
        summary: "full with long postponement, drawing all of a group that shows: the fewest questions",
        asks: true,
        make: |setup| Box::new(Full::new(setup, FullKnobs::trusting())),
    },
    CullerKind {
        name: "full-waits",
        summary: "the paper to the letter: questions with overlapping rectangles wait for one another",
        asks: true,
        make: |setup| Box::new(FullWaits::new(setup, FullWaitsKnobs::default())),
    },
    CullerKind {
        name: "chc",
        summary: "coherent hierarchical culling, Bittner et al. 2004",
        asks: true,
        make: |setup| Box::new(Chc::new(setup)),
    },
    CullerKind {
        name: "chc++",
        summary: "CHC++, Mattausch et al. 2008: several nodes in a question, visible parts asked seldom",
        asks: true,
        make: |setup| Box::new(ChcPlus::new(setup, ChcPlusKnobs::default())),
    },
    CullerKind {
        name: "pipelined",
        summary: "simple with several batches of questions on their way at once",
        asks: true,
        make: |setup| Box::new(Pipelined::new(setup, PipelinedKnobs::default())),
    },
    CullerKind {
        name: "draw-all",
        summary: "draws every part: always safe, always last",
        asks: false,
        make: |setup| Box::new(DrawAll::new(setup)),
    },
];
