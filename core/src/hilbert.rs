//! The order of cells along the Hilbert curve, on which near indices are near in space (Skilling 2004, "Programming the
//! Hilbert curve").

/// Bits of each coordinate in a Hilbert index.
pub const BITS: u32 = 20;

/// Index of a cell along the Hilbert curve. Coordinates are below 2^[`BITS`].
#[inline]
pub fn hilbert_index(cell: [u32; 3]) -> u64 {
    hilbert_indices(cell.map(|coordinate| [coordinate]))[0]
}

/// [`hilbert_index`] of several cells side by side, given by their x, y and z: the loops over them compile to vector instructions.
#[inline(always)]
pub fn hilbert_indices<const N: usize>(cells: [[u32; N]; 3]) -> [u64; N] {
    let mut x = cells;
    // Branch-free: the bits are unpredictable.
    let bit_mask = |number: u32, bit: u32| 0_u32.wrapping_sub(number >> bit & 1);
    for bit in (1..BITS).rev() {
        let low_bits = (1 << bit) - 1;
        for axis in 0..3 {
            for lane in 0..N {
                let is_set = bit_mask(x[axis][lane], bit);
                let swap = (x[0][lane] ^ x[axis][lane]) & low_bits & !is_set;
                x[0][lane] ^= swap | low_bits & is_set;
                x[axis][lane] ^= swap;
            }
        }
    }
    let mut indices = [0; N];
    for lane in 0..N {
        x[1][lane] ^= x[0][lane];
        x[2][lane] ^= x[1][lane];
        let turn = (1..BITS).fold(0, |turn, bit| turn ^ ((1 << bit) - 1) & bit_mask(x[2][lane], bit));
        let [a, b, c] = [0, 1, 2].map(|axis: usize| spread_bits(x[axis][lane] ^ turn));
        indices[lane] = a << 2 | b << 1 | c;
    }
    indices
}

/// Inserts two zeros before each of the lowest 21 bits (Morton code of one coordinate).
#[inline(always)]
fn spread_bits(bits: u32) -> u64 {
    let steps = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    steps.iter().fold(bits.into(), |bits: u64, (step, kept)| (bits | bits << step) & kept)
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use super::*;

    #[test]
    fn the_curve_visits_every_cell_once_and_steps_to_a_neighbour() {
        let side = 8;
        for shift in [0, 8, BITS - 3] {
            let mut cells = Vec::new();
            for z in 0..side {
                for y in 0..side {
                    for x in 0..side {
                        cells.push((hilbert_index([x << shift, y << shift, z << shift]), [x, y, z]));
                    }
                }
            }
            cells.sort();
            for pair in cells.windows(2) {
                let steps: u32 = (0..3).map(|axis| pair[0].1[axis].abs_diff(pair[1].1[axis])).sum();
                assert_eq!(steps, 1, "{pair:?}");
            }
        }
    }
}
