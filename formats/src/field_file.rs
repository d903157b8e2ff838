//! Fields from files, and closed forms to them: a baked grid (`.sdf.h5`), a blob of one (`.sdfb`), or shapes in closed form
//! (`.sdf.toml`, docs/fields.md).
//!
//! | question | file |
//! |---|---|
//! | Is it a grid or TOML, and where is it read from? | here |
//! | Which value has a key, and are all keys known? | `table` |
//! | Which shape does a table describe, and which pose? | `shapes`, `pose` |
//! | Which text does a closed form have? | `write` |

mod error;
mod pose;
mod shapes;
mod table;
mod write;

use std::borrow::Cow;
use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fs;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use error::FieldError;

use sdf_core::AnyField;
use sdf_core::grid::owned::OwnedGrid;

use crate::atomic_write;
use crate::blob_file::{self, StoredBlob, is_blob};
use crate::grid_file::{self, GridReader, StoredGrid};
use crate::hdf5::SIGNATURE;
use table::Table;

/// The field of a file.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a program has one or two")]
pub enum Field {
    /// A baked grid with its metadata.
    Grid(StoredGrid),
    /// Shapes in closed form, or the grid of a blob, which has no metadata.
    Analytic(AnyField),
}

/// The field of a file; of a grid, the samples are not read yet.
#[expect(clippy::large_enum_variant, reason = "a program has one or two")]
pub enum OpenField<'a> {
    /// An open grid file.
    Grid(GridReader<'a>),
    /// The grid of a blob, read whole.
    Blob(StoredBlob),
    /// Shapes in closed form.
    Analytic(AnyField),
}

impl OpenField<'_> {
    fn read(self) -> Result<Field, FieldError> {
        Ok(match self {
            Self::Grid(reader) => Field::Grid(reader.read()?),
            Self::Blob(blob) => Field::Analytic(blob.grid.into()),
            Self::Analytic(node) => Field::Analytic(node),
        })
    }
}

/// Deepest nesting of shapes in shapes: each level takes stack to evaluate.
const MAX_DEPTH: usize = 64;

/// Largest `.sdf.toml` that is read, in bytes. Hand-written files have a few hundred.
const MAX_TOML_BYTES: u64 = 16 << 20;

/// Reads a baked grid, a blob or shapes in closed form. The content decides: HDF5 and blobs have a signature, everything else must
/// be TOML.
pub fn read(path: &Path) -> Result<Field, FieldError> {
    open(path)?.read()
}

/// Like [`read`], from the bytes of a file. Errors show `name` in place of a path. TOML is read as by [`read_text`].
pub fn read_bytes(bytes: &[u8], name: &str) -> Result<Field, FieldError> {
    open_bytes(bytes, name)?.read()
}

/// Like [`read`], but leaves it to the caller which samples of a grid are read. Grids named in TOML are read whole, but for one that stands
/// there alone, without a pose: that is the grid's own file by another name, with all that is known of the grid.
pub fn open(path: &Path) -> Result<OpenField<'static>, FieldError> {
    let unreadable = |source| FieldError::Unreadable { path: path.to_owned(), source };
    // What is read of a pipe to know its kind would be lost.
    if is_pipe(path) {
        return Err(unreadable(io::Error::new(io::ErrorKind::InvalidInput, "not a regular file: read its bytes")));
    }
    let start = start(path).map_err(unreadable)?;
    if start == SIGNATURE {
        return Ok(OpenField::Grid(grid_file::open(path)?));
    }
    if is_blob(&start) {
        return blob(&fs::read(path).map_err(unreadable)?, path);
    }
    // A device reports no length and never ends.
    let mut bytes = Vec::new();
    fs::File::open(path).and_then(|file| file.take(MAX_TOML_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    let folder = path.parent().unwrap_or(Path::new("."));
    if let Some(grid) = lone_grid(&bytes).map(|name| folder.join(name)).filter(|path| has_signature(path)) {
        return open(&grid);
    }
    parse_bytes(&bytes, path, &mut Grids::new(Some(folder))).map(OpenField::Analytic)
}

/// The file of the grid that is all of a field in TOML.
fn lone_grid(bytes: &[u8]) -> Option<String> {
    let text = std::str::from_utf8(bytes).ok().filter(|text| text.len() as u64 <= MAX_TOML_BYTES)?;
    let mut document: toml::Table = text.parse().ok()?;
    let Some(toml::Value::Table(mut field)) = document.remove("field") else { return None };
    let is_grid = field.remove("shape").is_some_and(|shape| shape.as_str() == Some("grid"));
    let Some(toml::Value::String(name)) = field.remove("file") else { return None };
    (is_grid && field.is_empty() && document.is_empty()).then_some(name)
}

/// Is it there, and no file, folder or device? A device has an error of its own, or enough bytes.
#[cfg(unix)]
fn is_pipe(path: &Path) -> bool {
    use std::os::unix::fs::FileTypeExt;
    let kind = fs::metadata(path).map(|there| there.file_type());
    kind.is_ok_and(|kind| kind.is_fifo() || kind.is_socket())
}

/// Is it there, and no file, folder or device?
#[cfg(not(unix))]
fn is_pipe(_: &Path) -> bool {
    false
}

/// Like [`open`], from the bytes of a file, lent (`&[u8]`) or owned (`Vec<u8>`). Errors show `name` in place of a path.
pub fn open_bytes<'a>(bytes: impl Into<Cow<'a, [u8]>>, name: &str) -> Result<OpenField<'a>, FieldError> {
    let bytes = bytes.into();
    if bytes.starts_with(SIGNATURE) {
        return Ok(OpenField::Grid(grid_file::open_bytes(bytes, name)?));
    }
    if is_blob(&bytes) {
        return blob(&bytes, Path::new(name));
    }
    parse_bytes(&bytes, Path::new(name), &mut Grids::new(None)).map(OpenField::Analytic)
}

