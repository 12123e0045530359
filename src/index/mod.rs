//! Spatial structures over the objects of a scene, one per file behind [`Index`]; `list` is the
//! stupid one. An index gets ids, world boxes, a bound on each object's step and a jump flag; it must
//! not know scenes, cameras or oracles.

mod list;
mod two_level_bsp;

use glam::DVec3;

use crate::math::Aabb;
use crate::part::ObjectId;

pub use list::List;
pub use two_level_bsp::TwoLevelBsp;

/// A node of an index. Node 0 is the root.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// An object as an index sees it.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// World box; holds everything the object draws.
    pub bounds: Aabb,
    /// The farthest the object's origin moves in one frame, world units; 0 for one that never moves.
    pub step_bound: f64,
}

/// An object that changed since the last update.
#[derive(Clone, Copy, Debug)]
pub struct Move {
    /// Which.
    pub object: ObjectId,
    /// Its new world box.
    pub bounds: Aabb,
    /// Whether it may have gone farther than its step bound.
    pub jumped: bool,
}

/// What a node offers to a culler.
#[derive(Clone, Copy, Debug)]
pub struct Node<'a> {
    /// The box asked about: of the subspace. `None` where the contents may stick out of it, so that
    /// the node is visible without a question.
    pub query_box: Option<Aabb>,
    /// The tight box of everything at and below the node, where the index has one: only while the
    /// contents have not changed for several updates (Kovalčík & Sochor 2006, end of section 3.4).
    pub tight_box: Option<Aabb>,
    /// Objects linked to the node itself.
    pub objects: &'a [ObjectId],
    /// How many objects hang at and below the node. A node with none can be passed over.
    pub subtree_objects: u32,
}

/// A spatial structure over objects.
pub trait Index {
    /// Name for reports.
    fn name(&self) -> &'static str;

    /// Takes over the new boxes. Objects not named stay where they were.
    fn update(&mut self, moves: &[Move]);

    /// The nodes that the latest update made anew: what was remembered of these numbers is void.
    fn rebuilt(&self) -> &[NodeId] {
        &[]
    }

    /// Whether the latest update took an object from one side of the root to the other.
    fn crossed_root(&self) -> bool {
        false
    }

    /// Every node in use, parents before children.
    fn top_down(&self) -> &[NodeId];

    /// One more than the largest number of a node, at least one. Numbers may be out of use.
    fn node_count(&self) -> u32;

    /// A node's contents.
    ///
    /// # Panics
    /// For a number beyond the last node.
    fn node(&self, node: NodeId) -> Node<'_>;

    /// Appends a node's children in front-to-back order as seen from `eye` and returns how many of
    /// them come before the node's own objects (section 3.3 of the paper: the nearer child, the
    /// objects, the farther child).
    fn children(&self, node: NodeId, eye: DVec3, out: &mut Vec<NodeId>) -> usize;

    /// A node's parent; `None` for the root.
    fn parent(&self, node: NodeId) -> Option<NodeId>;

    /// Whether every structural promise holds.
    ///
    /// # Errors
    /// The first broken promise, in words.
    fn check(&self) -> Result<(), String>;
}

/// A member of the family.
#[derive(Clone, Copy, Debug)]
pub struct IndexKind {
    /// Name for flags and reports.
    pub name: &'static str,
    /// One line for `list`.
    pub summary: &'static str,
    /// Builds it over the objects of frame 0; the place in the slice is the object's id.
    pub build: fn(&[Entry]) -> Box<dyn Index>,
}

/// Every index there is.
pub const INDEXES: &[IndexKind] = &[
    IndexKind {
        name: "two-level-bsp",
        summary: "the scene tree of Kovalčík & Sochor 2006: axis-aligned, objects in inner nodes too",
        build: |entries| Box::new(TwoLevelBsp::new(entries)),
    },
    IndexKind {
        name: "list",
        summary: "one node that holds everything",
        build: |entries| Box::new(List::new(entries)),
    },
];
