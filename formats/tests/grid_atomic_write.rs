//! A write that does not end well leaves the old file as it was, and nothing else.

mod grid_samples;

use std::fs;
use std::io::{self, Error};
use std::path::{Path, PathBuf};
use std::process::Command;

use grid_samples::{Made, about};
use sdf_formats::grid_file::{self, atomic_write};
use tempfile::TempDir;

/// A folder with nothing but an old file in it.
struct Old {
    folder: TempDir,
    path: PathBuf,
}

impl Old {
    fn new() -> Self {
        let folder = TempDir::new().unwrap();
        let path = folder.path().join("old.txt");
        fs::write(&path, "old").unwrap();
        Self { folder, path }
    }

    fn is_as_it_was(&self) -> bool {
        fs::read(&self.path).unwrap() == b"old" && self.files() == 1
    }

    fn files(&self) -> usize {
        fs::read_dir(&self.folder).unwrap().count()
    }
}

#[test]
fn the_new_file_takes_the_place_of_the_old() {
    let old = Old::new();
    let written: io::Result<usize> = atomic_write(&old.path, |temporary| {
        assert_eq!(temporary.parent().unwrap().parent(), old.path.parent());
        fs::write(temporary, "new")?;
        assert_eq!(fs::read(&old.path)?, b"old");
        Ok(3)
    });
    assert_eq!(written.unwrap(), 3);
    assert_eq!(fs::read(&old.path).unwrap(), b"new");
    assert_eq!(old.files(), 1);
}

#[test]
fn a_write_that_fails_leaves_the_old_file() {
    let old = Old::new();
    let answer: io::Result<()> = atomic_write(&old.path, |temporary| {
        fs::write(temporary, "half of the n")?;
        Err(Error::other("disk is full"))
    });
    assert_eq!(answer.unwrap_err().to_string(), "disk is full");
    assert!(old.is_as_it_was());
}

#[test]
fn a_write_that_panics_leaves_the_old_file() {
    let old = Old::new();
    let path = old.path.clone();
    let answer = std::panic::catch_unwind(move || -> io::Result<()> {
        atomic_write(&path, |temporary| {
            fs::write(temporary, "half of the n")?;
            panic!("on purpose")
        })
    });
    assert!(answer.is_err());
    assert!(old.is_as_it_was());
}

#[test]
fn two_writers_of_one_file_do_not_mix() {
    let old = Old::new();
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
    let old = Old::new();
    let answer: io::Result<()> = atomic_write(old.folder.path(), |_| unreachable!());
    assert_eq!(answer.unwrap_err().to_string(), "exists and is not a regular file");
    let answer: io::Result<()> = atomic_write(&old.folder.path().join("none/new.txt"), |_| unreachable!());
    assert_eq!(answer.unwrap_err().kind(), io::ErrorKind::NotFound);
    assert!(old.is_as_it_was());
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link() {
    let old = Old::new();
    let link = old.folder.path().join("link.txt");
    std::os::unix::fs::symlink("old.txt", &link).unwrap();
    let answer: io::Result<()> = atomic_write(&link, |temporary| fs::write(temporary, "new"));
    answer.unwrap();
    assert!(link.symlink_metadata().unwrap().is_symlink());
    assert_eq!(fs::read(&old.path).unwrap(), b"new");
}

const TARGET: &str = "GRID_ATOMIC_WRITE_TARGET";

/// Not a test of its own: the process that the next two let run into its end.
#[test]
#[ignore = "is started by other tests"]
fn victim() {
    let Some(target) = std::env::var_os(TARGET) else { return };
    let made = Made::new([64, 64, 64], None);
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
    let old = Old::new();
    let this = std::env::current_exe().unwrap();
    let arguments = ["--exact", "victim", "--ignored"];
    let ended = Command::new(this).args(arguments).env(TARGET, &old.path).env("ABORT", "1").output().unwrap();
    assert!(!ended.status.success());
    assert_eq!(fs::read(&old.path).unwrap(), b"old");
}

/// A limit to the size of files does what a full disk does.
#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_old_file() {
    let old = Old::new();
    let script = "trap '' XFSZ; ulimit -f 64; exec \"$0\" --exact victim --ignored";
    let this = std::env::current_exe().unwrap();
    let ended = Command::new("sh").args(["-c", script]).arg(this).env(TARGET, &old.path).output().unwrap();
    assert!(ended.status.success(), "{}", String::from_utf8_lossy(&ended.stdout));
    assert!(String::from_utf8_lossy(&ended.stdout).contains("1 passed"));
    assert!(old.is_as_it_was());
}
