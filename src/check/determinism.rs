//! **determinism**: a frame run again by a new culler leaves the same trace. Where it does not, the first
//! event that differs says whose doing it is. By a draw or a question the culler parted from itself. By an
//! answer, with all draws, questions and answers before it the same, the device did, and so it did where all
//! events are the same and only its picture is not: that is **device not repeatable**, and no fault of the
//! culler's. What follows in later frames of the same round follows from that and is not looked at.

use crate::cull::Asked;
use crate::run::{FrameTrace, HASH_START, Moment, Repetition, render};

/// Compares repeated frames.
#[derive(Clone, Debug, Default)]
pub struct Determinism {
    compared: u32,
    /// The frame compared last; a round begins where frames do not go on.
    last: Option<Moment>,
    /// Whether the traces have parted in this round.
    parted: bool,
    culler: Option<(Moment, String)>,
    device: Option<(Moment, String)>,
}

impl Determinism {
    /// Compares the two traces of one frame by what must repeat; wall time is left out.
    pub fn repeated(&mut self, repetition: &Repetition<'_>) {
        let (first, again) = (repetition.first, repetition.again);
        self.compared += 1;
        if self.last.is_some_and(|last| first.moment <= last) {
            self.parted = false;
        }
        self.last = Some(first.moment);
        if self.parted || first.fold_into(HASH_START) == again.fold_into(HASH_START) {
            return;
        }
        self.parted = true;
        match device_difference(repetition) {
            Some(words) => self.device.get_or_insert((first.moment, words)),
            None => self.culler.get_or_insert_with(|| (first.moment, what_differs(first, again))),
        };
    }

    /// How many frames were compared.
    #[must_use]
    pub fn compared(&self) -> u32 {
        self.compared
    }

    /// The first frame in which the culler did not repeat.
    #[must_use]
    pub fn first_difference(&self) -> Option<Moment> {
        self.culler.as_ref().map(|(moment, _)| *moment)
    }

    /// The first event of it that differed, in words, or what else did; empty where all repeated.
    #[must_use]
    pub fn first_event(&self) -> &str {
        self.culler.as_ref().map_or("", |(_, event)| event)
    }

    /// The first frame in which the device did not repeat, and how, in words.
    #[must_use]
    pub fn device(&self) -> Option<(Moment, &str)> {
        self.device.as_ref().map(|(moment, words)| (*moment, words.as_str()))
    }
}

/// How many events two traces of a frame begin with alike.
fn alike(first: &FrameTrace, again: &FrameTrace) -> usize {
    first.events.iter().zip(&again.events).take_while(|(a, b)| a == b).count()
}

/// The first event of two traces of one frame that differs; where none does, what else.
fn what_differs(first: &FrameTrace, again: &FrameTrace) -> String {
    let same = alike(first, again);
    let at = |trace: &FrameTrace| {
        trace.events.get(same).map_or("the end of the frame".to_owned(), ToString::to_string)
    };
    if same < first.events.len().max(again.events.len()) {
        return format!("event {same} was {}, and then {}", at(first), at(again));
    }
    let other = match first.truth_hash != again.truth_hash {
        true => "the truth's image",
        false if first.memory != again.memory => "the memory's traffic",
        false => "the number of round trips",
    };
    format!("all events were the same, {other} was not")
}

/// What the device did not repeat, in words; `None` where it is not the device's doing.
fn device_difference(repetition: &Repetition<'_>) -> Option<String> {
    let (first, again) = (repetition.first, repetition.again);
    let same = alike(first, again);
    let [one, other] = [first, again].map(|trace| trace.events.get(same));
    if let (None, None) = (one, other) {
        let only_image = FrameTrace { image_hash: first.image_hash, ..again.clone() };
        return (first.fold_into(HASH_START) == only_image.fold_into(HASH_START)).then(|| {
            format!(
                "{}: all {same} events were the same when run again, the image of what was drawn was not",
                first.moment
            )
        });
    }
    let (one, other) = (one?.as_answer()?, other?.as_answer()?);
    let word = |visible: bool| if visible { "visible" } else { "hidden" };
    let answers = match one.query == other.query {
        true => format!(
            "question {} was answered \"{}\" and, run again, \"{}\"",
            one.query.0,
            word(one.visible),
            word(other.visible)
        ),
        false => format!(
            "question {} was answered where, run again, question {} was",
            one.query.0, other.query.0
        ),
    };
    let tie = Asked::find(&first.events, one.query).map_or(String::new(), |asked| {
        let mut image = repetition.world.image();
        render(repetition.world, repetition.state, &asked.drawn, &mut image);
        nearest(&asked, &image)
    });
    Some(format!(
        "{}, event {same}: {answers}; all events before it were the same{tie}",
        first.moment
    ))
}

/// Where a question's proxies come nearest to what was drawn before it.
fn nearest(asked: &Asked, image: &plainsight_reference::Image) -> String {
    let ties = asked.proxies.iter().filter_map(|proxy| proxy.nearest_tie(image));
    let Some(tie) = ties.min_by_key(|tie| tie.ulps) else {
        return "; its proxies cover no sample".to_owned();
    };
    let whose = match asked.proxies.len() {
        1 => "its proxy".to_owned(),
        more => format!("the nearest of its {more} proxies"),
    };
    let [[left, top], [right, bottom]] = tie.rectangle;
    let [x, y] = tie.pixel;
    format!(
        "; {whose} is columns {left}..{right}, rows {top}..{bottom} at depth {:?}, and the nearest tie with what was drawn before it is {:e} ({} ulps) away, at ({x}, {y})",
        tie.depth, tie.distance, tie.ulps
    )
}
