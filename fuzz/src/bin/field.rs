#![no_main]

use sdf_core::Sdf;
use sdf_core::nalgebra::Vector3;
use sdf_formats::field_file;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| {
    sdf_fuzz::limited(bytes, || {
        let Ok(text) = std::str::from_utf8(bytes) else { return };
        let Ok(field) = field_file::read_text(text, "fuzz.sdf.toml") else { return };
        for point in [[0.0; 3], [0.25, -1.5, 3.0], [1e150, 0.0, 0.0], [f64::NAN; 3]] {
            let sample = field.sample(Vector3::from(point));
            assert!(!sample.value.is_nan() && sample.gradient.iter().all(|x| !x.is_nan()), "{text}");
        }
        let Ok(written) = field_file::to_text(&field, "fuzz.sdf.toml") else { return };
        assert!(field_file::read_text(&written, "fuzz.sdf.toml").is_ok(), "{text}\n{written}");
    });
});
