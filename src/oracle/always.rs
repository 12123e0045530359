//! The stupid oracle: everything is visible, nothing is drawn. Each other oracle may only be more
//! useful than this, never less safe.

use super::batches::Batches;
use super::{Answer, FrameView, Oracle, OracleError, Proxy, QueryId, ReadBack};
use crate::part::PartId;

/// Answers "visible" to every question.
#[derive(Debug, Default)]
pub struct Always {
    answers: Batches,
}

impl Oracle for Always {
    fn name(&self) -> &'static str {
        "always"
    }

    fn begin_frame(&mut self, _: &FrameView<'_>) -> Result<(), OracleError> {
        self.answers.clear();
        Ok(())
    }

    fn draw_part(&mut self, _: PartId) {}

    fn ask(&mut self, _: &[Proxy]) -> QueryId {
        self.answers.answer(true)
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        self.answers.submit();
        Ok(())
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        self.answers.collect(answers);
        Ok(())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        Ok(None)
    }

    fn redraw(&mut self, _: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        Ok(None)
    }
}
