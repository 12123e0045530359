//! The answers of an oracle that knows them at once, kept until they are collected: numbered in asking
//! order, handed over batch by batch.

use std::collections::VecDeque;

use super::{Answer, QueryId};

/// One frame's answers.
#[derive(Debug, Default)]
pub(super) struct Batches {
    asked: u32,
    open: Vec<Answer>,
    submitted: VecDeque<Vec<Answer>>,
}

impl Batches {
    /// Forgets all questions: a new frame.
    pub(super) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Takes the answer to the next question, and says which that is.
    pub(super) fn answer(&mut self, visible: bool) -> QueryId {
        let query = QueryId(self.asked);
        self.asked += 1;
        self.open.push(Answer { query, visible });
        query
    }

    /// Ends the batch.
    pub(super) fn submit(&mut self) {
        self.submitted.push_back(std::mem::take(&mut self.open));
    }

    /// Appends the answers of the oldest batch not yet collected.
    pub(super) fn collect(&mut self, answers: &mut Vec<Answer>) {
        answers.extend(self.submitted.pop_front().unwrap_or_default());
    }
}
