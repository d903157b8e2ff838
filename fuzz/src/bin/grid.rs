#![no_main]

use sdf_core::Sdf;
use sdf_core::nalgebra::Vector3;
use sdf_formats::grid_file;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    sdf_fuzz::limited(bytes, || {
        let Ok(reader) = grid_file::open_bytes(bytes, "fuzz.sdf.h5") else { return };
        let lattice = *reader.lattice();
        let Ok(stored) = reader.read() else { return };
        for step in 0..4 {
            let point = lattice.node(lattice.nodes().map(|count| (count - 1) * step / 3));
            let sample = stored.grid.sample(Vector3::from(point));
            assert!(!sample.value.is_nan() && sample.gradient.iter().all(|x| !x.is_nan()));
        }
    });
});
