use super::Record;

/// A line of names, then a line for each entry.
pub(super) fn text<T: Record>(records: &[T]) -> String {
    let lines = records.iter().map(|record| record.csv_line() + "\n");
    std::iter::once(T::CSV_HEADER.to_owned()).chain(lines).collect()
}

/// Shortest text that reads back as the same number.
pub(super) fn number(number: &f64) -> String {
    format!("{number:?}")
}
