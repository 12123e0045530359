//! Outputs: every file that a verb leaves is made here, and nothing is harmed by it.
//!
//! - A file appears whole or not at all: it is written beside its place under a hidden name and renamed.
//!   Lines that come one by one wait in a file without a name, so that no end of the process, not even by
//!   SIGKILL, leaves anything behind.
//! - Only regular files are replaced. Folders, pipes, sockets and devices are refused, and so are files that
//!   nobody may write, even where root could. Links are followed: what they lead to is replaced or
//!   made, and the link stays. The mode of a file stays, its owner where the system lets it.
//! - What a verb reads is no output of it, whatever name or link leads there, and no two outputs are
//!   the same file.
//! - `-` is standard output, and so are `/dev/stdout` and its like: whatever else would go there goes to
//!   standard error, so that the stream holds the output alone. `/dev/null` takes anything and stays.
//! - All this is looked at before the work begins, so that a place where nothing can be written is said
//!   early; and again when the file is written.

use std::fs::{self, File, Metadata};
use std::io::{BufWriter, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use tempfile::{Builder, NamedTempFile};

use super::CliError;
use super::args::quoted;
use super::files::Files;
use super::target::{Identity, Target, is_stream, standard_files};

/// Takes anything.
const NULL: &str = "/dev/null";

/// Names of files that are being written, to be removed where the process ends at once.
static PARTIALS: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes what is being written.
pub(super) fn remove_partials() {
    for path in PARTIALS.lock().unwrap_or_else(PoisonError::into_inner).iter() {
        // The process ends: there is nobody to tell.
        let _ = fs::remove_file(path);
    }
}

/// A name in [`PARTIALS`].
struct Partial(PathBuf);

impl Partial {
    fn new(path: &Path) -> Self {
        PARTIALS.lock().unwrap_or_else(PoisonError::into_inner).push(path.to_owned());
        Self(path.to_owned())
    }
}

impl Drop for Partial {
    fn drop(&mut self) {
        PARTIALS.lock().unwrap_or_else(PoisonError::into_inner).retain(|path| *path != self.0);
    }
}

/// The outputs of one invocation.
pub(super) struct Outputs<'a> {
    inputs: Vec<(String, Identity)>,
    taken: Vec<(String, Identity)>,
    /// Standard output, until an output is it.
    stream: Option<&'a mut dyn Write>,
    /// The command line, as a shell takes it.
    again: String,
}

impl<'a> Outputs<'a> {
    /// Of a verb that names these files. `stream` is standard output where an output is it, `again` the line
    /// that runs the verb.
    ///
    /// # Errors
    /// Where two things are to go to standard output.
    pub(super) fn new(
        files: &Files,
        stream: Option<&'a mut dyn Write>,
        again: String,
    ) -> Result<Self, CliError> {
        let streams: Vec<String> = files.streams().collect();
        let refuse = |what: String| Err(CliError::Usage(what));
        match streams.as_slice() {
            [first, .., last] => {
                return refuse(format!(
                    "{first} and {last} are both standard output; name a file for one of them"
                ));
            }
            [only] if files.json => {
                return refuse(format!(
                    "--json and {only} are both standard output; leave out --json, or name a file"
                ));
            }
            _ => {}
        }
        let [input, output, error] = standard_files();
        let identity = |there: Metadata| Identity::new(PathBuf::new(), Some(&there));
        let standard = |name: &str, there: Option<Metadata>| {
            there.map(|there| (format!("standard {name}"), identity(there)))
        };
        let inputs = files.inputs.iter().filter_map(|(label, path)| {
            let there = fs::metadata(path).ok()?;
            let path = fs::canonicalize(path).unwrap_or_else(|_| path.clone());
            Some((label.clone(), Identity::new(path, Some(&there))))
        });
        Ok(Self {
            inputs: inputs.chain(standard("input", input)).collect(),
            taken: [standard("output", output), standard("error", error)]
                .into_iter()
                .flatten()
                .collect(),
            stream,
            again,
        })
    }

