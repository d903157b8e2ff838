use std::collections::BTreeSet;
use std::fs::{self, File, OpenOptions};
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The temporary folders of writes under way in this process.
static UNDER_WAY: Mutex<BTreeSet<PathBuf>> = Mutex::new(BTreeSet::new());

/// Writes a file whole or not at all.
///
/// `write` is given the path of an empty file, in a temporary folder beside `target`. If it returns `Ok`, that file is
/// flushed to the disk and takes the name of `target` in one step; if it fails or panics, the file is removed and `target`
/// is as it was. A link is followed: what it points at is replaced. A `target` that exists and is no regular file (a folder,
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

/// Removes what unfinished [`atomic_write`]s of this process have written so far, for a handler of Ctrl-C. None begins as
/// long as the answer is held, so hold it until the process has ended; none goes on, for its folder is gone.
pub fn remove_temporaries() -> Removed {
    let under_way = under_way();
    for folder in under_way.iter() {
        // A file may be made in it meanwhile, but not for ever: each attempt takes what is there.
        for _ in 0..1000 {
            let left = fs::remove_dir_all(folder);
            if left.is_ok() || left.is_err_and(|error| error.kind() == io::ErrorKind::NotFound) {
                break;
            }
        }
    }
    Removed { _under_way: under_way }
}

/// Keeps new temporaries from being made.
#[must_use = "as soon as it is dropped, writes begin again"]
pub struct Removed {
    _under_way: MutexGuard<'static, BTreeSet<PathBuf>>,
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

/// An empty file in a folder of its own, both gone when this is dropped. The folder is what makes an end final: once it is
/// removed, nobody who still has the file's name can make it again.
struct Temporary {
    folder: PathBuf,
    path: PathBuf,
}

impl Temporary {
    fn create(folder: PathBuf) -> io::Result<Self> {
        let mut under_way = under_way();
        if !under_way.insert(folder.clone()) {
            return Err(io::Error::new(io::ErrorKind::ResourceBusy, "is being written already"));
        }
        // Of a process with the same number that was killed.
        let _ = fs::remove_dir_all(&folder);
        // Never through a link that someone else laid there.
        if let Err(error) = fs::create_dir(&folder) {
            under_way.remove(&folder);
            return Err(error);
        }
        drop(under_way);
        let temporary = Self { path: folder.join("file"), folder };
        File::create_new(&temporary.path)?;
        Ok(temporary)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.folder);
        under_way().remove(&self.folder);
    }
}
