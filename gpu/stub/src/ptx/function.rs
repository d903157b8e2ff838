//! Operations without memory or control flow, as functions of three operands.
//!
//! A register holds 64 bits: a number of fewer has zeros above it, a predicate is 0 or 1.

use std::cmp::Ordering;

/// The bit that tells an address of local memory from a generic one: on a card they are different numbers.
pub const LOCAL: u64 = 1 << 60;

/// A result from up to three operands.
pub type Function = fn(u64, u64, u64) -> u64;

/// A type of PTX in a register.
trait Number: Copy {
    fn get(bits: u64) -> Self;
    fn put(self) -> u64;
}

macro_rules! whole {
    ($($type:ty, $bits:ty;)+) => {$(
        impl Number for $type {
            fn get(bits: u64) -> Self {
                bits as Self
            }
            fn put(self) -> u64 {
                self as $bits as u64
            }
        }
    )+};
}

whole! { u16, u16; u32, u32; u64, u64; i16, u16; i32, u32; i64, u64; }

impl Number for f32 {
    fn get(bits: u64) -> Self {
        Self::from_bits(bits as u32)
    }
    fn put(self) -> u64 {
        u64::from(self.to_bits())
    }
}

impl Number for f64 {
    fn get(bits: u64) -> Self {
        Self::from_bits(bits)
    }
    fn put(self) -> u64 {
        self.to_bits()
    }
}

impl Number for bool {
    fn get(bits: u64) -> Self {
        bits & 1 == 1
    }
    fn put(self) -> u64 {
        u64::from(self)
    }
}

/// A function of operands of one type.
macro_rules! function {
    ($type:ty: $a:ident, $b:ident, $c:ident => $result:expr) => {
        |a, b, c| {
            let ($a, $b, $c): ($type, $type, $type) = (Number::get(a), Number::get(b), Number::get(c));
            let _ = ($a, $b, $c);
            Number::put($result)
        }
    };
}

macro_rules! float {
    ($type:ty, $op:expr) => {
        Some(match $op {
            "add" => function!($type: a, b, _c => a + b),
            "sub" => function!($type: a, b, _c => a - b),
            "mul" => function!($type: a, b, _c => a * b),
            "div" => function!($type: a, b, _c => a / b),
            "rcp" => function!($type: a, _b, _c => 1.0 / a),
            "sqrt" => function!($type: a, _b, _c => a.sqrt()),
            "abs" => function!($type: a, _b, _c => a.abs()),
            "neg" => function!($type: a, _b, _c => -a),
            "min" => function!($type: a, b, _c => a.min(b)),
            "max" => function!($type: a, b, _c => a.max(b)),
            // The sign of the first, the magnitude of the second.
            "copysign" => function!($type: a, b, _c => b.copysign(a)),
            "lt" => function!($type: a, b, _c => a < b),
            "le" => function!($type: a, b, _c => a <= b),
            "gt" => function!($type: a, b, _c => a > b),
            "ge" => function!($type: a, b, _c => a >= b),
            "eq" => function!($type: a, b, _c => a == b),
            "ne" => function!($type: a, b, _c => a.partial_cmp(&b).is_some_and(Ordering::is_ne)),
            "ltu" => function!($type: a, b, _c => a.partial_cmp(&b).is_none_or(Ordering::is_lt)),
            "leu" => function!($type: a, b, _c => a.partial_cmp(&b).is_none_or(Ordering::is_le)),
            "gtu" => function!($type: a, b, _c => a.partial_cmp(&b).is_none_or(Ordering::is_gt)),
            "geu" => function!($type: a, b, _c => a.partial_cmp(&b).is_none_or(Ordering::is_ge)),
            "equ" => function!($type: a, b, _c => a.partial_cmp(&b).is_none_or(Ordering::is_eq)),
            "neu" => function!($type: a, b, _c => a != b),
            "num" => function!($type: a, b, _c => !a.is_nan() && !b.is_nan()),
            "nan" => function!($type: a, b, _c => a.is_nan() || b.is_nan()),
            _ => return None,
        })
    };
}

