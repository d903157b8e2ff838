//! Values of attributes: attribute messages (section IV.A.2.m) with a datatype (IV.A.2.d), a dataspace (IV.A.2.b), and
//! texts of variable length in a global heap (III.E).

use super::fields::Fields;
use super::object::Object;
use super::source::ByteSource;
use super::{MAX_TEXT_BYTES, ReadError};

const ATTRIBUTE: u16 = 0x0c;

/// Most numbers in an attribute; ours have at most 68.
const MAX_NUMBERS: u64 = 256;

/// Largest heap collection, in bytes: room for all texts of a grid at their longest.
const MAX_HEAP_BYTES: u64 = 16 * MAX_TEXT_BYTES as u64 + 4096;

/// The value of an attribute.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Value {
    /// Integers of any width and sign.
    Integers(Vec<i128>),
    Numbers(Vec<f64>),
    Text(String),
}

enum Type {
    Integer {
        size: usize,
        is_signed: bool,
    },
    F64,
    FixedText {
        size: usize,
    },
    /// Text of variable length, in a global heap.
    HeapText,
}

/// Does an object have an attribute of this name?
pub(super) fn exists(object: &Object, name: &str) -> Result<bool, ReadError> {
    for body in object.all(ATTRIBUTE) {
        if Message::read(body)?.name == name.as_bytes() {
            return Ok(true);
        }
    }
    Ok(false)
}

/// An attribute message, split into its parts.
struct Message<'a> {
    name: &'a [u8],
    /// `None` where it is shared.
    datatype: Option<&'a [u8]>,
    dataspace: &'a [u8],
    value: Fields<'a>,
}

impl<'a> Message<'a> {
    fn read(body: &'a [u8]) -> Result<Self, ReadError> {
        let mut fields = Fields(body);
        let version = fields.u8()?;
        let flags = fields.u8()?;
        let sizes = [fields.u16()?, fields.u16()?, fields.u16()?].map(usize::from);
        // Version 1 pads its parts to 8 bytes; version 3 has a byte for the name's encoding.
        let [name_size, type_size, space_size] = match version {
            1 => sizes.map(|size| size.next_multiple_of(8)),
            2 | 3 => sizes,
            _ => return Err(ReadError::damaged(format!("an attribute has version {version}"))),
        };
        if version == 3 {
            fields.skip(1)?;
        }
        let name = text_before_nul(fields.bytes(name_size)?);
        let datatype = fields.bytes(type_size)?;
        let dataspace = fields.bytes(space_size)?;
        let is_shared = version > 1 && flags != 0;
        Ok(Self { name, datatype: (!is_shared).then_some(datatype), dataspace, value: fields })
    }
}

pub(super) fn read(source: &ByteSource, object: &Object, name: &str) -> Result<Value, ReadError> {
    for body in object.all(ATTRIBUTE) {
        let message = Message::read(body)?;
        if message.name != name.as_bytes() {
            continue;
        }
        let mut fields = message.value;
        let datatype = message.datatype.map(datatype).transpose()?.flatten();
        let count = value_count(message.dataspace)?;
        let unknown = || ReadError::unexpected(format!("its attribute {name} has an unexpected type"));
        return match (datatype.ok_or_else(unknown)?, count) {
            (Type::HeapText, 1) => heap_text(source, fields),
            (Type::FixedText { size }, 1) => text(text_before_nul(fields.bytes(size)?)),
            (Type::F64, _) => {
                let numbers = fields.bytes(count * 8)?.chunks_exact(8);
                let number = |bytes: &[u8]| f64::from_le_bytes(bytes.try_into().expect("chunks of 8 bytes"));
                Ok(Value::Numbers(numbers.map(number).collect()))
            }
            (Type::Integer { size, is_signed }, _) => {
                let integers = fields.bytes(count * size)?.chunks_exact(size);
                Ok(Value::Integers(integers.map(|bytes| integer(bytes, is_signed)).collect()))
            }
            _ => Err(unknown()),
        };
    }
    Err(ReadError::unexpected(format!("it has no attribute {name}")))
}

