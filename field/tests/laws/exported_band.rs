//! Samples of a sparse grid claim no distances beyond its band, in files of any format.

use sdf_field::core::AnyField;
use sdf_field::core::combine::Offset;
use sdf_field::core::grid::owned::{Layout, Precision};
use sdf_field::core::placed::Similarity;
use sdf_field::export::{ExportError, ExportFormat, ExportOptions};
use sdf_field::file::SaveError;
use sdf_field::import::ImportFormat;
use sdf_field::{BakeOptions, Field, GridSize, MeshView, Source, Threads};
use sdf_procedural::SpikedBall;

/// Padding, in cells: far more than the band of 3.
const PADDING: u32 = 20;

fn sparse() -> Field {
    let mesh = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    let (size, layout) = (GridSize::Cells(40), Layout::Sparse);
    let options = BakeOptions { size, layout, padding: PADDING, ..BakeOptions::default() };
    Field::bake(MeshView { points: &mesh.points, faces: &mesh.triangles }, &options).unwrap().field
}

fn export(field: &Field, format: ExportFormat, options: ExportOptions) -> Vec<u8> {
    field.export(format, &ExportOptions { cells: Some(90), ..options }).unwrap().bytes
}

/// The sparse grid, its like at twice the size and one whose levels are moved, with the widest band that each has.
fn fields() -> [(Field, f64); 3] {
    let field = sparse();
    let (any, band) = (field.as_any().clone(), field.grid().unwrap().band());
    let twice = any.clone().placed(Similarity::new([1.0, 2.0, 3.0], [0.0, 0.6, 0.0, 0.8], 2.0).unwrap());
    let thicker = AnyField::Offset(Box::new(Offset::new(any, 0.25 * band).unwrap()));
    [(field, band), (Field::new(twice), 2.0 * band), (Field::new(thicker), 0.75 * band)]
}

#[test]
fn a_blob_refuses_the_margins_that_its_grid_refuses() {
    for (field, band) in fields() {
        for precision in Precision::ALL {
            let options = ExportOptions { precision: Some(precision), ..ExportOptions::default() };
            let blob = Field::from_bytes(&export(&field, ExportFormat::Blob, options), "blob").unwrap();
            let info = blob.info().unwrap();
            // Sums of rounded products.
            let is_band = |found: f64| (found - band).abs() <= 1e-12 * band;
            assert!(info.band.is_some_and(is_band) && info.max_margin() <= info.band.unwrap(), "{info:?}, {band}");
            assert!(blob.check_margin(1.01 * band).is_err() && blob.check_margin(-1.01 * band).is_err());
            assert!(field.check_margin(0.99 * band).is_ok());
            let sample = blob.sample(&[blob.domain().min], Threads::ONE)[0];
            assert!(sample.status.beyond_band, "{sample:?}");
            // A file of a dense grid names no band.
            assert!(matches!(blob.to_bytes(), Err(SaveError::DenseWithBand)));
        }
    }
}

#[test]
fn a_level_set_is_no_wider_than_the_band() {
    for (field, band) in fields() {
        for wanted in [None, Some(2), Some(200)] {
            let options = ExportOptions { band: wanted, ..ExportOptions::default() };
            let exported = field.export(ExportFormat::Nvdb, &ExportOptions { cells: Some(90), ..options }).unwrap();
            let asked = wanted.map_or(f64::INFINITY, |cells| f64::from(cells) * exported.lattice.spacing());
            // The value of the corner, which lies far outside of leaves: the background, in f32.
            let again = Field::import(&exported.bytes, ImportFormat::Nvdb, Source::default()).unwrap();
            let background = again.sample(&[again.domain().min], Threads::ONE)[0].value;
            let band = band.min(asked);
            assert!((background - band).abs() <= band * f64::from(f32::EPSILON), "{background}, {band}");
        }
    }
}

/// A box one voxel around the body: beyond it values are lower bounds, also where the band is wider, and where cells do not fit the box.
#[test]
fn a_level_set_reaches_no_farther_than_the_box() {
    let mesh = SpikedBall { levels: 2, radius: 0.6 }.mesh();
    let mesh = MeshView { points: &mesh.points, faces: &mesh.triangles };
    for layout in [Layout::Dense, Layout::Sparse] {
        let options = BakeOptions { size: GridSize::Cells(32), padding: 1, layout, ..BakeOptions::default() };
        let field = Field::bake(mesh, &options).unwrap().field;
        let (limit, mut limited) = (field.grid().unwrap().lowest_boundary_sample(), 0);
        let moved = Field::new(
            field.as_any().clone().placed(Similarity::new([0.3, 0.2, 0.1], [0.0, 0.0, 0.0, 1.0], 1.0).unwrap()),
        );
        for (field, cells) in [(&field, Some(7)), (&field, Some(11)), (&moved, None), (&moved, Some(40))] {
            for band in [None, Some(1), Some(200)] {
                let options = ExportOptions { cells, band, ..ExportOptions::default() };
                let exported = field.export(ExportFormat::Nvdb, &options).unwrap();
                // Within a grid's own box all of its values are distances.
                let is_within =
                    field.grid().is_some_and(|own| own.lattice().bounds().encloses(&exported.lattice.bounds()));
                let found = exported.band.unwrap();
                let context = || format!("{layout:?}, {cells:?} cells, band {band:?}: {found} beyond {limit}");
                assert!(is_within || found <= limit * (1.0 + 1e-6), "{}", context());
                limited += usize::from(!is_within);
            }
        }
        assert!(limited >= 6, "{limited}");
    }
}

#[test]
fn a_raw_file_names_the_band() {
    for (field, _) in fields() {
        for cells in [Some(90), None] {
            let exported =
                field.export(ExportFormat::Raw, &ExportOptions { cells, ..ExportOptions::default() }).unwrap();
            let text = exported.description("x.raw").unwrap();
            assert!(text.contains("\"band\": 0."), "{text}");
        }
    }
}

#[test]
fn a_surface_beyond_the_band_is_not_exported() {
    let field = sparse();
    let band = field.grid().unwrap().band();
    for distance in [1.1 * band, -1.1 * band] {
        let moved = Field::new(AnyField::Offset(Box::new(Offset::new(field.as_any().clone(), distance).unwrap())));
        for format in ExportFormat::ALL {
            let error = moved.export(format, &ExportOptions::default()).unwrap_err();
            assert!(matches!(error, ExportError::BeyondBand), "{format:?}: {error}");
        }
    }
}