macro_rules! integer {
    ($type:ty, $wide:ty, $op:expr) => {
        Some(match $op {
            "add" => function!($type: a, b, _c => a.wrapping_add(b)),
            "sub" => function!($type: a, b, _c => a.wrapping_sub(b)),
            "mul.lo" => function!($type: a, b, _c => a.wrapping_mul(b)),
            "mul.hi" => function!($type: a, b, _c => ((a as $wide * b as $wide) >> <$type>::BITS) as $type),
            "mad.lo" => function!($type: a, b, c => a.wrapping_mul(b).wrapping_add(c)),
            "div" => function!($type: a, b, _c => a.checked_div(b).unwrap_or(0)),
            "min" => function!($type: a, b, _c => a.min(b)),
            "max" => function!($type: a, b, _c => a.max(b)),
            "neg" => function!($type: a, _b, _c => a.wrapping_neg()),
            "abs" => function!($type: a, _b, _c => if a < (0 as $type) { a.wrapping_neg() } else { a }),
            "and" => function!($type: a, b, _c => a & b),
            "or" => function!($type: a, b, _c => a | b),
            "xor" => function!($type: a, b, _c => a ^ b),
            "not" => function!($type: a, _b, _c => !a),
            "shl" => |a, b, _| <$type as Number>::get(a).checked_shl(b as u32).unwrap_or(0).put(),
            "shr" => |a, b, _| {
                let last = <$type>::BITS - 1;
                let a = <$type as Number>::get(a);
                if b as u32 > last { (a >> last >> 1) } else { a >> b as u32 }.put()
            },
            "lt" => function!($type: a, b, _c => a < b),
            "le" => function!($type: a, b, _c => a <= b),
            "gt" => function!($type: a, b, _c => a > b),
            "ge" => function!($type: a, b, _c => a >= b),
            "eq" => function!($type: a, b, _c => a == b),
            "ne" => function!($type: a, b, _c => a != b),
            _ => return None,
        })
    };
}

/// The function of an operation such as `add.rn.f32`, `setp.lt.u64` or `cvt.rzi.u32.f32`.
pub fn function(operation: &str) -> Option<Function> {
    let is_rounding = |part: &&str| !matches!(*part, "rn" | "rzi" | "uni");
    let parts: Vec<&str> = operation.split('.').filter(is_rounding).collect();
    match parts[..] {
        ["cvt", "rmi", "f32", "f32"] => Some(|a, _, _| <f32 as Number>::get(a).floor().put()),
        ["cvt", to, from] => convert(to, from),
        ["cvta", "local", _] => Some(|a, _, _| {
            assert!(a & LOCAL != 0, "cvta.local of {a:x}, which is no address of local memory");
            a & !LOCAL
        }),
        ["cvta", "to", "local", _] => Some(|a, _, _| {
            assert!(a & LOCAL == 0, "cvta.to.local of {a:x}, which is one already");
            a | LOCAL
        }),
        // Of two halves, or of one number and nothing.
        ["mov", "b64"] => Some(|a, b, _| a | b << 32),
        ["mov", "b32"] => Some(|a, b, _| a | b << 16),
        ["mov" | "cvta", ..] => Some(|a, _, _| a),
        ["selp", _] => Some(|a, b, c| if c & 1 == 1 { a } else { b }),
        ["mul", "wide", "u32"] => Some(|a, b, _| a.wrapping_mul(b)),
        ["mul", "wide", "u16"] => Some(|a, b, _| a.wrapping_mul(b)),
        ["mul", "wide", "s32"] => Some(|a, b, _| (i64::from(a as i32) * i64::from(b as i32)) as u64),
        ["popc", _] => Some(|a, _, _| u64::from(a.count_ones())),
        ["bfe", "u32"] => Some(|a, b, c| (a as u32 as u64) >> (b & 255).min(63) & ((1 << (c & 255).min(32)) - 1)),
        ["prmt", "b32"] => Some(permute),
        ["shf", "l", "wrap", "b32"] => Some(|a, b, c| (b << 32 | a & 0xffff_ffff) << (c & 31) >> 32),
        ["shf", "r", "wrap", "b32"] => Some(|a, b, c| (b << 32 | a & 0xffff_ffff) >> (c & 31) & 0xffff_ffff),
        ["mul" | "mad", half, type_] => of_type(type_, &format!("{}.{half}", parts[0])),
        ["setp", compare, type_] => of_type(type_, compare),
        [op, type_] => of_type(type_, op),
        _ => None,
    }
}

