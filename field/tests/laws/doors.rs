//! Foundations of the bindings: bakes that end early, combinations, exact distances, contacts one by one and as rows.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};

use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_field::core::contact::{ContactStatus, Feature};
use sdf_field::core::grid::owned::Layout;
use sdf_field::core::placed::Similarity;
use sdf_field::core::shapes::{Cuboid, Sphere, Torus};
use sdf_field::{
    BakeError, BakeOptions, CombineError, ContactOptions, ContactRow, Elements, Field, FirstTouchOptions, GridSize,
    MaxError, MeshPath, MeshView, Method, Progress, SignMethod, Threads,
};
use sdf_procedural::random::{Random, test_seed};
use sdf_procedural::{Mesh, Sheet, SpikedBall};

const BALL: SpikedBall = SpikedBall { levels: 2, radius: 0.7 };

fn view(mesh: &Mesh) -> MeshView<'_> {
    MeshView { points: &mesh.points, faces: &mesh.triangles }
}

fn sphere(radius: f64) -> Field {
    Field::new(Sphere::new(radius).unwrap())
}

#[test]
fn a_cancelled_bake_skips_what_is_left() {
    let mut open = BALL.mesh();
    open.triangles.truncate(500);
    let sizes = [
        (GridSize::Cells(40), Layout::Dense, None),
        (GridSize::Cells(40), Layout::Dense, Some(SignMethod::Winding)),
        (GridSize::Cells(64), Layout::Sparse, None),
        (GridSize::MaxError(MaxError::Fraction(5e-3)), Layout::Sparse, None),
    ];
    for (size, layout, sign) in sizes {
        let mesh = if sign.is_some() { open.clone() } else { BALL.mesh() };
        let options = BakeOptions { size, layout, sign, ..BakeOptions::default() };
        let bake = |cancel_at: u64| {
            let (calls, cancel) = (AtomicU64::new(0), AtomicBool::new(cancel_at == 0));
            let on_progress = |progress| {
                let Progress::Done(_) = progress else { return };
                if calls.fetch_add(1, Ordering::Relaxed) + 1 >= cancel_at {
                    cancel.store(true, Ordering::Relaxed);
                }
            };
            let baked = Field::bake_cancellable(view(&mesh), &options, &on_progress, &cancel);
            (baked.map(|_| ()), calls.into_inner())
        };
        let (whole, all) = bake(u64::MAX);
        assert_eq!(whole, Ok(()));
        for at in [0, 1] {
            let (ended, some) = bake(at);
            assert_eq!(ended, Err(BakeError::Cancelled), "{size:?} {layout:?}");
            assert!(some <= all / 2, "{size:?} {layout:?}: {some} of {all} calls though it was cancelled at call {at}");
        }
    }
}

#[test]
fn combinations_are_minima_and_maxima_of_their_parts() {
    let (ball, torus) = (sphere(1.0), Field::new(Torus::new(1.0, 0.25).unwrap()));
    let mut random = Random::new(test_seed(16));
    for _ in 0..1000 {
        let point = random.point_in_cube(2.0);
        let value = |field: &Field| field.values(&[point], Threads::ONE)[0];
        let (a, b) = (value(&ball), value(&torus));
        assert_eq!(value(&Field::union(&[ball.clone(), torus.clone()]).unwrap()), a.min(b));
        assert_eq!(value(&ball.intersection(&torus).unwrap()), a.max(b));
        assert_eq!(value(&ball.difference(&torus).unwrap()), a.max(-b));
        assert_eq!(value(&ball.offset(-0.5).unwrap()), a + 0.5);
        assert_eq!(value(&ball.shell(0.25).unwrap()), a.abs() - 0.125);
        assert!(value(&ball.smooth_union(&torus, 0.1).unwrap()) <= a.min(b));
        let moved = ball.placed(Similarity::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0], 2.0).unwrap()).unwrap();
        let expected = (point[0] - 1.0).hypot(point[1]).hypot(point[2]) - 2.0;
        assert!((value(&moved) - expected).abs() < 1e-12);
    }
}

#[test]
fn combinations_that_are_refused_say_why() {
    let ball = sphere(1.0);
    assert_eq!(Field::union(&[]).unwrap_err(), CombineError::NoParts);
    assert!(matches!(ball.offset(f64::NAN), Err(CombineError::NotFinite(_))));
    assert_eq!(ball.shell(0.0).unwrap_err().to_string(), "0 is not a positive finite length");
    assert_eq!(ball.smooth_union(&ball, -1.0).unwrap_err(), CombineError::NotPositive(-1.0));
    // As deep as a file may nest, and not one more.
    let (mut nested, mut depth) = (ball, 0);
    let error = loop {
        match nested.offset(0.125) {
            Ok(deeper) => (nested, depth) = (deeper, depth + 1),
            Err(error) => break error,
        }
    };
    assert_eq!((depth, error), (63, CombineError::TooDeep));
    assert_eq!(nested.values(&[[10.0, 0.0, 0.0]], Threads::ONE), [1.125]);
    let again = Field::from_bytes(&nested.to_bytes().unwrap(), "nested").unwrap();
    assert_eq!(again.values(&[[10.0, 0.0, 0.0]], Threads::ONE), [1.125]);
}

