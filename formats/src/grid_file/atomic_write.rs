use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The temporaries of writes under way in this process.
static UNDER_WAY: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Writes a file whole or not at all.
///
/// `write` is given the path of an empty file in the folder of `target`. If it returns `Ok`, that file is flushed to
/// the disk and takes the name of `target` in one step; if it fails or panics, the file is removed and `target` is as
/// it was. A link is followed: what it points at is replaced. A `target` that exists and is no regular file (a folder,
/// a device, a pipe) is refused, for a rename would take its place.
///
/// One process writes one target once at a time; the second is refused.
pub fn atomic_write<T, E: From<io::Error>>(target: &Path, write: impl FnOnce(&Path) -> Result<T, E>) -> Result<T, E> {
    let target = replaceable(target)?;
    let folder = folder_of(&target);
    let temporary = Temporary::create(folder.join(temporary_name(&target)))?;
    let written = write(&temporary.path)?;
    // Windows flushes only what is open for writing.
    OpenOptions::new().write(true).open(&temporary.path)?.sync_all()?;
    fs::rename(&temporary.path, &target)?;
    // Without this the new name itself may be lost with the power.
    #[cfg(unix)]
    File::open(folder)?.sync_all()?;
    Ok(written)
}

/// Removes what unfinished [`atomic_write`]s of this process have written so far: for a handler of Ctrl-C, just before
/// it ends the process.
pub fn remove_temporaries() {
    for path in under_way().iter() {
        // Nobody is left to be told, and the others are to go too.
        let _ = fs::remove_file(path);
    }
}

fn under_way() -> MutexGuard<'static, BTreeSet<PathBuf>> {
    UNDER_WAY.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The path to rename to, its links followed.
fn replaceable(target: &Path) -> io::Result<PathBuf> {
    match fs::metadata(target) {
        Ok(found) if found.is_file() => fs::canonicalize(target),
        Ok(_) => Err(io::Error::new(io::ErrorKind::InvalidInput, "exists and is not a regular file")),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(target.to_owned()),
        Err(error) => Err(error),
    }
}

fn folder_of(target: &Path) -> &Path {
    target.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The same for the same target and process, and short whatever the target's name is.
fn temporary_name(target: &Path) -> String {
    let mut hasher = DefaultHasher::new();
    target.hash(&mut hasher);
    format!(".sdftool-{}-{:016x}.tmp", std::process::id(), hasher.finish())
}

/// An empty file that is gone when this is dropped, unless it was renamed.
struct Temporary {
    path: PathBuf,
}

impl Temporary {
    fn create(path: PathBuf) -> io::Result<Self> {
        if !under_way().insert(path.clone()) {
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, "is being written already"));
        }
        let temporary = Self { path };
        // Of a process with the same number that was killed.
        let _ = fs::remove_file(&temporary.path);
        // Never through a link that someone else laid there.
        File::create_new(&temporary.path)?;
        Ok(temporary)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_file(&self.path);
        under_way().remove(&self.path);
    }
}
