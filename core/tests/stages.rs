//! The stages of a contact, called one by one as a GPU does: are they those of `contact`?

use sdf_core::Simplex;
use sdf_core::contact::{Element, Outcome, contact, contact_at, cull, lean_contact};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::{Cuboid, Torus};

const MARGIN: f32 = 0.05;

#[test]
fn cull_search_and_report_one_after_the_other_make_the_contact_of_one_call() {
    let (field, method) = (Torus::new(0.8, 0.2).unwrap(), FrankWolfe::default());
    let at = |step: u32, stride: f32| (step as f32 * stride).fract() * 2.0 - 1.0;
    let (mut contacts, mut culled) = (0, 0);
    for id in 0..2000 {
        let corner = |k| {
            let step = 3 * id + k;
            Vector3::new(at(id, 0.618_034), at(id, 0.754_878), at(id, 0.569_840))
                + Vector3::new(at(step, 0.381_966), at(step, 0.245_122), at(step, 0.430_160)) * 0.3
        };
        let simplex = Simplex { corners: [corner(0), corner(1), corner(2)] };
        let element = Element { id, vertices: [3 * id, 3 * id + 1, 3 * id + 2], simplex };
        let by_stages = match cull(&field, MARGIN, &element) {
            Err(outcome) => outcome,
            Ok(lower_bound) => {
                let minimum = method.minimize_below(&field, &simplex, MARGIN);
                if MARGIN < minimum.sample.value {
                    Outcome::Separated(minimum)
                } else {
                    Outcome::Contact(contact_at(&field, &element, &minimum, lower_bound).unwrap())
                }
            }
        };
        assert_eq!(by_stages, contact(&field, &method, MARGIN, &element));
        contacts += u32::from(matches!(by_stages, Outcome::Contact(_)));
        culled += u32::from(by_stages == Outcome::Culled);
    }
    assert!(contacts > 100 && culled > 100, "{contacts} contacts, {culled} culled");
}

/// Squares of such lengths are zero in single precision.
#[test]
fn nothing_is_culled_of_a_body_that_is_too_small_for_squares() {
    for exponent in 0..=28 {
        let unit = 10.0_f64.powi(-exponent);
        let field = Cuboid::new([unit; 3]).unwrap();
        let corners = [[0.5, 0.0, 0.0], [1.5, 0.0, 0.0], [1.5, 0.5, 0.0]];
        let corners = corners.map(|corner| Vector3::from(corner.map(|x: f64| (x * unit) as f32)));
        let element = Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } };
        for outcome in [
            contact(&field, &FrankWolfe::default(), 0.0, &element),
            contact(&field, &Certified::default(), 0.0, &element),
            lean_contact(&field, &FrankWolfe::default(), 0.0, &element),
        ] {
            let Outcome::Contact(contact) = outcome else { panic!("in units of {unit}: {outcome:?}") };
            assert!(contact.distance < 0.0 && contact.lower_bound <= -0.5 * unit as f32, "{contact:?}");
        }
    }
}
