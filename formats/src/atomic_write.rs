//! Files written whole or not at all.
//!
//! The content goes to a file in a temporary folder beside the target, is flushed to the disk, and takes the target's
//! name by `rename`, which POSIX makes atomic. The folder makes an interruption final: once it is removed, a writer
//! that still runs cannot create the file again.
//!
//! A process that is killed leaves its folder behind. The next write of the same target removes it. Whether its process
//! is gone is told by a lock on a file in the folder, which the system releases with the process. A process id would not
//! tell: it may be in use again, or belong to another machine or container. Where a disk has no locks, or a lock is held,
//! the folder stays.

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::hash::{BuildHasher, DefaultHasher, Hash, Hasher, RandomState};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Temporary folders of the writes in progress in this process, by folder and [`id`] of the target.
static ACTIVE_FOLDERS: Mutex<ActiveFolders> = Mutex::new(BTreeMap::new());

type ActiveFolders = BTreeMap<(PathBuf, u64), PathBuf>;

/// Writes a file whole or not at all.
///
/// `write` receives the path of an empty file, in a temporary folder beside `target`. If it returns `Ok`, that file is
/// flushed to the disk and takes the name of `target` in one step. If it fails or panics, the file is removed and
/// `target` keeps its content. A link is followed: its target is replaced, or made if it is not there. A `target` that
/// exists and is not a regular file (a folder, a device, a pipe) is refused, because a rename would replace it; so is one
/// that is read-only. What is replaced hands on its permissions.
///
/// A second write of the same target by this process at the same time is refused. Other processes write it too, each into a folder of
/// its own: the file is that of the last one to end, whole. What killed processes left of writes of this target is
/// removed.
pub fn atomic_write<T, E: From<io::Error>>(target: &Path, write: impl FnOnce(&Path) -> Result<T, E>) -> Result<T, E> {
    let (temporary, target, written) = prepare(target, write)?;
    temporary.rename(&target)?;
    end(temporary, &target)?;
    Ok(written)
}

/// Writes and flushes the temporary file of a target, and follows the target's links.
fn prepare<T, E: From<io::Error>>(
    target: &Path,
    write: impl FnOnce(&Path) -> Result<T, E>,
) -> Result<(Temporary, PathBuf, T), E> {
    let target = replaceable(target)?;
    let (folder, id) = (folder_of(&target), id(&target));
    remove_leftovers(folder, id);
    let temporary = Temporary::create(folder, id)?;
    let written = write(&temporary.path)?;
    // Windows flushes only files that are open for writing.
    OpenOptions::new().write(true).open(&temporary.path)?.sync_all()?;
    Ok((temporary, target, written))
}

/// Removes the temporary folder, and flushes the target's new name.
fn end(temporary: Temporary, target: &Path) -> io::Result<()> {
    // Before the flush, which takes long: a process killed in it leaves no folder.
    drop(temporary);
    // Without this, a power failure may lose the new name.
    #[cfg(unix)]
    File::open(folder_of(target))?.sync_all()?;
    #[cfg(not(unix))]
    let _ = target;
    Ok(())
}

/// Writes two files that belong together: both, or neither if a disk is full, one of them cannot be written, or Ctrl-C ends the process. Only
/// a process that is killed between the two renames, which follow each other at once, leaves one of them. The error comes with the
/// index of its file.
pub fn atomic_write_both(files: [(&Path, &[u8]); 2]) -> Result<(), (usize, io::Error)> {
    let write = |bytes| move |temporary: &Path| fs::write(temporary, bytes);
    let prepared = files.into_iter().map(|(target, bytes)| prepare(target, write(bytes)));
    let numbered = prepared.enumerate().map(|(index, prepared)| prepared.map_err(|error: io::Error| (index, error)));
    let prepared = numbered.collect::<Result<Vec<_>, _>>()?;
    {
        // A handler of Ctrl-C waits until both have their names, or has removed both.
        let _active_folders = active_folders();
        for (index, (temporary, target, ())) in prepared.iter().enumerate() {
            temporary.rename(target).map_err(|error| (index, error))?;
        }
    }
    for (index, (temporary, target, ())) in prepared.into_iter().enumerate() {
        end(temporary, &target).map_err(|error| (index, error))?;
    }
    Ok(())
}

