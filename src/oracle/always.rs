//! The stupid oracle: everything is visible, nothing is drawn. Each other oracle may only be more
//! useful than this, never less safe.

use super::{Answer, FrameView, Oracle, OracleError, Proxy, QueryId, ReadBack};
use crate::part::PartId;

/// Answers "visible" to every question.
#[derive(Debug, Default)]
pub struct Always {
    asked: u32,
    open: Vec<QueryId>,
    submitted: std::collections::VecDeque<Vec<QueryId>>,
}

impl Oracle for Always {
    fn name(&self) -> &'static str {
        "always"
    }

    fn begin_frame(&mut self, _: &FrameView<'_>) -> Result<(), OracleError> {
        *self = Self::default();
        Ok(())
    }

    fn draw_part(&mut self, _: PartId) {}

    fn ask(&mut self, _: &[Proxy]) -> QueryId {
        let query = QueryId(self.asked);
        self.asked += 1;
        self.open.push(query);
        query
    }

    fn submit(&mut self) -> Result<(), OracleError> {
        self.submitted.push_back(std::mem::take(&mut self.open));
        Ok(())
    }

    fn collect(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        let batch = self.submitted.pop_front().unwrap_or_default();
        answers.extend(batch.into_iter().map(|query| Answer { query, visible: true }));
        Ok(())
    }

    fn read_back(&mut self) -> Result<Option<ReadBack>, OracleError> {
        Ok(None)
    }

    fn redraw(&mut self, _: &[PartId]) -> Result<Option<ReadBack>, OracleError> {
        Ok(None)
    }
}
