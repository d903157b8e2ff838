//! How a bake reports its progress: by one call at a time, in order, to a function that may call the library itself.

use std::ffi::c_void;
use std::ptr::null_mut;
use std::sync::mpsc;
use std::time::Duration;

use sdftool::{SdfBakeOptions, SdfField, SdfResult};

const FACES: [[u32; 3]; 8] = [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
const OCTAHEDRON: [[f64; 3]; 6] =
    [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]];

type Progress = extern "C" fn(*mut c_void, u64, u64) -> i32;

fn bake(options: SdfBakeOptions, progress: Option<Progress>, user: *mut c_void) -> SdfResult {
    let (points, faces) = (OCTAHEDRON.as_ptr().cast(), FACES.as_ptr().cast());
    let mut field: *mut SdfField = null_mut();
    let result = sdftool::sdf_bake(points, 6, faces, 8, &options, progress, user, &mut field, null_mut());
    assert_eq!(result == SdfResult::Ok, !field.is_null());
    sdftool::sdf_free(field);
    result
}

/// Arguments of the last call, and the number of calls.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Told {
    done: u64,
    total: u64,
    calls: u64,
    is_in_call: bool,
    is_wrong: bool,
    stops_at_the_end: bool,
}

fn note(told: &mut Told, done: u64, total: u64) {
    told.is_wrong |= told.is_in_call || done < told.done || total < told.total || done > total;
    *told = Told { done, total, calls: told.calls + 1, ..*told };
}

fn told(user: *mut c_void) -> &'static mut Told {
    // SAFETY: the test's own, which outlives the bake; calls come one at a time, which is what is tested.
    unsafe { &mut *user.cast::<Told>() }
}

extern "C" fn look_on(user: *mut c_void, done: u64, total: u64) -> i32 {
    let told = told(user);
    note(told, done, total);
    i32::from(told.stops_at_the_end && done == total)
}

/// Asks the library for what takes threads.
extern "C" fn ask_the_library(user: *mut c_void, done: u64, total: u64) -> i32 {
    let told = told(user);
    note(told, done, total);
    told.is_in_call = true;
    let inner = SdfBakeOptions { resolution: 8, threads: 2, ..sdftool::sdf_bake_options() };
    let is_baked = bake(inner, None, null_mut()) == SdfResult::Ok;
    told.is_in_call = false;
    i32::from(!is_baked)
}

fn watched(options: SdfBakeOptions, progress: Progress, mut told: Told) -> (SdfResult, Told) {
    let result = bake(options, Some(progress), (&raw mut told).cast());
    (result, told)
}

#[test]
fn a_progress_that_calls_the_library_ends() {
    let (send, receive) = mpsc::channel();
    std::thread::spawn(move || {
        for layout in [0, 1] {
            let options = SdfBakeOptions { layout, resolution: 48, threads: 4, ..sdftool::sdf_bake_options() };
            send.send(watched(options, ask_the_library, Told::default())).unwrap();
        }
    });
    for layout in [0, 1] {
        let (result, told) = receive.recv_timeout(Duration::from_secs(60)).expect("the bake hangs");
        assert!(result == SdfResult::Ok && !told.is_wrong, "layout {layout}: {result:?}, {told:?}");
        assert!(told.done == told.total && told.calls > 1, "layout {layout}: {told:?}");
    }
}

#[test]
fn the_last_call_has_all_done() {
    for (threads, layout) in [(1, 0), (1, 1), (4, 0), (4, 1)] {
        let options = SdfBakeOptions { layout, resolution: 40, threads, ..sdftool::sdf_bake_options() };
        let (result, told) = watched(options, look_on, Told::default());
        assert!(result == SdfResult::Ok && !told.is_wrong && told.done == told.total && told.calls > 1, "{told:?}");
        let stopped = watched(options, look_on, Told { stops_at_the_end: true, ..Told::default() });
        assert_eq!(stopped.0, SdfResult::Stopped);
    }
    assert_eq!(bake(sdftool::sdf_bake_options(), None, null_mut()), SdfResult::Ok);
}