fn blob(bytes: &[u8], path: &Path) -> Result<OpenField<'static>, FieldError> {
    blob_file::read(bytes).map(OpenField::Blob).map_err(|error| refused(path, error.to_string()))
}

/// Reads shapes in closed form from the text of a `.sdf.toml`. Errors show `name` in place of a path. A text has no
/// folder to look for files in, so the shape `grid` is refused.
pub fn read_text(text: &str, name: &str) -> Result<AnyField, FieldError> {
    parse(text, Path::new(name), &mut Grids::new(None))
}

/// The text of a `.sdf.toml` that [`read_text`] reads as the same field, bit for bit. Grids are refused, and more than 64
/// shapes in each other. Errors show `name` in place of a path.
pub fn to_text(field: &AnyField, name: &str) -> Result<String, FieldError> {
    write::to_text(field, Path::new(name))
}

/// Writes [`to_text`] to a file: whole, or not at all.
pub fn write(path: &Path, field: &AnyField) -> Result<(), FieldError> {
    let text = write::to_text(field, path)?;
    let unwritable = |source| FieldError::Unwritable { path: path.to_owned(), source };
    atomic_write(path, |temporary| fs::write(temporary, text)).map_err(unwritable)
}

/// `true` for a regular file that is a field and not a mesh: HDF5 and blobs by their content, TOML by its name.
pub fn is_field(path: &Path) -> bool {
    let is_toml = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    is_toml || has_signature(path)
}

/// Files that TOML names under a key `file`, as shapes do with grids, nested ones too, and those that TOML among them names. Empty for what
/// is not TOML.
pub fn files_named_in(path: &Path) -> Vec<PathBuf> {
    let mut files = files_named_by(path);
    let by_them: Vec<PathBuf> = files.iter().flat_map(|file| files_named_by(file)).collect();
    files.extend(by_them);
    files
}

fn files_named_by(path: &Path) -> Vec<PathBuf> {
    let is_short = fs::metadata(path).is_ok_and(|file| file.is_file() && file.len() <= MAX_TOML_BYTES);
    let is_toml = is_short && fs::File::open(path).is_ok_and(|file| begins_as_toml(BufReader::new(file)));
    let text = if is_toml { fs::read_to_string(path).unwrap_or_default() } else { String::new() };
    let folder = path.parent().unwrap_or(Path::new("."));
    let mut files = vec![];
    let mut rest: Vec<toml::Value> = text.parse().map(toml::Value::Table).into_iter().collect();
    while let Some(value) = rest.pop() {
        match value {
            toml::Value::Table(mut table) => {
                if let Some(toml::Value::String(name)) = table.remove("file") {
                    files.push(folder.join(name));
                }
                rest.extend(table.into_iter().map(|(_, value)| value));
            }
            toml::Value::Array(values) => rest.extend(values),
            _ => {}
        }
    }
    files
}

