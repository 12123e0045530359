//! The nodes that a frame's walk went into, with the way back up: *pull-up* of visibility (Bittner,
//! Wimmer, Piringer & Purgathofer 2004, section 3.2). An inner node shows if anything below it does.

use super::{Item, Pen, Scenery, View};

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
pub(super) struct OpenedNodes {
    nodes: Vec<Opened>,
    /// Room for a node's children.
    below: Vec<Item>,
}

impl OpenedNodes {
    pub(super) fn clear(&mut self) {
        self.nodes.clear();
    }

    /// Adds a node below the one at `parent`; returns its place.
    fn push(&mut self, item: Item, parent: usize) -> usize {
        self.nodes.push(Opened { item, parent, shows: false });
        self.nodes.len() - 1
    }

    /// Walks into a node: draws its own part, or puts its children on the stack so that the nearest
    /// comes off first. Returns the node's place.
    pub(super) fn open(
        &mut self,
        scenery: &Scenery,
        view: &View<'_>,
        pen: &mut Pen<'_>,
        (item, parent): (Item, usize),
        stack: &mut Vec<(Item, usize)>,
    ) -> usize {
        let place = self.push(item, parent);
        self.below.clear();
        scenery.expand(view, item, pen, &mut self.below);
        stack.extend(self.below.drain(..).rev().map(|item| (item, place)));
        place
    }

    /// Notes that the node at `place`, and so all above it, shows.
    pub(super) fn show(&mut self, mut place: usize) {
        while place != NO_PARENT && !self.nodes[place].shows {
            self.nodes[place].shows = true;
            place = self.nodes[place].parent;
        }
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = &Opened> {
        self.nodes.iter()
    }
}
