//! **device image**: the depth that the culler's own frame left on the device equals the depth of
//! drawing everything there, bit for bit, and every part that shows there was drawn. Depth does not
//! depend on the order of drawing; ids at ties do, and everything is drawn in draw-index order. So a
//! sample that shows a drawn part would show it as well with the drawn parts alone in that order: it is
//! the first of all at the least depth, hence of those. Nothing but everything needs drawing again.

use super::image::Difference;
use crate::run::FrameRecord;

/// Compares what a real device drew.
#[derive(Clone, Debug, Default)]
pub struct DeviceImage {
    frames: u32,
    differences: Vec<Difference>,
}

impl DeviceImage {
    /// Compares one frame; does nothing where no real device drew.
    pub fn frame(&mut self, record: &FrameRecord<'_>) {
        let Some(device) = &record.device else { return };
        self.frames += 1;
        let depth = |i: usize| device.own.depth[i].to_bits() != device.all.depth[i].to_bits();
        // By part id plus one, as in the image; nothing needs no drawing.
        let mut drawn = vec![false; record.world.partition.part_count() as usize + 1];
        drawn[0] = true;
        record.drawn.iter().for_each(|part| drawn[part.0 as usize + 1] = true);
        let missing =
            |i: usize| device.all.parts.as_ref().is_some_and(|parts| !drawn[parts[i] as usize]);
        self.differences.extend(Difference::find(record, |i| depth(i) || missing(i)));
    }

    /// Whether the device's images were equal in every frame; `None` where no device drew.
    #[must_use]
    pub fn equal(&self) -> Option<bool> {
        (self.frames > 0).then_some(self.differences.is_empty())
    }

    /// The frames that differ.
    #[must_use]
    pub fn differences(&self) -> &[Difference] {
        &self.differences
    }
}
