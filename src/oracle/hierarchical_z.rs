//! Hierarchical z as engines build it (Greene, Kass & Miller 1993, *Hierarchical Z-buffer visibility*;
//! two-pass occlusion culling on the GPU since): a pyramid whose every level halves the one below and
//! keeps the farthest depth, and one look at a handful of texels for each rectangle, at the level where
//! it meets at most 2 × 2 of them. So it errs towards "visible": texels reach beyond the rectangle.
//!
//! 1. Level k + 1 has ⌈w / 2⌉ × ⌈h / 2⌉ texels; each is the maximum of the up to 2 × 2 texels below it.
//!    Rounding up keeps the last column and row of an odd level.
//! 2. A rectangle of samples `min` to `max − 1` meets the texels `min >> k` to `(max − 1) >> k`. The level
//!    is the lowest at which that is at most two along each axis.
//! 3. Visible if any of them is at or beyond the rectangle's depth. At most two along an axis are those of
//!    the rectangle's corners, so four looks are enough.
//!
//! The pyramid is built when it is asked, and anew after draws only where the one before does not hide the
//! rectangle: depths come nearer alone as a frame goes on, and what lay behind lies behind still. The
//! answers are those of a pyramid built for each.
//!
//! Its depth is the reference's, so what it may add to `sim` is only "visible". It loses where rectangles
//! are large or straddle texels. A hull is asked about by the rectangle around it; a box counts as visible
//! unasked.

use std::marker::PhantomData;

use plainsight_reference::Image;

use super::batches::Batches;
use super::{Answer, FrameView, Memory, Oracle, OracleError, Proxy, QueryId, ReadBack, Sim, Stage};
use crate::part::PartId;

/// The rules that can be got wrong, as they are right: each has been, in some engine. [`Sound`] keeps them
/// all; others exist to see that the bench notices. They are types, so that the oracle pays nothing.
pub trait PyramidRules {
    /// Whether a frame asks the depth that the frame before it left.
    const ASKS_LAST_FRAME: bool = false;

    /// Level 0 of an image of `width` columns, from its depths row by row.
    #[must_use]
    fn level_0(width: usize, depths: Vec<f32>) -> Vec<f32> {
        let _ = width;
        depths
    }

    /// Texels along an axis of the level above one of `size`.
    #[must_use]
    fn halved(size: usize) -> usize {
        size.div_ceil(2)
    }

    /// First and last sample of a rectangle along an axis of `size` samples, as the pyramid is asked.
    #[must_use]
    fn span(size: usize, first: u32, last: u32) -> (u32, u32) {
        let _ = size;
        (first, last)
    }

    /// The level at which a rectangle of samples `first` to `last` meets at most 2 × 2 texels.
    #[must_use]
    fn level(first: [u32; 2], last: [u32; 2]) -> usize {
        let narrow = |k: &usize| (0..2).all(|axis| (last[axis] >> k) - (first[axis] >> k) <= 1);
        (0..u32::BITS as usize - 1).find(narrow).unwrap_or(u32::BITS as usize - 1)
    }

    /// The texels looked at along an axis, of those that the rectangle's ends are in.
    #[must_use]
    fn looks(first: usize, last: usize) -> [usize; 2] {
        [first, last]
    }
}

/// All rules kept.
#[derive(Clone, Copy, Debug)]
pub struct Sound;

impl PyramidRules for Sound {}

/// The oracle.
pub struct HierarchicalZ<R = Sound> {
    /// Draws; is never asked.
    sim: Sim,
    pyramid: Pyramid<R>,
    age: Age,
    answers: Batches,
}

/// What the pyramid shows.
#[derive(Clone, Copy, Debug, Eq, PartialEq)]
enum Age {
    /// All that is drawn.
    Current,
    /// What was drawn earlier in this frame.
    OfThisFrame,
    /// Another frame.
    Older,
}

/// Farthest depths, level by level; level 0 is the image.
#[derive(Debug)]
struct Pyramid<R> {
    levels: Vec<Level>,
    rules: PhantomData<R>,
}

#[derive(Debug)]
struct Level {
    width: usize,
    height: usize,
    texels: Vec<f32>,
}

