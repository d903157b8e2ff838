//! A grid that cannot be allocated is refused, and the process lives on.
#![cfg(target_os = "linux")]

use std::ffi::CStr;
use std::process::Command;
use std::ptr::null_mut;

use sdftool::{SdfBakeOptions, SdfError, SdfField, SdfResult};

const VERTICES: [[f64; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
const FACES: [[u32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
const FILE: &CStr = match CStr::from_bytes_with_nul(concat!(env!("CARGO_TARGET_TMPDIR"), "/large.sdf.h5\0").as_bytes())
{
    Ok(file) => file,
    Err(_) => panic!(),
};

/// A dense grid of the tetrahedron.
fn bake(resolution: u32) -> (SdfResult, *mut SdfField, String) {
    let options = SdfBakeOptions { resolution, ..sdftool::sdf_bake_options() };
    let (mut field, mut error): (*mut SdfField, _) = (null_mut(), SdfError { text: [0; 512] });
    let (points, faces) = (VERTICES.as_ptr().cast(), FACES.as_ptr().cast());
    let baked = sdftool::sdf_bake(points, 4, faces, 4, &options, None, null_mut(), &mut field, &mut error);
    (baked, field, text(&error))
}

fn text(error: &SdfError) -> String {
    CStr::from_bytes_until_nul(&error.text).unwrap().to_str().unwrap().to_owned()
}

/// 309³ nodes of 4 bytes are 118 MB, for which a process of 110 MB has no room.
#[test]
fn a_grid_that_is_not_damaged_is_too_large_for_a_small_process() {
    let (baked, field, why) = bake(300);
    assert_eq!(baked, SdfResult::Ok, "{why}");
    assert_eq!(sdftool::sdf_save(field, FILE.as_ptr(), null_mut()), SdfResult::Ok);
    sdftool::sdf_free(field);
    let test = std::env::current_exe().unwrap();
    let script = "ulimit -v 110000; exec \"$0\" --exact in_a_small_process --ignored --test-threads 1";
    // A backtrace that has no room for its symbols waits for itself.
    let output = Command::new("sh").args(["-c", script]).arg(test).env("RUST_BACKTRACE", "0").output().unwrap();
    assert!(output.status.success(), "{output:?}");
}

/// The above in the small process.
#[test]
#[ignore = "run by the above"]
fn in_a_small_process() {
    let (baked, field, why) = bake(300);
    assert!(baked == SdfResult::InvalidArgument && field.is_null(), "{baked:?}");
    assert!(why.starts_with("a grid of 309 × 309 × 309 nodes needs 120638544 bytes, and "), "{why}");
    assert!(why.ends_with(" are free: take larger voxels or a sparse grid"), "{why}");
    let (mut field, mut error): (*mut SdfField, _) = (null_mut(), SdfError { text: [0; 512] });
    assert_eq!(sdftool::sdf_load(FILE.as_ptr(), &mut field, &mut error), SdfResult::File);
    let why = text(&error);
    assert!(why.ends_with("needs 118014516 bytes, more than can be allocated"), "{why}");
}
