//! Fields in deformed cages: exact by brute force, honest culls, and a status for what is inverted, flat or outside.

use nalgebra::{Matrix3, Vector3};
use sdf_core::cage::{Cage, CageContact, CageMap, CageOutcome, CageSearch, TetStatus, bound_tets};
use sdf_core::contact::{ContactStatus, Element, Outcome, contact};
use sdf_core::minimize::Certified;
use sdf_core::placed::Placed;
use sdf_core::shapes::{Sphere, Torus};
use sdf_core::{EnclosedSdf, Sdf, Simplex};
use sdf_tests::random::Random;

use crate::cage_lattice::{Lattice, with_locator};
use crate::{random_element, random_weights};

type Point = Vector3<f64>;

const SEARCH: Certified = Certified {
    evaluations: 4096,
    tolerance: 1e-7,
    local: sdf_core::minimize::Newton { iterations: 8, tolerance: 1e-9 },
};

fn with_cage<T>(lattice: &Lattice, now: &[[f64; 3]], run: impl FnOnce(&Cage) -> T) -> T {
    with_locator(lattice, &lattice.points, |rest| with_locator(lattice, now, |now| run(&Cage::new(rest, now).unwrap())))
}

/// Bent, twisted and shaken, but with no tetrahedron inside out.
fn deformed(lattice: &Lattice, random: &mut Random) -> Vec<[f64; 3]> {
    let (bend, twist) = (random.between(-0.3, 0.3), random.between(-0.5, 0.5));
    let shakes: Vec<Point> = lattice.points.iter().map(|_| random.in_cube(0.03)).collect();
    let bent = lattice.moved(|p| {
        let (s, c) = (twist * p.z).sin_cos();
        Vector3::new(c * p.x - s * p.y, s * p.x + c * p.y, p.z + bend * p.x * p.x)
    });
    bent.iter().zip(shakes).map(|(point, shake)| (Vector3::from(*point) + shake).into()).collect()
}

fn expect_contact(search: CageSearch) -> CageContact {
    match search.outcome {
        CageOutcome::Contact(contact) => contact,
        other => panic!("expected a contact, found {other:?}"),
    }
}

#[test]
fn a_point_is_found_in_its_tetrahedron_and_comes_back() {
    let mut random = Random::seeded();
    let lattice = Lattice::new(4);
    let now = deformed(&lattice, &mut random);
    with_cage(&lattice, &now, |cage| {
        for _ in 0..2000 {
            let tet = random.below(lattice.tets.len()) as u32;
            let weights: [f64; 4] = random_weights(&mut random);
            let point = cage.now().point(&sdf_core::contact::TetPoint { tet, weights }).unwrap();
            let (material, at) = cage.pull(point).unwrap();
            assert!(at.weights.iter().all(|weight| *weight >= -1e-9), "{at:?}");
            assert!((cage.now().point(&at).unwrap() - point).norm() < 1e-12);
            assert!((cage.push(material).unwrap().0 - point).norm() < 1e-9);
            if weights.iter().all(|weight| *weight > 1e-6) {
                assert_eq!(at.tet, tet);
            }
            let corners = lattice.tets[tet as usize].map(|corner| Vector3::from(lattice.points[corner as usize]));
            let expected: Point = corners.iter().zip(weights).map(|(corner, weight)| corner * weight).sum();
            assert!((material - expected).norm() < 1e-9);
        }
        assert_eq!(cage.pull(Vector3::new(5.0, 0.0, 0.0)), None);
        assert_eq!(cage.pull(Vector3::new(f64::NAN, 0.0, 0.0)), None);
    });
}

/// Values of φ_d at samples of the element's part in the cage.
fn samples<const N: usize>(cage: &Cage, field: &impl Sdf, element: &Element<f64, N>, random: &mut Random) -> Vec<f64> {
    let points = (0..150).map(|_| element.simplex.point(random_weights(random)));
    points.filter_map(|point| cage.pull(point)).map(|(material, _)| field.value(material)).collect()
}

