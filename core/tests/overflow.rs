//! Fields whose values overflow in a part of an element: is what a search says of the element true all the same?

use sdf_core::Simplex;
use sdf_core::combine::{SmoothUnion, Union};
use sdf_core::contact::{Element, all_contacts};
use sdf_core::minimize::{AllMinima, Certified, Minimizer, Minimum, SimplexCell};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placed, Stretch};
use sdf_core::shapes::{RoundedBox, Sphere};

type Overflowing = Placed<SmoothUnion<Sphere, RoundedBox>, Stretch>;

/// Squares of the segment's ends overflow in the frame of the shapes, and a smooth union takes ∞ from ∞. Its middle has a value.
fn overflowing() -> (Overflowing, Simplex<f64, 2>) {
    let shapes =
        SmoothUnion::new(Sphere::new(1e-51).unwrap(), RoundedBox::new([0.6, 0.9, 0.6], 0.9).unwrap(), 0.6).unwrap();
    let field = Placed { field: shapes, placement: Stretch::new([8e-278, 1e-8, -1.0]).unwrap() };
    (field, Simplex { corners: [Vector3::new(-1.0, -1.0, 0.4), Vector3::new(1.0, 0.8, -0.9)] })
}

/// Found by fuzzing: the lower bound was NaN.
#[test]
fn a_certified_search_proves_nothing_where_a_corner_has_no_value() {
    let (field, simplex) = overflowing();
    let twice = Union(field, field);
    for evaluations in 0..80 {
        let search = Certified { evaluations, ..Certified::default() };
        for minimum in [search.minimize(&field, &simplex), search.minimize(&twice, &simplex)] {
            assert_eq!(
                (minimum.lower_bound, minimum.converged),
                (f64::NEG_INFINITY, false),
                "{evaluations}: {minimum:?}"
            );
        }
    }
}

/// Found by fuzzing: the lower bound was NaN.
#[test]
fn contacts_of_all_minima_have_bounds_where_a_corner_has_no_value() {
    let (field, simplex) = overflowing();
    let element = Element { id: 0, vertices: [0, 1], simplex };
    let search = AllMinima {
        search: Certified { evaluations: 64, ..Certified::default() },
        max_cells: 256,
        ..AllMinima::default()
    };
    let (mut cells, mut minima) = (vec![SimplexCell::default(); 256], vec![Minimum::default(); 16]);
    let mut count = 0;
    all_contacts(&field, &search, 3.0, &element, &mut cells, &mut minima, |found| {
        count += 1;
        assert!(found.lower_bound <= found.distance, "{found:?}");
        assert!(found.shape_lower_bound <= found.lower_bound, "{found:?}");
    });
    let summary = search.minima(&field, &element.simplex, 3.0, &mut cells, &mut minima);
    assert!(count > 0 && summary.lower_bound == f64::NEG_INFINITY && !summary.is_complete, "{summary:?}");
}
