//! Bounds of a stretched grid hold for the stretched shape, inside and outside, also where the sign of an open mesh jumps.

use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_field::core::grid::owned::{Layout, OwnedGrid};
use sdf_field::core::nalgebra::{Matrix3, Rotation3, Vector3};
use sdf_field::core::placed::{Affine, Placed, Placement, Stretch};
use sdf_field::core::shapes::Cuboid;
use sdf_field::core::{Aabb, AnyField, EnclosedSdf, ErrorBound, Sdf};
use sdf_field::{BakeOptions, ContactOptions, Elements, Field, GridSize, MeshView};
use sdf_procedural::Mesh;
use sdf_procedural::random::{Random, test_seed};

const HALF: [f64; 3] = [0.7, 1.0, 0.8];
const FACTORS: [[f64; 3]; 4] = [[1.0, 1.0, 3.0], [0.5, -2.0, 1.5], [2.0, 2.0, 2.0], [0.02, 1.0, 1.0]];

/// A grid of the box.
struct Body {
    layout: Layout,
    is_open: bool,
    mesh: Mesh,
    field: Field,
}

impl Body {
    fn new(layout: Layout, is_open: bool) -> Self {
        let mut mesh = sdf_procedural::Cuboid { half: HALF }.mesh();
        let is_lid = |triangle: &[u32; 3]| triangle.iter().all(|corner| mesh.points[*corner as usize][2] == HALF[2]);
        mesh.triangles = mesh.triangles.iter().copied().filter(|triangle| !is_open || !is_lid(triangle)).collect();
        let options = BakeOptions { size: GridSize::Cells(24), layout, ..BakeOptions::default() };
        let field = Field::bake(MeshView { points: &mesh.points, faces: &mesh.triangles }, &options).unwrap().field;
        Self { layout, is_open, mesh, field }
    }

    fn all() -> [Self; 4] {
        [(Layout::Dense, false), (Layout::Dense, true), (Layout::Sparse, false), (Layout::Sparse, true)]
            .map(|(layout, is_open)| Self::new(layout, is_open))
    }

    fn name(&self, factors: [f64; 3]) -> String {
        format!("{:?}, open: {}, {factors:?}", self.layout, self.is_open)
    }

    /// Distances to the stretched mesh. The flat lid divides inside from outside, whether it is there or not.
    fn distances(&self, factors: [f64; 3], points: &[Vector3<f64>]) -> Vec<f64> {
        let corners: Vec<_> =
            self.mesh.points.iter().map(|point| std::array::from_fn(|k| point[k] * factors[k])).collect();
        let triangles = TriangleMesh::new(&corners, &self.mesh.triangles).unwrap();
        let mesh = MeshDistance::new(&triangles, None);
        let closed = Cuboid::new(std::array::from_fn(|k| HALF[k] * factors[k].abs())).unwrap();
        let distance =
            |point: &Vector3<f64>| mesh.signed_distance((*point).into()).abs().copysign(closed.value(*point));
        points.iter().map(distance).collect()
    }
}

/// Points in twice the stretched box, half of them within it, and one of three about its lid.
fn points(factors: [f64; 3], random: &mut Random, count: usize) -> Vec<Vector3<f64>> {
    let point = |_| {
        let reach = random.pick(&[1.0, 2.0]);
        let mut unit = random.point_in_cube(reach);
        if random.pick(&[true, false, false]) {
            unit[2] = random.between(0.95, 1.05);
        }
        Vector3::from_fn(|k, _| unit[k] * HALF[k] * factors[k])
    };
    (0..count).map(point).collect()
}

/// Counts of points.
#[derive(Debug, Default)]
struct Found {
    /// Number of those with finite bounds of φ − d, and of d − φ.
    finite: [usize; 2],
    /// Number of those whose sign is wrong, more than half of the band away from the surface.
    at_jumps: usize,
}

/// Checks all bounds at points whose distances are given.
fn check<P: Placement>(context: &str, grid: &OwnedGrid, placement: P, truth: &[(Vector3<f64>, f64)]) -> Found {
    let half_band = 0.5 * grid.band() * placement.scale();
    let field = Placed { field: grid, placement };
    let mut found = Found::default();
    for (point, distance) in truth {
        let sample = field.evaluate(*point);
        let ErrorBound { near, near_below, above, below, levels, .. } =
            field.error_bound(&Aabb { min: (*point).into(), max: (*point).into() });
        let (off, slack) = (sample.value - distance, 1e-6);
        let context = || format!("{context}: {distance} at {point:?}, φ − d = {off}");
        assert!(off <= above + slack && -off <= below + slack, "{}: {above}, {below}", context());
        let (lower, upper) = (sample.value.min(*distance), sample.value.max(*distance));
        if lower <= levels.upper && upper >= levels.lower {
            assert!(off <= near + slack, "{}: {near}", context());
            assert!(sample.status.outside_grid || -off <= near_below + slack, "{}: {near_below}", context());
        }
        found.finite[0] += usize::from(above.is_finite());
        found.finite[1] += usize::from(below.is_finite());
        found.at_jumps += usize::from((sample.value < 0.0) != (*distance < 0.0) && distance.abs() > half_band);
    }
    found
}

#[test]
fn bounds_of_a_stretched_grid_hold_for_the_stretched_shape() {
    let mut random = Random::new(test_seed(20_260_511));
    for body in Body::all() {
        let grid = body.field.grid().unwrap();
        for factors in FACTORS {
            let points = points(factors, &mut random, 2000);
            let distances = body.distances(factors, &points);
            let truth: Vec<_> = points.into_iter().zip(distances).collect();
            let context = body.name(factors);
            let found = check(&context, grid, Stretch::new(factors).unwrap(), &truth);
            let is_rich = found.finite[0] == 2000 && found.finite[1] > 200;
            let is_at_jumps = body.layout == Layout::Dense || !body.is_open || found.at_jumps > 5;
            assert!(is_rich && is_at_jumps, "{context}: {found:?}");

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
    for body in Body::all() {
        for factors in FACTORS {
            let placed = Placed { field: body.field.clone().into_any(), placement: Stretch::new(factors).unwrap() };
            let stretched = Field::new(AnyField::Stretched(Box::new(placed)));
            let points = points(factors, &mut random, 500);
            let distances = body.distances(factors, &points);
            let corners: Vec<[f64; 3]> = points.iter().map(|point| (*point).into()).collect();
            let mesh = MeshView { points: &corners, faces: &[] };
            for margin in [-0.3, -0.01, 0.0, 0.01] {
                let options = ContactOptions {
                    margin,
                    elements: Elements::Vertices,
                    complete: true,
                    ..ContactOptions::default()
                };
                let found = stretched.contacts(mesh, &options).unwrap();
                for (id, distance) in distances.iter().enumerate() {
                    let context =
                        || format!("{}, margin {margin}: {distance} at {:?}", body.name(factors), corners[id]);
                    let contact = found.contacts.iter().find(|contact| contact.element as usize == id);
                    assert!(contact.is_some() || *distance > margin - 1e-6, "{} is missed", context());
                    let Some(contact) = contact else { continue };
                    assert!(contact.shape_lower_bound <= distance + 1e-6, "{}: {contact:?}", context());
                    let off = (contact.distance - distance).abs();
                    assert!(off <= contact.error_bound + 1e-6, "{}: {contact:?}", context());
                }
            }
        }
    }
}
