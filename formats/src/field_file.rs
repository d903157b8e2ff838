//! Fields as a program is given them: a baked grid (`.sdf.h5`) or shapes in closed form (`.sdf.toml`).

mod error;
mod node;
mod shapes;
mod table;

use std::fs;
use std::path::Path;

use sdf_core::grid::{Dense, Grid};

pub use error::FieldError;
pub use node::Node;

use crate::grid_file;
use table::Table;

/// A grid that holds its samples.
pub type OwnedGrid = Grid<Dense<Vec<f32>>>;

/// What a field file holds.
#[derive(Clone, Debug)]
pub enum Field {
    Grid { grid: OwnedGrid, about: grid_file::About },
    Analytic(Node),
}

/// What a field file says of itself.
#[derive(Clone, Debug)]
pub enum FieldSummary {
    Grid(grid_file::Summary),
    Analytic(Node),
}

/// Shapes within shapes, one in another, deeper than this are refused: each takes stack to evaluate.
const MOST_NESTED: usize = 64;

/// The largest `.sdf.toml` that is read. Hand-written ones have a few hundred bytes.
const MOST_TOML_BYTES: u64 = 16 << 20;

/// Reads a baked grid or an analytic field, by content: HDF5 has a signature, all else is taken for TOML.
pub fn read(path: &Path) -> Result<Field, FieldError> {
    let unreadable = |source| FieldError::Unreadable { path: path.to_owned(), source };
    if starts_with_hdf5_signature(path).map_err(unreadable)? {
        let (grid, about) = read_grid(path)?;
        return Ok(Field::Grid { grid, about });
    }
    read_toml(path, MOST_NESTED).map(Field::Analytic)
}

/// What a field file holds, without the samples of a grid.
pub fn read_summary(path: &Path) -> Result<FieldSummary, FieldError> {
    let unreadable = |source| FieldError::Unreadable { path: path.to_owned(), source };
    if starts_with_hdf5_signature(path).map_err(unreadable)? {
        return Ok(FieldSummary::Grid(grid_file::read_summary(path)?));
    }
    read_toml(path, MOST_NESTED).map(FieldSummary::Analytic)
}

fn starts_with_hdf5_signature(path: &Path) -> std::io::Result<bool> {
    use std::io::Read;
    let mut start = Vec::new();
    fs::File::open(path)?.take(8).read_to_end(&mut start)?;
    Ok(start == b"\x89HDF\r\n\x1a\n")
}

fn read_grid(path: &Path) -> Result<(OwnedGrid, grid_file::About), FieldError> {
    let file = grid_file::read(path)?;
    let storage = Dense::new(&file.lattice, file.distances);
    let grid = storage.and_then(|storage| Grid::new(file.lattice, storage, file.about.slope_bound));
    // The reader has checked both the count and the bound.
    grid.map(|grid| (grid, file.about)).ok_or_else(|| FieldError::Refused {
        path: path.to_owned(),
        place: String::new(),
        what: "the grid's samples do not fit its lattice".to_owned(),
    })
}

fn read_toml(path: &Path, may_nest: usize) -> Result<Node, FieldError> {
    let unreadable = |source| FieldError::Unreadable { path: path.to_owned(), source };
    let refused = |what: String| FieldError::Refused { path: path.to_owned(), place: String::new(), what };
    if fs::metadata(path).map_err(unreadable)?.len() > MOST_TOML_BYTES {
        return Err(refused(format!("is larger than the {MOST_TOML_BYTES} bytes that a .sdf.toml may have")));
    }
    let bytes = fs::read(path).map_err(unreadable)?;
    let not_a_field = || refused("is neither a baked grid (HDF5) nor a field in TOML".to_owned());
    let text = std::str::from_utf8(&bytes).map_err(|_| not_a_field())?;
    let document: toml::Table = text.parse().map_err(|error: toml::de::Error| {
        let line = error.span().map(|span| text[..span.start.min(text.len())].matches('\n').count() + 1);
        let place = line.map(|line| format!("line {line}: ")).unwrap_or_default();
        refused(format!("{place}{}", error.message().lines().next().unwrap_or("is not TOML")))
    })?;
    let mut root = Table::new(path, String::new(), &document);
    let field = root.table("field")?;
    root.finish()?;
    shapes::node(field, may_nest)
}
