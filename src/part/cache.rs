//! A folder of cut meshes, one file each, named by the hash of what the cut is a function of (see
//! `pack`): the same mesh under the same knobs is cut once. It must not know scenes beyond a mesh, nor
//! who shows what it warns of.
//!
//! A file is written beside its place and renamed, so that it is there whole or not at all, also where
//! several processes share the folder. It is not flushed to the disk before the rename: what a crash
//! leaves behind has a wrong checksum, and is cut again.

use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use super::pack::{self, Key};
use super::{PartedMesh, PartitionKnobs, cut};
use crate::scene::Mesh;

/// Why a folder cannot hold cut meshes.
#[derive(Debug, thiserror::Error)]
#[error("{}: cannot write object trees there: {source}", folder.display())]
pub struct CacheError {
    folder: PathBuf,
    source: std::io::Error,
}

/// A folder of cut meshes.
#[derive(Clone, Debug)]
pub struct Cache {
    folder: PathBuf,
}

/// A cut mesh, and how it was come by.
pub(super) struct Got {
    pub(super) mesh: PartedMesh,
    pub(super) loaded: bool,
    pub(super) warning: Option<String>,
}

impl Cache {
    /// The folder, made if it is not there.
    ///
    /// # Errors
    /// [`CacheError`] where no file can be written in it.
    pub fn open(folder: &Path) -> Result<Self, CacheError> {
        let cache = Self { folder: folder.to_owned() };
        let probe = cache.partial("probe");
        std::fs::create_dir_all(folder)
            .and_then(|()| File::create(&probe))
            .and_then(|_| std::fs::remove_file(&probe))
            .map_err(|source| CacheError { folder: folder.to_owned(), source })?;
        Ok(cache)
    }

    /// The cut of `mesh`, without `drawable`: read where the folder has it whole, else cut and kept.
    /// Trouble with a file is a warning, since the cut is there all the same.
    pub(super) fn get(&self, mesh: &Mesh, knobs: PartitionKnobs) -> Got {
        let key = Key::of(mesh, knobs);
        let path = self.folder.join(format!("{}.tree", key.hex()));
        let damage = match read(&path, &key, mesh.triangles().len()) {
            Ok(Some(mesh)) => return Got { mesh, loaded: true, warning: None },
            Ok(None) => None,
            Err(what) => Some(what),
        };
        let mesh = cut::cut(mesh, knobs);
        let warning = match (damage, self.write(&path, &pack::encode(&mesh, &key))) {
            (damage, Ok(())) => damage.map(|what| format!("{what}; cut and written anew")),
            (_, Err(error)) => {
                Some(format!("{}: cannot keep the object tree: {error}", path.display()))
            }
        };
        Got { mesh, loaded: false, warning }
    }

    /// A name that no other thread or process writes to.
    fn partial(&self, name: &str) -> PathBuf {
        static WRITTEN: AtomicU64 = AtomicU64::new(0);
        let number = WRITTEN.fetch_add(1, Ordering::Relaxed);
        self.folder.join(format!("{name}.{}-{number}.part", std::process::id()))
    }

    fn write(&self, path: &Path, bytes: &[u8]) -> std::io::Result<()> {
        let partial = self.partial(&path.file_stem().unwrap_or_default().to_string_lossy());
        let written =
            std::fs::write(&partial, bytes).and_then(|()| std::fs::rename(&partial, path));
        if written.is_err() {
            // The first error is the one to tell.
            let _ = std::fs::remove_file(&partial);
        }
        written
    }
}

/// The cut mesh of a file; `None` where there is no file.
fn read(path: &Path, key: &Key, source_triangles: usize) -> Result<Option<PartedMesh>, String> {
    let named = |what: String| format!("{}: {what}", path.display());
    let unreadable = |error: std::io::Error| named(format!("cannot be read: {error}"));
    let mut file = match File::open(path) {
        Err(error) if error.kind() == ErrorKind::NotFound => return Ok(None),
        file => file.map_err(unreadable)?,
    };
    let length = file.metadata().map_err(unreadable)?.len();
    let mut bytes = Vec::new();
    // The header first: a large file of something else is not read.
    let header = file.by_ref().take(pack::HEADER_BYTES as u64).read_to_end(&mut bytes);
    header.map_err(unreadable)?;
    let expected = pack::file_bytes(&bytes, key).map_err(|damage| named(damage.to_string()))?;
    if expected != length {
        return Err(named(pack::Damage::Length.to_string()));
    }
    bytes.reserve_exact((length as usize).saturating_sub(bytes.len()));
    file.read_to_end(&mut bytes).map_err(unreadable)?;
    pack::decode(&bytes, key, source_triangles)
        .map(Some)
        .map_err(|damage| named(damage.to_string()))
}
