//! A folder of OBJ files, one for each frame, and one of what stands still.

use std::ffi::OsStr;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use sdf_formats::FolderWriter;

use super::Recording;

/// Writes `frame_0000.obj` and so on, from the frame `first` on, and `still.obj`, into a folder that is made if missing. Each file is
/// written whole or not, and left to the system to flush. Frames that an earlier, longer recording left there are removed, and nothing else.
pub fn write_folder(recording: &Recording, first: usize, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let writer = FolderWriter::new(folder)?;
    for (index, points) in recording.frames.iter().enumerate().skip(first) {
        writer.write(&frame_name(index), text(points, &recording.faces, &recording.edges).as_bytes())?;
    }
    writer.write("still.obj", text(&recording.still_points, &recording.still_faces, &[]).as_bytes())?;
    remove_later_frames(folder, recording.frames.len())
}

/// Files of a folder that [`write_folder`] may replace or remove.
pub fn files_of_folder(folder: &Path) -> io::Result<Vec<PathBuf>> {
    let mut files = vec![];
    for entry in fs::read_dir(folder)? {
        let (name, path) = entry.map(|entry| (entry.file_name(), entry.path()))?;
        if (name == "still.obj" || frame_number(&name).is_some()) && path.is_file() {
            files.push(path);
        }
    }
    Ok(files)
}

fn frame_name(index: usize) -> String {
    format!("frame_{index:04}.obj")
}

/// The frame whose file has the very name that `frame_name` gives.
fn frame_number(name: &OsStr) -> Option<usize> {
    let number = name.to_str()?.strip_prefix("frame_")?.strip_suffix(".obj")?.parse().ok()?;
    (name == &*frame_name(number)).then_some(number)
}

/// Removes the frames from an index on, where they are regular files.
fn remove_later_frames(folder: &Path, first: usize) -> io::Result<()> {
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let is_later = frame_number(&entry.file_name()).is_some_and(|index| index >= first);
        if is_later && entry.file_type()?.is_file() {
            fs::remove_file(entry.path())?;
        }
    }
    Ok(())
}

fn text(points: &[[f32; 3]], faces: &[[u32; 3]], edges: &[[u32; 2]]) -> String {
    use std::fmt::Write;
    let mut text = String::new();
    for [x, y, z] in points {
        _ = writeln!(text, "v {x} {y} {z}");
    }
    for [a, b, c] in faces {
        _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    for [a, b] in edges {
        _ = writeln!(text, "l {} {}", a + 1, b + 1);
    }
    text
}