/// Writer of many files of one folder, each whole or not at all if the program is killed, as [`atomic_write`] does, but not flushed to
/// the disk one by one: after a power failure the last ones may be empty, cut short or missing, also where they replaced another. One
/// temporary folder serves all of them.
pub struct FolderWriter {
    folder: PathBuf,
    temporary: Temporary,
}

impl FolderWriter {
    /// A writer of files of a folder that is there.
    pub fn new(folder: &Path) -> io::Result<Self> {
        let (folder, id) = (fs::canonicalize(folder)?, id(Path::new("all files")));
        remove_leftovers(&folder, id);
        Ok(Self { temporary: Temporary::create(&folder, id)?, folder })
    }

    /// Writes a file, or replaces it. What leads elsewhere by a link goes through [`atomic_write`].
    pub fn write(&self, name: &str, bytes: &[u8]) -> io::Result<()> {
        let target = replaceable(&self.folder.join(name))?;
        if folder_of(&target) != self.folder {
            return atomic_write(&target, |temporary| fs::write(temporary, bytes));
        }
        fs::write(&self.temporary.path, bytes)?;
        self.temporary.rename(&target)
    }
}

/// Creates the temporary folder of a write of `target` and removes it. Call it before long work: an error shows at once that the target
/// cannot be written.
pub fn try_to_write(target: &Path) -> io::Result<()> {
    let target = replaceable(target)?;
    Temporary::create(folder_of(&target), id(&target)).map(drop)
}

/// Removes what killed processes left of writes of a target, as the next [`atomic_write`] of it would. For those who find
/// the target there and do not write it again: its writer may have been killed after it had renamed the file.
pub fn clear_leftovers(target: &Path) {
    if let Ok(target) = replaceable(target) {
        remove_leftovers(folder_of(&target), id(&target));
    }
}

