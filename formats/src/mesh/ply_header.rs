//! Header of a PLY file: encoding, elements and their properties (Turk 1994).
//!
//! Counts are checked against the file's length before anything is done for them.

use super::error::{MeshFault, quote};
use super::text::Text;

pub(super) struct PlyHeader {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<PlyElement>,
    /// Offset of the first element.
    pub(super) end: usize,
    /// Line of the first element, counted from 1.
    pub(super) line: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

pub(super) struct PlyElement {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
    /// Line of the declaration.
    pub(super) line: usize,
}

pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: PropertyKind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum PropertyKind {
    Scalar(Scalar),
    List { count: Scalar, item: Scalar },
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Scalar {
    pub(super) fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
        }
    }

    fn from_name(name: &[u8]) -> Option<Self> {
        Some(match name {
            b"char" | b"int8" => Self::I8,
            b"uchar" | b"uint8" => Self::U8,
            b"short" | b"int16" => Self::I16,
            b"ushort" | b"uint16" => Self::U16,
            b"int" | b"int32" => Self::I32,
            b"uint" | b"uint32" => Self::U32,
            b"float" | b"float32" => Self::F32,
            b"double" | b"float64" => Self::F64,
            _ => return None,
        })
    }
}

impl PlyElement {
    /// Smallest size of one such element; in text, each value takes a digit and a blank.
    fn min_bytes(&self, encoding: Encoding) -> u128 {
        let min = |property: &Property| match (encoding, property.kind) {
            (Encoding::Ascii, _) => 2,
            (_, PropertyKind::Scalar(scalar) | PropertyKind::List { count: scalar, .. }) => scalar.bytes() as u128,
        };
        self.properties.iter().map(min).sum()
    }
}

pub(super) fn parse(bytes: &[u8]) -> Result<PlyHeader, MeshFault> {
    let mut text = Text::<false>::new(bytes);
    let mut encoding = None;
    let mut elements: Vec<PlyElement> = Vec::new();
    loop {
        if !text.next_line() {
            return Err(MeshFault::line(text.line, "`end_header`", "the end of the file"));
        }
        let line = text.line;
        match text.token() {
            b"format" => {
                let token = text.token();
                encoding = Some(match token {
                    b"ascii" => Encoding::Ascii,
                    b"binary_little_endian" => Encoding::LittleEndian,
                    b"binary_big_endian" => Encoding::BigEndian,
                    _ => {
                        let expected = "`ascii`, `binary_little_endian` or `binary_big_endian`";
                        return Err(MeshFault::line(line, expected, quote(token)));
                    }
                });
            }
            b"element" => {
                let element = element(&mut text)?;
                if elements.iter().any(|e| e.name == element.name) {
                    return Err(MeshFault::line(line, "each element once", quote(element.name.as_bytes())));
                }
                elements.push(element);
            }
            b"property" => {
                let property = property(&mut text)?;
                let Some(element) = elements.last_mut() else {
                    return Err(MeshFault::line(line, "`element` first", "`property`"));
                };
                element.properties.push(property);
            }
            b"end_header" => break,
            b"comment" | b"obj_info" | b"" => {}
            token => return Err(MeshFault::line(line, "a keyword of PLY", quote(token))),
        }
    }
    let Some(encoding) = encoding else {
        return Err(MeshFault::line(text.line, "`format` before `end_header`", "none"));
    };
    // The first line shows how lines end. After a CR alone, an LF is the first byte of the binary data.
    text.token();
    let is_cr_only = bytes.iter().position(|&b| b == b'\r').is_some_and(|cr| bytes.get(cr + 1) != Some(&b'\n'));
    let (mut end, line) = (bytes.len() - text.rest().len(), text.line + 1);
    let after = |offset: usize, byte: u8| usize::from(bytes.get(offset) == Some(&byte));
    end += after(end, b'\r');
    if !(is_cr_only && bytes.get(end.wrapping_sub(1)) == Some(&b'\r')) {
        end += after(end, b'\n');
    }
    let header = PlyHeader { encoding, elements, end, line };
    header.check_size((bytes.len() - end) as u128)?;
    Ok(header)
}

impl PlyHeader {
    /// An error if the rest of the file cannot hold the declared counts.
    fn check_size(&self, left: u128) -> Result<(), MeshFault> {
        let mut min_bytes = 0u128;
        for element in &self.elements {
            min_bytes += element.count as u128 * element.min_bytes(self.encoding);
            // The last value of a text needs no blank.
            if min_bytes > left + u128::from(self.encoding == Encoding::Ascii) {
                let expected =
                    format!("{min_bytes} bytes or more after the header, for {} {}", element.count, element.name);
                return Err(MeshFault::line(element.line, expected, left.to_string()));
            }
        }
        Ok(())
    }
}

fn element(text: &mut Text<false>) -> Result<PlyElement, MeshFault> {
    let (name, count) = (text.token(), text.token());
    let number = str::from_utf8(count).ok().and_then(|count| count.parse().ok());
    match number {
        Some(count) if !name.is_empty() => {
            Ok(PlyElement { name: printable(name), count, properties: Vec::new(), line: text.line })
        }
        _ => Err(MeshFault::line(text.line, "an element's name and number", quote(count))),
    }
}

fn property(text: &mut Text<false>) -> Result<Property, MeshFault> {
    let kind = match text.token() {
        b"list" => PropertyKind::List { count: scalar(text, None)?, item: scalar(text, None)? },
        token => PropertyKind::Scalar(scalar(text, Some(token))?),
    };
    let name = text.token();
    if name.is_empty() {
        return Err(MeshFault::line(text.line, "a property's name", "nothing"));
    }
    Ok(Property { name: printable(name), kind })
}

fn scalar(text: &mut Text<false>, token: Option<&[u8]>) -> Result<Scalar, MeshFault> {
    let token = token.unwrap_or_else(|| text.token());
    Scalar::from_name(token)
        .ok_or_else(|| MeshFault::line(text.line, "a type such as `float` or `int32`", quote(token)))
}

/// A name that a message may show. The names that we know are plain.
fn printable(name: &[u8]) -> String {
    name.escape_ascii().take(40).map(char::from).collect()
}
