//! Numbers and indices against the standard library, bit for bit.

use sdf_procedural::random::Random;

use super::*;

/// Random digits and tokens.
struct Tokens(Random);

impl Tokens {
    fn digits(&mut self, max_count: usize) -> String {
        (0..self.0.below(max_count + 1)).map(|_| char::from(b'0' + self.0.below(10) as u8)).collect()
    }

    /// A number in one of many spellings, or almost a number.
    fn token(&mut self) -> String {
        let value = f64::from_bits(self.0.bits());
        let near = value.abs().log10().rem_euclid(9.0) - 4.0;
        match self.0.below(8) {
            0 => format!("{value:e}"),
            1 => format!("{:.*}", self.0.below(18), near),
            2 => format!("{near:?}"),
            3 => format!("{:.*e}", self.0.below(20), near),
            4 => (1_u64 << 53).wrapping_add(self.0.below(5) as u64).wrapping_sub(2).to_string(),
            5 => format!("{}{}.{}", ["", "-", "+"][self.0.below(3)], self.digits(21), self.digits(24)),
            6 => format!("{}.{}e{}{}", self.digits(9), self.digits(9), ["", "-", "+"][self.0.below(3)], self.digits(5)),
            _ => (0..self.0.below(12)).map(|_| char::from(b"0123456789+-.eE/ :"[self.0.below(18)])).collect(),
        }
    }
}

#[test]
fn every_number_has_the_bits_that_std_reads() {
    let seed = 0x6f62_6a20_6e75_6d62;
    let mut tokens = Tokens(Random::new(seed));
    let mut finite_count = 0;
    for _ in 0..400_000 {
        let token = tokens.token();
        let found = number::<f64>(token.as_bytes()).map(f64::to_bits);
        assert_eq!(found, token.parse().ok().map(f64::to_bits), "{token:?}, seed {seed:#x}");
        let found = number::<f32>(token.as_bytes()).map(f32::to_bits);
        assert_eq!(found, token.parse().ok().map(f32::to_bits), "{token:?}, seed {seed:#x}");
        finite_count += usize::from(finite_prefix(token.as_bytes()).is_some());
    }
    assert!(finite_count > 100_000, "only {finite_count} took the fast path");
}

#[test]
fn text_after_a_number_does_not_change_it() {
    let seed = 0x7461_696c;
    let mut tokens = Tokens(Random::new(seed));
    for _ in 0..100_000 {
        let token = tokens.token();
        let Some(alone) = finite_prefix(token.as_bytes()) else { continue };
        let tail = [" ", "\n", " 123456789", "/7/8 9", "\0\0\0", "\u{ff}"][tokens.0.below(6)];
        let text = format!("{}{tail}", &token[..alone.length]);
        let found = finite_prefix(text.as_bytes()).unwrap();
        assert_eq!((found.length, found.value.to_bits()), (alone.length, alone.value.to_bits()), "{text:?}, {seed:#x}");
    }
}

#[test]
fn digits_are_read_as_if_one_by_one() {
    let seed = 0x6469_6769;
    let mut tokens = Tokens(Random::new(seed));
    for _ in 0..100_000 {
        let mut text = tokens.digits(22).into_bytes();
        text.extend((0..tokens.0.below(4)).map(|_| tokens.0.bits() as u8));
        let count = text.iter().take_while(|byte| byte.is_ascii_digit()).count();
        assert_eq!(digit_count(&text), count, "{text:?}, seed {seed:#x}");
        let read = str::from_utf8(&text[..count]).unwrap().parse().ok().filter(|_| count <= 19);
        assert_eq!(index_prefix(&text).map(|number| number.value), read, "{text:?}, seed {seed:#x}");
    }
}
