//! Grids that are written are read again, by our reader and by others.

use sdf_core::{Aabb, Interval};
use std::fs;

use hdf5_reader::Hdf5File;
use sdf_core::grid::owned::{ErrorRegion, ErrorRegions, OwnedStorage, Precision};
use sdf_core::grid::sparse::{BRICK_SAMPLES, Scale};
use sdf_core::grid::{BlockBounds, Lattice, Storage};
use sdf_formats::grid_file::{self, About, ReadCount, Samples, SparseSamples};
use tempfile::TempDir;

use crate::grid_samples::{Content, DEEP, DENSE, KINDS, Kind, Made, SPARSE_U16, about, lent};
use crate::random::Random;

const SHAPES: [[u32; 3]; 8] =
    [[2, 2, 2], [2, 3, 5], [33, 33, 33], [65, 2, 2], [2, 2, 2240], [32, 64, 31], [40, 3, 70], [97, 34, 33]];

#[test]
fn every_shape_comes_back_in_either_layout_and_any_precision() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for (shape, kind) in SHAPES.into_iter().flat_map(|shape| KINDS.map(|kind| (shape, kind))) {
        let made = Made::new(shape, kind);
        // The surface passes through no brick.
        if matches!(made.sparse(), Some(grid_file::SparseInfo { bricks: 0, .. })) {
            continue;
        }
        made.write(&path);
        let summary = grid_file::open(&path).unwrap_or_else(|error| panic!("{error}")).summary();
        assert_eq!((summary.lattice, summary.sparse, &summary.about), (made.lattice, made.sparse(), &about()));
        assert_eq!(summary.precision, made.grid().storage().precision());
        assert_eq!(summary.file_bytes, fs::metadata(&path).unwrap().len());
        let stored: u64 = summary.parts.iter().map(|part| part.stored_bytes).sum();
        assert!(0 < stored && stored < summary.file_bytes);

        let stored = grid_file::read(&path).unwrap();
        assert!(stored.grid == made.grid(), "{shape:?} {kind:?}");
        assert_eq!((stored.sparse, &stored.about), (made.sparse(), &about()));
        assert!(stored.read.bytes <= summary.file_bytes + (1 << 16) && stored.read.blocks == stored.read.total_blocks);
        assert!(corners(&stored.grid) == corners(&made.grid()));
    }
}

#[test]
fn regions_of_large_errors_come_back_and_damage_to_them_is_told() {
    let region = |at: f64| ErrorRegion {
        bounds: Aabb { min: [at, -1.0, 0.25], max: [at + 0.5, 2.0, 0.75] },
        cells: 70 + at as u64,
        error_bound: 0.125 * at,
    };
    let found = ErrorRegions {
        cells: 5000,
        cells_within: 4711,
        error_bound: 0.015,
        regions: (1..9).map(|at| region(f64::from(at))).collect(),
        region_count: 12,
    };
    for kind in KINDS {
        let made = Made::new([33, 33, 33], kind);
        let bytes = |found: &ErrorRegions| {
            let about = About { error_regions: Some(found.clone()), ..about() };
            grid_file::to_bytes(&made.lattice, made.samples(), &about)
        };
        let file = bytes(&found).unwrap();
        assert_eq!(grid_file::read_bytes(&file, "regions").unwrap().about.error_regions.as_ref(), Some(&found));
        // The error bound within, wherever it stands, a little larger; and the checksum, or the regions, under another name.
        for (wanted, offset, told) in [
            (&0.015_f64.to_le_bytes()[..], 0, "checksum of error_regions does not match"),
            (b"error_regions_sha256", 19, "error_regions and its checksum are not both there"),
            (b"error_regions\0", 12, "error_regions and its checksum are not both there"),
        ] {
            let mut damaged = file.clone();
            damaged[file.windows(wanted.len()).position(|bytes| bytes == wanted).unwrap() + offset] ^= 1;
            let refusal = grid_file::read_bytes(&damaged, "regions").err().map(|error| error.to_string());
            assert!(refusal.as_ref().is_some_and(|text| text.contains(told)), "{refusal:?}");
        }
        for wrong in [
            ErrorRegions { cells_within: 5001, ..found.clone() },
            ErrorRegions { region_count: 7, ..found.clone() },
            ErrorRegions { error_bound: f64::NAN, ..found.clone() },
        ] {
            assert!(bytes(&wrong).is_err(), "{wrong:?}");
        }
    }
}

