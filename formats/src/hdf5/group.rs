//! A group that is being written: in a file ([`H5Group`]), or in memory ([`super::memory`]).

use rust_hdf5::{DatatypeMessage, H5Dataset, H5Group, H5Type, Hdf5Error};

use super::element::Element;
use super::packing::DEFLATE_LEVEL;

/// A group to put attributes, datasets and groups into.
pub(crate) trait Group: Sized {
    type Dataset: ChunkedDataset;

    /// Adds a group.
    fn add_group(&self, name: &str) -> Result<Self, Hdf5Error>;

    /// Sets an attribute to a text.
    fn set_text(&self, name: &str, text: &str) -> Result<(), Hdf5Error>;

    /// Sets an attribute to an ASCII text of fixed length.
    fn set_ascii(&self, name: &str, text: &str) -> Result<(), Hdf5Error>;

    fn set_number<T: Number>(&self, name: &str, number: T) -> Result<(), Hdf5Error>;

    fn set_numbers<T: Number>(&self, name: &str, numbers: &[T]) -> Result<(), Hdf5Error>;

    /// Adds a deflated dataset, its bytes shuffled if elements have several.
    fn dataset<T: Element>(&self, name: &str, shapes: [&[usize]; 2]) -> Result<Self::Dataset, Hdf5Error>;
}

/// A dataset to put chunks into.
pub(crate) trait ChunkedDataset {
    /// Puts the next chunk, as it stands in the file.
    fn put_chunk(&self, index: usize, packed: Vec<u8>) -> Result<(), Hdf5Error>;

    /// Sets an attribute to an ASCII text of fixed length.
    fn label(&self, name: &str, text: &str) -> Result<(), Hdf5Error>;
}

/// A number of an attribute.
pub(crate) trait Number: H5Type {
    fn little_endian(self) -> [u8; 8];
}

impl Number for f64 {
    fn little_endian(self) -> [u8; 8] {
        self.to_le_bytes()
    }
}

impl Number for i64 {
    fn little_endian(self) -> [u8; 8] {
        self.to_le_bytes()
    }
}

impl Number for u64 {
    fn little_endian(self) -> [u8; 8] {
        self.to_le_bytes()
    }
}

impl Group for H5Group {
    type Dataset = H5Dataset;

    fn add_group(&self, name: &str) -> Result<Self, Hdf5Error> {
        self.create_group(name)
    }

    fn set_text(&self, name: &str, text: &str) -> Result<(), Hdf5Error> {
        self.set_attr_string(name, text)
    }

    fn set_ascii(&self, name: &str, text: &str) -> Result<(), Hdf5Error> {
        self.set_attr_typed(name, fixed_ascii(text), text.into())
    }

    fn set_number<T: Number>(&self, name: &str, number: T) -> Result<(), Hdf5Error> {
        self.set_attr_numeric(name, &number)
    }

    fn set_numbers<T: Number>(&self, name: &str, numbers: &[T]) -> Result<(), Hdf5Error> {
        self.set_attr_array_numeric(name, numbers)
    }

    fn dataset<T: Element>(&self, name: &str, [shape, chunk_shape]: [&[usize]; 2]) -> Result<H5Dataset, Hdf5Error> {
        let dataset = self.new_dataset::<T>().shape(shape).chunk(chunk_shape);
        match T::BYTES {
            1 => dataset.deflate(DEFLATE_LEVEL).create(name),
            _ => dataset.shuffle_deflate(DEFLATE_LEVEL).create(name),
        }
    }
}

impl ChunkedDataset for H5Dataset {
    fn put_chunk(&self, index: usize, packed: Vec<u8>) -> Result<(), Hdf5Error> {
        self.write_chunk_raw(index, &packed, 0)
    }

    fn label(&self, name: &str, text: &str) -> Result<(), Hdf5Error> {
        self.set_attr_typed(name, fixed_ascii(text), text.into())
    }
}

/// Type of an ASCII text of fixed length, padded with NUL.
pub(super) fn fixed_ascii(text: &str) -> DatatypeMessage {
    DatatypeMessage::FixedString { size: text.len() as u32, padding: 1, charset: 0 }
}
