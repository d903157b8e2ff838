//! First touches of a mesh: those of each element alone, and never later than contacts at any moment say.

use std::collections::BTreeMap;
use std::sync::atomic::AtomicBool;

use sdf_core::contact::{ContactStatus, FirstTouch, MovingElement, Touch, contact_at};
use sdf_core::grid::owned::Layout;
use sdf_core::moving::{MovingSdf, RigidMotion, Travelling};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placement, Rigid, Similarity};
use sdf_core::shapes::{Sphere, Torus};
use sdf_field::core as sdf_core;
use sdf_field::{
    BakeOptions, ContactOptions, Elements, Field, FirstTouchOptions, GridSize, MeshPath, MeshView, QueryError, Threads,
    TimedContact,
};
use sdf_procedural::SpikedBall;
use sdf_procedural::random::{Random, test_seed};

fn pose(random: &mut Random, half: f64) -> Rigid {
    Rigid::new(random.point_in_cube(half), [0; 4].map(|_| random.between(-1.0, 1.0))).unwrap()
}

/// Closed forms, grids of either layout, and a combination with a grid that was moved.
fn fields() -> Vec<(&'static str, Field)> {
    let body = SpikedBall { levels: 3, radius: 0.6 }.mesh();
    let mesh = MeshView { points: &body.points, faces: &body.triangles };
    let [dense, sparse] = [Layout::Dense, Layout::Sparse].map(|layout| {
        let options = BakeOptions { size: GridSize::Cells(24), padding: 12, layout, ..BakeOptions::default() };
        Field::bake(mesh, &options).unwrap().field
    });
    let torus = Field::new(Torus::new(0.5, 0.2).unwrap());
    let moved = dense.placed(Similarity::new([0.2, 0.1, 0.0], [0.1, 0.3, -0.2, 0.9], 0.8).unwrap()).unwrap();
    let both = Field::union(&[torus.clone(), moved]).unwrap();
    vec![("torus", torus), ("dense", dense), ("sparse", sparse), ("union", both)]
}

/// Triangles of about a fifth of the fields' size, and where they are a frame later.
fn triangles(random: &mut Random, count: u32) -> ([Vec<[f64; 3]>; 2], Vec<[u32; 3]>) {
    let (mut start, mut end) = (vec![], vec![]);
    for _ in 0..count {
        let (centre, way) = (Vector3::from(random.point_in_cube(1.2)), Vector3::from(random.point_in_cube(1.2)));
        for _ in 0..3 {
            let corner = centre + Vector3::from(random.point_in_cube(0.15));
            start.push(corner.into());
            end.push((corner + way + Vector3::from(random.point_in_cube(0.05))).into());
        }
    }
    ([start, end], (0..count).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect())
}

#[test]
fn first_touches_are_never_later_than_contacts_at_any_moment_and_do_touch() {
    let mut random = Random::new(test_seed(41));
    let (thickness, tolerance) = (0.01, 1e-4);
    for (name, field) in fields() {
        for step in 0..3 {
            let ([start, end], faces) = triangles(&mut random, 200);
            let path = MeshPath { start: MeshView { points: &start, faces: &faces }, end: &end };
            // At rest where it is, on its way, and at rest elsewhere.
            let start_pose = (step > 0).then(|| pose(&mut random, 0.3));
            let end_pose = (step == 1).then(|| pose(&mut random, 0.3));
            let options = FirstTouchOptions {
                thickness,
                pose: start_pose,
                end_pose,
                tolerance: Some(tolerance),
                ..FirstTouchOptions::default()
            };
            let found = field.first_touches(&path, &options).unwrap();
            let at: BTreeMap<u32, f64> =
                found.touches.iter().map(|touch| (touch.contact.element, touch.time)).collect();
            assert_eq!((at.len(), found.element_count), (found.touches.len(), faces.len()));
            assert!(found.touches.is_sorted_by_key(|touch| touch.contact.element));
            let touching = found.touches.len() - found.undecided_count;
            assert!(touching > 10 && found.undecided_count < 10, "{name}: {touching}, {} open", found.undecided_count);

            let pose_at = |time: f64| {
                start_pose.map(|start| end_pose.map_or(start, |end| RigidMotion::between(start, end).pose(time)))
            };
            for step in 0..20 {
                let time = f64::from(step) / 19.0;
                let points: Vec<[f64; 3]> =
                    start.iter().zip(&end).map(|(start, end)| between(*start, *end, time)).collect();
                // The rounding of a point on its way.
                let margin = thickness - 1e-12;
                let options = ContactOptions { margin, pose: pose_at(time), ..ContactOptions::certified() };
                for contact in field.contacts(MeshView { points: &points, faces: &faces }, &options).unwrap().contacts {
                    let touch = at.get(&contact.element);
                    assert!(touch.is_some_and(|touch| *touch <= time), "{name}: {touch:?} is later than {time}");
                }
            }
            for touch in &found.touches {
                let point: [f64; 3] = touch.contact.point.into();
                let local = pose_at(touch.time).map_or(point, |pose| pose.pull(point.into()).point.into());
                let value = field.values(&[local], Threads::ONE)[0];
                let corners = touch.contact.vertices.map(|k| between(start[k as usize], end[k as usize], touch.time));
                let on_element: Vector3<f64> = corners
                    .iter()
                    .zip(touch.contact.weights)
                    .map(|(corner, weight)| Vector3::from(*corner) * weight)
                    .sum();
                // Rounding of coordinates of about 2.
                assert!(
                    (on_element - touch.contact.point).norm() < 1e-14 && (value - touch.contact.distance).abs() < 1e-13
                );
                let is_open = touch.contact.distance > thickness + tolerance;
                assert!(!is_open || touch.contact.status == ContactStatus::BudgetSpent, "{name}: {touch:?}");
            }
        }
    }
}