    /// The line that runs the verb again.
    pub(super) fn again(&self) -> &str {
        &self.again
    }

    /// A file to be written, which `flag` named.
    ///
    /// # Errors
    /// One line, where it cannot be written, or must not be.
    pub(super) fn file(&mut self, flag: &str, path: &Path) -> Result<OutFile<'a>, CliError> {
        let label = format!("{flag} {}", quoted(&path.display().to_string()));
        let refuse = |what: String| CliError::Output(format!("{label}: {what}"));
        if is_stream(path) {
            let stream = self.stream.take();
            let stream = stream.ok_or_else(|| refuse("standard output is taken".to_owned()))?;
            return Ok(OutFile::Stream(stream));
        }
        if fs::canonicalize(path).is_ok_and(|path| path == Path::new(NULL))
            && fs::metadata(path).is_ok_and(|there| !there.is_file())
        {
            return Ok(OutFile::File(WholeFile { label, path: None, lines: None }));
        }
        let target = Target::of(path).map_err(refuse)?;
        let own = Identity::new(target.path.clone(), target.there.as_ref());
        if let Some((input, _)) = self.inputs.iter().find(|(_, input)| input.is(&own)) {
            return Err(refuse(format!("is what is read, {input}; choose another file")));
        }
        if let Some((taken, _)) = self.taken.iter().find(|(_, taken)| taken.is(&own)) {
            return Err(refuse(format!("is {taken} as well; choose another file")));
        }
        // Gone as soon as it is made; made where the file will be, it shows that there can be one.
        tempfile::tempfile_in(target.folder())
            .map_err(|error| refuse(format!("cannot write: {error}; choose another file")))?;
        self.taken.push((label.clone(), own));
        Ok(OutFile::File(WholeFile { label, path: Some(path.to_owned()), lines: None }))
    }

    /// A folder for files, made if it is not there, which `flag` named.
    ///
    /// # Errors
    /// One line, where there can be no such folder.
    pub(super) fn folder(&self, flag: &'static str, path: &Path) -> Result<OutFolder, CliError> {
        let label = format!("{flag} {}", quoted(&path.display().to_string()));
        let refuse = |what: String| CliError::Output(format!("{label}: {what}"));
        if path.as_os_str().is_empty() || is_stream(path) {
            return Err(refuse("several files are written; name a folder".to_owned()));
        }
        if fs::metadata(path).is_ok_and(|there| !there.is_dir()) {
            return Err(refuse("is no folder; choose another one".to_owned()));
        }
        let new = path
            .ancestors()
            .take_while(|path| !path.as_os_str().is_empty() && fs::symlink_metadata(path).is_err());
        let made: Vec<PathBuf> = new.map(Path::to_owned).collect();
        let folder = OutFolder { flag, path: path.to_owned(), made };
        fs::create_dir_all(path)
            .map_err(|error| refuse(format!("cannot be made: {error}; choose another folder")))?;
        tempfile::tempfile_in(path).map_err(|error| {
            refuse(format!("cannot write there: {error}; choose another folder"))
        })?;
        Ok(folder)
    }
}

/// A folder that a verb writes several files to. Those that were made for nothing are removed.
pub(super) struct OutFolder {
    flag: &'static str,
    path: PathBuf,
    /// The folders that were not there, the innermost first.
    made: Vec<PathBuf>,
}

impl OutFolder {
    /// Where it is.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// A file in it.
    ///
    /// # Errors
    /// As [`Outputs::file`].
    pub(super) fn file<'a>(
        &self,
        outputs: &mut Outputs<'a>,
        name: &str,
    ) -> Result<OutFile<'a>, CliError> {
        outputs.file(self.flag, &self.path.join(name))
    }
}

impl Drop for OutFolder {
    fn drop(&mut self) {
        for folder in &self.made {
            // Takes away nothing but an empty folder.
            let _ = fs::remove_dir(folder);
        }
    }
}

/// An output: a file, or standard output.
pub(super) enum OutFile<'a> {
    /// The caller's own stream.
    Stream(&'a mut dyn Write),
    /// A file that any thread may end.
    File(WholeFile),
}

