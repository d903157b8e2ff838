//! Fields as a program is given them: a baked grid (`.sdf.h5`) or shapes in closed form (`.sdf.toml`).

mod error;
mod shapes;
mod table;

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use error::FieldError;

use sdf_core::AnyField;
use sdf_core::grid::owned::OwnedGrid;

use crate::grid_file::{self, GridReader, StoredGrid};
use table::Table;

/// What a field file holds.
#[derive(Clone, Debug)]
#[expect(clippy::large_enum_variant, reason = "a program has one or two")]
pub enum Field {
    Grid(StoredGrid),
    Analytic(AnyField),
}

/// What a field file holds, of a grid not yet the samples.
#[expect(clippy::large_enum_variant, reason = "a program has one or two")]
pub enum OpenField {
    Grid(GridReader),
    Analytic(AnyField),
}

/// Shapes within shapes, one in another, deeper than this are refused: each takes stack to evaluate.
const MAX_NESTED: usize = 64;

/// The largest `.sdf.toml` that is read. Hand-written ones have a few hundred bytes.
const MAX_TOML_BYTES: u64 = 16 << 20;

/// Reads a baked grid or an analytic field, by content: HDF5 has a signature, all else is taken for TOML.
pub fn read(path: &Path) -> Result<Field, FieldError> {
    Ok(match open(path)? {
        OpenField::Grid(reader) => Field::Grid(reader.read()?),
        OpenField::Analytic(node) => Field::Analytic(node),
    })
}

/// Like [`read`], but leaves the samples of a grid, or those of them that are needed, for its reader to read. Grids that an
/// analytic field names are read whole.
pub fn open(path: &Path) -> Result<OpenField, FieldError> {
    let unreadable = |source| FieldError::Unreadable { path: path.to_owned(), source };
    if starts_with_hdf5_signature(path).map_err(unreadable)? {
        return Ok(OpenField::Grid(grid_file::open(path)?));
    }
    read_toml(path, MAX_NESTED).map(OpenField::Analytic)
}

/// Whether a regular file says that it is a field and no mesh: HDF5 by its content, TOML by its name.
pub fn is_field(path: &Path) -> bool {
    let is_toml = path.extension().is_some_and(|end| end.eq_ignore_ascii_case("toml"));
    is_toml || (path.is_file() && starts_with_hdf5_signature(path).unwrap_or(false))
}

fn starts_with_hdf5_signature(path: &Path) -> std::io::Result<bool> {
    let mut start = Vec::new();
    fs::File::open(path)?.take(8).read_to_end(&mut start)?;
    Ok(start == b"\x89HDF\r\n\x1a\n")
}

fn read_toml(path: &Path, may_nest: usize) -> Result<AnyField, FieldError> {
    let unreadable = |source| FieldError::Unreadable { path: path.to_owned(), source };
    let refused = |what: String| FieldError::Refused { path: path.to_owned(), place: String::new(), what };
    let not_a_field =
        |what: &str| refused(format!("{what}; give a baked grid (.sdf.h5) or shapes in TOML (.sdf.toml)"));
    // A device says that it has no bytes and goes on for ever.
    let mut bytes = Vec::new();
    fs::File::open(path).and_then(|file| file.take(MAX_TOML_BYTES + 1).read_to_end(&mut bytes)).map_err(unreadable)?;
    if bytes.is_empty() {
        return Err(not_a_field("an empty file"));
    }
    let text = std::str::from_utf8(&bytes).map_err(|_| not_a_field("neither HDF5 nor TOML"))?;
    if text.len() as u64 > MAX_TOML_BYTES {
        return Err(not_a_field(&format!("not HDF5, and larger than the {MAX_TOML_BYTES} bytes that TOML may have")));
    }
    parse(text, path, may_nest)
}

/// Reads shapes in closed form from the text of a `.sdf.toml`. `path` is where it comes from: messages name it, and grids are
/// looked for beside it.
pub fn read_text(text: &str, path: &Path) -> Result<AnyField, FieldError> {
    parse(text, path, MAX_NESTED)
}

fn parse(text: &str, path: &Path, may_nest: usize) -> Result<AnyField, FieldError> {
    let refused = |what: String| FieldError::Refused { path: path.to_owned(), place: String::new(), what };
    let document: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        let place = line.map(|line| format!(" from line {line} on")).unwrap_or_default();
        refused(format!("not TOML{place}: {}", error.message().lines().next().unwrap_or("cannot be parsed")))
    })?;
    let mut root = Table::new(path, String::new(), &document);
    let field = root.table("field")?;
    root.finish()?;
    shapes::node(field, &mut Grids::default(), may_nest)
}

/// The grids that one file names, each read once however often it is named: so many hold no more than their files.
#[derive(Default)]
struct Grids(HashMap<PathBuf, Arc<OwnedGrid>>);

impl Grids {
    fn read(&mut self, path: &Path) -> Result<Arc<OwnedGrid>, FieldError> {
        let unreadable = |source| FieldError::Unreadable { path: path.to_owned(), source };
        Ok(match self.0.entry(fs::canonicalize(path).map_err(unreadable)?) {
            Entry::Occupied(known) => known.get().clone(),
            Entry::Vacant(new) => new.insert(Arc::new(grid_file::read(path)?.grid)).clone(),
        })
    }
}
