#![no_main]

#[path = "../../../cli/src/csv_points.rs"]
#[allow(dead_code)]
mod csv_points;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    let read = sdf_fuzz::limited(bytes, || csv_points::read_from(bytes, "fuzz.csv"));
    assert!(read.iter().flatten().flatten().all(|x| x.is_finite()));
});
