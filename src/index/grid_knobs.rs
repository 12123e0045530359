//! What the grids can be told.

/// The knob of a grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GridKnobs {
    /// Objects in a cell of the deepest level, were they spread evenly; above 0.
    pub per_cell: f64,
}

impl Default for GridKnobs {
    fn default() -> Self {
        Self { per_cell: 12.0 }
    }
}
