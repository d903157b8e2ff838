//! Meshes named on the command line, with a hash of the file; devices are refused.

use std::io::Read;
use std::path::Path;

use anyhow::{Context, Result, bail};
use sdf_formats::mesh::{self, Mesh, MeshError, PolygonCounts, read_bytes};
use sha2::{Digest, Sha256};

/// A mesh and the facts about its file.
#[derive(Clone)]
pub struct MeshInput {
    pub mesh: Mesh,
    pub facts: MeshFacts,
}

impl MeshInput {
    /// `sha256` is that of the file's bytes.
    pub fn new(name: String, mesh: Mesh, sha256: [u8; 32]) -> Self {
        let facts = MeshFacts {
            name,
            sha256,
            points: mesh.points.len(),
            triangles: mesh.triangles.len(),
            objects: mesh.objects,
            polygon_counts: mesh.polygon_counts,
        };
        Self { mesh, facts }
    }
}

/// Facts that are reported about a mesh after its points and triangles are freed.
#[derive(Clone)]
pub struct MeshFacts {
    pub name: String,
    /// SHA-256 of the file's bytes.
    pub sha256: [u8; 32],
    pub points: usize,
    pub triangles: usize,
    pub objects: usize,
    pub polygon_counts: PolygonCounts,
}

pub fn read(path: &Path) -> Result<MeshInput> {
    let bytes = bytes(path)?;
    let shown = shown(path);
    let (mesh, sha256) = sdf_parallel::join(|| read_bytes(&bytes, &shown), || Sha256::digest(&bytes).into());
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(MeshInput::new(name, mesh?, sha256))
}

/// Reads a mesh without hashing its file.
pub fn read_mesh(path: &Path) -> Result<Mesh> {
    require_end(path)?;
    if is_standard_input(path) {
        return Ok(read_bytes(&bytes(path)?, &shown(path))?);
    }
    match mesh::read(path) {
        Err(MeshError::Unreadable { file, source }) => Err(source).context(file),
        read => Ok(read?),
    }
}

/// A dash stands for standard input.
pub fn is_standard_input(path: &Path) -> bool {
    path == Path::new("-")
}

/// The name of a file in messages.
pub fn shown(path: &Path) -> String {
    if is_standard_input(path) { "standard input".to_owned() } else { path.display().to_string() }
}

/// The bytes of a file, or of standard input.
pub fn bytes(path: &Path) -> Result<Vec<u8>> {
    require_end(path)?;
    if is_standard_input(path) {
        let mut bytes = Vec::new();
        std::io::stdin().lock().read_to_end(&mut bytes).context("standard input")?;
        return Ok(bytes);
    }
    std::fs::read(path).with_context(|| path.display().to_string())
}

/// Refuses a device, which may have no end.
pub fn require_end(path: &Path) -> Result<()> {
    if is_device(path) {
        bail!("{}: a device, which may have no end: give a regular file", path.display());
    }
    Ok(())
}

/// `true` of a device, which may have no end.
#[cfg(unix)]
pub fn is_device(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = std::fs::metadata(path).map(|there| there.file_type());
    kind.is_ok_and(|kind| kind.is_char_device() || kind.is_block_device())
}

/// `true` of a device, which may have no end.
#[cfg(not(unix))]
pub fn is_device(_path: &Path) -> bool {
    false
}

/// Puts the path before an error that does not name it.
pub fn with_path<T, E: std::error::Error + Send + Sync + 'static>(path: &Path, result: Result<T, E>) -> Result<T> {
    result.with_context(|| path.display().to_string())
}
