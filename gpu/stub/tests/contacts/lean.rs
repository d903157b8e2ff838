//! Lean contacts of `sdf-field` on a card: those of the core's `lean_contact::<f32, …>`, bit for bit, and a word where the card has none.

use sdf_core::contact::Contact;
use sdf_core::minimize::{FrankWolfe, PointSampling, ProjectedGradient};
use sdf_field::cuda::{Cuda, CudaError};
use sdf_field::{ContactOptions, Elements, Field, MeshView, Method, QueryError};
use sdf_gpu::GpuError;

use crate::scenes::{Scene, assert_equal, scenes};
use crate::with_stub;

/// A contact of the card as it was there: weights alone are other numbers in f64.
fn narrowed(contact: &Contact<f64>, expected: &Contact<f32>) -> Contact<f32> {
    let off = contact.weights.iter().zip(expected.weights).map(|(weight, known)| (weight - f64::from(known)).abs());
    assert!(off.fold(0.0, f64::max) < 1e-6, "{contact:?} in place of {expected:?}");
    Contact {
        kind: contact.kind,
        element: contact.element,
        vertices: contact.vertices,
        rank: contact.rank,
        feature: contact.feature,
        weights: expected.weights,
        point: contact.point.map(|x| x as f32),
        surface_point: contact.surface_point.map(|x| x as f32),
        normal: contact.normal.map(|x| x as f32),
        slope: contact.slope as f32,
        distance: contact.distance as f32,
        lower_bound: contact.lower_bound as f32,
        error_bound: contact.error_bound as f32,
        shape_lower_bound: contact.shape_lower_bound as f32,
        evaluations: contact.evaluations,
        status: contact.status,
    }
}

fn expected(scene: &Scene, elements: Elements, method: Method) -> (Vec<Contact<f32>>, u32) {
    match (elements, method) {
        (Elements::Vertices, _) => {
            scene.expected_lean(&scene.vertices(), &PointSampling { samples: 1, corners: false })
        }
        (Elements::Edges, Method::ProjectedGradient) => {
            scene.expected_lean(&scene.edges, &ProjectedGradient::default())
        }
        (Elements::Edges, _) => scene.expected_lean(&scene.edges, &FrankWolfe::default()),
        (_, Method::ProjectedGradient) => scene.expected_lean(&scene.faces, &ProjectedGradient::default()),
        _ => scene.expected_lean(&scene.faces, &FrankWolfe::default()),
    }
}

#[test]
fn lean_contacts_of_a_card_are_those_of_the_core_bit_for_bit() {
    with_stub("lean::lean_contacts_of_a_card_are_those_of_the_core_bit_for_bit", &[], |folder| {
        let cuda = Cuda::open(&folder.join("kernels.ptx")).unwrap();
        let mut compared = 0;
        for scene in scenes() {
            let field = Field::new(scene.field.clone());
            let points: Vec<[f64; 3]> = scene.points.iter().map(|point| point.map(f64::from)).collect();
            let mesh = MeshView { points: &points, faces: &scene.faces };
            for (elements, method) in [
                (Elements::Faces, Method::FrankWolfe),
                (Elements::Faces, Method::ProjectedGradient),
                (Elements::Edges, Method::FrankWolfe),
                (Elements::Edges, Method::ProjectedGradient),
                (Elements::Vertices, Method::FrankWolfe),
            ] {
                let what = format!("{} {elements:?} {method}", scene.kind);
                let margin = f64::from(scene.margin);
                let options = ContactOptions { elements, method, margin, lean: true, ..Default::default() };
                let found = match elements {
                    Elements::Edges => field
                        .query_edges_on(&cuda, &points, &scene.edges, &options)
                        .and_then(|mut query| query.contacts()),
                    _ => field.contacts_on(&cuda, mesh, &options),
                };
                let found = match found {
                    Err(CudaError::Card(GpuError::Unsupported(why))) => {
                        assert!(why.contains("lean"), "{what}: {why}");
                        continue;
                    }
                    found => found.unwrap(),
                };
                let (expected, skipped) = expected(&scene, elements, method);
                assert_eq!(found.contacts.len(), expected.len(), "{what}");
                let pairs = found.contacts.iter().zip(&expected);
                let on_card: Vec<_> = pairs.map(|(contact, expected)| narrowed(contact, expected)).collect();
                assert_equal(&on_card, &expected, &what);
                assert_eq!(found.not_finite_count, skipped as usize, "{what}");
                compared += 1;
            }
        }
        // As many as there are lean kernels.
        assert_eq!(compared, 11);
    });
}

#[test]
fn what_lean_contacts_leave_out_is_refused_on_a_card_too() {
    with_stub("lean::what_lean_contacts_leave_out_is_refused_on_a_card_too", &[], |folder| {
        let cuda = Cuda::open(&folder.join("kernels.ptx")).unwrap();
        let scene = crate::scenes::scene("dense");
        let field = Field::new(scene.field.clone());
        let points: Vec<[f64; 3]> = scene.points.iter().map(|point| point.map(f64::from)).collect();
        let mesh = MeshView { points: &points, faces: &scene.faces };
        let lean = ContactOptions { lean: true, ..ContactOptions::fast() };
        let refused = |options: &ContactOptions| field.contacts_on(&cuda, mesh, options).unwrap_err();
        for options in [ContactOptions { complete: true, ..lean }, ContactOptions { all_minima: true, ..lean }] {
            let error = refused(&options);
            assert!(matches!(error, CudaError::Query(QueryError::LeanLeavesOut)), "{error}");
        }
        for method in [Method::Auto, Method::Certified, Method::Newton] {
            let error = refused(&ContactOptions { method, ..lean }).to_string();
            assert!(error.contains("lean contacts by") && error.contains("CPU"), "{error}");
        }
        // Those of other methods are compared.
        let compared = field.compare_on(&cuda, mesh, &ContactOptions { lean: true, ..Default::default() }, 1, &|_| {});
        let methods: Vec<Method> = compared.unwrap().on_card.iter().map(|report| report.method).collect();
        assert_eq!(methods, [Method::FrankWolfe, Method::ProjectedGradient]);
    });
}