#[test]
fn that_the_inside_reaches_the_box_comes_back_and_damage_to_it_is_told() {
    for kind in KINDS {
        let made = Made::new([17, 17, 17], kind);
        let about = About { inside_reaches_box: true, ..about() };
        let file = grid_file::to_bytes(&made.lattice, made.samples(), &about).unwrap();
        let read = grid_file::read_bytes(&file, "open").unwrap();
        assert!(read.about.inside_reaches_box && read.grid.inside_reaches_box());
        for (offset, told) in
            [(0, "checksum of the attributes does not match"), (10, "checksum of the attributes does not match")]
        {
            let mut damaged = file.clone();
            let name = b"inside_reaches_box";
            damaged[file.windows(name.len()).position(|bytes| bytes == name).unwrap() + offset] ^= 1;
            let refusal = grid_file::read_bytes(&damaged, "open").err().map(|error| error.to_string());
            assert!(refusal.as_ref().is_some_and(|text| text.contains(told)), "{refusal:?}");
        }
    }
}

fn corners(grid: &sdf_core::grid::owned::OwnedGrid) -> Vec<[u32; 8]> {
    let [nx, ny, nz] = grid.lattice().cells();
    let cells = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
    cells.map(|cell| grid.storage().corners(cell).map(f32::to_bits)).collect()
}

/// Any bits but NaN and infinities: one bit of the exponent is cleared.
fn any(random: &mut Random) -> f32 {
    f32::from_bits(random.below(1 << 32) as u32 & !0x0080_0000)
}

fn any_bounds(random: &mut Random) -> BlockBounds {
    let [a, b] = [any(random), any(random)];
    BlockBounds { range: Interval { lower: a.min(b), upper: a.max(b) }, slope_bound: any(random).abs() }
}

#[test]
fn random_bits_come_back_too() {
    let mut random = Random::from_clock();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    for _ in 0..50 {
        let nodes = [2 + random.below(50), 2 + random.below(50), 2 + random.below(50)].map(|n| n as u32);
        let lattice = Lattice::new([-0.0, 1e-300, -1e30], 1e-7, nodes).unwrap();
        let distances: Vec<f32> = (0..lattice.node_count()).map(|_| any(&mut random)).collect();
        let places = sdf_core::grid::sparse::brick_counts(&lattice).iter().product::<u32>();
        let bounds: Vec<BlockBounds> = (0..places).map(|_| any_bounds(&mut random)).collect();
        let samples = Samples::Dense { distances: &distances, bounds: &bounds };
        grid_file::write(&path, &lattice, samples, &about()).unwrap();
        let stored = grid_file::read(&path).unwrap();
        assert_eq!(stored.grid.lattice().origin().map(f64::to_bits), lattice.origin().map(f64::to_bits));
        let OwnedStorage::Dense(bounded) = stored.grid.storage() else { panic!("another layout") };
        let bits =
            |bounds: &BlockBounds| [bounds.range.lower, bounds.range.upper, bounds.slope_bound].map(f32::to_bits);
        assert!(bounded.bounds().iter().map(bits).eq(bounds.iter().map(bits)));
        for cell in [[0; 3], lattice.cells().map(|n| n - 1), lattice.cells().map(|n| random.below(n as usize) as u32)] {
            let corner = |corner: u32| [cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2)];
            let expected = std::array::from_fn(|at| distances[lattice.index(corner(at as u32))].to_bits());
            assert_eq!(bounded.corners(cell).map(f32::to_bits), expected);
        }
    }
}

