use super::{OrientedPoint, Record};

/// A binary PLY file with a vertex for each entry: position, normal, distance and [`Record::PLY_PROPERTY`].
pub(super) fn bytes<T: Record>(records: &[T]) -> Vec<u8> {
    let properties = ["x", "y", "z", "nx", "ny", "nz", "distance"].map(|name| format!("property double {name}\n"));
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment {}\nelement vertex {}\n{}property {}\nend_header\n",
        T::PLY_COMMENT,
        records.len(),
        properties.concat(),
        T::PLY_PROPERTY
    );
    let mut bytes = header.into_bytes();
    for record in records {
        let OrientedPoint { point, normal, distance } = record.oriented_point();
        let numbers = point.into_iter().chain(normal).chain([distance]);
        numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.extend(record.ply_property());
    }
    bytes
}
