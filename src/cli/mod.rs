//! Verbs: the command line as a function of its arguments, the cullers there are and two streams, so
//! that tests can drive it with cullers of their own. Results go to `out`, progress and talk to
//! `talk`.

mod accuracy;
mod args;
mod blocks;
mod calibrate;
mod compare;
mod export;
mod faults;
mod files;
mod judge;
mod list;
mod merge;
mod oracles;
mod out_file;
mod picture;
mod pipe;
mod plan;
mod progress;
mod quiet;
mod repeat;
mod replay;
mod report;
mod run;
mod signals;
mod stress;
mod target;
mod tell;
mod thesis;
mod waiting;
mod watchdog;
mod why;

use std::cell::RefCell;
use std::ffi::OsString;
use std::io::Write;

use clap::Parser;

use args::{Cli, Verb, quoted};
use files::Files;
use out_file::{OutFile, Outputs};

use crate::cull::CullerKind;
use crate::oracle::OracleError;
use crate::part::CacheError;
use crate::run::{RunError, caught};
use crate::scene::SceneError;

/// Everything held.
pub const EXIT_HELD: u8 = 0;
/// A check failed, or something panicked.
pub const EXIT_FAILED: u8 = 1;
/// Bad usage or input.
pub const EXIT_USAGE: u8 = 2;
/// A device was lost, did not repeat, or was missing where one was required.
pub const EXIT_DEVICE: u8 = 3;
/// Stopped by the user, as shells count it: 128 + SIGINT. By SIGTERM it is 143, by SIGHUP 129.
pub const EXIT_INTERRUPTED: u8 = 130;
/// Whoever read the results went away, as shells count it: 128 + SIGPIPE. Nobody was told how it ended.
pub const EXIT_READER_GONE: u8 = 141;

/// Where results and talk go.
pub struct Streams<'a> {
    /// Results: tables, JSON lines.
    pub out: &'a mut dyn Write,
    /// Progress, warnings, failures' details.
    pub talk: &'a mut dyn Write,
    /// Columns of the terminal that `out` is; `None` where it is none, and nothing is broken to fit.
    pub width: Option<usize>,
}

/// Why a verb gave up.
#[derive(Debug, thiserror::Error)]
enum CliError {
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error("{0}")]
    Usage(String),
    /// An output that cannot be written, or must not be.
    #[error("{0}")]
    Output(String),
    #[error("{0}; choose another --cache")]
    Cache(#[from] CacheError),
    #[error("panic: {place}: {said}")]
    Panicked { place: String, said: String },
    #[error("writing the results: {0}")]
    Stream(#[from] std::io::Error),
}

impl From<OracleError> for CliError {
    fn from(error: OracleError) -> Self {
        Self::Run(error.into())
    }
}

impl CliError {
    /// Whether what the user gave was wrong: such a run leaves nothing behind.
    fn is_bad_input(&self) -> bool {
        matches!(self, Self::Usage(_) | Self::Scene(_))
    }

    fn exit(&self) -> u8 {
        match self {
            Self::Run(RunError::Interrupted) => signals::exit_interrupted(),
            Self::Run(RunError::Oracle(_)) => EXIT_DEVICE,
            Self::Panicked { .. } => EXIT_FAILED,
            // A reader that has had enough (`| head`) is no error of ours, and no pass either.
            Self::Stream(error) if error.kind() == std::io::ErrorKind::BrokenPipe => {
                EXIT_READER_GONE
            }
            _ => EXIT_USAGE,
        }
    }
}

/// Standard error for two: what would go to standard output, were that not taken, and talk.
struct Shared<'a, 'b>(&'a RefCell<&'b mut dyn Write>);

impl Write for Shared<'_, '_> {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.borrow_mut().write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        self.0.borrow_mut().flush()
    }
}

