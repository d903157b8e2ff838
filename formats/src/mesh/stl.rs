//! STL, binary and ASCII (3D Systems 1988, "StereoLithography Interface Specification"): a triangle soup, whose corners
//! are welded if they are equal to the last bit.
//!
//! Our own, because stl_io takes a binary file that begins with "solid" for text, silently stops after the first of
//! several solids, requires lower case and UTF-8, and names no line in errors.

use super::error::{Location, MeshFault, quote};
use super::polygons::Polygons;
use super::text::{Text, is_keyword};
use super::{Mesh, MeshFormat, point_index};
use std::collections::HashMap;

/// Bytes of a binary header: a text of 80 bytes and the number of triangles.
const HEADER_BYTES: usize = 84;
/// Bytes of a triangle: a normal, three corners, two bytes of attributes.
const TRIANGLE_BYTES: usize = 50;

/// `true` if the length is the one that a binary header declares. The first bytes do not decide: a binary file, too,
/// may begin with "solid". A text below 7 GB cannot pass, because its bytes 80 to 83 declare more.
pub(super) fn is_binary(beginning: &[u8], length: u64) -> bool {
    declared_size(beginning).is_some_and(|(_, declared)| declared == length)
}

/// Number of triangles and length of the file, as declared by a binary header.
fn declared_size(bytes: &[u8]) -> Option<(u32, u64)> {
    let count = u32::from_le_bytes(*bytes.get(80..)?.first_chunk()?);
    Some((count, HEADER_BYTES as u64 + TRIANGLE_BYTES as u64 * u64::from(count)))
}

pub(super) fn parse_binary(bytes: &[u8]) -> Result<Mesh, MeshFault> {
    let Some((count, length)) = declared_size(bytes) else {
        return Err(MeshFault::whole_file(
            format!("at least {HEADER_BYTES} bytes of binary STL"),
            bytes.len().to_string(),
        ));
    };
    if length != bytes.len() as u64 {
        let expected = format!("{HEADER_BYTES} + {TRIANGLE_BYTES} * {count} = {length} bytes of binary STL");
        return Err(MeshFault::whole_file(expected, bytes.len().to_string()));
    }
    let mut soup = Soup::default();
    for (triangle, record) in bytes[HEADER_BYTES..].chunks_exact(TRIANGLE_BYTES).enumerate() {
        let numbers = record[12..48].as_chunks::<4>().0;
        let coordinate = |corner: usize, axis: usize| f64::from(f32::from_le_bytes(numbers[3 * corner + axis]));
        let corners = [0, 1, 2].map(|corner| [0, 1, 2].map(|axis| coordinate(corner, axis)));
        if let Some(found) = corners.as_flattened().iter().find(|x| !x.is_finite()) {
            return Err(MeshFault::new(
                Location::Element("triangle".into(), triangle),
                "a finite number",
                found.to_string(),
            ));
        }
        soup.push(corners)?;
    }
    Ok(soup.weld(1))
}

pub(super) fn parse_text(bytes: &[u8]) -> Result<Mesh, MeshFault> {
    let mut text = Text::<false>::new(bytes);
    let mut soup = Soup::default();
    let mut corners: Vec<[f64; 3]> = Vec::with_capacity(3);
    let (mut is_in_solid, mut is_in_facet) = (false, false);
    let (mut object_count, mut is_object_counted) = (0, false);
    loop {
        let keyword = text.token();
        let misplaced = |expected: &str| MeshFault::line(text.line, expected, quote(keyword));
        if is_keyword(keyword, "vertex") {
            if !is_in_facet {
                return Err(misplaced("`facet` first"));
            }
            if corners.len() == 3 {
                return Err(misplaced("`endfacet` after 3 corners"));
            }
            corners.push(text.coordinates()?);
        } else if is_keyword(keyword, "facet") {
            if !is_in_solid || is_in_facet {
                return Err(misplaced(if is_in_facet { "`endfacet`" } else { "`solid`" }));
            }
            is_in_facet = true;
        } else if is_keyword(keyword, "endfacet") {
            let [a, b, c] = corners[..] else {
                return Err(MeshFault::line(text.line, "3 corners", corners.len().to_string()));
            };
            if !is_in_facet {
                return Err(misplaced("`facet`"));
            }
            soup.push([a, b, c])?;
            corners.clear();
            is_in_facet = false;
            object_count += usize::from(!is_object_counted);
            is_object_counted = true;
        } else if is_keyword(keyword, "solid") || is_keyword(keyword, "endsolid") {
            // The rest of the line is a name of any words.
            if is_in_facet {
                return Err(misplaced("`endfacet`"));
            }
            is_in_solid = is_keyword(keyword, "solid");
            is_object_counted = false;
        } else if !(keyword.is_empty()
            || is_keyword(keyword, "outer")
            || is_keyword(keyword, "endloop")
            || is_keyword(keyword, "color"))
        {
            return Err(misplaced("a keyword of STL"));
        }
        if !text.next_line() {
            break;
        }
    }
    if is_in_solid {
        let expected = if is_in_facet { "`endfacet`" } else { "`endsolid`" };
        return Err(MeshFault::line(text.line, expected, "the end of the file"));
    }
    Ok(soup.weld(object_count))
}

#[derive(Default)]
struct Soup {
    points: Vec<[f64; 3]>,
    /// Point indices by the bits of the coordinates. Std's keyed hash, because the file chooses the keys.
    indices: HashMap<[u64; 3], u32>,
    polygons: Polygons,
}

impl Soup {
    fn push(&mut self, corners: [[f64; 3]; 3]) -> Result<(), MeshFault> {
        let mut triangle = [0; 3];
        for (index, point) in triangle.iter_mut().zip(corners) {
            // Adding 0 turns -0 into 0.
            let key = point.map(|x| (x + 0.0).to_bits());
            let next = point_index(self.points.len())?;
            *index = *self.indices.entry(key).or_insert(next);
            if *index == next {
                self.points.push(point);
            }
        }
        self.polygons.push(&triangle)
    }

    fn weld(self, object_count: usize) -> Mesh {
        let (triangles, polygons, polygon_counts) = self.polygons.cut(&self.points);
        let (points, segments, objects) = (self.points, Vec::new(), object_count.max(1));
        Mesh { format: MeshFormat::Stl, points, triangles, polygons, segments, objects, polygon_counts }
    }
}
