//! Tokens, lines and numbers of the text formats.
//!
//! Each reader has a fast path for the usual spelling, which leaves the position unchanged where it does not apply, and
//! a slow path for everything else.

use memchr::{memchr2, memchr3};

use super::error::{MeshFault, quote};
use super::number::{Prefix, finite_prefix, number};

/// A position in a text. Lines end with LF, CR LF or CR. If `OBJ`, `#` begins a comment, and a backslash at the end of
/// a line joins it to the next (not in a comment, which may end in a Windows path).
pub(super) struct Text<'a, const OBJ: bool> {
    bytes: &'a [u8],
    offset: usize,
    /// Line of the position, counted from 1.
    pub(super) line: usize,
}

impl<'a, const OBJ: bool> Text<'a, OBJ> {
    /// Starts after a byte order mark, if there is one.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        Self { bytes: bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes), offset: 0, line: 1 }
    }

    /// Starts at the first byte of a line inside a file.
    pub(super) fn from_line(bytes: &'a [u8], line: usize) -> Self {
        Self { bytes, offset: 0, line }
    }

    /// Bytes after the position.
    pub(super) fn rest(&self) -> &'a [u8] {
        &self.bytes[self.offset..]
    }

    /// The next token of this line; empty at its end.
    #[inline]
    pub(super) fn token(&mut self) -> &'a [u8] {
        loop {
            match self.bytes.get(self.offset) {
                Some(b' ' | b'\t' | 0x0b | 0x0c) => self.offset += 1,
                Some(b'\\') if OBJ && self.is_joined_line_end() => {
                    self.offset += 1;
                    self.skip_line_end();
                }
                _ => break,
            }
        }
        let start = self.offset;
        while let Some(&byte) = self.bytes.get(self.offset) {
            let ends = match byte {
                _ if !ENDS_TOKEN[byte as usize] => false,
                b'#' => OBJ,
                b'\\' => OBJ && self.is_joined_line_end(),
                _ => true,
            };
            if ends {
                break;
            }
            self.offset += 1;
        }
        &self.bytes[start..self.offset]
    }

    /// The first token of a line; usually a single letter.
    #[inline]
    pub(super) fn keyword(&mut self) -> &'a [u8] {
        match self.rest() {
            [b'a'..=b'z', b' ', ..] => {
                self.offset += 1;
                &self.bytes[self.offset - 1..self.offset]
            }
            _ => self.token(),
        }
    }

    /// `true` if only blanks are left of the line.
    pub(super) fn is_line_empty(&self) -> bool {
        let blanks = self.rest().iter().position(|b| !matches!(b, b' ' | b'\t' | 0x0b | 0x0c));
        blanks.is_none_or(|i| matches!(self.rest()[i], b'\n' | b'\r'))
    }

    /// The result of `read`; if it is `None`, the position stays.
    #[inline]
    pub(super) fn attempt<T>(&mut self, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<T> {
        let offset = self.offset;
        let result = read(self);
        if result.is_none() {
            self.offset = offset;
        }
        result
    }

    /// `true` at the end of a line.
    #[inline]
    pub(super) fn is_at_line_end(&self) -> bool {
        matches!(self.rest(), [b'\n' | b'\r', ..])
    }

    /// Goes to the beginning of the next line; `false` at the end of the text.
    #[inline]
    pub(super) fn next_line(&mut self) -> bool {
        let mut is_in_comment = false;
        loop {
            let rest = self.rest();
            let found = match rest {
                [b'\n' | b'\r', ..] => Some(0),
                _ if OBJ => memchr3(b'\n', b'\r', b'\\', rest),
                _ => memchr2(b'\n', b'\r', rest),
            };
            let Some(found) = found else {
                self.offset = self.bytes.len();
                return false;
            };
            let is_backslash = rest[found] == b'\\';
            is_in_comment |= is_backslash && rest[..found].contains(&b'#');
            self.offset += found;
            if !is_backslash {
                self.skip_line_end();
                return self.offset < self.bytes.len();
            }
            self.offset += 1;
            if !is_in_comment && matches!(self.bytes.get(self.offset), Some(b'\n' | b'\r')) {
                self.skip_line_end();
            }
        }
    }

    /// Three coordinates, correctly rounded and finite.
    #[inline(always)]
    pub(super) fn coordinates(&mut self) -> Result<[f64; 3], MeshFault> {
        let point = self.attempt(|text| Some([text.fast_number()?, text.fast_number()?, text.fast_number()?]));
        point.map_or_else(|| self.slow_coordinates(), Ok)
    }

    #[inline(never)]
    fn slow_coordinates(&mut self) -> Result<[f64; 3], MeshFault> {
        let mut point = [0.0; 3];
        for (index, coordinate) in point.iter_mut().enumerate() {
            let token = self.token();
            match number::<f64>(token) {
                Some(value) if value.is_finite() => *coordinate = value,
                _ => return Err(self.bad_coordinate(token, index)),
            }
        }
        Ok(point)
    }

    /// The next token, if it is a finite number and ends at a blank or at the line's end.
    #[inline(always)]
    fn fast_number(&mut self) -> Option<f64> {
        let blanks = self.blanks();
        let Prefix { value, length } = finite_prefix(self.bytes.get(self.offset + blanks..)?)?;
        self.skip_token(blanks + length).then_some(value)
    }

    /// Number of blanks after the position.
    #[inline]
    pub(super) fn blanks(&self) -> usize {
        let rest = self.rest();
        // Usually one.
        match rest {
            [b' ', b' ' | b'\t', ..] => {
                rest.iter().position(|byte| !matches!(byte, b' ' | b'\t')).unwrap_or(rest.len())
            }
            [b' ' | b'\t', ..] => 1,
            _ => 0,
        }
    }

    /// Skips so many bytes if a token certainly ends after them.
    #[inline]
    pub(super) fn skip_token(&mut self, bytes: usize) -> bool {
        let is_end = matches!(self.bytes.get(self.offset + bytes), None | Some(b' ' | b'\t' | b'\r' | b'\n'));
        self.offset += if is_end { bytes } else { 0 };
        is_end
    }

    #[cold]
    fn bad_coordinate(&self, token: &[u8], count: usize) -> MeshFault {
        if token.is_empty() {
            return MeshFault::line(self.line, "3 coordinates", count.to_string());
        }
        let expected = if number::<f64>(token).is_some() { "a finite number" } else { "a number" };
        MeshFault::line(self.line, expected, quote(token))
    }

    /// `true` if the backslash at the position ends its line.
    fn is_joined_line_end(&self) -> bool {
        matches!(self.bytes.get(self.offset + 1), Some(b'\n' | b'\r'))
    }

    fn skip_line_end(&mut self) {
        self.offset += if self.bytes[self.offset..].starts_with(b"\r\n") { 2 } else { 1 };
        self.line += 1;
    }
}

/// Bytes that may end a token: blanks, line ends, and OBJ's `#` and backslash.
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

/// `true` if a token is a keyword, in any case of letters.
pub(super) fn is_keyword(token: &[u8], keyword: &str) -> bool {
    token.eq_ignore_ascii_case(keyword.as_bytes())
}
