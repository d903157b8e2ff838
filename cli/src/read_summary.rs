//! How much of a grid file was read, and does the grid have distances up to a margin?

use std::path::Path;

use anyhow::{Result, bail};
use sdf_core::grid::owned::Precision;
use sdf_formats::grid_file::{Part, ReadCount, StoredGrid, Summary};
use serde::Serialize;

use crate::report::{many, number};

/// The amount of a grid file that was read.
#[derive(Clone, Copy, Serialize)]
pub struct ReadSummary {
    file_bytes: u64,
    bytes: u64,
    #[serde(flatten)]
    blocks: Blocks,
}

#[derive(Clone, Copy, Serialize)]
#[serde(untagged)]
enum Blocks {
    Sparse { bricks: usize, of_bricks: usize },
    DenseCodes { blocks: usize, of_blocks: usize },
    Dense { chunks: usize, of_chunks: usize },
}

impl ReadSummary {
    pub fn new(stored: &StoredGrid, file_bytes: u64) -> Self {
        let ReadCount { bytes, blocks, total_blocks } = stored.read;
        let blocks = match (stored.sparse, stored.grid.storage().precision()) {
            (Some(_), _) => Blocks::Sparse { bricks: blocks, of_bricks: total_blocks },
            (None, Precision::U16 | Precision::U8) => Blocks::DenseCodes { blocks, of_blocks: total_blocks },
            (None, Precision::F32) => Blocks::Dense { chunks: blocks, of_chunks: total_blocks },
        };
        // What is read a second time, such as a header, does not make it more than the file.
        Self { file_bytes, bytes: bytes.min(file_bytes), blocks }
    }

    pub fn in_words(&self) -> String {
        let blocks = match self.blocks {
            Blocks::Sparse { bricks, of_bricks } => format!("{bricks} of {of_bricks} bricks"),
            Blocks::DenseCodes { blocks, of_blocks } => format!("{blocks} of {of_blocks} blocks"),
            Blocks::Dense { chunks, of_chunks } => format!("{chunks} of {of_chunks} chunks"),
        };
        format!("{blocks}, {} of {} bytes", self.bytes, self.file_bytes)
    }
}

/// Largest `--padding` or `--band`, in cells, that a message advises: wider grids are hardly ever what is wanted.
const MAX_ADVISED_CELLS: f64 = 4096.0;

/// Relative rounding of distances in f64: more than a cull allows for, as a fraction of the largest coordinate.
pub const ROUNDING: f64 = 1e-12;

/// Refuses a margin beyond which a grid has only lower bounds of the distance: it would report false contacts. Refuses one deeper than
/// a sparse grid's band, where it would leave contacts out.
pub fn require_distances(file: &Path, margin: f64, grid: &Summary) -> Result<()> {
    let spacing = grid.lattice.spacing();
    let band = grid.sparse.map(|sparse| sparse.band);
    let padding = (margin > 0.0).then_some(grid.about.padding);
    for (option, limit) in [("--padding", padding), ("--band", band)] {
        if let Some(limit) = limit.filter(|limit| margin.abs() > limit * (1.0 + ROUNDING)) {
            let (beyond, remedy) = match margin > 0.0 {
                true => ("more", "use a smaller --margin"),
                false => ("deeper", "find contacts of a mesh by `contacts` with --complete or --exact"),
            };
            let cells = (margin.abs() / spacing).ceil();
            let bake = match cells <= MAX_ADVISED_CELLS {
                true => format!("bake it with {option} {} or more, or ", many(cells)),
                false => String::new(),
            };
            bail!(
                "{}: --margin {} is {beyond} than the {} around the surface in which the grid has distances: {bake}{remedy}",
                file.display(),
                number(margin),
                number(limit)
            );
        }
    }
    Ok(())
}

/// Stored bytes of each part of a file, by name.
pub fn bytes_of(parts: &[Part]) -> serde_json::Map<String, serde_json::Value> {
    parts.iter().map(|part| (part.name.to_owned(), part.stored_bytes.into())).collect()
}
