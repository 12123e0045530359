//! Spatial structures over the objects of a scene, one per file behind [`Index`]; `list` is the
//! stupid one. An index gets ids, world boxes, a bound on each object's step and a jump flag; it must
//! not know scenes, cameras or oracles.

mod bucket_octree;
mod checklist;
mod grid_knobs;
mod irregular_octree;
mod lazy_grid;
mod list;
mod loose_octree;
mod octree;
mod promises;
mod regular_grid;
mod temporal_volumes;
mod tree;
mod tree_knobs;
mod two_level_bsp;

use std::borrow::Cow;
use std::ops::{Add, Sub};

use glam::DVec3;

use crate::math::{Aabb, Meets, Volume};
use crate::part::ObjectId;

pub use bucket_octree::{bounds_octree, extents_octree, radius_octree};
pub use grid_knobs::{BspKnobs, GridKnobs, VolumeKnobs};
pub use irregular_octree::IrregularOctree;
pub use lazy_grid::LazyGrid;
pub use list::List;
pub use loose_octree::{LooseKnobs, loose_octree};
pub use octree::{octree, overlapping_octree};
pub use promises::{Shape, missed, promises};
pub use regular_grid::RegularGrid;
pub use temporal_volumes::TemporalVolumes;
pub use tree_knobs::{Split, TreeKnobs};
pub use two_level_bsp::TwoLevelBsp;

/// A node of an index. Node 0 is the root.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(pub u32);

/// An object as an index sees it.
#[derive(Clone, Copy, Debug)]
pub struct Entry {
    /// World box; holds everything the object draws.
    pub bounds: Aabb,
    /// The farthest the middle of its box moves in one frame without a jump, world units; 0 for one that
    /// never moves.
    pub step_bound: f64,
    /// The largest half side that its box ever has on any axis, however it turns.
    pub reach: f64,
}

/// Where everything is, and what changed since the last update. An index that knows how far things can
/// go in a frame need not read the list of what moved.
#[derive(Clone, Copy, Debug)]
pub struct Moves<'a> {
    /// World boxes of all objects, by id.
    pub boxes: &'a [Aabb],
    /// Objects whose boxes are not those of the last update, ascending.
    pub moved: &'a [ObjectId],
    /// Those of them that may have gone farther than their step bound, ascending.
    pub jumped: &'a [ObjectId],
}

impl Moves<'_> {
    /// The box of an object.
    ///
    /// # Panics
    /// For an object that does not exist.
    #[must_use]
    pub fn bounds(&self, object: ObjectId) -> &Aabb {
        &self.boxes[object.0 as usize]
    }

    /// Whether the object moved.
    #[must_use]
    pub fn has(&self, object: ObjectId) -> bool {
        self.moved.binary_search(&object).is_ok()
    }
}

/// What the middle and half side of a box may be off by, of the largest coordinate: two roundings of
/// 2⁻⁵³ each; sixteen of them.
const MIDDLE_ROUNDING: f64 = 1.0 / (1_u64 << 49) as f64;

/// The next f32 that is no less, so that bounds stay bounds.
fn rounded_up(value: f64) -> f32 {
    let near = value as f32;
    if f64::from(near) < value { near.next_up() } else { near }
}

/// The box of all boxes; a point where there is nothing.
fn space_of_boxes(entries: &[Entry]) -> Aabb {
    whole(entries.iter().map(|entry| entry.bounds))
}

/// The box of the middles of all boxes; a point where there is nothing.
fn space_of_middles(entries: &[Entry]) -> Aabb {
    let full = entries.iter().filter(|entry| !entry.bounds.is_empty());
    whole(full.map(|entry| entry.bounds.center()).map(|at| Aabb::new(at, at)))
}

fn whole(boxes: impl Iterator<Item = Aabb>) -> Aabb {
    let space = boxes.fold(Aabb::EMPTY, |all, one| all.union(&one));
    if space.is_empty() { Aabb::new(DVec3::ZERO, DVec3::ZERO) } else { space }
}