/// More bricks than one chunk, or one table's chunk, holds.
#[test]
fn thousands_of_bricks_of_random_codes_come_back() {
    let mut random = Random::from_clock();
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let lattice = Lattice::new([0.0; 3], 1.0, [160, 167, 168]).unwrap();
    let mut places: Vec<[u32; 3]> =
        (0..8820).map(|at| [at % 20, at / 20 % 21, at / 20 / 21]).filter(|_| random.below(8) > 0).collect();
    for at in 1..places.len() {
        places.swap(at, random.below(at + 1));
    }
    assert!(places.len() > 4200);
    let samples: Vec<u16> = (0..places.len() * BRICK_SAMPLES).map(|_| random.below(1 << 16) as u16).collect();
    let scale = |_| Scale { base: any(&mut random) * 1e-9, step: any(&mut random).abs() * 1e-9 };
    let scales: Vec<Scale> = (0..places.len()).map(scale).collect();
    let bounds: Vec<BlockBounds> = places.iter().map(|_| any_bounds(&mut random)).collect();
    let errors: Vec<f32> = places.iter().map(|_| any(&mut random).abs()).collect();
    let coarse: Vec<f32> = (0..21 * 22 * 22).map(|_| any(&mut random)).collect();
    let (places, scales, samples) = (&places[..], &scales[..], &samples[..]);
    let sparse = SparseSamples {
        band: 0.0,
        deep_values: DEEP,
        slots: places,
        scales,
        samples,
        bounds: &bounds,
        errors: &errors,
        coarse: &coarse,
    };
    grid_file::write(&path, &lattice, sparse, &about()).unwrap();
    let stored = grid_file::read(&path).unwrap();
    let OwnedStorage::SparseU16(found) = stored.grid.storage() else { panic!("another layout") };
    let found = found.bricks();
    assert!(found.slots == places && found.samples == samples && found.scales == scales);
    assert!(found.bounds == bounds && found.errors == errors && found.coarse.to_vec() == coarse);
    let all = places.len();
    assert_eq!(stored.read, ReadCount { blocks: all, total_blocks: all, ..stored.read });
}

#[test]
fn the_longest_texts_come_back() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let made = Made::new([2, 3, 5], DENSE);
    let mut about = about();
    let longest = "ä".repeat(1 << 15);
    about.sign_reason = longest.clone();
    about.source.name = longest.clone();
    about.tool = longest.clone();
    about.options = longest;
    about.source.triangles = u64::MAX;
    grid_file::write(&path, &made.lattice, made.samples(), &about).unwrap();
    assert_eq!(grid_file::read(&path).unwrap().about, about);
}

#[test]
fn the_same_grid_gives_the_same_bytes() {
    let folder = TempDir::new().unwrap();
    let kinds = [DENSE, Kind::Dense(Precision::U8), SPARSE_U16].map(|kind| Made::new([40, 33, 70], kind));
    let bytes = |name: &str, made: &Made| {
        let path = folder.path().join(name);
        made.write(&path);
        fs::read(path).unwrap()
    };
    let first = kinds.each_ref().map(|made| bytes("first.sdf.h5", made));
    for again in 0..5 {
        // A time of writing in the file would show after a second.
        std::thread::sleep(std::time::Duration::from_millis(300));
        assert!(kinds.each_ref().map(|made| bytes(&format!("{again}.sdf.h5"), made)) == first);
    }
}

