//! Contact records: values, features, keys, lower bounds, and the union of parts.

use std::collections::{BTreeSet, HashMap};

use nalgebra::Vector3;
use sdf_core::contact::{Contact, ContactStatus, Element, ElementKind, Feature, Outcome, all_contacts, contact};
use sdf_core::minimize::{
    AllMinima, FrankWolfe, GoldenSection, Minimizer, Minimum, PointSampling, ProjectedGradient, SimplexCell,
};
use sdf_core::shapes::{Cuboid, Sphere};
use sdf_core::{Float, Sdf, Simplex};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, element, lattice_minimum, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, Scene, scenes, shifted};

use super::expect_contact;

fn contacts_of<const N: usize>(scene: &Scene, method: &Method, elements: &[Element<f64, N>]) -> Vec<Contact<f64>>
where
    Method: Minimizer<N>,
{
    let outcomes = elements.iter().map(|element| contact(&scene.field, method, 0.05, element));
    outcomes.filter_map(|outcome| if let Outcome::Contact(contact) = outcome { Some(contact) } else { None }).collect()
}

#[test]
fn contacts_of_a_union_are_the_union_of_contacts_in_any_order() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::seeded();
        for scene in scenes(1.0) {
            let mut all: Vec<_> = (0..60).map(|id| element(id, random_simplex::<N>(&mut random, scene.size))).collect();
            for method in methods(N, 16) {
                let mut whole = contacts_of(&scene, &method, &all);
                random.shuffle(&mut all);
                let (a, b) = all.split_at(random.below(all.len()));
                let mut parts = contacts_of(&scene, &method, a);
                parts.extend(contacts_of(&scene, &method, b));
                whole.sort_by_key(|contact| contact.element);
                parts.sort_by_key(|contact| contact.element);
                assert_eq!(whole, parts, "{} by {method:?}", scene.name);
            }
        }
    }
    check::<1>();
    check::<2>();
    check::<3>();
}

#[test]
fn a_contact_reports_the_fields_own_values() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::seeded();
        // Some ten roundings for each step of φ, at numbers as large as the scene.
        let slack = 64.0 * R::EPSILON;
        let mut count = 0;
        for scene in scenes(1.0) {
            for id in 0..60 {
                let element = element(id, cast::<R, N>(&random_simplex(&mut random, scene.size)));
                for method in methods(N, 24) {
                    let Outcome::Contact(contact) = contact(&scene.field, &method, R::from_f64(0.1), &element) else {
                        continue;
                    };
                    count += 1;
                    let context = || format!("{} by {method:?}: {contact:?} of {element:?}", scene.name);
                    assert_eq!(contact.distance, scene.value(contact.point), "{}", context());
                    assert_eq!(contact.element, id, "{}", context());
                    assert!(contact.distance <= R::from_f64(0.1), "{}", context());
                    assert!(contact.lower_bound <= contact.distance, "{}", context());
                    let normal = contact.normal.map(Float::to_f64);
                    assert!((normal.norm() - 1.0).abs() < slack || normal.norm() == 0.0, "{}", context());
                    let smooth = scene.evaluate_smooth(contact.point).gradient.map(Float::to_f64);
                    // Zero in the middle of a symmetric grid, where the interpolant's own gradient stands in.
                    let is_flat = smooth.norm() < f64::from(f32::MIN_POSITIVE);
                    let plain = scene.evaluate(contact.point).gradient.map(Float::to_f64);
                    let gradient = if is_flat { plain } else { smooth };
                    assert!(
                        (normal * gradient.norm() - gradient).norm() < slack * scene.slope_bound(),
                        "{}",
                        context()
                    );
                    // Within rounding of an axis or a crease the gradient is arbitrary.
                    let offset = random.direction().map(|x| R::from_f64(x * 1e3 * R::EPSILON * scene.size));
                    let beside = scene.evaluate(contact.point + offset).gradient.map(Float::to_f64);
                    if scene.meaning == Meaning::Exact && (beside - gradient).norm() < 0.1 {
                        let error = scene.value(contact.surface_point).to_f64().abs();
                        assert!(error < slack * 4.0 * scene.size, "{}: surface point off by {error}", context());
                        let depth = (contact.point - contact.surface_point).map(Float::to_f64).norm();
                        assert!((depth - contact.distance.to_f64().abs()).abs() < slack * scene.size, "{}", context());
                    }
                    let minimum = method.minimize(&scene.field, &element.simplex);
                    assert_eq!(contact.evaluations, minimum.evaluations.to_f64() as u32, "{}", context());
                    let status = minimum.sample.status;
                    let expected = if status.degenerate_gradient || is_flat || normal.norm() == 0.0 {
                        ContactStatus::DegenerateGradient
                    } else if status.outside_grid {
                        ContactStatus::OutsideGrid
                    } else if status.beyond_band {
                        ContactStatus::BeyondBand
                    } else if minimum.converged {
                        ContactStatus::Converged
                    } else {
                        ContactStatus::BudgetSpent
                    };
                    assert_eq!(contact.status, expected, "{}", context());
                }
            }
        }
        assert!(count > 300, "{count} contacts");
    }
    check::<f32, 2>();
    check::<f64, 1>();
    check::<f64, 2>();
    check::<f64, 3>();
}

