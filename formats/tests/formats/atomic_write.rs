//! A write that fails, panics, is killed or interrupted leaves the old file as it was, and nothing else.

use std::fs;
use std::io::{self, Error};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

use sdf_formats::{FolderWriter, atomic_write, atomic_write_both, grid_file, remove_temporaries, try_to_write};
use tempfile::TempDir;

use crate::grid_samples::{DENSE, Made, about};

/// A folder that contains only an old file.
struct OldFile {
    folder: TempDir,
    path: PathBuf,
}

impl OldFile {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("old.txt");
        fs::write(&path, "old").unwrap();
        Self { folder, path }
    }

    fn is_unchanged(&self) -> bool {
        fs::read(&self.path).unwrap() == b"old" && self.file_count() == 1
    }

    fn file_count(&self) -> usize {
        fs::read_dir(&self.folder).unwrap().count()
    }
}

#[test]
fn a_tried_write_leaves_nothing() {
    let old = OldFile::new();
    try_to_write(&old.path).unwrap();
    try_to_write(&old.folder.path().join("new.txt")).unwrap();
    assert!(try_to_write(&old.folder.path().join("missing/new.txt")).is_err());
    assert!(old.is_unchanged());
}

#[test]
fn two_files_are_written_both_or_neither() {
    let old = OldFile::new();
    let beside = old.folder.path().join("beside.txt");
    atomic_write_both([(&old.path, b"new"), (&beside, b"about new")]).unwrap();
    assert_eq!([&old.path, &beside].map(|path| fs::read(path).unwrap()), [b"new".to_vec(), b"about new".to_vec()]);
    assert_eq!(old.file_count(), 2);
    // Neither of two of which one cannot be written.
    let (old, missing) = (OldFile::new(), Path::new("missing/file.txt"));
    let lost = old.folder.path().join(missing);
    assert_eq!(atomic_write_both([(&old.path, b"new"), (&lost, b"about new")]).unwrap_err().0, 1);
    assert_eq!(atomic_write_both([(&lost, b"new"), (&old.path, b"about new")]).unwrap_err().0, 0);
    assert!(old.is_unchanged());
    // Nor the same one twice.
    assert_eq!(atomic_write_both([(&old.path, b"new"), (&old.path, b"about new")]).unwrap_err().0, 1);
    assert!(old.is_unchanged());
}

#[test]
fn the_new_file_replaces_the_old() {
    let old = OldFile::new();
    let written: io::Result<usize> = atomic_write(&old.path, |temporary| {
        assert_eq!(temporary.parent().unwrap().parent(), old.path.parent());
        fs::write(temporary, "new")?;
        assert_eq!(fs::read(&old.path)?, b"old");
        Ok(3)
    });
    assert_eq!(written.unwrap(), 3);
    assert_eq!(fs::read(&old.path).unwrap(), b"new");
    assert_eq!(old.file_count(), 1);
}

#[cfg(unix)]
#[test]
fn the_new_file_has_the_permissions_of_the_old() {
    use std::os::unix::fs::PermissionsExt;
    for mode in [0o600, 0o640, 0o755] {
        let old = OldFile::new();
        fs::set_permissions(&old.path, fs::Permissions::from_mode(mode)).unwrap();
        let written: io::Result<()> = atomic_write(&old.path, |temporary| fs::write(temporary, "new"));
        written.unwrap();
        assert_eq!(fs::metadata(&old.path).unwrap().permissions().mode() & 0o777, mode);
    }
}

#[test]
fn a_write_that_fails_leaves_the_old_file() {
    let old = OldFile::new();
    let answer: io::Result<()> = atomic_write(&old.path, |temporary| {
        fs::write(temporary, "half of the n")?;
        Err(Error::other("disk is full"))
    });
    assert_eq!(answer.unwrap_err().to_string(), "disk is full");
    assert!(old.is_unchanged());
}

#[test]
fn a_write_that_panics_leaves_the_old_file() {
    let old = OldFile::new();
    let path = old.path.clone();
    let answer = std::panic::catch_unwind(move || -> io::Result<()> {
        atomic_write(&path, |temporary| {
            fs::write(temporary, "half of the n")?;
            panic!("on purpose")
        })
    });
    assert!(answer.is_err());
    assert!(old.is_unchanged());
}

#[test]
fn two_writers_of_one_file_do_not_mix() {
    let old = OldFile::new();
    let outer: io::Result<()> = atomic_write(&old.path, |temporary| {
        fs::write(temporary, "outer")?;
        let inner: io::Result<()> = atomic_write(&old.path, |_| unreachable!());
        assert_eq!(inner.unwrap_err().kind(), io::ErrorKind::ResourceBusy);
        assert_eq!(fs::read(temporary)?, b"outer");
        Ok(())
    });
    outer.unwrap();
    assert_eq!(fs::read(&old.path).unwrap(), b"outer");
}