/// Whether every object was seen once, by how often each was.
fn each_once(seen: &[u32]) -> Result<(), String> {
    match seen.iter().position(|&times| times != 1) {
        Some(object) => Err(format!("object {object} hangs at {} nodes", seen[object])),
        None => Ok(()),
    }
}

/// Operations of an index, in the words of Wortel 2011, section 4.1. The same for the same moves and
/// volumes, everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Work {
    /// Objects looked at in updates and found to be where they belong ("object ok").
    pub ok: u64,
    /// Objects that an update hung at another node ("tree updates").
    pub updates: u64,
    /// Nodes that updates looked at above and below, to find an object's place ("tree traversal steps").
    pub steps: u64,
    /// Nodes looked at when finding what is visible, those known to be visible with their parents too
    /// ("node visibility checks").
    pub node_checks: u64,
    /// Objects looked at one by one when finding what is visible.
    pub object_checks: u64,
    /// Objects that were moved down when their node was looked at.
    pub lowered: u64,
}

impl Add for Work {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self {
            ok: self.ok + other.ok,
            updates: self.updates + other.updates,
            steps: self.steps + other.steps,
            node_checks: self.node_checks + other.node_checks,
            object_checks: self.object_checks + other.object_checks,
            lowered: self.lowered + other.lowered,
        }
    }
}

impl Sub for Work {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self {
            ok: self.ok - other.ok,
            updates: self.updates - other.updates,
            steps: self.steps - other.steps,
            node_checks: self.node_checks - other.node_checks,
            object_checks: self.object_checks - other.object_checks,
            lowered: self.lowered - other.lowered,
        }
    }
}

/// Finds by the boxes of nodes, top down: [`Index::find`] of those that put nothing off.
fn find_by_nodes(index: &dyn Index, volume: &Volume, work: &mut Work, found: &mut Vec<ObjectId>) {
    let mut stack = vec![(NodeId(0), false)];
    let mut children = Vec::new();
    while let Some((node, inside)) = stack.pop() {
        work.node_checks += 1;
        let this = index.node(node);
        let meets = match (inside, this.tight_box.or(this.query_box)) {
            (true, _) => Meets::Inside,
            (false, Some(aabb)) => volume.meets(&aabb),
            (false, None) => Meets::Partly,
        };
        if meets == Meets::Outside || this.subtree_objects == 0 {
            continue;
        }
        found.extend_from_slice(this.objects);
        index.children(node, DVec3::ZERO, &mut children);
        stack.extend(children.drain(..).map(|child| (child, meets == Meets::Inside)));
    }
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
    fn update(&mut self, moves: Moves<'_>);

    /// Does what the index puts off until a part of it is looked at, for everything that `volume` meets.
    /// Comes after [`Index::update`], with the same boxes, and before a walk through the nodes.
    fn refine(&mut self, boxes: &[Aabb], volume: &Volume) {
        let _ = (boxes, volume);
    }

    /// Appends what may be inside `volume`, each object once: at least all whose boxes meet it. What is put
    /// off is done on the way. Counts as visibility determination in [`Index::work`].
    fn find(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>);

    /// Operations since it was built.
    fn work(&self) -> Work;

    /// Bytes on the heap.
    fn heap_bytes(&self) -> usize;

    /// The nodes that the latest update, or what was put off since, made anew: what was remembered of these numbers is void.
    fn rebuilt(&self) -> &[NodeId] {
        &[]
    }

    /// Whether the latest update took an object from one side of the root to the other.
    fn crossed_root(&self) -> bool {
        false
    }

    /// Every node in use, parents before children.
    fn top_down(&self) -> Cow<'_, [NodeId]>;

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

    /// Whether every structural promise holds, with the objects in these boxes.
    ///
    /// # Errors
    /// The first broken promise, in words.
    fn check(&self, boxes: &[Aabb]) -> Result<(), String>;
}

/// Knobs for any index; each takes those that it has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IndexKnobs {
    /// Of the trees, whose split is their own.
    pub tree: TreeKnobs,
    /// Of Octree 4.
    pub loose: LooseKnobs,
    /// Of the grids.
    pub grid: GridKnobs,
    /// Of the scene tree.
    pub bsp: BspKnobs,
    /// Of temporal bounding volumes.
    pub volumes: VolumeKnobs,
}

