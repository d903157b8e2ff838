use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};

/// Refuses an output that cannot be written, before any work is done: in a missing folder, over something that is not a
/// regular file, or over one of the inputs.
pub fn ensure_writable(output: &Path, inputs: &[&Path]) -> Result<()> {
    let shown = output.display();
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !fs::metadata(folder).with_context(|| format!("{shown}: cannot write into {}", folder.display()))?.is_dir() {
        bail!("{shown}: {} is not a folder: give a path in a folder that exists", folder.display());
    }
    match fs::metadata(output) {
        Ok(there) if there.is_dir() => bail!("{shown}: is a folder: give the name of a file in it"),
        Ok(there) if !there.is_file() => bail!("{shown}: is not a regular file: give another name"),
        Ok(there) if there.permissions().readonly() => {
            bail!("{shown}: is read-only: make it writable, or choose another name with -o")
        }
        _ => {}
    }
    let real = |path: &Path| fs::canonicalize(path).ok();
    if let Some(input) = inputs.iter().find(|input| real(output).is_some() && real(output) == real(input)) {
        bail!("{shown}: would replace {}, which is an input: choose another name with -o", input.display());
    }
    Ok(())
}
