//! The journal of a frame: which nodes were walked into and what was asked about which, in order. A culler
//! that has both levels of a [`Scenery`](super::Scenery) need not know of it; it is written only where
//! somebody asks why, and costs a look at an `Option` elsewhere.

use super::Item;
use crate::oracle::{Proxy, QueryId};

/// One question.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// Its number in the frame.
    pub query: QueryId,
    /// The nodes that it was about; none where the culler does not say.
    pub items: Vec<Item>,
    /// What was asked about.
    pub proxies: Vec<Proxy>,
    /// What came back; `None` where nothing did.
    pub visible: Option<bool>,
    /// How many nodes were walked into before it was asked.
    pub after_opened: usize,
}

/// What a culler did in one frame.
#[derive(Clone, Debug, Default)]
pub struct Journal {
    /// Nodes walked into, in order.
    pub opened: Vec<Item>,
    /// Questions, in asking order.
    pub questions: Vec<Question>,
}

impl Journal {
    /// The latest question about a node, and whether the node was walked into before it.
    #[must_use]
    pub fn about(&self, item: Item) -> Option<(&Question, bool)> {
        let question = self.questions.iter().rev().find(|q| q.items.contains(&item))?;
        let before = self.opened[..question.after_opened].contains(&item);
        Some((question, before))
    }
}
