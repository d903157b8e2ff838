//! Lean contacts: those of the full search without smooth normals and error bounds, whatever the field, the elements and the method.

use sdf_field::core::contact::{Contact, ContactStatus, Element, Outcome, lean_contact};
use sdf_field::core::grid::PlainNormals;
use sdf_field::core::grid::owned::{Layout, Precision};
use sdf_field::core::minimize::{FrankWolfe, Minimizer, Newton, PointSampling, ProjectedGradient};
use sdf_field::core::nalgebra::Vector3;
use sdf_field::core::placed::{Posed, Rigid};
use sdf_field::core::shapes::{Sphere, Torus};
use sdf_field::core::{AnyField, Sdf, Simplex};
use sdf_field::{
    BakeOptions, ContactOptions, Elements, Field, GridSize, MeshInMotion, MeshView, Method, QueryError, Threads,
};
use sdf_procedural::{Mesh, Sheet, SpikedBall};

fn sheet(cells: u32) -> Mesh {
    Sheet { cells: [cells; 2], size: [1.8; 2], height: 0.5, bend: 0.4, floor: -1.0, holes: None, faces: None }.mesh()
}

fn view(mesh: &Mesh) -> MeshView<'_> {
    MeshView { points: &mesh.points, faces: &mesh.triangles }
}

fn baked(layout: Layout, precision: Option<Precision>) -> Field {
    let body = SpikedBall { levels: 2, radius: 0.5 }.mesh();
    let options = BakeOptions { size: GridSize::Cells(24), layout, precision, ..BakeOptions::default() };
    Field::bake(view(&body), &options).unwrap().field
}

/// Fields by name, and whether their smooth gradient is another than ∇φ.
fn fields() -> Vec<(&'static str, bool, Field)> {
    let parts = [Field::new(Sphere::new(0.6).unwrap()), Field::new(Torus::new(0.7, 0.2).unwrap())];
    vec![
        ("union", false, Field::union(&parts).unwrap()),
        ("dense", true, baked(Layout::Dense, None)),
        ("dense of u16", true, baked(Layout::Dense, Some(Precision::U16))),
        ("sparse", true, baked(Layout::Sparse, None)),
    ]
}

fn poses() -> [Option<Rigid>; 2] {
    [None, Rigid::new([0.1, -0.05, 0.2], [0.1, 0.2, -0.3, 0.9])]
}

/// Every number of a contact, in digits that tell all f64 apart.
fn bits(contact: &Contact<f64>) -> String {
    format!("{contact:?}")
}

/// A full contact with what a lean one does not have taken from that.
fn stripped(full: &Contact<f64>, lean: &Contact<f64>) -> Contact<f64> {
    let Contact { normal, slope, surface_point, .. } = *lean;
    let is_degenerate = |contact: &Contact<f64>| contact.status == ContactStatus::DegenerateGradient;
    let status = if is_degenerate(full) || is_degenerate(lean) { lean.status } else { full.status };
    let (error_bound, shape_lower_bound) = (f64::INFINITY, f64::NEG_INFINITY);
    Contact { normal, slope, surface_point, status, error_bound, shape_lower_bound, ..*full }
}

#[test]
fn a_lean_contact_is_the_full_one_without_smooth_normals_and_error_bounds() {
    let mesh = sheet(12);
    for (name, is_smoothed, field) in fields() {
        let (mut seen, mut turned) = (0, 0);
        for (elements, pose) in
            [Elements::Faces, Elements::Edges, Elements::Vertices].into_iter().zip(poses().repeat(2))
        {
            for method in Method::ALL {
                if method == Method::GoldenSection && elements != Elements::Edges {
                    continue;
                }
                let full = ContactOptions { elements, method, pose, margin: 0.05, ..Default::default() };
                let options = ContactOptions { lean: true, ..full };
                let (lean, full) = (field.contacts(view(&mesh), &options), field.contacts(view(&mesh), &full));
                let (lean, full) = (lean.unwrap(), full.unwrap());
                let what = format!("{name}, {elements:?} by {method}");
                assert_eq!(lean.contacts.len(), full.contacts.len(), "{what}");
                assert_eq!(lean.searched_count, full.searched_count, "{what}");
                for (lean, full) in lean.contacts.iter().zip(&full.contacts) {
                    assert_eq!(bits(lean), bits(&stripped(full, lean)), "{what}");
                    seen += 1;
                    turned += usize::from(lean.normal != full.normal);
                }
                for threads in [Threads::ONE, Threads::new(3)] {
                    let again = field.contacts(view(&mesh), &ContactOptions { threads, ..options }).unwrap();
                    assert!(again.contacts.iter().map(bits).eq(lean.contacts.iter().map(bits)), "{what}");
                }
                if elements == Elements::Faces {
                    let in_motion = field.contacts_in_motion(&MeshInMotion::new(view(&mesh)), &options).unwrap();
                    assert!(in_motion.contacts.iter().map(bits).eq(lean.contacts.iter().map(bits)), "{what}");
                }
            }
        }
        assert!(seen > 1000, "{name}: {seen}");
        assert_eq!(turned > seen / 2, is_smoothed, "{name}: {turned} of {seen} normals are others");
    }
}