/// The larger of two depths; they are never NaN, and unlike `f32::max` this is one instruction.
pub(super) fn farther(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

impl Level {
    /// The next one up.
    fn halved<R: PyramidRules>(&self) -> Self {
        let (width, height) = (R::halved(self.width).max(1), R::halved(self.height).max(1));
        let row_of = |row: usize| &self.texels[row * self.width..(row + 1) * self.width];
        let mut texels = Vec::with_capacity(width * height);
        for y in 0..height {
            let upper = row_of((2 * y).min(self.height - 1));
            let lower = row_of((2 * y + 1).min(self.height - 1));
            let ((upper, odd_above), (lower, odd_below)) =
                (upper.as_chunks::<2>(), lower.as_chunks::<2>());
            let most = |([a, b], [c, d]): (&[f32; 2], &[f32; 2])| {
                farther(farther(*a, *b), farther(*c, *d))
            };
            texels.extend(upper.iter().zip(lower).map(most));
            // The last column of an odd level, where the next one keeps it.
            let odd = odd_above.iter().zip(odd_below).map(|(a, b)| farther(*a, *b));
            texels.extend(odd.take(width - upper.len()));
        }
        Self { width, height, texels }
    }
}

impl<R: PyramidRules> Pyramid<R> {
    /// Over an image of `width` columns, row by row.
    fn new(width: usize, depths: Vec<f32>) -> Self {
        let height = depths.len() / width;
        let mut levels = vec![Level { width, height, texels: R::level_0(width, depths) }];
        while let Some(last) = levels.last().filter(|level| level.texels.len() > 1) {
            levels.push(last.halved::<R>());
        }
        Self { levels, rules: PhantomData }
    }

    /// Whether each texel has the farthest depth of the samples that it stands for, and the top is one texel.
    ///
    /// # Errors
    /// The first that has not.
    fn check(&self) -> Result<(), String> {
        let base = &self.levels[0];
        for (k, level) in self.levels.iter().enumerate() {
            let mut most = vec![f32::NEG_INFINITY; level.width * level.height];
            for (y, row) in base.texels.chunks(base.width).enumerate() {
                for (x, &depth) in row.iter().enumerate() {
                    let Some(texel) = most.get_mut((y >> k) * level.width + (x >> k)) else {
                        return Err(format!("level {k} has no texel for sample ({x}, {y})"));
                    };
                    *texel = farther(*texel, depth);
                }
            }
            if let Some(texel) = most.iter().zip(&level.texels).position(|(most, has)| most != has)
            {
                return Err(format!(
                    "texel {texel} of level {k} has not the farthest depth below it"
                ));
            }
        }
        let top = self.levels.last().map_or(0, |level| level.texels.len());
        if top == 1 { Ok(()) } else { Err(format!("the top of the pyramid has {top} texels")) }
    }

    /// Whether a rectangle, columns `min[0]..max[0]` and rows `min[1]..max[1]`, may show a sample at
    /// `depth` or beyond.
    fn may_show(&self, min: [u32; 2], max: [u32; 2], depth: f32) -> bool {
        let base = &self.levels[0];
        let (x0, x1) = R::span(base.width, min[0], max[0] - 1);
        let (y0, y1) = R::span(base.height, min[1], max[1] - 1);
        let k = R::level([x0, y0], [x1, y1]).min(self.levels.len() - 1);
        let level = &self.levels[k];
        // No rule leads beyond the last texel; where one is broken, as samplers do.
        let looks = |first: u32, last: u32, size: usize| {
            R::looks((first >> k) as usize, (last >> k) as usize).map(|texel| texel.min(size - 1))
        };
        let (columns, rows) = (looks(x0, x1, level.width), looks(y0, y1, level.height));
        rows.iter().any(|y| columns.iter().any(|x| level.texels[y * level.width + x] >= depth))
    }
}

impl HierarchicalZ {
    /// An image of its own over the stage.
    ///
    /// # Panics
    /// Where the stage has not enough memory for its largest mesh.
    #[must_use]
    pub fn new(stage: Stage) -> Self {
        Self::by_rules(stage)
    }
}

impl<R: PyramidRules> HierarchicalZ<R> {
    /// The same by other rules.
    ///
    /// # Panics
    /// As [`HierarchicalZ::new`].
    #[must_use]
    pub fn by_rules(stage: Stage) -> Self {
        let pyramid = Pyramid::new(1, vec![1.0]);
        Self { sim: Sim::new(stage), pyramid, age: Age::Older, answers: Batches::default() }
    }

    fn build(&mut self) {
        let image = self.sim.image();
        let width = image.viewport().width as usize;
        self.pyramid = Pyramid::new(width, image.depths());
        self.age = Age::Current;
    }

    /// Whether a rectangle may show, by all that is drawn.
    fn may_show(&mut self, min: [u32; 2], max: [u32; 2], depth: f32) -> bool {
        let held = self.age != Age::Older || R::ASKS_LAST_FRAME;
        if held && !self.pyramid.may_show(min, max, depth) {
            return false;
        }
        if self.age == Age::Current || R::ASKS_LAST_FRAME {
            return true;
        }
        self.build();
        self.pyramid.may_show(min, max, depth)
    }
}

impl<R: PyramidRules> Oracle for HierarchicalZ<R> {
    fn name(&self) -> &'static str {
        "hierarchical-z"
    }

    fn memory(&self) -> Option<Memory> {
        self.sim.memory()
    }

    fn begin_frame(&mut self, view: &FrameView<'_>) -> Result<(), OracleError> {
        if R::ASKS_LAST_FRAME {
            self.build();
        }
        self.age = Age::Older;
        self.answers.clear();
        self.sim.begin_frame(view)
    }

    fn draw_part(&mut self, part: PartId) {
        if self.age == Age::Current {
            self.age = Age::OfThisFrame;
        }
        self.sim.draw_part(part);
    }

    fn ask(&mut self, proxies: &[Proxy]) -> QueryId {
        let visible = proxies.iter().any(|proxy| match *proxy {
            Proxy::Rectangle { min, max, depth } | Proxy::Hull { min, max, depth, .. } => {
                self.may_show(min, max, depth)
            }
            Proxy::Box { .. } => true,
        });
        self.answers.answer(visible)
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        self.answers.submit();
        self.sim.submit()
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        self.answers.collect(answers);
        self.sim.collect(&mut Vec::new())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        self.sim.read_back()
    }

    fn check(&self) -> Result<(), String> {
        if self.age != Age::Older {
            self.pyramid.check()?;
        }
        self.sim.check()
    }

    fn reference_image(&self) -> Option<&Image> {
        self.sim.reference_image()
    }

    fn redraw(&mut self, _: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// Sides of an image, those at and beside the sides of tiles, blocks and levels as often as all others.
    fn sides() -> impl Strategy<Value = usize> {
        prop_oneof![1_usize..70, proptest::sample::select(&[1, 2, 3, 4, 31, 32, 33, 64, 65][..])]
    }

    /// Places along a side, the first and the last as often as all others.
    fn places() -> impl Strategy<Value = usize> {
        prop_oneof![0_usize..70, Just(0), Just(usize::MAX)]
    }

    /// Shares of a side, its ends as often as all others.
    fn share() -> impl Strategy<Value = f64> {
        prop_oneof![0.0..1.0_f64, Just(0.0), Just(1.0)]
    }

    proptest! {
        /// Never "hidden" where a sample says "visible", whatever the sizes, and exact for a rectangle
        /// that fills a texel.
        #[test]
        fn errs_towards_visible_alone(
            width in sides(),
            height in sides(),
            far in proptest::collection::vec((places(), places(), 0_u8..4), 0..6),
            corners in [share(), share(), share(), share()],
            depth in 0_u8..=4,
            reversed in proptest::bool::ANY,
        ) {
            // Of forward depth, or of reversed depth as it is kept.
            let least = if reversed { -1.0 } else { 0.0 };
            let mut depths = vec![least; width * height];
            for (x, y, d) in far {
                depths[y.min(height - 1) * width + x.min(width - 1)] = f32::from(d) / 4.0 + least;
            }
            let span = |a: f64, b: f64, side: usize| {
                let low = ((a.min(b) * side as f64) as u32).min(side as u32 - 1);
                (low, ((a.max(b) * side as f64) as u32).max(low + 1))
            };
            let ((x0, x1), (y0, y1)) =
                (span(corners[0], corners[1], width), span(corners[2], corners[3], height));
            let depth = f32::from(depth) / 4.0 + least;
            let pyramid = Pyramid::<Sound>::new(width, depths.clone());
            let any = |[x0, y0]: [u32; 2], [x1, y1]: [u32; 2]| {
                (y0..y1).any(|y| (x0..x1).any(|x| depths[y as usize * width + x as usize] >= depth))
            };
            if any([x0, y0], [x1, y1]) {
                prop_assert!(pyramid.may_show([x0, y0], [x1, y1], depth));
            }
            // What the texels reach: at most the rectangle's own size more on each side.
            let (wide, high) = (x1 - x0, y1 - y0);
            let side = 2 * wide.max(high);
            let reach = ([x0.saturating_sub(side), y0.saturating_sub(side)],
                [(x1 + side).min(width as u32), (y1 + side).min(height as u32)]);
            if pyramid.may_show([x0, y0], [x1, y1], depth) {
                prop_assert!(any(reach.0, reach.1));
            }
            let whole = pyramid.may_show([0, 0], [width as u32, height as u32], depth);
            prop_assert_eq!(whole, any([0, 0], [width as u32, height as u32]));
        }
    }
}
