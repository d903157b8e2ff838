//! The error bounds of contacts hold for combinations of grids and shapes, also outside of the grids and beyond their bands.

use sdf_field::core::grid::owned::Layout;
use sdf_field::core::placed::Similarity;
use sdf_field::core::shapes::{Cuboid, Sphere};
use sdf_field::{BakeOptions, ContactOptions, Elements, Field, GridSize, MeshView, Threads};
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
