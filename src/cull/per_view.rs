//! One culler for each view of a frame. What was visible to one camera says nothing of another, so each
//! view has a history and an index of its own, and every culler that knows one view serves many. It
//! costs an index update a view.

use super::{Culler, Item, Pen, Scenery, View};
use crate::math::Aabb;
use crate::oracle::OracleError;

/// Hands each view to the culler of that number.
pub struct PerView {
    cullers: Vec<Box<dyn Culler>>,
    /// Which view was drawn last: the others know nothing of this frame yet.
    latest: usize,
}

impl PerView {
    /// As many as there are views, at least one; a single view's culler needs no wrapping.
    #[must_use]
    pub fn over(views: u32, make: impl Fn() -> Box<dyn Culler>) -> Box<dyn Culler> {
        let cullers: Vec<_> = (0..views.max(1)).map(|_| make()).collect();
        if cullers.len() > 1 {
            return Box::new(Self { cullers, latest: 0 });
        }
        cullers.into_iter().next().expect("there is at least one view")
    }
}

impl Culler for PerView {
    fn name(&self) -> &str {
        self.cullers[0].name()
    }

    fn frame(&mut self, view: &View<'_>, pen: &mut Pen<'_>) -> Result<(), OracleError> {
        self.latest = view.view as usize;
        self.cullers[self.latest].frame(view, pen)
    }

    fn check(&self, boxes: &[Aabb]) -> Result<(), String> {
        self.cullers[self.latest].check(boxes)
    }

    fn scenery(&self, view: u32) -> Option<&Scenery> {
        self.cullers[view as usize].scenery(view)
    }

    fn recall(&self, view: &View<'_>, item: Item) -> Option<String> {
        self.cullers[view.view as usize].recall(view, item)
    }
}
