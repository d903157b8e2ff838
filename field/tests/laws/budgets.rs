//! Budgets as programs give them: what a contact counts is no more than its options allow, of any method on any element.

use std::collections::BTreeSet;

use sdf_field::core::grid::owned::Layout;
use sdf_field::core::shapes::{Sphere, Torus};
use sdf_field::{BakeOptions, ContactOptions, Elements, Field, GridSize, MeshView, Method};
use sdf_procedural::Sheet;

fn baked(layout: Layout) -> Field {
    let body =
        Sheet { cells: [6; 2], size: [1.6; 2], height: 0.4, bend: 0.3, floor: -1.0, holes: None, faces: None }.mesh();
    let options = BakeOptions { size: GridSize::Cells(24), layout, ..BakeOptions::default() };
    Field::bake(MeshView { points: &body.points, faces: &body.triangles }, &options).unwrap().field
}

/// Evaluations that a method promises within a budget, on an element of so many corners.
fn allowed(method: Method, budget: u32, corners: u32) -> u32 {
    match method {
        Method::Auto | Method::Certified => budget.max(1),
        Method::Sampling(points) => points.max(1),
        Method::SamplingWithCorners(points) => points + corners,
        // Two probes before the first step.
        Method::GoldenSection => budget + corners + 2,
        _ => budget + corners,
    }
}

#[test]
fn no_contact_counts_more_evaluations_than_its_budget() {
    let mesh =
        Sheet { cells: [9; 2], size: [1.8; 2], height: 0.9, bend: 0.6, floor: -1.0, holes: None, faces: None }.mesh();
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let ball = || Field::new(Sphere::new(0.9).unwrap());
    let ring = || Field::new(Torus::new(0.7, 0.3).unwrap());
    let fields = [
        ("ball", ball()),
        ("ring", ring()),
        ("union", Field::union(&[ball(), ring()]).unwrap()),
        ("dense grid", baked(Layout::Dense)),
        ("sparse grid", baked(Layout::Sparse)),
    ];
    let kinds = [(Elements::Faces, 3), (Elements::Edges, 2), (Elements::Vertices, 1)];
    let mut seen = 0;
    for (name, field) in &fields {
        for (elements, corners) in kinds {
            for method in Method::ALL {
                if method == Method::GoldenSection && elements != Elements::Edges {
                    continue;
                }
                for budget in [0, 1, 2, 3, 5, 13, 32] {
                    let options =
                        ContactOptions { elements, method, budget: Some(budget), margin: 0.1, ..Default::default() };
                    let most = allowed(method, budget, corners);
                    for contact in field.contacts(view, &options).unwrap().contacts {
                        let case = || format!("{name}, {method} within {budget} on {elements:?}: {contact:?}");
                        assert!((1..=most).contains(&contact.evaluations), "more than {most}: {}", case());
                        seen += 1;
                    }
                }
            }
        }
    }
    assert!(seen > 10_000, "{seen}");
}

/// No element within the margin is missed without a word: what a spent budget leaves open is counted, or listed by a complete search.
#[test]
fn elements_that_a_budget_leaves_open_are_counted() {
    let mesh =
        Sheet { cells: [9; 2], size: [1.8; 2], height: 0.9, bend: 0.6, floor: -1.0, holes: None, faces: None }.mesh();
    let view = MeshView { points: &mesh.points, faces: &mesh.triangles };
    let ring = Field::new(Torus::new(0.7, 0.3).unwrap());
    let both = Field::union(&[Field::new(Sphere::new(0.9).unwrap()), ring.clone()]).unwrap();
    let fields = [("ring", ring), ("union", both), ("sparse grid", baked(Layout::Sparse))];
    let mut missed = 0;
    for ((name, field), method) in fields
        .iter()
        .flat_map(|field| [Method::Auto, Method::Certified, Method::FrankWolfe].map(|method| (field, method)))
    {
        let options = |budget| ContactOptions { method, budget: Some(budget), margin: 0.05, ..Default::default() };
        let touching = |budget, complete| {
            let found = field.contacts(view, &ContactOptions { complete, ..options(budget) }).unwrap();
            (found.contacts.iter().map(|contact| contact.element).collect::<BTreeSet<_>>(), found.undecided_count)
        };
        let (all, left) = touching(1 << 14, false);
        assert_eq!(left, 0, "{name}, {method}");
        for budget in [0, 1, 2, 3, 5, 8, 13] {
            let (some, undecided) = touching(budget, false);
            let absent = all.difference(&some).count();
            if method == Method::FrankWolfe {
                assert_eq!(undecided, 0, "{name}, {method}");
                continue;
            }
            assert!(absent <= undecided, "{name}, {method} within {budget}: {absent} missed, {undecided} undecided");
            let (listed, undecided) = touching(budget, true);
            assert!(undecided == 0 && all.is_subset(&listed), "{name}, {method} within {budget}, complete");
            missed += absent;
        }
    }
    assert!(missed > 10, "{missed}");
}