/// Refuses a store of so few bytes of a register: where that holds a float, ptxas stores its value, converted, and not its low bits.
pub fn check_stored(register: &str, bytes: usize) {
    let fewest = [("%rs", 1), ("%rd", 8), ("%r", 4)].iter().find(|(start, _)| register.starts_with(start));
    assert!(
        fewest.is_none_or(|(_, fewest)| bytes >= *fewest),
        "a store of {bytes} bytes of {register}, which has more"
    );
}

fn of_type(type_: &str, op: &str) -> Option<Function> {
    match type_ {
        "f32" => float!(f32, op),
        "f64" => float!(f64, op),
        "u16" | "b16" => integer!(u16, u32, op),
        "u32" | "b32" => integer!(u32, u64, op),
        "u64" | "b64" => integer!(u64, u128, op),
        "s16" => integer!(i16, i32, op),
        "s32" => integer!(i32, i64, op),
        "s64" => integer!(i64, i128, op),
        "pred" => Some(match op {
            "and" => function!(bool: a, b, _c => a & b),
            "or" => function!(bool: a, b, _c => a | b),
            "xor" => function!(bool: a, b, _c => a ^ b),
            "not" => function!(bool: a, _b, _c => !a),
            _ => return None,
        }),
        _ => None,
    }
}

/// The bytes of two words that four digits choose.
fn permute(a: u64, b: u64, digits: u64) -> u64 {
    let bytes = (b << 32 | a & 0xffff_ffff).to_le_bytes();
    let byte = |k: u64| {
        let digit = digits >> (4 * k) & 15;
        let byte = bytes[digit as usize & 7];
        u64::from(if digit < 8 { byte } else { ((byte as i8) >> 7) as u8 })
    };
    (0..4).fold(0, |word, k| word | byte(k) << (8 * k))
}

/// Conversions, of which those to whole numbers round to zero and saturate, as `as` does.
fn convert(to: &str, from: &str) -> Option<Function> {
    macro_rules! from {
        ($to:ty) => {
            Some(match from {
                "f32" => |a, _, _| (<f32 as Number>::get(a) as $to).put(),
                "f64" => |a, _, _| (<f64 as Number>::get(a) as $to).put(),
                "u16" => |a, _, _| (<u16 as Number>::get(a) as $to).put(),
                "u32" => |a, _, _| (<u32 as Number>::get(a) as $to).put(),
                "u64" => |a, _, _| (<u64 as Number>::get(a) as $to).put(),
                "s16" => |a, _, _| (<i16 as Number>::get(a) as $to).put(),
                "s32" => |a, _, _| (<i32 as Number>::get(a) as $to).put(),
                "s64" => |a, _, _| (<i64 as Number>::get(a) as $to).put(),
                _ => return None,
            })
        };
    }
    match to {
        "f32" => from!(f32),
        "f64" => from!(f64),
        "u16" => from!(u16),
        "u32" => from!(u32),
        "u64" => from!(u64),
        "s16" => from!(i16),
        "s32" => from!(i32),
        "s64" => from!(i64),
        _ => None,
    }
}
