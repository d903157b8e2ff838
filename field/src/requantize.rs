//! How does a grid become one of fewer bits a sample? Each sample is rounded to the nearest of 65,536 or 256 steps: of its brick's
//! range, or of the whole range of a dense grid of f32, as small processors read it with the least code. Dense grids of codes are decoded,
//! and encoded again block by block (`DenseGrid::into_grid_as`). With δ the largest change of a sample and h the spacing:
//!
//! - the interpolant changes by at most δ, so that error bounds and ranges widen by δ;
//! - bounds of bricks count it beyond the band too (`least_brick_error_rounded_again`);
//! - a difference along an edge changes by at most 2 δ, so that slopes grow by at most 2 √3 δ / h.

use sdf_bake::sparse::Quantize;
use sdf_bake::{DenseGrid, least_brick_error_rounded_again};
use sdf_core::grid::owned::{OwnedBricks, OwnedCode, OwnedGrid, OwnedStorage, Precision};
use sdf_core::grid::sparse::{BRICK_SAMPLES, Code, Scale};
use sdf_core::grid::{BlockBounds, Lattice, slope_bound_with_outside};
use sdf_core::{Interval, Sdf};
use sdf_formats::blob_file::DenseCodes;

/// A grid of another precision.
pub(crate) struct Requantized {
    /// The grid, with bounds that hold for the new samples. One that was dense in f32 has them decoded.
    pub grid: OwnedGrid,
    /// The codes of a grid that was dense in f32.
    pub codes: Option<DenseCodes>,
}

/// The grid in another precision; `None` if it is the grid's own.
pub(crate) fn requantize(grid: &OwnedGrid, precision: Precision) -> Option<Requantized> {
    match (grid.storage(), precision) {
        (storage, precision) if storage.precision() == precision => None,
        (OwnedStorage::Dense(dense), precision) => {
            let samples = dense.storage().samples();
            let (codes, decoded) = match precision {
                Precision::U8 => {
                    let (codes, scale, decoded) = encode::<u8>(samples);
                    (DenseCodes::U8(codes, scale), decoded)
                }
                _ => {
                    let (codes, scale, decoded) = encode::<u16>(samples);
                    (DenseCodes::U16(codes, scale), decoded)
                }
            };
            let change = Change::between(samples.iter().copied(), &decoded);
            let bounds = dense.bounds().iter().map(|bounds| change.widen(*bounds, grid.lattice())).collect();
            let storage = OwnedStorage::dense(grid.lattice(), decoded, bounds)?;
            Some(Requantized { grid: change.apply(grid, storage)?, codes: Some(codes) })
        }
        (OwnedStorage::DenseU16(_) | OwnedStorage::DenseU8(_), precision) => {
            let samples = sdf_formats::export::dense_samples(grid).into_owned();
            let dense = DenseGrid::from_samples(grid.lattice(), samples)?;
            let inside_reaches_box = grid.inside_reaches_box();
            let dense = DenseGrid { error_bound: grid.global_error_bound(), inside_reaches_box, ..dense };
            Some(Requantized { grid: dense.into_grid_as(grid.lattice(), precision).grid, codes: None })
        }
        (OwnedStorage::SparseF32(sparse), precision) => bricks(grid, sparse.bricks(), precision),
        (OwnedStorage::SparseU16(sparse), precision) => bricks(grid, sparse.bricks(), precision),
        (OwnedStorage::SparseU8(sparse), precision) => bricks(grid, sparse.bricks(), precision),
    }
}

fn bricks<C: Code>(grid: &OwnedGrid, bricks: &OwnedBricks<C>, precision: Precision) -> Option<Requantized> {
    match precision {
        Precision::F32 => bricks_as::<C, f32>(grid, bricks),
        Precision::U16 => bricks_as::<C, u16>(grid, bricks),
        Precision::U8 => bricks_as::<C, u8>(grid, bricks),
    }
}

