//! PLY: the elements `vertex`, `face`, `tristrips` and `edge`; others are stepped over.
//!
//! Not by ply-rs-bw: it refuses numbers such as `1.` and headers with Latin-1 comments, keeps one of two properties with
//! the same name and then reads the rest out of step, and allocates a list for each face. A value is a value here,
//! whatever its type: each of the eight is exact as f64.

use super::error::{Fault, Place, quote, spell};
use super::number::number;
use super::ply_header::{self, Element, Encoding, Header, Kind, Scalar};
use super::polygons::Polygons;
use super::text::Text;
use super::{Mesh, MeshFormat, point_index};

pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, Fault> {
    let header = ply_header::parse(bytes)?;
    let payload = &bytes[header.end..];
    match header.encoding {
        Encoding::Ascii => read(&header, Ascii { text: Text::from_line(payload, header.lines), line: header.lines }),
        Encoding::LittleEndian => read(&header, Binary::<false> { bytes: payload, element: "", index: 0 }),
        Encoding::BigEndian => read(&header, Binary::<true> { bytes: payload, element: "", index: 0 }),
    }
}

fn read<'a>(header: &'a Header, mut values: impl Values<'a>) -> Result<Mesh, Fault> {
    let points_declared = header.elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count);
    let mut points = Vec::new();
    let mut polygons = Polygons::default();
    let mut segments = Vec::new();
    let mut row = Row::default();
    for element in &header.elements {
        let subject = Subject::of(element);
        // Elements without properties take no room in the file, however many there are.
        if element.count == 0 || element.properties.is_empty() && subject == Subject::Other {
            continue;
        }
        let roles = roles(element, subject)?;
        for index in 0..element.count {
            values.begin(&element.name, index)?;
            row.read(element, &roles, &mut values)?;
            values.end()?;
            match subject {
                Subject::Vertex => {
                    point_index(points.len())?;
                    match row.scalars.iter().find(|x| !x.is_finite()) {
                        None => points.push(row.scalars),
                        Some(x) => return Err(Fault::at(values.place(), "a finite number", spell(*x))),
                    }
                }
                Subject::Face => {
                    row.take_indices(row.list.len(), points_declared, &values)?;
                    if row.corners.len() < 3 {
                        let found = row.corners.len().to_string();
                        return Err(Fault::at(values.place(), "at least 3 corners", found));
                    }
                    polygons.push(&row.corners)?;
                }
                Subject::Strips => row.take_strips(points_declared, &values, &mut polygons)?,
                Subject::Edge => {
                    row.list.clear();
                    row.list.extend(&row.scalars[..2]);
                    row.take_indices(2, points_declared, &values)?;
                    segments.push([row.corners[0], row.corners[1]]);
                }
                Subject::Other => {}
            }
        }
    }
    values.finish()?;
    let (triangles, polygons, polygon_counts) = polygons.cut(&points);
    Ok(Mesh { format: MeshFormat::Ply, points, triangles, polygons, segments, objects: 1, polygon_counts })
}

/// What an element is to us.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Subject {
    Vertex,
    Face,
    Strips,
    Edge,
    Other,
}

impl Subject {
    fn of(element: &Element) -> Self {
        match element.name.as_str() {
            "vertex" => Self::Vertex,
            "face" => Self::Face,
            "tristrips" => Self::Strips,
            // Others write edges in ways of their own.
            "edge" if element.properties.iter().any(|p| p.name == "vertex1") => Self::Edge,
            _ => Self::Other,
        }
    }
}

/// What becomes of a property's value.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Skipped,
    Scalar(usize),
    List,
}