/// A level of a nest takes the stack of its own numbers, and not of the search in what it holds: so as many as are allowed fit into the
/// stack of any thread, also of the debug build that this is as a rule, and in a release into half a megabyte.
#[test]
fn fields_nested_as_deep_as_allowed_fit_into_the_stack_of_a_thread() {
    let turned = Similarity::new([0.01, 0.0, 0.0], [0.0, 0.0, 0.1, 1.0], 1.0).unwrap();
    type Deeper = fn(&Field) -> Field;
    let deeper: [(&str, Deeper); 5] = [
        ("offset", |field| field.offset(0.001).unwrap()),
        ("shell", |field| field.shell(0.5).unwrap()),
        ("union", |field| Field::union(&[field.clone(), sphere(0.2)]).unwrap()),
        ("difference", |field| field.difference(&sphere(0.1)).unwrap()),
        ("smooth union", |field| field.smooth_union(&sphere(0.2), 0.01).unwrap()),
    ];
    for (name, deeper) in deeper {
        let mut nested = sphere(1.0);
        for level in 0..62 {
            nested = if level % 2 == 0 { deeper(&nested) } else { nested.placed(turned).unwrap() };
        }
        let ask = move || {
            let (points, faces) = ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], [[0, 1, 2]]);
            let mesh = MeshView { points: &points, faces: &faces };
            let options = ContactOptions { margin: 10.0, threads: Threads::ONE, ..ContactOptions::default() };
            let found = nested.contacts(mesh, &options).unwrap();
            let end = points.map(|point| point.map(|x: f64| x * 0.1));
            let touches = nested.first_touches(&MeshPath { start: mesh, end: &end }, &FirstTouchOptions::default());
            (found.contacts.len(), touches.unwrap().element_count)
        };
        let thread = std::thread::Builder::new().stack_size(2 << 20).spawn(ask).unwrap();
        assert_eq!(thread.join().unwrap(), (1, 1), "{name}");
    }
}

#[test]
fn values_are_those_of_samples_and_nan_where_a_point_is_not_finite() {
    let mesh = BALL.mesh();
    let fields = [
        sphere(0.5),
        Field::new(Cuboid::new([0.3, 0.4, 0.5]).unwrap()),
        Field::bake(view(&mesh), &BakeOptions { size: GridSize::Cells(24), ..BakeOptions::default() }).unwrap().field,
    ];
    let mut random = Random::new(test_seed(17));
    let mut points: Vec<[f64; 3]> = (0..2000).map(|_| random.point_in_cube(1.5)).collect();
    points.extend([[f64::NAN, 0.0, 0.0], [0.0, f64::INFINITY, 0.0], [0.0, 0.0, 1e200]]);
    for field in fields {
        let samples = field.sample(&points, Threads::ONE);
        for threads in [Threads::ONE, Threads::new(2)] {
            for (value, sample) in field.values(&points, threads).into_iter().zip(&samples) {
                let agrees = if sample.status.not_finite { value.is_nan() } else { value == sample.value };
                assert!(agrees, "{value} and {sample:?}");
            }
        }
    }
}

#[test]
fn distances_to_a_mesh_are_those_of_the_baker() {
    let mesh = BALL.mesh();
    let triangles = TriangleMesh::new(&mesh.points, &mesh.triangles).unwrap();
    let exact = MeshDistance::new(&triangles, None);
    let mut random = Random::new(test_seed(18));
    let mut points: Vec<[f64; 3]> = (0..600).map(|_| random.point_in_cube(1.5)).collect();
    let expected: Vec<f64> = points.iter().map(|point| exact.signed_distance(*point)).collect();
    assert!(expected.iter().any(|distance| *distance < 0.0) && expected.iter().any(|distance| *distance > 0.0));
    points.push([f64::NAN; 3]);
    for threads in [Threads::ONE, Threads::new(2)] {
        let distances = Field::mesh_distances(view(&mesh), &points, None, threads).unwrap();
        assert!(distances[..600] == expected && distances[600].is_nan());
    }
    assert!(Field::mesh_distances(MeshView { points: &[], faces: &[] }, &points, None, Threads::ONE).is_err());
}

