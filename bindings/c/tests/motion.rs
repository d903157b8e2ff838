//! First touches, complete and exact contacts are those of the library.

use std::ffi::{CStr, c_void};
use std::mem::MaybeUninit;
use std::ptr::{null, null_mut};

use sdf_field::core::placed::Rigid;
use sdf_field::{
    BakeOptions, ContactOptions, ContactRow, Field, FirstTouchOptions, GridSize, MeshInMotion, MeshPath, MeshView,
    Threads,
};
use sdftool::{SdfBakeOptions, SdfError, SdfField, SdfQuery, SdfResult, SdfTouch};

const SIDES: [[u32; 3]; 8] = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
const OCTAHEDRON: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];

/// An octahedron that keeps its mesh, on either side of the border.
struct Body {
    field: Field,
    handle: *mut SdfField,
}

impl Drop for Body {
    fn drop(&mut self) {
        sdftool::sdf_free(self.handle);
    }
}

fn body() -> Body {
    let options = SdfBakeOptions { resolution: 24, padding: 8, keep_mesh: 1, ..sdftool::sdf_bake_options() };
    let (mut handle, points, sides) = (null_mut(), OCTAHEDRON.as_ptr().cast(), SIDES.as_ptr().cast());
    let baked = sdftool::sdf_bake(points, 6, sides, 8, &options, None, null_mut(), &mut handle, null_mut());
    assert_eq!(baked, SdfResult::Ok);
    let mesh = MeshView { points: &OCTAHEDRON, faces: &SIDES };
    let options = BakeOptions { size: GridSize::Cells(24), padding: 8, keep_mesh: true, ..BakeOptions::default() };
    Body { field: Field::bake(mesh, &options).unwrap().field, handle }
}

/// A cloth of 200 faces at this height.
fn cloth(height: f64) -> (Vec<[f64; 3]>, Vec<[u32; 3]>) {
    let points = (0..121).map(|id| [0.2 * f64::from(id % 11) - 1.0, 0.2 * f64::from(id / 11) - 1.0, height]).collect();
    let corners = (0..100).map(|id| id % 10 + id / 10 * 11);
    (points, corners.flat_map(|a| [[a, a + 1, a + 12], [a + 12, a + 11, a]]).collect())
}

struct Call<'a> {
    field: *const SdfField,
    start: &'a [[f64; 3]],
    end: &'a [[f64; 3]],
    faces: &'a [[u32; 3]],
    query: SdfQuery,
    end_pose: Option<[f64; 7]>,
    tolerance: f64,
}

impl Call<'_> {
    /// The result, the touches that were written, how many there are, and the error.
    fn run(&self, capacity: usize) -> (SdfResult, Vec<(f64, ContactRow)>, usize, String) {
        let (mut count, mut error) = (usize::MAX, SdfError { text: [0; 512] });
        let mut room = vec![MaybeUninit::<SdfTouch>::uninit(); capacity];
        let result = sdftool::sdf_first_touches(
            self.field,
            self.start.as_ptr().cast(),
            self.end.as_ptr().cast(),
            self.start.len(),
            self.faces.as_ptr().cast(),
            self.faces.len(),
            &self.query,
            self.end_pose.as_ref().map_or(null(), |pose| pose.as_ptr()),
            self.tolerance,
            room.as_mut_ptr().cast(),
            capacity,
            &mut count,
            &mut error,
        );
        let written = if count == usize::MAX { 0 } else { count.min(capacity) };
        // SAFETY: so many were written.
        let rows =
            room[..written].iter().map(|touch| unsafe { touch.assume_init() }).map(|touch| (touch.time, touch.contact));
        (result, rows.collect(), count, CStr::from_bytes_until_nul(&error.text).unwrap().to_str().unwrap().to_owned())
    }
}