/// Section IV.A.2.d; `None` for types that no grid has.
fn datatype(body: &[u8]) -> Result<Option<Type>, ReadError> {
    let mut fields = Fields(body);
    let class = fields.u8()? & 0xf;
    let bits = fields.array::<3>()?;
    let size = fields.u32()? as usize;
    Ok(match class {
        // Little-endian, no padding, every bit in use.
        0 if bits[0] & !8 == 0 && matches!(size, 1 | 2 | 4 | 8) => {
            let is_whole = [fields.u16()?, fields.u16()?] == [0, 8 * size as u16];
            is_whole.then_some(Type::Integer { size, is_signed: bits[0] & 8 != 0 })
        }
        1 if is_f64(bits, size, fields.0) => Some(Type::F64),
        3 if (1..=MAX_TEXT_BYTES).contains(&size) => Some(Type::FixedText { size }),
        9 if bits[0] & 0xf == 1 => Some(Type::HeapText),
        _ => None,
    })
}

fn is_f64(bits: [u8; 3], size: usize, properties: &[u8]) -> bool {
    bits == [0x20, 0x3f, 0] && size == 8 && properties.starts_with(&[0, 0, 64, 0, 52, 11, 0, 52, 255, 3, 0, 0])
}

/// Number of values in a dataspace, section IV.A.2.b; a scalar has one.
fn value_count(body: &[u8]) -> Result<usize, ReadError> {
    let mut fields = Fields(body);
    let version = fields.u8()?;
    let rank = fields.u8()?;
    fields.skip(match version {
        1 => 6,
        _ => 2,
    })?;
    let count = match rank {
        0 => 1,
        1 => fields.u64()?,
        _ => u64::MAX,
    };
    if count > MAX_NUMBERS {
        return Err(ReadError::unexpected(format!("an attribute has more than {MAX_NUMBERS} values")));
    }
    Ok(count as usize)
}

/// Section III.E. `reference` is the attribute's data: length, collection's address, index in it.
fn heap_text(source: &ByteSource, mut reference: Fields) -> Result<Value, ReadError> {
    let length = reference.u32()? as usize;
    let address = reference.u64()?;
    let wanted = reference.u32()?;
    if length == 0 {
        return text(b"");
    }
    if length > MAX_TEXT_BYTES {
        return Err(ReadError::damaged(format!("a text has {length} bytes")));
    }
    let head = source.read(address, 16)?;
    let mut fields = Fields(&head);
    fields.expect(b"GCOL")?;
    if fields.u32()? != 1 {
        return Err(ReadError::damaged("a heap of texts has another version than 1"));
    }
    let size = fields.u64()?;
    if !(16..=MAX_HEAP_BYTES).contains(&size) {
        return Err(ReadError::damaged(format!("a heap of texts has {size} bytes")));
    }
    let heap = source.read(address + 16, size as usize - 16)?;
    let mut fields = Fields(&heap);
    loop {
        let index = fields.u16()?;
        fields.skip(6)?;
        let size = usize::try_from(fields.u64()?).unwrap_or(usize::MAX);
        if index == 0 {
            return Err(ReadError::damaged("a text is missing"));
        }
        if u32::from(index) == wanted {
            return text(Fields(fields.bytes(size)?).bytes(length)?);
        }
        fields.skip(size.checked_next_multiple_of(8).unwrap_or(usize::MAX))?;
    }
}

fn text(bytes: &[u8]) -> Result<Value, ReadError> {
    let text = std::str::from_utf8(bytes).map_err(|_| ReadError::damaged("a text is not UTF-8"))?;
    Ok(Value::Text(text.to_owned()))
}

fn text_before_nul(bytes: &[u8]) -> &[u8] {
    bytes.split(|byte| *byte == 0).next().unwrap_or_default()
}

/// Sign extension to 128 bits.
fn integer(bytes: &[u8], is_signed: bool) -> i128 {
    let is_negative = is_signed && bytes.last().is_some_and(|byte| byte & 0x80 != 0);
    let mut wide = [if is_negative { 0xff } else { 0 }; 16];
    wide[..bytes.len()].copy_from_slice(bytes);
    i128::from_le_bytes(wide)
}