/// A role for each property of the element. A name that stands there twice has its first property.
fn roles(element: &Element, subject: Subject) -> Result<Vec<Role>, Fault> {
    let mut roles = vec![Role::Skipped; element.properties.len()];
    let mut give = |names: &[&str], list: bool, role: Role| {
        let fits = |kind: Kind| list == matches!(kind, Kind::List { .. });
        match element.properties.iter().position(|p| names.contains(&p.name.as_str()) && fits(p.kind)) {
            Some(i) => {
                roles[i] = role;
                Ok(())
            }
            None => {
                let wanted = format!("a {} `{}`", if list { "list property" } else { "property" }, names[0]);
                Err(Fault::on_line(element.line, wanted, format!("none in element {}", element.name)))
            }
        }
    };
    match subject {
        Subject::Vertex => {
            give(&["x"], false, Role::Scalar(0))?;
            give(&["y"], false, Role::Scalar(1))?;
            give(&["z"], false, Role::Scalar(2))?;
        }
        Subject::Edge => {
            give(&["vertex1"], false, Role::Scalar(0))?;
            give(&["vertex2"], false, Role::Scalar(1))?;
        }
        Subject::Face | Subject::Strips => give(&["vertex_indices", "vertex_index"], true, Role::List)?,
        Subject::Other => {}
    }
    Ok(roles)
}

/// The values of one element that have a role.
#[derive(Default)]
struct Row {
    scalars: [f64; 3],
    list: Vec<f64>,
    corners: Vec<u32>,
}

impl Row {
    #[inline]
    fn read<'a>(&mut self, element: &Element, roles: &[Role], values: &mut impl Values<'a>) -> Result<(), Fault> {
        for (property, role) in element.properties.iter().zip(roles) {
            match (property.kind, *role) {
                (Kind::Scalar(kind), Role::Scalar(slot)) => self.scalars[slot] = values.value(kind)?,
                (Kind::Scalar(kind), _) => values.skip(kind, 1)?,
                (Kind::List { count, item }, role) => {
                    let count = list_length(values.value(count)?, values)?;
                    if role == Role::List {
                        self.list.clear();
                        for _ in 0..count {
                            self.list.push(values.value(item)?);
                        }
                    } else {
                        values.skip(item, count)?;
                    }
                }
            }
        }
        Ok(())
    }

    /// The first values of the list as corners.
    #[inline]
    fn take_indices<'a>(&mut self, count: usize, points: usize, values: &impl Values<'a>) -> Result<(), Fault> {
        self.corners.clear();
        for &value in &self.list[..count] {
            // Beyond 32 bits there are no points, so the cast is exact where the test holds.
            if !(value >= 0.0 && value < points as f64 && value.fract() == 0.0) {
                let wanted = format!("an index from 0 up to {points} - 1");
                return Err(Fault::at(values.place(), wanted, spell(value)));
            }
            self.corners.push(value as u32);
        }
        Ok(())
    }

    /// The list as strips of triangles, ended by -1: each corner makes one with the two before it, every other one
    /// turned around.
    fn take_strips<'a>(
        &mut self,
        points: usize,
        values: &impl Values<'a>,
        polygons: &mut Polygons,
    ) -> Result<(), Fault> {
        let all = std::mem::take(&mut self.list);
        for strip in all.split(|&i| i == -1.0) {
            self.list.clear();
            self.list.extend(strip);
            self.take_indices(strip.len(), points, values)?;
            for (i, &[a, b, c]) in self.corners.array_windows().enumerate() {
                polygons.push(&if i % 2 == 0 { [a, b, c] } else { [b, a, c] })?;
            }
        }
        Ok(())
    }
}

fn list_length<'a>(value: f64, values: &impl Values<'a>) -> Result<usize, Fault> {
    if value >= 0.0 && value.fract() == 0.0 && value <= f64::from(u32::MAX) {
        return Ok(value as usize);
    }
    Err(Fault::at(values.place(), "the length of a list", spell(value)))
}

/// Where the values come from, one after another.
trait Values<'a> {
    fn begin(&mut self, element: &'a str, index: usize) -> Result<(), Fault>;
    fn value(&mut self, kind: Scalar) -> Result<f64, Fault>;
    fn skip(&mut self, kind: Scalar, count: usize) -> Result<(), Fault>;
    fn end(&mut self) -> Result<(), Fault>;
    /// After the last element.
    fn finish(&mut self) -> Result<(), Fault>;
    fn place(&self) -> Place;
}

/// Each element is a line; empty lines are passed over.
struct Ascii<'a> {
    text: Text<'a, false>,
    /// Of the element.
    line: usize,
}

