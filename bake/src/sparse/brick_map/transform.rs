//! Distance from the slots that the surface crosses: an exact Euclidean distance transform, axis by axis (Saito and Toriwaki
//! 1994, "New algorithms for Euclidean distance transformation"), in slots.
//!
//! Along z the nearest crossed slots above and below are found by 64 slots at a time, so that some layers can be computed without the
//! others. Along y and x each line is compared with the others outward from it, until they are farther than the farthest of its points.
//! All squares are whole numbers that f32 holds, or quarters of such.

use std::ops::Range;

use crate::simd::{lesser_magnitude, min};
use crate::sparse::slot_bits::SlotBits;

/// Origin of distances.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum From {
    /// Slots: between their boxes.
    Slots,
    /// Corners of slots, one more along each axis.
    Corners,
    /// Middles of slots.
    Middles,
}

/// Distance of each slot or corner in some layers from the nearest crossed slot, in slots; infinite if there is none.
pub(super) fn distances(
    arch: pulp::Arch,
    crossed: &SlotBits,
    counts: [usize; 3],
    from: From,
    layers: Range<usize>,
) -> Vec<f32> {
    let [row, rows, _] = counts;
    let more = usize::from(from == From::Corners);
    let along_z = arch.dispatch(AlongZ { crossed, counts, from, layers });
    let layer = (row + more) * (rows + more);
    let mut found = vec![0.0; along_z.len() / (row * rows) * layer];
    let pairs = along_z.chunks(row * rows).zip(found.chunks_mut(layer)).collect();
    sdf_parallel::for_each(pairs, |(along_z, found): (&[f32], &mut [f32])| {
        arch.dispatch(Layer { along_z, found, row, rows, from });
    });
    found
}

impl From {
    /// Squared distance along one axis of slot or corner `from` from slot `to`.
    #[inline(always)]
    fn along_sq(self, from: usize, to: usize) -> f32 {
        let steps = match self {
            Self::Slots => from.abs_diff(to).saturating_sub(1) as f32,
            Self::Corners if from > to => (from - to - 1) as f32,
            Self::Corners => (to - from) as f32,
            Self::Middles if from == to => 0.0,
            Self::Middles => from.abs_diff(to) as f32 - 0.5,
        };
        steps * steps
    }
}

/// Squared distances along z.
struct AlongZ<'a> {
    crossed: &'a SlotBits,
    counts: [usize; 3],
    from: From,
    layers: Range<usize>,
}

/// No crossed slot.
const NONE: u32 = u32::MAX;

impl AlongZ<'_> {
    /// Calls `visit` with each crossed slot of a layer, by its index there, of those in `pending`; they are pending no more.
    #[inline(always)]
    fn visit_crossed(&self, z: usize, pending: Option<&mut [u64]>, mut visit: impl FnMut(usize)) -> bool {
        let layer = self.counts[0] * self.counts[1];
        let mut pending = pending;
        let mut are_any_pending = false;
        for first in (0..layer).step_by(64) {
            let wanted = pending.as_deref().map_or(u64::MAX, |pending| pending[first / 64]);
            if wanted == 0 {
                continue;
            }
            let in_layer = if layer - first < 64 { (1 << (layer - first)) - 1 } else { u64::MAX };
            let mut found = self.crossed.from(z * layer + first) & in_layer & wanted;
            if let Some(pending) = &mut pending {
                pending[first / 64] = wanted & in_layer & !found;
                are_any_pending |= pending[first / 64] != 0;
            }
            while found != 0 {
                visit(first + found.trailing_zeros() as usize);
                found &= found - 1;
            }
        }
        are_any_pending
    }

    /// For each slot of a layer: the first crossed slot in its column, in some layers.
    #[inline(always)]
    fn first_crossed(&self, layers: impl Iterator<Item = usize>) -> Vec<u32> {
        let layer = self.counts[0] * self.counts[1];
        let mut first = vec![NONE; layer];
        let mut pending = vec![u64::MAX; layer.div_ceil(64)];
        for z in layers {
            if !self.visit_crossed(z, Some(&mut pending), |slot| first[slot] = z as u32) {
                break;
            }
        }
        first
    }
}

impl pulp::NullaryFnOnce for AlongZ<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn call(self) -> Vec<f32> {
        let (layer, count) = (self.counts[0] * self.counts[1], self.counts[2]);
        let Range { start, end } = self.layers;
        let mut found = vec![f32::INFINITY; (end - start) * layer];
        let lower = |found: &mut [f32], z: usize, nearest: &[u32]| {
            for (found, nearest) in found.iter_mut().zip(nearest) {
                let along = self.from.along_sq(z, if *nearest == NONE { z } else { *nearest as usize });
                *found = if *nearest == NONE { *found } else { min(*found, along) };
            }
        };
        // The nearest in the layer or below.
        let mut nearest = self.first_crossed((0..count.min(start + 1)).rev());
        for (z, found) in (start..end).zip(found.chunks_mut(layer)) {
            if z < count {
                self.visit_crossed(z, None, |slot| nearest[slot] = z as u32);
            }
            lower(found, z, &nearest);
        }
        // In the layer or above.
        let mut nearest = self.first_crossed(end.saturating_sub(1)..count);
        for (z, found) in (start..end).zip(found.chunks_mut(layer)).rev() {
            if z < count {
                self.visit_crossed(z, None, |slot| nearest[slot] = z as u32);
            }
            lower(found, z, &nearest);
        }
        found
    }
}

