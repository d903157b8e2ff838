//! Few contacts in place of many are those of the library.

use std::ptr::null_mut;

use sdf_field::core::contact::Reduction;
use sdf_field::core::shapes::HalfSpace;
use sdf_field::{ContactOptions, ContactRow, Field, MeshView};
use sdftool::{SdfError, SdfResult};

/// A bumpy plate of 200 faces, and its contacts with the ground.
fn rows() -> (Vec<ContactRow>, sdf_field::Contacts) {
    let height = |id: u32| -0.01 * f64::from(id * 37 % 11);
    let points: Vec<[f64; 3]> = (0..121).map(|id| [f64::from(id % 11), f64::from(id / 11), height(id)]).collect();
    let corners = (0..100).map(|id| id % 10 + id / 10 * 11);
    let faces: Vec<[u32; 3]> = corners.flat_map(|a| [[a, a + 1, a + 12], [a + 12, a + 11, a]]).collect();
    let ground = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let found = ground.contacts(MeshView { points: &points, faces: &faces }, &ContactOptions::default()).unwrap();
    (found.contacts.iter().map(ContactRow::from).collect(), found)
}

#[test]
fn a_reduction_keeps_what_the_library_keeps_and_a_refusal_changes_nothing() {
    let (rows, found) = rows();
    assert!(rows.len() > 100);
    let none: *mut SdfError = null_mut();
    for keep in [1, 4, 16, 64] {
        let mut expected = found.clone();
        let reduced = expected.reduce(&Reduction { count: keep, movement: 0.1, thickness: 0.01 }).unwrap();
        let (mut kept, mut count, mut shortfall) = (rows.clone(), rows.len(), f64::NAN);
        let result = sdftool::sdf_reduce(kept.as_mut_ptr(), &mut count, keep, 0.1, 0.01, &mut shortfall, none);
        assert_eq!((result, count, shortfall), (SdfResult::Ok, reduced.count, reduced.shortfall));
        assert!(kept[..count].iter().eq(expected.contacts.iter().map(ContactRow::from).collect::<Vec<_>>().iter()));
        // The others come after them, each once.
        let mut ids: Vec<u32> = kept.iter().map(|row| row.id).collect();
        ids.sort_unstable();
        let mut all: Vec<u32> = rows.iter().map(|row| row.id).collect();
        all.sort_unstable();
        assert_eq!(ids, all);
        let (mut again, mut count) = (rows.clone(), rows.len());
        let result = sdftool::sdf_reduce(again.as_mut_ptr(), &mut count, keep, 0.1, 0.01, null_mut(), none);
        assert!(result == SdfResult::Ok && again == kept);
    }
    let mut unknown = rows.clone();
    unknown[3].status = 9;
    let refused = [(&rows, 0, 0.1, 0.0), (&rows, 65, 0.1, 0.0), (&rows, 4, 0.0, 0.0), (&rows, 4, f64::NAN, 0.0)];
    for (given, keep, movement, thickness) in refused.into_iter().chain([(&unknown, 4, 0.1, 0.0)]) {
        let (mut kept, mut count, mut shortfall) = (given.clone(), given.len(), 7.0);
        let result =
            sdftool::sdf_reduce(kept.as_mut_ptr(), &mut count, keep, movement, thickness, &mut shortfall, none);
        assert_eq!((result, count, shortfall), (SdfResult::InvalidArgument, given.len(), 7.0));
        assert!(kept == *given);
    }
    for infinity in [f64::INFINITY, f64::NAN] {
        let (mut kept, mut count, mut error) = (rows.clone(), rows.len(), SdfError { text: [0; 512] });
        let result = sdftool::sdf_reduce(kept.as_mut_ptr(), &mut count, 4, 0.1, infinity, null_mut(), &mut error);
        let text = std::ffi::CStr::from_bytes_until_nul(&error.text).unwrap().to_str().unwrap();
        assert_eq!((result, text), (SdfResult::InvalidArgument, "the thickness must be a finite length"));
        let mut wrong = [rows.clone(), rows.clone(), rows.clone()];
        wrong[0][5].point[1] = infinity;
        wrong[1][5].normal[2] = infinity;
        wrong[2][5].distance = infinity;
        for mut rows in wrong {
            let (mut count, mut error) = (rows.len(), SdfError { text: [0; 512] });
            let result = sdftool::sdf_reduce(rows.as_mut_ptr(), &mut count, 4, 0.1, 0.0, null_mut(), &mut error);
            assert_eq!(result, SdfResult::InvalidArgument);
            let text = std::ffi::CStr::from_bytes_until_nul(&error.text).unwrap().to_str().unwrap();
            assert_eq!(text, "contact 5: its point, normal and distance must be finite");
        }
    }
    let mut count = 2;
    let result = sdftool::sdf_reduce(null_mut(), &mut count, 4, 0.1, 0.0, null_mut(), none);
    assert_eq!(result, SdfResult::InvalidArgument);
    assert_eq!(sdftool::sdf_reduce(null_mut(), null_mut(), 4, 0.1, 0.0, null_mut(), none), SdfResult::InvalidArgument);
    count = 0;
    assert_eq!(sdftool::sdf_reduce(null_mut(), &mut count, 4, 0.1, 0.0, null_mut(), none), SdfResult::Ok);
}
