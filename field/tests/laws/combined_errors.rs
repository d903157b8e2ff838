//! The error bounds of contacts hold for combinations of grids and shapes, also outside of the grids and beyond their bands.

use sdf_field::core::grid::owned::Layout;
use sdf_field::core::placed::Similarity;
use sdf_field::core::shapes::{Cuboid, Sphere};
use sdf_field::{BakeOptions, ContactOptions, Elements, Field, GridSize, MeshView, QueryError, Threads};
use sdf_procedural::SpikedBall;
use sdf_procedural::random::{Random, test_seed};

type Combine = fn(&Field, &Field) -> Field;

#[test]
fn error_bounds_of_contacts_hold_for_combinations_outside_of_grids_and_beyond_bands() {
    let mut random = Random::new(test_seed(61));
    let body = SpikedBall { levels: 3, radius: 0.7 }.mesh();
    let mesh = MeshView { points: &body.points, faces: &body.triangles };
    let points: Vec<[f64; 3]> = (0..3000).map(|_| random.point_in_cube(2.5)).collect();
    let of_mesh = Field::mesh_distances(mesh, &points, None, Threads::ONE).unwrap();
    let moved = Similarity::new([0.6, 0.0, 0.3], [0.0, 0.0, 0.0, 1.0], 1.0).unwrap();
    let shapes = [
        Field::new(Sphere::new(1.2).unwrap()).placed(moved).unwrap(),
        Field::new(Cuboid::new([0.5, 2.0, 1.0]).unwrap()),
    ];
    // Each with what it makes of the distances of its parts.
    let union: (Combine, fn(f64, f64) -> f64) = (|a, b| Field::union(&[a.clone(), b.clone()]).unwrap(), f64::min);
    let both: (Combine, fn(f64, f64) -> f64) = (|a, b| a.intersection(b).unwrap(), f64::max);
    let without: (Combine, fn(f64, f64) -> f64) = (|a, b| a.difference(b).unwrap(), |a, b| a.max(-b));
    let swapped: (Combine, fn(f64, f64) -> f64) = (|a, b| b.difference(a).unwrap(), |a, b| b.max(-a));
    let mut finite = 0;
    for layout in [Layout::Dense, Layout::Sparse] {
        let options = BakeOptions { size: GridSize::Cells(24), layout, ..BakeOptions::default() };
        let grid = Field::bake(mesh, &options).unwrap().field;
        for shape in &shapes {
            let of_shape = shape.values(&points, Threads::ONE);
            for (index, (combine, distance)) in [union, both, without, swapped].into_iter().enumerate() {
                let field = combine(&grid, shape);
                let options =
                    ContactOptions { elements: Elements::Vertices, margin: 99.0, ..ContactOptions::default() };
                let found = field.contacts(MeshView { points: &points, faces: &[] }, &options).unwrap();
                assert_eq!(found.contacts.len(), points.len());
                for contact in &found.contacts {
                    let id = contact.element as usize;
                    let distance = distance(of_mesh[id], of_shape[id]);
                    let off = (contact.distance - distance).abs();
                    // Rounding of numbers of about 5.
                    assert!(off <= contact.error_bound + 1e-14, "{layout:?}, {index}: {off}, {contact:?}");
                    assert!(
                        contact.shape_lower_bound <= distance + 1e-14,
                        "{layout:?}, {index}: {distance}, {contact:?}"
                    );
                    finite += usize::from(contact.error_bound.is_finite());
                }
            }
        }
    }
    assert!(finite > 10_000, "{finite} are bounded");
}

/// Outside of its box the distance to what a grid was baked from is larger than φ by an unknown length. In a difference, and a shell of a shell,
/// it is smaller.
#[test]
fn a_complete_search_drops_nothing_of_differences_and_shells_outside_of_a_grid() {
    let half = [0.3; 3];
    let exact = Field::new(Cuboid::new(half).unwrap());
    let corner = |at: u32| [0, 1, 2].map(|axis| if at >> axis & 1 == 0 { -0.3 } else { 0.3 });
    let points: Vec<[f64; 3]> = (0..8).map(corner).collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let faces: Vec<[u32; 3]> = quads.into_iter().flat_map(|[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    let carved: fn(&Field) -> Field =
        |field| Field::new(Cuboid::new([10.0; 3]).unwrap()).difference(field).unwrap().offset(-1.0).unwrap();
    let shells: fn(&Field) -> Field = |field| field.shell(0.29).unwrap().shell(0.29).unwrap();
    for layout in [Layout::Dense, Layout::Sparse] {
        let options = BakeOptions { size: GridSize::Cells(16), layout, ..BakeOptions::default() };
        let grid = Field::bake(MeshView { points: &points, faces: &faces }, &options).unwrap().field;
        for (combine, margin) in [(carved, 0.0), (shells, 0.1)] {
            let mut near = 0;
            for step in 0..200 {
                let x = 0.31 + 0.01 * f64::from(step);
                let face = [[x, 0.0, 0.0], [x + 0.01, 0.0, 0.0], [x, 0.01, 0.0]];
                let mesh = MeshView { points: &face, faces: &[[0, 1, 2]] };
                let complete = ContactOptions { margin, complete: true, ..ContactOptions::default() };
                if combine(&exact).contacts(mesh, &complete).unwrap().contacts.is_empty() {
                    continue;
                }
                near += 1;
                match combine(&grid).contacts(mesh, &complete) {
                    Ok(found) => assert_eq!(found.contacts.len(), 1, "{layout:?}, margin {margin}: dropped at {x}"),
                    // The margin lies beyond the band of the sparse grid, too.
                    Err(QueryError::ErrorBoundUnknown) => assert_eq!((layout, margin), (Layout::Sparse, 0.1)),
                    Err(error) => assert_eq!(error, QueryError::OutsideGridInCombination),
                }
            }
            assert!(near > 20, "{near}");
        }
    }
}
