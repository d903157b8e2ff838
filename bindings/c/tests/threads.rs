//! No call starts a thread unless asked to: the header says so. A program of its own, as the threads of other tests would be counted.
#![cfg(target_os = "linux")]

use std::ffi::{CString, c_void};
use std::fs;
use std::path::PathBuf;
use std::ptr::null_mut;

use sdf_field::ContactRow;
use sdftool::{SdfField, SdfResult};

const VERTICES: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];
const FACES: [[u32; 3]; 8] = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

fn task_count() -> usize {
    fs::read_dir("/proc/self/task").unwrap().count()
}

extern "C" fn go_on(_user: *mut c_void, _contact: *const ContactRow) -> i32 {
    0
}

#[test]
fn no_call_starts_a_thread() {
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("threads.sdf.h5");
    let path_of_c = CString::new(path.to_str().unwrap()).unwrap();
    let (vertices, faces) = (VERTICES.as_ptr().cast::<f64>(), FACES.as_ptr().cast::<u32>());
    let (vertex_count, face_count) = (VERTICES.len(), FACES.len());
    let before = task_count();
    let expect = |expected: SdfResult, name: &str, result: SdfResult| {
        assert_eq!(result, expected, "{name}");
        assert_eq!(task_count(), before, "{name} started a thread");
    };
    let expect_ok = |name: &str, result: SdfResult| expect(SdfResult::Ok, name, result);
    for layout in [0, 1] {
        let options = sdftool::SdfBakeOptions { layout, resolution: 40, keep_mesh: 1, ..sdftool::sdf_bake_options() };
        // By two searches.
        let queries = [0, 1].map(|exact| sdftool::SdfQuery { exact, ..sdftool::sdf_query() });
        let mut fields: [*mut SdfField; 3] = [null_mut(); 3];
        let [baked, loaded, read] = &mut fields;
        let none = null_mut();
        let made =
            sdftool::sdf_bake(vertices, vertex_count, faces, face_count, &options, None, null_mut(), baked, none);
        expect_ok("sdf_bake", made);
        expect_ok("sdf_save", sdftool::sdf_save(*baked, path_of_c.as_ptr(), none));
        expect_ok("sdf_load", sdftool::sdf_load(path_of_c.as_ptr(), loaded, none));
        let bytes = fs::read(&path).unwrap();
        expect_ok("sdf_read", sdftool::sdf_read(bytes.as_ptr().cast(), bytes.len(), read, none));
        for query in &queries {
            let visit = Some(go_on as _);
            let visited = sdftool::sdf_visit_contacts(
                *loaded,
                vertices,
                vertex_count,
                faces,
                face_count,
                query,
                visit,
                null_mut(),
                null_mut(),
                none,
            );
            expect_ok("sdf_visit_contacts", visited);
        }
        let mut distances = [0.0; VERTICES.len()];
        let out = distances.as_mut_ptr();
        expect_ok("sdf_sample", sdftool::sdf_sample(*read, vertices, vertex_count, out, null_mut(), none));
        let measured = sdftool::sdf_mesh_distances(
            vertices,
            vertex_count,
            faces,
            face_count,
            0,
            1,
            vertices,
            vertex_count,
            out,
            none,
        );
        expect_ok("sdf_mesh_distances", measured);
        let mut count = 0;
        let moved = sdftool::SdfQuery { translation: [1.5, 0.3, 0.2], ..queries[0] };
        let touched = sdftool::sdf_first_touches(
            *loaded,
            vertices,
            vertices,
            vertex_count,
            faces,
            face_count,
            &moved,
            [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0].as_ptr(),
            0.0,
            null_mut(),
            0,
            &mut count,
            none,
        );
        expect(SdfResult::TooSmall, "sdf_first_touches", touched);
        let met = sdftool::sdf_overlap(*read, *loaded, &moved, null_mut(), null_mut(), 0, &mut count, null_mut(), none);
        expect(SdfResult::TooSmall, "sdf_overlap", met);
        fields.into_iter().for_each(|field| sdftool::sdf_free(field));
    }
}
