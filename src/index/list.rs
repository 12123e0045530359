//! The stupid index: one node that holds every object. Never wrong, never of help.

use std::borrow::Cow;

use glam::DVec3;

use super::{Entry, Index, Moves, Node, NodeId, Work};
use crate::math::{Aabb, Volume};
use crate::part::ObjectId;

/// One node with all objects, in the order of their ids. It finds by a look at every box.
#[derive(Clone, Debug)]
pub struct List {
    objects: Vec<ObjectId>,
    work: Work,
}

impl List {
    /// Lists the objects.
    #[must_use]
    pub fn new(entries: &[Entry]) -> Self {
        Self { objects: (0..entries.len() as u32).map(ObjectId).collect(), work: Work::default() }
    }
}

impl Index for List {
    fn name(&self) -> &'static str {
        "list"
    }

    fn update(&mut self, _: Moves<'_>) {}

    /// Exactly what meets the volume.
    fn find(&mut self, boxes: &[Aabb], volume: &Volume, found: &mut Vec<ObjectId>) {
        self.work.object_checks += self.objects.len() as u64;
        let meets = |id: &&ObjectId| volume.touches(&boxes[id.0 as usize]);
        found.extend(self.objects.iter().filter(meets));
    }

    fn work(&self) -> Work {
        self.work
    }

    fn heap_bytes(&self) -> usize {
        size_of_val(self.objects.as_slice())
    }

    fn top_down(&self) -> Cow<'_, [NodeId]> {
        Cow::Borrowed(&[NodeId(0)])
    }

    fn node_count(&self) -> u32 {
        1
    }

    fn node(&self, node: NodeId) -> Node<'_> {
        assert_eq!(node, NodeId(0), "a list has one node");
        let subtree_objects = self.objects.len() as u32;
        Node { query_box: None, tight_box: None, objects: &self.objects, subtree_objects }
    }

    fn children(&self, _: NodeId, _: DVec3, _: &mut Vec<NodeId>) -> usize {
        0
    }

    fn parent(&self, _: NodeId) -> Option<NodeId> {
        None
    }

    fn check(&self, _: &[Aabb]) -> Result<(), String> {
        Ok(())
    }
}
