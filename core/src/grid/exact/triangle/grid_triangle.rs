//! A triangle in cell coordinates, with what every step needs of it: box, normal, separating planes, range of cells.

use nalgebra::Vector3;

use crate::grid::Lattice;
use crate::grid::node_box::{ROOM, SPILL};
use crate::number::{Float, Real};
use crate::rounding::CELL_COORDINATE;

/// Most cells in a triangle's box. A larger triangle is better searched in parts, most of which are culled at once.
pub(super) const MAX_CELLS: u32 = if cfg!(feature = "std") { 512 } else { MAX_ENTRIES };

/// Most nodes in a triangle's box, and entries in a [`DescentTable`](super::descent_table::DescentTable).
pub(super) const MAX_ENTRIES: u32 = (ROOM - SPILL) as u32;

/// A triangle in cell coordinates.
pub(super) struct GridTriangle<R: Real> {
    pub corners: [Vector3<R>; 3],
    /// (b − a) × (c − a).
    pub normal: Vector3<R>,
    /// Lower corner of its box, rounding included.
    pub lower: Vector3<R>,
    /// Upper corner of its box, rounding included.
    pub upper: Vector3<R>,
    /// First cell of its box along each axis.
    pub first_cell: [u32; 3],
    /// Last cell of its box along each axis.
    pub last_cell: [u32; 3],
    /// Bound of the rounding of a coordinate.
    pub rounding: R,
}

impl<R: Float> GridTriangle<R> {
    /// `None` if its box holds more than [`MAX_CELLS`] cells.
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new(lattice: &Lattice, corners: [Vector3<R>; 3]) -> Option<Self> {
        let bounds = lattice.bounds();
        let largest = bounds.min.iter().chain(&bounds.max).fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let rounding = R::from_f64(CELL_COORDINATE * R::EPSILON * largest * lattice.inv_spacing());
        let [a, b, c] = corners;
        let lower = a.zip_zip_map(&b, &c, |a, b, c| Real::min(a, Real::min(b, c)) - rounding);
        let upper = a.zip_zip_map(&b, &c, |a, b, c| Real::max(a, Real::max(b, c)) + rounding);
        let last = lattice.cells().map(|cells| cells.wrapping_sub(1));
        // Coordinates below zero, by rounding, belong to the first cell.
        let cell = |point: Vector3<R>| -> [u32; 3] {
            let cell = point.map(|x| Real::max(x, R::zero()).trunc().to_f64() as u32);
            [cell.x.min(last[0]), cell.y.min(last[1]), cell.z.min(last[2])]
        };
        let (first_cell, last_cell) = (cell(lower), cell(upper));
        let cells = |k: usize| last_cell[k % 3].checked_sub(first_cell[k % 3])?.checked_add(1);
        // In single precision as many as small processors have memory for, so that answers are the same everywhere.
        let most_entries = if R::EPSILON > 1e-10 { MAX_ENTRIES.min(248) } else { MAX_ENTRIES };
        let [x, y, z] = [cells(0)?, cells(1)?, cells(2)?];
        let entries = [x, y, z].iter().try_fold(1, |product: u32, along| product.checked_mul(along.checked_add(1)?))?;
        if x.checked_mul(y)?.checked_mul(z)? > MAX_CELLS || entries > most_entries {
            return None;
        }
        let (u, v) = (b - a, c - a);
        let normal = u.cross(&v);
        Some(Self { corners, normal, lower, upper, first_cell, last_cell, rounding })
    }

    /// Number of cells of its box along each axis.
    #[inline(always)]
    pub fn cell_counts(&self) -> [u32; 3] {
        let count = |axis: usize| self.last_cell[axis % 3].wrapping_sub(self.first_cell[axis % 3]).wrapping_add(1);
        [count(0), count(1), count(2)]
    }

    /// The first cell of its box, as numbers.
    #[inline(always)]
    pub fn first_node(&self) -> Vector3<R> {
        Vector3::from(self.first_cell.map(|index| R::from_f64(f64::from(index))))
    }

    /// u = b − a and v = c − a.
    #[inline(always)]
    pub fn edges(&self) -> [Vector3<R>; 2] {
        let [a, b, c] = self.corners;
        [b - a, c - a]
    }

    /// The point with these barycentric weights. The first is implied by the others.
    #[inline(always)]
    pub fn point(&self, weights: [R; 3]) -> Vector3<R> {
        let [u, v] = self.edges();
        self.corners[0] + u * weights[1] + v * weights[2]
    }
}
