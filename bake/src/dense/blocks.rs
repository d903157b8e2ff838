//! How does a dense grid become one of 2 or 1 bytes a node? Each block of 8 × 8 × 8 nodes has a linear scale over the range of its own
//! samples. A distance changes by at most 7 √3 spacings between nodes of a block, so that half a step is 1/10,800 of a spacing (u16) or
//! 1/42 (u8) at most; more only where the sign of an open mesh jumps.
//!
//! **No node changes its side.** In a block with both signs, or that comes within a step of 0, codes stand for the middles of steps that
//! 0 divides, and a sample is put into a step by its sign and magnitude:
//!
//! ```text
//! code = k + ⌊φ / step⌋      φ ≥ 0     decoded ≈ (code − k + ½) step     base = −(k − ½) step
//! code = k − 1 − ⌊−φ / step⌋ φ < 0
//! ```
//!
//! In other blocks the code is the nearest. With δ the largest difference of a decoded sample from its sample, measured, the interpolant
//! changes by at most δ: it is a convex combination. So δ is added to the error bound; bounds and slopes are those of decoded samples.

use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{BlockCode, DenseBlocks, OwnedGrid, OwnedStorage, Precision};
use sdf_core::grid::sparse::{BRICK_SAMPLES, Scale, brick_counts};

use super::Measured;
use crate::baked_grid::FITS;
use crate::curve_order::curve_order;
use crate::nearest::{SIDE, packet_rows};
use crate::{BakedGrid, DenseGrid};

/// Bytes for each node of codes while blocks are put into their order: the codes twice.
const CODES_IN_PROGRESS: usize = 2;

/// Memory for each node while a dense grid of this precision is baked, in bytes.
pub fn bytes_per_node(precision: Precision) -> usize {
    let code = match precision {
        Precision::F32 => 0,
        Precision::U16 => size_of::<u16>(),
        Precision::U8 => size_of::<u8>(),
    };
    size_of::<f32>() + CODES_IN_PROGRESS * code
}

/// A code that counts steps.
trait StepCode: BlockCode + Default + Send + Sync {
    /// The largest.
    const MAX: f32;
    /// The code of a whole number, clamped.
    fn from_steps(steps: f32) -> Self;
}

impl StepCode for u16 {
    const MAX: f32 = 65_535.0;
    fn from_steps(steps: f32) -> Self {
        steps as Self
    }
}

impl StepCode for u8 {
    const MAX: f32 = 255.0;
    fn from_steps(steps: f32) -> Self {
        steps as Self
    }
}

/// How a block's samples become codes.
#[derive(Clone, Copy)]
struct BlockScale {
    scale: Scale,
    /// Code of the first step at or above 0, if 0 divides steps.
    first_outside: Option<f32>,
}

impl BlockScale {
    /// For samples from `lower` to `upper`.
    fn new<C: StepCode>(lower: f32, upper: f32) -> Self {
        let plain = (upper - lower) / C::MAX;
        let is_near_zero = lower < 0.0 && upper > -plain;
        if !is_near_zero {
            return Self { scale: Scale { base: lower, step: plain }, first_outside: None };
        }
        // One step is lost, as 0 divides two; widened by the rounding of the quotient, and not 0.
        let step = ((upper - lower) / (C::MAX - 1.0) * (1.0 + 2.0 * f32::EPSILON)).max(f32::from_bits(1));
        let first_outside = (-lower / step).floor() + 1.0;
        let first_outside = first_outside.min(C::MAX);
        Self { scale: Scale { base: -(first_outside - 0.5) * step, step }, first_outside: Some(first_outside) }
    }

    fn encode<C: StepCode>(self, sample: f32) -> C {
        let Scale { base, step } = self.scale;
        let steps = match self.first_outside {
            Some(first) if sample < 0.0 => (first - 1.0 - (-sample / step).floor()).max(0.0),
            Some(first) => (first + (sample / step).floor()).min(C::MAX),
            None if step > 0.0 => ((sample - base) / step).round().min(C::MAX),
            None => 0.0,
        };
        C::from_steps(steps)
    }
}

impl DenseGrid {
    /// The grid in a precision known only at run time, on the lattice that it was baked on.
    ///
    /// # Panics
    ///
    /// On another lattice.
    pub fn into_grid_as(self, lattice: &Lattice, precision: Precision) -> BakedGrid {
        match precision {
            Precision::F32 => self.into_grid(lattice),
            Precision::U16 => self.into_blocks::<u16>(lattice),
            Precision::U8 => self.into_blocks::<u8>(lattice),
        }
    }

