//! STL, binary and ASCII: a soup of triangles, whose corners are welded where they are equal to the last bit.
//!
//! Not by stl_io: it takes a binary file that begins with "solid" for text, stops at the first of several solids without
//! a word, wants lower case and UTF-8, and names no line.

use super::error::{Fault, Place, quote};
use super::polygons::Polygons;
use super::text::{Text, is};
use super::{Mesh, MeshFormat, point_index};
use std::collections::HashMap;

/// The name and colours of a binary file, and the number of triangles.
const HEADER: usize = 84;
/// A normal, three corners, two bytes of colour.
const TRIANGLE: usize = 50;

/// Whether the length is the one that a binary file's header asks for, which is how to know one: it may well begin with
/// "solid", as a text does. No text is that long for its 81st to 84th byte, below 7 GB.
pub(super) fn is_binary(beginning: &[u8], length: u64) -> bool {
    declared(beginning).is_some_and(|(_, declared)| declared == length)
}

fn declared(bytes: &[u8]) -> Option<(u32, u64)> {
    let count = u32::from_le_bytes(*bytes.get(80..)?.first_chunk()?);
    Some((count, HEADER as u64 + TRIANGLE as u64 * u64::from(count)))
}

pub(super) fn parse_binary(bytes: &[u8]) -> Result<Mesh, Fault> {
    let Some((count, length)) = declared(bytes) else {
        return Err(Fault::of_file(format!("at least {HEADER} bytes of binary STL"), bytes.len().to_string()));
    };
    if length != bytes.len() as u64 {
        let wanted = format!("{HEADER} + {TRIANGLE} * {count} = {length} bytes of binary STL");
        return Err(Fault::of_file(wanted, bytes.len().to_string()));
    }
    let mut soup = Soup::default();
    for (triangle, record) in bytes[HEADER..].chunks_exact(TRIANGLE).enumerate() {
        let numbers = record[12..48].as_chunks::<4>().0;
        let coordinate = |corner: usize, axis: usize| f64::from(f32::from_le_bytes(numbers[3 * corner + axis]));
        let corners = [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| coordinate(corner, axis)));
        if let Some(found) = corners.as_flattened().iter().find(|x| !x.is_finite()) {
            return Err(Fault::at(Place::Element("triangle".into(), triangle), "a finite number", found.to_string()));
        }
        soup.push(corners)?;
    }
    Ok(soup.weld(1))
}

pub(super) fn parse_text(bytes: &[u8]) -> Result<Mesh, Fault> {
    let mut text = Text::<false>::new(bytes);
    let mut soup = Soup::default();
    let mut corners: Vec<[f64; 3]> = Vec::with_capacity(3);
    let (mut in_solid, mut in_facet) = (false, false);
    let (mut objects, mut counted) = (0, false);
    loop {
        let keyword = text.token();
        let misplaced = |wanted: &str| Fault::on_line(text.line, wanted, quote(keyword));
        if is(keyword, "vertex") {
            if !in_facet {
                return Err(misplaced("`facet` first"));
            }
            if corners.len() == 3 {
                return Err(misplaced("`endfacet` after 3 corners"));
            }
            corners.push(text.coordinates()?);
        } else if is(keyword, "facet") {
            if !in_solid || in_facet {
                return Err(misplaced(if in_facet { "`endfacet`" } else { "`solid`" }));
            }
            in_facet = true;
        } else if is(keyword, "endfacet") {
            let [a, b, c] = corners[..] else {
                return Err(Fault::on_line(text.line, "3 corners", corners.len().to_string()));
            };
            if !in_facet {
                return Err(misplaced("`facet`"));
            }
            soup.push([a, b, c])?;
            corners.clear();
            in_facet = false;
            objects += usize::from(!counted);
            counted = true;
        } else if is(keyword, "solid") || is(keyword, "endsolid") {
            // The rest of the line is a name, of any words.
            if in_facet {
                return Err(misplaced("`endfacet`"));
            }
            in_solid = is(keyword, "solid");
            counted = false;
        } else if !(keyword.is_empty() || is(keyword, "outer") || is(keyword, "endloop") || is(keyword, "color")) {
            return Err(misplaced("a keyword of STL"));
        }
        if !text.next_line() {
            break;
        }
    }
    if in_solid {
        let wanted = if in_facet { "`endfacet`" } else { "`endsolid`" };
        return Err(Fault::on_line(text.line, wanted, "the end of the file"));
    }
    Ok(soup.weld(objects))
}

#[derive(Default)]
struct Soup {
    points: Vec<[f64; 3]>,
    /// By their bits. The keyed hash of std, since the file chooses the keys.
    indices: HashMap<[u64; 3], u32>,
    polygons: Polygons,
}

impl Soup {
    fn push(&mut self, corners: [[f64; 3]; 3]) -> Result<(), Fault> {
        let mut triangle = [0; 3];
        for (index, point) in triangle.iter_mut().zip(corners) {
            // -0 + 0 is 0.
            let key = point.map(|x| (x + 0.0).to_bits());
            let next = point_index(self.points.len())?;
            *index = *self.indices.entry(key).or_insert(next);
            if *index == next {
                self.points.push(point);
            }
        }
        self.polygons.push(&triangle)
    }

    fn weld(self, objects: usize) -> Mesh {
        let (triangles, polygons, polygon_counts) = self.polygons.cut(&self.points);
        let (points, segments, objects) = (self.points, Vec::new(), objects.max(1));
        Mesh { format: MeshFormat::Stl, points, triangles, polygons, segments, objects, polygon_counts }
    }
}