#[test]
fn grids_that_could_not_be_read_are_not_written() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let made = Made::new([2, 3, 5], DENSE);
    let refused = |samples: Samples, about: &About| {
        let error = grid_file::write(&path, &made.lattice, samples, about).unwrap_err().to_string();
        assert!(error.contains("cannot be written") && error.lines().count() == 1, "{error}");
    };
    let Content::Dense { distances, bounds } = &made.content else { panic!("another layout") };
    refused(Samples::Dense { distances: &distances[1..], bounds }, &about());
    refused(Samples::Dense { distances, bounds: &[] }, &about());
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut distances = distances.clone();
        distances[17] = bad;
        refused(Samples::Dense { distances: &distances, bounds }, &about());
    }
    for bad in bad_bounds() {
        refused(Samples::Dense { distances, bounds: &[bad] }, &about());
    }
    for bad in [f64::NAN, f64::INFINITY, -1e-9] {
        // Infinite where nothing is certified.
        if bad != f64::INFINITY {
            refused(made.samples(), &About { error_bound: bad, ..about() });
        }
        refused(made.samples(), &About { slope_bound: bad, ..about() });
        refused(made.samples(), &About { padding: bad, ..about() });
    }
    refused(made.samples(), &About { options: "a\0b".into(), ..about() });
    refused(made.samples(), &About { tool: "a".repeat(65537), ..about() });
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
}

pub fn bad_bounds() -> [BlockBounds; 5] {
    let range = Interval { lower: -1.0, upper: 1.0 };
    let good = BlockBounds { range, slope_bound: 1.0 };
    [
        BlockBounds { range: Interval { lower: f32::NAN, ..range }, ..good },
        BlockBounds { range: Interval { upper: f32::INFINITY, ..range }, ..good },
        BlockBounds { slope_bound: f32::NAN, ..good },
        BlockBounds { slope_bound: -1e-9, ..good },
        BlockBounds { range: Interval { lower: 2.0, ..range }, ..good },
    ]
}

#[test]
fn bricks_that_could_not_be_read_are_not_written() {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("grid.sdf.h5");
    let made = Made::new([33, 33, 33], SPARSE_U16);
    let Content::U16(bricks) = &made.content else { panic!("another layout") };
    let bricks = lent(bricks);
    let refused = |samples: SparseSamples<u16>| {
        let error = grid_file::write(&path, &made.lattice, samples, &about()).unwrap_err().to_string();
        assert!(error.contains("cannot be written") && error.lines().count() == 1, "{error}");
    };
    for band in [f64::NAN, f64::INFINITY, -1e-9] {
        refused(SparseSamples { band, ..bricks });
    }
    refused(SparseSamples { samples: &bricks.samples[1..], ..bricks });
    refused(SparseSamples { scales: &bricks.scales[1..], ..bricks });
    refused(SparseSamples { bounds: &bricks.bounds[1..], ..bricks });
    refused(SparseSamples { errors: &bricks.errors[1..], ..bricks });
    refused(SparseSamples { coarse: &bricks.coarse[1..], ..bricks });
    refused(SparseSamples { slots: &bricks.slots[1..], ..bricks });
    refused(SparseSamples { slots: &[], scales: &[], samples: &[], bounds: &[], errors: &[], ..bricks });
    let mut places = bricks.slots.to_vec();
    places[3] = places[2];
    refused(SparseSamples { slots: &places, ..bricks });
    places[3] = [0, 5, 0];
    refused(SparseSamples { slots: &places, ..bricks });
    for (base, step) in
        [(f32::NAN, 1.0), (f32::INFINITY, 1.0), (0.0, f32::NAN), (0.0, -1e-9), (3e38, 1e38), (0.0, 1e34)]
    {
        let mut scales = bricks.scales.to_vec();
        scales[5] = Scale { base, step };
        refused(SparseSamples { scales: &scales, ..bricks });
    }
    for bad in bad_bounds() {
        let mut bounds = bricks.bounds.to_vec();
        bounds[5] = bad;
        refused(SparseSamples { bounds: &bounds, ..bricks });
    }
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        let mut errors = bricks.errors.to_vec();
        errors[5] = bad;
        refused(SparseSamples { errors: &errors, ..bricks });
    }
    let mut coarse = bricks.coarse.to_vec();
    coarse[5] = f32::NAN;
    refused(SparseSamples { coarse: &coarse, ..bricks });
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    grid_file::write(&path, &made.lattice, bricks, &about()).unwrap();
}

