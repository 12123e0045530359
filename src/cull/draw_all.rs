//! The stupid culler: draws every part. Always safe, always last in the excess column.

use super::{Culler, CullerSetup, Pen, View};
use crate::oracle::OracleError;
use crate::part::PartId;

/// Draws every part in the order of ids.
#[derive(Clone, Copy, Debug)]
pub struct DrawAll {
    parts: u32,
}

impl DrawAll {
    /// Needs to know only how many parts there are.
    #[must_use]
    pub fn new(setup: CullerSetup) -> Self {
        Self { parts: setup.partition.part_count() }
    }
}

impl Culler for DrawAll {
    fn name(&self) -> &str {
        "draw-all"
    }

    fn frame(&mut self, _: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        (0..self.parts).map(PartId).for_each(|part| pen.draw(part));
        Ok(())
    }
}
