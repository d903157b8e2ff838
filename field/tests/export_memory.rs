//! Peak memory of an export: at most what its check requires. A test program of its own, because the peak is that of the process.
#![cfg(target_os = "linux")]

use sdf_field::core::shapes::Sphere;
use sdf_field::export::{ExportFormat, ExportOptions};
use sdf_field::{Field, Threads};

/// The most bytes that the process has held so far.
fn peak() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap();
    1024.0 * line.trim_end_matches("kB").trim().parse::<f64>().unwrap()
}

#[test]
fn an_export_takes_no_more_memory_than_its_check_asks_for() {
    let field = Field::new(Sphere::new(1.0).unwrap());
    let options = ExportOptions { cells: Some(200), band: Some(1), threads: Threads::ONE, ..ExportOptions::default() };
    let before = peak();
    // The level set first: the peak never falls.
    for (format, asked) in [(ExportFormat::Nvdb, 4.1), (ExportFormat::Npy, 4.1 + 4.0), (ExportFormat::Nrrd, 4.1 + 4.0)]
    {
        let exported = field.export(format, &options).unwrap();
        let nodes = exported.lattice.node_count() as f64;
        let taken = (peak() - before) / nodes;
        // Beside it: the leaves of the level set, about 1.1 bytes a node. A second copy of the samples would be 4.
        assert!(taken < asked + 2.0, "{format:?}: {taken:.2} bytes a node, its check requires {asked}");
    }
}
