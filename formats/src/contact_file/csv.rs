use super::{ContactRecord, Record};

pub(super) const NAMES: &str = "element,id,polygon,feature,feature_id,w0,w1,w2,x,y,z,surface_x,surface_y,surface_z,\
    normal_x,normal_y,normal_z,distance,lower_bound,evaluations,status,key\n";

/// One line an entry.
pub(super) fn text<T: Record>(records: &[T]) -> String {
    let lines = records.iter().map(|record| record.csv_line() + "\n");
    std::iter::once(T::CSV_NAMES.to_owned()).chain(lines).collect()
}

/// Weights and polygons that an element does not have are empty; an edge's vertices are parted by a space.
pub(super) fn line(contact: &ContactRecord) -> String {
    let ids: Vec<String> = contact.feature_id.iter().map(u32::to_string).collect();
    let polygon = contact.polygon.map(|polygon| polygon.to_string()).unwrap_or_default();
    let [w0, w1, w2] = [0, 1, 2].map(|corner| contact.weights.get(corner).map(number).unwrap_or_default());
    let vectors = [contact.point, contact.surface_point, contact.normal];
    let numbers: Vec<String> = vectors.iter().flatten().map(number).collect();
    format!(
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
    )
}

/// As short as reads back the same.
pub(super) fn number(number: &f64) -> String {
    format!("{number:?}")
}
