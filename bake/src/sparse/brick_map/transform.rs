//! Distance from the slots that the surface crosses: an exact Euclidean distance transform, axis by axis (Saito and Toriwaki
//! 1994, "New algorithms for Euclidean distance transformation"), in slots.

use crate::simd::{lesser_magnitude, min};

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

/// Distance of each slot or corner from the nearest crossed slot, in slots; infinite if there is none.
pub(super) fn distances(arch: pulp::Arch, crossed: &[bool], counts: [usize; 3], from: From) -> Vec<f32> {
    arch.dispatch(Transform { crossed, counts, from })
}

struct Transform<'a> {
    crossed: &'a [bool],
    counts: [usize; 3],
    from: From,
}

impl Transform<'_> {
    /// Squared distance along one axis of slot or corner `from` from slot `to`.
    #[inline(always)]
    fn along_sq(&self, from: usize, to: usize) -> f32 {
        let steps = match self.from {
            From::Slots => from.abs_diff(to).saturating_sub(1) as f32,
            From::Corners if from > to => (from - to - 1) as f32,
            From::Corners => (to - from) as f32,
            From::Middles if from == to => 0.0,
            From::Middles => from.abs_diff(to) as f32 - 0.5,
        };
        steps * steps
    }
}

impl pulp::NullaryFnOnce for Transform<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn call(self) -> Vec<f32> {
        let Self { crossed, counts: [row, rows, layers], from } = self;
        let more = usize::from(from == From::Corners);
        let (width, height) = (row + more, rows + more);
        let mut along_x = vec![f32::INFINITY; width * rows * layers];
        for (crossed, distances) in crossed.chunks(row).zip(along_x.chunks_mut(width)) {
            let mut last = None;
            for x in 0..width {
                last = if x < row && crossed[x] { Some(x) } else { last };
                distances[x] = last.map_or(f32::INFINITY, |last| self.along_sq(x, last));
            }
            let mut next = None;
            for x in (0..width).rev() {
                next = if x < row && crossed[x] { Some(x) } else { next };
                distances[x] = next.map_or(distances[x], |next| min(distances[x], self.along_sq(x, next)));
            }
        }
        let mut along_y = vec![f32::INFINITY; width * height * layers];
        for (from, to) in along_x.chunks(width * rows).zip(along_y.chunks_mut(width * height)) {
            for (y, to) in to.chunks_mut(width).enumerate() {
                for (other, from) in from.chunks(width).enumerate() {
                    add_nearest(to, from, self.along_sq(y, other));
                }
            }
        }
        let layer = width * height;
        let mut along_z = vec![f32::INFINITY; layer * (layers + more)];
        for (z, to) in along_z.chunks_mut(layer).enumerate() {
            for (other, from) in along_y.chunks(layer).enumerate() {
                add_nearest(to, from, self.along_sq(z, other));
            }
        }
        along_z.iter_mut().for_each(|distance| *distance = distance.sqrt());
        along_z
    }
}

/// Lowers values at nodes until no two neighbours along an axis differ by more than `step`, and no more than that asks.
pub(super) fn limit_steps(arch: pulp::Arch, values: &mut [f32], counts: [usize; 3], step: f32) {
    let [row, rows, _] = counts;
    for line in values.chunks_mut(row) {
        for x in 1..row {
            line[x] = min(line[x], line[x - 1] + step);
        }
        for x in (1..row).rev() {
            line[x - 1] = min(line[x - 1], line[x] + step);
        }
    }
    for layer in values.chunks_mut(row * rows) {
        arch.dispatch(|| limit_lines(layer, row, step));
    }
    arch.dispatch(|| limit_lines(values, row * rows, step));
}

/// As [`limit_steps`], between lines of a length.
#[inline(always)]
fn limit_lines(values: &mut [f32], length: usize, step: f32) {
    let count = values.len() / length;
    for line in 1..count {
        let (before, after) = values.split_at_mut(line * length);
        add_nearest(&mut after[..length], &before[(line - 1) * length..], step);
    }
    for line in (1..count).rev() {
        let (before, after) = values.split_at_mut(line * length);
        add_nearest(&mut before[(line - 1) * length..], &after[..length], step);
    }
}

/// Lowers values to those of another line and what lies between.
#[inline(always)]
fn add_nearest(to: &mut [f32], from: &[f32], between: f32) {
    for (to, from) in to.iter_mut().zip(from) {
        *to = lesser_magnitude(*to, *from + between);
    }
}
