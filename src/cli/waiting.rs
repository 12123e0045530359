//! Reading from where nothing may come for long: a signal ends the wait.

use std::io::{Error, Read};
use std::sync::mpsc::{Receiver, RecvTimeoutError, sync_channel};
use std::time::Duration;

use super::signals::interrupted;

/// How long a signal may go unnoticed.
const PATIENCE: Duration = Duration::from_millis(50);
/// Bytes that are read at once, and how often ahead of who reads here.
const CHUNK: usize = 1 << 16;
const CHUNKS_AHEAD: usize = 4;

/// A stream that another thread reads from.
pub(super) struct Waiting {
    chunks: Receiver<std::io::Result<Vec<u8>>>,
    chunk: Vec<u8>,
    /// How much of it was read.
    read: usize,
}

impl Waiting {
    /// Reads from `stream`. After a signal the thread is left where it waits.
    pub(super) fn new(mut stream: impl Read + Send + 'static) -> Self {
        let (send, chunks) = sync_channel(CHUNKS_AHEAD);
        std::thread::spawn(move || {
            loop {
                let mut chunk = vec![0; CHUNK];
                let read = stream.read(&mut chunk).map(|length| {
                    chunk.truncate(length);
                    chunk
                });
                let end = read.as_ref().map_or(true, Vec::is_empty);
                // Nobody listens any more, or nothing more comes.
                if send.send(read).is_err() || end {
                    return;
                }
            }
        });
        Self { chunks, chunk: Vec::new(), read: 0 }
    }
}

impl Read for Waiting {
    fn read(&mut self, to: &mut [u8]) -> std::io::Result<usize> {
        while self.read == self.chunk.len() {
            if interrupted() {
                // Not `ErrorKind::Interrupted`, after which readers try again.
                return Err(Error::other("interrupted"));
            }
            match self.chunks.recv_timeout(PATIENCE) {
                Ok(chunk) => (self.chunk, self.read) = (chunk?, 0),
                Err(RecvTimeoutError::Timeout) => continue,
                Err(RecvTimeoutError::Disconnected) => return Ok(0),
            }
            if self.chunk.is_empty() {
                return Ok(0);
            }
        }
        let length = to.len().min(self.chunk.len() - self.read);
        to[..length].copy_from_slice(&self.chunk[self.read..self.read + length]);
        self.read += length;
        Ok(length)
    }
}
