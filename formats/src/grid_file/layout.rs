//! What docs/format.md fixes: versions, chunks, checksums.

use std::fmt::Write;

use sdf_core::grid::Lattice;
use sha2::{Digest, Sha256};

use super::About;

pub(super) const FORMAT_VERSION: i128 = 1;

/// The first that lets a dataset say that it is the scalars. Readers of earlier 2.x read it too, as one array of many.
pub(super) const VTKHDF_VERSION: [i64; 2] = [2, 6];

pub(super) const IDENTITY: [f64; 9] = [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];

/// Nodes along each side of a chunk: 128 KiB of samples, which is what a reader of one spot must inflate (0.3 ms).
/// With 64 the file is 0.5 % smaller and that spot costs 8 times more; with 16 the file is 6 % larger and writing
/// takes 4 times longer.
const CHUNK_SIDE: u32 = 32;

/// Of 256³ samples of a lumpy sphere, 67 MB, on one core: level 2 gives 42.6 MB in 0.71 s, 4 gives 41.5 MB in
/// 0.77 s, 6 gives 41.2 MB in 0.87 s, 9 gives 41.0 MB in 1.45 s. Level 1 gives 46.6 MB and takes longer to read.
pub(super) const DEFLATE_LEVEL: u32 = 4;

/// The longest text of an attribute, in bytes: a path or a sentence has a hundred times less, and HDF5 cannot keep
/// more in the header of an object.
pub(super) const MOST_TEXT: usize = 1 << 16;

pub(super) const SIGN_METHODS: [&str; 2] = ["pseudo-normal", "winding"];

/// Along z, y and x.
pub(super) fn shape(lattice: &Lattice) -> [usize; 3] {
    let [nx, ny, nz] = lattice.nodes();
    [nz, ny, nx].map(|n| n as usize)
}

/// Along z, y and x.
pub(super) fn chunk_shape(lattice: &Lattice) -> [usize; 3] {
    shape(lattice).map(|n| n.min(CHUNK_SIDE as usize))
}

pub(super) fn whole_extent(lattice: &Lattice) -> [i64; 6] {
    let [nx, ny, nz] = lattice.cells().map(i64::from);
    [0, nx, 0, ny, 0, nz]
}

/// SHA-256 over the samples as little-endian f32, x fastest.
pub(super) fn samples_sha256(distances: &[f32]) -> String {
    let mut hasher = Sha256::new();
    let mut bytes = Vec::with_capacity(1 << 14);
    for piece in distances.chunks(1 << 12) {
        bytes.clear();
        bytes.extend(piece.iter().flat_map(|distance| distance.to_le_bytes()));
        hasher.update(&bytes);
    }
    hex(&hasher.finalize())
}

/// SHA-256 over the text of all other attributes of /sdf, one line each, as docs/format.md gives it.
pub(super) fn attributes_sha256(lattice: &Lattice, about: &About, samples_sha256: &str) -> String {
    let [ox, oy, oz] = lattice.origin().map(f64::to_bits);
    let [nx, ny, nz] = lattice.nodes();
    let mut text = String::new();
    let mut line = |name: &str, value: &dyn std::fmt::Display| {
        writeln!(text, "{name}={value}").expect("a String takes everything");
    };
    line("format_version", &FORMAT_VERSION);
    line("layout", &"dense");
    line("origin", &format_args!("{ox:016x} {oy:016x} {oz:016x}"));
    line("spacing", &format_args!("{:016x}", lattice.spacing().to_bits()));
    line("counts", &format_args!("{nx} {ny} {nz}"));
    line("sign_method", &about.sign_method);
    line("sign_verdict", &about.sign_verdict);
    line("slope_bound", &format_args!("{:016x}", about.slope_bound.to_bits()));
    line("error_bound", &format_args!("{:016x}", about.error_bound.to_bits()));
    line("source_name", &about.source.name);
    line("source_sha256", &hex(&about.source.sha256));
    line("source_triangles", &about.source.triangles);
    line("tool", &about.tool);
    line("options", &about.options);
    line("samples_sha256", &samples_sha256);
    hex(&Sha256::digest(text))
}

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
