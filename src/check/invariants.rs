//! The promises of a lane's culler, index and oracle: none was broken on the way, whether or not the picture
//! shows it.

use crate::run::Moment;

/// Keeps the first broken promise and counts the frames in which one was.
#[derive(Clone, Debug, Default)]
pub struct Invariants {
    first: Option<(Moment, String)>,
    count: u32,
}

impl Invariants {
    /// Takes a broken promise.
    pub fn broken(&mut self, moment: Moment, promise: &str) {
        self.count += 1;
        self.first.get_or_insert_with(|| (moment, promise.to_owned()));
    }

    /// When a promise was broken first, and which; `None` where all were kept.
    #[must_use]
    pub fn first(&self) -> Option<(Moment, &str)> {
        self.first.as_ref().map(|(moment, promise)| (*moment, promise.as_str()))
    }

    /// Frames and views in which a promise was broken.
    #[must_use]
    pub fn count(&self) -> u32 {
        self.count
    }
}
