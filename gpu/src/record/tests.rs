use super::*;

#[test]
fn a_number_of_the_card_stands_for_the_status_that_the_core_numbers_so() {
    for (number, status) in (0..).zip(STATUSES) {
        assert_eq!(number, status as u32);
    }
}

#[test]
fn a_record_becomes_the_contact_with_the_same_numbers() {
    let record = ContactRecord {
        kind: 2,
        element: 7,
        vertices: [3, 4, 5],
        rank: 0,
        feature_kind: 1,
        feature: [3, 5],
        weights: [0.25, 0.0, 0.75],
        point: [1.0, 2.0, 3.0],
        surface_point: [4.0, 5.0, 6.0],
        normal: [0.0, 0.0, 1.0],
        slope: 0.5,
        distance: -0.125,
        lower_bound: -0.25,
        error_bound: 0.01,
        shape_lower_bound: -0.26,
        evaluations: 9,
        status: 4,
    };
    let expected = Contact {
        kind: ElementKind::Face,
        element: 7,
        vertices: [3, 4, 5],
        rank: 0,
        feature: Feature::Edge([3, 5]),
        weights: [0.25, 0.0, 0.75],
        point: Vector3::new(1.0, 2.0, 3.0),
        surface_point: Vector3::new(4.0, 5.0, 6.0),
        normal: Vector3::z(),
        slope: 0.5,
        distance: -0.125,
        lower_bound: -0.25,
        error_bound: 0.01,
        shape_lower_bound: -0.26,
        evaluations: 9,
        status: ContactStatus::BudgetSpent,
    };
    assert_eq!(contact(&record), Some(expected));
    assert_eq!(contact(&ContactRecord { kind: u32::MAX, ..record }), None);
}
