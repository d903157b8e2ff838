//! The attributes of an HDF5 object by name, and the text whose SHA-256 is their checksum.

use std::fmt::Write;

use sha2::{Digest, Sha256};

use super::{GridFault, layout};
use crate::hdf5::{Hdf5Reader, Object, Value};

/// Attributes by name.
pub(super) struct Attributes(pub Vec<(&'static str, Value)>);

impl Attributes {
    pub(super) fn read(
        file: &Hdf5Reader,
        object: &Object,
        names: impl IntoIterator<Item = &'static str>,
    ) -> Result<Self, GridFault> {
        names
            .into_iter()
            .map(|name| Ok((name, file.attribute(object, name)?)))
            .collect::<Result<_, GridFault>>()
            .map(Self)
    }

    /// SHA-256 of lines `name=value`, as docs/format.md defines it.
    pub(super) fn checksum(&self) -> String {
        let mut text = String::new();
        for (name, value) in &self.0 {
            let value = match value {
                Value::Text(text) => text.clone(),
                Value::Integers(integers) => joined(integers, |integer| integer.to_string()),
                Value::Numbers(numbers) => joined(numbers, |number| format!("{:016x}", number.to_bits())),
            };
            writeln!(text, "{name}={value}").expect("writing to a String cannot fail");
        }
        layout::hex(&Sha256::digest(text))
    }

    pub(super) fn value(&self, name: &str) -> Result<&Value, GridFault> {
        let found = self.0.iter().find(|(known, _)| *known == name);
        found.map(|(_, value)| value).ok_or_else(|| unexpected(name))
    }

    pub(super) fn integers<const N: usize>(&self, name: &str) -> Result<[i128; N], GridFault> {
        match self.value(name)? {
            Value::Integers(integers) => integers.as_slice().try_into().map_err(|_| unexpected(name)),
            _ => Err(unexpected(name)),
        }
    }

    pub(super) fn numbers<const N: usize>(&self, name: &str) -> Result<[f64; N], GridFault> {
        match self.value(name)? {
            Value::Numbers(numbers) => numbers.as_slice().try_into().map_err(|_| unexpected(name)),
            _ => Err(unexpected(name)),
        }
    }

    pub(super) fn text(&self, name: &str) -> Result<&str, GridFault> {
        match self.value(name)? {
            Value::Text(text) => Ok(text),
            _ => Err(unexpected(name)),
        }
    }
}

fn joined<T>(values: &[T], written: impl Fn(&T) -> String) -> String {
    values.iter().map(written).collect::<Vec<_>>().join(" ")
}

fn unexpected(name: &str) -> GridFault {
    GridFault::not_a_grid(format!("its attribute {name} is not what docs/format.md says"))
}
