//! Bodies whose own vertices are points of contact, over edges of grounds without an inside; and what a solver keeps from step to step.

use parry3d::math::{Pose, Vector};
use parry3d::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher, QueryDispatcher};
use parry3d::shape::{Cuboid, HeightField, Shape, SharedShape, TriMesh};
use parry3d::utils::Array2;
use sdf_core::shapes;
use sdf_parry::{SdfDispatcher, SdfShape};

const PREDICTION: f32 = 0.02;

/// A plank of eight vertices.
fn plank(half_extents: Vector) -> SdfShape {
    let (points, faces) = Cuboid::new(half_extents).to_trimesh();
    let points: Vec<[f64; 3]> = points.into_iter().map(|point| point.to_array().map(f64::from)).collect();
    let field = shapes::Cuboid::new(half_extents.to_array().map(f64::from)).unwrap();
    SdfShape::new(field).unwrap().with_mesh(&points, &faces).unwrap()
}

fn manifolds<C: Default + Copy + Send + Sync>(
    pose: &Pose,
    ground: &dyn Shape,
    body: &dyn Shape,
    known: &mut Vec<ContactManifold<(), C>>,
) {
    let dispatcher = SdfDispatcher::default().chain(DefaultQueryDispatcher);
    dispatcher.contact_manifolds(pose, ground, body, PREDICTION, known, &mut None).unwrap();
}

/// Gap and normal out of the ground, in the world, of all points of contact.
fn contacts(pose: &Pose, ground: &dyn Shape, body: &dyn Shape) -> Vec<(f32, Vector)> {
    let mut found: Vec<ContactManifold<(), ()>> = vec![];
    manifolds(pose, ground, body, &mut found);
    found.iter().flat_map(|manifold| manifold.points.iter().map(|point| (point.dist, manifold.local_n1))).collect()
}

/// Grounds whose upper side is y = 0 about the origin and ends at an edge not far from there, in triangles without an inside; and where
/// on it that edge is.
fn grounds() -> [(&'static str, SharedShape, Vector); 4] {
    let square = |low: f32, high: f32, y: f32| {
        [(low, -2.0), (high, -2.0), (high, 2.0), (low, 2.0)].map(|(x, z)| Vector::new(x, y, z))
    };
    let mesh = |points: Vec<Vector>, faces| SharedShape::new(TriMesh::new(points, faces).unwrap());
    let sheet = mesh(square(-3.0, 0.3, 0.0).into(), vec![[0, 2, 1], [0, 3, 2]]);
    let step = [square(-3.0, 0.3, 0.0), square(0.3, 3.0, -1.0)].concat();
    let stairs = mesh(step, vec![[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6], [1, 2, 7], [1, 7, 4]]);
    // Columns along x: the first two are level, then it falls by one.
    let heights = [0.0, 0.0, -1.0, -1.0].into_iter().flat_map(|height| [height; 2]).collect();
    let ledge = SharedShape::new(HeightField::new(Array2::new(2, 4, heights), Vector::new(6.0, 1.0, 4.0)));
    let slanted = [Vector::new(-3.0, 0.0, -3.0), Vector::new(-3.0, 0.0, 3.6), Vector::new(3.6, 0.0, -3.0)];
    let triangle = mesh(slanted.into(), vec![[0, 1, 2]]);
    [
        ("a sheet", sheet, Vector::new(0.3, 0.0, 0.0)),
        ("stairs", stairs, Vector::new(0.3, 0.0, 0.0)),
        ("a ledge", ledge, Vector::new(-1.0, 0.0, 0.0)),
        ("a triangle", triangle, Vector::new(0.3, 0.0, 0.3)),
    ]
}

/// A vertex that hangs over an edge is beside the ground, not under it.
#[test]
fn a_vertex_over_an_edge_has_not_gone_through() {
    let half_extents = Vector::new(0.6, 0.08, 0.5);
    let body = plank(half_extents);
    for (name, ground, edge) in grounds() {
        for (along, gap) in [-0.5, -0.3, 0.0].into_iter().flat_map(|along| [0.01, 0.001].map(|gap| (along, gap))) {
            let pose = Pose::from_translation(edge + Vector::new(along, half_extents.y + gap, 0.0));
            let found = contacts(&pose, &*ground, &body);
            let lowest = found.iter().map(|(dist, _)| *dist).fold(f32::INFINITY, f32::min);
            assert!((lowest - gap).abs() < 1e-4, "{name}, {along}: {lowest} for {gap}");
            // Far from the edge the plank lies on the ground alone.
            let upright = found.iter().filter(|(_, normal)| normal.y > 0.99).count();
            assert!(upright >= 3, "{name}, {along}: {found:?}");
        }
    }
}

/// A corner that is under the ground is pushed out upwards, as deep as it is.
#[test]
fn a_vertex_under_the_ground_has_gone_through() {
    let half_extents = Vector::new(0.2, 0.3, 0.2);
    let body = plank(half_extents);
    for (name, ground, edge) in grounds() {
        let pose = Pose::from_translation(edge + Vector::new(-0.9, half_extents.y - 0.05, -0.3));
        let found = contacts(&pose, &*ground, &body);
        let deepest = found.iter().min_by(|(a, _), (b, _)| a.total_cmp(b)).unwrap();
        assert!((deepest.0 + 0.05).abs() < 1e-4 && deepest.1.y > 0.99, "{name}: {found:?}");
    }
}

/// Impulses of the last step are given once: a solver that starts from one of them twice pushes twice.
#[test]
fn each_point_of_the_last_step_goes_on_once() {
    let body = plank(Vector::new(0.6, 0.08, 0.5));
    let ground = SharedShape::cuboid(2.0, 0.5, 2.0);
    let mut found: Vec<ContactManifold<(), u32>> = vec![];
    let pose = |step: u32| {
        let step = step as f32;
        Pose::new(
            Vector::new(0.01 * step, 0.585, 0.0),
            Vector::new(0.004 * step.sin(), 0.02 * step, 0.004 * step.cos()),
        )
    };
    let mut kept = 0;
    for step in 0..40 {
        manifolds(&pose(step), &*ground, &body, &mut found);
        let points = || found.iter().flat_map(|manifold| &manifold.points);
        let mut known: Vec<u32> = points().map(|point| point.data).filter(|data| *data > 0).collect();
        kept += known.len();
        known.sort_unstable();
        let count = known.len();
        known.dedup();
        assert_eq!(known.len(), count, "step {step}: data are given twice");
        for (point, number) in found.iter_mut().flat_map(|manifold| &mut manifold.points).zip(1..) {
            point.data = number;
        }
    }
    assert!(kept > 60, "{kept}");
}
