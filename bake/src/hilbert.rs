/// Bits of each coordinate in a Hilbert index.
pub(crate) const BITS: u32 = 20;

/// How far along the Hilbert curve a cell lies: cells with near indices are near in space. Coordinates are below
/// 2^[`BITS`]. (Skilling 2004, "Programming the Hilbert curve".)
pub(crate) fn hilbert_index(cell: [u32; 3]) -> u64 {
    let mut x = cell;
    let mut bit = 1 << (BITS - 1);
    while bit > 1 {
        let low_bits = bit - 1;
        for axis in 0..3 {
            if x[axis] & bit != 0 {
                x[0] ^= low_bits;
            } else {
                let swap = (x[0] ^ x[axis]) & low_bits;
                x[0] ^= swap;
                x[axis] ^= swap;
            }
        }
        bit >>= 1;
    }
    x[1] ^= x[0];
    x[2] ^= x[1];
    let mut turn = 0;
    let mut bit = 1 << (BITS - 1);
    while bit > 1 {
        if x[2] & bit != 0 {
            turn ^= bit - 1;
        }
        bit >>= 1;
    }
    let x = x.map(|coordinate| coordinate ^ turn);
    let interleave =
        |index: u64, bit: u32| (0..3).fold(index, |index, axis| index << 1 | u64::from(x[axis] >> bit & 1));
    (0..BITS).rev().fold(0, interleave)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_visits_every_cell_once_and_steps_to_a_neighbour() {
        let side = 8;
        let shift = BITS - 3;
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
