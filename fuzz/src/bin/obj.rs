#![no_main]

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| sdf_fuzz::read_mesh(bytes, "fuzz.obj"));
