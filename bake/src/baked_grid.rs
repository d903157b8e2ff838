//! Baked grids as the core holds them, of any layout and precision.

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{OwnedBricks, OwnedCode, OwnedGrid, OwnedStorage, Precision};
use sdf_core::grid::sparse::{DEEP_ERROR, brick_counts};

use crate::sparse::{Quantize, SignJumps, SparseBaker};
use crate::{DenseGrid, SparseGrid};

/// A baked grid and its certified error.
#[derive(Clone, Debug, PartialEq)]
pub struct BakedGrid {
    /// The grid, in the core's own type.
    pub grid: OwnedGrid,
    /// See [`DenseGrid::error_bound`] and [`SparseGrid::error_bound`].
    pub error_bound: f64,
    /// See [`SparseGrid::jumps`]; `None` of dense grids.
    pub jumps: Option<SignJumps>,
}

/// The baker's counts and tables fit its own lattice, and its slope bound is finite.
pub(crate) const FITS: &str = "a baked grid fits the lattice that it was baked on";

impl DenseGrid {
    /// The grid on the lattice that it was baked on.
    ///
    /// # Panics
    ///
    /// On another lattice.
    pub fn into_grid(self, lattice: &Lattice) -> BakedGrid {
        let storage = OwnedStorage::dense(lattice, self.distances, self.bounds).expect(FITS);
        let grid = OwnedGrid::new(*lattice, storage, self.slope_bound).expect(FITS).with_error_bound(self.error_bound);
        let grid = grid.with_inside_at_box(self.inside_reaches_box);
        BakedGrid { grid, error_bound: self.error_bound, jumps: None }
    }
}

impl<C: OwnedCode> SparseGrid<C> {
    /// The grid on the lattice and with the band that it was baked with.
    ///
    /// # Panics
    ///
    /// On another lattice.
    pub fn into_grid(self, lattice: &Lattice, band: f64) -> BakedGrid {
        let Self { slots, scales, samples, bounds, errors, coarse, slope_bound, error_bound, jumps, .. } = self;
        let counts = brick_counts(lattice);
        let table = OwnedBricks::<C>::table_of(counts, &slots).expect(FITS);
        let coarse = OwnedBricks::<C>::coarse_of(counts, &coarse).expect(FITS);
        let bricks = OwnedBricks { table, slots, scales, samples, bounds, errors, coarse };
        let storage = OwnedStorage::sparse(lattice, bricks).expect(FITS);
        let grid = OwnedGrid::new(*lattice, storage, slope_bound).expect(FITS);
        let grid = grid.with_band(band).with_error_bound(error_bound).with_deep_error(DEEP_ERROR * lattice.spacing());
        let grid = grid.with_inside_at_box(self.inside_reaches_box);
        BakedGrid { grid, error_bound, jumps }
    }
}

impl SparseBaker<'_> {
    /// [`max_bytes`](Self::max_bytes) of a precision known only at run time.
    pub fn max_bytes_as(&self, precision: Precision) -> usize {
        match precision {
            Precision::F32 => self.max_bytes::<f32>(),
            Precision::U16 => self.max_bytes::<u16>(),
            Precision::U8 => self.max_bytes::<u8>(),
        }
    }

    /// [`max_streamed_bytes`](Self::max_streamed_bytes) of a precision known only at run time.
    pub fn max_streamed_bytes_as(&self, precision: Precision, slots_at_a_time: usize) -> usize {
        match precision {
            Precision::F32 => self.max_streamed_bytes::<f32>(slots_at_a_time),
            Precision::U16 => self.max_streamed_bytes::<u16>(slots_at_a_time),
            Precision::U8 => self.max_streamed_bytes::<u8>(slots_at_a_time),
        }
    }

    /// [`bake`](Self::bake) in a precision known only at run time.
    pub fn bake_as(&self, precision: Precision, on_slots_done: &(dyn Fn(usize) + Sync)) -> BakedGrid {
        match precision {
            Precision::F32 => self.bake_into::<f32>(on_slots_done),
            Precision::U16 => self.bake_into::<u16>(on_slots_done),
            Precision::U8 => self.bake_into::<u8>(on_slots_done),
        }
    }

    fn bake_into<C: Quantize + OwnedCode>(&self, on_slots_done: &(dyn Fn(usize) + Sync)) -> BakedGrid {
        self.bake::<C>(on_slots_done).into_grid(self.lattice(), self.band())
    }
}