/// Runs the command line and returns the exit code. `cullers` are those that `--culler` may name; the
/// first three are run by default.
pub fn main(
    args: impl IntoIterator<Item = OsString>,
    cullers: &[CullerKind],
    mut streams: Streams<'_>,
) -> u8 {
    let args: Vec<OsString> = args.into_iter().collect();
    let cli = match Cli::try_parse_from(&args) {
        Ok(cli) => cli,
        Err(error) => {
            let wanted = !error.use_stderr();
            let stream = if wanted { &mut streams.out } else { &mut streams.talk };
            // Nothing can be done where even the help cannot be written.
            let _ = write!(stream, "{error}");
            return if wanted { EXIT_HELD } else { EXIT_USAGE };
        }
    };
    let verb = cli.verb.unwrap_or_default();
    let files = files(&verb);
    // A panic that no lane answers for, of a culler or not, is a failure all the same.
    let guarded = |outputs: &mut Outputs<'_>, streams: &mut Streams<'_>| {
        let again = outputs.again().to_owned();
        caught(|| run_verb(verb, cullers, outputs, streams)).unwrap_or_else(|said| {
            Err(CliError::Panicked { place: format!("replay: {again}"), said })
        })
    };
    let words = args.iter().skip(1).map(|word| quoted(&word.to_string_lossy()));
    let again = std::iter::once("plainsight".to_owned()).chain(words).collect::<Vec<_>>().join(" ");
    let Streams { out, talk, width } = streams;
    let done = if files.streams().next().is_some() {
        let talk: RefCell<&mut dyn Write> = RefCell::new(&mut *talk);
        let (mut tables, mut words) = (Shared(&talk), Shared(&talk));
        let mut streams = Streams { out: &mut tables, talk: &mut words, width: None };
        Outputs::new(&files, Some(out), again)
            .and_then(|mut outputs| guarded(&mut outputs, &mut streams))
    } else {
        let mut streams = Streams { out: &mut *out, talk: &mut *talk, width };
        Outputs::new(&files, None, again).and_then(|mut outputs| {
            let code = guarded(&mut outputs, &mut streams)?;
            streams.out.flush()?;
            Ok(code)
        })
    };
    done.unwrap_or_else(|error| {
        if error.exit() != EXIT_READER_GONE {
            let _ = writeln!(talk, "plainsight: {error}");
        }
        error.exit()
    })
}

/// The files that a verb's arguments name.
fn files(verb: &Verb) -> Files {
    match verb {
        Verb::Run(args) => args.files(),
        Verb::Picture(args) => args.files(),
        Verb::Compare(args) => args.files(),
        Verb::Calibrate(args) => args.files(),
        Verb::Export(args) => args.files(),
        Verb::Judge(args) => args.files(),
        Verb::Why(args) => args.files(),
        Verb::Faults(args) => args.files(),
        Verb::Stress(args) => args.files(),
        Verb::Accuracy(args) => args.files(),
        Verb::Report(args) => args.files(),
        Verb::Replay(_) | Verb::Tune(_) | Verb::List => Files::default(),
    }
}

fn run_verb(
    verb: Verb,
    cullers: &[CullerKind],
    outputs: &mut Outputs<'_>,
    streams: &mut Streams<'_>,
) -> Result<u8, CliError> {
    match verb {
        Verb::Run(args) => run::run(&args, cullers, outputs, streams),
        Verb::Replay(args) => replay::replay(&args, cullers, streams),
        Verb::Picture(args) => picture::picture(&args, cullers, outputs, streams),
        Verb::Compare(args) if args.thesis => thesis::compare(&args, outputs, streams),
        Verb::Compare(args) => compare::compare(&args, cullers, outputs, streams),
        Verb::Calibrate(args) => calibrate::calibrate(&args, outputs, streams),
        Verb::Export(args) => export::export(&args, outputs, streams),
        Verb::Judge(args) => judge::judge(&args, outputs, streams),
        Verb::Why(args) => why::why(&args, cullers, outputs, streams),
        Verb::Faults(args) => faults::faults(&args, outputs, streams),
        Verb::Stress(args) => stress::stress(&args, cullers, outputs, streams),
        Verb::Accuracy(args) => accuracy::accuracy(&args, outputs, streams),
        Verb::Report(args) => report::report(&args, cullers, outputs, streams),
        Verb::Tune(args) => thesis::tune_verb(&args, streams),
        Verb::List => list::list(cullers, streams),
    }
}
