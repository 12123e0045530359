//! **image**: the reference's image of the drawn parts equals its image of all parts, bit for bit. On a
//! device with a tolerance, only where no device within it could show another part.

use plainsight_reference::{Image, Tolerance};

use crate::run::{FrameRecord, Moment, render};

/// A sample where two images differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The frame and view.
    pub moment: Moment,
    /// How many samples differ.
    pub pixels: u32,
    /// Column and row of the first of them, row 0 on top.
    pub first_pixel: [u32; 2],
}

impl Difference {
    /// Counts the samples of a frame that `differ` picks; `None` for none.
    pub(super) fn find(
        record: &FrameRecord<'_>,
        mut differ: impl FnMut(usize) -> bool,
    ) -> Option<Self> {
        let viewport = record.truth.image.viewport();
        let mut first = None;
        let mut pixels = 0;
        for sample in 0..(viewport.width * viewport.height) as usize {
            if differ(sample) {
                pixels += 1;
                first.get_or_insert(sample as u32);
            }
        }
        let first = first?;
        let first_pixel = [first % viewport.width, first / viewport.width];
        Some(Self { moment: record.state.moment, pixels, first_pixel })
    }
}

/// Renders what was drawn, where the oracle has not done so, and compares.
#[derive(Default)]
pub struct ImageCheck {
    image: Option<Image>,
    differences: Vec<Difference>,
}

impl ImageCheck {
    /// Compares one frame.
    pub fn frame(&mut self, record: &FrameRecord<'_>) {
        let image = match record.reference {
            Some(image) => image,
            None => {
                let image = self.image.get_or_insert_with(|| record.world.image());
                render(record.world, record.state, record.drawn, image);
                image
            }
        };
        let all = &record.truth.image;
        if image == all {
            return;
        }
        if record.lane.tolerance == Tolerance::EXACT {
            self.differences.extend(Difference::find(record, |i| image.word(i) != all.word(i)));
            return;
        }
        let decided = &record.fates().decided;
        let shown = |i| image.draw_index(i).map(|draw| record.world.partition.part_of_draw(draw).0);
        let differ = |i: usize| decided[i].is_some_and(|part| shown(i) != Some(part));
        self.differences.extend(Difference::find(record, differ));
    }

    /// Compares the frame that was compared last once more, by other pictures.
    pub(super) fn look_again(&mut self, record: &FrameRecord<'_>) {
        let moment = record.state.moment;
        if self.differences.last().is_some_and(|last| last.moment == moment) {
            self.differences.pop();
        }
        self.frame(record);
    }

    /// The frames that differ.
    #[must_use]
    pub fn differences(&self) -> &[Difference] {
        &self.differences
    }
}