/// The answer but for lower bounds, which a cull's may take the place of.
fn without_bounds(mut search: CageSearch) -> CageSearch {
    if let CageOutcome::Contact(CageContact { contact, .. }) = &mut search.outcome {
        (contact.lower_bound, contact.shape_lower_bound) = (0.0, 0.0);
    }
    search
}

fn check_against_samples<F: EnclosedSdf, const N: usize>(
    cage: &Cage,
    field: &F,
    lower_bounds: &[f64],
    random: &mut Random,
) -> u32 {
    let (margin, mut contacts) = (0.05, 0);
    for id in 0..60 {
        let element: Element<f64, N> = random_element(random, id, 1.2, 0.8);
        let found = cage.contact(field, &SEARCH, margin, &element, lower_bounds, CageMap::Exact);
        let without_cull = cage.contact(field, &SEARCH, margin, &element, &[], CageMap::Exact);
        assert_eq!(without_bounds(found), without_bounds(without_cull), "the cull changes it");
        let lowest = samples(cage, field, &element, random).into_iter().fold(f64::INFINITY, f64::min);
        match found.outcome {
            CageOutcome::Contact(CageContact { contact, surface }) => {
                assert!(contact.distance <= lowest + 1e-6, "{} above a sample, {lowest}", contact.distance);
                // Of the whole element, whichever part is the lowest and however little is searched.
                for (evaluations, bounds) in [(4096, lower_bounds), (7, lower_bounds), (7, &[])] {
                    let search = Certified { evaluations, ..SEARCH };
                    let poor = cage.contact(field, &search, margin, &element, bounds, CageMap::Exact);
                    if let CageOutcome::Contact(CageContact { contact, .. }) = poor.outcome {
                        let lower = contact.lower_bound.max(contact.shape_lower_bound);
                        assert!(lower <= lowest, "{lower} above a sample, {lowest}");
                        let is_told = contact.status != ContactStatus::Converged;
                        assert!(
                            contact.distance <= lowest + 1e-6 || is_told,
                            "{contact:?} is not the lowest, {lowest}"
                        );
                    }
                }
                let weights = contact.corner_weights();
                assert!(
                    (weights.iter().sum::<f64>() - 1.0).abs() < 1e-12 && weights.iter().all(|weight| *weight >= 0.0)
                );
                let (material, _) = cage.pull(contact.point).unwrap();
                assert!((field.value(material) - contact.distance).abs() < 1e-7, "{}", contact.distance);
                assert!((cage.now().point(&surface).unwrap() - contact.surface_point).norm() < 1e-9);
                let row = CageContact { contact, surface }.row(0.0);
                assert!(row.is_none_or(|row| row.gap.is_finite()));
                contacts += 1;
            }
            CageOutcome::Separated => assert!(lowest > margin - 1e-6, "no contact, but a sample of {lowest}"),
            CageOutcome::NotFinite => panic!("not finite"),
        }
        assert_eq!(found.bad_tets, 0);
    }
    contacts
}

#[test]
fn the_exact_contact_is_the_lowest_of_all_points_in_the_cage() {
    let mut random = Random::seeded();
    let lattice = Lattice::new(3);
    let mut contacts = 0;
    for _ in 0..4 {
        let now = deformed(&lattice, &mut random);
        with_cage(&lattice, &now, |cage| {
            let mut check = |field: &dyn sdf_core::DynSdf| {
                let mut bounds = vec![0.0; lattice.tets.len()];
                assert!(bound_tets(&field, cage.rest(), &mut bounds));
                contacts += check_against_samples::<_, 1>(cage, &field, &bounds, &mut random);
                contacts += check_against_samples::<_, 2>(cage, &field, &bounds, &mut random);
                contacts += check_against_samples::<_, 3>(cage, &field, &bounds, &mut random);
            };
            check(&Sphere::new(0.6).unwrap());
            check(&Torus::new(0.5, 0.2).unwrap());
        });
    }
    assert!(contacts > 100, "{contacts}");
}