#[test]
fn contacts_one_after_the_other_are_those_at_once() {
    let sheet =
        Sheet { cells: [130; 2], size: [1.0; 2], height: 0.5, bend: 0.1, floor: -1.0, holes: None, faces: None };
    let (mesh, field) = (sheet.mesh(), sphere(0.5));
    assert!(mesh.triangles.len() > 1 << 15, "more than one block");
    for elements in [Elements::Faces, Elements::Vertices] {
        let options =
            ContactOptions { elements, margin: 0.05, method: Method::FrankWolfe, ..ContactOptions::default() };
        let expected = field.contacts(view(&mesh), &options).unwrap().contacts;
        let mut found = vec![];
        let visit = |contact: &_| {
            found.push(*contact);
            ControlFlow::Continue(())
        };
        assert!(field.visit_contacts(view(&mesh), &options, visit).unwrap().is_continue());
        assert!(expected.len() > 1000 && found == expected, "{elements:?}");
        let mut count = 0;
        let stop = |_: &_| {
            count += 1;
            if count == 10 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        assert!(field.visit_contacts(view(&mesh), &options, stop).unwrap().is_break());
        assert_eq!(count, 10);
    }
}

#[test]
fn a_row_has_what_its_contact_has() {
    let mesh = BALL.mesh();
    for elements in [Elements::Faces, Elements::Edges, Elements::Vertices] {
        let options = ContactOptions { elements, margin: 0.1, ..ContactOptions::default() };
        let found = sphere(0.7).contacts(view(&mesh), &options).unwrap().contacts;
        assert!(found.len() > 10);
        for contact in &found {
            let row = ContactRow::from(contact);
            let (feature, id) = match contact.feature {
                Feature::Vertex(vertex) => ("vertex", [vertex, u32::MAX]),
                Feature::Edge(ends) => ("edge", ends),
                Feature::Face(face) => ("face", [face, u32::MAX]),
            };
            let name = |names: &[&'static str], code: u8| names[usize::from(code)];
            assert_eq!((name(ContactRow::ELEMENT_NAMES, row.feature), row.feature_id), (feature, id));
            let is_converged = name(ContactRow::STATUS_NAMES, row.status) == "converged";
            assert_eq!(is_converged, contact.status == ContactStatus::Converged);
            assert_eq!((row.id, row.vertices, row.key), (contact.element, contact.vertices, contact.key()));
            assert_eq!((row.distance, row.point), (contact.distance, contact.point.into()));
        }
    }
}

#[test]
fn a_margin_beyond_the_grid_is_refused() {
    let options = BakeOptions { size: GridSize::Cells(32), layout: Layout::Sparse, ..BakeOptions::default() };
    let baked = Field::bake(view(&BALL.mesh()), &options).unwrap().field;
    let info = baked.info().unwrap();
    let limit = info.max_margin();
    let band = info.band.unwrap();
    assert!(limit > 0.0 && [limit, 0.0, -band].into_iter().all(|margin| info.check_margin(margin).is_ok()));
    for (margin, limit, remedy) in [(limit * 1.001, limit, "more padding"), (-band * 1.001, band, "wider band")] {
        let error = info.check_margin(margin).unwrap_err().to_string();
        assert!(error.contains(remedy) && error.contains(&limit.to_string()), "{error}");
    }
    assert!(info.check_margin(f64::NAN).is_err());
    // Complete and exact searches grant the error of what is deeper.
    let complete = ContactOptions { margin: -1.0, complete: true, ..ContactOptions::default() };
    assert!(info.check_margin(complete.margin_to_check()).is_ok());
    let dense = Field::bake(view(&BALL.mesh()), &BakeOptions { layout: Layout::Dense, ..options }).unwrap().field;
    assert!(dense.info().unwrap().check_margin(-1.0).is_ok());
}

#[test]
fn edges_are_those_that_the_program_finds_in_a_file() {
    let mesh = BALL.mesh();
    let points = mesh.points.iter().map(|[x, y, z]| format!("v {x:?} {y:?} {z:?}\n"));
    let faces = mesh.triangles.iter().map(|corners| {
        let [a, b, c] = corners.map(|corner| corner + 1);
        format!("f {a} {b} {c}\n")
    });
    let text: String = points.chain(faces).collect();
    let file = sdf_formats::mesh::read_bytes(text.as_bytes(), "ball.obj").unwrap();
    assert_eq!(view(&mesh).edges(), file.edges());
    assert_eq!(view(&mesh).edges().len(), mesh.triangles.len() * 3 / 2);
}

/// Two methods may keep different faces of one feature: neither has missed it.
#[test]
fn methods_are_compared_face_by_face_also_where_one_contact_for_each_feature_is_asked_for() {
    let torus = Field::new(Torus::new(1.0, 0.3).unwrap());
    let points: Vec<[f64; 3]> =
        (0..225).map(|id| [f64::from(id % 15) * 0.2 - 1.4, f64::from(id / 15) * 0.2 - 1.4, 0.25]).collect();
    let corners = (0..196).map(|id| id % 14 + id / 14 * 15);
    let faces: Vec<[u32; 3]> = corners.flat_map(|a| [[a, a + 1, a + 16], [a + 16, a + 15, a]]).collect();
    let counts = |one_per_feature| {
        let options = ContactOptions { one_per_feature, margin: 0.01, ..ContactOptions::default() };
        let compared = torus.compare(MeshView { points: &points, faces: &faces }, &options, 1, &|_| ()).unwrap();
        let counts: Vec<_> =
            compared.methods.iter().map(|report| (report.method, report.contacts, report.missed)).collect();
        (compared.contacts, counts)
    };
    assert_eq!(counts(true), counts(false));
    assert!(counts(false).0 > 50);
}
