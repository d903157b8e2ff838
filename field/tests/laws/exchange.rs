//! Exported files hold the field, imported ones make it again, and damaged ones are refused.

use sdf_field::core::Sdf;
use sdf_field::core::grid::owned::{Layout, Precision};
use sdf_field::core::nalgebra::Vector3;
use sdf_field::core::shapes::{HalfSpace, Sphere};
use sdf_field::export::{ExportError, ExportFormat, ExportOptions};
use sdf_field::import::ImportFormat;
use sdf_field::{BakeOptions, Field, GridSize, MeshView, SignMethod, Source, Threads};
use sdf_procedural::SpikedBall;
use sdf_procedural::random::{Random, test_seed};

fn baked(layout: Layout, precision: Option<Precision>) -> Field {
    let mesh = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    let options = BakeOptions { size: GridSize::Cells(32), layout, precision, ..BakeOptions::default() };
    Field::bake(MeshView { points: &mesh.points, faces: &mesh.triangles }, &options).unwrap().field
}

fn exported(field: &Field, format: ExportFormat) -> Vec<u8> {
    field.export(format, &ExportOptions::default()).unwrap().bytes
}

fn level_set(bytes: &[u8]) -> Result<Field, String> {
    Field::import(bytes, ImportFormat::Nvdb, Source::default()).map_err(|error| error.to_string())
}

/// Points anywhere in a grid's box.
fn points(field: &Field, count: usize) -> Vec<[f64; 3]> {
    let mut random = Random::new(test_seed(17));
    let bounds = field.grid().unwrap().lattice().bounds();
    (0..count).map(|_| std::array::from_fn(|axis| random.between(bounds.min[axis], bounds.max[axis]))).collect()
}

#[test]
fn a_level_set_holds_the_field_in_its_band_to_the_rounding_of_the_place() {
    for (layout, precision) in [
        (Layout::Dense, None),
        (Layout::Dense, Some(Precision::U16)),
        (Layout::Dense, Some(Precision::U8)),
        (Layout::Sparse, None),
        (Layout::Sparse, Some(Precision::F32)),
        (Layout::Sparse, Some(Precision::U8)),
    ] {
        let field = baked(layout, precision);
        let grid = field.grid().unwrap();
        let band = if layout == Layout::Sparse { grid.band() } else { 4.0 * grid.lattice().spacing() };
        let again = level_set(&exported(&field, ExportFormat::Nvdb)).unwrap();
        let samples = points(&field, 20_000);
        let [ours, theirs] = [&field, &again].map(|field| field.sample(&samples, Threads::ALL));
        let in_band = std::iter::zip(&ours, &theirs).filter(|(ours, _)| ours.value.abs() < band);
        let worst = in_band.clone().map(|(ours, theirs)| (ours.value - theirs.value).abs()).fold(0.0, f64::max);
        let diagonal = grid.lattice().bounds().diagonal();
        assert!(in_band.count() > 1000 && worst <= 1e-12 * diagonal, "{layout:?} {precision:?}: {worst}");
        let is_sign_kept = |(ours, theirs): (&_, &_)| -> bool {
            let [ours, theirs]: [&sdf_field::core::Sample<f64>; 2] = [ours, theirs];
            (ours.value < 0.0) == (theirs.value < 0.0)
        };
        assert!(std::iter::zip(&ours, &theirs).all(is_sign_kept), "{layout:?} {precision:?}: a sign changed");
    }
}

