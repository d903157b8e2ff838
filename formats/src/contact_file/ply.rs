use super::ContactRecord;

/// A binary PLY of points, one a contact, with normals, distances and element ids.
pub(super) fn bytes(contacts: &[ContactRecord]) -> Vec<u8> {
    let properties = ["x", "y", "z", "nx", "ny", "nz", "distance"].map(|name| format!("property double {name}\n"));
    let header = format!(
        "ply\nformat binary_little_endian 1.0\ncomment contacts\nelement vertex {}\n{}property uint element\nend_header\n",
        contacts.len(),
        properties.concat()
    );
    let mut bytes = header.into_bytes();
    for contact in contacts {
        let numbers = contact.point.into_iter().chain(contact.normal).chain([contact.distance]);
        numbers.for_each(|number| bytes.extend(number.to_le_bytes()));
        bytes.extend(contact.id.to_le_bytes());
    }
    bytes
}
