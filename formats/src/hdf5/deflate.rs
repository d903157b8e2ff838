//! Deflating of chunks, each plane of bytes by itself: a zlib stream (RFC 1950, 1951) that any inflater reads.
//!
//! Shuffling leaves the low bytes of all elements together, then the next, and so on. Low bytes are noise: deflate would save a few
//! percent of them, and take most of its time for it, and reading too. So a plane whose bytes are spread over many values and do not
//! repeat stands in stored blocks, which are copied; the others are deflated, each with codes of its own, and end at a byte by an
//! empty stored block (zlib's Z_SYNC_FLUSH).

use std::io;

use flate2::{Compress, Compression, FlushCompress, Status};

/// Deflate level of planes: 4 saves one percent of a file, and takes a fifth longer to write. Level 1 has fixed codes.
pub(super) const LEVEL: u32 = 2;

/// Bytes of a stored block at most, RFC 1951, 3.2.4.
const STORED_BYTES: usize = 65_535;
/// Method 8 with a window of 32 KiB, and the check of the header.
const HEADER: [u8; 2] = [0x78, 0x5e];
/// An empty last block with fixed codes.
const LAST_BLOCK: [u8; 2] = [0x03, 0x00];

/// Deflates one chunk after the other.
pub(super) struct Deflater {
    compress: Compress,
    plane: Vec<u8>,
}

impl Deflater {
    pub(super) fn new() -> Self {
        Self { compress: Compress::new(Compression::new(LEVEL), false), plane: Vec::new() }
    }

    /// The stream of a shuffled chunk. `layers` are the distances at which the bytes of a plane may repeat.
    pub(super) fn chunk(&mut self, shuffled: &[u8], element_bytes: usize, layers: &[usize]) -> io::Result<Vec<u8>> {
        let mut out = Vec::with_capacity(shuffled.len() + shuffled.len() / 64 + 64);
        out.extend(HEADER);
        for plane in shuffled.chunks(shuffled.len().div_ceil(element_bytes).max(1)) {
            if is_noise(plane, min_values(element_bytes)) && !repeats(plane, layers) {
                store(plane, &mut out);
            } else {
                out.extend(self.deflate(plane)?);
            }
        }
        out.extend(LAST_BLOCK);
        out.extend(adler32(shuffled).to_be_bytes());
        Ok(out)
    }

    /// Blocks that end at a byte and are not the last.
    fn deflate(&mut self, plane: &[u8]) -> io::Result<&[u8]> {
        self.compress.reset();
        self.plane.clear();
        // More than deflate ever takes.
        self.plane.reserve(plane.len() + plane.len() / 8 + 64);
        let status = self.compress.compress_vec(plane, &mut self.plane, FlushCompress::Sync);
        match status {
            Ok(Status::Ok) if self.compress.total_in() == plane.len() as u64 => Ok(&self.plane),
            _ => Err(io::Error::other("a chunk was not deflated")),
        }
    }
}

/// Number of values, all alike frequent, from which on a plane is stored. u16 are differences of codes, which repeat nowhere: a sparse dragon
/// in 512 cells has 11.6 MB with 64, packed in 0.19 s, 11.9 MB in 0.165 s with 48, 12.1 MB in 0.155 s with 32; as one stream each, at
/// level 4, it has 11.6 MB in 0.35 s. Others are f32, of whose mantissa little can be saved: a dense dragon in 256 cells has 17.9 MB in 0.18 s
/// with 192, 18.3 MB in 0.16 s with 64; as one stream each 17.4 MB in 0.4 s.
fn min_values(element_bytes: usize) -> u64 {
    if element_bytes == 2 { 48 } else { 192 }
}

