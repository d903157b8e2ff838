//! CRC-32 of a blob: that of IEEE 802.3, zlib and PNG, by a table of sixteen entries, so that it costs 64 bytes of flash.

use super::CHECKSUM_AT;

/// The reversed polynomial.
const POLYNOMIAL: u32 = 0xedb8_8320;

/// Remainders of the sixteen values of four bits.
const TABLE: [u32; 16] = table();

const fn table() -> [u32; 16] {
    let mut table = [0; 16];
    let mut value = 0;
    while value < 16 {
        let mut remainder = value as u32;
        let mut bit = 0;
        while bit < 4 {
            remainder = (remainder >> 1) ^ if remainder & 1 == 1 { POLYNOMIAL } else { 0 };
            bit += 1;
        }
        table[value] = remainder;
        value += 1;
    }
    table
}

/// CRC-32 of a blob's bytes without the four that hold it.
pub fn checksum(bytes: &[u8]) -> u32 {
    let (before, from) = bytes.split_at_checked(CHECKSUM_AT).unwrap_or((bytes, &[]));
    !update(update(!0, before), from.get(4..).unwrap_or(&[]))
}

fn update(remainder: u32, bytes: &[u8]) -> u32 {
    bytes.iter().fold(remainder, |remainder, byte| four_bits(four_bits(remainder ^ u32::from(*byte))))
}

fn four_bits(remainder: u32) -> u32 {
    // The index is below sixteen.
    (remainder >> 4) ^ TABLE[(remainder & 15) as usize]
}
