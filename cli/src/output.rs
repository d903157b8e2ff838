use std::fs;
use std::path::Path;

use anyhow::{Context, Result, bail};

/// Refuses what cannot be written, before any work is done for it: a folder that is not there, a place that holds no
/// file, and one of the files that the work reads.
pub fn require(output: &Path, inputs: &[&Path]) -> Result<()> {
    let shown = output.display();
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !fs::metadata(folder).with_context(|| format!("{shown}: cannot write into {}", folder.display()))?.is_dir() {
        bail!("{shown}: {} is not a folder: write elsewhere", folder.display());
    }
    match fs::metadata(output) {
        Ok(there) if there.is_dir() => bail!("{shown}: is a folder: name a file in it"),
        Ok(there) if !there.is_file() => bail!("{shown}: is not a regular file: name one"),
        Ok(there) if there.permissions().readonly() => {
            bail!("{shown}: is read-only: make it writable, or write elsewhere")
        }
        _ => {}
    }
    let place = |path: &Path| fs::canonicalize(path).ok();
    if let Some(input) = inputs.iter().find(|input| place(output).is_some() && place(output) == place(input)) {
        bail!("{shown}: would replace {}, which is read: write elsewhere with -o", input.display());
    }
    Ok(())
}
