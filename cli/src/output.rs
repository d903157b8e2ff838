//! Where does a command write its file? Into a file that may be written, or to standard output for a dash.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

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
    ensure_all_writable(&[output], inputs)
}

/// [`ensure_writable`] of files in one folder, which is written to once.
pub fn ensure_all_writable<P: AsRef<Path>>(outputs: &[P], inputs: &[&Path]) -> Result<()> {
    let mut outputs = outputs.iter().map(AsRef::as_ref).filter(|output| !is_standard_output(output)).peekable();
    let Some(first) = outputs.peek().copied() else { return Ok(()) };
    let folder = first.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let shown = first.display();
    if !fs::metadata(folder).with_context(|| format!("{shown}: cannot write into {}", folder.display()))?.is_dir() {
        bail!("{shown}: {} is not a folder: give a path in a folder that exists", folder.display());
    }
    let kept = kept_files(inputs);
    for output in outputs {
        ensure_replaceable(output, folder)?;
        if output == first {
            try_to_write(output).with_context(|| format!("{shown}: cannot be written"))?;
        }
        let Ok(replaced) = fs::canonicalize(output) else { continue };
        if let Some((_, what)) = kept.iter().find(|(path, _)| *path == replaced) {
            bail!("{}: would replace {what}: choose another name with -o", output.display());
        }
    }
    Ok(())
}

/// Refuses what is there and not a regular file that may be written.
fn ensure_replaceable(output: &Path, folder: &Path) -> Result<()> {
    let shown = output.display();
    if is_device(output, folder) {
        bail!("{shown}: is not a regular file: give another name");
    }
    match fs::metadata(output) {
        Ok(there) if there.is_dir() => bail!("{shown}: is a folder: give the name of a file in it"),
        Ok(there) if !there.is_file() => bail!("{shown}: is not a regular file: give another name"),
        Ok(there) if there.permissions().readonly() => {
            bail!("{shown}: is read-only: make it writable, or choose another name with -o")
        }
        _ => Ok(()),
    }
}

/// The inputs and the files that they name, and what each is.
fn kept_files(inputs: &[&Path]) -> Vec<(PathBuf, String)> {
    let mut kept = vec![];
    for input in inputs {
        let shown = input.display();
        kept.extend(fs::canonicalize(input).map(|path| (path, format!("{shown}, which is an input"))));
        let named = files_named_in(input).into_iter().filter_map(|file| fs::canonicalize(file).ok());
        kept.extend(named.map(|path| (path, format!("a file that {shown} names"))));
    }
    kept
}
