//! Decimal numbers in text.
//!
//! Real numbers are parsed by fast-float2 (D. Lemire 2021, "Number parsing at a gigabyte per second"), correctly
//! rounded. Indices are our own: most have up to 7 digits, which one 64-bit word holds and a few multiplications
//! convert.

#[cfg(test)]
mod tests;

use fast_float2::FastFloat;

/// A number at the beginning of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Prefix<T> {
    pub value: T,
    /// Bytes of the text that spell it.
    pub length: usize,
}

/// The number that a whole token spells, correctly rounded; infinite or NaN where it says so or is too large.
#[inline]
pub(super) fn number<T: FastFloat>(token: &[u8]) -> Option<T> {
    fast_float2::parse(token).ok()
}

/// The finite number that a text begins with, correctly rounded.
#[inline(always)]
pub(super) fn finite_prefix(text: &[u8]) -> Option<Prefix<f64>> {
    let (value, length) = fast_float2::parse_partial::<f64, _>(text).ok()?;
    value.is_finite().then_some(Prefix { value, length })
}

/// The whole number without a sign that a text begins with, if it has at most 19 digits.
#[inline(always)]
pub(super) fn index_prefix(text: &[u8]) -> Option<Prefix<u64>> {
    let bytes = eight_bytes(text, 0);
    let length = leading_digits(bytes);
    if (1..8).contains(&length) {
        return Some(Prefix { value: digits_value(bytes, length), length });
    }
    long_index_prefix(text)
}

#[cold]
fn long_index_prefix(text: &[u8]) -> Option<Prefix<u64>> {
    let length = digit_count(text);
    let digits = text[..length].iter().map(|byte| u64::from(byte - b'0'));
    // 19 digits cannot overflow 64 bits.
    (1..=19).contains(&length).then(|| Prefix { value: digits.fold(0, |value, digit| 10 * value + digit), length })
}

/// Number of digits at the beginning of a text.
#[inline]
pub(super) fn digit_count(text: &[u8]) -> usize {
    let mut count = 0;
    while leading_digits(eight_bytes(text, count)) == 8 {
        count += 8;
    }
    count + leading_digits(eight_bytes(text, count))
}

/// Eight bytes from an offset on, the first in the lowest byte; zeros after the end.
#[inline]
fn eight_bytes(text: &[u8], offset: usize) -> u64 {
    match text.get(offset..).and_then(|rest| rest.first_chunk()) {
        Some(bytes) => u64::from_le_bytes(*bytes),
        None => last_bytes(text.get(offset..).unwrap_or_default()),
    }
}

#[cold]
fn last_bytes(rest: &[u8]) -> u64 {
    rest.iter().rev().fold(0, |bytes, byte| bytes << 8 | u64::from(*byte))
}

/// Number of bytes that are digits, from the lowest on. With '0' … '9' mapped to 0 … 9 by XOR, adding 0x76 leaves
/// exactly those below 0x80. Carries move upwards, past the first byte that is not a digit.
#[inline]
fn leading_digits(bytes: u64) -> usize {
    let digits = bytes ^ (EACH_BYTE * 0x30);
    let others = (digits.wrapping_add(EACH_BYTE * 0x76) | digits) & (EACH_BYTE * 0x80);
    others.trailing_zeros() as usize / 8
}

/// Value of 1 to 8 digits, the first in the lowest byte: combines pairs, then fours, then eights.
#[inline]
fn digits_value(bytes: u64, count: usize) -> u64 {
    // Shifting puts zeros before the digits and drops the bytes after them.
    let digits = (bytes & (EACH_BYTE * 0x0f)) << (64 - 8 * count as u32);
    let pairs = (digits.wrapping_mul(10).wrapping_add(digits >> 8)) & 0x00ff_00ff_00ff_00ff;
    let fours = (pairs.wrapping_mul(100).wrapping_add(pairs >> 16)) & 0x0000_ffff_0000_ffff;
    fours.wrapping_mul(10_000).wrapping_add(fours >> 32) & 0xffff_ffff
}

/// A one in each byte.
const EACH_BYTE: u64 = 0x0101_0101_0101_0101;
