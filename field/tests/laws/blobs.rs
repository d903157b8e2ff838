//! A blob is the field that was exported: the same contacts, bit for bit. One of fewer bits a sample keeps every bound true.

use sdf_field::core::grid::measure_slope_bound;
use sdf_field::core::grid::owned::{Layout, Precision};
use sdf_field::core::nalgebra::Vector3;
use sdf_field::core::shapes::{Sphere, Torus};
use sdf_field::core::{Aabb, EnclosedSdf, Sdf};
use sdf_field::export::{ExportError, ExportFormat, ExportOptions};
use sdf_field::{BakeOptions, ContactOptions, Field, GridSize, MeshView, Threads};
use sdf_procedural::SpikedBall;
use sdf_procedural::random::{Random, test_seed};

fn baked(layout: Layout, precision: Option<Precision>) -> Field {
    let mesh = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    let options = BakeOptions { size: GridSize::Cells(32), layout, precision, ..BakeOptions::default() };
    Field::bake(MeshView { points: &mesh.points, faces: &mesh.triangles }, &options).unwrap().field
}

fn exported(field: &Field, precision: Option<Precision>) -> Vec<u8> {
    field.export(ExportFormat::Blob, &ExportOptions { precision, ..ExportOptions::default() }).unwrap().bytes
}

const KINDS: [(Layout, Option<Precision>); 6] = [
    (Layout::Dense, None),
    (Layout::Dense, Some(Precision::U16)),
    (Layout::Dense, Some(Precision::U8)),
    (Layout::Sparse, Some(Precision::F32)),
    (Layout::Sparse, Some(Precision::U16)),
    (Layout::Sparse, Some(Precision::U8)),
];

#[test]
fn contacts_with_a_blob_are_those_with_the_field() {
    let mut random = Random::new(test_seed(41));
    let points: Vec<[f64; 3]> = (0..900).map(|_| [0; 3].map(|_| random.between(-0.7, 0.7))).collect();
    let faces: Vec<[u32; 3]> = (0..300).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
    let mesh = MeshView { points: &points, faces: &faces };
    for (layout, precision) in KINDS {
        let field = baked(layout, precision);
        let blob = Field::from_bytes(&exported(&field, None), "blob").unwrap();
        let [ours, theirs] = [&field, &blob].map(|field| field.contacts(mesh, &ContactOptions::default()).unwrap());
        assert!(ours.contacts.len() > 100 && ours == theirs, "{layout:?} {precision:?}");
        let [ours, theirs] = [&field, &blob].map(|field| {
            let info = field.info().unwrap();
            (info.error_bound, info.padding, info.band, field.grid().unwrap().clone())
        });
        assert_eq!(ours, theirs);
        // And back.
        let saved = Field::from_bytes(&blob.to_bytes().unwrap(), "again").unwrap();
        assert_eq!(saved.grid(), field.grid());
    }
}

#[test]
fn fewer_bits_a_sample_keep_every_bound_true() {
    let mut random = Random::new(test_seed(42));
    for (layout, own) in KINDS {
        let field = baked(layout, own);
        for precision in Precision::ALL {
            let blob = Field::from_bytes(&exported(&field, Some(precision)), "blob").unwrap();
            let (grid, before) = (blob.grid().unwrap(), field.grid().unwrap());
            let growth = grid.global_error_bound() - before.global_error_bound();
            let what = format!("{layout:?} {own:?} in {precision:?}");
            if Some(precision) == own.or(Some(Precision::F32)) {
                assert_eq!((grid, growth), (before, 0.0), "{what}");
                continue;
            }
            assert!(growth >= 0.0 && growth < 0.1 * grid.lattice().spacing(), "{what}: {growth}");
            let slope = measure_slope_bound(grid.lattice(), grid.storage());
            assert!(slope <= grid.slope_bound(), "{what}: {slope} of {}", grid.slope_bound());
            let (mut worst, bounds) = (0.0_f64, grid.lattice().bounds());
            for _ in 0..4000 {
                let point = Vector3::from_fn(|axis, _| random.between(bounds.min[axis], bounds.max[axis]));
                let (value, gradient) = (grid.value(point), grid.evaluate(point).gradient.norm());
                worst = worst.max((value - before.value(point)).abs());
                let reach = random.between(0.0, 0.05);
                let region = Aabb { min: point.into(), max: point.into() }.inflate(reach);
                let inside = grid.enclose_box(&region);
                assert!(inside.range.lower <= value && value <= inside.range.upper, "{what} at {point:?}: {inside:?}");
                assert!(gradient <= inside.slope_bound * (1.0 + 1e-12), "{what} at {point:?}: {gradient}, {inside:?}");
                let at = Aabb { min: point.into(), max: point.into() };
                let (error, earlier) = (grid.error_bound(&at).near, before.error_bound(&at).near);
                assert!(error >= earlier + (value - before.value(point)).abs() - 1e-9, "{what} at {point:?}");
            }
            // Some samples change, unless the new steps hold them all.
            assert!(worst <= growth && (worst > 0.0 || precision == Precision::F32), "{what}: {worst} of {growth}");
        }
    }
}

#[test]
fn closed_forms_and_tables_are_exported_too() {
    let options = ExportOptions { cells: Some(16), name: "2 rings.".to_owned(), ..ExportOptions::default() };
    let ring = Field::new(Torus::new(0.5, 0.2).unwrap());
    let export = |format| ring.export(format, &options).unwrap().bytes;
    let blob = export(ExportFormat::Blob);
    let field = Field::from_bytes(&blob, "ring").unwrap();
    let distance = field.sample(&[[0.5, 0.0, 0.0]], Threads::ONE)[0].value;
    // The middle of the ring's tube, where the distance has a tip: within √3/2 of a cell of 1.4/16.
    assert!((distance + 0.2).abs() < 0.076, "{distance}");
    // Four cells around the ring, of which the surface cuts none.
    assert!(field.info().unwrap().padding > 0.1);
    for (format, name) in [(ExportFormat::C, "_2_rings__sdf["), (ExportFormat::Rust, "_2_RINGS__SDF: [u8; ")] {
        let text = String::from_utf8(export(format)).unwrap();
        let (head, table) = text.split_once(if format == ExportFormat::C { "{\n" } else { "[\n" }).unwrap();
        assert!(head.contains(name), "{head}");
        let numbers =
            table.split(['}', ']']).next().unwrap().split(',').filter_map(|word| word.trim().parse::<u8>().ok());
        assert_eq!(numbers.collect::<Vec<_>>(), blob);
    }
    let far = Field::new(Sphere::new(1e39).unwrap()).export(ExportFormat::Blob, &options).unwrap_err();
    assert!(matches!(far, ExportError::OutsideSingle { .. }), "{far}");
}
