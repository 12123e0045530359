//! **truth**: the fast renderer, which all that is judged rests on, equals the naive one bit for bit. The
//! naive one is slow, so it is asked where an answer is worth most: in the first frame of a lane in which a
//! check fails, before a culler is blamed, and in a frame now and then of a sweep, in which nothing need
//! have failed. Where the two disagree the naive renderer decides, and what was said of that frame is said
//! again by its picture.

use plainsight_reference::Image;

use crate::run::{FrameRecord, Moment, Truth, render, render_naively};
use crate::scene::Stream;

/// A picture that the two renderers disagree about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Disagreement {
    /// The frame and view.
    pub moment: Moment,
    /// Samples that differ.
    pub pixels: u32,
    /// Column and row of the first of them, row 0 on top.
    pub first_pixel: [u32; 2],
    /// Whether the picture is that of what was drawn, where that of everything is right.
    pub of_drawn: bool,
}

impl Disagreement {
    fn of(moment: Moment, of_drawn: bool, [fast, naive]: [&Image; 2]) -> Option<Self> {
        let differs = |sample: &usize| fast.word(*sample) != naive.word(*sample);
        let mut samples = (0..fast.sample_count()).filter(differs);
        let first = samples.next()? as u32;
        let width = fast.viewport().width;
        let pixels = 1 + samples.count() as u32;
        Some(Self { moment, pixels, first_pixel: [first % width, first / width], of_drawn })
    }
}

/// What the naive renderer says of a frame.
pub(super) struct Naive {
    /// Everything.
    pub(super) truth: Truth,
    /// What was drawn.
    pub(super) drawn: Image,
}

/// Asks the naive renderer.
#[derive(Default)]
pub struct TruthCheck {
    /// Whether the first failing frame was found right: then the truth is not doubted again.
    trusted: bool,
    /// Picks the frames of a sweep, one in so many.
    sample: Option<(Stream, u32)>,
    checked: u32,
    wrong: Vec<Disagreement>,
}

impl TruthCheck {
    /// One that has the naive renderer draw, beside failing frames, one frame in `one_in` as `stream` picks.
    #[must_use]
    pub fn sampling(stream: Stream, one_in: u32) -> Self {
        Self { sample: Some((stream, one_in)), ..Self::default() }
    }

    /// Whether the next frame is picked, whatever is said of it; asked once a frame.
    pub(super) fn picks(&mut self) -> bool {
        self.sample.as_mut().is_some_and(|(stream, one_in)| stream.below(*one_in) == 0)
    }

    /// Whether a frame in which something fails is to be drawn by the naive renderer.
    pub(super) fn doubts(&self) -> bool {
        !self.trusted
    }

    /// Has the naive renderer draw a frame; what it drew where the fast one drew something else.
    pub(super) fn frame(&mut self, record: &FrameRecord<'_>, failing: bool) -> Option<Naive> {
        let (world, state, moment) = (record.world, record.state, record.state.moment);
        self.checked += 1;
        let truth = Truth::naive(world, state);
        let drawn = render_naively(world, state, record.drawn);
        let mut fast = world.image();
        render(world, state, record.drawn, &mut fast);
        let wrong = Disagreement::of(moment, false, [&record.truth.image, &truth.image])
            .or_else(|| Disagreement::of(moment, true, [&fast, &drawn]));
        match wrong {
            None => self.trusted |= failing && self.wrong.is_empty(),
            Some(wrong) => self.wrong.push(wrong),
        }
        wrong.map(|_| Naive { truth, drawn })
    }

    /// How many frames the naive renderer drew.
    #[must_use]
    pub fn checked(&self) -> u32 {
        self.checked
    }

    /// Where the renderers disagree, frame by frame.
    #[must_use]
    pub fn wrong(&self) -> &[Disagreement] {
        &self.wrong
    }
}
