//! The header of a PLY file: what its elements are made of.

use super::error::{Fault, quote};
use super::text::Text;

pub(super) struct Header {
    pub(super) encoding: Encoding,
    pub(super) elements: Vec<Element>,
    /// Where the elements begin: the byte, and the line counted from 1.
    pub(super) end: usize,
    pub(super) lines: usize,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Ascii,
    LittleEndian,
    BigEndian,
}

pub(super) struct Element {
    pub(super) name: String,
    pub(super) count: usize,
    pub(super) properties: Vec<Property>,
    /// Where it is declared.
    pub(super) line: usize,
}

pub(super) struct Property {
    pub(super) name: String,
    pub(super) kind: Kind,
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
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

    fn named(name: &[u8]) -> Option<Self> {
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

impl Element {
    /// The least that one such element takes: in text, each value and a blank.
    fn least_bytes(&self, encoding: Encoding) -> u128 {
        let least = |property: &Property| match (encoding, property.kind) {
            (Encoding::Ascii, _) => 2,
            (_, Kind::Scalar(scalar) | Kind::List { count: scalar, .. }) => scalar.bytes() as u128,
        };
        self.properties.iter().map(least).sum()
    }
}

pub(super) fn parse(bytes: &[u8]) -> Result<Header, Fault> {
    let mut text = Text::<false>::new(bytes);
    let mut encoding = None;
    let mut elements: Vec<Element> = Vec::new();
    loop {
        if !text.next_line() {
            return Err(Fault::on_line(text.line, "`end_header`", "the end of the file"));
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
                        let wanted = "`ascii`, `binary_little_endian` or `binary_big_endian`";
                        return Err(Fault::on_line(line, wanted, quote(token)));
                    }
                });
            }
            b"element" => {
                let element = element(&mut text)?;
                if elements.iter().any(|e| e.name == element.name) {
                    return Err(Fault::on_line(line, "each element once", quote(element.name.as_bytes())));
                }
                elements.push(element);
            }
            b"property" => {
                let property = property(&mut text)?;
                let Some(element) = elements.last_mut() else {
                    return Err(Fault::on_line(line, "`element` first", "`property`"));
                };
                element.properties.push(property);
            }
            b"end_header" => break,
            b"comment" | b"obj_info" | b"" => {}
            token => return Err(Fault::on_line(line, "a keyword of PLY", quote(token))),
        }
    }
    let Some(encoding) = encoding else {
        return Err(Fault::on_line(text.line, "`format` before `end_header`", "none"));
    };
    // The first line tells how lines end. A CR of its own must not take a first byte of binary data for the LF to it.
    text.token();
    let cr_only = bytes.iter().position(|&b| b == b'\r').is_some_and(|cr| bytes.get(cr + 1) != Some(&b'\n'));
    let (mut end, lines) = (bytes.len() - text.rest().len(), text.line + 1);
    let after = |at: usize, byte: u8| usize::from(bytes.get(at) == Some(&byte));
    end += after(end, b'\r');
    if !(cr_only && bytes.get(end.wrapping_sub(1)) == Some(&b'\r')) {
        end += after(end, b'\n');
    }
    let header = Header { encoding, elements, end, lines };
    header.check_size((bytes.len() - end) as u128)?;
    Ok(header)
}

impl Header {
    /// Refuses counts that the rest of the file cannot hold, so that nothing is done for them.
    fn check_size(&self, left: u128) -> Result<(), Fault> {
        let mut least = 0u128;
        for element in &self.elements {
            least += element.count as u128 * element.least_bytes(self.encoding);
            // The last value of a text needs no blank.
            if least > left + u128::from(self.encoding == Encoding::Ascii) {
                let wanted = format!("{least} bytes or more after the header, for {} {}", element.count, element.name);
                return Err(Fault::on_line(element.line, wanted, left.to_string()));
            }
        }
        Ok(())
    }
}

fn element(text: &mut Text<false>) -> Result<Element, Fault> {
    let (name, count) = (text.token(), text.token());
    let number = str::from_utf8(count).ok().and_then(|count| count.parse().ok());
    match number {
        Some(count) if !name.is_empty() => {
            Ok(Element { name: printable(name), count, properties: Vec::new(), line: text.line })
        }
        _ => Err(Fault::on_line(text.line, "an element's name and number", quote(count))),
    }
}

fn property(text: &mut Text<false>) -> Result<Property, Fault> {
    let kind = match text.token() {
        b"list" => Kind::List { count: scalar(text, None)?, item: scalar(text, None)? },
        token => Kind::Scalar(scalar(text, Some(token))?),
    };
    let name = text.token();
    if name.is_empty() {
        return Err(Fault::on_line(text.line, "a property's name", "nothing"));
    }
    Ok(Property { name: printable(name), kind })
}

fn scalar(text: &mut Text<false>, token: Option<&[u8]>) -> Result<Scalar, Fault> {
    let token = token.unwrap_or_else(|| text.token());
    Scalar::named(token).ok_or_else(|| Fault::on_line(text.line, "a type such as `float` or `int32`", quote(token)))
}

/// A name that a message may show. Only plain ones mean anything to us.
fn printable(name: &[u8]) -> String {
    name.escape_ascii().take(40).map(char::from).collect()
}
