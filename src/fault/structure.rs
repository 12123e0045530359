//! Faults of the structures: the real scene tree whose upkeep goes wrong, and a mesh cut wrongly. The
//! culler above is `full`.

use std::borrow::Cow;

use glam::DVec3;

use super::{Fault, Rig, history};
use crate::index::{Entry, Index, Moves, Node, NodeId, TwoLevelBsp, Work};
use crate::math::{Aabb, Volume};
use crate::part::{ObjectId, PartedMesh};

/// What is broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Flaw {
    /// An object whose middle is still in the same node is not looked at.
    SameContainer,
    /// The root's box is asked about although things stick out of it.
    SticksOut,
    /// What stands outside the old space is lost when the root grows.
    Growth,
    /// Freeing and spawning an object takes a neighbour out of the list.
    Respawn,
    /// An object linked anew to the node where it hangs is taken out and not put in.
    SamePlace,
    /// An object in too many leaves is in none.
    TooManyLeaves,
    /// A tightened box is kept after the contents moved.
    TightKept,
    /// A relinked object is in neither node.
    Neither,
}

/// An object that reaches over more than this share of the space is in too many leaves.
const MOST_SHARE: f64 = 0.4;

struct Wrong {
    inner: TwoLevelBsp,
    flaw: Flaw,
    bounds: Vec<Aabb>,
    /// The space of the first tree.
    space: Aabb,
    /// Objects that hang nowhere.
    lost: Vec<bool>,
    home: Vec<NodeId>,
    objects: Vec<Vec<ObjectId>>,
    tight: Vec<Option<Aabb>>,
}

impl Wrong {
    fn new(entries: &[Entry], flaw: Flaw) -> Self {
        let bounds: Vec<Aabb> = entries.iter().map(|entry| entry.bounds).collect();
        let space = bounds.iter().fold(Aabb::EMPTY, |all, aabb| all.union(aabb));
        let most = space.size() * MOST_SHARE;
        let wide = |aabb: &Aabb| !aabb.is_empty() && aabb.size().cmpgt(most).any();
        let lost = bounds.iter().map(|b| flaw == Flaw::TooManyLeaves && wide(b)).collect();
        let mut index = Self {
            inner: TwoLevelBsp::new(entries),
            flaw,
            space,
            lost,
            home: vec![NodeId(0); bounds.len()],
            bounds,
            objects: Vec::new(),
            tight: Vec::new(),
        };
        index.relist();
        index
    }

    /// Notes where every object hangs, and leaves out those that are lost.
    fn relist(&mut self) {
        let count = self.inner.node_count() as usize;
        self.objects.clear();
        self.objects.resize_with(count, Vec::new);
        self.tight.resize(count, None);
        for &node in self.inner.rebuilt() {
            self.tight[node.0 as usize] = None;
        }
        for &node in self.inner.top_down().iter() {
            let number = node.0 as usize;
            let this = self.inner.node(node);
            this.objects.iter().for_each(|object| self.home[object.0 as usize] = node);
            let kept = this.objects.iter().filter(|object| !self.lost[object.0 as usize]);
            self.objects[number] = kept.copied().collect();
            self.tight[number] = self.tight[number].or(this.tight_box);
        }
    }

    /// Loses what goes wrong with these moves before they are made.
    fn lose(&mut self, moves: Moves<'_>) {
        for &id in moves.moved {
            let object = id.0 as usize;
            match self.flaw {
                Flaw::Respawn if moves.jumped.contains(&id) => {
                    let neighbours = &self.objects[self.home[object].0 as usize];
                    let last = neighbours.iter().rev().find(|&&other| other != id);
                    if let Some(neighbour) = last {
                        self.lost[neighbour.0 as usize] = true;
                    }
                }
                _ => {}
            }
            self.bounds[object] = *moves.bounds(id);
        }
    }
}

