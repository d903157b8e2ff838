use std::io;
use std::path::Path;

use rust_hdf5::{H5File, H5Group, H5Type, Hdf5Error};

use super::{ContactRecord, InSpace, Record, csv};
use crate::hdf5;

pub(super) fn write<T: Record>(path: &Path, records: &[T]) -> io::Result<()> {
    hdf5::create(path, |file| T::fill_hdf5(file, records))
}

impl Record for ContactRecord {
    const CSV_NAMES: &'static str = csv::NAMES;
    const PLY_COMMENT: &'static str = "contacts";
    const PLY_LAST: &'static str = "uint element";

    fn csv_line(&self) -> String {
        csv::line(self)
    }

    fn in_space(&self) -> InSpace {
        InSpace { point: self.point, normal: self.normal, distance: self.distance }
    }

    fn ply_last(&self) -> Vec<u8> {
        self.id.to_le_bytes().to_vec()
    }

    fn fill_hdf5(file: &H5File, contacts: &[Self]) -> Result<(), Hdf5Error> {
        fill(file, contacts)
    }
}

/// A group `/contacts` with one dataset a column, all of as many rows as there are contacts. Words are numbered: element
/// and feature 0 vertex, 1 edge, 2 face; status as the attribute `status_names` lists them. What does not exist, such
/// as the third weight of an edge, is 0; `feature_id` has 4294967295 for a second vertex that is none.
fn fill(file: &H5File, contacts: &[ContactRecord]) -> Result<(), Hdf5Error> {
    let group = file.create_group("contacts")?;
    group.set_attr_numeric("count", &(contacts.len() as u64))?;
    group.set_attr_string("kind_names", &KINDS.join(" "))?;
    group.set_attr_string("status_names", &STATUSES.join(" "))?;

    let table = Table { group: &group, rows: contacts };
    let number = |names: &[&str], name: &str| names.iter().position(|known| *known == name).unwrap_or(0) as u8;
    table.column("element", |contact| [number(&KINDS, contact.element)])?;
    table.column("id", |contact| [contact.id])?;
    table.column("polygon", |contact| [contact.polygon.unwrap_or(0)])?;
    table.column("feature", |contact| [number(&KINDS, contact.feature)])?;
    table.column("feature_id", |contact| {
        [0, 1].map(|place| contact.feature_id.get(place).copied().unwrap_or(u32::MAX))
    })?;
    table.column("weights", |contact| [0, 1, 2].map(|corner| contact.weights.get(corner).copied().unwrap_or(0.0)))?;
    table.column("point", |contact| contact.point)?;
    table.column("surface_point", |contact| contact.surface_point)?;
    table.column("normal", |contact| contact.normal)?;
    table.column("distance", |contact| [contact.distance])?;
    table.column("lower_bound", |contact| [contact.lower_bound])?;
    table.column("evaluations", |contact| [contact.evaluations])?;
    table.column("status", |contact| [number(&STATUSES, contact.status)])?;
    table.column("key", |contact| [contact.key])
}

const KINDS: [&str; 3] = ["vertex", "edge", "face"];
const STATUSES: [&str; 4] = ["converged", "budget_spent", "outside_grid", "degenerate_gradient"];

/// Rows of a group, one dataset a column.
pub(super) struct Table<'a, Row> {
    pub group: &'a H5Group,
    pub rows: &'a [Row],
}

impl<Row> Table<'_, Row> {
    pub fn column<T: H5Type, const N: usize>(&self, name: &str, of: impl Fn(&Row) -> [T; N]) -> Result<(), Hdf5Error> {
        let values: Vec<T> = self.rows.iter().flat_map(of).collect();
        let rows = self.rows.len();
        let dataset = self.group.new_dataset::<T>();
        let dataset = if N == 1 { dataset.shape([rows]) } else { dataset.shape([rows, N]) };
        let dataset = dataset.create(name)?;
        // Of no rows there is nothing to write, and rust-hdf5 refuses to.
        if rows == 0 { Ok(()) } else { dataset.write_raw(&values) }
    }
}
