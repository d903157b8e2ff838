//! Baked grids as the core holds them.

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{OwnedBricks, OwnedCode, OwnedGrid, OwnedStorage};

use crate::{DenseGrid, SparseGrid};

/// The baker's counts and tables fit its own lattice, and its slope bound is finite.
const FITS: &str = "a baked grid fits the lattice that it was baked on";

impl DenseGrid {
    /// The grid on the lattice that it was baked on.
    ///
    /// # Panics
    ///
    /// On another lattice.
    pub fn into_grid(self, lattice: &Lattice) -> OwnedGrid {
        let storage = OwnedStorage::dense(lattice, self.distances, self.bounds).expect(FITS);
        OwnedGrid::new(*lattice, storage, self.slope_bound).expect(FITS)
    }
}

impl<C: OwnedCode> SparseGrid<C> {
    /// The grid on the lattice that it was baked on.
    ///
    /// # Panics
    ///
    /// On another lattice.
    pub fn into_grid(self, lattice: &Lattice) -> OwnedGrid {
        let Self { table, places: slots, scales, samples, bounds, errors, coarse, slope_bound, .. } = self;
        let bricks = OwnedBricks { table, slots, scales, samples, bounds, errors, coarse };
        let storage = OwnedStorage::sparse(lattice, bricks).expect(FITS);
        OwnedGrid::new(*lattice, storage, slope_bound).expect(FITS)
    }
}
