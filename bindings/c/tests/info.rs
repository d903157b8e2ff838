//! Facts about a field are those of the library.

use std::ffi::c_void;
use std::ptr::{null, null_mut};

use sdf_field::Field;
use sdf_field::core::shapes::Sphere;
use sdftool::{SdfField, SdfInfo, SdfResult};

const VERTICES: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 4.0]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

fn info(field: *const SdfField) -> SdfInfo {
    let mut info = SdfInfo::default();
    assert_eq!(sdftool::sdf_info(field, &mut info, null_mut()), SdfResult::Ok);
    info
}

/// A tetrahedron in cells of 1/16.
fn bake(layout: u32) -> *mut SdfField {
    let options = sdftool::SdfBakeOptions { layout, voxel_size: 0.0625, ..sdftool::sdf_bake_options() };
    let (mut field, user, none) = (null_mut::<SdfField>(), null_mut::<c_void>(), null_mut());
    let (points, faces) = (VERTICES.as_ptr().cast(), FACES.as_ptr().cast());
    let baked = sdftool::sdf_bake(points, 4, faces, 4, &options, None, user, &mut field, none);
    assert_eq!(baked, SdfResult::Ok);
    field
}

#[test]
fn a_grid_says_where_it_lies_how_fine_it_is_and_how_far_it_reaches() {
    for layout in [0, 1] {
        let field = bake(layout);
        let facts = info(field);
        assert_eq!((facts.layout, facts.spacing), (layout, 0.0625));
        for axis in 0..3 {
            let length = f64::from(facts.nodes[axis] - 1) * facts.spacing;
            assert!((facts.max[axis] - facts.min[axis] - length).abs() < 1e-12);
            // The mesh and its padding of 4 cells are in the box.
            assert!(facts.min[axis] <= -0.25 && facts.max[axis] >= [1.25, 2.25, 4.25][axis]);
        }
        assert!(0.0 < facts.error_bound && facts.error_bound < 0.0625, "{}", facts.error_bound);
        // Differences of neighbours are at most 1 along each axis; before a flat face φ has the slope 1.
        assert!(0.99 < facts.slope_bound && facts.slope_bound < 1.75, "{}", facts.slope_bound);
        // Where the facts put the largest margin, contacts put it too.
        assert_eq!(facts.max_margin, if layout == 0 { 0.25 } else { 3.0 * 0.0625 });
        for (margin, expected) in [(1.0, SdfResult::Ok), (1.001, SdfResult::InvalidArgument)] {
            let query = sdftool::SdfQuery { margin: margin * facts.max_margin, ..sdftool::sdf_query() };
            let (mut count, points, faces) = (0, VERTICES.as_ptr().cast(), FACES.as_ptr().cast());
            let mut rows = vec![sdf_field::ContactRow::default(); 4];
            let room = rows.as_mut_ptr();
            let found =
                sdftool::sdf_contacts(field, points, 4, faces, 4, &query, room, 4, &mut count, null_mut(), null_mut());
            assert_eq!(found, expected);
        }
        sdftool::sdf_free(field);
    }
}

#[test]
fn a_closed_form_has_a_box_and_no_grid() {
    let sphere = Sphere::new(0.5).unwrap();
    let field = Box::into_raw(Box::new(SdfField(Field::new(sphere))));
    let expected = SdfInfo {
        min: [-0.5; 3],
        max: [0.5; 3],
        spacing: 0.0,
        error_bound: f64::INFINITY,
        max_margin: f64::INFINITY,
        slope_bound: 1.0,
        nodes: [0; 3],
        layout: 2,
    };
    assert_eq!(info(field), expected);
    let mut untouched = expected;
    assert_eq!(sdftool::sdf_info(null(), &mut untouched, null_mut()), SdfResult::InvalidArgument);
    assert_eq!(sdftool::sdf_info(field, null_mut(), null_mut()), SdfResult::InvalidArgument);
    assert_eq!(untouched, expected);
    sdftool::sdf_free(field);
}