impl Index for Wrong {
    fn name(&self) -> &'static str {
        self.inner.name()
    }

    fn update(&mut self, moves: Moves<'_>) {
        let stays = |id: &&ObjectId| {
            let home = self.inner.node(self.home[id.0 as usize]).query_box;
            home.is_some_and(|space| space.contains_point(moves.bounds(**id).center()))
        };
        let taken: Vec<ObjectId> = if self.flaw == Flaw::SameContainer {
            moves.moved.iter().filter(|id| !stays(id)).copied().collect()
        } else {
            moves.moved.to_vec()
        };
        let moves = Moves { moved: &taken, ..moves };
        self.lose(moves);
        let before = self.home.clone();
        self.inner.update(moves);
        self.relist();
        match self.flaw {
            Flaw::Neither => {
                // What the tree makes anew it puts where it belongs.
                let anew = !self.inner.rebuilt().is_empty();
                let moved = taken.iter().map(|id| id.0 as usize);
                for object in moved.filter(|&o| !anew && self.home[o] != before[o]) {
                    self.lost[object] = true;
                }
            }
            Flaw::SamePlace => {
                for object in taken.iter().map(|id| id.0 as usize) {
                    self.lost[object] = self.home[object] == before[object];
                }
            }
            Flaw::Growth if self.inner.rebuilt().contains(&NodeId(0)) => {
                for (lost, bounds) in self.lost.iter_mut().zip(&self.bounds) {
                    *lost |= !self.space.contains(bounds);
                }
            }
            _ => return,
        }
        self.relist();
    }

    fn find(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>) {
        self.inner.find(boxes, volume, found);
    }

    fn work(&self) -> Work {
        self.inner.work()
    }

    fn heap_bytes(&self) -> usize {
        self.inner.heap_bytes()
    }

    fn rebuilt(&self) -> &[NodeId] {
        self.inner.rebuilt()
    }

    fn top_down(&self) -> Cow<'_, [NodeId]> {
        self.inner.top_down()
    }

    fn node_count(&self) -> u32 {
        self.inner.node_count()
    }

    fn node(&self, node: NodeId) -> Node<'_> {
        let number = node.0 as usize;
        let mut this = Node { objects: &self.objects[number], ..self.inner.node(node) };
        match self.flaw {
            Flaw::TightKept => this.tight_box = self.tight[number],
            Flaw::SticksOut if number == 0 => this.query_box = Some(self.space),
            _ => {}
        }
        this
    }

    fn children(&self, node: NodeId, eye: DVec3, out: &mut Vec<NodeId>) -> usize {
        self.inner.children(node, eye, out)
    }

    fn parent(&self, node: NodeId) -> Option<NodeId> {
        self.inner.parent(node)
    }

    /// The gate is to find out.
    fn check(&self, _: &[Aabb]) -> Result<(), String> {
        Ok(())
    }
}

/// Loses the last fragment of each triangle that was split.
fn lose_fragments(mesh: &mut PartedMesh) {
    for rank in 1..mesh.source_of_rank.len() {
        let split = mesh.source_of_rank[rank] == mesh.source_of_rank[rank - 1];
        let last = mesh.source_of_rank.get(rank + 1) != Some(&mesh.source_of_rank[rank]);
        if split && last {
            // A triangle of one point draws nothing.
            let triangle = &mut mesh.triangles[mesh.triangle_of_rank[rank] as usize];
            *triangle = [triangle[0]; 3];
        }
    }
}

macro_rules! with {
    ($flaw:ident) => {
        Rig { index: |entries| Box::new(Wrong::new(entries, Flaw::$flaw)), ..history::FULL }
    };
}

/// The faults.
pub(super) const FAULTS: &[Fault] = &[
    Fault::drops(
        ("root-sticks-out", 38),
        "things stick out of the root's box, which is asked about all the same",
        &["hard/strays", "hard/peeping"],
        (history::FULL, with!(SticksOut)),
    ),
    Fault::drops(
        ("same-container", 43),
        "an object whose middle is still in the same node is not looked at",
        &["hard/peeping", "hard/strays"],
        (history::FULL, with!(SameContainer)),
    ),
    Fault::drops(
        ("growth-drops", 44),
        "what stands outside is lost when the tree grows",
        &["hard/out-of-space", "hard/teleports"],
        (history::FULL, with!(Growth)),
    ),
    Fault::drops(
        ("respawn-breaks", 45),
        "freeing and spawning an object takes a neighbour out of the list",
        &["hard/teleports", "hard/out-of-space"],
        (history::FULL, with!(Respawn)),
    ),
    Fault::drops(
        ("same-place", 47),
        "an object linked anew to the node where it hangs is taken out and not put in",
        &["hard/teleports", "hard/ping-pong"],
        (history::FULL, with!(SamePlace)),
    ),
    Fault::drops(
        ("too-many-leaves", 50),
        "an object in too many leaves is in none",
        &["hard/orthographic", "hard/layers"],
        (history::FULL, with!(TooManyLeaves)),
    ),
    Fault::drops(
        ("fragment-lost", 55),
        "a fragment is lost at the plane that split its triangle",
        &["hard/t-junctions", "hard/layers"],
        (history::FULL, Rig { alter: Some(lose_fragments), ..history::FULL }),
    ),
    Fault::drops(
        ("tight-kept", 58),
        "a tightened box is kept after the contents moved",
        &["hard/slits"],
        (history::FULL, with!(TightKept)),
    ),
    Fault::drops(
        ("in-neither", 59),
        "a relinked object is left in neither node",
        &["hard/orthographic", "hard/stop-and-go"],
        (history::FULL, with!(Neither)),
    ),
];