#[test]
fn a_level_set_goes_on_beyond_the_box_as_the_field_does() {
    let mesh = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    for (layout, padding) in [(Layout::Dense, 0), (Layout::Dense, 2), (Layout::Sparse, 0), (Layout::Sparse, 2)] {
        // 30 cells and padding: no multiple of the 8 nodes of a leaf.
        let options = BakeOptions { size: GridSize::Cells(30), layout, padding, ..BakeOptions::default() };
        let field = Field::bake(view, &options).unwrap().field;
        let grid = field.grid().unwrap();
        let band = if layout == Layout::Sparse { grid.band() } else { 4.0 * grid.lattice().spacing() };
        let again = level_set(&exported(&field, ExportFormat::Nvdb)).unwrap();
        let (ours, theirs) = (grid.lattice(), *again.grid().unwrap().lattice());
        let [nx, ny, nz] = theirs.nodes();
        let nodes = (0..nz).flat_map(|z| (0..ny).flat_map(move |y| (0..nx).map(move |x| theirs.node([x, y, z]))));
        let beyond: Vec<[f64; 3]> = nodes
            .filter(|node| (0..3).any(|axis| node[axis] > ours.bounds().max[axis] + 0.5 * ours.spacing()))
            .collect();
        let [wanted, found] = [&field, &again].map(|field| field.values(&beyond, Threads::ALL));
        for ((point, wanted), found) in beyond.iter().zip(wanted).zip(found) {
            // What f32 and the nodes' places round.
            let is_it = (found - wanted.min(band)).abs() < 1e-6 * band || found == f64::from(band as f32);
            assert!(is_it, "{layout:?}, padding {padding} at {point:?}: {found}, not {wanted}");
        }
        assert!(beyond.len() > 500);
    }
}

#[test]
fn an_imported_grid_says_that_nothing_is_certified() {
    let field = level_set(&exported(&baked(Layout::Sparse, None), ExportFormat::Nvdb)).unwrap();
    let info = field.info().unwrap();
    assert_eq!((info.sign_method, info.error_bound), (SignMethod::Given, f64::INFINITY));
    assert!(info.sign_reason.contains("no error is certified") && info.padding > 0.0, "{info:?}");
    let again = Field::from_bytes(&field.to_bytes().unwrap(), "again").unwrap();
    assert_eq!(again.info(), Some(info));
    assert_eq!(again.slope_bound(), field.slope_bound());
}

#[test]
fn an_array_makes_the_same_grid_again() {
    let field = baked(Layout::Dense, None);
    let grid = field.grid().unwrap();
    let (origin, spacing) = (grid.lattice().origin(), grid.lattice().spacing());
    let bytes = exported(&field, ExportFormat::Npy);
    let again = Field::import(&bytes, ImportFormat::Npy { origin, spacing }, Source::default()).unwrap();
    assert_eq!(again.grid().unwrap().storage(), grid.storage());
    assert_eq!(again.slope_bound(), field.slope_bound());
}

#[test]
fn arrays_of_either_order_and_any_float_are_read() {
    // Two layers of three rows of four: the value is 100 z + 10 y + x.
    let value = |[x, y, z]: [usize; 3]| (100 * z + 10 * y + x) as f64;
    let c_order = (0..24).map(|index| value([index % 4, index / 4 % 3, index / 12]));
    let fortran = (0..24).map(|index| value([index / 6, index / 2 % 3, index % 2]));
    let array = |kind: &str, order: &str, data: Vec<u8>| {
        let header = format!("{{'descr': '{kind}', 'fortran_order': {order}, 'shape': (2, 3, 4), }}\n");
        [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), &data].concat()
    };
    let format = ImportFormat::Npy { origin: [1.0, 2.0, 3.0], spacing: 0.5 };
    for bytes in [
        array("<f8", "False", c_order.clone().flat_map(f64::to_le_bytes).collect()),
        array(">f4", "False", c_order.flat_map(|x| (x as f32).to_be_bytes()).collect()),
        array("<f4", "True", fortran.flat_map(|x| (x as f32).to_le_bytes()).collect()),
    ] {
        let field = Field::import(&bytes, format, Source::default()).unwrap();
        let lattice = field.grid().unwrap().lattice();
        assert_eq!((lattice.nodes(), lattice.origin(), lattice.spacing()), ([4, 3, 2], [1.0, 2.0, 3.0], 0.5));
        let at: f64 = field.as_any().value(Vector3::new(2.5, 3.0, 3.5));
        assert_eq!(at, value([3, 2, 1]));
    }
    for (bytes, words) in [
        (array("<i4", "False", vec![0; 96]), "its type is <i4"),
        (array("<f4", "False", vec![0; 95]), "95 bytes of samples"),
        (array("<f4", "False", f32::NAN.to_le_bytes().repeat(24)), "sample 0 is NaN"),
        (b"\x93NUMPY\x01\x00\xff\xff".to_vec(), "cut off"),
        (b"PK\x03\x04".to_vec(), "not a NumPy file"),
    ] {
        let error = Field::import(&bytes, format, Source::default()).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
}

