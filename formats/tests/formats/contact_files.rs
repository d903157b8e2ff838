//! Lists of contacts: the same bytes in a file and in memory, with the words of docs/contacts.md.

use std::fs;
use std::io::Write;

use sdf_core::contact::{ContactStatus, ElementKind};
use sdf_formats::contact_file::{
    self, ContactFormat, ContactRecord, Label, OverlapKind, OverlapRecord, OverlapStatus, Record,
};
use serde_json::{Value, json};
use tempfile::TempDir;

fn contacts() -> Vec<ContactRecord> {
    let record = |(index, (element, status)): (u32, (ElementKind, ContactStatus))| ContactRecord {
        element,
        id: index,
        vertices: [4, 3, 9][..=usize::from(element.code())].to_vec(),
        polygon: (element == ElementKind::Face).then_some(7),
        feature: ElementKind::Edge,
        feature_id: vec![3, 9],
        weights: vec![0.25, 0.75],
        point: [1.0, 2.5, -0.5],
        surface_point: [1.0, 2.0, -0.5],
        normal: [0.0, 1.0, 0.0],
        slope: 0.875,
        distance: 0.5,
        lower_bound: 0.4375,
        error_bound: 0.125,
        shape_lower_bound: 0.3125,
        evaluations: 12,
        status,
        key: u64::MAX - u64::from(index),
    };
    let kinds = [ElementKind::Vertex, ElementKind::Edge].into_iter().chain([ElementKind::Face; 4]);
    let statuses = [
        ContactStatus::Converged,
        ContactStatus::BudgetSpent,
        ContactStatus::OutsideGrid,
        ContactStatus::DegenerateGradient,
        ContactStatus::BeyondBand,
        ContactStatus::Possible,
    ];
    (0..).zip(kinds.zip(statuses)).map(record).collect()
}

fn overlaps() -> Vec<OverlapRecord> {
    let record = |(kind, status)| OverlapRecord {
        kind,
        point: [1.0, 2.5, -0.5],
        normal: [0.0, 1.0, 0.0],
        distance: -0.25,
        distance_a: -0.5,
        distance_b: -0.25,
        separation: -0.75,
        area: 0.0625,
        status,
    };
    [
        (OverlapKind::Deepest, OverlapStatus::Good),
        (OverlapKind::Patch, OverlapStatus::OutsideGrid),
        (OverlapKind::Patch, OverlapStatus::DegenerateGradient),
        (OverlapKind::Patch, OverlapStatus::BeyondBand),
    ]
    .map(record)
    .into()
}

fn assert_bytes_are_those_of_the_file<T: Record + Clone>(records: &[T]) {
    let folder = TempDir::new().unwrap();
    for (name, format) in [
        ("a.csv", ContactFormat::Csv),
        ("a.json", ContactFormat::Json),
        ("a.ply", ContactFormat::Ply),
        ("a.h5", ContactFormat::Hdf5),
    ] {
        let path = folder.path().join(name);
        assert_eq!(ContactFormat::from_extension(&path), Some(format));
        let json = |out: &mut dyn Write| out.write_all(b"{}\n");
        contact_file::write(&path, format, records.iter().cloned(), json).unwrap();
        let bytes = contact_file::to_bytes(format, records.iter().cloned(), json).unwrap();
        assert!(!bytes.is_empty() && bytes == fs::read(&path).unwrap(), "{name}");
    }
}

#[test]
fn bytes_and_files_are_the_same() {
    assert_bytes_are_those_of_the_file(&contacts());
    assert_bytes_are_those_of_the_file(&contacts()[..0]);
    assert_bytes_are_those_of_the_file(&overlaps());
}

#[test]
fn kinds_and_statuses_are_words_in_json_and_csv() {
    let first = serde_json::to_value(&contacts()[0]).unwrap();
    assert_eq!(
        (&first["element"], &first["feature"], &first["status"]),
        (&json!("vertex"), &json!("edge"), &json!("converged"))
    );
    let words = |records: &[Value], key: &str| records.iter().map(|record| record[key].clone()).collect::<Vec<_>>();
    let records: Vec<Value> = contacts().iter().map(|record| serde_json::to_value(record).unwrap()).collect();
    assert_eq!(words(&records, "element"), ["vertex", "edge", "face", "face", "face", "face"]);
    assert_eq!(words(&records, "status"), ContactStatus::NAMES);
    let records: Vec<Value> = overlaps().iter().map(|record| serde_json::to_value(record).unwrap()).collect();
    assert_eq!(words(&records, "kind"), ["deepest", "patch", "patch", "patch"]);
    assert_eq!(words(&records, "status"), ["good", "outside_grid", "degenerate_gradient", "beyond_band"]);

    assert!(contacts()[1].csv_line().starts_with("edge,1,,edge,3 9,0.25,0.75,,1.0,2.5,-0.5,"));
    assert!(contacts()[1].csv_line().ends_with(",12,budget_spent,18446744073709551614,4,3,,0.875,0.125,0.3125"));
    assert!(contacts()[2].csv_line().starts_with("face,2,7,edge,"));
    assert_eq!(overlaps()[1].csv_line(), "patch,1.0,2.5,-0.5,0.0,1.0,0.0,-0.25,-0.5,-0.25,-0.75,0.0625,outside_grid");
}

/// HDF5 stores the codes, which index the names.
#[test]
fn codes_index_the_names() {
    assert_eq!(ElementKind::NAMES, ["vertex", "edge", "face"]);
    assert_eq!([ElementKind::Vertex, ElementKind::Edge, ElementKind::Face].map(Label::code), [0, 1, 2]);
    let statuses = ["converged", "budget_spent", "outside_grid", "degenerate_gradient", "beyond_band", "possible"];
    assert_eq!(ContactStatus::NAMES, statuses);
    assert_eq!(contacts().iter().map(|contact| contact.status.code()).collect::<Vec<_>>(), [0, 1, 2, 3, 4, 5]);
    assert_eq!(overlaps().iter().map(|overlap| overlap.kind.code()).collect::<Vec<_>>(), [0, 1, 1, 1]);
    assert_eq!(overlaps().iter().map(|overlap| overlap.status.code()).collect::<Vec<_>>(), [0, 1, 2, 3]);
}