/// A point on its way, as the core moves it.
fn between(start: [f64; 3], end: [f64; 3], time: f64) -> [f64; 3] {
    match time {
        1.0 => end,
        _ => std::array::from_fn(|axis| start[axis] + (end[axis] - start[axis]) * time),
    }
}

#[test]
fn first_touches_of_a_mesh_are_those_of_its_elements_on_any_number_of_threads() {
    let mut random = Random::new(test_seed(42));
    let body = SpikedBall { levels: 2, radius: 0.3 }.mesh();
    let start: Vec<[f64; 3]> = body.points.iter().map(|[x, y, z]| [x - 1.2, *y, z + 0.1]).collect();
    let end: Vec<[f64; 3]> = body.points.iter().map(|[x, y, z]| [x + 0.4, y + 0.2, *z]).collect();
    let mesh = MeshView { points: &start, faces: &body.triangles };
    let path = MeshPath { start: mesh, end: &end };
    for (name, field) in fields() {
        for elements in [Elements::Faces, Elements::Edges, Elements::Vertices] {
            let poses = [0; 2].map(|_| pose(&mut random, 0.1));
            let moving = Travelling { field: field.as_any(), motion: RigidMotion::between(poses[0], poses[1]) };
            let points = [&start, &end];
            let expected: Vec<TimedContact> = match elements {
                Elements::Faces => touches(&moving, points, &body.triangles),
                Elements::Edges => touches(&moving, points, &mesh.edges()),
                Elements::Vertices => touches(&moving, points, &mesh.vertices()),
            };
            assert!(expected.len() > 10, "{name}: {} touch", expected.len());
            let base = FirstTouchOptions {
                elements,
                pose: Some(poses[0]),
                end_pose: Some(poses[1]),
                tolerance: Some(1e-3),
                ..FirstTouchOptions::default()
            };
            let alone = field.first_touches(&path, &FirstTouchOptions { threads: Threads::ONE, ..base }).unwrap();
            assert_eq!(alone.touches, expected, "{name}, {elements:?}");
            let on_three = FirstTouchOptions { threads: Threads::new(3), ..base };
            assert_eq!(field.first_touches(&path, &on_three).unwrap(), alone, "{name}, {elements:?}");
        }
    }
}

/// First touches by the core, one element after the other.
fn touches<const N: usize>(
    field: &impl MovingSdf,
    points: [&Vec<[f64; 3]>; 2],
    elements: &[[u32; N]],
) -> Vec<TimedContact> {
    let search = FirstTouch { tolerance: 1e-3, ..FirstTouch::default() };
    let touch = |(id, vertices): (u32, &[u32; N])| {
        let path = vertices.map(|vertex| points.map(|points| Vector3::from(points[vertex as usize])));
        let element = MovingElement { id, vertices: *vertices, path };
        match search.first_touch(field, 0.0, &element) {
            Touch::At { time, minimum } => {
                let contact = contact_at(&field.at(time), &element.at(time), &minimum, f64::NEG_INFINITY)?;
                Some(TimedContact { time, contact })
            }
            Touch::Never => None,
            other => panic!("{other:?}"),
        }
    };
    (0..).zip(elements).filter_map(touch).collect()
}