#[test]
fn a_damaged_level_set_is_read_or_refused_and_nothing_else() {
    let bytes = exported(&baked(Layout::Sparse, None), ExportFormat::Nvdb);
    let mut random = Random::new(test_seed(23));
    let mut refused = 0;
    // Everything before the leaves: heads, root, and the tables of internal nodes at their first entries.
    for round in 0..120 {
        let mut damaged = bytes.clone();
        let at = if round % 2 == 0 { random.below(1200) } else { random.below(bytes.len()) };
        damaged[at] ^= 1 << random.below(8);
        refused += usize::from(level_set(&damaged).is_err());
    }
    assert!(refused > 3, "{refused} refused");
    for length in [0, 8, 16, 191, 300, 1100, bytes.len() / 2, bytes.len() - 1] {
        assert!(level_set(&bytes[..length]).is_err(), "{length}");
    }
}

#[test]
fn a_surface_in_gltf_is_that_of_the_field() {
    let field = Field::new(Sphere::new(1.0).unwrap());
    let bytes =
        field.export(ExportFormat::Glb, &ExportOptions { cells: Some(24), ..ExportOptions::default() }).unwrap().bytes;
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    assert_eq!((&bytes[..4], number(4), number(8)), (&b"glTF"[..], 2, bytes.len()));
    let binary = 20 + number(12);
    assert_eq!(
        (&bytes[16..20], &bytes[binary + 4..binary + 8], number(binary)),
        (&b"JSON"[..], &b"BIN\0"[..], bytes.len() - binary - 8)
    );
    let document = std::str::from_utf8(&bytes[20..binary]).unwrap();
    let count: usize = document
        .split("\"count\":")
        .nth(1)
        .unwrap()
        .split(|c: char| !c.is_ascii_digit())
        .next()
        .unwrap()
        .parse()
        .unwrap();
    let float = |index: usize| f32::from_bits(number(binary + 8 + 4 * index) as u32);
    for point in 0..count {
        let [x, n] = [0, 3 * count].map(|first| Vector3::from_fn(|axis, _| float(first + 3 * point + axis)));
        // A vertex of surface nets is within its cell, 1/12 wide.
        assert!((x.norm() - 1.0).abs() < 0.02 && (n - x.normalize()).norm() < 1e-5, "{x} {n}");
    }
    assert!(count > 500);
}

#[test]
fn a_raw_file_is_described_beside_it() {
    let exported = baked(Layout::Dense, None).export(ExportFormat::Raw, &ExportOptions::default()).unwrap();
    let text = exported.description("ball.raw").unwrap();
    let nodes = exported.lattice.node_count();
    assert_eq!(exported.bytes.len(), 4 * nodes);
    for words in ["\"file\": \"ball.raw\"", "\"type\": \"float32\"", "\"error_bound\": 0.", "\"order\": \"x fastest"] {
        assert!(text.contains(words), "{words} is missing in {text}");
    }
}

