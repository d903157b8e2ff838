//! A rigid body that few contacts hold rests as one that all hold.

use sdf_core::nalgebra::Matrix3;
use sdf_core::shapes::HalfSpace;
use sdf_field::Field;
use sdf_sim::{Body, Carrier, Contacts, Motion, Obstacle, Query, Surface};

use crate::{V3, falling};

/// Half of the plate's sides.
const HALF: f64 = 0.5;
const THICKNESS: f64 = 1e-3;

/// A plate of 2 · 20² faces falls on the ground, a little tilted. Its body after a unit of time, the most rows of a frame, and the largest
/// shortfall.
fn fall(reduce: Option<usize>) -> (Body, usize, f64) {
    let mut world = falling();
    let inertia = Matrix3::from_diagonal(&V3::new(HALF * HALF / 3.0, HALF * HALF / 3.0, 2.0 * HALF * HALF / 3.0));
    let body = Body {
        position: V3::new(0.0, 0.0, 0.02),
        rotation: sdf_core::nalgebra::UnitQuaternion::from_scaled_axis(V3::new(0.01, 0.02, 0.3)),
        inv_mass: 1.0,
        inertia,
        inv_inertia: inertia.try_inverse().unwrap(),
        ..Body::fixed()
    };
    let id = world.add_body(body);
    let at = |n: u32| HALF * (f64::from(n) / 10.0 - 1.0);
    let points: Vec<[f64; 3]> = (0..441).map(|k| [at(k % 21), at(k / 21), 0.0]).collect();
    let corners = (0..400).map(|k| k % 20 + k / 20 * 21);
    let faces: Vec<[u32; 3]> = corners.flat_map(|a| [[a, a + 1, a + 22], [a + 22, a + 21, a]]).collect();
    let surface = Surface::of_faces(faces, points.len(), Carrier::Body { id, points: points.into() });
    let ground = Field::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap());
    let query = Query { thickness: THICKNESS, reduce, ..Query::default() };
    let (mut contacts, mut most, mut shortfall) = (Contacts::default(), 0, 0.0_f64);
    for _ in 0..60 {
        contacts.clear();
        query.find(&ground as &dyn Obstacle, &surface, &world, &Motion::of(&world, 1.0 / 60.0), &mut contacts).unwrap();
        most = most.max(contacts.contacts.len());
        shortfall = shortfall.max(contacts.shortfall);
        for _ in 0..10 {
            world.step(1.0 / 600.0, contacts.rows());
        }
    }
    (world.bodies[id as usize].clone(), most, shortfall)
}

#[test]
fn a_plate_that_few_contacts_hold_rests_as_one_that_all_hold() {
    let (all, rows, none) = fall(None);
    let (few, few_rows, shortfall) = fall(Some(8));
    assert!(rows > 400 && few_rows <= 8 && none == 0.0, "{rows} rows, {few_rows} of 8, {none}");
    for body in [&all, &few] {
        // It lies flat, at the thickness.
        let tilt = (body.rotation * V3::z()).z.acos();
        assert!((body.position.z - THICKNESS).abs() < 2e-5 && tilt < 1e-4, "{} and {tilt}", body.position);
        assert!(body.velocity.norm() < 1e-2, "{}", body.velocity);
    }
    // What was left out in the worst frame sinks by less than a tenth of what the plate fell in it.
    assert!(shortfall < 0.1 * 0.02, "{shortfall}");
}
