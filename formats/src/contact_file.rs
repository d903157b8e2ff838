//! Lists of contacts on disk: CSV and JSON for people and scripts, PLY for viewers, HDF5 for everything else.
//!
//! A [`Record`] is one entry: a contact of a mesh element or an overlap point of two fields. docs/contacts.md describes
//! the files.

mod columns;
mod contact_record;
mod csv;
mod label;
mod overlap_record;
mod ply;

use std::io;
use std::path::Path;

use rust_hdf5::{H5File, Hdf5Error};

pub use contact_record::ContactRecord;
pub use label::Label;
pub use overlap_record::{OverlapKind, OverlapRecord, OverlapStatus};

use crate::atomic_write::{atomic_write, temporary_bytes};
use crate::hdf5;

/// Format of a contact file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactFormat {
    /// A header and a line for each entry.
    Csv,
    /// The document that the caller passes.
    Json,
    /// Binary PLY: a vertex for each entry.
    Ply,
    /// A dataset for each column.
    Hdf5,
}

impl ContactFormat {
    /// The format of a name that ends in csv, json, ply or h5.
    pub fn from_extension(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "json" => Some(Self::Json),
            "ply" => Some(Self::Ply),
            "h5" => Some(Self::Hdf5),
            _ => None,
        }
    }
}

/// An entry of a list, as it stands in each format.
pub trait Record: Sized {
    /// First line of a CSV file, with its line feed.
    const CSV_HEADER: &'static str;
    /// Comment in a PLY header.
    const PLY_COMMENT: &'static str;
    /// Last property of a PLY vertex: type and name.
    const PLY_PROPERTY: &'static str;

    /// A line of a CSV file, without its line feed.
    fn csv_line(&self) -> String;

    /// Position, normal and distance, for viewers.
    fn oriented_point(&self) -> OrientedPoint;

    /// Little-endian value of [`Self::PLY_PROPERTY`].
    fn ply_property(&self) -> Vec<u8>;

    /// Writes a group with a dataset for each column.
    fn write_hdf5(file: &H5File, records: &[Self]) -> Result<(), Hdf5Error>;
}

/// Position, normal and distance, which every entry has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrientedPoint {
    /// The point on the element, or between the fields.
    pub point: [f64; 3],
    /// Unit normal, or zero where there is none.
    pub normal: [f64; 3],
    /// Signed distance at the point.
    pub distance: f64,
}

/// Writes the file whole or not at all. `json` returns the document of a JSON file.
pub fn write<T: Record>(
    path: &Path,
    format: ContactFormat,
    records: &[T],
    json: impl FnOnce() -> Vec<u8>,
) -> io::Result<()> {
    atomic_write(path, |temporary| match format {
        ContactFormat::Hdf5 => hdf5::create(temporary, |file| T::write_hdf5(file, records)),
        _ => std::fs::write(temporary, to_bytes(format, records, json)?),
    })
}

/// The bytes that [`write()`] would write. HDF5 passes through a temporary file, as in [`crate::grid_file::to_bytes`].
pub fn to_bytes<T: Record>(
    format: ContactFormat,
    records: &[T],
    json: impl FnOnce() -> Vec<u8>,
) -> io::Result<Vec<u8>> {
    Ok(match format {
        ContactFormat::Csv => csv::text(records).into_bytes(),
        ContactFormat::Json => json(),
        ContactFormat::Ply => ply::bytes(records),
        ContactFormat::Hdf5 => temporary_bytes(|path| hdf5::create(path, |file| T::write_hdf5(file, records)))?,
    })
}
