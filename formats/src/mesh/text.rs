//! Tokens, lines and numbers of the text formats.

use memchr::{memchr2, memchr3};

use super::error::{Fault, quote};
use super::number::{Spelled, number, plain_number};

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

    /// The token that a line begins with, mostly a single letter.
    #[inline]
    pub(super) fn keyword(&mut self) -> &'a [u8] {
        match self.rest() {
            [b'a'..=b'z', b' ', ..] => {
                self.at += 1;
                &self.bytes[self.at - 1..self.at]
            }
            _ => self.token(),
        }
    }

    /// Whether nothing but blanks is left of the line.
    pub(super) fn is_line_empty(&self) -> bool {
        let blanks = self.rest().iter().position(|b| !matches!(b, b' ' | b'\t' | 0x0b | 0x0c));
        blanks.is_none_or(|i| matches!(self.rest()[i], b'\n' | b'\r'))
    }

    /// What is read of this line; without success the position stays.
    #[inline]
    pub(super) fn attempt<T>(&mut self, read: impl FnOnce(&mut Self) -> Option<T>) -> Option<T> {
        let at = self.at;
        let found = read(self);
        if found.is_none() {
            self.at = at;
        }
        found
    }

    /// Whether the position is that of a line's end.
    #[inline]
    pub(super) fn is_at_line_end(&self) -> bool {
        matches!(self.rest(), [b'\n' | b'\r', ..])
    }

    /// Goes to the next line, past whatever is left of this one; false at the end of the text.
    #[inline]
    pub(super) fn next_line(&mut self) -> bool {
        let mut comment = false;
        loop {
            let rest = self.rest();
            let found = match rest {
                [b'\n' | b'\r', ..] => Some(0),
                _ if OBJ => memchr3(b'\n', b'\r', b'\\', rest),
                _ => memchr2(b'\n', b'\r', rest),
            };
            let Some(found) = found else {
                self.at = self.bytes.len();
                return false;
            };
            let joins = rest[found] == b'\\';
            comment |= joins && rest[..found].contains(&b'#');
            self.at += found;
            if !joins {
                self.step_over_line_end();
                return self.at < self.bytes.len();
            }
            self.at += 1;
            if !comment && matches!(self.bytes.get(self.at), Some(b'\n' | b'\r')) {
                self.step_over_line_end();
            }
        }
    }

    /// Three coordinates, each exactly rounded and finite.
    #[inline(always)]
    pub(super) fn coordinates(&mut self) -> Result<[f64; 3], Fault> {
        let plain = self.attempt(|text| Some([text.plain_number()?, text.plain_number()?, text.plain_number()?]));
        plain.map_or_else(|| self.coordinates_of_any_sort(), Ok)
    }

    #[inline(never)]
    fn coordinates_of_any_sort(&mut self) -> Result<[f64; 3], Fault> {
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

    /// The number that is the next token, if it is of the usual sort; else the position stays. It is finite.
    #[inline(always)]
    fn plain_number(&mut self) -> Option<f64> {
        let blanks = self.blanks();
        let Spelled { value, length } = plain_number(self.bytes.get(self.at + blanks..)?)?;
        self.step_over_token(blanks + length).then_some(value)
    }

    /// How many blanks are next.
    #[inline]
    pub(super) fn blanks(&self) -> usize {
        let rest = self.rest();
        // Mostly one.
        match rest {
            [b' ', b' ' | b'\t', ..] => {
                rest.iter().position(|byte| !matches!(byte, b' ' | b'\t')).unwrap_or(rest.len())
            }
            [b' ' | b'\t', ..] => 1,
            _ => 0,
        }
    }

    /// Steps over so many bytes if a token surely ends there.
    #[inline]
    pub(super) fn step_over_token(&mut self, bytes: usize) -> bool {
        let ends = matches!(self.bytes.get(self.at + bytes), None | Some(b' ' | b'\t' | b'\r' | b'\n'));
        self.at += if ends { bytes } else { 0 };
        ends
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

/// Whether a token is a keyword, in any case of letters.
pub(super) fn is(token: &[u8], keyword: &str) -> bool {
    token.eq_ignore_ascii_case(keyword.as_bytes())
}
