//! Decimal numbers in text, eight digits at a time.

/// A number at the beginning of a text.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Spelled<T> {
    pub value: T,
    /// How many bytes it takes.
    pub length: usize,
}

/// The number that a token spells, correctly rounded; infinite or NaN where it says so or is too large.
#[inline]
pub(super) fn number(token: &[u8]) -> Option<f64> {
    match plain_number(token) {
        Some(Spelled { value, length }) if length == token.len() => Some(value),
        _ => slow_number(token),
    }
}

#[cold]
fn slow_number(token: &[u8]) -> Option<f64> {
    str::from_utf8(token).ok()?.parse().ok()
}

/// The number that a text begins with, correctly rounded, if it is of the usual size. `None` says nothing of the text.
///
/// Up to 2⁵³ the digits are exact as f64, and so are the powers of ten up to 10²²: their product or quotient is rounded
/// once, and so correctly (W. Clinger 1990, "How to read floating point numbers accurately").
#[inline(always)]
pub(super) fn plain_number(text: &[u8]) -> Option<Spelled<f64>> {
    let mut at = usize::from(matches!(text, [b'-' | b'+', ..]));
    let mut mantissa = 0;
    let whole = take_digits(text, &mut at, &mut mantissa);
    let mut decimals = 0;
    if text.get(at) == Some(&b'.') {
        at += 1;
        decimals = take_digits(text, &mut at, &mut mantissa);
    }
    // 19 digits cannot overflow 64 bits.
    if !(1..=19).contains(&(whole + decimals)) || mantissa > 1 << 53 {
        return None;
    }
    let mut exponent = -(decimals as i64);
    if matches!(text.get(at), Some(b'e' | b'E')) {
        exponent += take_exponent(text, &mut at)?;
    }
    let power = *TEN.get(exponent.unsigned_abs() as usize)?;
    let value = if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
    Some(Spelled { value: if text[0] == b'-' { -value } else { value }, length: at })
}

/// The letter, a sign and one to four digits.
#[inline]
fn take_exponent(text: &[u8], at: &mut usize) -> Option<i64> {
    let negative = text.get(*at + 1) == Some(&b'-');
    *at += if negative || text.get(*at + 1) == Some(&b'+') { 2 } else { 1 };
    let mut exponent = 0;
    let count = take_digits(text, at, &mut exponent);
    (1..=4).contains(&count).then(|| if negative { -(exponent as i64) } else { exponent as i64 })
}

/// The whole number that a text begins with, without a sign. `None` where there is none of up to 19 digits.
#[inline(always)]
pub(super) fn whole_number(text: &[u8]) -> Option<Spelled<u64>> {
    let bytes = eight_bytes(text, 0);
    let length = count_digits(bytes);
    if (1..8).contains(&length) {
        return Some(Spelled { value: value_of_digits(bytes, length), length });
    }
    let (mut value, mut length) = (0, 0);
    let count = take_digits(text, &mut length, &mut value);
    (1..=19).contains(&count).then_some(Spelled { value, length })
}

/// How many digits a text begins with.
#[inline]
pub(super) fn digits(text: &[u8]) -> usize {
    let mut at = 0;
    while count_digits(eight_bytes(text, at)) == 8 {
        at += 8;
    }
    at + count_digits(eight_bytes(text, at))
}

/// Appends the digits at a place to a number, which wraps around above 64 bits, and steps over them.
#[inline]
fn take_digits(text: &[u8], at: &mut usize, number: &mut u64) -> usize {
    let first = *at;
    loop {
        let bytes = eight_bytes(text, *at);
        let count = count_digits(bytes);
        *number = number.wrapping_mul(POWERS[count]).wrapping_add(value_of_digits(bytes, count));
        *at += count;
        if count < 8 {
            return *at - first;
        }
    }
}

/// The bytes from a place on, the first lowest, and zeros after the end.
#[inline]
fn eight_bytes(text: &[u8], at: usize) -> u64 {
    match text.get(at..).and_then(|rest| rest.first_chunk()) {
        Some(bytes) => u64::from_le_bytes(*bytes),
        None => last_bytes(text.get(at..).unwrap_or_default()),
    }
}

#[cold]
fn last_bytes(rest: &[u8]) -> u64 {
    rest.iter().rev().fold(0, |bytes, byte| bytes << 8 | u64::from(*byte))
}

/// How many bytes are digits, from the lowest on: 0 to 9 stay below 0x80 with 0x76 more, all others do not. What they
/// carry goes upwards, past the first of them.
#[inline]
fn count_digits(bytes: u64) -> usize {
    let digits = bytes ^ (EACH * 0x30);
    let others = (digits.wrapping_add(EACH * 0x76) | digits) & (EACH * 0x80);
    others.trailing_zeros() as usize / 8
}

