//! Bounds of a stretched grid hold for the stretched shape, inside and outside.

use sdf_field::core::grid::owned::{Layout, OwnedGrid};
use sdf_field::core::nalgebra::{Matrix3, Rotation3, Vector3};
use sdf_field::core::placed::{Affine, Placed, Placement, Stretch};
use sdf_field::core::shapes::Cuboid;
use sdf_field::core::{Aabb, AnyField, EnclosedSdf, ErrorBound, Sdf};
use sdf_field::{BakeOptions, ContactOptions, Elements, Field, GridSize, MeshView};
use sdf_procedural::random::{Random, test_seed};

const HALF: [f64; 3] = [0.7, 1.0, 0.8];
const FACTORS: [[f64; 3]; 4] = [[1.0, 1.0, 3.0], [0.5, -2.0, 1.5], [2.0, 2.0, 2.0], [0.02, 1.0, 1.0]];

fn boxes() -> Vec<(Layout, Field)> {
    let mesh = sdf_procedural::Cuboid { half: HALF }.mesh();
    let bake = |layout| {
        let options = BakeOptions { size: GridSize::Cells(24), layout, ..BakeOptions::default() };
        (layout, Field::bake(MeshView { points: &mesh.points, faces: &mesh.triangles }, &options).unwrap().field)
    };
    Layout::ALL.map(bake).into_iter().collect()
}

/// The box stretched, whose field is its distance.
fn stretched_box(factors: [f64; 3]) -> Cuboid {
    Cuboid::new(std::array::from_fn(|k| HALF[k] * factors[k].abs())).unwrap()
}

/// Points in twice the stretched box, half of them within it.
fn points(factors: [f64; 3], random: &mut Random, count: usize) -> Vec<Vector3<f64>> {
    let point = |_| {
        let reach = random.pick(&[1.0, 2.0]);
        let unit = random.point_in_cube(reach);
        Vector3::from_fn(|k, _| unit[k] * HALF[k] * factors[k])
    };
    (0..count).map(point).collect()
}

/// Checks all bounds at points whose distances are given. Counts finite bounds of φ − d and of d − φ.
fn check<P: Placement>(context: &str, grid: &OwnedGrid, placement: P, truth: &[(Vector3<f64>, f64)]) -> [usize; 2] {
    let band = grid.band() * placement.scale();
    let field = Placed { field: grid, placement };
    let mut finite = [0; 2];
    for (point, distance) in truth {
        let sample = field.evaluate(*point);
        let ErrorBound { near, near_below, above, below } =
            field.error_bound(&Aabb { min: (*point).into(), max: (*point).into() });
        let (off, slack) = (sample.value - distance, 1e-6);
        let context = || format!("{context}: {distance} at {point:?}, φ − d = {off}");
        assert!(off <= above + slack && -off <= below + slack, "{}: {above}, {below}", context());
        if distance.abs() <= band {
            assert!(off <= near + slack, "{}: {near}", context());
            assert!(sample.status.outside_grid || -off <= near_below + slack, "{}: {near_below}", context());
        }
        finite[0] += usize::from(above.is_finite());
        finite[1] += usize::from(below.is_finite());
    }
    finite
}

#[test]
fn bounds_of_a_stretched_grid_hold_for_the_stretched_shape() {
    let mut random = Random::new(test_seed(20_260_511));
    for (layout, field) in boxes() {
        let grid = field.grid().unwrap();
        for factors in FACTORS {
            let shape = stretched_box(factors);
            let points = points(factors, &mut random, 2000);
            let truth: Vec<_> = points.iter().map(|point| (*point, shape.value(*point))).collect();
            let context = format!("{layout:?} {factors:?}");
            let finite = check(&context, grid, Stretch::new(factors).unwrap(), &truth);
            assert!(finite[0] == 2000 && finite[1] > 300, "{context}: {finite:?}");

            let turn = Rotation3::from_scaled_axis(Vector3::from(random.point_in_cube(2.0)));
            let linear = turn.matrix() * Matrix3::from_diagonal(&Vector3::from(factors));
            let rows = std::array::from_fn(|row| std::array::from_fn(|column| linear[(row, column)]));
            let turned: Vec<_> = truth.iter().map(|(point, distance)| (turn * point, *distance)).collect();
            check(&context, grid, Affine::new([0.0; 3], rows).unwrap(), &turned);
        }
    }
}

#[test]
fn a_complete_search_of_a_stretched_grid_misses_no_point_within_the_margin() {
    let mut random = Random::new(test_seed(20_260_512));
    for (layout, field) in boxes() {
        for factors in FACTORS {
            let placed = Placed { field: field.clone().into_any(), placement: Stretch::new(factors).unwrap() };
            let stretched = Field::new(AnyField::Stretched(Box::new(placed)));
            let shape = stretched_box(factors);
            let points = points(factors, &mut random, 500);
            let corners: Vec<[f64; 3]> = points.iter().map(|point| (*point).into()).collect();
            let mesh = MeshView { points: &corners, faces: &[] };
            // A sparse grid finds all that is nearer than its band.
            let margins: &[f64] = if layout == Layout::Dense { &[-0.3, -0.01, 0.0, 0.01] } else { &[0.0] };
            for margin in margins {
                let options = ContactOptions {
                    margin: *margin,
                    elements: Elements::Vertices,
                    complete: true,
                    ..ContactOptions::default()
                };
                let found = stretched.contacts(mesh, &options).unwrap();
                for (id, point) in points.iter().enumerate() {
                    let (context, distance) = (format!("{layout:?} {factors:?} {margin}"), shape.value(*point));
                    let contact = found.contacts.iter().find(|contact| contact.element as usize == id);
                    assert!(
                        contact.is_some() || distance > *margin - 1e-6,
                        "{context}: {distance} at {point:?} is missed"
                    );
                    let Some(contact) = contact else { continue };
                    assert!(contact.shape_lower_bound <= distance + 1e-6, "{context}: {distance}, {contact:?}");
                    let off = (contact.distance - distance).abs();
                    assert!(off <= contact.error_bound + 1e-6, "{context}: {distance}, {contact:?}");
                }
            }
        }
    }
}