#[test]
fn first_touches_are_those_of_the_library_and_refusals_say_why() {
    let (body, (start, faces), (end, _)) = (body(), cloth(1.4), cloth(0.3));
    let query = SdfQuery { margin: 0.05, threads: 2, ..sdftool::sdf_query() };
    let base =
        Call { field: body.handle, start: &start, end: &end, faces: &faces, query, end_pose: None, tolerance: 0.0 };
    let path = MeshPath { start: MeshView { points: &start, faces: &faces }, end: &end };
    let options = FirstTouchOptions { thickness: 0.05, threads: Threads::ONE, ..FirstTouchOptions::default() };
    let rows = |options: &FirstTouchOptions| -> Vec<(f64, ContactRow)> {
        let found = body.field.first_touches(&path, options).unwrap();
        found.touches.iter().map(|touch| (touch.time, ContactRow::from(&touch.contact))).collect()
    };
    let expected = rows(&options);
    assert!(expected.len() > 50);
    assert_eq!(base.run(faces.len()), (SdfResult::Ok, expected.clone(), expected.len(), String::new()));
    let (result, written, count, error) = base.run(3);
    assert_eq!((result, &written[..], count), (SdfResult::TooSmall, &expected[..3], expected.len()));
    assert!(error.contains("room for 3"), "{error}");

    let translation = [0.1, 0.0, -0.2];
    let moving = Call {
        query: SdfQuery { translation, elements: 2, ..query },
        end_pose: Some([0.0, 0.3, 0.1, 0.0, 0.0, 1.0, 2.0]),
        tolerance: 1e-3,
        ..base
    };
    let expected = rows(&FirstTouchOptions {
        elements: sdf_field::Elements::Vertices,
        pose: Rigid::new(translation, [0.0, 0.0, 0.0, 1.0]),
        end_pose: Rigid::new([0.0, 0.3, 0.1], [0.0, 0.0, 1.0, 2.0]),
        tolerance: Some(1e-3),
        ..options
    });
    assert!(expected.len() > 20);
    assert_eq!(moving.run(faces.len()), (SdfResult::Ok, expected.clone(), expected.len(), String::new()));

    let says = |call: Call, words: &str| {
        let (result, _, _, error) = call.run(faces.len());
        assert!(result == SdfResult::InvalidArgument && error.contains(words), "{result:?}: {error}");
    };
    says(Call { tolerance: -1.0, ..moving }, "tolerance");
    says(Call { end_pose: Some([0.0; 7]), ..base }, "end_pose: a zero quaternion");
    says(Call { query: SdfQuery { margin: 50.0, ..query }, ..base }, "margin");
    says(Call { field: null(), ..base }, "field is NULL");
    says(Call { faces: &[[0, 1, 121]], ..base }, "vertex 121");
    // The others are written all the same.
    let mut broken = end.clone();
    broken[60][1] = f64::INFINITY;
    let (result, written, count, error) = Call { end: &broken, ..base }.run(faces.len());
    assert!(result == SdfResult::InvalidArgument && error.contains("6 faces have coordinates"), "{error}");
    assert!(count == written.len() && count > 50 && count + 6 >= rows(&options).len());
}

#[test]
fn complete_and_exact_contacts_are_those_of_the_library() {
    let (body, (points, faces)) = (body(), cloth(0.6));
    let query = SdfQuery { margin: 0.01, ..sdftool::sdf_query() };
    let options = ContactOptions { margin: 0.01, ..ContactOptions::default() };
    for (query, options) in [
        (SdfQuery { complete: 1, ..query }, ContactOptions { complete: true, ..options }),
        (SdfQuery { exact: 1, ..query }, ContactOptions { exact: true, ..options }),
    ] {
        let found = body.field.contacts(MeshView { points: &points, faces: &faces }, &options).unwrap();
        let expected: Vec<_> = found.contacts.iter().map(ContactRow::from).collect();
        let (mut rows, mut count) = (vec![ContactRow::default(); faces.len()], 0);
        let (vertices, sides) = (points.as_ptr().cast(), faces.as_ptr().cast());
        let (room, none) = (rows.as_mut_ptr(), null_mut());
        let result = sdftool::sdf_contacts(
            body.handle,
            vertices,
            points.len(),
            sides,
            faces.len(),
            &query,
            room,
            faces.len(),
            &mut count,
            null_mut(),
            none,
        );
        assert_eq!((result, &rows[..count]), (SdfResult::Ok, &expected[..]));
        assert!(count > 10);
    }
}

#[test]
fn what_the_budget_leaves_open_is_counted() {
    let text = b"[field]\nshape = \"torus\"\nmajor_radius = 0.6\nminor_radius = 0.2\n";
    let (field, mut handle) = (Field::from_bytes(text, "torus").unwrap(), null_mut());
    assert_eq!(sdftool::sdf_read(text.as_ptr().cast(), text.len(), &mut handle, null_mut()), SdfResult::Ok);
    let (body, (points, faces)) = (Body { field, handle }, cloth(0.25));
    for budget in [1, 256] {
        let query = SdfQuery { margin: 0.055, budget, ..sdftool::sdf_query() };
        let options = ContactOptions { margin: 0.055, budget: Some(budget), ..ContactOptions::default() };
        let found = body.field.contacts(MeshView { points: &points, faces: &faces }, &options).unwrap();
        let (mut rows, mut count, mut undecided) = (vec![ContactRow::default(); faces.len()], 0, usize::MAX);
        let (vertices, sides) = (points.as_ptr().cast(), faces.as_ptr().cast());
        let (field, room, capacity) = (body.handle, rows.as_mut_ptr(), faces.len());
        let none = null_mut();
        let result = sdftool::sdf_contacts(
            field,
            vertices,
            points.len(),
            sides,
            faces.len(),
            &query,
            room,
            capacity,
            &mut count,
            &mut undecided,
            none,
        );
        assert_eq!((result, count, undecided), (SdfResult::Ok, found.contacts.len(), found.undecided_count));
        assert_eq!(undecided > 0, budget == 1);
        undecided = usize::MAX;
        let visit = Some(go_on as _);
        let result = sdftool::sdf_visit_contacts(
            field,
            vertices,
            points.len(),
            sides,
            faces.len(),
            &query,
            visit,
            null_mut(),
            &mut undecided,
            none,
        );
        assert_eq!((result, undecided), (SdfResult::Ok, found.undecided_count));
    }
}