    fn into_blocks<C: StepCode>(self, lattice: &Lattice) -> BakedGrid {
        let Self { mut distances, error_bound, inside_reaches_box, .. } = self;
        let counts = brick_counts(lattice).map(|n| n as usize);
        let block_count: usize = counts.iter().product();
        let mut scales = vec![Scale { base: 0.0, step: 0.0 }; block_count];
        let mut roundings = vec![0.0_f64; block_count];
        let mut codes = vec![C::default(); block_count * BRICK_SAMPLES];
        // Blocks x fastest: those of one group of rows stand one after the other.
        let rows = packet_rows(&mut distances, lattice.nodes().map(|n| n as usize));
        let of_rows = codes.chunks_mut(counts[0] * BRICK_SAMPLES);
        let tables = scales.chunks_mut(counts[0]).zip(roundings.chunks_mut(counts[0]));
        let groups = rows.into_iter().zip(of_rows.zip(tables)).collect();
        let row_count = lattice.nodes()[1] as usize;
        sdf_parallel::for_each(groups, |(([y, _], mut rows), (codes, (scales, roundings))): (RowGroup, Coded<C>)| {
            let rows_along_y = (row_count - y).min(SIDE);
            let blocks = codes.chunks_mut(BRICK_SAMPLES).zip(scales.iter_mut().zip(roundings));
            for (x, (codes, (scale, rounding))) in blocks.enumerate() {
                (*scale, *rounding) = encode_block(&mut rows, rows_along_y, x * SIDE, codes);
            }
        });
        let Measured { bounds, slope_bound, .. } = Measured::new(lattice, &distances);
        drop(distances);
        let slot = |index: usize| {
            [index % counts[0], index / counts[0] % counts[1], index / counts[0] / counts[1]].map(|n| n as u32)
        };
        let order: Vec<usize> = curve_order(block_count, slot).into_iter().map(|index| index as usize).collect();
        let mut samples = vec![C::default(); codes.len()];
        let ordered = samples.chunks_mut(BRICK_SAMPLES).zip(&order).collect();
        sdf_parallel::for_each(ordered, |(samples, index): (&mut [C], &usize)| {
            samples.copy_from_slice(&codes[index * BRICK_SAMPLES..][..BRICK_SAMPLES]);
        });
        let blocks = DenseBlocks {
            slots: order.iter().map(|index| slot(*index)).collect(),
            scales: order.iter().map(|index| scales[*index]).collect(),
            samples,
            bounds: order.iter().map(|index| bounds[*index]).collect(),
        };
        let rounding = roundings.into_iter().fold(0.0, f64::max);
        let error_bound = if rounding > 0.0 { (error_bound + rounding).next_up() } else { error_bound };
        let storage = OwnedStorage::dense_blocks(lattice, blocks).expect(FITS);
        let grid = OwnedGrid::new(*lattice, storage, slope_bound).expect(FITS).with_error_bound(error_bound);
        let grid = grid.with_inside_at_box(inside_reaches_box);
        BakedGrid { grid, error_bound, jumps: None }
    }
}

/// Up to 8 × 8 rows of nodes along x, y fastest, and the indices of the first.
type RowGroup<'a> = ([usize; 2], Vec<&'a mut [f32]>);

/// The codes, scales and errors of the blocks along x.
type Coded<'a, C> = (&'a mut [C], (&'a mut [Scale], &'a mut [f64]));

/// Encodes the block whose nodes begin at `x`, and replaces its samples by what they decode to. Returns its scale, and the largest
/// difference of a sample from what it was. Nodes beyond the lattice get the code of the nearest in it, as that packs well.
fn encode_block<C: StepCode>(rows: &mut [&mut [f32]], rows_along_y: usize, x: usize, codes: &mut [C]) -> (Scale, f64) {
    let range = x..rows[0].len().min(x + SIDE);
    let (mut lower, mut upper) = (f32::INFINITY, f32::NEG_INFINITY);
    for sample in rows.iter().flat_map(|row| &row[range.clone()]) {
        (lower, upper) = (lower.min(*sample), upper.max(*sample));
    }
    let scale = BlockScale::new::<C>(lower, upper);
    let [last_x, last_y, last_z] = [range.len() - 1, rows_along_y - 1, rows.len() / rows_along_y - 1];
    for (row, codes) in codes.chunks_mut(SIDE).enumerate() {
        let [y, z] = [(row % SIDE).min(last_y), (row / SIDE).min(last_z)];
        let samples = &rows[z * rows_along_y + y][range.clone()];
        for (i, code) in codes.iter_mut().enumerate() {
            *code = scale.encode(samples[i.min(last_x)]);
        }
    }
    let (mut rounding, mut total) = (0.0_f64, 0.0);
    for (row, samples) in rows.iter_mut().enumerate() {
        let first = (row / rows_along_y * SIDE + row % rows_along_y) * SIDE;
        for (sample, code) in samples[range.clone()].iter_mut().zip(&codes[first..]) {
            let decoded = code.decode(scale.scale);
            let change = (f64::from(decoded) - f64::from(*sample)).abs();
            (rounding, total) = (rounding.max(change), total + change);
            *sample = decoded;
        }
    }
    // A code says nothing of a NaN, and a maximum passes it over.
    assert!(total.is_finite(), "baked distances are finite");
    (scale.scale, rounding)
}

#[cfg(test)]
mod tests;