fn bricks_as<C: Code, D: Quantize + OwnedCode>(grid: &OwnedGrid, bricks: &OwnedBricks<C>) -> Option<Requantized> {
    let (mut scales, mut samples, mut change) = (vec![], vec![], Change(0.0));
    for (codes, scale) in bricks.samples.chunks(BRICK_SAMPLES).zip(&bricks.scales) {
        let before: Vec<f32> = codes.iter().map(|code| code.decode(*scale)).collect();
        let (codes, scale, decoded) = encode::<D>(&before);
        change = change.max(Change::between(before, &decoded));
        samples.extend(codes);
        scales.push(scale);
    }
    let OwnedBricks { table, slots, bounds, errors, coarse, .. } = bricks.clone();
    let bounds = bounds.into_iter().map(|bounds| change.widen(bounds, grid.lattice())).collect();
    let errors = errors.into_iter().map(|error| change.of_brick(error, grid)).collect();
    let bricks = OwnedBricks { table, slots, scales, samples, bounds, errors, coarse };
    let storage = OwnedStorage::sparse::<D>(grid.lattice(), bricks)?;
    Some(Requantized { grid: change.apply(grid, storage)?, codes: None })
}

/// The codes of samples, their scale, and what they decode to.
fn encode<D: Quantize>(samples: &[f32]) -> (Vec<D>, Scale, Vec<f32>) {
    let lower = samples.iter().copied().fold(f32::INFINITY, f32::min);
    let upper = samples.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    let scale = D::scale(lower, upper);
    let codes: Vec<D> = samples.iter().map(|sample| D::encode(*sample, scale)).collect();
    let decoded = codes.iter().map(|code| code.decode(scale)).collect();
    (codes, scale, decoded)
}

/// Largest change of a sample, δ.
#[derive(Clone, Copy)]
struct Change(f64);

impl Change {
    fn between(before: impl IntoIterator<Item = f32>, after: &[f32]) -> Self {
        let change = |(before, after): (f32, &f32)| (f64::from(before) - f64::from(*after)).abs();
        Self(before.into_iter().zip(after).map(change).fold(0.0, f64::max).next_up())
    }

    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0))
    }

    /// The sum, rounded up.
    fn add(self, error: f32) -> f32 {
        ((f64::from(error) + self.0) as f32).next_up()
    }

    /// The error bound of a brick, in the band and beyond.
    fn of_brick(self, error: f32, grid: &OwnedGrid) -> f32 {
        let least = least_brick_error_rounded_again(error.into(), self.0, grid.lattice().spacing(), grid.band());
        self.add(error).max((least as f32).next_up())
    }

    fn steeper(self, slope: f64, lattice: &Lattice) -> f64 {
        // 2 √3, rounded up.
        (slope + 3.465 * self.0 / lattice.spacing()).next_up()
    }

    fn widen(self, bounds: BlockBounds, lattice: &Lattice) -> BlockBounds {
        let range = Interval { lower: -self.add(-bounds.range.lower), upper: self.add(bounds.range.upper) };
        BlockBounds { range, slope_bound: (self.steeper(bounds.slope_bound.into(), lattice) as f32).next_up() }
    }

    /// The grid with these samples, and the bounds of the one before as they are now.
    fn apply(self, grid: &OwnedGrid, storage: OwnedStorage) -> Option<OwnedGrid> {
        // A sample on the box's face that rounding makes negative changes the slope outside.
        let is_negative_now = (0.0..=self.0).contains(&grid.lowest_boundary_sample());
        let inside = self.steeper(grid.slope_bound(), grid.lattice());
        let slope_bound = if is_negative_now { slope_bound_with_outside(inside, true) } else { inside };
        let changed = OwnedGrid::new(*grid.lattice(), storage, slope_bound)?;
        let changed = changed.with_inside_at_box(grid.inside_reaches_box());
        let error = grid.global_error_bound();
        let least = least_brick_error_rounded_again(error, self.0, grid.lattice().spacing(), grid.band());
        let error_bound = (error + self.0).max(least).next_up();
        Some(changed.with_band(grid.band()).with_error_bound(error_bound).with_deep_error(grid.deep_error()))
    }
}
