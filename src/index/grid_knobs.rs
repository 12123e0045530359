//! What the grids, temporal volumes and the scene tree can be told.

/// The knob of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridKnobs {
    /// Objects in a cell of the deepest level, were they spread evenly; above 0.
    pub per_cell: f64,
    /// Updates ahead that checklists foresee, at least 3; a regular grid has none.
    pub ahead: u32,
}

impl Default for GridKnobs {
    fn default() -> Self {
        Self { per_cell: 12.0, ahead: 4096 }
    }
}

/// Lives of temporal bounding volumes, in frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VolumeKnobs {
    /// The life of a volume in view; at least 1.
    pub shortest: u16,
    /// The longest life of any volume, at least [`VolumeKnobs::shortest`].
    pub longest: u16,
}

impl Default for VolumeKnobs {
    fn default() -> Self {
        Self { shortest: 4, longest: 256 }
    }
}

/// Knobs of the scene tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BspKnobs {
    /// A node with no more objects than this is not parted any further; at least 1.
    pub leaf_objects: u32,
    /// Updates between two reconstructions, at least 1. The paper says "several frames".
    pub reconstruction_period: u32,
    /// A node is worth building anew if it holds so many objects more than when it was built; at least 1.
    pub worth_reconstruction: u32,
    /// Updates without a change after which a node's box is tightened. The paper says "several frames".
    pub tighten_after: u32,
}

impl Default for BspKnobs {
    fn default() -> Self {
        Self {
            leaf_objects: 2,
            reconstruction_period: 8,
            worth_reconstruction: 2,
            tighten_after: 4,
        }
    }
}
