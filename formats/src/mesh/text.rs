//! Tokens, lines and numbers of the text formats.

use super::error::{Fault, quote};

/// A position in a text. Lines end with LF, CR LF or CR. Where `OBJ` holds, `#` begins a comment, and a backslash at the
/// end of a line joins it to the next one (not in a comment, which may end in a Windows path).
pub(super) struct Text<'a, const OBJ: bool> {
    bytes: &'a [u8],
    at: usize,
    /// The line of the position, counted from 1.
    pub(super) line: usize,
}

impl<'a, const OBJ: bool> Text<'a, OBJ> {
    /// Begins after a byte order mark, if there is one.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), at: 0, line: 1 }
    }

    /// Begins within a file, at the first byte of the given line.
    pub(super) fn from_line(bytes: &'a [u8], line: usize) -> Self {
        Self { bytes, at: 0, line }
    }

    /// The bytes not yet read.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.at..]
    }

    /// The next token of this line, empty at the line's end.
    #[inline]
    pub(super) fn token(&mut self) -> &'a [u8] {
        loop {
            match self.bytes.get(self.at) {
                Some(b' ' | b'\t' | 0x0b | 0x0c) => self.at += 1,
                Some(b'\\') if OBJ && self.joins() => {
                    self.at += 1;
                    self.step_over_line_end();
                }
                _ => break,
            }
        }
        let start = self.at;
        while let Some(&byte) = self.bytes.get(self.at) {
            let ends = match byte {
                _ if !ENDS_TOKEN[byte as usize] => false,
                b'#' => OBJ,
                b'\\' => OBJ && self.joins(),
                _ => true,
            };
            if ends {
                break;
            }
            self.at += 1;
        }
        &self.bytes[start..self.at]
    }

    /// Whether nothing but blanks is left of the line.
    pub(super) fn is_line_empty(&self) -> bool {
        let blanks = self.rest().iter().position(|b| !matches!(b, b' ' | b'\t' | 0x0b | 0x0c));
        blanks.is_none_or(|i| matches!(self.rest()[i], b'\n' | b'\r'))
    }

    /// Goes to the next line, past whatever is left of this one; false at the end of the text.
    #[inline]
    pub(super) fn next_line(&mut self) -> bool {
        let mut comment = false;
        while let Some(&byte) = self.bytes.get(self.at) {
            match byte {
                b'\n' | b'\r' => {
                    self.step_over_line_end();
                    return self.at < self.bytes.len();
                }
                b'#' if OBJ => comment = true,
                b'\\' if OBJ && !comment && self.joins() => {
                    self.at += 1;
                    self.step_over_line_end();
                    continue;
                }
                _ => {}
            }
            self.at += 1;
        }
        false
    }

    /// Three coordinates, each exactly rounded and finite.
    #[inline]
    pub(super) fn coordinates(&mut self) -> Result<[f64; 3], Fault> {
        let mut point = [0.0; 3];
        for (found, coordinate) in point.iter_mut().enumerate() {
            let token = self.token();
            match number(token) {
                Some(value) if value.is_finite() => *coordinate = value,
                _ => return Err(self.bad_coordinate(token, found)),
            }
        }
        Ok(point)
    }

    #[cold]
    fn bad_coordinate(&self, token: &[u8], found: usize) -> Fault {
        if token.is_empty() {
            return Fault::on_line(self.line, "3 coordinates", found.to_string());
        }
        let wanted = if number(token).is_some() { "a finite number" } else { "a number" };
        Fault::on_line(self.line, wanted, quote(token))
    }

    /// Whether the backslash at the position ends its line.
    fn joins(&self) -> bool {
        matches!(self.bytes.get(self.at + 1), Some(b'\n' | b'\r'))
    }

    fn step_over_line_end(&mut self) {
        self.at += if self.bytes[self.at..].starts_with(b"\r\n") { 2 } else { 1 };
        self.line += 1;
    }
}

/// The bytes that may end a token: blanks, line ends, and the two of OBJ.
const ENDS_TOKEN: [bool; 256] = {
    let mut table = [false; 256];
    let ends = b" \t\x0b\x0c\r\n#\\";
    let mut i = 0;
    while i < ends.len() {
        table[ends[i] as usize] = true;
        i += 1;
    }
    table
};

/// The number that a token spells, correctly rounded; infinite or NaN where it says so or is too large.
///
/// Up to 2⁵³ the digits are exact as f64, and so are the powers of ten up to 10²²: their product or quotient is rounded
/// once, and so correctly (W. Clinger 1990, "How to read floating point numbers accurately"). The rest goes to std.
#[inline]
pub(super) fn number(token: &[u8]) -> Option<f64> {
    let (negative, digits) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, token),
    };
    let (mut mantissa, mut count, mut decimals) = (0u64, 0, 0);
    let mut point = false;
    for &byte in digits {
        match byte {
            b'0'..=b'9' => {
                mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
                count += 1;
                decimals += usize::from(point);
            }
            b'.' if !point => point = true,
            _ => return slow_number(token),
        }
    }
    // 19 digits cannot overflow 64 bits.
    if count == 0 || count > 19 || mantissa > 1 << 53 || decimals >= TEN.len() {
        return slow_number(token);
    }
    let value = mantissa as f64 / TEN[decimals];
    Some(if negative { -value } else { value })
}

#[cold]
fn slow_number(token: &[u8]) -> Option<f64> {
    str::from_utf8(token).ok()?.parse().ok()
}

const TEN: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Whether a token is a keyword, in any case of letters.
pub(super) fn is(token: &[u8], keyword: &str) -> bool {
    token.eq_ignore_ascii_case(keyword.as_bytes())
}
