use rust_hdf5::{H5Dataset, H5Group, H5Type, Hdf5Error};

/// Records that are written at a time: their columns take a few MB, however many records there are.
const SLICE: usize = 4096;

type Create = dyn Fn(&H5Group, usize) -> Result<H5Dataset, Hdf5Error>;
type WriteSlice<Row> = dyn Fn(&H5Dataset, usize, &[Row]) -> Result<(), Hdf5Error>;

/// A dataset of a group: `N` numbers of each row.
pub struct Column<Row> {
    create: Box<Create>,
    write: Box<WriteSlice<Row>>,
}

impl<Row> Column<Row> {
    pub(super) fn new<T: H5Type, const N: usize>(
        name: &'static str,
        values: impl Fn(&Row) -> [T; N] + 'static,
    ) -> Self {
        let create = move |group: &H5Group, rows: usize| {
            let dataset = group.new_dataset::<T>();
            let dataset = if N == 1 { dataset.shape([rows]) } else { dataset.shape([rows, N]) };
            dataset.create(name)
        };
        let write = move |dataset: &H5Dataset, first: usize, rows: &[Row]| {
            let values: Vec<T> = rows.iter().flat_map(&values).collect();
            let (starts, counts) = ([first, 0], [rows.len(), N]);
            let axes = if N == 1 { 1 } else { 2 };
            dataset.write_slice(&starts[..axes], &counts[..axes], &values)
        };
        Self { create: Box::new(create), write: Box::new(write) }
    }
}

/// Writes all columns, [`SLICE`] rows at a time.
pub(super) fn write<Row>(
    group: &H5Group,
    columns: &[Column<Row>],
    mut rows: impl ExactSizeIterator<Item = Row>,
) -> Result<(), Hdf5Error> {
    let count = rows.len();
    let datasets = columns.iter().map(|column| (column.create)(group, count)).collect::<Result<Vec<_>, _>>()?;
    let mut slice = Vec::with_capacity(count.min(SLICE));
    for first in (0..count).step_by(SLICE) {
        slice.clear();
        slice.extend(rows.by_ref().take(SLICE));
        for (column, dataset) in columns.iter().zip(&datasets) {
            (column.write)(dataset, first, &slice)?;
        }
    }
    Ok(())
}
