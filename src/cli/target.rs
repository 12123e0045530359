//! Where the path of an output leads, and whether there may be one.

use std::fs::{self, File, Metadata};
use std::path::{Path, PathBuf};

/// Links that lead from one to the next before they are taken for a circle, as in Linux.
const MOST_LINKS: usize = 40;
/// What standard output is called where an output file can be named.
const STREAM: &str = "-";
/// Its names as a file: replaced as such, what comes after would go to a file without a name.
const STREAM_NAMES: [&str; 3] = ["/dev/stdout", "/dev/fd/1", "/proc/self/fd/1"];
/// Folders of what is already open.
const OPEN_FILES: [&str; 4] = ["/dev/fd", "/dev/stdin", "/dev/stderr", "/proc/self/fd"];
/// Whether `path` stands for standard output.
pub(super) fn is_stream(path: &Path) -> bool {
    path == Path::new(STREAM) || STREAM_NAMES.iter().any(|name| path == Path::new(name))
}

/// Where a path leads.
pub(super) struct Target {
    /// The file that is replaced or made: absolute, no link.
    pub(super) path: PathBuf,
    /// Of the file that is there.
    pub(super) there: Option<Metadata>,
}

impl Target {
    /// Follows `path`.
    ///
    /// # Errors
    /// What is wrong with it and the remedy.
    pub(super) fn of(path: &Path) -> Result<Self, String> {
        let bytes = path.as_os_str().as_encoded_bytes();
        if bytes.is_empty() {
            return Err("names no file".to_owned());
        }
        if OPEN_FILES.iter().any(|folder| path.starts_with(folder)) {
            return Err(
                "names an open file; name the file itself, or - for standard output".to_owned()
            );
        }
        let cannot = |error: std::io::Error| format!("cannot write: {error}; choose another file");
        match fs::metadata(path) {
            Ok(there) if there.is_file() => {
                if there.permissions().readonly() {
                    return Err("is read-only; choose another file, or make it writable".to_owned());
                }
                #[cfg(unix)]
                rustix::fs::access(path, rustix::fs::Access::WRITE_OK)
                    .map_err(|error| cannot(error.into()))?;
                Ok(Self { path: fs::canonicalize(path).map_err(cannot)?, there: Some(there) })
            }
            Ok(other) => Err(format!(
                "is {}; name a regular file or a new one, or - for standard output",
                kind(&other)
            )),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                let mut path = path.to_owned();
                for _ in 0..MOST_LINKS {
                    let Ok(to) = fs::read_link(&path) else { break };
                    path = path.parent().unwrap_or(Path::new("")).join(to);
                }
                let ends_in_slash = path.as_os_str().as_encoded_bytes().ends_with(b"/");
                let name = path.file_name().filter(|_| !ends_in_slash);
                let name = name.ok_or("names a folder that is not there; name a file")?;
                let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
                let folder = fs::canonicalize(folder.unwrap_or(Path::new("."))).map_err(cannot)?;
                Ok(Self { path: folder.join(name), there: None })
            }
            Err(error) => Err(cannot(error)),
        }
    }

    pub(super) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new("/"))
    }
}

/// Says of what is no regular file what it is.
fn kind(there: &Metadata) -> &'static str {
    #[cfg(unix)]
    {
        use std::os::unix::fs::FileTypeExt;
        let kind = there.file_type();
        if kind.is_fifo() {
            return "a pipe";
        }
        if kind.is_socket() {
            return "a socket";
        }
        if kind.is_char_device() || kind.is_block_device() {
            return "a device";
        }
    }
    if there.is_dir() { "a folder" } else { "no regular file" }
}

/// A file by which names and links lead to it.
pub(super) struct Identity {
    path: PathBuf,
    node: Option<(u64, u64)>,
}

impl Identity {
    pub(super) fn new(path: PathBuf, there: Option<&Metadata>) -> Self {
        Self { path, node: there.and_then(node) }
    }

    pub(super) fn is(&self, other: &Self) -> bool {
        self.path == other.path || (self.node.is_some() && self.node == other.node)
    }
}

/// Device and number of a file, which all its hard links share.
fn node(there: &Metadata) -> Option<(u64, u64)> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::MetadataExt;
        there.is_file().then(|| (there.dev(), there.ino()))
    }
    #[cfg(not(unix))]
    {
        let _ = there;
        None
    }
}

/// What the process was given as standard input, output and error, as far as these are regular files.
#[cfg(unix)]
pub(super) fn standard_files() -> [Option<Metadata>; 3] {
    use std::os::fd::AsFd;
    let of = |stream: std::os::fd::BorrowedFd<'_>| {
        let file = File::from(stream.try_clone_to_owned().ok()?);
        file.metadata().ok().filter(Metadata::is_file)
    };
    [of(std::io::stdin().as_fd()), of(std::io::stdout().as_fd()), of(std::io::stderr().as_fd())]
}

#[cfg(not(unix))]
pub(super) fn standard_files() -> [Option<Metadata>; 3] {
    [None, None, None]
}
