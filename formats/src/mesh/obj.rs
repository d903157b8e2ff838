//! Wavefront OBJ: points, polygons and polylines. Texture, normals, materials, curves and free forms are passed over.

use super::error::{Fault, quote};
use super::number::{Spelled, digits, number, whole_number};
use super::polygons::Polygons;
use super::text::Text;
use super::{Mesh, MeshFormat, point_index};

pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    let mut found = Found::default();
    found.read(&mut Text::new(bytes))?;
    found.mesh()
}

/// What the lines so far hold.
#[derive(Default)]
pub(super) struct Found {
    points: Vec<[f64; 3]>,
    polygons: Polygons,
    segments: Vec<[u32; 2]>,
    objects: usize,
    /// Whether the object of the lines to come is among them.
    counted: bool,
    ahead: Ahead,
    /// Room for those of a line.
    corners: Vec<u32>,
}

impl Found {
    /// Takes whole lines, which follow on those before.
    pub(super) fn read(&mut self, text: &mut Text<true>) -> Result<(), Fault> {
        loop {
            match text.keyword() {
                b"v" => {
                    point_index(self.points.len())?;
                    self.points.push(text.coordinates()?);
                }
                b"f" => self.read_face(text)?,
                b"l" => {
                    read_corners(text, 2, "points", self.points.len(), &mut self.corners, &mut self.ahead)?;
                    self.segments.extend(self.corners.array_windows().copied());
                }
                b"o" | b"g" => self.counted = false,
                _ => {}
            }
            if !text.next_line() {
                return Ok(());
            }
        }
    }

    #[inline]
    fn read_face(&mut self, text: &mut Text<true>) -> Result<(), Fault> {
        match plain_triangle(text, self.points.len()) {
            Some(corners) => self.polygons.push(&corners)?,
            None => {
                read_corners(text, 3, "corners", self.points.len(), &mut self.corners, &mut self.ahead)?;
                self.polygons.push(&self.corners)?;
            }
        }
        self.objects += usize::from(!self.counted);
        self.counted = true;
        Ok(())
    }

    pub(super) fn mesh(self) -> Result<Mesh, Fault> {
        let Self { points, polygons, segments, objects, ahead, .. } = self;
        ahead.check(points.len())?;
        let (triangles, polygons, polygon_counts) = polygons.cut(&points);
        let objects = objects.max(1);
        Ok(Mesh { format: MeshFormat::Obj, points, triangles, polygons, segments, objects, polygon_counts })
    }
}

/// The three corners that are the rest of the line, if they are of the usual sort. Else the position stays.
#[inline]
fn plain_triangle(text: &mut Text<true>, points: usize) -> Option<[u32; 3]> {
    text.attempt(|text| {
        let mut corner = || plain_corner(text, points);
        let corners = [corner()?, corner()?, corner()?];
        text.is_at_line_end().then_some(corners)
    })
}

/// The corners on the rest of the line, counted from 0.
#[inline]
fn read_corners(
    text: &mut Text<true>,
    least: usize,
    what: &str,
    points: usize,
    corners: &mut Vec<u32>,
    ahead: &mut Ahead,
) -> Result<(), Fault> {
    corners.clear();
    loop {
        if let Some(corner) = plain_corner(text, points) {
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
            found => return Err(bad_index(text.line, found, token, points)),
        };
        let Ok(corner) = u32::try_from(index) else {
            return Err(bad_index(text.line, Some(i64::MAX), token, points));
        };
        if index >= points as u64 {
            ahead.note(corner, text.line);
        }
        corners.push(corner);
    }
    if corners.len() < least {
        return Err(Fault::on_line(text.line, format!("at least {least} {what}"), corners.len().to_string()));
    }
    Ok(())
}

/// The corner that is the next token, if it is of the usual sort: an index of a point that is there, and up to two others
/// without signs. Else the position stays.
#[inline(always)]
fn plain_corner(text: &mut Text<true>, points: usize) -> Option<u32> {
    let blanks = text.blanks();
    let rest = text.rest().get(blanks..)?;
    let Spelled { value, mut length } = whole_number(rest)?;
    for _ in 0..2 {
        if rest.get(length) == Some(&b'/') {
            length += 1;
            length += digits(&rest[length..]);
        }
    }
    // There are fewer than 2³² points.
    let corner = value.checked_sub(1).filter(|corner| *corner < points as u64)? as u32;
    text.step_over_token(blanks + length).then_some(corner)
}

/// The point of a corner `v`, `v/t`, `v//n` or `v/t/n`, as it stands there.
#[inline]
fn index(token: &[u8]) -> Option<i64> {
    let (negative, rest) = match token {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        _ => (false, token),
    };
    let digits = rest.iter().position(|b| !b.is_ascii_digit()).unwrap_or(rest.len());
    let (digits, other) = rest.split_at(digits);
    let other_is_sane = || {
        other[0] == b'/'
            && other.iter().filter(|&&b| b == b'/').count() <= 2
            && other.iter().all(|b| b.is_ascii_digit() || matches!(b, b'/' | b'-' | b'+'))
    };
    if digits.is_empty() || !(other.is_empty() || other_is_sane()) {
        return None;
    }
    let value = digits.iter().fold(0i64, |n, b| n.saturating_mul(10).saturating_add(i64::from(b - b'0')));
    Some(if negative { -value } else { value })
}

#[cold]
fn bad_index(line: usize, index: Option<i64>, token: &[u8], points: usize) -> Fault {
    let wanted = match index {
        None if number(token).is_some() => "a whole number",
        None => "an index such as `7`, `7/1`, `7//1` or `7/1/1`",
        Some(0) => "an index that is not 0 (they count from 1)",
        Some(1..) => return Fault::on_line(line, format!("an index up to {}", u32::MAX), quote(token)),
        Some(_) => {
            return Fault::on_line(line, format!("an index back to one of {points} points so far"), quote(token));
        }
    };
    Fault::on_line(line, wanted, quote(token))
}

/// Indices that ran ahead of the points: they hold if the points come later. Each is the largest of its time, so the
/// first one past the last point is the first of all that are.
#[derive(Default)]
struct Ahead(Vec<(u32, usize)>);

impl Ahead {
    fn note(&mut self, corner: u32, line: usize) {
        if self.0.last().is_none_or(|&(largest, _)| corner > largest) {
            self.0.push((corner, line));
        }
    }

    fn check(&self, points: usize) -> Result<(), Fault> {
        match self.0.iter().find(|&&(corner, _)| corner as usize >= points) {
            Some(&(corner, line)) => {
                let found = u64::from(corner) + 1;
                Err(Fault::on_line(line, format!("an index up to {points}, the number of points"), found.to_string()))
            }
            None => Ok(()),
        }
    }
}
