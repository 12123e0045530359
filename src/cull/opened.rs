//! The nodes that a frame's walk went into, with the way back up: *pull-up* of visibility (Bittner,
//! Wimmer, Piringer & Purgathofer 2004, section 3.2). An inner node shows if anything below it does.

use super::Item;

/// The place above the root.
pub(super) const NO_PARENT: usize = usize::MAX;

/// A node that was walked into this frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Opened {
    pub(super) item: Item,
    parent: usize,
    /// Whether it, or anything below it, shows.
    pub(super) shows: bool,
}

/// All of them, in the order of the walk.
#[derive(Debug, Default)]
pub(super) struct OpenedNodes(Vec<Opened>);

impl OpenedNodes {
    pub(super) fn clear(&mut self) {
        self.0.clear();
    }

    /// Adds a node below the one at `parent`; returns its place.
    pub(super) fn push(&mut self, item: Item, parent: usize) -> usize {
        self.0.push(Opened { item, parent, shows: false });
        self.0.len() - 1
    }

    /// Notes that the node at `place`, and so all above it, shows.
    pub(super) fn show(&mut self, mut place: usize) {
        while place != NO_PARENT && !self.0[place].shows {
            self.0[place].shows = true;
            place = self.0[place].parent;
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Opened> {
        self.0.iter()
    }
}