#[test]
fn a_cage_at_rest_changes_nothing() {
    let mut random = Random::seeded();
    let lattice = Lattice::new(3);
    let field = Torus::new(0.5, 0.2).unwrap();
    with_cage(&lattice, &lattice.points, |cage| {
        assert!((cage.slope_factor() - 1.0).abs() < 1e-12);
        for id in 0..300 {
            let element: Element<f64, 3> = random_element(&mut random, id, 0.6, 0.7);
            for map in [CageMap::Exact, CageMap::Frozen] {
                let found = cage.contact(&field, &SEARCH, 0.05, &element, &[], map);
                assert!(!found.is_uncovered, "{id}");
                match (contact(&field, &SEARCH, 0.05, &element), found.outcome) {
                    (Outcome::Contact(plain), CageOutcome::Contact(CageContact { contact, .. })) => {
                        assert!(
                            (plain.distance - contact.distance).abs() < 1e-6,
                            "{} for {}",
                            contact.distance,
                            plain.distance
                        );
                        // Away from the medial axis the point nearest to the surface is one.
                        if contact.distance > -0.1 {
                            assert!((field.value(contact.surface_point)).abs() < 1e-5);
                        }
                    }
                    (Outcome::Contact(plain), other) => panic!("{plain:?}, {other:?}"),
                    (_, CageOutcome::Contact(found)) => assert!(found.contact.distance > 0.05 - 1e-6, "{found:?}"),
                    _ => {}
                }
            }
        }
    });
}

#[test]
fn the_normal_is_that_of_the_deformed_field_and_the_surface_point_lies_on_it() {
    let mut random = Random::seeded();
    let lattice = Lattice::new(4);
    let field = Sphere::new(0.6).unwrap();
    let mut checked = 0;
    for _ in 0..4 {
        let now = deformed(&lattice, &mut random);
        with_cage(&lattice, &now, |cage| {
            for id in 0..60 {
                let element: Element<f64, 1> = random_element(&mut random, id, 0.8, 0.0);
                let found = cage.contact(&field, &SEARCH, 0.2, &element, &[], CageMap::Exact);
                let CageOutcome::Contact(CageContact { contact, .. }) = found.outcome else { continue };
                let value = |point: Point| cage.pull(point).map(|(material, at)| (field.value(material), at.tet));
                let h = 1e-6;
                let gradient = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| {
                    let [Some(a), Some(b)] = [value(contact.point - axis * h), value(contact.point + axis * h)] else {
                        return f64::NAN;
                    };
                    if a.1 == b.1 { (b.0 - a.0) / (2.0 * h) } else { f64::NAN }
                });
                let (material, _) = cage.pull(contact.surface_point).unwrap();
                assert!(field.value(material).abs() < 1e-9, "{}", field.value(material));
                if gradient.iter().all(|x| x.is_finite()) {
                    let told = contact.normal * contact.slope;
                    assert!((told - Vector3::from(gradient)).norm() < 1e-5, "{told} for {gradient:?}");
                    checked += 1;
                }
            }
        });
    }
    assert!(checked > 50, "{checked}");
}

