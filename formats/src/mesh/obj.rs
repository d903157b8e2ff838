//! Wavefront OBJ ("Appendix B1: Object Files", Advanced Visualizer manual): points `v`, polygons `f`, polylines `l`,
//! groups `o` and `g`. Textures, normals, materials, curves and free-form surfaces are skipped.
//!
//! Our own, because the memory of a large file must not grow with its text (`streamed`), and because tobj 4
//! names no line in errors and cuts every polygon into a fan, convex or not.

use super::error::{MeshFault, quote};
use super::number::{Prefix, digit_count, index_prefix, number};
use super::polygons::Polygons;
use super::text::Text;
use super::{Mesh, MeshFormat, point_index};

pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, MeshFault> {
    let mut reader = ObjReader::default();
    reader.read(&mut Text::new(bytes))?;
    reader.finish()
}

/// Content of the lines read so far.
#[derive(Default)]
pub(super) struct ObjReader {
    points: Vec<[f64; 3]>,
    polygons: Polygons,
    segments: Vec<[u32; 2]>,
    /// Groups with at least one polygon.
    object_count: usize,
    /// `true` if the current group is counted already.
    is_object_counted: bool,
    forward: ForwardReferences,
    /// Scratch: the corners of a line.
    corners: Vec<u32>,
}

impl ObjReader {
    /// Reads whole lines, which continue those before.
    pub(super) fn read(&mut self, text: &mut Text<true>) -> Result<(), MeshFault> {
        loop {
            match text.keyword() {
                b"v" => {
                    point_index(self.points.len())?;
                    self.points.push(text.coordinates()?);
                }
                b"f" => self.read_face(text)?,
                b"l" => {
                    read_corners(text, 2, "points", self.points.len(), &mut self.corners, &mut self.forward)?;
                    self.segments.extend(self.corners.array_windows().copied());
                }
                b"o" | b"g" => self.is_object_counted = false,
                _ => {}
            }
            if !text.next_line() {
                return Ok(());
            }
        }
    }

    #[inline]
    fn read_face(&mut self, text: &mut Text<true>) -> Result<(), MeshFault> {
        match fast_triangle(text, self.points.len()) {
            Some(corners) => self.polygons.push(&corners)?,
            None => {
                read_corners(text, 3, "corners", self.points.len(), &mut self.corners, &mut self.forward)?;
                self.polygons.push(&self.corners)?;
            }
        }
        self.object_count += usize::from(!self.is_object_counted);
        self.is_object_counted = true;
        Ok(())
    }

    pub(super) fn finish(self) -> Result<Mesh, MeshFault> {
        let Self { points, polygons, segments, object_count, forward, .. } = self;
        forward.check(points.len())?;
        let (triangles, polygons, polygon_counts) = polygons.cut(&points);
        let objects = object_count.max(1);
        Ok(Mesh { format: MeshFormat::Obj, points, triangles, polygons, segments, objects, polygon_counts })
    }
}

/// The rest of the line, if it is three corners in the usual spelling.
#[inline]
fn fast_triangle(text: &mut Text<true>, points: usize) -> Option<[u32; 3]> {
    text.attempt(|text| {
        let mut corner = || fast_corner(text, points);
        let corners = [corner()?, corner()?, corner()?];
        text.is_at_line_end().then_some(corners)
    })
}

/// Reads the corners on the rest of the line, counted from 0.
#[inline]
fn read_corners(
    text: &mut Text<true>,
    min_count: usize,
    what: &str,
    points: usize,
    corners: &mut Vec<u32>,
    forward: &mut ForwardReferences,
) -> Result<(), MeshFault> {
    corners.clear();
    loop {
        if let Some(corner) = fast_corner(text, points) {
            corners.push(corner);
            continue;
        }
        let token = text.token();
        if token.is_empty() {
            break;
        }
        let index = match index(token) {
            Some(i @ 1..) => i.unsigned_abs() - 1,
            Some(i) if i < 0 && i.unsigned_abs() <= points as u64 => points as u64 - i.unsigned_abs(),
            index => return Err(bad_index(text.line, index, token, points)),
        };
        let Ok(corner) = u32::try_from(index) else {
            return Err(bad_index(text.line, Some(i64::MAX), token, points));
        };
        if index >= points as u64 {
            forward.note(corner, text.line);
        }
        corners.push(corner);
    }
    if corners.len() < min_count {
        return Err(MeshFault::line(text.line, format!("at least {min_count} {what}"), corners.len().to_string()));
    }
    Ok(())
}

/// The next token, if it is a corner in the usual spelling: the index of a point already read, and up to two more
/// indices, all without signs.
#[inline(always)]
fn fast_corner(text: &mut Text<true>, points: usize) -> Option<u32> {
    let blanks = text.blanks();
    let rest = text.rest().get(blanks..)?;
    let Prefix { value, mut length } = index_prefix(rest)?;
    for _ in 0..2 {
        if rest.get(length) == Some(&b'/') {
            length += 1;
            length += digit_count(&rest[length..]);
        }
    }
    // The cast is exact: there are fewer than 2³² points.
    let corner = value.checked_sub(1).filter(|corner| *corner < points as u64)? as u32;
    text.skip_token(blanks + length).then_some(corner)
}

/// The point's index in a corner `v`, `v/t`, `v//n` or `v/t/n`, as spelled: counted from 1, negative from the end.
#[inline]
fn index(token: &[u8]) -> Option<i64> {
    let (is_negative, rest) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, token),
    };
    let digits = rest.iter().position(|b| !b.is_ascii_digit()).unwrap_or(rest.len());
    let (digits, other) = rest.split_at(digits);
    let is_other_valid = || {
        other[0] == b'/'
            && other.iter().filter(|&&b| b == b'/').count() <= 2
            && other.iter().all(|b| b.is_ascii_digit() || matches!(b, b'/' | b'-' | b'+'))
    };
    if digits.is_empty() || !(other.is_empty() || is_other_valid()) {
        return None;
    }
    let value = digits.iter().fold(0i64, |n, b| n.saturating_mul(10).saturating_add(i64::from(b - b'0')));
    Some(if is_negative { -value } else { value })
}

#[cold]
fn bad_index(line: usize, index: Option<i64>, token: &[u8], points: usize) -> MeshFault {
    let expected = match index {
        None if number::<f64>(token).is_some() => "a whole number",
        None => "an index such as `7`, `7/1`, `7//1` or `7/1/1`",
        Some(0) => "an index that is not 0 (they count from 1)",
        Some(1..) => return MeshFault::line(line, format!("an index up to {}", u32::MAX), quote(token)),
        Some(_) => {
            return MeshFault::line(line, format!("an index back to one of {points} points so far"), quote(token));
        }
    };
    MeshFault::line(line, expected, quote(token))
}

/// Indices of points that were not read yet, with their lines. Each entry is larger than all before it, so the first
/// one past the last point is the first error of the file.
#[derive(Default)]
struct ForwardReferences(Vec<(u32, usize)>);

impl ForwardReferences {
    fn note(&mut self, corner: u32, line: usize) {
        if self.0.last().is_none_or(|&(largest, _)| corner > largest) {
            self.0.push((corner, line));
        }
    }

    fn check(&self, points: usize) -> Result<(), MeshFault> {
        match self.0.iter().find(|&&(corner, _)| corner as usize >= points) {
            Some(&(corner, line)) => {
                let found = u64::from(corner) + 1;
                Err(MeshFault::line(line, format!("an index up to {points}, the number of points"), found.to_string()))
            }
            None => Ok(()),
        }
    }
}