#[test]
fn a_folder_is_not_replaced() {
    let old = OldFile::new();
    let answer: io::Result<()> = atomic_write(old.folder.path(), |_| unreachable!());
    assert_eq!(answer.unwrap_err().to_string(), "exists and is not a regular file");
    let answer: io::Result<()> = atomic_write(&old.folder.path().join("none/new.txt"), |_| unreachable!());
    assert_eq!(answer.unwrap_err().kind(), io::ErrorKind::NotFound);
    assert!(old.is_unchanged());
}

#[cfg(unix)]
#[test]
fn files_of_a_folder_are_replaced_by_one_writer() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    let (old, elsewhere) = (OldFile::new(), OldFile::new());
    let at = |name: &str| old.folder.path().join(name);
    fs::set_permissions(&old.path, fs::Permissions::from_mode(0o640)).unwrap();
    symlink(&elsewhere.path, at("link.txt")).unwrap();
    fs::create_dir(at("folder")).unwrap();
    let writer = FolderWriter::new(old.folder.path()).unwrap();
    assert!(FolderWriter::new(old.folder.path()).is_err(), "it is being written already");
    ["old.txt", "new.txt", "link.txt"].iter().for_each(|name| writer.write(name, name.as_bytes()).unwrap());
    assert_eq!(writer.write("folder", b"").unwrap_err().to_string(), "exists and is not a regular file");
    drop(writer);
    ["old.txt", "new.txt", "link.txt"].iter().for_each(|name| assert_eq!(fs::read(at(name)).unwrap(), name.as_bytes()));
    assert_eq!(fs::metadata(&old.path).unwrap().permissions().mode() & 0o777, 0o640);
    assert!(at("link.txt").symlink_metadata().unwrap().is_symlink());
    assert_eq!((old.file_count(), elsewhere.file_count()), (4, 1));
    assert!(FolderWriter::new(&at("none")).is_err());
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link() {
    let old = OldFile::new();
    let link = old.folder.path().join("link.txt");
    std::os::unix::fs::symlink("old.txt", &link).unwrap();
    let answer: io::Result<()> = atomic_write(&link, |temporary| fs::write(temporary, "new"));
    answer.unwrap();
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert_eq!(fs::read(&old.path).unwrap(), b"new");
}

#[cfg(unix)]
#[test]
fn a_link_to_a_file_that_is_not_there_stays_a_link() {
    use std::os::unix::fs::symlink;
    let old = OldFile::new();
    let at = |name: &str| old.folder.path().join(name);
    fs::create_dir(at("folder")).unwrap();
    // A link to a link, each beside another file.
    symlink("folder/second.txt", at("first.txt")).unwrap();
    symlink("../new.txt", at("folder/second.txt")).unwrap();
    let write = |path: &Path| atomic_write(path, |temporary| fs::write(temporary, "new"));
    write(&at("first.txt")).unwrap();
    assert!(["first.txt", "folder/second.txt"].iter().all(|link| at(link).symlink_metadata().unwrap().is_symlink()));
    assert_eq!(fs::read(at("new.txt")).unwrap(), b"new");
    symlink("missing/new.txt", at("lost.txt")).unwrap();
    assert_eq!(write(&at("lost.txt")).unwrap_err().kind(), io::ErrorKind::NotFound);
    symlink("circle.txt", at("circle.txt")).unwrap();
    write(&at("circle.txt")).unwrap_err();
    assert_eq!(fs::read(&old.path).unwrap(), b"old");
}

const TARGET: &str = "ATOMIC_WRITE_TARGET";

/// Not a test of its own: the child process that the next two tests start and end early.
#[test]
#[ignore = "started by other tests"]
fn victim() {
    let Some(target) = std::env::var_os(TARGET) else { return };
    let made = Made::new([64, 64, 64], DENSE);
    if std::env::var_os("ABORT").is_none() {
        let error = grid_file::write(Path::new(&target), &made.lattice, made.samples(), &about()).unwrap_err();
        assert_eq!(error.to_string().lines().count(), 1);
        return;
    }
    let _: io::Result<()> = atomic_write(Path::new(&target), |temporary| {
        fs::write(temporary, "half of the n")?;
        std::process::abort()
    });
}

#[test]
fn a_killed_write_leaves_the_old_file() {
    let old = OldFile::new();
    let this = std::env::current_exe().unwrap();
    let arguments = ["--exact", "atomic_write::victim", "--ignored"];
    let abort = |target: &Path| {
        let output = Command::new(&this).args(arguments).env(TARGET, target).env("ABORT", "1").output().unwrap();
        assert!(!output.status.success());
    };
    abort(&old.path);
    assert_eq!(fs::read(&old.path).unwrap(), b"old");
    // The next write of the same target clears up; one of another target does not.
    abort(&old.path);
    abort(&old.folder.path().join("new.txt"));
    assert!(old.file_count() > 2, "nothing to clear up");
    let write = |path: &Path| -> io::Result<()> { atomic_write(path, |temporary| fs::write(temporary, "new")) };
    write(&old.path).unwrap();
    assert_eq!(old.file_count(), 2, "old.txt, and what is left of new.txt");
    write(&old.folder.path().join("new.txt")).unwrap();
    assert_eq!(old.file_count(), 2, "old.txt and new.txt");
}