#[test]
fn a_frozen_map_is_the_field_of_its_tetrahedron_with_an_honest_slope() {
    let mut random = Random::seeded();
    let lattice = Lattice::new(3);
    let field = Torus::new(0.5, 0.2).unwrap();
    let now = deformed(&lattice, &mut random);
    with_cage(&lattice, &now, |cage| {
        let factor = cage.slope_factor();
        for _ in 0..300 {
            let point = random.in_cube(0.7);
            let Some(frozen) = cage.frozen_at(point) else { continue };
            let placed = Placed { field, placement: frozen };
            let (material, at) = cage.pull(point).unwrap();
            assert_eq!(at.tet, frozen.tet());
            assert!((placed.value(point) - field.value(material)).abs() < 1e-12);
            assert!(placed.slope_bound() <= factor * field.slope_bound() * (1.0 + 1e-12));
            let other = point + random.in_cube(0.5);
            let change = (placed.value(point) - placed.value(other)).abs();
            assert!(change <= placed.slope_bound() * (point - other).norm() + 1e-12);
            // Inside of one tetrahedron frozen and exact are the same.
            let corners = [0; 3].map(|_| {
                let weights = random_weights::<4>(&mut random).map(|weight| 0.9 * weight + 0.025);
                cage.now().point(&sdf_core::contact::TetPoint { tet: at.tet, weights }).unwrap()
            });
            let element = Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } };
            let [exact, frozen] = [CageMap::Exact, CageMap::Frozen]
                .map(|map| expect_contact(cage.contact(&field, &SEARCH, 5.0, &element, &[], map)).contact);
            assert!((exact.distance - frozen.distance).abs() < 1e-6, "{} for {}", frozen.distance, exact.distance);
        }
    });
}

#[test]
fn an_affine_cage_is_the_field_under_that_map() {
    let mut random = Random::seeded();
    let lattice = Lattice::new(2);
    let field = Sphere::new(0.6).unwrap();
    let linear = Matrix3::new(1.2, 0.3, 0.0, -0.1, 0.8, 0.2, 0.0, 0.1, 1.5);
    let inverse = linear.try_inverse().unwrap();
    let now = lattice.moved(|point| linear * point);
    with_cage(&lattice, &now, |cage| {
        assert!((cage.slope_factor() - inverse.singular_values().max()).abs() < 1e-12);
        for id in 0..200 {
            let element: Element<f64, 3> = random_element(&mut random, id, 0.8, 0.5);
            let material =
                Element { simplex: Simplex { corners: element.simplex.corners.map(|x| inverse * x) }, ..element };
            let expected = contact(&field, &SEARCH, 0.05, &material);
            let found = cage.contact(&field, &SEARCH, 0.05, &element, &[], CageMap::Exact);
            if let (Outcome::Contact(expected), false) = (expected, found.is_uncovered) {
                let contact = expect_contact(found).contact;
                assert!((contact.distance - expected.distance).abs() < 1e-6);
            }
        }
    });
}

#[test]
fn what_leaves_the_cage_is_told() {
    let lattice = Lattice::new(2);
    let field = Sphere::new(0.6).unwrap();
    with_cage(&lattice, &lattice.points, |cage| {
        let face = |x: f64| {
            let corners = [[x, -0.5, 0.0], [x + 0.8, 0.0, 0.0], [x, 0.5, 0.0]].map(Vector3::from);
            Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } }
        };
        let search = |x: f64, map| cage.contact(&field, &SEARCH, 0.05, &face(x), &[], map);
        assert!(!search(0.1, CageMap::Exact).is_uncovered);
        // Its tip is outside, its centroid inside.
        let half_way = search(0.5, CageMap::Exact);
        assert!(half_way.is_uncovered);
        assert!((expect_contact(half_way).contact.distance - -0.1).abs() < 1e-6);
        // Its centroid is outside, and a part inside: the paper would drop it.
        let mostly_out = cage.contact(&field, &SEARCH, 0.25, &face(0.8), &[], CageMap::Frozen);
        assert!(mostly_out.is_uncovered);
        assert!((expect_contact(mostly_out).contact.distance - 0.2).abs() < 1e-6);
        let outside = search(1.5, CageMap::Exact);
        assert!(outside.is_uncovered && outside.outcome == CageOutcome::Separated);
    });
}

