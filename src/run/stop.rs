//! Lanes that end before their last frame: why, and how a panic becomes a reason. A panic in a culler, an
//! oracle or the truth ends its lane and no other, and whoever watches the lane is told.

use std::any::Any;
use std::fmt;
use std::panic::{AssertUnwindSafe, catch_unwind};

use super::Moment;
use crate::oracle::OracleError;

/// Why a lane ended early.
#[derive(Clone, Debug)]
pub enum Cause {
    /// A panic, in its own words on one line.
    Panic(String),
    /// The oracle gave up.
    Oracle(OracleError),
    /// Its frame took longer than this many seconds and was not waited for.
    Hang(f64),
}

impl From<OracleError> for Cause {
    fn from(error: OracleError) -> Self {
        Self::Oracle(error)
    }
}

impl fmt::Display for Cause {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Panic(said) => f.write_str(said),
            Self::Oracle(error) => error.fmt(f),
            Self::Hang(seconds) => write!(f, "did not end within {seconds} s"),
        }
    }
}

/// The early end of a lane; reads "frame 3: index out of bounds".
#[derive(Clone, Debug)]
pub struct Stop {
    /// The frame and view in which it ended; `None` where it had not begun.
    pub moment: Option<Moment>,
    /// Whether the frame was run for another time then.
    pub again: bool,
    /// Why.
    pub cause: Cause,
}

impl fmt::Display for Stop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.moment {
            Some(moment) => moment.fmt(f)?,
            None => f.write_str("before frame 0")?,
        }
        let again = if self.again { ", run again" } else { "" };
        write!(f, "{again}: {}", self.cause)
    }
}

/// The words of a panic on one line.
fn said(panic: &(dyn Any + Send)) -> String {
    let words = panic.downcast_ref::<String>().map(String::as_str);
    let words = words.or_else(|| panic.downcast_ref::<&str>().copied());
    let lines = words.unwrap_or("without a word").lines().map(str::trim);
    lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// Does `work`; a panic in it comes back as its words, on one line. What `work` was changing is then in no
/// known state and must not be used again.
///
/// # Errors
/// The words of the panic.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| said(panic.as_ref()))
}

/// As [`caught`], for work of a lane.
pub(super) fn attempt<T>(work: impl FnOnce() -> Result<T, OracleError>) -> Result<T, Cause> {
    match caught(work) {
        Ok(done) => done.map_err(Cause::Oracle),
        Err(said) => Err(Cause::Panic(said)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_one_line() {
        let words = |work: fn()| caught(work).unwrap_err();
        assert_eq!(words(|| panic!("one")), "one");
        assert_eq!(words(|| panic!("{}\n  two\n\nthree", 1)), "1 two three");
        assert_eq!(words(|| std::panic::panic_any(7)), "without a word");
        assert_eq!(caught(|| 7), Ok(7));
        let stop = |moment, again| Stop { moment, again, cause: Cause::Panic("no".to_owned()) };
        let moment = Some(Moment { frame: 3, view: 1 });
        assert_eq!(stop(moment, true).to_string(), "frame 3 view 1, run again: no");
        assert_eq!(stop(None, false).to_string(), "before frame 0: no");
    }
}
