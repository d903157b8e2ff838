//! Where does a command write its file? Into a file that may be written, or to standard output for a dash.

use std::fs;
use std::io::{self, Write};
use std::path::Path;

use anyhow::{Context, Result, bail};
use sdf_field::Field;
use sdf_field::file::Compression;
use sdf_formats::contact_file::{self, ContactFormat, Record};
use sdf_formats::field_file::files_named_in;
use sdf_formats::try_to_write;

use crate::args::Json;
use crate::failure::misuse;
use crate::mesh_input::with_path;
use crate::standard_output::{is_standard_output, print_bytes, to_stdout};

/// Refuses a file and a JSON object on one standard output.
pub fn ensure_alone(output: &Path, json: Json) -> Result<()> {
    if is_standard_output(output) && json.wanted {
        misuse!("--output - and --json both write to standard output: leave one out, or name a file");
    }
    Ok(())
}

/// Writes a field into a file, or to standard output; the number of bytes.
pub fn save(field: &Field, output: &Path, compression: Compression) -> Result<u64> {
    if is_standard_output(output) {
        let bytes = field.to_packed_bytes(compression)?;
        print_bytes(&bytes)?;
        return Ok(bytes.len() as u64);
    }
    field.save_packed(output, compression)?;
    Ok(fs::metadata(output).map_or(0, |file| file.len()))
}

/// Writes a list of contacts into a file of the format of its name, or as CSV to standard output. `json` writes the document of a
/// JSON file.
pub fn write_contacts<T: Record>(
    path: &Path,
    records: impl ExactSizeIterator<Item = T>,
    json: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<()> {
    match ContactFormat::from_extension(path) {
        Some(format) => with_path(path, contact_file::write(path, format, records, json)),
        None => to_stdout(|out| contact_file::write_csv(out, records)),
    }
}

/// Is it in a folder of devices, as /dev/stdout is, or a link to there? Even where it stands for a regular file, whoever opened that
/// file writes to it too, and a rename would take it away.
fn is_device(output: &Path, folder: &Path) -> bool {
    let (mut path, mut folder) = (output.to_owned(), folder.to_owned());
    // As many links as systems follow.
    for _ in 0..40 {
        let Ok(found) = fs::canonicalize(&folder) else { return false };
        let is_device = found.starts_with("/dev") && !found.starts_with("/dev/shm");
        if is_device || found.starts_with("/proc") {
            return true;
        }
        let Ok(next) = fs::read_link(&path) else { return false };
        path = found.join(next);
        folder = path.parent().unwrap_or(Path::new("/")).to_owned();
    }
    false
}

/// Refuses an output that cannot be written, before any work is done: in a missing folder, over something that is not a
/// regular file, or over one of the inputs or a file that one of them names.
pub fn ensure_writable(output: &Path, inputs: &[&Path]) -> Result<()> {
    if is_standard_output(output) {
        return Ok(());
    }
    let shown = output.display();
    let folder = output.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    if !fs::metadata(folder).with_context(|| format!("{shown}: cannot write into {}", folder.display()))?.is_dir() {
        bail!("{shown}: {} is not a folder: give a path in a folder that exists", folder.display());
    }
    if is_device(output, folder) {
        bail!("{shown}: is not a regular file: give another name");
    }
    match fs::metadata(output) {
        Ok(there) if there.is_dir() => bail!("{shown}: is a folder: give the name of a file in it"),
        Ok(there) if !there.is_file() => bail!("{shown}: is not a regular file: give another name"),
        Ok(there) if there.permissions().readonly() => {
            bail!("{shown}: is read-only: make it writable, or choose another name with -o")
        }
        _ => {}
    }
    try_to_write(output).with_context(|| format!("{shown}: cannot be written"))?;
    let Ok(replaced) = fs::canonicalize(output) else { return Ok(()) };
    let is_replaced = |input: &Path| fs::canonicalize(input).is_ok_and(|input| input == replaced);
    for input in inputs {
        if is_replaced(input) {
            bail!("{shown}: would replace {}, which is an input: choose another name with -o", input.display());
        }
        if files_named_in(input).iter().any(|file| is_replaced(file)) {
            bail!("{shown}: would replace a file that {} names: choose another name with -o", input.display());
        }
    }
    Ok(())
}