#[test]
fn the_lower_bound_of_a_contact_holds_over_the_whole_element() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::seeded();
        for scene in scenes(1.0) {
            for id in 0..60 {
                let element = element(id, cast::<R, N>(&random_simplex(&mut random, scene.size)));
                let lowest = lattice_minimum(&scene.field, &element.simplex, 12);
                for method in methods(N, 2) {
                    let Outcome::Contact(contact) = contact(&scene.field, &method, R::from_f64(0.1), &element) else {
                        continue;
                    };
                    assert!(contact.lower_bound <= lowest, "{}: {contact:?}, but {lowest:?}", scene.name);
                }
            }
        }
    }
    check::<f32, 3>();
    check::<f64, 2>();
    check::<f64, 3>();
}

/// Spheres under a corner, under the middle of an edge, and under the middle of a large triangle.
#[test]
fn a_contact_names_the_feature_that_it_lies_on() {
    let corners = [Vector3::new(0.0, 0.0, 0.0), Vector3::new(4.0, 0.0, 0.0), Vector3::new(0.0, 4.0, 0.0)];
    let ball = |x: f64, y: f64| shifted(Sphere::new(0.5).unwrap(), [x, y, 0.0]);
    let face = Element { id: 7, vertices: [30, 20, 10], simplex: Simplex { corners } };
    let method = ProjectedGradient { iterations: 400, ..ProjectedGradient::default() };
    let at = |x, y| expect_contact(contact(&ball(x, y), &method, 0.0, &face));
    assert_eq!(at(4.0, 0.0).feature, Feature::Vertex(20));
    assert_eq!(at(2.0, 2.0).feature, Feature::Edge([10, 20]));
    assert_eq!(at(2.0, 0.0).feature, Feature::Edge([20, 30]));
    assert_eq!(at(1.0, 1.0).feature, Feature::Face(7));
    assert_eq!(at(1.0, 1.0).kind, ElementKind::Face);
    // All elements that share an edge or vertex of the mesh give it the same name.
    let edge = Element { id: 3, vertices: [10, 20], simplex: Simplex { corners: [corners[2], corners[1]] } };
    assert_eq!(expect_contact(contact(&ball(2.0, 2.0), &method, 0.0, &edge)).feature, Feature::Edge([10, 20]));
    assert_eq!(expect_contact(contact(&ball(4.0, 0.0), &method, 0.0, &edge)).feature, Feature::Vertex(20));
    assert_eq!(expect_contact(contact(&ball(4.0, 0.0), &method, 0.0, &edge)).kind, ElementKind::Edge);
    let vertex = Element { id: 20, vertices: [20], simplex: Simplex { corners: [corners[1]] } };
    assert_eq!(expect_contact(contact(&ball(4.0, 0.0), &method, 0.0, &vertex)).feature, Feature::Vertex(20));
}

