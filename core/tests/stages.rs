//! The stages of a contact, called one by one as a GPU does: are they those of `contact`?

use sdf_core::Simplex;
use sdf_core::contact::{Element, Outcome, contact, contact_at, cull};
use sdf_core::minimize::{FrankWolfe, Minimizer};
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::Torus;

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