extern "C" fn go_on(_user: *mut c_void, _contact: *const ContactRow) -> i32 {
    0
}

#[test]
fn clusters_poses_and_margins_of_a_mesh_are_those_of_the_library() {
    let (body, (mut points, faces)) = (body(), cloth(0.2));
    let mut clusters = null_mut();
    let (count, sides) = (points.len(), faces.as_ptr().cast());
    let none = null_mut();
    let made = sdftool::sdf_clusters(points.as_ptr().cast(), count, sides, faces.len(), &mut clusters, none);
    assert_eq!(made, SdfResult::Ok);
    points.iter_mut().for_each(|[x, y, z]| *z += 0.2 * *x * *y);
    let vertices = points.as_ptr().cast();
    let fitted = sdftool::sdf_clusters_refit(clusters, vertices, count, sides, faces.len(), none);
    assert_eq!(fitted, SdfResult::Ok);
    let too_few = sdftool::sdf_clusters_refit(clusters, vertices, count, sides, faces.len() - 1, none);
    assert_eq!(too_few, SdfResult::InvalidArgument);

    let numbers = [0.1, 0.0, 0.3, 0.0, 0.0, 0.2, 1.0];
    let margins: Vec<f64> = (0..faces.len()).map(|face| 0.01 * f64::from(face as u32 % 7)).collect();
    let query = SdfQuery { clusters, mesh_pose: numbers.as_ptr(), margins: margins.as_ptr(), ..sdftool::sdf_query() };
    let ask = |query: &SdfQuery| {
        let (mut rows, mut found, mut error) =
            (vec![ContactRow::default(); faces.len()], 0, SdfError { text: [0; 512] });
        let (field, room, capacity) = (body.handle, rows.as_mut_ptr(), faces.len());
        let result = sdftool::sdf_contacts(
            field,
            vertices,
            count,
            sides,
            faces.len(),
            query,
            room,
            capacity,
            &mut found,
            null_mut(),
            &mut error,
        );
        rows.truncate(found);
        (result, rows, CStr::from_bytes_until_nul(&error.text).unwrap().to_str().unwrap().to_owned())
    };
    // The one margin is not looked at.
    for margin in [1000.0, f64::NAN] {
        assert!(ask(&SdfQuery { margin, ..query }) == ask(&query), "{margin}");
    }
    let pose = Rigid::new([0.1, 0.0, 0.3], [0.0, 0.0, 0.2, 1.0]);
    let mesh = MeshView { points: &points, faces: &faces };
    let moving = MeshInMotion { pose, margins: Some(&margins), ..MeshInMotion::new(mesh) };
    let expected = body.field.contacts_in_motion(&moving, &ContactOptions::default()).unwrap();
    let expected: Vec<_> = expected.contacts.iter().map(ContactRow::from).collect();
    assert!(expected.len() > 20);
    assert_eq!(ask(&query), (SdfResult::Ok, expected, String::new()));

    let says = |query: SdfQuery, words: &str| {
        let (result, _, error) = ask(&query);
        assert!(result == SdfResult::InvalidArgument && error.contains(words), "{result:?}: {error}");
    };
    says(SdfQuery { elements: 1, ..query }, "SDF_FACES alone");
    says(SdfQuery { mesh_pose: [0.0; 7].as_ptr(), ..query }, "mesh_pose: a zero quaternion");
    let wrong = vec![f64::NAN; faces.len()];
    says(SdfQuery { margins: wrong.as_ptr(), ..query }, "margin of face 0");
    let far = vec![99.0; faces.len()];
    says(SdfQuery { margins: far.as_ptr(), ..query }, "margin");
    let infinite: Vec<f64> = (0..faces.len()).map(|face| if face == 3 { f64::INFINITY } else { 0.0 }).collect();
    says(SdfQuery { margins: infinite.as_ptr(), ..query }, "the margin of face 3 must be a finite length");
    says(SdfQuery { exact: 1, ..query }, "exact search");
    sdftool::sdf_clusters_free(clusters);
    sdftool::sdf_clusters_free(null_mut());
}
