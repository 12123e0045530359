//! The pen: what a culler draws and asks with. It hands everything on to the oracle and keeps the
//! record that the trace is made of.

use super::event::{self, Event};
use super::{Item, Journal, Question, Situation, Situations};
use crate::oracle::{Amounts, Answer, Oracle, OracleError, Proxy, QueryId};
use crate::part::{PartId, Partition};

/// What one frame cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Questions asked.
    pub queries: u64,
    /// Proxies in all questions; more than questions where some were asked about together.
    pub proxies: u64,
    /// Samples of all rectangles asked about; one within two rectangles counts twice. A hull counts its
    /// area, a box none: what it covers is known to the oracle alone. In no hash: the proxies are.
    pub pixels: u64,
    /// Triangles of the parts drawn.
    pub triangles: u64,
    /// Answers that were "visible".
    pub visible_answers: u64,
    /// Times the culler waited for answers.
    pub round_trips: u64,
}

impl Counts {
    /// The work as a cost model weighs it, with the number of parts drawn.
    #[must_use]
    pub fn amounts(&self, parts: u64) -> Amounts {
        Amounts {
            parts,
            triangles: self.triangles,
            queries: self.queries,
            proxies: self.proxies,
            pixels: self.pixels,
            trips: self.round_trips,
        }
    }
}

/// Draws, asks, and remembers.
pub struct Pen<'a> {
    oracle: &'a mut dyn Oracle,
    partition: &'a Partition,
    drawn: Vec<PartId>,
    already: Vec<bool>,
    counts: Counts,
    events_hash: u64,
    situations: Situations,
    /// Questions of the batch that are about several proxies.
    several: Vec<QueryId>,
    journal: Option<&'a mut Journal>,
    events: Option<Vec<Event>>,
}

/// A frame as it was drawn.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The parts in drawing order, each once.
    pub drawn: Vec<PartId>,
    /// What it cost.
    pub counts: Counts,
    /// Hash of every draw, question and answer in order.
    pub events_hash: u64,
    /// What the culler got into.
    pub situations: Situations,
    /// The events themselves, where the pen was told to keep them.
    pub events: Vec<Event>,
}

impl<'a> Pen<'a> {
    /// A pen for one frame of the parts of `partition`.
    pub fn new(oracle: &'a mut dyn Oracle, partition: &'a Partition) -> Self {
        Self {
            oracle,
            partition,
            drawn: Vec::new(),
            already: vec![false; partition.part_count() as usize],
            counts: Counts::default(),
            events_hash: event::HASH_START,
            situations: Situations::default(),
            several: Vec::new(),
            journal: None,
            events: None,
        }
    }

    /// The same pen, that keeps every event as well.
    #[must_use]
    pub fn keeping_events(self) -> Self {
        Self { events: Some(Vec::new()), ..self }
    }

    /// The same pen, that keeps a journal as well.
    #[must_use]
    pub fn writing(self, journal: &'a mut Journal) -> Self {
        Self { journal: Some(journal), ..self }
    }

    /// Notes that the culler is in a situation.
    pub(super) fn reached(&mut self, situation: Situation) {
        self.situations.insert(situation);
    }

    /// Says that a node is walked into; see [`Journal`].
    pub(super) fn opens(&mut self, item: Item) {
        if let Some(journal) = &mut self.journal {
            journal.opened.push(item);
        }
    }

    /// Draws a part at this point of the stream; a part drawn before in the frame is not drawn again.
    ///
    /// # Panics
    /// For an id beyond the last part.
    pub fn draw(&mut self, part: PartId) {
        if !std::mem::replace(&mut self.already[part.0 as usize], true) {
            self.note(Event::draw(part));
            self.counts.triangles += u64::from(self.partition.part(part).triangle_count);
            self.drawn.push(part);
            self.oracle.draw_part(part);
        }
    }

    /// Asks whether any sample of `proxy` would pass against what was drawn so far.
    pub fn ask(&mut self, proxy: &Proxy) -> QueryId {
        self.ask_any(std::slice::from_ref(proxy))
    }

    /// One question about several proxies: whether any sample of any of them would pass.
    pub fn ask_any(&mut self, proxies: &[Proxy]) -> QueryId {
        self.ask_about(std::iter::empty(), proxies)
    }

    /// The same, saying which nodes the proxies stand for; see [`Journal`].
    pub fn ask_about(
        &mut self,
        items: impl IntoIterator<Item = Item>,
        proxies: &[Proxy],
    ) -> QueryId {
        self.counts.queries += 1;
        self.counts.proxies += proxies.len() as u64;
        let query = self.oracle.ask(proxies);
        if proxies.len() > 1 {
            self.several.push(query);
        }
        if let Some(journal) = &mut self.journal {
            let (items, proxies) = (items.into_iter().collect(), proxies.to_vec());
            let after_opened = journal.opened.len();
            journal.questions.push(Question { query, items, proxies, visible: None, after_opened });
        }
        self.note(Event::ask(query));
        for proxy in proxies {
            self.counts.pixels += proxy.pixels();
            event::of_proxy(proxy, &mut |event| self.note(event));
        }
        query
    }

    /// Ends the batch, waits, and appends its answers in asking order.
    ///
    /// # Errors
    /// What the oracle said.
    pub fn round_trip(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        self.send()?;
        self.receive(answers)
    }

    /// Ends the batch and sends it on its way.
    ///
    /// # Errors
    /// What the oracle said.
    pub fn send(&mut self) -> Result<(), OracleError> {
        self.oracle.submit()
    }

    /// Waits for the oldest batch that was sent and not received, and appends its answers in asking order;
    /// nothing where there is none.
    ///
    /// # Errors
    /// What the oracle said.
    pub fn receive(&mut self, answers: &mut Vec<Answer>) -> Result<(), OracleError> {
        self.counts.round_trips += 1;
        let before = answers.len();
        self.oracle.collect(answers)?;
        for answer in &answers[before..] {
            self.counts.visible_answers += u64::from(answer.visible);
            self.situations.insert(match answer.visible {
                true => Situation::AnsweredVisible,
                false => Situation::AnsweredHidden,
            });
            if !answer.visible && self.several.binary_search(&answer.query).is_ok() {
                self.situations.insert(Situation::SeveralHidden);
            }
            self.note(Event::answer(*answer));
            let question = self
                .journal
                .as_mut()
                .and_then(|j| j.questions.get_mut(answer.query.0 as usize))
                .filter(|question| question.query == answer.query);
            if let Some(question) = question {
                question.visible = Some(answer.visible);
            }
        }
        Ok(())
    }

    /// Ends the frame.
    ///
    /// # Errors
    /// What the oracle said to the last batch.
    pub fn finish(self) -> Result<Finished, OracleError> {
        self.oracle.submit()?;
        self.oracle.collect(&mut Vec::new())?;
        let Self { drawn, counts, events_hash, situations, events, .. } = self;
        let events = events.unwrap_or_default();
        Ok(Finished { drawn, counts, events_hash, situations, events })
    }

    fn note(&mut self, event: Event) {
        self.events_hash = event.fold_into(self.events_hash);
        if let Some(events) = &mut self.events {
            events.push(event);
        }
    }
}
