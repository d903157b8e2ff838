//! Constants and shapes that docs/format.md fixes, and the chunk shapes that we choose.

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK_SAMPLES, NO_BRICK, brick_counts};

/// The version of files that readers of version 4 understand: all but dense grids of u16 and u8.
pub(super) const PLAIN_VERSION: i128 = 4;

/// The version of dense grids of u16 and u8, the latest. Other grids keep the earlier number, so that earlier programs read them.
pub(super) const FORMAT_VERSION: i128 = DENSE_CODES_VERSION;

/// The first version with dense grids of codes. A dense grid has it if and only if its samples are codes.
pub(super) const DENSE_CODES_VERSION: i128 = 5;

/// The oldest version that is read.
pub(super) const OLDEST_VERSION: i128 = 2;

/// The first version with a CRC-32 of each chunk; before it, SHA-256.
pub(super) const CRC_VERSION: i128 = 4;

/// First version in which a dataset can be marked as the scalars. Readers of earlier 2.x read it too, as one array of
/// several.
pub(super) const VTKHDF_VERSION: [i64; 2] = [2, 6];

pub(super) const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Nodes of a chunk along z, y and x: 32 KiB of samples, which a reader of one point must inflate. Contacts of a cloth over a dragon in
/// 256 cells reach chunks of 9.4 MB of 28.5, in 8.5 ms; with 32 x 32 x 32 14.9 MB, in 8.9 ms. Deflated it takes them 14.4 ms in place of
/// 20, and the file is 0.3 % larger.
const CHUNK_NODES: [usize; 3] = [16, 16, 32];

/// Bricks in a chunk of samples: 32 KiB of u16, inflated and hashed in 0.07 ms. 50 000 bricks of a lumpy sphere, 51 MB
/// of u16: chunks of 16 bricks give 31.2 MB and 0.05 ms, 32 give 29.9 MB, 64 give 29.8 MB and 0.13 ms, 256 give 29.7 MB
/// and 0.62 ms. A dragon at --res 256, as u16: 1.46, 1.38, 1.38 and 1.38 bytes a sample.
const CHUNK_BRICKS: usize = 32;

/// Rows in a chunk of a table, which is always read whole: 48 KiB of bounds. With a tenth of it the digests, which do
/// not compress, would take a twentieth of what they protect.
const CHUNK_ROWS: usize = 4096;

/// Largest number of bricks: the last index means that there is no brick.
pub(super) const MAX_BRICKS: usize = NO_BRICK as usize;

/// Shape of a dense grid's samples: nodes along z, y and x.
pub(super) fn dense_shape(lattice: &Lattice) -> [usize; 3] {
    let [nx, ny, nz] = lattice.nodes();
    [nz, ny, nx].map(|n| n as usize)
}

/// Shape of a sparse grid's samples.
pub(super) fn bricks_shape(bricks: usize) -> [usize; 2] {
    [bricks, BRICK_SAMPLES]
}

/// Shape of the coarse grid: one more than there are brick slots, along z, y and x.
pub(super) fn coarse_shape(lattice: &Lattice) -> [usize; 3] {
    let [px, py, pz] = brick_counts(lattice);
    [pz, py, px].map(|slots| slots as usize + 1)
}

/// Number of brick slots: blocks of 8 × 8 × 8 nodes; `None` on overflow.
pub(super) fn slot_count(lattice: &Lattice) -> Option<usize> {
    brick_counts(lattice).iter().try_fold(1_usize, |count, slots| count.checked_mul(*slots as usize))
}

/// Shape of the chunks of a dataset that we write.
pub(super) fn chunk_shape(shape: &[usize]) -> Vec<usize> {
    let sides: &[usize] = match shape {
        [_, _, _] => &CHUNK_NODES,
        [_, BRICK_SAMPLES] => &[CHUNK_BRICKS, BRICK_SAMPLES],
        [_, columns] => &[CHUNK_ROWS, *columns],
        _ => &[CHUNK_ROWS],
    };
    shape.iter().zip(sides).map(|(n, side)| *n.min(side)).collect()
}

pub(super) fn whole_extent(lattice: &Lattice) -> [i64; 6] {
    let [nx, ny, nz] = lattice.cells().map(i64::from);
    [0, nx, 0, ny, 0, nz]
}

pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Inverse of [`hex`] for 32 bytes; `None` for any other text.
pub(super) fn sha256_from_hex(text: &str) -> Option<[u8; 32]> {
    let digits: Option<Vec<u8>> = text
        .bytes()
        .map(|digit| match digit {
            b'0'..=b'9' => Some(digit - b'0'),
            b'a'..=b'f' => Some(digit - b'a' + 10),
            _ => None,
        })
        .collect();
    let bytes: Vec<u8> = digits?.chunks_exact(2).map(|pair| pair[0] << 4 | pair[1]).collect();
    (text.len() == 64).then(|| bytes.try_into().ok())?
}
