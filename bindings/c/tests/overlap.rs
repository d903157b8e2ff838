//! A patch between two fields says what it leaves out.

use std::ptr::null_mut;

use sdf_field::Field;
use sdf_field::core::shapes::{Cuboid, Sphere};
use sdftool::{SdfField, SdfOverlapPoint, SdfPatch, SdfQuery, SdfResult};

/// The patch of a field and itself, raised by so much, and the verdict.
fn patch(field: Field, height: f64) -> (SdfPatch, u32) {
    let field = SdfField(field);
    let query = SdfQuery { translation: [0.0, 0.0, height], ..sdftool::sdf_query() };
    let (mut verdict, mut count, mut patch) = (7, 0, SdfPatch { area: 7.0, unknown: 7, complete: 7 });
    let mut points = [SdfOverlapPoint { point: [0.0; 3], normal: [0.0; 3], distances: [0.0; 2] }; 256];
    let (room, capacity, none) = (points.as_mut_ptr(), points.len(), null_mut());
    let found =
        sdftool::sdf_overlap(&field, &field, &query, &mut verdict, room, capacity, &mut count, &mut patch, none);
    assert_eq!(found, SdfResult::Ok);
    (patch, verdict)
}

#[test]
fn a_patch_counts_the_cubes_that_cannot_be_cut() {
    let sphere = || Field::new(Sphere::new(1.0).unwrap());
    let (raised, verdict) = patch(sphere(), 1.9);
    let disc = std::f64::consts::PI * (1.0 - 0.95 * 0.95);
    assert!((raised.area / disc - 1.0).abs() < 0.05, "{raised:?}");
    assert_eq!((raised.unknown, raised.complete, verdict), (0, 1, 0));
    // Where both have the same slope nothing is cut, so that an area of 0 is not taken for no touch.
    let (equal, verdict) = patch(Field::new(Cuboid::new([1.0, 1.0, 0.05]).unwrap()), 0.0);
    assert!(equal.area == 0.0 && equal.unknown > 100, "{equal:?}");
    assert_eq!((equal.complete, verdict), (1, 0));
    let (apart, verdict) = patch(sphere(), 2.5);
    assert_eq!((apart, verdict), (SdfPatch { area: 0.0, unknown: 0, complete: 1 }, 1));
}