#[test]
fn first_touches_do_not_depend_on_the_unit() {
    let mut random = Random::new(test_seed(43));
    let ([start, end], faces) = triangles(&mut random, 60);
    let times = |scale: f64| {
        let scaled = |points: &[[f64; 3]]| points.iter().map(|point| point.map(|x| scale * x)).collect::<Vec<_>>();
        let (start, end) = (scaled(&start), scaled(&end));
        let field = Field::new(Torus::new(0.5 * scale, 0.2 * scale).unwrap());
        let path = MeshPath { start: MeshView { points: &start, faces: &faces }, end: &end };
        let options = FirstTouchOptions { thickness: 0.01 * scale, ..FirstTouchOptions::default() };
        let touches = field.first_touches(&path, &options).unwrap().touches;
        touches.iter().map(|touch| (touch.contact.element, touch.time)).collect::<Vec<_>>()
    };
    assert!(times(1.0).len() > 5);
    for exponent in [-40, -3, 7, 40] {
        assert_eq!(times(2.0_f64.powi(exponent)), times(1.0), "2^{exponent}");
    }
}

#[test]
fn first_touches_without_a_budget_say_up_to_when_nothing_touches() {
    let field = Field::new(Torus::new(0.5, 0.2).unwrap());
    let (start, end, faces) = ([[2.0, 0.0, 0.0], [2.0, 0.1, 0.0], [2.0, 0.0, 0.1]], [[0.0, 0.0, 0.0]; 3], [[0, 1, 2]]);
    let path = MeshPath { start: MeshView { points: &start, faces: &faces }, end: &end };
    let options = FirstTouchOptions { budget: 3, ..FirstTouchOptions::default() };
    let found = field.first_touches(&path, &options).unwrap();
    assert_eq!((found.touches.len(), found.undecided_count), (1, 1));
    let touch = found.touches[0];
    assert_eq!(touch.contact.status, ContactStatus::BudgetSpent);
    let exact = field.first_touches(&path, &FirstTouchOptions::default()).unwrap();
    assert_eq!(exact.undecided_count, 0);
    assert!(touch.time < exact.touches[0].time && touch.contact.distance > 0.0, "{touch:?}");
}

/// The default tolerance is one of the elements: a vertex that none names, or that no search can reach, counts for nothing.
#[test]
fn a_stray_vertex_makes_no_touch() {
    let field = Field::new(Torus::new(0.5, 0.2).unwrap());
    let face = [[20.0, 0.0, 0.0], [21.0, 0.0, 0.0], [20.0, 1.0, 0.0]];
    for stray in [1e6, 1e29, 1e200, f64::MAX, f64::INFINITY, f64::NAN] {
        let points = [face[0], face[1], face[2], [stray, 0.0, 0.0], [-stray, 0.0, 0.0]];
        let path = MeshPath { start: MeshView { points: &points, faces: &[[0, 1, 2]] }, end: &points };
        let found = field.first_touches(&path, &FirstTouchOptions::default()).unwrap();
        assert_eq!((found.touches.len(), found.undecided_count), (0, 0), "{stray}");
    }
}

/// Positions on a long way are rounded as its ends are, also where they come near the origin.
#[test]
fn a_vertex_that_passes_through_less_than_its_rounding_touches() {
    let seed = test_seed(2711);
    let mut random = Random::new(seed);
    for far in [1.0, 1e3, 1e9] {
        let field = Field::new(Sphere::new(0.2 * far * 2.0_f64.powi(-53)).unwrap());
        let mut ends = |side: f64| -> Vec<[f64; 3]> {
            (0..400).map(|_| [side * far * random.between(1.0, 1.3), 0.0, 0.0]).collect()
        };
        let (start, end) = (ends(1.0), ends(-1.0));
        let path = MeshPath { start: MeshView { points: &start, faces: &[] }, end: &end };
        let options = FirstTouchOptions {
            elements: Elements::Vertices,
            tolerance: Some(1e-20 * far),
            ..FirstTouchOptions::default()
        };
        let found = field.first_touches(&path, &options).unwrap();
        assert_eq!(found.touches.len(), 400, "{far}, seed {seed}");
    }
}

