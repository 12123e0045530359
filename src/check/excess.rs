//! **excess**: what was drawn beyond what is visible. Never wrong, only dear.

use crate::run::FrameRecord;

/// Sums over the frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct Excess {
    drawn: u64,
    visible: u64,
}

impl Excess {
    /// Adds one frame.
    pub fn frame(&mut self, record: &FrameRecord<'_>) {
        self.drawn += record.drawn.len() as u64;
        self.visible += u64::from(record.truth.visible_parts);
    }

    /// Parts drawn, over all frames.
    #[must_use]
    pub fn drawn(&self) -> u64 {
        self.drawn
    }

    /// Parts visible, over all frames.
    #[must_use]
    pub fn visible(&self) -> u64 {
        self.visible
    }
}