impl<'a> Ascii<'a> {
    fn skip_empty_lines(&mut self) -> bool {
        loop {
            self.line = self.text.line;
            if !self.text.is_line_empty() {
                return true;
            }
            if !self.text.next_line() {
                return false;
            }
        }
    }

    fn token(&mut self) -> Result<&'a [u8], Fault> {
        match self.text.token() {
            [] => Err(Fault::on_line(self.line, "another value", "the end of the line")),
            token => Ok(token),
        }
    }
}

impl<'a> Values<'a> for Ascii<'a> {
    fn begin(&mut self, element: &'a str, index: usize) -> Result<(), Fault> {
        if self.skip_empty_lines() {
            return Ok(());
        }
        Err(Fault::on_line(self.line, format!("{element} {index}"), "the end of the file"))
    }

    #[inline]
    fn value(&mut self, kind: Scalar) -> Result<f64, Fault> {
        let token = self.token()?;
        let value = match kind {
            // What the file says is rounded to the type that it declares, as the binary encodings do.
            Scalar::F32 => str::from_utf8(token).ok().and_then(|t| t.parse::<f32>().ok()).map(f64::from),
            _ => number(token),
        };
        value.ok_or_else(|| Fault::on_line(self.line, "a number", quote(token)))
    }

    fn skip(&mut self, _: Scalar, count: usize) -> Result<(), Fault> {
        (0..count).try_for_each(|_| self.token().map(|_| ()))
    }

    fn end(&mut self) -> Result<(), Fault> {
        match self.text.token() {
            [] => {
                self.text.next_line();
                Ok(())
            }
            more => Err(Fault::on_line(self.line, "the end of the line", quote(more))),
        }
    }

    fn finish(&mut self) -> Result<(), Fault> {
        if self.skip_empty_lines() {
            let found = self.text.token();
            return Err(Fault::on_line(self.line, "no more than the header declares", quote(found)));
        }
        Ok(())
    }

    fn place(&self) -> Place {
        Place::Line(self.line)
    }
}

struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    element: &'a str,
    index: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let Some((&first, rest)) = self.bytes.split_first_chunk::<N>() else {
            return Err(self.too_short(N));
        };
        self.bytes = rest;
        Ok(if BIG {
            let mut little = first;
            little.reverse();
            little
        } else {
            first
        })
    }

    #[cold]
    fn too_short(&self, wanted: usize) -> Fault {
        let found = format!("{} at the end of the file", self.bytes.len());
        Fault::at(self.place(), format!("{wanted} more bytes"), found)
    }
}

impl<'a, const BIG: bool> Values<'a> for Binary<'a, BIG> {
    fn begin(&mut self, element: &'a str, index: usize) -> Result<(), Fault> {
        (self.element, self.index) = (element, index);
        Ok(())
    }

    #[inline]
    fn value(&mut self, kind: Scalar) -> Result<f64, Fault> {
        Ok(match kind {
            Scalar::I8 => i8::from_le_bytes(self.take()?).into(),
            Scalar::U8 => u8::from_le_bytes(self.take()?).into(),
            Scalar::I16 => i16::from_le_bytes(self.take()?).into(),
            Scalar::U16 => u16::from_le_bytes(self.take()?).into(),
            Scalar::I32 => i32::from_le_bytes(self.take()?).into(),
            Scalar::U32 => u32::from_le_bytes(self.take()?).into(),
            Scalar::F32 => f32::from_le_bytes(self.take()?).into(),
            Scalar::F64 => f64::from_le_bytes(self.take()?),
        })
    }

    fn skip(&mut self, kind: Scalar, count: usize) -> Result<(), Fault> {
        let bytes = kind.bytes().saturating_mul(count);
        self.bytes = self.bytes.get(bytes..).ok_or_else(|| self.too_short(bytes))?;
        Ok(())
    }

    fn end(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn finish(&mut self) -> Result<(), Fault> {
        Ok(())
    }

    fn place(&self) -> Place {
        Place::Element(self.element.into(), self.index)
    }
}
