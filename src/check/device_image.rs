//! **device image**: the depth that the culler's own frame left on the device equals the depth of
//! drawing everything there, bit for bit. Depth does not depend on the order of drawing; ids at ties
//! do, so ids are compared on a redraw of both sets in draw-index order.

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
        let ids = match (&device.drawn.parts, &device.all.parts) {
            (Some(drawn), Some(all)) => Some((drawn, all)),
            _ => None,
        };
        let differ = |i: usize| depth(i) || ids.is_some_and(|(drawn, all)| drawn[i] != all[i]);
        self.differences.extend(Difference::find(record, differ));
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
