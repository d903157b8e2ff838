use std::path::Path;

use anyhow::{Context, Result};
use sdf_formats::mesh::{Mesh, parse};
use sha2::{Digest, Sha256};

/// A mesh and the digest of the file's bytes.
pub struct MeshInput {
    pub name: String,
    pub mesh: Mesh,
    pub sha256: [u8; 32],
}

pub fn read(path: &Path) -> Result<MeshInput> {
    let shown = path.display().to_string();
    let bytes = std::fs::read(path).with_context(|| shown.clone())?;
    let mesh = parse(&bytes, &shown)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(MeshInput { name, mesh, sha256: Sha256::digest(&bytes).into() })
}

/// Puts the path before an error that does not name it.
pub fn at<T, E: std::error::Error + Send + Sync + 'static>(path: &Path, result: Result<T, E>) -> Result<T> {
    result.with_context(|| path.display().to_string())
}
