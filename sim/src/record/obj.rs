//! A folder of OBJ files, one for each frame, and one of what stands still.

use std::fs;
use std::io;
use std::path::Path;

use super::Recording;

/// Writes `frame_0000.obj` and so on, and `still.obj`, into a folder that is made if missing. Each file is written whole or not.
pub fn write_folder(recording: &Recording, folder: &Path) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    let write = |name: &str, text: String| {
        sdf_formats::atomic_write(&folder.join(name), |temporary| fs::write(temporary, &text))
    };
    for (index, points) in recording.frames.iter().enumerate() {
        write(&format!("frame_{index:04}.obj"), text(points, &recording.faces, &recording.edges))?;
    }
    write("still.obj", text(&recording.still_points, &recording.still_faces, &[]))
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
