use super::bytes::{Bytes, Fields};
use super::object::Object;
use crate::grid_file::{Fault, layout::MAX_TEXT};

const ATTRIBUTE: u16 = 0x0c;

/// Of numbers that an attribute has; ours have 9 at most.
const MAX_NUMBERS: u64 = 64;

/// The most that a heap of texts of the longest kind takes.
const MAX_HEAP_BYTES: u64 = 16 * MAX_TEXT as u64 + 4096;

/// What an attribute holds.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::grid_file) enum Value {
    /// Every integer type fits.
    Integers(Vec<i128>),
    Numbers(Vec<f64>),
    Text(String),
}

enum Type {
    Integer {
        size: usize,
        signed: bool,
    },
    F64,
    FixedText {
        size: usize,
    },
    /// In a global heap.
    Text,
}

/// Section IV.A.2.m.
pub(super) fn read(bytes: &mut Bytes, object: &Object, name: &str) -> Result<Value, Fault> {
    for body in object.all(ATTRIBUTE) {
        let mut fields = Fields(body);
        let version = fields.u8()?;
        let flags = fields.u8()?;
        let sizes = [fields.u16()?, fields.u16()?, fields.u16()?].map(usize::from);
        // Version 1 pads its parts to 8 bytes, version 3 says how the name is encoded.
        let [name_size, type_size, space_size] = match version {
            1 => sizes.map(|size| size.next_multiple_of(8)),
            2 | 3 => sizes,
            _ => return Err(Fault::damaged(format!("an attribute has version {version}"))),
        };
        if version == 3 {
            fields.skip(1)?;
        }
        if until_nul(fields.take(name_size)?) != name.as_bytes() {
            continue;
        }
        let kind = if version > 1 && flags != 0 { None } else { datatype(fields.take(type_size)?)? };
        let count = dataspace(fields.take(space_size)?)?;
        let unknown = || Fault::not_a_grid(format!("its attribute {name} is of an unexpected type"));
        return match (kind.ok_or_else(unknown)?, count) {
            (Type::Text, 1) => heap_text(bytes, fields),
            (Type::FixedText { size }, 1) => text(until_nul(fields.take(size)?)),
            (Type::F64, _) => {
                let numbers = fields.take(count * 8)?.chunks_exact(8);
                Ok(Value::Numbers(numbers.map(|number| f64::from_le_bytes(number.try_into().expect("8"))).collect()))
            }
            (Type::Integer { size, signed }, _) => {
                let integers = fields.take(count * size)?.chunks_exact(size);
                Ok(Value::Integers(integers.map(|integer| widen(integer, signed)).collect()))
            }
            _ => Err(unknown()),
        };
    }
    Err(Fault::not_a_grid(format!("it has no attribute {name}")))
}

/// Section IV.A.2.d. `None` for what we have no use for.
fn datatype(body: &[u8]) -> Result<Option<Type>, Fault> {
    let mut fields = Fields(body);
    let class = fields.u8()? & 0xf;
    let bits = fields.array::<3>()?;
    let size = fields.u32()? as usize;
    Ok(match class {
        // Little-endian, no padding, every bit in use.
        0 if bits[0] & !8 == 0 && matches!(size, 1 | 2 | 4 | 8) => {
            let whole = [fields.u16()?, fields.u16()?] == [0, 8 * size as u16];
            whole.then_some(Type::Integer { size, signed: bits[0] & 8 != 0 })
        }
        1 if is_f64(bits, size, fields.0) => Some(Type::F64),
        3 if (1..=MAX_TEXT).contains(&size) => Some(Type::FixedText { size }),
        9 if bits[0] & 0xf == 1 => Some(Type::Text),
        _ => None,
    })
}

fn is_f64(bits: [u8; 3], size: usize, properties: &[u8]) -> bool {
    bits == [0x20, 0x3f, 0] && size == 8 && properties.starts_with(&[0, 0, 64, 0, 52, 11, 0, 52, 255, 3, 0, 0])
}

/// Section IV.A.2.b: how many values there are, one for a scalar.
fn dataspace(body: &[u8]) -> Result<usize, Fault> {
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
        return Err(Fault::not_a_grid("an attribute has very many values"));
    }
    Ok(count as usize)
}

/// Section III.E.
fn heap_text(bytes: &mut Bytes, mut reference: Fields) -> Result<Value, Fault> {
    let length = reference.u32()? as usize;
    let address = reference.u64()?;
    let wanted = reference.u32()?;
    if length == 0 {
        return text(b"");
    }
    if length > MAX_TEXT {
        return Err(Fault::damaged(format!("a text has {length} bytes")));
    }
    let head = bytes.at(address, 16)?;
    let mut fields = Fields(&head);
    fields.expect(b"GCOL")?;
    fields.skip(4)?;
    let size = fields.u64()?;
    if !(16..=MAX_HEAP_BYTES).contains(&size) {
        return Err(Fault::damaged(format!("a heap of texts has {size} bytes")));
    }
    let heap = bytes.at(address + 16, size as usize - 16)?;
    let mut fields = Fields(&heap);
    loop {
        let index = fields.u16()?;
        fields.skip(6)?;
        let size = usize::try_from(fields.u64()?).unwrap_or(usize::MAX);
        if index == 0 {
            return Err(Fault::damaged("a text is missing"));
        }
        if u32::from(index) == wanted {
            return text(Fields(fields.take(size)?).take(length)?);
        }
        fields.skip(size.checked_next_multiple_of(8).unwrap_or(usize::MAX))?;
    }
}

fn text(bytes: &[u8]) -> Result<Value, Fault> {
    let text = std::str::from_utf8(bytes).map_err(|_| Fault::damaged("a text is not UTF-8"))?;
    Ok(Value::Text(text.to_owned()))
}

fn until_nul(bytes: &[u8]) -> &[u8] {
    bytes.split(|byte| *byte == 0).next().unwrap_or_default()
}

fn widen(integer: &[u8], signed: bool) -> i128 {
    let negative = signed && integer.last().is_some_and(|byte| byte & 0x80 != 0);
    let mut wide = [if negative { 0xff } else { 0 }; 16];
    wide[..integer.len()].copy_from_slice(integer);
    i128::from_le_bytes(wide)
}
