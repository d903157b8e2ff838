//! OFF as text ("Object File Format", Geomview manual, "OFF Files"): the counts, then a line for each vertex, then
//! `n i_1 … i_n` for each face. Colours, normals and texture coordinates are skipped.
//!
//! | header | meaning |
//! |---|---|
//! | `OFF` | x y z, alone on the line |
//! | `C`, `N`, `ST` before it | more numbers after the coordinates: skipped |
//! | `4` before it | x y z w, homogeneous: the point is (x, y, z) / w |
//! | `n` before it, or `BINARY` after it | refused |
//!
//! Lines of over three numbers under plain `OFF` are refused: they may be a colour or a second point. The counts may follow
//! the header without a blank, as in ModelNet's files.

use super::error::{MeshFault, quote, spell};
use super::number::number;
use super::polygons::Polygons;
use super::text::Text;
use super::{Mesh, MeshFormat, point_index};

/// The columns of a vertex, by the word before the counts.
#[derive(Clone, Copy)]
struct Header {
    /// Bytes of the word.
    length: usize,
    is_homogeneous: bool,
    /// Numbers follow the coordinates.
    has_more: bool,
    is_of_any_dimension: bool,
}

/// `true` if the first word is a header.
pub(super) fn is_off(bytes: &[u8]) -> bool {
    let mut reader = Reader { text: Text::new(bytes) };
    header(reader.word()).is_some()
}

/// The header in the order of the manual: `ST`, `C`, `N`, `4`, `n`, `OFF`, then nothing or a digit of the counts.
fn header(word: &[u8]) -> Option<Header> {
    let (has_texture, rest) = strip(word, b"ST");
    let (has_color, rest) = strip(rest, b"C");
    let (has_normal, rest) = strip(rest, b"N");
    let (is_homogeneous, rest) = strip(rest, b"4");
    let (is_of_any_dimension, rest) = strip(rest, b"n");
    let rest = rest.strip_prefix(b"OFF")?;
    let length = word.len() - rest.len();
    let has_more = has_texture || has_color || has_normal;
    let ends = rest.first().is_none_or(u8::is_ascii_digit);
    ends.then_some(Header { length, is_homogeneous, has_more, is_of_any_dimension })
}

fn strip<'a>(word: &'a [u8], prefix: &[u8]) -> (bool, &'a [u8]) {
    word.strip_prefix(prefix).map_or((false, word), |rest| (true, rest))
}

pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, MeshFault> {
    let mut reader = Reader { text: Text::new(bytes) };
    let word = reader.word();
    let line = reader.text.line;
    let Some(header) = header(word) else {
        return Err(MeshFault::line(line, "`OFF` first", quote(word)));
    };
    if header.is_of_any_dimension {
        return Err(MeshFault::line(line, "3 dimensions, `OFF`", quote(word)));
    }
    let counts = word.len() - header.length + reader.text.rest().len();
    let mut reader = Reader { text: Text::from_line(&bytes[bytes.len() - counts..], line) };
    if reader.text.attempt(|text| (text.token() == b"BINARY").then_some(())).is_some() {
        return Err(MeshFault::line(line, "text, saved as ASCII OFF", "`BINARY`"));
    }
    let [point_count, face_count] =
        [reader.whole_number("the number of points")?, reader.whole_number("the number of faces")?];
    reader.skip_edge_count();

    let mut points = Vec::new();
    for _ in 0..point_count {
        point_index(points.len())?;
        points.push(reader.point(header)?);
    }
    let (mut polygons, mut segments, mut corners) = (Polygons::default(), Vec::new(), Vec::new());
    for _ in 0..face_count {
        reader.face(points.len(), &mut corners)?;
        match corners[..] {
            [] | [_] => {
                return Err(MeshFault::line(reader.text.line, "at least 2 corners", corners.len().to_string()));
            }
            [from, to] => segments.push([from, to]),
            _ => polygons.push(&corners)?,
        }
        reader.skip_line();
    }
    let rest = reader.word();
    if !rest.is_empty() {
        let expected = format!("the end of the file after {face_count} faces");
        return Err(MeshFault::line(reader.text.line, expected, quote(rest)));
    }
    let (triangles, polygons, polygon_counts) = polygons.cut(&points);
    Ok(Mesh { format: MeshFormat::Off, points, triangles, polygons, segments, objects: 1, polygon_counts })
}

/// Words of a text, wherever its lines end.
struct Reader<'a> {
    text: Text<'a, true>,
}

impl<'a> Reader<'a> {
    /// The next word; empty at the end of the file.
    fn word(&mut self) -> &'a [u8] {
        loop {
            let word = self.text.token();
            if !word.is_empty() || !self.text.next_line() {
                return word;
            }
        }
    }

    /// Goes to the next line, past colours and the like.
    fn skip_line(&mut self) {
        self.text.next_line();
    }

    /// Goes past the number of edges, which may be wrong or missing, on this line or alone on a later one.
    fn skip_edge_count(&mut self) {
        let is_missing = self.text.token().is_empty();
        self.skip_line();
        let mut ahead = Self { text: Text::from_line(self.text.rest(), self.text.line) };
        let word = ahead.word();
        let is_number = !word.is_empty() && word.iter().all(u8::is_ascii_digit);
        if is_missing && is_number && ahead.text.token().is_empty() {
            ahead.skip_line();
            *self = ahead;
        }
    }

    fn whole_number(&mut self, what: &str) -> Result<u64, MeshFault> {
        let word = self.word();
        let digits = std::str::from_utf8(word).ok().filter(|word| word.bytes().all(|byte| byte.is_ascii_digit()));
        digits.and_then(|digits| digits.parse().ok()).ok_or_else(|| MeshFault::line(self.text.line, what, found(word)))
    }

    /// The point of a line.
    fn point(&mut self, header: Header) -> Result<[f64; 3], MeshFault> {
        while self.text.is_line_empty() || self.text.rest().trim_ascii_start().first() == Some(&b'#') {
            if !self.text.next_line() {
                return Err(MeshFault::line(self.text.line, "a point", found(b"")));
            }
        }
        let mut point = self.text.coordinates()?;
        let line = self.text.line;
        if header.is_homogeneous {
            let word = self.text.token();
            let w = number::<f64>(word).filter(|w| w.is_finite() && *w != 0.0);
            let w = w.ok_or_else(|| MeshFault::line(line, "a fourth coordinate that is not 0", found(word)))?;
            point = point.map(|x| x / w);
            if let Some(x) = point.iter().find(|x| !x.is_finite()) {
                return Err(MeshFault::line(line, "a finite number", spell(*x)));
            }
        }
        let more = self.text.token();
        if !(more.is_empty() || header.has_more) {
            let expected = if header.is_homogeneous { "4 coordinates on a line" } else { "3 coordinates on a line" };
            return Err(MeshFault::line(line, format!("{expected}, or `C` before `OFF` for colours"), quote(more)));
        }
        self.skip_line();
        Ok(point)
    }

    /// The corners of a face, which may go on over several lines.
    fn face(&mut self, points: usize, corners: &mut Vec<u32>) -> Result<(), MeshFault> {
        corners.clear();
        for _ in 0..self.whole_number("a face's number of corners")? {
            let index = self.whole_number("an index")?;
            if index >= points as u64 {
                let expected = format!("an index below {points}, the number of points");
                return Err(MeshFault::line(self.text.line, expected, index.to_string()));
            }
            // Exact: there are fewer than 2³² points.
            corners.push(index as u32);
        }
        Ok(())
    }
}

fn found(word: &[u8]) -> String {
    if word.is_empty() { "the end of the file".into() } else { quote(word) }
}
