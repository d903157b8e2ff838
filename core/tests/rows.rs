//! Rows of contacts: is the constraint of a [`Row`] what its header says, for every side that can carry a point?

use sdf_core::Simplex;
use sdf_core::contact::{Contact, Element, NO_VERTEX, Outcome, Row, RowSide, TetPoint, contact};
use sdf_core::minimize::FrankWolfe;
use sdf_core::nalgebra::Vector3;
use sdf_core::shapes::{HalfSpace, Sphere};

/// A face above a ball whose nearest point is inside of it.
fn touching_face() -> Contact<f64> {
    let corners = [Vector3::new(-1.0, -1.0, 1.2), Vector3::new(1.5, -1.0, 1.1), Vector3::new(0.25, 1.5, 1.3)];
    let element = Element { id: 4, vertices: [10, 20, 30], simplex: Simplex { corners } };
    match contact(&Sphere::new(1.0).unwrap(), &FrankWolfe::default(), 0.5, &element) {
        Outcome::Contact(contact) => contact,
        other => panic!("{other:?}"),
    }
}

fn shares(side: &RowSide<f64>, tets: &[[u32; 4]]) -> Vec<(u32, f64)> {
    let mut all = vec![];
    side.visit_particles(tets, |index, weight| all.push((index, weight)));
    all
}

#[test]
fn a_rows_gap_is_the_way_to_the_surface_less_the_thickness() {
    let contact = touching_face();
    let row = Row::from_contact(&contact, 0.03).unwrap();
    assert!((row.gap - (contact.distance - 0.03)).abs() < 1e-12, "{} of {}", row.gap, contact.distance);
    assert_eq!(row.gap_at(row.point, row.surface_point), row.gap);
    let step = Vector3::new(0.1, -0.2, 0.3);
    let moved = row.gap_at(row.point + step, row.surface_point);
    assert!((moved - row.gap - row.normal.dot(&step)).abs() < 1e-12);
    assert_eq!(row.key, contact.key());
}

#[test]
fn the_particles_of_a_side_carry_its_point() {
    let contact = touching_face();
    let positions = |index: u32| match index {
        110 => Vector3::new(-1.0, -1.0, 1.2),
        120 => Vector3::new(1.5, -1.0, 1.1),
        130 => Vector3::new(0.25, 1.5, 1.3),
        other => panic!("no particle {other}"),
    };
    let side = RowSide::particles(&contact, 100);
    let carried =
        shares(&side, &[]).iter().fold(Vector3::zeros(), |sum, (index, weight)| sum + positions(*index) * *weight);
    assert!((carried - contact.point).norm() < 1e-12);

    // The same face embedded in two tetrahedra that share particles: the shares of the corners, summed up by particle.
    let tets = [[0, 1, 2, 3], [1, 2, 3, 4]];
    let mut embedding = vec![TetPoint { tet: 0, weights: [0.0; 4] }; 31];
    embedding[10] = TetPoint { tet: 0, weights: [0.1, 0.2, 0.3, 0.4] };
    embedding[20] = TetPoint { tet: 1, weights: [0.25, 0.25, 0.5, 0.0] };
    embedding[30] = TetPoint { tet: 1, weights: [0.0, 0.0, 0.0, 1.0] };
    let side = RowSide::embedded(&contact, &embedding).unwrap();
    let mut totals = [0.0; 5];
    shares(&side, &tets).iter().for_each(|(index, weight)| totals[*index as usize] += weight);
    // Each comes once: the inverse mass at the point is Σ w²/m, and not less.
    assert_eq!(shares(&side, &tets).len(), 5);
    let folded = RowSide::Particles { indices: [4, 7, 4], weights: [0.5, 0.25, 0.25] };
    assert_eq!(shares(&folded, &[]), [(4, 0.75), (7, 0.25)]);
    let [a, b, c] = contact.weights;
    let expected = [0.1 * a, 0.2 * a + 0.25 * b, 0.3 * a + 0.25 * b, 0.4 * a + 0.5 * b, c];
    for (total, expected) in totals.iter().zip(expected) {
        assert!((total - expected).abs() < 1e-15, "{totals:?}, {expected:?}");
    }
    assert_eq!(RowSide::embedded(&contact, &embedding[..30]), None);
    assert_eq!(shares(&RowSide::Tet(embedding[20]), &tets), [(1, 0.25), (2, 0.25), (3, 0.5)]);
    assert_eq!(shares(&RowSide::Tet(TetPoint { tet: 9, weights: [0.25; 4] }), &tets), []);
    assert_eq!(shares(&RowSide::body(0, Vector3::zeros(), contact.point), &tets), []);
}

#[test]
fn an_edge_or_vertex_has_no_particle_beyond_its_own() {
    let ground = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    let simplex = Simplex { corners: [Vector3::new(0.0, 0.0, 0.5), Vector3::new(1.0, 0.0, 0.25)] };
    let element = Element { id: 0, vertices: [u32::MAX - 1, 5], simplex };
    let Outcome::Contact(contact) = contact(&ground, &FrankWolfe::default(), 1.0, &element) else {
        panic!("no contact")
    };
    let RowSide::Particles { indices, weights } = RowSide::particles(&contact, 3) else { panic!("no particles") };
    assert_eq!((indices[1], indices[2], weights[2]), (8, NO_VERTEX, 0.0));
    assert!(shares(&RowSide::particles(&contact, 3), &[]).iter().all(|(index, _)| *index == 8));
}

#[test]
fn tangents_and_normal_are_an_orthonormal_frame() {
    let row = Row::from_contact(&touching_face(), 0.0).unwrap();
    for step in 0..500 {
        let angle = |stride: f64| f64::from(step) * stride;
        let [s, c] = [angle(0.7).sin(), angle(0.7).cos()];
        let z = if step < 2 { 1.0 - 2.0 * f64::from(step) } else { (angle(0.618) % 2.0) - 1.0 };
        let flat = (1.0 - z * z).max(0.0).sqrt();
        let normal = Vector3::new(flat * c, flat * s, z);
        let [t, b] = Row { normal, ..row }.tangents();
        for (product, expected) in
            [(t.dot(&t), 1.0), (b.dot(&b), 1.0), (t.dot(&b), 0.0), (t.dot(&normal), 0.0), (b.dot(&normal), 0.0)]
        {
            assert!((product - expected).abs() < 1e-12, "{normal}");
        }
    }
}

#[test]
fn a_contact_without_a_normal_makes_no_row() {
    let contact = touching_face();
    assert_eq!(Row::from_contact(&Contact { normal: Vector3::zeros(), ..contact }, 0.0), None);
}