/// Is the first line that says something a table's or a key's? No mesh begins so, and to parse a large one as TOML takes much memory.
fn begins_as_toml(text: impl BufRead) -> bool {
    let says_something = |line: &String| !line.trim().is_empty() && !line.trim_start().starts_with('#');
    let first = text.lines().map_while(Result::ok).find(says_something);
    first.is_some_and(|line| line.trim_start().starts_with('[') || line.contains('='))
}

/// Does the file begin as HDF5 or as a blob?
fn has_signature(path: &Path) -> bool {
    path.is_file() && start(path).is_ok_and(|start| start == SIGNATURE || is_blob(&start))
}

/// The first bytes of a file, which may be a signature.
fn start(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut start = Vec::new();
    fs::File::open(path)?.take(SIGNATURE.len() as u64).read_to_end(&mut start)?;
    Ok(start)
}

fn parse_bytes(bytes: &[u8], path: &Path, grids: &mut Grids) -> Result<AnyField, FieldError> {
    let not_a_field =
        |what: &str| refused(path, format!("{what}; give a baked grid (.sdf.h5) or shapes in TOML (.sdf.toml)"));
    if bytes.is_empty() {
        return Err(not_a_field("an empty file"));
    }
    let text = std::str::from_utf8(bytes).map_err(|_| not_a_field("neither HDF5 nor TOML"))?;
    if text.len() as u64 > MAX_TOML_BYTES {
        return Err(not_a_field(&format!("not HDF5, and larger than the {MAX_TOML_BYTES} bytes that TOML may have")));
    }
    parse(text, path, grids)
}

fn parse(text: &str, path: &Path, grids: &mut Grids) -> Result<AnyField, FieldError> {
    let document: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        let location = line.map(|line| format!(" from line {line} on")).unwrap_or_default();
        let reason = error.message().lines().next().unwrap_or("cannot be parsed");
        refused(path, format!("not TOML{location}: {reason}"))
    })?;
    let mut root = Table::new(path, String::new(), &document);
    let field = root.table("field")?;
    root.finish()?;
    shapes::node(field, grids, MAX_DEPTH)
}

fn refused(path: &Path, what: String) -> FieldError {
    FieldError::Refused { path: path.to_owned(), table: String::new(), what }
}

/// Grids named by one file, each read once however often it is named.
struct Grids<'a> {
    /// Folder that names are relative to; `None` if the field is not read from a file.
    folder: Option<&'a Path>,
    grids: HashMap<PathBuf, Arc<OwnedGrid>>,
}

impl<'a> Grids<'a> {
    fn new(folder: Option<&'a Path>) -> Self {
        Self { folder, grids: HashMap::new() }
    }

    /// The grid of a file; the error is its description.
    fn read(&mut self, name: &str) -> Result<Arc<OwnedGrid>, String> {
        let Some(folder) = self.folder else {
            return Err(format!("file {name:.40?}: only a field that is read from a file can name a grid"));
        };
        let path = folder.join(name);
        let unreadable = |source: std::io::Error| format!("{}: {source}", path.display());
        Ok(match self.grids.entry(fs::canonicalize(&path).map_err(unreadable)?) {
            Entry::Occupied(known) => known.get().clone(),
            Entry::Vacant(new) => {
                let grid = match path.is_file() && is_blob(&start(&path).map_err(unreadable)?) {
                    true => {
                        let blob = blob_file::read(&fs::read(&path).map_err(unreadable)?);
                        blob.map_err(|error| format!("{}: {error}", path.display()))?.grid
                    }
                    false => grid_file::read(&path).map_err(|error| error.to_string())?.grid,
                };
                new.insert(Arc::new(grid)).clone()
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::begins_as_toml;

    #[test]
    fn a_field_begins_as_toml_and_a_mesh_does_not() {
        for field in
            ["# a post\n\n[field]\nshape = 'sphere'\n", "field = { shape = 'sphere' }", "  field.shape = 'sphere'"]
        {
            assert!(begins_as_toml(field.as_bytes()), "{field}");
        }
        for mesh in ["", "# a mesh\nv 0 0 0\n", "ply\nformat ascii 1.0\n", "OFF\n", "solid\n", "\u{0}\u{0}\n"] {
            assert!(!begins_as_toml(mesh.as_bytes()), "{mesh}");
        }
    }
}
