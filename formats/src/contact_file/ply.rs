use std::io::{self, Write};

use super::{OrientedPoint, Record};

/// A binary PLY file with a vertex for each entry: position, normal, distance and [`Record::PLY_PROPERTY`].
pub(super) fn write<T: Record>(records: impl ExactSizeIterator<Item = T>, out: &mut dyn Write) -> io::Result<()> {
    let properties = ["x", "y", "z", "nx", "ny", "nz", "distance"].map(|name| format!("property double {name}\n"));
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment {}\nelement vertex {}\n{}property {}\nend_header\n",
        T::PLY_COMMENT,
        records.len(),
        properties.concat(),
        T::PLY_PROPERTY
    )?;
    for record in records {
        let OrientedPoint { point, normal, distance } = record.oriented_point();
        for number in point.into_iter().chain(normal).chain([distance]) {
            out.write_all(&number.to_le_bytes())?;
        }
        out.write_all(&record.ply_property())?;
    }
    Ok(())
}
