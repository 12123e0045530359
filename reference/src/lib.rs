//! The ground truth of plainsight. (Conventions to be written here.)

/// Pixels of an image; both sides at least 1 and at most 16384.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Viewport {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
}
