//! What is written is read again, by us and by others.

mod grid_samples;

use std::fs;

use grid_samples::{Random, about, lumpy_sphere};
use hdf5_reader::Hdf5File;
use sdf_core::grid::Lattice;
use sdf_formats::grid_file::{self, GridFile};
use tempfile::TempDir;

const SHAPES: [[u32; 3]; 8] =
    [[2, 2, 2], [2, 3, 5], [33, 33, 33], [65, 2, 2], [2, 2, 2240], [32, 64, 31], [40, 3, 70], [97, 34, 33]];

#[test]
fn every_shape_comes_back_bit_for_bit() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for shape in SHAPES {
        let (lattice, distances) = lumpy_sphere(shape);
        grid_file::write(&path, &lattice, &distances, &about()).unwrap();
        let grid = grid_file::read(&path).unwrap();
        assert_eq!(bits(&grid.distances), bits(&distances), "{shape:?}");
        assert_eq!((grid.lattice, &grid.about), (lattice, &about()));

        let summary = grid_file::read_summary(&path).unwrap();
        assert_eq!((summary.lattice, summary.about), (lattice, about()));
        assert_eq!(summary.file_bytes, fs::metadata(&path).unwrap().len());
    }
}

#[test]
fn random_bits_come_back_too() {
    let mut random = Random::told();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for _ in 0..50 {
        let nodes = [2 + random.below(50), 2 + random.below(50), 2 + random.below(50)].map(|n| n as u32);
        let lattice = Lattice::new([-0.0, 1e-300, -1e30], 1e-7, nodes).unwrap();
        // Neither NaN nor infinite: one bit of the exponent is cleared.
        let any = |random: &mut Random| f32::from_bits(random.below(1 << 32) as u32 & !0x0080_0000);
        let distances: Vec<f32> = (0..lattice.node_count()).map(|_| any(&mut random)).collect();
        grid_file::write(&path, &lattice, &distances, &about()).unwrap();
        let grid = grid_file::read(&path).unwrap();
        assert_eq!(bits(&grid.distances), bits(&distances));
        assert_eq!(grid.lattice.origin().map(f64::to_bits), lattice.origin().map(f64::to_bits));
    }
}

#[test]
fn the_longest_texts_come_back() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let (lattice, distances) = lumpy_sphere([2, 3, 5]);
    let mut about = about();
    let longest = "ä".repeat(1 << 15);
    about.sign_verdict = longest.clone();
    about.source.name = longest.clone();
    about.tool = longest.clone();
    about.options = longest;
    grid_file::write(&path, &lattice, &distances, &about).unwrap();
    assert_eq!(grid_file::read(&path).unwrap(), GridFile { lattice, distances, about });
}

#[test]
fn the_same_grid_gives_the_same_bytes() {
    let folder = TempDir::new().unwrap();
    let (lattice, distances) = lumpy_sphere([40, 33, 70]);
    let bytes = |name: &str| {
        let path = folder.path().join(name);
        grid_file::write(&path, &lattice, &distances, &about()).unwrap();
        fs::read(path).unwrap()
    };
    let first = bytes("first.sdf.h5");
    for again in 0..5 {
        // A time of writing in the file would show after a second.
        std::thread::sleep(std::time::Duration::from_millis(300));
        assert!(bytes(&format!("{again}.sdf.h5")) == first);
    }
}

#[test]
fn what_could_not_be_read_is_not_written() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let (lattice, distances) = lumpy_sphere([2, 3, 5]);
    let refused = |distances: &[f32], about: &grid_file::About| {
        let error = grid_file::write(&path, &lattice, distances, about).unwrap_err().to_string();
        assert!(error.contains("cannot be written") && error.lines().count() == 1, "{error}");
    };
    refused(&distances[1..], &about());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut distances = distances.clone();
        distances[17] = bad;
        refused(&distances, &about());
    }
    for bad in [f64::NAN, f64::INFINITY, -1e-9] {
        refused(&distances, &grid_file::About { error_bound: bad, ..about() });
        refused(&distances, &grid_file::About { slope_bound: bad, ..about() });
    }
    refused(&distances, &grid_file::About { sign_method: "guess".into(), ..about() });
    refused(&distances, &grid_file::About { options: "a\0b".into(), ..about() });
    refused(&distances, &grid_file::About { tool: "a".repeat(65537), ..about() });
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
}

/// Its name is known to tests/readers/run.sh's callers: the file is for readers in other languages.
#[test]
fn readers_that_are_not_ours_see_the_same() {
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("lumpy_sphere.sdf.h5");
    let (lattice, distances) = lumpy_sphere([41, 37, 35]);
    grid_file::write(&path, &lattice, &distances, &about()).unwrap();

    let file = Hdf5File::open(&path).unwrap();
    let dataset = file.dataset("/VTKHDF/PointData/distance").unwrap();
    assert_eq!(dataset.shape(), [35, 37, 41]);
    let samples = dataset.read_array::<f32>().unwrap();
    assert_eq!(bits(samples.as_slice().unwrap()), bits(&distances));
    let sdf = file.group("/sdf").unwrap();
    assert_eq!(sdf.attribute("error_bound").unwrap().read_scalar::<f64>().unwrap(), about().error_bound);
    assert_eq!(sdf.attribute("sign_verdict").unwrap().read_string().unwrap(), about().sign_verdict);

    let file = rust_hdf5::H5File::open(&path).unwrap();
    let dataset = file.dataset("VTKHDF/PointData/distance").unwrap();
    assert_eq!(bits(&dataset.read_raw::<f32>().unwrap()), bits(&distances));
    let sdf = file.root_group().group("sdf").unwrap();
    assert_eq!(sdf.attr_string("sign_verdict").unwrap(), about().sign_verdict);
    for object in ["/", "/sdf", "/VTKHDF", "/VTKHDF/PointData", "/VTKHDF/PointData/distance"] {
        assert!(!file.object_records_times(object).unwrap(), "{object} records a time");
    }
}

fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|sample| sample.to_bits()).collect()
}
