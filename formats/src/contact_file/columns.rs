//! Columns of a contact file in HDF5: datasets in one block each, filled a few thousand rows at a time.

use std::io;

use crate::hdf5::{Contiguous, Element, Group};

/// Records that are written at a time: their columns take a few MB, however many records there are.
const SLICE: usize = 4096;

type Create = dyn for<'f> Fn(&Group<'f>, usize) -> Contiguous<'f>;
type Encode<Row> = dyn Fn(&[Row]) -> Vec<u8>;

/// A dataset of a group: `N` numbers of each row.
pub struct Column<Row> {
    create: Box<Create>,
    encode: Box<Encode<Row>>,
}

impl<Row> Column<Row> {
    pub(super) fn new<T: Element, const N: usize>(
        name: &'static str,
        values: impl Fn(&Row) -> [T; N] + 'static,
    ) -> Self {
        let encode = move |rows: &[Row]| {
            let mut bytes = Vec::with_capacity(rows.len() * N * T::BYTES);
            rows.iter().flat_map(&values).for_each(|value| value.append_le(&mut bytes));
            bytes
        };
        Self { create: Box::new(create::<T, N>(name)), encode: Box::new(encode) }
    }
}

fn create<T: Element, const N: usize>(name: &'static str) -> impl for<'f> Fn(&Group<'f>, usize) -> Contiguous<'f> {
    move |group, rows| match N {
        1 => group.contiguous::<T>(name, &[rows]),
        _ => group.contiguous::<T>(name, &[rows, N]),
    }
}

/// Writes all columns, [`SLICE`] rows at a time.
pub(super) fn write<Row>(
    group: &Group,
    columns: &[Column<Row>],
    mut rows: impl ExactSizeIterator<Item = Row>,
) -> io::Result<()> {
    let count = rows.len();
    let datasets: Vec<_> = columns.iter().map(|column| (column.create)(group, count)).collect();
    let mut ends = vec![0; columns.len()];
    let mut slice = Vec::with_capacity(count.min(SLICE));
    for _ in (0..count).step_by(SLICE) {
        slice.clear();
        slice.extend(rows.by_ref().take(SLICE));
        for ((column, dataset), end) in columns.iter().zip(&datasets).zip(&mut ends) {
            let bytes = (column.encode)(&slice);
            dataset.write(*end, &bytes)?;
            *end += bytes.len() as u64;
        }
    }
    Ok(())
}
