use std::path::Path;

use sdf_bake::{DenseGrid, SparseGrid};
use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK, Code, Sparse};
use sdf_formats::grid_file::{self, About, GridFileError, Samples, SparseSamples};

/// A grid of either layout and any precision, fresh from the baker.
pub enum BakedGrid {
    Dense(DenseGrid),
    F32(SparseGrid<f32>),
    U16(SparseGrid<u16>),
    U8(SparseGrid<u8>),
}

/// Asks the same of whatever grid it is.
macro_rules! of_each {
    ($grid:expr, $dense:ident => $of_dense:expr, $sparse:ident => $of_sparse:expr) => {
        match $grid {
            BakedGrid::Dense($dense) => $of_dense,
            BakedGrid::F32($sparse) => $of_sparse,
            BakedGrid::U16($sparse) => $of_sparse,
            BakedGrid::U8($sparse) => $of_sparse,
        }
    };
}

impl BakedGrid {
    pub fn slope_bound(&self) -> f64 {
        of_each!(self, dense => dense.slope_bound, sparse => sparse.slope_bound)
    }

    pub fn error_bound(&self) -> f64 {
        of_each!(self, dense => dense.error_bound, sparse => sparse.error_bound)
    }

    /// Of a sparse grid what half of the bricks stay within.
    pub fn median_error(&self) -> Option<f64> {
        of_each!(self, _dense => None, sparse => {
            let mut errors = sparse.errors.clone();
            errors.sort_unstable_by(f32::total_cmp);
            errors.get(errors.len() / 2).copied().map(f64::from)
        })
    }

    pub fn layout(&self) -> &'static str {
        of_each!(self, _dense => "dense", _sparse => "sparse")
    }

    pub fn precision(&self) -> &'static str {
        match self {
            Self::Dense(_) | Self::F32(_) => "f32",
            Self::U16(_) => "u16",
            Self::U8(_) => "u8",
        }
    }

    pub fn bricks(&self) -> Option<usize> {
        of_each!(self, _dense => None, sparse => Some(sparse.places.len()))
    }

    /// Nodes that have a sample, and cells with all corners among them.
    pub fn stored(&self, lattice: &Lattice) -> [usize; 2] {
        let cells = lattice.cells();
        let in_all = cells.iter().fold(1, |count: usize, n| count * *n as usize);
        of_each!(self, _dense => [lattice.node_count(), in_all], sparse => stored_in_bricks(sparse, lattice))
    }

    /// `band` is that of a sparse grid.
    pub fn write(&self, path: &Path, lattice: &Lattice, band: f64, about: &About) -> Result<(), GridFileError> {
        of_each!(
            self,
            dense => {
                let samples = Samples::Dense { distances: &dense.distances, bounds: &dense.bounds };
                grid_file::write(path, lattice, samples, about)
            },
            sparse => grid_file::write(path, lattice, lent(sparse, band), about)
        )
    }
}

fn lent<C: Code>(grid: &SparseGrid<C>, band: f64) -> SparseSamples<'_, C> {
    let SparseGrid { places, scales, samples, bounds, errors, coarse, .. } = grid;
    SparseSamples { band, places, scales, samples, bounds, errors, coarse }
}

/// A brick's cells are those whose first corner it holds. Their other corners are in the same brick or in the next ones.
fn stored_in_bricks<C: Code>(grid: &SparseGrid<C>, lattice: &Lattice) -> [usize; 2] {
    let nodes = lattice.nodes();
    let Some(storage) = Sparse::new(lattice, grid) else { unreachable!("the baker's table fits its lattice") };
    let is_there = |place| storage.brick_at(place).is_some();
    let mut stored = [0, 0];
    for place in &grid.places {
        let along: [u32; 3] = std::array::from_fn(|axis| (nodes[axis] - place[axis] * BRICK).min(BRICK));
        stored[0] += along.iter().map(|n| *n as usize).product::<usize>();
        for next in 0..8_u32 {
            let step: [u32; 3] = std::array::from_fn(|axis| next >> axis & 1);
            if is_there(std::array::from_fn(|axis| place[axis] + step[axis])) {
                // Of the cells that reach into the next brick along some axes: one layer; along the others all but that.
                let cells = |axis: usize| if step[axis] == 1 { 1 } else { along[axis] as usize - 1 };
                stored[1] += cells(0) * cells(1) * cells(2);
            }
        }
    }
    stored
}
