use std::fmt::Write;

use super::ContactRecord;

const HEADER: &str = "element,id,polygon,feature,feature_id,w0,w1,w2,x,y,z,surface_x,surface_y,surface_z,\
    normal_x,normal_y,normal_z,distance,lower_bound,evaluations,status,key\n";

/// One line a contact; weights and polygons that an element does not have are empty; an edge's vertices are parted by a
/// space.
pub(super) fn text(contacts: &[ContactRecord]) -> String {
    let mut text = HEADER.to_owned();
    for contact in contacts {
        let ids: Vec<String> = contact.feature_id.iter().map(u32::to_string).collect();
        let polygon = contact.polygon.map(|polygon| polygon.to_string()).unwrap_or_default();
        let [w0, w1, w2] = [0, 1, 2].map(|corner| contact.weights.get(corner).map(number).unwrap_or_default());
        let vectors = [contact.point, contact.surface_point, contact.normal];
        let numbers: Vec<String> = vectors.iter().flatten().map(number).collect();
        // Writing to a String does not fail.
        let _ = writeln!(
            text,
            "{},{},{polygon},{},{},{w0},{w1},{w2},{},{},{},{},{},{}",
            contact.element,
            contact.id,
            contact.feature,
            ids.join(" "),
            numbers.join(","),
            number(&contact.distance),
            number(&contact.lower_bound),
            contact.evaluations,
            contact.status,
            contact.key,
        );
    }
    text
}

/// As short as reads back the same.
fn number(number: &f64) -> String {
    format!("{number:?}")
}