/// Not a test of its own: a child process of the next test, which writes the same target as others do.
#[test]
#[ignore = "started by another test"]
fn rival() {
    let Some(target) = std::env::var_os(TARGET) else { return };
    for _ in 0..200 {
        let write = |temporary: &Path| fs::write(temporary, "new");
        atomic_write(Path::new(&target), write).unwrap();
        try_to_write(Path::new(&target)).unwrap();
        FolderWriter::new(Path::new(&target).parent().unwrap()).unwrap().write("old.txt", b"new").unwrap();
    }
}

#[test]
fn processes_that_write_one_file_at_the_same_time_all_succeed() {
    let old = OldFile::new();
    let this = std::env::current_exe().unwrap();
    let start = |_| {
        let mut command = Command::new(&this);
        command.args(["--exact", "atomic_write::rival", "--ignored"]).env(TARGET, &old.path);
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    };
    let rivals: Vec<_> = (0..6).map(start).collect();
    for rival in rivals {
        let output = rival.wait_with_output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        assert!(String::from_utf8_lossy(&output.stdout).contains("1 passed"));
    }
    assert_eq!(fs::read(&old.path).unwrap(), b"new");
    assert_eq!(old.file_count(), 1);
}

/// The folder of a process that lives, here or on another machine, stays.
#[test]
fn a_write_in_progress_elsewhere_is_left_alone() {
    let old = OldFile::new();
    let mut name = String::new();
    let write = |visit: &mut dyn FnMut(&Path)| -> io::Result<()> {
        atomic_write(&old.path, |temporary| {
            visit(temporary);
            fs::write(temporary, "new")
        })
    };
    let mut note = |path: &Path| name = path.parent().unwrap().file_name().unwrap().to_str().unwrap().to_owned();
    write(&mut note).unwrap();
    let (_, of_target) = name.rsplit_once('-').unwrap();
    let other = old.folder.path().join(format!(".sdftool-1-{of_target}"));
    // Empty: killed between the folder and its lock.
    fs::create_dir(&other).unwrap();
    write(&mut |_| {}).unwrap();
    assert!(!other.exists());
    fs::create_dir(&other).unwrap();
    fs::write(other.join("file"), "half of the n").unwrap();
    // Not locked yet: it may be about to be.
    write(&mut |_| {}).unwrap();
    assert!(other.join("file").is_file());
    let lock = fs::File::create_new(other.join("lock")).unwrap();
    lock.lock().unwrap();
    write(&mut |_| {}).unwrap();
    assert!(other.join("file").is_file());
    lock.unlock().unwrap();
    write(&mut |_| {}).unwrap();
    assert!(!other.exists() && old.file_count() == 1);
}

#[test]
fn a_read_only_file_is_not_replaced() {
    let old = OldFile::new();
    let mut permissions = fs::metadata(&old.path).unwrap().permissions();
    permissions.set_readonly(true);
    fs::set_permissions(&old.path, permissions).unwrap();
    let answer: io::Result<()> = atomic_write(&old.path, |_| unreachable!());
    assert_eq!(answer.unwrap_err().to_string(), "is read-only: make it writable, or write elsewhere");
    assert!(old.is_unchanged());
}

/// A limit on file sizes acts as a full disk does.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_old_file() {
    let old = OldFile::new();
    let script = "trap '' XFSZ; ulimit -f 64; exec \"$0\" --exact atomic_write::victim --ignored";
    let this = std::env::current_exe().unwrap();
    let output = Command::new("sh").args(["-c", script]).arg(this).env(TARGET, &old.path).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stdout));
    assert!(String::from_utf8_lossy(&output.stdout).contains("1 passed"));
    assert!(old.is_unchanged());
}

/// Runs in a process of its own, because it stops every write of its process.
#[test]
#[ignore = "started by another test"]
fn interrupted_victim() {
    let folder = TempDir::new().unwrap();
    let target = folder.path().join("old.txt");
    fs::write(&target, "old").unwrap();
    let answer: io::Result<()> = atomic_write(&target, |temporary| {
        fs::write(temporary, "half of the n")?;
        let lock = remove_temporaries();
        assert_eq!(fs::read_dir(folder.path())?.count(), 1);
        // The folder is gone, so the file cannot be created again.
        assert!(fs::write(temporary, "half of the n").is_err());
        drop(lock);
        Ok(())
    });
    // If the process does not end, the writer notices.
    assert!(answer.is_err());
    assert_eq!(fs::read(&target).unwrap(), b"old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn interrupted_writes_are_cleared_away_and_cannot_come_back() {
    let this = std::env::current_exe().unwrap();
    let output =
        Command::new(this).args(["--exact", "atomic_write::interrupted_victim", "--ignored"]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success() && said.contains("1 passed"), "{said}");
}
