//! The stupid index: one node that holds every object. Never wrong, never of help.

use glam::DVec3;

use super::{Entry, Index, Move, Node, NodeId};
use crate::part::ObjectId;

/// One node with all objects, in the order of their ids.
#[derive(Clone, Debug)]
pub struct List {
    objects: Vec<ObjectId>,
}

impl List {
    /// Lists the objects.
    #[must_use]
    pub fn new(entries: &[Entry]) -> Self {
        Self { objects: (0..entries.len() as u32).map(ObjectId).collect() }
    }
}

impl Index for List {
    fn name(&self) -> &'static str {
        "list"
    }

    fn update(&mut self, _: &[Move]) {}

    fn top_down(&self) -> &[NodeId] {
        &[NodeId(0)]
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

    fn check(&self) -> Result<(), String> {
        Ok(())
    }
}