/// The number that up to eight digits spell, the lowest byte first: pairs, then fours, then eights of them.
#[inline]
fn value_of_digits(bytes: u64, count: usize) -> u64 {
    // Zeros before them, and what follows them pushed out. A shift by 64 is none; then there are no digits.
    let digits = (bytes & (EACH * 0x0f)).wrapping_shl(64 - 8 * count as u32);
    let digits = if count == 0 { 0 } else { digits };
    let pairs = (digits.wrapping_mul(10).wrapping_add(digits >> 8)) & 0x00ff_00ff_00ff_00ff;
    let fours = (pairs.wrapping_mul(100).wrapping_add(pairs >> 16)) & 0x0000_ffff_0000_ffff;
    fours.wrapping_mul(10_000).wrapping_add(fours >> 32) & 0xffff_ffff
}

/// A one in each byte.
const EACH: u64 = 0x0101_0101_0101_0101;

const POWERS: [u64; 9] = [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000];

const TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

#[cfg(test)]
mod tests {
    use sdf_procedural::random::next_bits;

    use super::*;

    struct Random(u64);

    impl Random {
        fn next(&mut self) -> u64 {
            next_bits(&mut self.0)
        }

        fn below(&mut self, n: u64) -> u64 {
            self.next() % n
        }

        fn digits(&mut self, most: u64) -> String {
            (0..self.below(most + 1)).map(|_| char::from(b'0' + self.below(10) as u8)).collect()
        }

        /// A number in one of the ways that files write them, or almost one.
        fn token(&mut self) -> String {
            let value = f64::from_bits(self.next());
            let near = value.abs().log10().rem_euclid(9.0) - 4.0;
            match self.below(8) {
                0 => format!("{value:e}"),
                1 => format!("{:.*}", self.below(18) as usize, near),
                2 => format!("{near:?}"),
                3 => format!("{:.*e}", self.below(20) as usize, near),
                4 => (1_u64 << 53).wrapping_add(self.below(5)).wrapping_sub(2).to_string(),
                5 => format!("{}{}.{}", ["", "-", "+"][self.below(3) as usize], self.digits(21), self.digits(24)),
                6 => format!(
                    "{}.{}e{}{}",
                    self.digits(9),
                    self.digits(9),
                    ["", "-", "+"][self.below(3) as usize],
                    self.digits(5)
                ),
                _ => (0..self.below(12)).map(|_| char::from(b"0123456789+-.eE/ :"[self.below(18) as usize])).collect(),
            }
        }
    }

    #[test]
    fn every_number_has_the_bits_that_std_reads() {
        let seed = 0x6f62_6a20_6e75_6d62;
        let mut random = Random(seed);
        let mut plain = 0;
        for _ in 0..400_000 {
            let token = random.token();
            let found = number(token.as_bytes()).map(f64::to_bits);
            assert_eq!(found, token.parse().ok().map(f64::to_bits), "{token:?}, seed {seed:#x}");
            plain += usize::from(plain_number(token.as_bytes()).is_some());
        }
        assert!(plain > 100_000, "only {plain} took the short way");
    }

    #[test]
    fn what_follows_a_number_does_not_change_it() {
        let seed = 0x7461_696c;
        let mut random = Random(seed);
        for _ in 0..100_000 {
            let token = random.token();
            let Some(alone) = plain_number(token.as_bytes()) else { continue };
            let tail = [" ", "\n", " 123456789", "/7/8 9", "\0\0\0", "\u{ff}"][random.below(6) as usize];
            let text = format!("{}{tail}", &token[..alone.length]);
            let found = plain_number(text.as_bytes()).unwrap();
            assert_eq!(
                (found.length, found.value.to_bits()),
                (alone.length, alone.value.to_bits()),
                "{text:?}, {seed:#x}"
            );
        }
    }

    #[test]
    fn digits_are_counted_as_one_by_one() {
        let seed = 0x6469_6769;
        let mut random = Random(seed);
        for _ in 0..100_000 {
            let mut text = random.digits(22).into_bytes();
            text.extend((0..random.below(4)).map(|_| random.next() as u8));
            let count = text.iter().take_while(|byte| byte.is_ascii_digit()).count();
            assert_eq!(digits(&text), count, "{text:?}, seed {seed:#x}");
            let read = str::from_utf8(&text[..count]).unwrap().parse().ok().filter(|_| count <= 19);
            assert_eq!(whole_number(&text).map(|number| number.value), read, "{text:?}, seed {seed:#x}");
        }
    }
}