/// The files stay in the target folder, for tests/readers/run.sh.
#[test]
fn foreign_readers_see_the_same() {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR"));
    let path = folder.join("lumpy_sphere.sdf.h5");
    let made = Made::new([41, 37, 35], DENSE);
    made.write(&path);
    let Content::Dense { distances, .. } = &made.content else { panic!("another layout") };

    let file = Hdf5File::open(&path).unwrap();
    let dataset = file.dataset("/VTKHDF/PointData/distance").unwrap();
    assert_eq!(dataset.shape(), [35, 37, 41]);
    let samples = dataset.read_array::<f32>().unwrap();
    assert_eq!(bits(samples.as_slice().unwrap()), bits(distances));
    let sdf = file.group("/sdf").unwrap();
    assert_eq!(sdf.attribute("error_bound").unwrap().read_scalar::<f64>().unwrap(), about().error_bound);
    assert_eq!(sdf.attribute("sign_verdict").unwrap().read_string().unwrap(), about().sign_reason);

    let file = rust_hdf5::H5File::open(&path).unwrap();
    let dataset = file.dataset("VTKHDF/PointData/distance").unwrap();
    assert_eq!(bits(&dataset.read_raw::<f32>().unwrap()), bits(distances));
    let sdf = file.root_group().group("sdf").unwrap();
    assert_eq!(sdf.attr_string("sign_verdict").unwrap(), about().sign_reason);
    for object in ["/", "/sdf", "/sdf/bounds", "/VTKHDF", "/VTKHDF/PointData", "/VTKHDF/PointData/distance"] {
        assert!(!file.object_records_times(object).unwrap(), "{object} records a time");
    }

    for precision in [Precision::F32, Precision::U16, Precision::U8] {
        let path = folder.join(format!("lumpy_sphere_{}.sdf.h5", precision.name()));
        let made = Made::new([41, 37, 35], Kind::Sparse(precision));
        made.write(&path);
        let file = Hdf5File::open(&path).unwrap();
        let samples = file.dataset("/sdf/samples").unwrap();
        let sums =
            |at: usize| (0..=at).filter(move |before| [1, 8, 64].iter().all(|step| before / step % 8 <= at / step % 8));
        match &made.content {
            Content::F32(bricks) => {
                assert_eq!(samples.read_array::<f32>().unwrap().as_slice().unwrap(), bricks.samples);
            }
            Content::U16(bricks) => {
                let stored = samples.read_array::<u16>().unwrap();
                let second = &stored.as_slice().unwrap()[512..1024];
                for at in 0..512 {
                    let difference = |zigzag: u16| zigzag >> 1 ^ (zigzag & 1).wrapping_neg();
                    let code = sums(at).fold(0_u16, |sum, before| sum.wrapping_add(difference(second[before])));
                    assert_eq!(code, bricks.samples[512 + at]);
                }
            }
            Content::U8(bricks) => {
                let stored = samples.read_array::<u8>().unwrap();
                let second = &stored.as_slice().unwrap()[512..1024];
                for at in 0..512 {
                    let difference = |zigzag: u8| zigzag >> 1 ^ (zigzag & 1).wrapping_neg();
                    let code = sums(at).fold(0_u8, |sum, before| sum.wrapping_add(difference(second[before])));
                    assert_eq!(code, bricks.samples[512 + at]);
                }
            }
            _ => panic!("another layout"),
        }
    }
    // For a reader of docs/format.md's rules alone.
    for precision in [Precision::U16, Precision::U8] {
        Made::new([41, 37, 35], Kind::Dense(precision))
            .write(&folder.join(format!("lumpy_sphere_dense_{}.sdf.h5", precision.name())));
    }
}

fn bits(samples: &[f32]) -> Vec<u32> {
    samples.iter().map(|sample| sample.to_bits()).collect()
}
