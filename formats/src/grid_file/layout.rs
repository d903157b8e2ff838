//! What docs/format.md fixes: versions, chunks, checksums.

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::{BRICK_SAMPLES, NO_BRICK, brick_counts};

pub(super) const FORMAT_VERSION: i128 = 2;

/// The first that lets a dataset say that it is the scalars. Readers of earlier 2.x read it too, as one array of many.
pub(super) const VTKHDF_VERSION: [i64; 2] = [2, 6];

pub(super) const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Nodes along each side of a chunk of nodes: 128 KiB of samples, which is what a reader of one spot must inflate (0.3 ms).
/// With 64 the file is 0.5 % smaller and that spot costs 8 times more; with 16 the file is 6 % larger and writing
/// takes 4 times longer.
const CHUNK_SIDE: usize = 32;

/// Bricks in a chunk of samples: 32 KiB of u16, inflated and hashed in 0.07 ms. Of 50 000 bricks of a lumpy sphere, 51 MB
/// of u16, 16 bricks give 31.2 MB and 0.05 ms, 32 give 29.9 MB, 64 give 29.8 MB and 0.13 ms, 256 give 29.7 MB and 0.62 ms.
/// Of a dragon at --res 256, as u16, they give 1.46, 1.38, 1.38 and 1.38 bytes a sample.
const CHUNK_BRICKS: usize = 32;

/// Rows in a chunk of a table, which is read whole anyway: 48 KiB of bounds. With a tenth of it the
/// digests, which do not pack, would take a twentieth of what they vouch for.
const CHUNK_ROWS: usize = 4096;

/// Of 256³ samples of a lumpy sphere, 67 MB, on one core: level 2 gives 42.6 MB in 0.71 s, 4 gives 41.5 MB in
/// 0.77 s, 6 gives 41.2 MB in 0.87 s, 9 gives 41.0 MB in 1.45 s. Level 1 gives 46.6 MB and takes longer to read.
pub(super) const DEFLATE_LEVEL: u32 = 4;

/// The longest text of an attribute, in bytes: a path or a sentence has a hundred times less, and HDF5 cannot keep
/// more in the header of an object.
pub(super) const MAX_TEXT: usize = 1 << 16;

/// The last number stands for no brick.
pub(super) const MAX_BRICKS: usize = NO_BRICK as usize;

pub(super) const SIGN_METHODS: [&str; 2] = ["pseudo-normal", "winding"];

/// Of the samples of a dense grid: nodes along z, y and x.
pub(super) fn shape(lattice: &Lattice) -> [usize; 3] {
    let [nx, ny, nz] = lattice.nodes();
    [nz, ny, nx].map(|n| n as usize)
}

/// Of the samples of a sparse grid.
pub(super) fn bricks_shape(bricks: usize) -> [usize; 2] {
    [bricks, BRICK_SAMPLES]
}

/// Of the coarse grid: along z, y and x one more than there are places of bricks.
pub(super) fn coarse_shape(lattice: &Lattice) -> [usize; 3] {
    let [px, py, pz] = brick_counts(lattice);
    [pz, py, px].map(|along| along as usize + 1)
}

/// `None` where that is beyond all numbers.
pub(super) fn place_count(lattice: &Lattice) -> Option<usize> {
    brick_counts(lattice).iter().try_fold(1_usize, |count, along| count.checked_mul(*along as usize))
}

/// How a dataset of ours is cut.
pub(super) fn chunk_shape(shape: &[usize]) -> Vec<usize> {
    let sides: &[usize] = match shape {
        [_, _, _] => &[CHUNK_SIDE; 3],
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

pub(super) const DIGEST_BYTES: usize = 32;

pub(super) fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// `None` unless it is what [`hex`] makes of 32 bytes.
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
