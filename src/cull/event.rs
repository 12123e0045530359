//! Events: what a culler did in a frame, or was told, in order. The hash of a trace is made of them, and
//! where two traces of a frame part they tell who parted first: the culler by a draw or a question, or the
//! device by an answer.

use std::fmt;

use crate::oracle::{Answer, Proxy, QueryId};
use crate::part::PartId;

/// Where the hash of a frame's events begins: the offset basis of FNV-1a.
pub(super) const HASH_START: u64 = 0xcbf2_9ce4_8422_2325;

/// Kinds of events.
const DRAW: u8 = 1;
const ASK: u8 = 2;
const RECTANGLE: u8 = 3;
const ANSWER: u8 = 4;
const HULL: u8 = 5;
const BOX: u8 = 6;

/// A draw, a question, a word of a question's proxies, or an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Event {
    kind: u8,
    value: u64,
}

impl fmt::Display for Event {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { kind, value } = *self;
        match kind {
            DRAW => write!(f, "draw of part {value}"),
            ASK => write!(f, "question {value}"),
            ANSWER => {
                let word = if value & 1 == 1 { "visible" } else { "hidden" };
                write!(f, "answer \"{word}\" to question {}", value >> 1)
            }
            _ => write!(f, "a proxy's place or depth, {value:#x}"),
        }
    }
}

impl Event {
    /// A part is drawn.
    #[must_use]
    pub fn draw(part: PartId) -> Self {
        Self { kind: DRAW, value: part.0.into() }
    }

    /// A question is asked; its proxies follow.
    #[must_use]
    pub fn ask(query: QueryId) -> Self {
        Self { kind: ASK, value: query.0.into() }
    }

    /// A question is answered.
    #[must_use]
    pub fn answer(answer: Answer) -> Self {
        let value = u64::from(answer.query.0) << 1 | u64::from(answer.visible);
        Self { kind: ANSWER, value }
    }

    /// The answer that it is, if it is one.
    #[must_use]
    pub fn as_answer(&self) -> Option<Answer> {
        let query = QueryId((self.value >> 1) as u32);
        (self.kind == ANSWER).then_some(Answer { query, visible: self.value & 1 == 1 })
    }

    /// With an answer, the other one to the same question.
    pub(crate) fn other_answer(&mut self) -> Option<(&mut Self, Self)> {
        let Answer { query, visible } = self.as_answer()?;
        Some((self, Self::answer(Answer { query, visible: !visible })))
    }

    /// Adds the event to a hash: FNV-1a over whole words with a rotation.
    #[must_use]
    pub(super) fn fold_into(self, hash: u64) -> u64 {
        [u64::from(self.kind), self.value]
            .into_iter()
            .fold(hash, |hash, word| (hash ^ word).wrapping_mul(0x0100_0000_01b3).rotate_left(29))
    }

    /// The hash of a frame that had these events.
    #[must_use]
    pub fn hash(events: &[Self]) -> u64 {
        events.iter().fold(HASH_START, |hash, event| event.fold_into(hash))
    }
}

/// Says the events that hold a proxy: everything of it that an answer depends on.
pub(super) fn of_proxy(proxy: &Proxy, note: &mut dyn FnMut(Event)) {
    let pair = |[high, low]: [u32; 2]| u64::from(high) << 32 | u64::from(low);
    match *proxy {
        Proxy::Rectangle { min, max, depth } | Proxy::Hull { min, max, depth, .. } => {
            for value in [pair(min), pair(max), depth.to_bits().into()] {
                note(Event { kind: RECTANGLE, value });
            }
        }
        Proxy::Box { clip_from_box, min, max } => {
            let words: Vec<f32> = clip_from_box.into_iter().chain(min).chain(max).collect();
            for two in words.chunks_exact(2) {
                let value = pair([two[0].to_bits(), two[1].to_bits()]);
                note(Event { kind: BOX, value });
            }
        }
    }
    if let Proxy::Hull { hull, .. } = proxy {
        for corner in hull.corners() {
            note(Event { kind: HULL, value: pair(corner.map(|at| at as u32)) });
        }
    }
}

/// Words of a box: a matrix of 16 and two corners of 3, two to an event.
const BOX_EVENTS: usize = (16 + 3 + 3) / 2;

/// A question as the events of its frame have it.
#[derive(Clone, Debug, PartialEq)]
pub struct Asked {
    /// Its proxies. A hull is told as the rectangle around it, at its depth.
    pub proxies: Vec<Proxy>,
    /// The parts drawn before it, in order.
    pub drawn: Vec<PartId>,
}

impl Asked {
    /// The question of that number; `None` where the events hold none.
    #[must_use]
    pub fn find(events: &[Event], query: QueryId) -> Option<Self> {
        let at = events.iter().position(|event| *event == Event::ask(query))?;
        let drawn = events[..at].iter().filter(|event| event.kind == DRAW);
        let drawn = drawn.map(|event| PartId(event.value as u32)).collect();
        let own = events[at + 1..].iter().take_while(|e| [RECTANGLE, HULL, BOX].contains(&e.kind));
        let of = |kind: u8| own.clone().filter(move |event| event.kind == kind).map(|e| e.value);
        let pair = |value: u64| [(value >> 32) as u32, value as u32];
        let rectangles: Vec<u64> = of(RECTANGLE).collect();
        let rectangle = |words: &[u64]| Proxy::Rectangle {
            min: pair(words[0]),
            max: pair(words[1]),
            depth: f32::from_bits(words[2] as u32),
        };
        let boxes: Vec<f32> = of(BOX).flat_map(pair).map(f32::from_bits).collect();
        let of_box = |words: &[f32]| Proxy::Box {
            clip_from_box: std::array::from_fn(|i| words[i]),
            min: std::array::from_fn(|i| words[16 + i]),
            max: std::array::from_fn(|i| words[19 + i]),
        };
        let proxies = rectangles.chunks_exact(3).map(rectangle);
        let proxies = proxies.chain(boxes.chunks_exact(2 * BOX_EVENTS).map(of_box)).collect();
        Some(Self { proxies, drawn })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn questions_read_back() {
        let rectangle = Proxy::Rectangle { min: [1, 2], max: [30, 4], depth: 0.25 };
        let of_box = Proxy::Box {
            clip_from_box: std::array::from_fn(|i| i as f32 - 0.5),
            min: [-1.0, -2.0, -3.0],
            max: [4.0, 5.0, 6.5],
        };
        let mut events = vec![Event::draw(PartId(7)), Event::ask(QueryId(0))];
        of_proxy(&rectangle, &mut |event| events.push(event));
        events.push(Event::draw(PartId(2)));
        events.push(Event::ask(QueryId(1)));
        of_proxy(&of_box, &mut |event| events.push(event));
        of_proxy(&of_box, &mut |event| events.push(event));
        let answer = Answer { query: QueryId(1), visible: true };
        events.push(Event::answer(answer));
        let asked = |number| Asked::find(&events, QueryId(number));
        assert_eq!(asked(0), Some(Asked { proxies: vec![rectangle], drawn: vec![PartId(7)] }));
        let drawn = vec![PartId(7), PartId(2)];
        assert_eq!(asked(1), Some(Asked { proxies: vec![of_box; 2], drawn }));
        assert_eq!(asked(2), None);
        assert_eq!(events.last().unwrap().as_answer(), Some(answer));
        assert_eq!(events[0].as_answer(), None);
    }
}
