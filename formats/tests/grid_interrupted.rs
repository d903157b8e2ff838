//! Alone in its process, for it stops every write there is.

use std::{fs, io};

use sdf_formats::grid_file::{atomic_write, remove_temporaries};

#[test]
fn interrupted_writes_are_cleared_away_and_cannot_come_back() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("old.txt");
    fs::write(&target, "old").unwrap();
    let answer: io::Result<()> = atomic_write(&target, |temporary| {
        fs::write(temporary, "half of the n")?;
        let removed = remove_temporaries();
        assert_eq!(fs::read_dir(folder.path())?.count(), 1);
        // What was about to make the file has lost its place.
        assert!(fs::write(temporary, "half of the n").is_err());
        drop(removed);
        Ok(())
    });
    // Had the process not ended, it would notice.
    assert!(answer.is_err());
    assert_eq!(fs::read(&target).unwrap(), b"old");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}
