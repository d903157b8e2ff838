//! Questions whose answer would leave something out are refused, with one line that says why.

use std::ffi::CStr;
use std::ptr::{null, null_mut};

use sdftool::{SdfBakeOptions, SdfError, SdfField, SdfPatch, SdfQuery, SdfResult};

const FACES: [[u32; 3]; 8] = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

/// An octahedron.
fn vertices(radius: f64) -> [[f64; 3]; 6] {
    let along = |axis: usize, x: f64| [0, 1, 2].map(|k| if k == axis { x } else { 0.0 });
    [0, 1, 2].map(|axis| [along(axis, radius), along(axis, -radius)]).concat().try_into().unwrap()
}

fn text(error: &SdfError) -> &str {
    CStr::from_bytes_until_nul(&error.text).unwrap().to_str().unwrap()
}

/// A sparse octahedron of the radius 1, saved in this file.
fn bake(file: &std::path::Path) {
    let (points, none) = (vertices(1.0), null_mut());
    let options = SdfBakeOptions { layout: 1, resolution: 32, band: 1, ..sdftool::sdf_bake_options() };
    let mut field: *mut SdfField = null_mut();
    let (points, faces) = (points.as_ptr().cast(), FACES.as_ptr().cast());
    let baked = sdftool::sdf_bake(points, 6, faces, FACES.len(), &options, None, none, &mut field, none.cast());
    assert_eq!(baked, SdfResult::Ok);
    let path = std::ffi::CString::new(file.to_str().unwrap()).unwrap();
    assert_eq!(sdftool::sdf_save(field, path.as_ptr(), none.cast()), SdfResult::Ok);
    sdftool::sdf_free(field);
}

fn load(file: &std::path::Path) -> *mut SdfField {
    let path = std::ffi::CString::new(file.to_str().unwrap()).unwrap();
    let mut field: *mut SdfField = null_mut();
    assert_eq!(sdftool::sdf_load(path.as_ptr(), &mut field, null_mut()), SdfResult::Ok);
    field
}

fn contacts(field: *const SdfField, points: &[[f64; 3]], query: &SdfQuery) -> (SdfResult, usize, String) {
    contacts_in(FACES.len(), field, points, query)
}

/// The same, with room for so many.
fn contacts_in(
    capacity: usize,
    field: *const SdfField,
    points: &[[f64; 3]],
    query: &SdfQuery,
) -> (SdfResult, usize, String) {
    let (mut count, mut error) = (0, SdfError { text: [0; 512] });
    let (vertices, faces) = (points.as_ptr().cast(), FACES.as_ptr().cast());
    let mut room = vec![std::mem::MaybeUninit::<sdf_field::ContactRow>::uninit(); FACES.len()];
    let out = room.as_mut_ptr().cast();
    let result = sdftool::sdf_contacts(
        field,
        vertices,
        points.len(),
        faces,
        FACES.len(),
        query,
        out,
        capacity,
        &mut count,
        null_mut(),
        &mut error,
    );
    (result, count, text(&error).to_owned())
}

#[test]
fn a_margin_below_the_band_is_refused_also_where_a_text_names_the_grid() {
    let folder = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("margins");
    std::fs::create_dir_all(&folder).unwrap();
    let [grid, named] = ["sparse.sdf.h5", "named.sdf.toml"].map(|name| folder.join(name));
    bake(&grid);
    std::fs::write(&named, "[field]\nshape = 'grid'\nfile = 'sparse.sdf.h5'\n").unwrap();
    for file in [grid, named] {
        let field = load(&file);
        let query = SdfQuery { margin: -0.4, ..sdftool::sdf_query() };
        let (result, count, why) = contacts(field, &vertices(0.1), &query);
        assert_eq!((result, count), (SdfResult::InvalidArgument, 0));
        assert!(why.contains("-0.4 is deeper") && why.ends_with(", or set complete of SdfQuery, not 0"), "{why}");
        // Which helps, also where margins are of single faces.
        let complete = SdfQuery { complete: 1, ..query };
        let (result, count, why) = contacts(field, &vertices(0.1), &complete);
        assert_eq!((result, count), (SdfResult::Ok, 8), "{why}");
        let margins = [-0.4; FACES.len()];
        let of_faces = SdfQuery { margins: margins.as_ptr(), ..sdftool::sdf_query() };
        let (result, _, why) = contacts(field, &vertices(0.1), &of_faces);
        assert_eq!(result, SdfResult::InvalidArgument);
        assert!(why.starts_with("margins: ") && why.ends_with(", or set complete of SdfQuery, not 0"), "{why}");
        // What is too far out is none of its business, nor are two fields.
        let (_, _, why) = contacts(field, &vertices(0.1), &SdfQuery { margin: 99.0, ..sdftool::sdf_query() });
        assert!(!why.contains("complete"), "{why}");
        let (mut count, mut error) = (0, SdfError { text: [0; 512] });
        let overlap = sdftool::sdf_overlap(
            field,
            field,
            &query,
            null_mut(),
            null::<()>().cast_mut().cast(),
            0,
            &mut count,
            null_mut(),
            &mut error,
        );
        assert_eq!(overlap, SdfResult::InvalidArgument);
        let why = text(&error);
        assert!(why.contains("-0.4 is deeper") && !why.contains("complete"), "{why}");
        let (result, count, why) = contacts(field, &vertices(0.1), &sdftool::sdf_query());
        assert_eq!((result, count), (SdfResult::Ok, 8), "{why}");
        sdftool::sdf_free(field);
    }
}

