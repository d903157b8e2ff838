//! A triangle in cell coordinates, with what every step needs of it: box, normal, separating planes, range of cells.

use core::array::from_fn;

use nalgebra::Vector3;

use crate::grid::Lattice;
use crate::grid::node_box::{ROOM, SPILL};
use crate::number::{Float, Real};
use crate::rounding::CELL_COORDINATE;

/// Most cells in a triangle's box that are searched at once.
pub(super) const MAX_CELLS: u32 = if cfg!(feature = "std") { 512 } else { MAX_ENTRIES };

/// Most nodes in a triangle's box, and entries in a [`DescentTable`](super::descent_table::DescentTable).
pub(super) const MAX_ENTRIES: u32 = (ROOM - SPILL) as u32;

/// Cells from the first of a block to that of the next.
const BLOCK_STEP: u32 = 7;

/// Most blocks of a triangle's box: 56 cells along each axis. A larger triangle is better cut first.
const MAX_BLOCKS: u32 = 512;

/// A triangle in cell coordinates, or its part in a range of cells.
#[derive(Clone, Copy)]
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
    /// Most cells of its whole box along an axis.
    pub extent: u32,
    /// Bound of the rounding of a coordinate.
    pub rounding: R,
}

impl<R: Float> GridTriangle<R> {
    /// `None` if a coordinate is not a number.
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
        let extent = cells(0)?.max(cells(1)?).max(cells(2)?);
        let (u, v) = (b - a, c - a);
        let normal = u.cross(&v);
        Some(Self { corners, normal, lower, upper, first_cell, last_cell, extent, rounding })
    }

    /// Can its cells be searched at once? In single precision as many as small processors have memory for, so that answers are
    /// the same everywhere.
    #[inline(always)]
    pub fn is_small(&self) -> bool {
        let most_entries = if R::EPSILON > 1e-10 { MAX_ENTRIES.min(248) } else { MAX_ENTRIES };
        let [x, y, z] = self.cell_counts();
        let product = |[x, y, z]: [u32; 3]| x.checked_mul(y)?.checked_mul(z);
        let entries = product([x, y, z].map(|count| count.saturating_add(1)));
        product([x, y, z]).is_some_and(|cells| cells <= MAX_CELLS)
            && entries.is_some_and(|entries| entries <= most_entries)
    }

    /// Its parts in blocks of its box. Each shares a layer of cells with the next, so that the cells on both sides of a border lie
    /// in one of them. `None` if there are more than [`MAX_BLOCKS`].
    pub fn blocks(&self) -> Option<impl Iterator<Item = Self>> {
        let counts = self.cell_counts().map(|cells| cells.saturating_sub(1).div_ceil(BLOCK_STEP).max(1));
        let [x, y, z] = counts;
        let count = x.checked_mul(y)?.checked_mul(z).filter(|count| *count <= MAX_BLOCKS)?;
        let block = move |index: u32| {
            let place = [index % x, index / x % y, index / x / y];
            let first_cell =
                from_fn(|k| self.first_cell[k % 3].saturating_add(place[k % 3].saturating_mul(BLOCK_STEP)));
            let last_cell = from_fn(|k| first_cell[k % 3].saturating_add(BLOCK_STEP).min(self.last_cell[k % 3]));
            Self { first_cell, last_cell, ..*self }
        };
        Some((0..count).map(block))
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