/// Part of the face lies in both of two cubes, and the rest in none.
#[test]
fn a_part_in_two_tetrahedra_covers_nothing_else() {
    let lattice = Lattice::new(1);
    let count = u32::try_from(lattice.points.len()).unwrap();
    let points: Vec<[f64; 3]> = lattice.points.iter().chain(&lattice.points).copied().collect();
    let tets: Vec<[u32; 4]> =
        lattice.tets.iter().copied().chain(lattice.tets.iter().map(|tet| tet.map(|k| k + count))).collect();
    let twice = Lattice { points, tets };
    let field = Sphere::new(0.6).unwrap();
    with_cage(&twice, &twice.points, |cage| {
        for (name, x, is_uncovered) in [("inside", 0.0, false), ("half outside", 0.75, true)] {
            let corners = [[x, -0.25, 0.125], [x + 0.5, 0.0, 0.1875], [x, 0.25, 0.0625]].map(Vector3::from);
            let element = Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } };
            let found = cage.contact(&field, &SEARCH, 0.05, &element, &[], CageMap::Exact);
            assert_eq!(found.is_uncovered, is_uncovered, "{name}");
        }
    });
}

/// Lengths cubed are no numbers there.
#[test]
fn a_cage_of_any_size_is_well_conditioned() {
    for size in [1e-120, 1e-104, 1e-60, 1.0, 1e60, 1e108, 1e120] {
        let Lattice { points, tets } = Lattice::new(2);
        // Flat enough for the inverse that takes more care.
        let points = points.into_iter().map(|[x, y, z]| [x * size, y * size, 1e-4 * z * size]).collect();
        let lattice = Lattice { points, tets };
        with_cage(&lattice, &lattice.points, |cage| {
            let mut statuses = (0..lattice.tets.len() as u32).map(|tet| cage.status(tet));
            assert!(statuses.all(|status| status == TetStatus::Good), "{size}");
        });
    }
}

#[test]
fn inverted_flat_and_broken_tetrahedra_have_a_status_and_no_nan_comes_of_them() {
    let mut random = Random::seeded();
    let lattice = Lattice::new(2);
    let field = Sphere::new(0.6).unwrap();
    let middle = lattice.points.iter().position(|point| *point == [0.0; 3]).unwrap();
    for (name, place) in
        [("beyond", [3.0, 0.1, 0.2]), ("flat", [1.0, 0.0, 0.0]), ("lost", [f64::NAN, 0.0, 0.0]), ("far", [1e200; 3])]
    {
        let mut now = lattice.points.clone();
        now[middle] = place;
        with_cage(&lattice, &now, |cage| {
            let statuses: Vec<_> = (0..lattice.tets.len() as u32).map(|tet| cage.status(tet)).collect();
            let count = |status| statuses.iter().filter(|other| **other == status).count();
            match name {
                "beyond" => assert!(count(TetStatus::Inverted) > 0, "{statuses:?}"),
                _ => assert!(count(TetStatus::IllConditioned) > 0, "{name}: {statuses:?}"),
            }
            assert!(cage.slope_factor().is_finite());
            for id in 0..100 {
                let element: Element<f64, 3> = random_element(&mut random, id, 1.0, 1.0);
                for map in [CageMap::Exact, CageMap::Frozen] {
                    let found = cage.contact(&field, &SEARCH, 0.1, &element, &[], map);
                    if let CageOutcome::Contact(CageContact { contact, surface }) = found.outcome {
                        let numbers = contact.point.iter().chain(&contact.surface_point).chain(&contact.normal);
                        assert!(numbers.chain(&surface.weights).all(|x| x.is_finite()), "{name}: {contact:?}");
                        assert_eq!(cage.status(surface.tet), TetStatus::Good, "{name}");
                    }
                }
            }
        });
    }
    with_cage(&lattice, &lattice.points, |cage| {
        let bad = Element { id: 0, vertices: [0], simplex: Simplex { corners: [Vector3::new(f64::NAN, 0.0, 0.0)] } };
        let found = cage.contact(&field, &SEARCH, 0.1, &bad, &[], CageMap::Exact);
        assert_eq!(found.outcome, CageOutcome::NotFinite);
    });
}
