//! Files written whole or not at all.
//!
//! The content goes to a file in a temporary folder beside the target, is flushed to the disk, and takes the target's
//! name by `rename`, which POSIX makes atomic. The folder makes an interruption final: once it is removed, a writer
//! that still runs cannot create the file again.

use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::hash::{BuildHasher, DefaultHasher, Hash, Hasher, RandomState};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Temporary folders of the writes in progress in this process.
static ACTIVE_FOLDERS: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Writes a file whole or not at all.
///
/// `write` receives the path of an empty file, in a temporary folder beside `target`. If it returns `Ok`, that file is
/// flushed to the disk and takes the name of `target` in one step. If it fails or panics, the file is removed and
/// `target` keeps its content. A link is followed: its target is replaced. A `target` that exists and is not a regular
/// file (a folder, a device, a pipe) is refused, because a rename would replace it.
///
/// A second write of the same target at the same time is refused.
pub fn atomic_write<T, E: From<io::Error>>(target: &Path, write: impl FnOnce(&Path) -> Result<T, E>) -> Result<T, E> {
    let target = replaceable(target)?;
    let folder = folder_of(&target);
    let temporary = Temporary::create(folder.join(folder_name(hash(&target))))?;
    let written = write(&temporary.path)?;
    // Windows flushes only files that are open for writing.
    OpenOptions::new().write(true).open(&temporary.path)?.sync_all()?;
    fs::rename(&temporary.path, &target)?;
    // Without this, a power failure may lose the new name.
    #[cfg(unix)]
    File::open(folder)?.sync_all()?;
    Ok(written)
}

/// The bytes of a file that `write` writes, for writers that need a path. The file is temporary, in a folder that only
/// this user can open.
pub(crate) fn temporary_bytes<E: From<io::Error>>(write: impl FnOnce(&Path) -> Result<(), E>) -> Result<Vec<u8>, E> {
    let random = RandomState::new().build_hasher().finish();
    let temporary = Temporary::create(std::env::temp_dir().join(folder_name(random)))?;
    write(&temporary.path)?;
    Ok(fs::read(&temporary.path)?)
}

/// Removes the temporary files of all unfinished [`atomic_write`]s of this process, for a handler of Ctrl-C. They
/// cannot go on, because their folders are gone. New ones cannot begin while the returned lock is held: hold it until
/// the process ends.
pub fn remove_temporaries() -> WriteLock {
    let active_folders = active_folders();
    for folder in active_folders.iter() {
        // A writer may create a file meanwhile, but not for ever: each attempt removes what is there.
        for _ in 0..1000 {
            let left = fs::remove_dir_all(folder);
            if left.is_ok() || left.is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
                break;
            }
        }
    }
    WriteLock { _active_folders: active_folders }
}

/// Blocks new [`atomic_write`]s of this process.
#[must_use = "writes can begin again as soon as this is dropped"]
pub struct WriteLock {
    _active_folders: MutexGuard<'static, BTreeSet<PathBuf>>,
}

fn active_folders() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    ACTIVE_FOLDERS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The path to rename to, with links followed.
fn replaceable(target: &Path) -> io::Result<PathBuf> {
    match fs::metadata(target) {
        Ok(metadata) if metadata.is_file() => fs::canonicalize(target),
        Ok(_) => Err(io::Error::new(io::ErrorKind::InvalidInput, "exists and is not a regular file")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(target.to_owned()),
        Err(error) => Err(error),
    }
}

fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Name of a temporary folder; short, however long the target's name is.
fn folder_name(id: u64) -> String {
    format!(".sdftool-{}-{id:016x}.tmp", std::process::id())
}

fn hash(target: &Path) -> u64 {
    let mut hasher = DefaultHasher::new();
    target.hash(&mut hasher);
    hasher.finish()
}

/// An empty file in a folder of its own, both removed on drop.
struct Temporary {
    folder: PathBuf,
    path: PathBuf,
}

impl Temporary {
    fn create(folder: PathBuf) -> io::Result<Self> {
        let mut active_folders = active_folders();
        if !active_folders.insert(folder.clone()) {
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, "is being written already"));
        }
        // Left by a killed process with the same id.
        let _ = fs::remove_dir_all(&folder);
        // Fails if someone else put a link there.
        if let Err(error) = create_private_folder(&folder) {
            active_folders.remove(&folder);
            return Err(error);
        }
        drop(active_folders);
        let temporary = Self { path: folder.join("file"), folder };
        File::create_new(&temporary.path)?;
        Ok(temporary)
    }
}

#[cfg(unix)]
fn create_private_folder(path: &Path) -> io::Result<()> {
    use std::os::unix::fs::DirBuilderExt;
    fs::DirBuilder::new().mode(0o700).create(path)
}

#[cfg(not(unix))]
fn create_private_folder(path: &Path) -> io::Result<()> {
    fs::create_dir(path)
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
        active_folders().remove(&self.folder);
    }
}