/// Removes the temporary files of all unfinished [`atomic_write`]s of this process, for a handler of Ctrl-C. They
/// cannot go on, because their folders are gone. New ones cannot begin while the returned lock is held: hold it until
/// the process ends.
pub fn remove_temporaries() -> WriteLock {
    let active_folders = active_folders();
    for folder in active_folders.values() {
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
    _active_folders: MutexGuard<'static, ActiveFolders>,
}

fn active_folders() -> MutexGuard<'static, ActiveFolders> {
    ACTIVE_FOLDERS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The path to rename to, with links followed.
fn replaceable(target: &Path) -> io::Result<PathBuf> {
    match fs::metadata(target) {
        Ok(metadata) if metadata.is_file() && is_read_only(target, &metadata) => {
            let what = "is read-only: make it writable, or write elsewhere";
            Err(io::Error::new(io::ErrorKind::PermissionDenied, what))
        }
        Ok(metadata) if metadata.is_file() => fs::canonicalize(target),
        Ok(_) => Err(io::Error::new(io::ErrorKind::InvalidInput, "exists and is not a regular file")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(end_of_links(target)),
        Err(error) => Err(error),
    }
}

/// The file that is not there yet, of a link that may lead to another. Links in a circle are not "not found".
fn end_of_links(path: &Path) -> PathBuf {
    let mut path = path.to_owned();
    while let Ok(next) = fs::read_link(&path) {
        // An absolute path replaces the folder.
        path = folder_of(&path).join(next);
    }
    path
}

/// A superuser may open a file for writing though nobody has that permission.
fn is_read_only(target: &Path, metadata: &fs::Metadata) -> bool {
    let opened = || OpenOptions::new().write(true).open(target);
    metadata.permissions().readonly() || opened().is_err_and(|error| error.kind() == io::ErrorKind::PermissionDenied)
}

fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Name of a new temporary folder; short, however long the target's name is. Random: processes of two containers may have one id.
fn folder_name(id: u64) -> String {
    format!("{PREFIX}{:016x}{}", RandomState::new().build_hasher().finish(), suffix(id))
}

const PREFIX: &str = ".sdftool-";

fn suffix(id: u64) -> String {
    format!("-{id:016x}.tmp")
}

/// Tells targets in one folder apart.
fn id(target: &Path) -> u64 {
    let mut hasher = DefaultHasher::new();
    target.file_name().hash(&mut hasher);
    hasher.finish()
}

/// File in a temporary folder that its process holds locked.
const LOCK: &str = "lock";

/// Removes the temporary folders of a target whose process is gone. Errors are no reason not to write.
fn remove_leftovers(folder: &Path, id: u64) {
    let suffix = suffix(id);
    let is_temporary = |name: &OsStr| name.to_str().is_some_and(|n| n.starts_with(PREFIX) && n.ends_with(&suffix));
    for entry in fs::read_dir(folder).into_iter().flatten().flatten().filter(|entry| is_temporary(&entry.file_name())) {
        match File::open(entry.path().join(LOCK)) {
            Ok(lock) if lock.try_lock().is_ok() => drop(fs::remove_dir_all(entry.path())),
            // Killed before it had a lock, or after it had removed it. Only an empty folder goes.
            Err(error) if error.kind() == io::ErrorKind::NotFound => drop(fs::remove_dir(entry.path())),
            _ => {}
        }
    }
}

/// An empty file in a folder of its own, both removed on drop.
struct Temporary {
    /// See [`ACTIVE_FOLDERS`].
    target: (PathBuf, u64),
    folder: PathBuf,
    path: PathBuf,
    /// Held until the folder is removed.
    _lock: File,
}

impl Temporary {
    fn create(folder: &Path, id: u64) -> io::Result<Self> {
        let target = (folder.to_owned(), id);
        let mut active_folders = active_folders();
        if active_folders.contains_key(&target) {
            return Err(busy());
        }
        let (folder, lock) = create_locked(folder, id)?;
        active_folders.insert(target.clone(), folder.clone());
        drop(active_folders);
        let temporary = Self { target, path: folder.join("file"), folder, _lock: lock };
        File::create_new(&temporary.path)?;
        Ok(temporary)
    }

    /// Gives the file the name of a target. What is replaced hands on its permissions.
    fn rename(&self, target: &Path) -> io::Result<()> {
        // Disks without permissions have none to keep.
        if let Ok(before) = fs::metadata(target) {
            let _ = fs::set_permissions(&self.path, before.permissions());
        }
        fs::rename(&self.path, target)
    }
}

fn busy() -> io::Error {
    io::Error::new(io::ErrorKind::ResourceBusy, "is being written already")
}

/// How often another process may take a new folder for a leftover, in the moment before it is locked.
const ATTEMPTS: usize = 1000;

/// Creates a folder that only this user can open, and in it the lock.
fn create_locked(folder: &Path, id: u64) -> io::Result<(PathBuf, File)> {
    for _ in 0..ATTEMPTS {
        let folder = folder.join(folder_name(id));
        create_private_folder(&folder)?;
        match lock_in(&folder) {
            Ok(Some(lock)) => return Ok((folder, lock)),
            Ok(None) => {}
            Err(error) => {
                let _ = fs::remove_dir_all(&folder);
                return Err(error);
            }
        }
    }
    Err(busy())
}

/// Creates the lock in a new folder; `None` if another process removes that as a leftover.
fn lock_in(folder: &Path) -> io::Result<Option<File>> {
    let path = folder.join(LOCK);
    let lock = match File::create_new(&path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        created => created?,
    };
    match lock.try_lock() {
        Err(TryLockError::WouldBlock) => Ok(None),
        // A disk without locks: the folder stays if the process is killed.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(path.exists().then_some(lock)),
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
        active_folders().remove(&self.target);
    }
}