#[test]
fn a_moving_mesh_that_cannot_be_watched_is_refused() {
    let field = Field::new(Torus::new(0.5, 0.2).unwrap());
    let points = [[2.0, 0.0, 0.0], [2.0, 0.1, 0.0], [2.0, 0.0, 0.1]];
    let faces = [[0, 1, 2]];
    let path = MeshPath { start: MeshView { points: &points, faces: &faces }, end: &points };
    let options = FirstTouchOptions::default();
    let error = |path: &MeshPath, options: &FirstTouchOptions| field.first_touches(path, options).unwrap_err();
    assert_eq!(error(&MeshPath { end: &points[..2], ..path }, &options), QueryError::VertexCountDiffers);
    for thickness in [f64::NAN, f64::INFINITY] {
        let wrong = FirstTouchOptions { thickness, ..options };
        assert_eq!(error(&path, &wrong), QueryError::ThicknessOutOfRange);
    }
    for tolerance in [0.0, f64::INFINITY] {
        let wrong = FirstTouchOptions { tolerance: Some(tolerance), ..options };
        assert_eq!(error(&path, &wrong), QueryError::ToleranceOutOfRange);
    }
    let broken = MeshPath { start: MeshView { points: &points, faces: &[[0, 1, 3]] }, ..path };
    assert!(matches!(error(&broken, &options), QueryError::VertexOutOfRange(_)));
    // Elements without a number are counted, the others answered; an empty mesh is fine.
    let end = [[f64::NAN, 0.0, 0.0], points[1], points[2]];
    let found = field.first_touches(&MeshPath { end: &end, ..path }, &options).unwrap();
    assert_eq!((found.not_finite_count, found.touches.len(), found.element_count), (1, 0, 1));
    let empty = MeshPath { start: MeshView { points: &[], faces: &[] }, end: &[] };
    assert_eq!(field.first_touches(&empty, &options).unwrap().element_count, 0);
}

#[test]
fn a_cancelled_search_finds_nothing() {
    let ([start, end], faces) = triangles(&mut Random::new(test_seed(63)), 100);
    let path = MeshPath { start: MeshView { points: &start, faces: &faces }, end: &end };
    for (_, field) in fields() {
        for threads in [Threads::ONE, Threads::ALL] {
            let options = FirstTouchOptions { threads, ..FirstTouchOptions::default() };
            let [found, none] = [false, true].map(|is_cancelled| {
                let cancel = AtomicBool::new(is_cancelled);
                field.first_touches_cancellable(&path, &options, &cancel)
            });
            assert_eq!(found, field.first_touches(&path, &options));
            assert_eq!(none, Err(QueryError::Cancelled));
        }
    }
}

#[test]
fn faces_that_are_larger_than_their_way_to_a_grid_are_not_left_open() {
    let mut random = Random::new(test_seed(42));
    let body = SpikedBall { levels: 3, radius: 0.6 }.mesh();
    let mesh = MeshView { points: &body.points, faces: &body.triangles };
    let (thickness, count) = (0.02, 300);
    for layout in [Layout::Dense, Layout::Sparse] {
        let options = BakeOptions { size: GridSize::Cells(40), layout, ..BakeOptions::default() };
        let field = Field::bake(mesh, &options).unwrap().field;
        // Nearly normally distributed, of deviation 1.
        let normal = |random: &mut Random| [0; 3].map(|_| (0..12).map(|_| random.unit() - 0.5).sum::<f64>());
        let (mut start, mut end) = (vec![], vec![]);
        for _ in 0..count {
            let (centre, way) = (Vector3::from(random.point_in_cube(1.5)), Vector3::from(normal(&mut random)));
            for _ in 0..3 {
                let corner = centre + Vector3::from(normal(&mut random)) * 0.2;
                start.push(corner.into());
                end.push((corner + way + Vector3::from(normal(&mut random)) * 0.2).into());
            }
        }
        let faces: Vec<[u32; 3]> = (0..count).map(|face| [3 * face, 3 * face + 1, 3 * face + 2]).collect();
        let path = MeshPath { start: MeshView { points: &start, faces: &faces }, end: &end };
        let options = FirstTouchOptions { thickness, ..FirstTouchOptions::default() };
        let open = field.first_touches(&path, &options).unwrap().undecided_count;
        // Of such faces 31 were left open where a search went on to the tolerance wherever a face was larger than its gap.
        assert!(100 * open <= faces.len(), "{layout:?}: {open} of {count} are left open");
    }
}