#[test]
fn faces_that_are_not_finite_are_an_error_and_the_others_are_found() {
    let file = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("finite.sdf.h5");
    bake(&file);
    let field = load(&file);
    let mut points = vertices(0.1);
    points[4][1] = f64::NAN;
    let (result, count, why) = contacts(field, &points, &sdftool::sdf_query());
    assert_eq!((result, count), (SdfResult::InvalidArgument, 4));
    assert_eq!(why, "4 faces have coordinates that are not finite or too large, face 0 the first");
    // The same where there is no room for the others.
    assert_eq!(contacts_in(2, field, &points, &sdftool::sdf_query()), (result, count, why));
    sdftool::sdf_free(field);
}

#[test]
fn exact_contacts_of_a_field_without_its_mesh_say_which_option_keeps_it() {
    let file = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("unkept.sdf.h5");
    bake(&file);
    let field = load(&file);
    let (result, count, why) = contacts(field, &vertices(0.1), &SdfQuery { exact: 1, ..sdftool::sdf_query() });
    assert_eq!((result, count), (SdfResult::InvalidArgument, 0));
    assert!(why.ends_with("bake it again with keep_mesh of SdfBakeOptions, not 0"), "{why}");
    sdftool::sdf_free(field);
}

#[test]
fn a_band_of_no_cells_is_refused() {
    let points = vertices(1.0);
    for band in [0, 1001, u32::MAX] {
        let options = SdfBakeOptions { layout: 1, band, ..sdftool::sdf_bake_options() };
        let (mut field, mut error): (*mut SdfField, _) = (null_mut(), SdfError { text: [0; 512] });
        let (points, faces, none) = (points.as_ptr().cast(), FACES.as_ptr().cast(), null_mut());
        let baked = sdftool::sdf_bake(points, 6, faces, FACES.len(), &options, None, none, &mut field, &mut error);
        assert_eq!((baked, text(&error)), (SdfResult::InvalidArgument, &*format!("band {band}: give 1 to 1000 cells")));
    }
}

#[test]
fn counts_and_verdicts_of_a_refusal_are_written() {
    let file = std::path::PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("counts.sdf.h5");
    bake(&file);
    let (field, points) = (load(&file), vertices(0.1));
    let (points, faces) = (points.as_ptr().cast(), FACES.as_ptr().cast());
    let wrong = SdfQuery { elements: 9, ..sdftool::sdf_query() };
    let invalid = SdfResult::InvalidArgument;
    let null_room = null_mut();
    // The field is NULL, the query is wrong, or the room is NULL.
    for (asked, query, capacity) in [
        (null(), sdftool::sdf_query(), 0),
        (field.cast_const(), wrong, 0),
        (field.cast_const(), SdfQuery { margin: f64::NAN, ..sdftool::sdf_query() }, 0),
        (field.cast_const(), sdftool::sdf_query(), 5),
    ] {
        let (mut count, mut undecided, mut verdict) = (7, 7, 7);
        let result = sdftool::sdf_contacts(
            asked,
            points,
            6,
            faces,
            8,
            &query,
            null_mut(),
            capacity,
            &mut count,
            &mut undecided,
            null_mut(),
        );
        assert_eq!((result, count, undecided), (invalid, 0, 0));
        count = 7;
        let (touches, end_pose) = (null_mut(), null());
        let result = sdftool::sdf_first_touches(
            asked,
            points,
            points,
            6,
            faces,
            8,
            &query,
            end_pose,
            0.0,
            touches,
            capacity,
            &mut count,
            null_mut(),
        );
        assert_eq!((result, count), (invalid, 0));
        count = 7;
        let mut patch = SdfPatch { area: 7.0, unknown: 7, complete: 7 };
        let result = sdftool::sdf_overlap(
            asked,
            field,
            &query,
            &mut verdict,
            null_room,
            capacity,
            &mut count,
            &mut patch,
            null_mut(),
        );
        assert_eq!((result, count, verdict, patch), (invalid, 0, 2, SdfPatch::default()));
        undecided = 7;
        let visit = None;
        let result = sdftool::sdf_visit_contacts(
            asked,
            points,
            6,
            faces,
            8,
            &query,
            visit,
            null_mut(),
            &mut undecided,
            null_mut(),
        );
        assert_eq!((result, undecided), (invalid, 0));
    }
    sdftool::sdf_free(field);
}

#[test]
fn an_error_is_one_line_also_of_a_name_of_two() {
    let (mut field, mut error): (*mut SdfField, _) = (null_mut(), SdfError { text: [0; 512] });
    assert_eq!(sdftool::sdf_load(c"two\nlines\x1b.sdf.h5".as_ptr(), &mut field, &mut error), SdfResult::File);
    assert!(text(&error).starts_with("two\u{fffd}lines\u{fffd}.sdf.h5: "), "{}", text(&error));
    // A path longer than an error has room: what is wrong stands at the end, and stays.
    for letter in ["a", "ä", "𝄞"] {
        let path = format!("first/{}/last.sdf.h5", letter.repeat(900));
        let path = std::ffi::CString::new(path).unwrap();
        assert_eq!(sdftool::sdf_load(path.as_ptr(), &mut field, &mut error), SdfResult::File);
        let text = text(&error);
        assert!(text.starts_with("first/") && text.contains('…') && text.contains("/last.sdf.h5: "), "{text}");
        assert!(text.len() <= 511 && text.contains("os error"), "{text}");
    }
}
