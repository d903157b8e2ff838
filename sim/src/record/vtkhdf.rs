//! VTKHDF files, which ParaView opens: one of all that moves, and one of what stands still.

use std::path::{Path, PathBuf};
use std::{fs, io};

use sdf_formats::atomic_write;
use sdf_formats::export::{MovingMesh, write_moving_vtkhdf};

use super::Recording;

/// Writes a file of all frames, and where something stands still another one beside it, [`still_path`]. Each is written whole or not. Where
/// nothing stands still, the other one of an earlier recording is removed.
pub fn write_vtkhdf(recording: &Recording, path: &Path) -> io::Result<()> {
    let times: Vec<f64> = (0..recording.frames.len()).map(|frame| frame as f64 / recording.rate).collect();
    let Recording { frames, edges, faces, bodies, .. } = recording;
    let moving = MovingMesh { times: &times, frames, lines: edges, faces, bodies };
    atomic_write(path, |temporary| write_moving_vtkhdf(temporary, &moving))?;
    if recording.still_faces.is_empty() {
        return match fs::remove_file(still_path(path)) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
            _ => Ok(()),
        };
    }
    let bodies = vec![0; recording.still_faces.len()];
    let frames = [recording.still_points.clone()];
    let still =
        MovingMesh { times: &[0.0], frames: &frames, lines: &[], faces: &recording.still_faces, bodies: &bodies };
    atomic_write(&still_path(path), |temporary| write_moving_vtkhdf(temporary, &still))
}

/// The file of what stands still: `run.still.vtkhdf` beside `run.vtkhdf`.
pub fn still_path(path: &Path) -> PathBuf {
    path.with_extension("still.vtkhdf")
}
