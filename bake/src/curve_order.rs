//! Order of cells along the Hilbert curve: indices eight side by side, then a radix sort.

use sdf_core::hilbert::{BITS, hilbert_indices};

use crate::simd::{LANES, VectorX8};

/// Bits that one pass of the sort looks at, and the passes that a Hilbert index takes.
const DIGIT: u32 = 10;
const PASSES: usize = (3 * BITS).div_ceil(DIGIT) as usize;

/// Number of cells above which all threads sort, by comparisons.
const MAX_RADIX: usize = 1 << 20;

/// Groups of [`LANES`] cells whose indices one thread computes at a time.
const GROUPS: usize = 128;

/// The numbers of so many cells in the order of the Hilbert curve; of cells with one index the lowest first.
pub(crate) fn curve_order(count: usize, cell: impl Fn(usize) -> [u32; 3] + Sync) -> Vec<u32> {
    let arch = pulp::Arch::new();
    let mut keyed: Vec<(u64, u32)> = (0..count as u32).map(|number| (0, number)).collect();
    sdf_parallel::for_each(keyed.chunks_mut(GROUPS * LANES).collect(), |chunk| {
        for group in chunk.chunks_mut(LANES) {
            let mut cells: VectorX8<u32> = [[0; LANES]; 3];
            for (lane, (_, number)) in group.iter().enumerate() {
                let cell = cell(*number as usize);
                (0..3).for_each(|axis| cells[axis][lane] = cell[axis]);
            }
            let indices = arch.dispatch(Indices(cells));
            group.iter_mut().zip(indices).for_each(|((key, _), index)| *key = index);
        }
    });
    if count > MAX_RADIX {
        sdf_parallel::sort(&mut keyed);
    } else {
        radix_sort(&mut keyed);
    }
    keyed.into_iter().map(|(_, number)| number).collect()
}

/// Sorts by keys below 2^(3 · [`BITS`]), from the lowest digit on: what has one key stays in its order.
fn radix_sort(keyed: &mut Vec<(u64, u32)>) {
    let digit = |key: u64, pass: usize| (key >> (DIGIT as usize * pass)) as usize & ((1 << DIGIT) - 1);
    let mut counts = vec![[0_u32; 1 << DIGIT]; PASSES];
    for (key, _) in keyed.iter() {
        for (pass, counts) in counts.iter_mut().enumerate() {
            counts[digit(*key, pass)] += 1;
        }
    }
    let mut sorted = keyed.clone();
    for (pass, counts) in counts.iter_mut().enumerate() {
        if counts.iter().any(|count| *count as usize == keyed.len()) {
            continue;
        }
        let mut sum = 0;
        counts.iter_mut().for_each(|count| (*count, sum) = (sum, sum + *count));
        for item in keyed.iter() {
            let position = &mut counts[digit(item.0, pass)];
            sorted[*position as usize] = *item;
            *position += 1;
        }
        std::mem::swap(keyed, &mut sorted);
    }
}

struct Indices(VectorX8<u32>);

impl pulp::NullaryFnOnce for Indices {
    type Output = [u64; LANES];

    #[inline(always)]
    fn call(self) -> [u64; LANES] {
        hilbert_indices(self.0)
    }
}

#[cfg(test)]
mod tests {
    use sdf_core::hilbert::hilbert_index;

    use super::*;
    use crate::testing::random;

    #[test]
    fn cells_are_sorted_by_their_indices_and_then_by_their_numbers() {
        let mut state = 5;
        for count in [0, 1, 7, 8, 9, 1000, 3000] {
            // Near each other, so that some are equal, or anywhere.
            for side in [4.0, f64::from((1_u32 << BITS) - 1)] {
                let cells: Vec<[u32; 3]> =
                    (0..count).map(|_| [0; 3].map(|_| (0.5 * (random(&mut state) + 1.0) * side) as u32)).collect();
                let mut sorted: Vec<u32> = (0..count as u32).collect();
                sorted.sort_by_key(|number| hilbert_index(cells[*number as usize]));
                assert_eq!(curve_order(count, |number| cells[number]), sorted, "{count} cells within {side}");
            }
        }
    }
}