/// A file that appears whole or not at all.
pub(super) struct WholeFile {
    /// The flag and the path.
    label: String,
    /// Where it will be; `None` for nowhere.
    path: Option<PathBuf>,
    /// Lines so far, in a file without a name.
    lines: Option<BufWriter<File>>,
}

impl OutFile<'_> {
    /// Adds a line to what [`OutFile::finish`] will leave; a stream has it at once.
    pub(super) fn line(&mut self, line: &str) -> Result<(), CliError> {
        match self {
            Self::Stream(stream) => {
                writeln!(stream, "{line}")?;
                Ok(stream.flush()?)
            }
            Self::File(file) => file.line(line),
        }
    }

    /// Writes the lines so far and `bytes`.
    pub(super) fn finish(self, bytes: &[u8]) -> Result<(), CliError> {
        match self {
            Self::Stream(stream) => {
                stream.write_all(bytes)?;
                Ok(stream.flush()?)
            }
            Self::File(file) => file.finish(bytes),
        }
    }
}

impl WholeFile {
    /// Adds a line to what [`WholeFile::finish`] will leave.
    pub(super) fn line(&mut self, line: &str) -> Result<(), CliError> {
        let Some(path) = &self.path else { return Ok(()) };
        let mut write = || {
            if self.lines.is_none() {
                let target = Target::of(path)?;
                let file = tempfile::tempfile_in(target.folder());
                self.lines = Some(BufWriter::new(file.map_err(|error| error.to_string())?));
            }
            let lines = self.lines.as_mut().expect("it was just made");
            writeln!(lines, "{line}").map_err(|error| error.to_string())
        };
        write().map_err(|what| unwritten(&self.label, &what))
    }

    /// Writes the lines so far and `bytes`.
    pub(super) fn finish(self, bytes: &[u8]) -> Result<(), CliError> {
        let Self { label, path, lines } = self;
        let Some(path) = path else { return Ok(()) };
        replace(&path, lines, bytes).map_err(|what| unwritten(&label, &what))
    }
}

fn unwritten(label: &str, what: &str) -> CliError {
    CliError::Output(format!("{label}: could not be written: {what}"))
}

/// Writes beside the target of `path` and renames.
fn replace(path: &Path, lines: Option<BufWriter<File>>, bytes: &[u8]) -> Result<(), String> {
    let target = Target::of(path)?;
    let said = |error: std::io::Error| error.to_string();
    let mut partial = partial_in(target.folder()).map_err(said)?;
    let listed = Partial::new(partial.path());
    if let Some(lines) = lines {
        let mut lines = lines.into_inner().map_err(|error| error.to_string())?;
        lines.rewind().map_err(said)?;
        std::io::copy(&mut lines, partial.as_file_mut()).map_err(said)?;
    }
    partial.write_all(bytes).map_err(said)?;
    if let Some(there) = &target.there {
        keep_owner(partial.as_file(), there);
        // After the owner, whose change takes bits away.
        partial.as_file().set_permissions(there.permissions()).map_err(said)?;
    }
    partial.as_file().sync_all().map_err(said)?;
    partial.persist(&target.path).map_err(|error| error.error.to_string())?;
    drop(listed);
    Ok(())
}

/// A new file of a hidden name, of the mode that new files have.
fn partial_in(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".plainsight-").suffix(".part");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        // What the umask leaves of it.
        builder.permissions(fs::Permissions::from_mode(0o666));
    }
    builder.tempfile_in(folder)
}

/// Gives the file the owner and group of the one that it replaces, where the system lets it.
fn keep_owner(file: &File, there: &Metadata) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::{MetadataExt, fchown};
        let own = |file: &Metadata| (file.uid(), file.gid());
        if file.metadata().is_ok_and(|new| own(&new) != own(there)) {
            // Only root may give files away; others replace them by their own, as editors do.
            let _ = fchown(file, Some(there.uid()), Some(there.gid()));
        }
    }
    #[cfg(not(unix))]
    let _ = (file, there);
}