/// `true` if the bytes are spread as widely as so many values that are all alike frequent: n² / Σ c² of their counts c (Simpson 1949).
fn is_noise(plane: &[u8], values: u64) -> bool {
    // Four tables: a count that was just written is not read at once.
    let mut tables = [[0_u32; 256]; 4];
    let (quads, rest) = plane.as_chunks::<4>();
    for quad in quads {
        for (table, byte) in tables.iter_mut().zip(quad) {
            table[usize::from(*byte)] += 1;
        }
    }
    rest.iter().for_each(|byte| tables[0][usize::from(*byte)] += 1);
    let count = |byte: usize| tables.iter().map(|table| u64::from(table[byte])).sum::<u64>();
    let squares: u64 = (0..256).map(|byte| count(byte).pow(2)).sum();
    let bytes = plane.len() as u64;
    squares * values <= bytes * bytes
}

/// `true` if an eighth of the bytes equal that before them, or that of a row or layer before.
fn repeats(plane: &[u8], layers: &[usize]) -> bool {
    layers.iter().any(|distance| {
        let earlier = plane.iter().zip(plane.get(*distance..).unwrap_or_default());
        earlier.filter(|(a, b)| a == b).count() * 8 > plane.len()
    })
}

fn store(plane: &[u8], out: &mut Vec<u8>) {
    for block in plane.chunks(STORED_BYTES) {
        let length = block.len() as u16;
        out.push(0);
        out.extend(length.to_le_bytes());
        out.extend((!length).to_le_bytes());
        out.extend(block);
    }
}

/// RFC 1950, section 8. Blocks are so short that sums do not overflow.
fn adler32(bytes: &[u8]) -> u32 {
    const MODULUS: u32 = 65_521;
    const BLOCK_BYTES: usize = 5552;
    let [mut a, mut b] = [1_u32, 0];
    for block in bytes.chunks(BLOCK_BYTES) {
        // b grows by a at each byte: by n times the first a, and by each byte as often as it was in a.
        let (groups, rest) = block.as_chunks::<16>();
        for group in groups {
            let sum: u32 = group.iter().map(|byte| u32::from(*byte)).sum();
            let weighted: u32 = group.iter().zip((1..=16).rev()).map(|(byte, weight)| u32::from(*byte) * weight).sum();
            b += 16 * a + weighted;
            a += sum;
        }
        for byte in rest {
            a += u32::from(*byte);
            b += a;
        }
        a %= MODULUS;
        b %= MODULUS;
    }
    b << 16 | a
}

#[cfg(test)]
mod tests {
    use std::io::Read;

    use super::*;

    fn inflated(stream: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        flate2::read::ZlibDecoder::new(stream).read_to_end(&mut bytes).unwrap();
        bytes
    }

    fn noise(count: usize) -> Vec<u8> {
        let mut state = 1_u64;
        let next = |_| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 56) as u8
        };
        (0..count).map(next).collect()
    }

    /// Planes that are stored, deflated or empty; longer than a stored block and than a block of the checksum.
    #[test]
    fn every_chunk_inflates_to_itself() {
        let mut deflater = Deflater::new();
        for (planes, element_bytes) in [
            (vec![], 4),
            (vec![7], 1),
            (noise(3), 2),
            (noise(4 * 70_000), 4),
            ([vec![255; 200_000], noise(200_000)].concat(), 2),
            ([noise(16_384), vec![0; 16_384]].concat(), 2),
        ] {
            let stream = deflater.chunk(&planes, element_bytes, &[1, 32]).unwrap();
            assert!(inflated(&stream) == planes, "{} bytes", planes.len());
        }
    }

    #[test]
    fn noise_is_stored_and_what_repeats_is_deflated() {
        let mut deflater = Deflater::new();
        let mut bytes = |plane: &[u8]| deflater.chunk(plane, 1, &[1, 64]).unwrap().len();
        let noise = noise(1 << 15);
        assert_eq!(bytes(&noise), noise.len() + 2 + 5 + 2 + 4);
        assert!(bytes(&vec![9; 1 << 15]) < 100);
        // All values alike frequent, in runs, and in rows that are all the same.
        let runs: Vec<u8> = noise.iter().flat_map(|byte| [*byte; 8]).collect();
        assert!(bytes(&runs) < runs.len() / 4);
        assert!(bytes(&noise[..64].repeat(512)) < 2000);
    }
}