/// Distances in one layer from squared ones along z.
struct Layer<'a> {
    along_z: &'a [f32],
    found: &'a mut [f32],
    row: usize,
    rows: usize,
    from: From,
}

impl pulp::NullaryFnOnce for Layer<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { along_z, found, row, rows, from } = self;
        let more = usize::from(from == From::Corners);
        let (width, height) = (row + more, rows + more);
        let mut along_y = vec![f32::INFINITY; row * height];
        nearest_lines(along_z, &mut along_y, row, from);
        let along_y = transposed(&along_y, row);
        let mut along_x = vec![f32::INFINITY; width * height];
        nearest_lines(&along_y, &mut along_x, height, from);
        let squared = transposed(&along_x, height);
        found.iter_mut().zip(squared).for_each(|(found, squared)| *found = squared.sqrt());
    }
}

/// Points of a line that are compared together.
const TILE: usize = 64;

/// For each line the least of all lines and what lies between.
#[inline(always)]
fn nearest_lines(lines: &[f32], to: &mut [f32], length: usize, from: From) {
    let count = lines.len() / length;
    for (line, to) in to.chunks_mut(length).enumerate() {
        for (tile, to) in to.chunks_mut(TILE).enumerate() {
            let other = |other: usize| &lines[other * length + tile * TILE..][..to.len()];
            let mut nearest = [f32::INFINITY; TILE];
            for step in 0.. {
                let (before, after) = (line.checked_sub(step + 1), line + step);
                if before.is_none() && after >= count {
                    break;
                }
                // Whatever is farther lowers nothing.
                if step % 4 == 0
                    && nearest[..to.len()].iter().fold(0.0, |a, b| if a > *b { a } else { *b })
                        <= from.along_sq(line, after)
                {
                    break;
                }
                if after < count {
                    add_nearest(&mut nearest, other(after), from.along_sq(line, after));
                }
                if let Some(before) = before.filter(|before| *before < count) {
                    add_nearest(&mut nearest, other(before), from.along_sq(line, before));
                }
            }
            to.copy_from_slice(&nearest[..to.len()]);
        }
    }
}

/// Columns of lines of a length, one after the other.
#[inline(always)]
fn transposed(lines: &[f32], length: usize) -> Vec<f32> {
    let count = lines.len() / length;
    let mut columns = vec![0.0; lines.len()];
    for (line, numbers) in lines.chunks(length).enumerate() {
        for (column, number) in numbers.iter().enumerate() {
            columns[column * count + line] = *number;
        }
    }
    columns
}

/// Lowers values at nodes until no two neighbours along an axis differ by more than `step`, and no more than that asks.
pub(super) fn limit_steps(arch: pulp::Arch, values: &mut [f32], counts: [usize; 3], step: f32) {
    limit_along_axes(arch, values, counts, &|to: &mut f32, from: f32| *to = min(*to, from + step));
}

/// Lowers magnitudes at nodes until no two neighbours along an axis with the same sign differ by more than `step`.
///
/// As [`limit_steps`] of the nodes of either sign by themselves, with the others infinite: so it does if a magnitude beside a node of
/// the other sign is at most the least of all and two steps, for a way around that node takes two.
pub(super) fn limit_signed_steps(arch: pulp::Arch, values: &mut [f32], counts: [usize; 3], step: f32) {
    limit_along_axes(arch, values, counts, &|to: &mut f32, from: f32| {
        let limited = min(to.abs(), from.abs() + step).copysign(*to);
        *to = if to.is_sign_negative() == from.is_sign_negative() { limited } else { *to };
    });
}

/// Lowers each number by those before and after it along each axis.
#[inline(always)]
fn limit_along_axes(
    arch: pulp::Arch,
    values: &mut [f32],
    [row, rows, _]: [usize; 3],
    limit: &(impl Fn(&mut f32, f32) + Sync),
) {
    let layers: Vec<&mut [f32]> = values.chunks_mut(row * rows).collect();
    sdf_parallel::for_each(layers, |layer: &mut [f32]| {
        for line in layer.chunks_mut(row) {
            for x in 1..row {
                let before = line[x - 1];
                limit(&mut line[x], before);
            }
            for x in (1..row).rev() {
                let after = line[x];
                limit(&mut line[x - 1], after);
            }
        }
        arch.dispatch(|| limit_lines(layer, row, limit));
    });
    arch.dispatch(|| limit_lines(values, row * rows, limit));
}

/// As [`limit_along_axes`], between lines of a length.
#[inline(always)]
fn limit_lines(values: &mut [f32], length: usize, limit: &impl Fn(&mut f32, f32)) {
    let count = values.len() / length;
    let lower = |to: &mut [f32], from: &[f32]| to.iter_mut().zip(from).for_each(|(to, from)| limit(to, *from));
    for line in 1..count {
        let (before, after) = values.split_at_mut(line * length);
        lower(&mut after[..length], &before[(line - 1) * length..]);
    }
    for line in (1..count).rev() {
        let (before, after) = values.split_at_mut(line * length);
        lower(&mut before[(line - 1) * length..], &after[..length]);
    }
}

/// Lowers values to those of another line and what lies between.
#[inline(always)]
fn add_nearest(to: &mut [f32], from: &[f32], between: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = lesser_magnitude(*to, *from + between);
    }
}
