//! Motion: single objects along declared paths.

use super::path;
use crate::scene::{Motion, Path, Placement};

/// The declared paths, by object.
#[derive(Debug)]
pub(super) struct MotionEffect {
    moving: Vec<u32>,
    paths: Vec<Path>,
}

impl MotionEffect {
    pub(super) fn new(motion: &Motion) -> Self {
        let mut movers = motion.movers.clone();
        movers.sort_by_key(|&(object, _)| object);
        let (moving, paths) = movers.into_iter().unzip();
        Self { moving, paths }
    }

    pub(super) fn moving(&self) -> &[u32] {
        &self.moving
    }

    pub(super) fn path(&self, object: u32) -> Option<&Path> {
        self.moving.binary_search(&object).ok().map(|place| &self.paths[place])
    }

    pub(super) fn placement(path: &Path, rest: Placement, t: u32) -> Placement {
        let (translation, turn) = path::place(path, rest.translation, t);
        Placement { translation, rotation: turn * rest.rotation, ..rest }
    }
}