#[test]
fn what_cannot_be_exported_says_why() {
    let refusal = |field: Field, format, cells| {
        field.export(format, &ExportOptions { cells, ..ExportOptions::default() }).unwrap_err()
    };
    let half_space = || Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    assert!(matches!(refusal(half_space(), ExportFormat::Npy, None), ExportError::Unbounded));
    let sphere = || Field::new(Sphere::new(1.0).unwrap());
    let too_large = refusal(sphere(), ExportFormat::Npy, Some(1_000_000));
    assert!(matches!(too_large, ExportError::TooLarge { .. }), "{too_large}");
    assert!(too_large.to_string().contains("use fewer cells"));
    for format in [ExportFormat::Npy, ExportFormat::Glb, ExportFormat::Nvdb] {
        assert_eq!(refusal(sphere(), format, Some(0)).to_string(), "cells 0: give 1 cell or more");
    }
    let no_band = sphere().export(ExportFormat::Nvdb, &ExportOptions { band: Some(0), ..ExportOptions::default() });
    assert_eq!(no_band.unwrap_err().to_string(), "band 0: give 1 cell or more");
}

/// f32 holds neither a field of 10⁴⁰ nor the voxels of one of 10⁻³⁰; the surface needs f64 alone.
#[test]
fn fields_outside_of_f32_are_refused_by_their_size_and_have_surfaces() {
    for (radius, words) in [(1e40, "too large for f32"), (1e-30, "too small for f32"), (1e-100, "too small for f32")] {
        let sphere = Field::new(Sphere::new(radius).unwrap());
        let formats =
            [ExportFormat::Glb, ExportFormat::Npy, ExportFormat::Nvdb, ExportFormat::Blob, ExportFormat::VtkHdf];
        for format in formats {
            let refusal = sphere.export(format, &ExportOptions::default()).unwrap_err().to_string();
            assert!(refusal.contains(words) && refusal.ends_with("scale the field"), "{radius}: {refusal}");
        }
        let lattice = sdf_bake::lattice_around(&sphere.bounds(0.0), radius / 8.0, 2).unwrap();
        let surface = sphere.surface(0.0, &lattice, Threads::ALL);
        let unit = Field::new(Sphere::new(1.0).unwrap());
        let lattice = sdf_bake::lattice_around(&unit.bounds(0.0), 1.0 / 8.0, 2).unwrap();
        assert_eq!(surface.triangles.len(), unit.surface(0.0, &lattice, Threads::ALL).triangles.len(), "{radius}");
        let off = |point: &[f64; 3]| (Vector3::from(*point) / radius).norm() - 1.0;
        assert!(surface.points.iter().all(|point| off(point).abs() < 0.01), "{radius}");
    }
    // Just within.
    let sphere = Field::new(Sphere::new(1e-26).unwrap());
    let bytes = exported(&sphere, ExportFormat::Npy);
    let lowest = bytes[128..].as_chunks().0.iter().map(|bytes| f32::from_le_bytes(*bytes)).fold(0.0, f32::min);
    assert!((f64::from(lowest) + 1e-26).abs() < 1e-28, "{lowest}");
    assert!(sphere.export(ExportFormat::Glb, &ExportOptions::default()).is_ok());
}

#[test]
fn a_sample_beyond_f32_is_named_with_its_value() {
    let array = |sample: f64| -> Vec<u8> {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 2, 2), }\n";
        let start = [b"\x93NUMPY\x01\x00".as_slice(), &(header.len() as u16).to_le_bytes(), header.as_bytes()].concat();
        let samples = [1.0, 1.0, sample, 1.0, 1.0, 1.0, 1.0, 1.0];
        start.into_iter().chain(samples.into_iter().flat_map(f64::to_le_bytes)).collect()
    };
    let npy = ImportFormat::Npy { origin: [0.0; 3], spacing: 1.0 };
    let refusal = |sample| Field::import(&array(sample), npy, Source::default()).unwrap_err().to_string();
    assert_eq!(refusal(-2.7e40), "sample 2 is -2.7e40, and samples are f32, of at most 3.4028235e38: scale the field");
    assert_eq!(refusal(f64::INFINITY), "sample 2 is inf: only finite distances make a field");
    assert!(Field::import(&array(1e38 / 1e38), npy, Source::default()).is_ok());
}
