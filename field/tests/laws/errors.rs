//! Errors name their causes, for programs that look for one.

use std::error::Error;
use std::path::PathBuf;

use sdf_field::core::grid::owned::Layout;
use sdf_field::file::SaveError;
use sdf_field::{
    BakeError, BakeFileError, BakeOptions, Field, GridSize, MeshView, Method, QueryError, VertexOutOfRange,
};
use sdf_formats::grid_file::{GridFault, GridFileError};

/// The error and its causes, each in words.
fn chain(error: &dyn Error) -> Vec<String> {
    error.source().map_or_else(Vec::new, chain).into_iter().rev().chain([error.to_string()]).rev().collect()
}

/// Is a cause of such a type among those of an error?
fn has_cause<E: Error + 'static>(error: &dyn Error) -> bool {
    error.source().is_some_and(|cause| cause.is::<E>() || has_cause::<E>(cause))
}

#[test]
fn an_error_that_says_its_cause_names_it_as_its_source() {
    let (points, faces) = ([[0.0; 3]; 3], [[0, 1, 7]]);
    let mesh = MeshView { points: &points, faces: &faces };
    let bake = Field::bake(mesh, &BakeOptions { size: GridSize::Cells(8), ..BakeOptions::default() }).unwrap_err();
    let BakeError::InvalidMesh(invalid) = &bake else { panic!("{bake}") };
    assert_eq!(chain(&bake), [invalid.to_string(), invalid.to_string()]);
    assert_eq!(chain(&BakeFileError::Bake(bake)).len(), 3);
    let full = || GridFault::Io(std::io::ErrorKind::StorageFull.into());
    let file = || GridFileError { path: PathBuf::from("body.sdf.h5"), fault: full() };
    assert!(has_cause::<GridFault>(&file()));
    assert!(
        has_cause::<GridFault>(&BakeFileError::File(file())) && has_cause::<GridFileError>(&SaveError::Grid(file()))
    );
    assert!(has_cause::<GridFault>(&SaveError::Fault(full())));
    let missing = sdf_formats::field_file::read(&PathBuf::from("missing.sdf.toml")).unwrap_err();
    assert!(SaveError::ClosedForm(missing).source().is_some());
    let query = QueryError::VertexOutOfRange(VertexOutOfRange { element: 0, vertex: 7, vertex_count: 3 });
    assert!(query.source().is_some_and(|cause| query.to_string() == cause.to_string()));
    assert!(SaveError::NotABakedGrid.source().is_none());
}

#[test]
fn a_band_of_no_cells_or_of_more_than_1000_is_refused() {
    let mesh = MeshView { points: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], faces: &[[0, 1, 2]] };
    for band in [0, 1001, u32::MAX] {
        let options = BakeOptions { layout: Layout::Sparse, band, ..BakeOptions::default() };
        let error = Field::bake(mesh, &options).unwrap_err();
        assert_eq!(error, BakeError::BandOutOfRange { band });
        assert_eq!(error.to_string(), format!("band {band}: give 1 to 1000 cells"));
    }
}

#[test]
fn a_grid_of_very_many_nodes_is_refused_in_few_digits() {
    let mesh = MeshView { points: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], faces: &[[0, 1, 2]] };
    let why = |size: f64| {
        let options = BakeOptions { size: GridSize::VoxelSize(size), ..BakeOptions::default() };
        Field::bake(mesh, &options).unwrap_err().to_string()
    };
    // The bytes of the first are beyond f64.
    assert_eq!(why(1e-300), "a grid of 1.0e300 × 1.0e300 × 9 nodes is too large: take larger voxels");
    let needs = "a grid of 1.0e20 × 1.0e20 × 9 nodes needs ";
    assert!(why(1e-20).starts_with(needs) && why(1e-20).contains("e41 bytes"), "{}", why(1e-20));
}

#[test]
fn a_size_that_no_grid_has_is_refused_by_its_name() {
    let mesh = MeshView { points: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], faces: &[[0, 1, 2]] };
    let why = |size| Field::bake(mesh, &BakeOptions { size, ..BakeOptions::default() }).unwrap_err().to_string();
    assert_eq!(why(GridSize::Cells(0)), "a grid needs a cell along its longest side: give 1 or more");
    for (size, words) in [(-0.1, "-0.1"), (0.0, "0.0"), (f64::NAN, "NaN"), (f64::INFINITY, "inf")] {
        assert_eq!(why(GridSize::VoxelSize(size)), format!("voxels need a positive finite size, not {words}"));
    }
}

#[test]
fn a_sparse_grid_that_is_too_large_is_not_told_to_be_sparse() {
    let mesh = MeshView { points: &[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], faces: &[[0, 1, 2]] };
    let why = |layout| {
        let options = BakeOptions { size: GridSize::VoxelSize(1e-20), layout, ..BakeOptions::default() };
        Field::bake(mesh, &options).unwrap_err().to_string()
    };
    assert!(why(Layout::Dense).ends_with(": take larger voxels or a sparse grid"), "{}", why(Layout::Dense));
    assert!(why(Layout::Sparse).ends_with(": take larger voxels"), "{}", why(Layout::Sparse));
}

#[test]
fn every_method_is_parsed_from_its_name_and_nothing_else_is() {
    let counts = [0, 1, 4, 5, 16, 64, 1000, u32::MAX];
    let sampling = counts.into_iter().flat_map(|n| [Method::Sampling(n), Method::SamplingWithCorners(n)]);
    for method in Method::ALL.into_iter().chain(sampling) {
        assert_eq!(method.to_string().parse(), Ok(method));
    }
    for name in ["", "Auto", "sample", "sample-1", "sample+4", "sample04", "sample4294967296", "corners0", "corners 4"]
    {
        assert_eq!(name.parse::<Method>().unwrap_err().name, name);
    }
}