/// The contacts of the core's `lean_contact`, one element at a time.
fn one_at_a_time<M: Minimizer<N>, const N: usize>(
    field: &AnyField,
    pose: Option<Rigid>,
    margin: f64,
    points: &[[f64; 3]],
    elements: &[[u32; N]],
    method: &M,
) -> Vec<Contact<f64>> {
    let field = PlainNormals(Posed { field, pose });
    let corners = |vertices: &[u32; N]| vertices.map(|vertex| Vector3::from(points[vertex as usize]));
    let find = |(id, vertices): (u32, &[u32; N])| {
        let element = Element { id, vertices: *vertices, simplex: Simplex { corners: corners(vertices) } };
        match lean_contact(&field, method, margin, &element) {
            Outcome::Contact(contact) => Some(contact),
            _ => None,
        }
    };
    (0..).zip(elements).filter_map(find).collect()
}

#[test]
fn lean_contacts_in_lanes_are_those_of_one_at_a_time_bit_for_bit() {
    let (mesh, margin, mut seen) = (sheet(12), 0.05, 0);
    for (name, _, field) in fields() {
        for pose in poses() {
            let mut check = |elements, method, expected: Vec<Contact<f64>>| {
                let options = ContactOptions { elements, method, pose, margin, lean: true, ..Default::default() };
                let found = field.contacts(view(&mesh), &options).unwrap().contacts;
                assert_eq!(found.len(), expected.len(), "{name}, {elements:?} by {method}");
                for (found, expected) in found.iter().zip(&expected) {
                    // Here boxes cull too, and their bounds are higher.
                    assert!(found.lower_bound >= expected.lower_bound && found.lower_bound <= found.distance);
                    let expected = Contact { lower_bound: found.lower_bound, ..*expected };
                    assert_eq!(bits(found), bits(&expected), "{name}, {elements:?} by {method}");
                    seen += 1;
                }
            };
            let (points, faces, edges) = (&mesh.points[..], &mesh.triangles[..], view(&mesh).edges());
            let samples = PointSampling { samples: 16, corners: false };
            let any = field.as_any();
            let steps = FrankWolfe::default();
            check(Elements::Faces, Method::FrankWolfe, one_at_a_time(any, pose, margin, points, faces, &steps));
            check(Elements::Edges, Method::FrankWolfe, one_at_a_time(any, pose, margin, points, &edges, &steps));
            let steps = ProjectedGradient::default();
            check(Elements::Faces, Method::ProjectedGradient, one_at_a_time(any, pose, margin, points, faces, &steps));
            let steps = Newton::default();
            check(Elements::Faces, Method::Newton, one_at_a_time(any, pose, margin, points, faces, &steps));
            check(Elements::Faces, Method::Sampling(16), one_at_a_time(any, pose, margin, points, faces, &samples));
            check(Elements::Edges, Method::Sampling(16), one_at_a_time(any, pose, margin, points, &edges, &samples));
        }
    }
    assert!(seen > 1000, "{seen}");
}

/// Without a pose the normal is that of φ itself, and the surface point one step along it.
#[test]
fn a_lean_normal_is_the_gradient_of_the_value() {
    let mesh = sheet(30);
    for (name, _, field) in fields() {
        let options = ContactOptions { margin: 0.05, lean: true, ..ContactOptions::fast() };
        for contact in field.contacts(view(&mesh), &options).unwrap().contacts {
            if contact.status == ContactStatus::DegenerateGradient {
                continue;
            }
            let gradient = field.as_any().evaluate(contact.point).gradient;
            assert!((contact.normal * contact.slope - gradient).norm() < 1e-9, "{name}: {contact:?}, but {gradient:?}");
            let way = (contact.point - contact.surface_point).norm();
            assert!(way <= 2.0 * contact.distance.abs() + 1e-12, "{name}: {contact:?}");
        }
    }
}

#[test]
fn what_lean_contacts_leave_out_cannot_be_asked_for() {
    let mesh = sheet(2);
    let lean = ContactOptions { lean: true, ..Default::default() };
    let refused = [
        ContactOptions { all_minima: true, ..lean },
        ContactOptions { complete: true, ..lean },
        ContactOptions { exact: true, ..lean },
    ];
    let body = SpikedBall { levels: 1, radius: 0.5 }.mesh();
    let keeping = BakeOptions { size: GridSize::Cells(8), keep_mesh: true, ..BakeOptions::default() };
    for field in [Field::new(Sphere::new(0.5).unwrap()), Field::bake(view(&body), &keeping).unwrap().field] {
        for options in refused {
            let error = QueryError::LeanLeavesOut;
            for elements in [Elements::Faces, Elements::Edges, Elements::Vertices] {
                let options = ContactOptions { elements, ..options };
                assert_eq!(field.contacts(view(&mesh), &options).unwrap_err(), error);
                let visit = |_: &Contact<f64>| std::ops::ControlFlow::Continue(());
                assert_eq!(field.visit_contacts(view(&mesh), &options, visit).unwrap_err(), error);
            }
            let in_motion = field.contacts_in_motion(&MeshInMotion::new(view(&mesh)), &options);
            assert_eq!(in_motion.unwrap_err(), error);
        }
    }
}
