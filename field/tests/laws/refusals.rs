//! Options that a query refuses, whichever way it is asked.

use sdf_field::core::shapes::Sphere;
use sdf_field::{ContactOptions, Elements, Field, MeshInMotion, MeshView, QueryError};

const POINTS: [[f64; 3]; 3] = [[-1.0, -1.0, 0.9], [1.0, -1.0, 0.9], [0.0, 1.0, 0.9]];

fn refused(options: &ContactOptions) -> Vec<Option<QueryError>> {
    let ball = Field::new(Sphere::new(1.0).unwrap());
    let mesh = MeshView { points: &POINTS, faces: &[[0, 1, 2]] };
    let of = |elements| ContactOptions { elements, ..*options };
    vec![
        ball.contacts(mesh, &of(Elements::Faces)).err(),
        ball.contacts(mesh, &of(Elements::Edges)).err(),
        ball.contacts(mesh, &of(Elements::Vertices)).err(),
        ball.contacts_in_motion(&MeshInMotion::new(mesh), options).err(),
        ball.visit_contacts(mesh, options, |_| std::ops::ControlFlow::Continue(())).err(),
    ]
}

#[test]
fn a_margin_or_a_tolerance_that_is_not_a_number_is_refused() {
    for (lean, complete, exact) in
        [(false, false, false), (true, false, false), (false, true, false), (false, false, true)]
    {
        let default = ContactOptions { lean, complete, ..ContactOptions::default() };
        assert!(refused(&default).iter().all(Option::is_none), "lean {lean}, complete {complete}");
        let default = ContactOptions { exact, ..default };
        let errors = refused(&ContactOptions { margin: f64::NAN, ..default });
        assert!(errors.iter().all(|error| *error == Some(QueryError::MarginIsNan)), "{errors:?}");
        for tolerance in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
            let errors = refused(&ContactOptions { tolerance, ..default });
            assert!(
                errors.iter().all(|error| *error == Some(QueryError::ToleranceOutOfRange)),
                "{tolerance}: {errors:?}"
            );
        }
    }
}

#[test]
fn a_margin_that_is_nan_is_called_that() {
    let error = Field::new(Sphere::new(1.0).unwrap()).check_margin(f64::NAN).unwrap_err();
    assert_eq!(error.to_string(), "the margin is NaN: give a length");
}

#[test]
fn an_infinite_margin_finds_all_elements() {
    let ball = Field::new(Sphere::new(1.0).unwrap());
    let options = ContactOptions { margin: f64::INFINITY, elements: Elements::Vertices, ..ContactOptions::default() };
    let points = [[0.0; 3], [5.0, 0.0, 0.0], [0.0, 0.0, -1e9]];
    assert_eq!(ball.contacts(MeshView { points: &points, faces: &[] }, &options).unwrap().contacts.len(), 3);
}
