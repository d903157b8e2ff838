//! PLY (Greg Turk 1994, "The PLY Polygon File Format"): elements `vertex`, `face`, `tristrips` and `edge`; others are
//! skipped.
//!
//! Our own, because ply-rs-bw refuses numbers such as `1.` and headers with Latin-1 comments, keeps only one of two
//! properties with the same name and then reads the rest out of step, and allocates a list for each face. Here every
//! value is an f64, which represents all eight types exactly.

use super::error::{Location, MeshFault, quote, spell};
use super::number::number;
use super::ply_header::{self, Encoding, PlyElement, PlyHeader, PropertyKind, Scalar};
use super::polygons::Polygons;
use super::text::Text;
use super::{Mesh, MeshFormat, point_index};

pub(super) fn parse(bytes: &[u8]) -> Result<Mesh, MeshFault> {
    let header = ply_header::parse(bytes)?;
    let payload = &bytes[header.end..];
    match header.encoding {
        Encoding::Ascii => read(&header, Ascii { text: Text::from_line(payload, header.line), line: header.line }),
        Encoding::LittleEndian => read(&header, Binary::<false> { bytes: payload, element: "", index: 0 }),
        Encoding::BigEndian => read(&header, Binary::<true> { bytes: payload, element: "", index: 0 }),
    }
}

fn read<'a>(header: &'a PlyHeader, mut values: impl Values<'a>) -> Result<Mesh, MeshFault> {
    let points_declared = header.elements.iter().find(|e| e.name == "vertex").map_or(0, |e| e.count);
    let mut points = Vec::new();
    let mut polygons = Polygons::default();
    let mut segments = Vec::new();
    let mut row = Row::default();
    for element in &header.elements {
        let subject = Subject::from_element(element);
        // Elements without properties take no space in the file, however many there are.
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
                        Some(x) => return Err(MeshFault::new(values.location(), "a finite number", spell(*x))),
                    }
                }
                Subject::Face => {
                    row.set_corners(row.list.len(), points_declared, &values)?;
                    if row.corners.len() < 3 {
                        let found = row.corners.len().to_string();
                        return Err(MeshFault::new(values.location(), "at least 3 corners", found));
                    }
                    polygons.push(&row.corners)?;
                }
                Subject::Strips => row.push_strips(points_declared, &values, &mut polygons)?,
                Subject::Edge => {
                    row.list.clear();
                    row.list.extend(&row.scalars[..2]);
                    row.set_corners(2, points_declared, &values)?;
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

/// Meaning of an element.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Subject {
    Vertex,
    Face,
    Strips,
    Edge,
    Other,
}

impl Subject {
    fn from_element(element: &PlyElement) -> Self {
        match element.name.as_str() {
            "vertex" => Self::Vertex,
            "face" => Self::Face,
            "tristrips" => Self::Strips,
            // Some programs write edges in other ways.
            "edge" if element.properties.iter().any(|p| p.name == "vertex1") => Self::Edge,
            _ => Self::Other,
        }
    }
}

/// Use of a property's value.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Role {
    Skipped,
    Scalar(usize),
    List,
}

/// A role for each property of the element. If a name occurs twice, the first property has the role.
fn roles(element: &PlyElement, subject: Subject) -> Result<Vec<Role>, MeshFault> {
    let mut roles = vec![Role::Skipped; element.properties.len()];
    let mut assign = |names: &[&str], is_list: bool, role: Role| {
        let fits = |kind: PropertyKind| is_list == matches!(kind, PropertyKind::List { .. });
        match element.properties.iter().position(|p| names.contains(&p.name.as_str()) && fits(p.kind)) {
            Some(i) => {
                roles[i] = role;
                Ok(())
            }
            None => {
                let expected = format!("a {} `{}`", if is_list { "list property" } else { "property" }, names[0]);
                Err(MeshFault::line(element.line, expected, format!("none in element {}", element.name)))
            }
        }
    };
    match subject {
        Subject::Vertex => {
            assign(&["x"], false, Role::Scalar(0))?;
            assign(&["y"], false, Role::Scalar(1))?;
            assign(&["z"], false, Role::Scalar(2))?;
        }
        Subject::Edge => {
            assign(&["vertex1"], false, Role::Scalar(0))?;
            assign(&["vertex2"], false, Role::Scalar(1))?;
        }
        Subject::Face | Subject::Strips => assign(&["vertex_indices", "vertex_index"], true, Role::List)?,
        Subject::Other => {}
    }
    Ok(roles)
}

/// Values of one element that have a role.
#[derive(Default)]
struct Row {
    scalars: [f64; 3],
    list: Vec<f64>,
    corners: Vec<u32>,
}

