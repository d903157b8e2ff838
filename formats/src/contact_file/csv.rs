use std::io::{self, Write};

use super::Record;

/// A line of names, then a line for each entry.
pub(super) fn write<T: Record>(records: impl Iterator<Item = T>, out: &mut dyn Write) -> io::Result<()> {
    out.write_all(T::CSV_HEADER.as_bytes())?;
    for record in records {
        writeln!(out, "{}", record.csv_line())?;
    }
    Ok(())
}

/// Shortest text that reads back as the same number.
pub(super) fn number(number: &f64) -> String {
    format!("{number:?}")
}
