//! One triangle against a closed form: where is it deepest, and is that proven?

use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::minimize::Certified;
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::Cone;
use sdf_core::{Sdf, Simplex};

pub fn main() {
    // A spike: its apex is at the origin, its axis is z.
    let spike = Cone::new(0.2, 1.0).expect("0 < half angle < π/2, height > 0");
    // It pokes through the middle of a triangle whose corners are all outside.
    let corners = [[-1.0, -1.0, -0.1], [1.0, -1.0, -0.1], [0.0, 1.0, -0.1]].map(Vector3::<f64>::from);
    let outside = corners.map(|corner| spike.value(corner));
    println!("φ at the corners:  {outside:.3?}");

    let element = Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } };
    let margin = 0.0;
    let outcome = contact(&spike, &Certified::default(), margin, &element);
    let Outcome::Contact(found) = outcome else { panic!("no contact: {outcome:?}") };

    println!("φ at the deepest:  {:.6} at {:.4?}", found.distance, found.point.as_slice());
    println!("proven:            no point of the triangle is below {:.6}", found.lower_bound);
    println!("status:            {:?} after {} evaluations", found.status, found.evaluations);

    // On the axis, 0.1 below the apex, the side is 0.1 · sin(0.2) away.
    assert!((found.distance + 0.1 * 0.2_f64.sin()).abs() < 1e-3);
    assert!(found.lower_bound <= found.distance && outside.iter().all(|value| *value > 0.5));
}
