use sdf_core::grid::sparse::Scale;
use sdf_formats::grid_file::{Layout, OwnedBricks, OwnedSamples, Part, ReadCount, StoredGrid};
use serde::Serialize;

/// What was read of a grid's file.
#[derive(Clone, Copy, Serialize)]
pub struct FromFile {
    file_bytes: u64,
    bytes: u64,
    #[serde(flatten)]
    blocks: Blocks,
}

#[derive(Clone, Copy, Serialize)]
#[serde(untagged)]
enum Blocks {
    Sparse { bricks: usize, of_bricks: usize },
    Dense { chunks: usize, of_chunks: usize },
}

impl FromFile {
    pub fn of(stored: &StoredGrid, file_bytes: u64) -> Self {
        let ReadCount { bytes, blocks, total_blocks } = stored.read;
        let blocks = match stored.layout {
            Layout::Sparse { .. } => Blocks::Sparse { bricks: blocks, of_bricks: total_blocks },
            Layout::Dense => Blocks::Dense { chunks: blocks, of_chunks: total_blocks },
        };
        Self { file_bytes, bytes, blocks }
    }

    pub fn in_words(&self) -> String {
        let blocks = match self.blocks {
            Blocks::Sparse { bricks, of_bricks } => format!("{bricks} of {of_bricks} bricks"),
            Blocks::Dense { chunks, of_chunks } => format!("{chunks} of {of_chunks} chunks"),
        };
        format!("{blocks}, {} of {} bytes", self.bytes, self.file_bytes)
    }
}

/// How far from the surface a sparse grid has distances.
pub fn band(layout: &Layout) -> Option<f64> {
    match layout {
        Layout::Dense => None,
        Layout::Sparse { band, .. } => Some(*band),
    }
}

/// What a sparse grid says of its bricks.
pub struct BrickList<'a> {
    /// Counted in bricks from the first node.
    pub places: &'a [[u32; 3]],
    pub scales: &'a [Scale],
    /// Certified, of the cells whose first corner is in the brick.
    pub errors: &'a [f32],
}

/// `None` of a dense grid.
pub fn bricks(samples: &OwnedSamples) -> Option<BrickList<'_>> {
    fn list<C>(bricks: &OwnedBricks<C>) -> Option<BrickList<'_>> {
        Some(BrickList { places: &bricks.places, scales: &bricks.scales, errors: &bricks.errors })
    }
    match samples {
        OwnedSamples::Dense(_) => None,
        OwnedSamples::SparseF32(sparse) => list(sparse.bricks()),
        OwnedSamples::SparseU16(sparse) => list(sparse.bricks()),
        OwnedSamples::SparseU8(sparse) => list(sparse.bricks()),
    }
}

/// The number of the brick at a place, counted in bricks from the first node. `None` of a dense grid.
pub fn brick_at(samples: &OwnedSamples, place: [u32; 3]) -> Option<usize> {
    match samples {
        OwnedSamples::Dense(_) => None,
        OwnedSamples::SparseF32(sparse) => sparse.brick_at(place),
        OwnedSamples::SparseU16(sparse) => sparse.brick_at(place),
        OwnedSamples::SparseU8(sparse) => sparse.brick_at(place),
    }
}

/// How many bytes each part of a file takes, by name.
pub fn bytes_of(parts: &[Part]) -> serde_json::Map<String, serde_json::Value> {
    parts.iter().map(|part| (part.name.to_owned(), part.stored_bytes.into())).collect()
}
