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
mod judge;
mod list;
mod picture;
mod progress;
mod replay;
mod report;
mod run;
mod stress;
mod thesis;
mod why;

use std::ffi::OsString;
use std::io::Write;
use std::path::Path;

use clap::Parser;

use crate::cull::CullerKind;
use crate::oracle::OracleError;
use crate::part::CacheError;
use crate::run::RunError;
use crate::scene::SceneError;

/// Everything held.
pub const EXIT_HELD: u8 = 0;
/// A check failed.
pub const EXIT_FAILED: u8 = 1;
/// Bad usage or input.
pub const EXIT_USAGE: u8 = 2;
/// A device was lost, or missing where one was required.
pub const EXIT_DEVICE: u8 = 3;
/// Stopped by the user, as shells count it: 128 + SIGINT.
pub const EXIT_INTERRUPTED: u8 = 130;

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
    #[error("{0}; choose another --cache")]
    Cache(#[from] CacheError),
    #[error("{path}: cannot write: {source}; choose another --out")]
    Write { path: String, source: std::io::Error },
    #[error("writing the results: {0}")]
    Stream(#[from] std::io::Error),
}

impl From<OracleError> for CliError {
    fn from(error: OracleError) -> Self {
        Self::Run(error.into())
    }
}

impl CliError {
    fn exit(&self) -> u8 {
        match self {
            Self::Run(RunError::Interrupted) => EXIT_INTERRUPTED,
            Self::Run(RunError::Oracle(_)) => EXIT_DEVICE,
            // A reader that has had enough (`| head`) is no error of ours.
            Self::Stream(error) if error.kind() == std::io::ErrorKind::BrokenPipe => EXIT_HELD,
            _ => EXIT_USAGE,
        }
    }
}

/// Runs the command line and returns the exit code. `cullers` are those that `--culler` may name; the
/// first three are run by default.
pub fn main(
    args: impl IntoIterator<Item = OsString>,
    cullers: &[CullerKind],
    mut streams: Streams<'_>,
) -> u8 {
    let cli = match args::Cli::try_parse_from(args) {
        Ok(cli) => cli,
        Err(error) => {
            let wanted = !error.use_stderr();
            let stream = if wanted { &mut streams.out } else { &mut streams.talk };
            // Nothing can be done where even the help cannot be written.
            let _ = write!(stream, "{error}");
            return if wanted { EXIT_HELD } else { EXIT_USAGE };
        }
    };
    let done = match cli.verb.unwrap_or_default() {
        args::Verb::Run(args) => run::run(&args, cullers, &mut streams),
        args::Verb::Replay(args) => replay::replay(&args, cullers, &mut streams),
        args::Verb::Picture(args) => picture::picture(&args, cullers, &mut streams),
        args::Verb::Compare(args) if args.thesis => thesis::compare(&args, &mut streams),
        args::Verb::Compare(args) => compare::compare(&args, cullers, &mut streams),
        args::Verb::Calibrate(args) => calibrate::calibrate(&args, &mut streams),
        args::Verb::Export(args) => export::export(&args, &mut streams),
        args::Verb::Judge(args) => judge::judge(&args, &mut streams),
        args::Verb::Why(args) => why::why(&args, cullers, &mut streams),
        args::Verb::Faults(args) => faults::faults(&args, &mut streams),
        args::Verb::Stress(args) => stress::stress(&args, cullers, &mut streams),
        args::Verb::Accuracy(args) => accuracy::accuracy(&args, &mut streams),
        args::Verb::Report(args) => report::report(&args, cullers, &mut streams),
        args::Verb::Tune(args) => thesis::tune_verb(&args, &mut streams),
        args::Verb::List => list::list(cullers, &mut streams),
    };
    done.unwrap_or_else(|error| {
        if !matches!(&error, CliError::Stream(e) if e.kind() == std::io::ErrorKind::BrokenPipe) {
            let _ = writeln!(streams.talk, "plainsight: {error}");
        }
        error.exit()
    })
}

/// A file that appears whole or not at all: written beside its place under another name, renamed when
/// done. Made before the work begins, so that an unwritable place is known at once.
struct OutFile {
    path: std::path::PathBuf,
    partial: std::path::PathBuf,
    file: Option<std::fs::File>,
}

impl OutFile {
    fn create(path: &Path) -> Result<Self, CliError> {
        let write = |source| CliError::Write { path: path.display().to_string(), source };
        if path.is_dir() {
            return Err(write(std::io::Error::other("it is a folder")));
        }
        let mut name = path.file_name().unwrap_or_default().to_owned();
        name.push(format!(".{}.part", std::process::id()));
        let partial = path.with_file_name(name);
        let file = std::fs::File::create(&partial).map_err(write)?;
        Ok(Self { path: path.to_owned(), partial, file: Some(file) })
    }

    /// Adds a line to what [`OutFile::finish`] will leave.
    fn line(&mut self, line: &str) -> Result<(), CliError> {
        let file = self.file.as_mut().expect("a file is finished once");
        writeln!(file, "{line}")
            .map_err(|source| CliError::Write { path: self.path.display().to_string(), source })
    }

    fn finish(mut self, bytes: &[u8]) -> Result<(), CliError> {
        let mut file = self.file.take().expect("a file is finished once");
        let done = file.write_all(bytes).and_then(|()| file.sync_all());
        drop(file);
        done.and_then(|()| std::fs::rename(&self.partial, &self.path))
            .map_err(|source| CliError::Write { path: self.path.display().to_string(), source })
    }
}

impl Drop for OutFile {
    fn drop(&mut self) {
        // After a finished rename there is nothing left to remove.
        let _ = std::fs::remove_file(&self.partial);
    }
}