#[test]
fn keys_are_unique_and_stable_from_frame_to_frame() {
    let mut random = Random::seeded();
    let all = scenes(1.0);
    let scene = all.iter().find(|scene| scene.name == "sphere").unwrap();
    let mut names: HashMap<u64, (ElementKind, u32)> = HashMap::new();
    let (mut kept, mut count) = (0, 0);
    for id in [0, 1, 2, 77, 65_535, 65_536, u32::MAX].into_iter().chain(100..200) {
        let triangle = Simplex { corners: [(); 3].map(|()| random.in_cube(1.0)) };
        let [a, b, c] = triangle.corners;
        let vertex = Element { id, vertices: [5], simplex: Simplex { corners: [a] } };
        let vertex = contact(&scene.field, &FrankWolfe::default(), 1.0, &vertex);
        let edge = Element { id, vertices: [5, 6], simplex: Simplex { corners: [a, b] } };
        let edge = contact(&scene.field, &GoldenSection::default(), 1.0, &edge);
        let face = |corners| {
            let face = Element { id, vertices: [5, 6, 7], simplex: Simplex { corners } };
            contact(&scene.field, &FrankWolfe::default(), 1.0, &face)
        };
        let one = expect_contact(face([a, b, c]));
        for (key, name) in [
            (expect_contact(vertex).key(), (ElementKind::Vertex, id)),
            (expect_contact(edge).key(), (ElementKind::Edge, id)),
            (one.key(), (ElementKind::Face, id)),
        ] {
            assert_eq!(names.insert(key, name), None, "{key:x} names two elements");
            assert_eq!(key & 0xffff_ffff, u64::from(id));
        }
        // One frame later every corner has moved by up to a thousandth.
        let moved = [a, b, c].map(|corner| corner + random.in_cube(1e-3));
        let next = expect_contact(face(moved));
        count += 1;
        if next.feature == one.feature {
            assert_eq!(next.key(), one.key());
            kept += 1;
        }
    }
    assert!(kept * 10 > count * 8, "{kept} of {count} features kept");
}

#[test]
fn all_contacts_of_an_element_begin_with_the_deepest_and_have_distinct_keys() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        let search = AllMinima::default();
        let (mut cells, mut minima) = (vec![SimplexCell::default(); 1024], vec![Minimum::default(); 64]);
        for scene in scenes(1.0) {
            for id in 0..8 {
                let element = element(id, cast::<R, N>(&random_simplex(random, scene.size)));
                let margin = R::from_f64(0.2 * scene.size);
                let mut contacts = vec![];
                let outcome =
                    all_contacts(&scene.field, &search, margin, &element, &mut cells, &mut minima, |contact| {
                        contacts.push(*contact);
                    });
                let deepest = contact(&scene.field, &search.search, margin, &element);
                let context = || format!("{}: {outcome:?} and {deepest:?} and {contacts:?} of {element:?}", scene.name);
                let (Outcome::Contact(first), Outcome::Contact(deepest)) = (outcome, deepest) else {
                    assert!(outcome == deepest && contacts.is_empty(), "{}", context());
                    continue;
                };
                assert_eq!(contacts.first(), Some(&first), "{}", context());
                assert!(contacts.iter().all(|contact| contact.distance <= margin), "{}", context());
                assert!(first.distance <= deepest.distance && first.lower_bound <= first.distance, "{}", context());
                let keys: BTreeSet<u64> = contacts.iter().map(Contact::key).collect();
                assert_eq!(keys.len(), contacts.len(), "{}", context());
            }
        }
    }
    let mut random = Random::seeded();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f32, 3>(&mut random);
}

#[test]
fn a_tetrahedron_is_not_an_element_of_a_mesh() {
    let cuboid = Cuboid::new([1.0; 3]).unwrap();
    let solid = element(0, Simplex { corners: [Vector3::<f64>::zeros(), Vector3::x(), Vector3::y(), Vector3::z()] });
    assert_eq!(contact(&cuboid, &FrankWolfe::default(), 0.0, &solid), Outcome::NotFinite);
}

/// The feature follows from the weights, whatever the method: sampled points are all in the interior.
#[test]
fn sampled_points_of_a_face_lie_on_the_face() {
    let sphere = Sphere::new(1.0).unwrap();
    let face = element(4, Simplex { corners: [Vector3::<f64>::zeros(), Vector3::x(), Vector3::y()] });
    assert_eq!(
        expect_contact(contact(&sphere, &PointSampling { samples: 64, corners: false }, 0.0, &face)).feature,
        Feature::Face(4)
    );
}
