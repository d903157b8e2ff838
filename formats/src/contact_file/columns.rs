use rust_hdf5::{H5Group, H5Type, Hdf5Error};

/// Rows of a group with a dataset for each column.
pub(super) struct Columns<'a, Row> {
    pub group: &'a H5Group,
    pub rows: &'a [Row],
}

impl<Row> Columns<'_, Row> {
    pub fn write<T: H5Type, const N: usize>(
        &self,
        name: &str,
        values: impl Fn(&Row) -> [T; N],
    ) -> Result<(), Hdf5Error> {
        let values: Vec<T> = self.rows.iter().flat_map(values).collect();
        let rows = self.rows.len();
        let dataset = self.group.new_dataset::<T>();
        let dataset = if N == 1 { dataset.shape([rows]) } else { dataset.shape([rows, N]) };
        let dataset = dataset.create(name)?;
        // rust-hdf5 refuses to write no rows.
        if rows == 0 { Ok(()) } else { dataset.write_raw(&values) }
    }
}
