//! A culler behind a pipe: a started process that is told each frame on its standard input and answers on
//! its standard output. Both are moved by threads, so that a process that stops reading or answering is
//! noticed in time, named and killed.

use std::cell::Cell;
use std::io::{BufWriter, Read, Write};
use std::process::{Child, Command, Stdio};
use std::rc::Rc;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};

use super::CliError;
use super::args::quoted;
use super::signals::interrupted;
use crate::foreign::ForeignError;

/// Bytes that are read at once.
const PIECE: usize = 1 << 16;
/// While nothing comes, Ctrl-C is looked for so often.
const LOOKS_EVERY: Duration = Duration::from_millis(100);
/// A process that has closed its output ends within this time, or is not said to have ended.
const ENDS_WITHIN: Duration = Duration::from_secs(1);

/// A started culler; killed when dropped.
pub(super) struct Process {
    child: Child,
    lines: Option<Sender<String>>,
    state: Rc<State>,
    limit: Option<Duration>,
    command: String,
}

/// What is known of a process's answers.
#[derive(Default)]
struct State {
    /// When the answer that is waited for must be there.
    deadline: Cell<Option<Instant>>,
    /// Whether it was not.
    late: Cell<bool>,
    /// Whether the output has ended.
    ended: Cell<bool>,
}

/// The output of a process.
pub(super) struct Answers {
    pieces: Receiver<std::io::Result<Vec<u8>>>,
    rest: Vec<u8>,
    state: Rc<State>,
}

impl Process {
    /// Starts a command, that has `limit` for each answer; `None` for any time.
    pub(super) fn start(
        command: &str,
        limit: Option<Duration>,
    ) -> Result<(Self, Answers), CliError> {
        let started = Command::new("sh")
            .args(["-c", command])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn();
        let mut child = started.map_err(|error| {
            CliError::Usage(format!("--pipe {}: cannot be started: {error}", quoted(command)))
        })?;
        let mut input = BufWriter::new(child.stdin.take().expect("its input is piped"));
        let mut output = child.stdout.take().expect("its output is piped");
        let (lines, to_write) = channel::<String>();
        std::thread::spawn(move || {
            // A process that reads no more has ended or will be missed when it does not answer.
            for line in to_write {
                let wrote = input.write_all(line.as_bytes()).and_then(|()| input.write_all(b"\n"));
                if wrote.and_then(|()| input.flush()).is_err() {
                    return;
                }
            }
        });
        let (send, pieces) = channel();
        std::thread::spawn(move || {
            let mut piece = vec![0; PIECE];
            loop {
                let read = output.read(&mut piece).map(|count| piece[..count].to_vec());
                let last = read.as_ref().map_or(true, Vec::is_empty);
                if send.send(read).is_err() || last {
                    return;
                }
            }
        });
        let state = Rc::<State>::default();
        let answers = Answers { pieces, rest: Vec::new(), state: Rc::clone(&state) };
        let (lines, command) = (Some(lines), command.to_owned());
        let process = Self { child, lines, state, limit, command };
        process.waits();
        Ok((process, answers))
    }

    /// Has the time begin that the next answer may take.
    pub(super) fn waits(&self) {
        self.state.deadline.set(self.limit.and_then(|limit| Instant::now().checked_add(limit)));
    }

    /// Tells it a line.
    pub(super) fn tell(&self, line: String) {
        if let Some(lines) = &self.lines {
            // If it reads no more, that shows where an answer is missing.
            let _ = lines.send(line);
        }
    }

    /// Has it see that nothing more comes.
    pub(super) fn end(&mut self) {
        self.lines = None;
        self.waits();
    }

    /// Whether it did not answer in time.
    pub(super) fn is_late(&self) -> bool {
        self.state.late.get()
    }

    /// The error about an answer, or that it ended before, where it did.
    pub(super) fn explained(&mut self, error: ForeignError) -> CliError {
        if !self.state.ended.get() {
            return error.into();
        }
        self.lines = None;
        let closed = Instant::now();
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break status.to_string(),
                Err(error) => break error.to_string(),
                Ok(None) if closed.elapsed() > ENDS_WITHIN => break "its output ended".to_owned(),
                Ok(None) => std::thread::sleep(ENDS_WITHIN / 100),
            }
        };
        let (command, what) = (quoted(&self.command), error.what);
        CliError::Usage(format!(
            "--pipe {command}: stopped before the last frame ({status}): {what}"
        ))
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.lines = None;
        // After an error it may not have ended.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Answers {
    /// The next bytes; empty at the end.
    fn piece(&self) -> std::io::Result<Vec<u8>> {
        loop {
            match self.pieces.recv_timeout(LOOKS_EVERY) {
                Ok(piece) => return piece,
                Err(RecvTimeoutError::Disconnected) => return Ok(Vec::new()),
                Err(RecvTimeoutError::Timeout) => {}
            }
            if interrupted() {
                return Err(std::io::Error::other("interrupted"));
            }
            if self.state.deadline.get().is_some_and(|deadline| Instant::now() > deadline) {
                self.state.late.set(true);
                return Err(std::io::Error::from(std::io::ErrorKind::TimedOut));
            }
        }
    }
}

impl Read for Answers {
    fn read(&mut self, into: &mut [u8]) -> std::io::Result<usize> {
        if self.rest.is_empty() && !self.state.ended.get() {
            self.rest = self.piece()?;
            self.state.ended.set(self.rest.is_empty());
        }
        let count = self.rest.len().min(into.len());
        into[..count].copy_from_slice(&self.rest[..count]);
        self.rest.drain(..count);
        Ok(count)
    }
}