impl IndexKnobs {
    /// The trees' knobs with that split.
    fn tree(&self, split: Split) -> TreeKnobs {
        TreeKnobs { split, ..self.tree }
    }
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
    /// Builds it by other knobs.
    pub with: fn(&[Entry], &IndexKnobs) -> Box<dyn Index>,
}

/// Levels that the members of the register leave to finding, where they do.
const REDUCTION: u8 = 2;

/// The same knobs, reduced by [`REDUCTION`] levels where they leave nothing to finding.
fn lazy(knobs: TreeKnobs) -> TreeKnobs {
    let depth_reduction =
        if knobs.depth_reduction == 0 { REDUCTION } else { knobs.depth_reduction };
    TreeKnobs { depth_reduction, checklists: true, ..knobs }
}

/// Knobs for any scene.
fn usual(split: Split, entries: &[Entry]) -> TreeKnobs {
    TreeKnobs::usual(split, entries.len())
}

/// Every index there is.
pub const INDEXES: &[IndexKind] = &[
    IndexKind {
        name: "two-level-bsp",
        summary: "the scene tree of Kovalčík & Sochor 2006: axis-aligned, objects in inner nodes too",
        build: |entries| Box::new(TwoLevelBsp::new(entries)),
        with: |entries, knobs| Box::new(TwoLevelBsp::with(entries, knobs.bsp)),
    },
    IndexKind {
        name: "list",
        summary: "one node that holds everything",
        build: |entries| Box::new(List::new(entries)),
        with: |entries, _| Box::new(List::new(entries)),
    },
    IndexKind {
        name: "octree",
        summary: "Octree 1 of Wortel 2011: each object at the smallest node that holds it",
        build: |entries| octree(entries, usual(Split::Octants, entries)),
        with: |entries, knobs| octree(entries, knobs.tree(Split::Octants)),
    },
    IndexKind {
        name: "quadtree",
        summary: "the same over the ground",
        build: |entries| octree(entries, usual(Split::Quadrants, entries)),
        with: |entries, knobs| octree(entries, knobs.tree(Split::Quadrants)),
    },
    IndexKind {
        name: "overlapping-octree",
        summary: "Octree 2 of Wortel 2011: nodes larger than their space",
        build: |entries| overlapping_octree(entries, usual(Split::Octants, entries)),
        with: |entries, knobs| overlapping_octree(entries, knobs.tree(Split::Octants)),
    },
    IndexKind {
        name: "overlapping-quadtree",
        summary: "the same over the ground",
        build: |entries| overlapping_octree(entries, usual(Split::Quadrants, entries)),
        with: |entries, knobs| overlapping_octree(entries, knobs.tree(Split::Quadrants)),
    },
    IndexKind {
        name: "bounds-octree",
        summary: "Octree 3 of Wortel 2011: buckets, nodes as large as their contents",
        build: |entries| bounds_octree(entries, usual(Split::Octants, entries)),
        with: |entries, knobs| bounds_octree(entries, knobs.tree(Split::Octants)),
    },
    IndexKind {
        name: "bounds-quadtree",
        summary: "the same over the ground",
        build: |entries| bounds_octree(entries, usual(Split::Quadrants, entries)),
        with: |entries, knobs| bounds_octree(entries, knobs.tree(Split::Quadrants)),
    },
    IndexKind {
        name: "extents-octree",
        summary: "Octree 3b of Wortel 2011: buckets, nodes as large as their largest object asks",
        build: |entries| extents_octree(entries, usual(Split::Octants, entries)),
        with: |entries, knobs| extents_octree(entries, knobs.tree(Split::Octants)),
    },
    IndexKind {
        name: "extents-quadtree",
        summary: "the same over the ground",
        build: |entries| extents_octree(entries, usual(Split::Quadrants, entries)),
        with: |entries, knobs| extents_octree(entries, knobs.tree(Split::Quadrants)),
    },
    IndexKind {
        name: "radius-octree",
        summary: "Octree 3bR of Wortel 2011: the same, but for one radius on all axes",
        build: |entries| radius_octree(entries, usual(Split::Octants, entries)),
        with: |entries, knobs| radius_octree(entries, knobs.tree(Split::Octants)),
    },
    IndexKind {
        name: "radius-quadtree-lazy",
        summary: "Octree 3bR over the ground, with depth reduction and object checklists",
        build: |entries| {
            let knobs = TreeKnobs { start_depth: 3, ..usual(Split::Quadrants, entries) };
            radius_octree(entries, knobs.reduced(REDUCTION))
        },
        with: |entries, knobs| radius_octree(entries, lazy(knobs.tree(Split::Quadrants))),
    },
    IndexKind {
        name: "loose-octree",
        summary: "Octree 4 of Wortel 2011: middles say where, sizes how deep",
        build: |entries| {
            loose_octree(entries, usual(Split::Octants, entries), LooseKnobs::default())
        },
        with: |entries, knobs| loose_octree(entries, knobs.tree(Split::Octants), knobs.loose),
    },
    IndexKind {
        name: "loose-octree-lazy",
        summary: "the same with depth reduction and object checklists",
        build: |entries| {
            let knobs = usual(Split::Octants, entries).reduced(REDUCTION);
            loose_octree(entries, knobs, LooseKnobs::default())
        },
        with: |entries, knobs| loose_octree(entries, lazy(knobs.tree(Split::Octants)), knobs.loose),
    },
    IndexKind {
        name: "lazy-grid",
        summary: "grids over one another, objects in large cells until somebody looks; this project's own",
        build: |entries| Box::new(LazyGrid::new(entries, GridKnobs::default())),
        with: |entries, knobs| Box::new(LazyGrid::new(entries, knobs.grid)),
    },
    IndexKind {
        name: "loose-quadtree-lazy",
        summary: "the same over the ground",
        build: |entries| {
            let knobs = usual(Split::Quadrants, entries).reduced(REDUCTION);
            loose_octree(entries, knobs, LooseKnobs::default())
        },
        with: |entries, knobs| {
            loose_octree(entries, lazy(knobs.tree(Split::Quadrants)), knobs.loose)
        },
    },
    IndexKind {
        name: "irregular-octree",
        summary: "of Shagam & Pfeiffer 2003: parted where its objects are, objects go down when looked at",
        build: |entries| {
            let knobs =
                TreeKnobs { max_depth: TreeKnobs::DEEPEST, ..usual(Split::Octants, entries) };
            Box::new(IrregularOctree::new(entries, knobs))
        },
        with: |entries, knobs| Box::new(IrregularOctree::new(entries, knobs.tree(Split::Octants))),
    },
    IndexKind {
        name: "regular-grid",
        summary: "of Batagelo & Wu 2002: one level of cells",
        build: |entries| Box::new(RegularGrid::new(entries, GridKnobs::default())),
        with: |entries, knobs| Box::new(RegularGrid::new(entries, knobs.grid)),
    },
    IndexKind {
        name: "temporal-grid",
        summary: "the same over temporal bounding volumes, which objects cannot leave for some frames",
        build: |entries| {
            let grid = |held: &[Entry]| -> Box<dyn Index> {
                Box::new(RegularGrid::new(held, GridKnobs::default()))
            };
            Box::new(TemporalVolumes::new("temporal-grid", VolumeKnobs::default(), entries, grid))
        },
        with: |entries, knobs| {
            let grid =
                |held: &[Entry]| -> Box<dyn Index> { Box::new(RegularGrid::new(held, knobs.grid)) };
            Box::new(TemporalVolumes::new("temporal-grid", knobs.volumes, entries, grid))
        },
    },
    IndexKind {
        name: "temporal-octree",
        summary: "of Sudarsky & Gotsman 1999: an octree over temporal bounding volumes",
        build: |entries| {
            let tree = |held: &[Entry]| octree(held, usual(Split::Octants, held));
            Box::new(TemporalVolumes::new("temporal-octree", VolumeKnobs::default(), entries, tree))
        },
        with: |entries, knobs| {
            let tree = |held: &[Entry]| octree(held, knobs.tree(Split::Octants));
            Box::new(TemporalVolumes::new("temporal-octree", knobs.volumes, entries, tree))
        },
    },
];