impl Row {
    #[inline]
    fn read<'a>(
        &mut self,
        element: &PlyElement,
        roles: &[Role],
        values: &mut impl Values<'a>,
    ) -> Result<(), MeshFault> {
        for (property, role) in element.properties.iter().zip(roles) {
            match (property.kind, *role) {
                (PropertyKind::Scalar(kind), Role::Scalar(slot)) => self.scalars[slot] = values.value(kind)?,
                (PropertyKind::Scalar(kind), _) => values.skip(kind, 1)?,
                (PropertyKind::List { count, item }, role) => {
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

    /// Sets the corners to the first values of the list.
    #[inline]
    fn set_corners<'a>(&mut self, count: usize, points: usize, values: &impl Values<'a>) -> Result<(), MeshFault> {
        self.corners.clear();
        for &value in &self.list[..count] {
            // The cast is exact: there are fewer than 2³² points.
            if !(value >= 0.0 && value < points as f64 && value.fract() == 0.0) {
                let expected = format!("an index from 0 up to {points} - 1");
                return Err(MeshFault::new(values.location(), expected, spell(value)));
            }
            self.corners.push(value as u32);
        }
        Ok(())
    }

    /// Adds the list as triangle strips, separated by -1. Each corner makes a triangle with the two before it; every
    /// other triangle is reversed.
    fn push_strips<'a>(
        &mut self,
        points: usize,
        values: &impl Values<'a>,
        polygons: &mut Polygons,
    ) -> Result<(), MeshFault> {
        let all = std::mem::take(&mut self.list);
        for strip in all.split(|&i| i == -1.0) {
            self.list.clear();
            self.list.extend(strip);
            self.set_corners(strip.len(), points, values)?;
            for (i, &[a, b, c]) in self.corners.array_windows().enumerate() {
                polygons.push(&if i % 2 == 0 { [a, b, c] } else { [b, a, c] })?;
            }
        }
        Ok(())
    }
}

fn list_length<'a>(value: f64, values: &impl Values<'a>) -> Result<usize, MeshFault> {
    if value >= 0.0 && value.fract() == 0.0 && value <= f64::from(u32::MAX) {
        return Ok(value as usize);
    }
    Err(MeshFault::new(values.location(), "the length of a list", spell(value)))
}

/// A sequence of values, in text or binary.
trait Values<'a> {
    fn begin(&mut self, element: &'a str, index: usize) -> Result<(), MeshFault>;
    fn value(&mut self, kind: Scalar) -> Result<f64, MeshFault>;
    fn skip(&mut self, kind: Scalar, count: usize) -> Result<(), MeshFault>;
    fn end(&mut self) -> Result<(), MeshFault>;
    /// Called after the last element.
    fn finish(&mut self) -> Result<(), MeshFault>;
    fn location(&self) -> Location;
}

/// Values in text: each element is a line, empty lines are skipped.
struct Ascii<'a> {
    text: Text<'a, false>,
    /// Line of the element.
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

    fn token(&mut self) -> Result<&'a [u8], MeshFault> {
        match self.text.token() {
            [] => Err(MeshFault::line(self.line, "another value", "the end of the line")),
            token => Ok(token),
        }
    }
}

impl<'a> Values<'a> for Ascii<'a> {
    fn begin(&mut self, element: &'a str, index: usize) -> Result<(), MeshFault> {
        if self.skip_empty_lines() {
            return Ok(());
        }
        Err(MeshFault::line(self.line, format!("{element} {index}"), "the end of the file"))
    }

    #[inline]
    fn value(&mut self, kind: Scalar) -> Result<f64, MeshFault> {
        let token = self.token()?;
        let value = match kind {
            // Rounded to the declared type, as in the binary encodings.
            Scalar::F32 => number::<f32>(token).map(f64::from),
            _ => number(token),
        };
        value.ok_or_else(|| MeshFault::line(self.line, "a number", quote(token)))
    }

    fn skip(&mut self, _: Scalar, count: usize) -> Result<(), MeshFault> {
        (0..count).try_for_each(|_| self.token().map(|_| ()))
    }

    fn end(&mut self) -> Result<(), MeshFault> {
        match self.text.token() {
            [] => {
                self.text.next_line();
                Ok(())
            }
            more => Err(MeshFault::line(self.line, "the end of the line", quote(more))),
        }
    }

    fn finish(&mut self) -> Result<(), MeshFault> {
        if self.skip_empty_lines() {
            let found = self.text.token();
            return Err(MeshFault::line(self.line, "no more than the header declares", quote(found)));
        }
        Ok(())
    }

    fn location(&self) -> Location {
        Location::Line(self.line)
    }
}

/// Values in binary, big-endian if `BIG`.
struct Binary<'a, const BIG: bool> {
    bytes: &'a [u8],
    element: &'a str,
    index: usize,
}

impl<'a, const BIG: bool> Binary<'a, BIG> {
    #[inline]
    fn take<const N: usize>(&mut self) -> Result<[u8; N], MeshFault> {
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
    fn too_short(&self, count: usize) -> MeshFault {
        let found = format!("{} at the end of the file", self.bytes.len());
        MeshFault::new(self.location(), format!("{count} more bytes"), found)
    }
}

impl<'a, const BIG: bool> Values<'a> for Binary<'a, BIG> {
    fn begin(&mut self, element: &'a str, index: usize) -> Result<(), MeshFault> {
        (self.element, self.index) = (element, index);
        Ok(())
    }

    #[inline]
    fn value(&mut self, kind: Scalar) -> Result<f64, MeshFault> {
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

    fn skip(&mut self, kind: Scalar, count: usize) -> Result<(), MeshFault> {
        let bytes = kind.bytes().saturating_mul(count);
        self.bytes = self.bytes.get(bytes..).ok_or_else(|| self.too_short(bytes))?;
        Ok(())
    }

    fn end(&mut self) -> Result<(), MeshFault> {
        Ok(())
    }

    fn finish(&mut self) -> Result<(), MeshFault> {
        Ok(())
    }

    fn location(&self) -> Location {
        Location::Element(self.element.into(), self.index)
    }
}
