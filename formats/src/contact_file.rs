//! Lists of contacts on disk: CSV and JSON for people and scripts, PLY for viewers, HDF5 for everything else.
//!
//! A [`Record`] is one entry: a contact of a mesh element or an overlap point of two fields. docs/contacts.md describes
//! the files.

mod columns;
mod contact_record;
mod contact_rows;
mod csv;
mod label;
mod overlap_record;
mod ply;

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::Path;

pub use columns::Column;
pub use contact_record::ContactRecord;
pub use contact_rows::{ContactRows, ContactRowsIter};
pub use label::Label;
pub use overlap_record::{OverlapKind, OverlapRecord, OverlapStatus};

use crate::atomic_write::atomic_write;
use crate::hdf5::{self, Group};

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

    /// Name of the group of an HDF5 file.
    const GROUP: &'static str;

    /// Texts that the group has as attributes, beside the count of entries.
    fn texts() -> Vec<(&'static str, String)>;

    /// The group's datasets.
    fn columns() -> Vec<Column<Self>>;
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

/// Writes the file whole or not at all. `json` writes the document of a JSON file.
///
/// Entries are written as they come: they need not be in memory at once, and nothing of the file's size is.
pub fn write<T: Record>(
    path: &Path,
    format: ContactFormat,
    records: impl ExactSizeIterator<Item = T>,
    json: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    atomic_write(path, |temporary| match format {
        ContactFormat::Hdf5 => hdf5::create(temporary, |root| write_hdf5(root, records)),
        _ => {
            let mut out = BufWriter::new(File::create(temporary)?);
            write_to(&mut out, format, records, json)?;
            out.flush()
        }
    })
}

/// Writes the lines of a CSV file, as the entries come.
pub fn write_csv<T: Record>(out: &mut dyn Write, records: impl Iterator<Item = T>) -> io::Result<()> {
    csv::write(records, out)
}

/// The bytes that [`write()`] would write.
pub fn to_bytes<T: Record>(
    format: ContactFormat,
    records: impl ExactSizeIterator<Item = T>,
    json: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<Vec<u8>> {
    if format == ContactFormat::Hdf5 {
        return hdf5::to_bytes(|root| write_hdf5(root, records));
    }
    let mut bytes = Vec::new();
    write_to(&mut bytes, format, records, json)?;
    Ok(bytes)
}

fn write_to<T: Record>(
    out: &mut dyn Write,
    format: ContactFormat,
    records: impl ExactSizeIterator<Item = T>,
    json: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> io::Result<()> {
    match format {
        ContactFormat::Json => json(out),
        ContactFormat::Ply => ply::write(records, out),
        ContactFormat::Csv | ContactFormat::Hdf5 => csv::write(records, out),
    }
}

fn write_hdf5<T: Record>(root: &Group, records: impl ExactSizeIterator<Item = T>) -> io::Result<()> {
    let group = root.group(T::GROUP);
    T::texts().iter().for_each(|(name, text)| group.set_text(name, text));
    group.set_number("count", records.len() as u64);
    columns::write(&group, &T::columns(), records)
}
