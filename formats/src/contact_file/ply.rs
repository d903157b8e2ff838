use super::{InSpace, Record};

/// A binary PLY of points, one an entry, with normals, distances and what else it has.
pub(super) fn bytes<T: Record>(records: &[T]) -> Vec<u8> {
    let properties = ["x", "y", "z", "nx", "ny", "nz", "distance"].map(|name| format!("property double {name}\n"));
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment {}\nelement vertex {}\n{}property {}\nend_header\n",
        T::PLY_COMMENT,
        records.len(),
        properties.concat(),
        T::PLY_LAST
    );
    let mut bytes = header.into_bytes();
    for record in records {
        let InSpace { point, normal, distance } = record.in_space();
        let numbers = point.into_iter().chain(normal).chain([distance]);
        numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.extend(record.ply_last());
    }
    bytes
}
