use std::path::Path;

use anyhow::{Context, Result, bail};
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
    if is_device(path) {
        bail!("{shown}: is a device, which may have no end: name a file");
    }
    let bytes = std::fs::read(path).with_context(|| shown.clone())?;
    let mesh = parse(&bytes, &shown)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    Ok(MeshInput { name, mesh, sha256: Sha256::digest(&bytes).into() })
}

#[cfg(unix)]
fn is_device(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = std::fs::metadata(path).map(|there| there.file_type());
    kind.is_ok_and(|kind| kind.is_char_device() || kind.is_block_device())
}

#[cfg(not(unix))]
fn is_device(_path: &Path) -> bool {
    false
}

/// Puts the path before an error that does not name it.
pub fn at<T, E: std::error::Error + Send + Sync + 'static>(path: &Path, result: Result<T, E>) -> Result<T> {
    result.with_context(|| path.display().to_string())
}
