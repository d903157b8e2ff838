//! Laws of the cull and of the contact record: promises 1, 4, 6 and 7.

use std::collections::{BTreeSet, HashMap};

use nalgebra::Vector3;
use sdf_core::contact::{
    Contact, ContactStatus, Element, ElementKind, Feature, Outcome, all_contacts, centroid_bound, contact,
};
use sdf_core::minimize::{
    AllMinima, Certified, FrankWolfe, GoldenSection, Minimizer, Minimum, PointSampling, ProjectedGradient, SimplexCell,
};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Cuboid, HalfSpace, Sphere};
use sdf_core::{EnclosedSdf, Float, Lanes, Real, Sdf, Simplex};
use sdf_tests::lanes::simplices_side_by_side;
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, lattice_weights, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, Scene, Steep, cube_lattice, sampled, scenes};

fn element<R: Real, const N: usize>(id: u32, simplex: Simplex<R, N>) -> Element<R, N> {
    Element { id, vertices: std::array::from_fn(|corner| 10 * id + corner as u32), simplex }
}

fn found<R: Float, const N: usize>(outcome: Outcome<R, N>) -> Contact<R> {
    match outcome {
        Outcome::Contact(contact) => contact,
        other => panic!("expected a contact, found {other:?}"),
    }
}

/// Both that nothing is lost and that the bound that comes with it holds.
fn cull_is_honest<R: Float, const N: usize>(
    field: &impl EnclosedSdf,
    name: &str,
    size: f64,
    rounds: usize,
    random: &mut Random,
) {
    let lattice: Vec<[R; N]> = lattice_weights::<N>(12).into_iter().map(|w| w.map(R::from_f64)).collect();
    for _ in 0..rounds {
        let simplex = cast::<R, N>(&random_simplex(random, 2.0 * size));
        let values = lattice.iter().map(|weights| field.value(simplex.point(*weights)));
        let least = values.reduce(Real::min).unwrap();
        // Margins just above and below the least value are the ones that a cull can get wrong.
        let near = R::from_f64(least.to_f64() + random.pick(&[0.0, 1e-7, -1e-7, 1e-3, 0.1]) * size);
        for margin in [near, least, R::from_f64(random.between(-0.5, 0.5) * size)] {
            let cull = centroid_bound(field, &simplex, margin);
            let told = format!("{name}: {cull:?} with {margin:?}, but {least:?} on {simplex:?}");
            assert!(cull.may_touch || margin < least, "{told}");
            assert!(cull.lower_bound <= least, "{told}");
            // A contact's own cull knows more: what is certain of the element's box.
            match contact(field, &FrankWolfe::default(), margin, &element(0, simplex)) {
                Outcome::Culled => {
                    assert!(margin < least, "{name}: culled with {margin:?}, but {least:?} on {simplex:?}")
                }
                Outcome::Contact(contact) => {
                    assert!(contact.lower_bound <= least, "{name}: {contact:?}, but {least:?}")
                }
                Outcome::Separated(_) | Outcome::NotFinite => {}
            }
        }
    }
}

#[test]
fn a_culled_element_has_no_value_within_the_margin() {
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        cull_is_honest::<f64, 1>(&scene, scene.name, scene.size, 100, &mut random);
        cull_is_honest::<f64, 2>(&scene, scene.name, scene.size, 200, &mut random);
        cull_is_honest::<f64, 3>(&scene, scene.name, scene.size, 200, &mut random);
        cull_is_honest::<f32, 1>(&scene, scene.name, scene.size, 100, &mut random);
        cull_is_honest::<f32, 2>(&scene, scene.name, scene.size, 200, &mut random);
        cull_is_honest::<f32, 3>(&scene, scene.name, scene.size, 200, &mut random);
    }
}

/// §3.3 of the paper compares the value with the reach alone, as if no field were steeper than one.
#[test]
fn the_cull_minds_fields_that_are_steeper_than_one() {
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        let size = scene.size;
        let name = format!("{}, three times as steep", scene.name);
        let steep = Steep { field: scene, steepness: 3.0 };
        cull_is_honest::<f64, 2>(&steep, &name, size, 100, &mut random);
        cull_is_honest::<f64, 3>(&steep, &name, size, 100, &mut random);
        cull_is_honest::<f32, 3>(&steep, &name, size, 100, &mut random);
    }
    // One such by hand: 0.9 up at its middle, three times as steep, its lower end on the surface.
    let plane = Steep { field: HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap(), steepness: 3.0 };
    let edge = Simplex::<f64, 2> { corners: [Vector3::zeros(), Vector3::new(0.0, 0.0, 0.6)] };
    assert!(centroid_bound(&plane, &edge, 0.0).may_touch);
    let steep_grid = sampled(&Sphere::new(0.5).unwrap(), cube_lattice(0.75, 24), 3.0);
    cull_is_honest::<f64, 3>(&steep_grid, "a steep grid", 0.6, 2000, &mut random);
}

/// The reach is from the centroid to the farthest corner. An obtuse sliver's circumradius is 12 times that.
#[test]
fn the_reach_of_a_sliver_is_to_its_farthest_corner() {
    let sliver = Simplex::<f64, 3> { corners: [Vector3::zeros(), Vector3::x(), Vector3::new(0.5, 0.01, 0.0)] };
    let centroid = sliver.centroid();
    assert_eq!(sliver.max_distance_from(centroid), (sliver.corners[0] - centroid).norm());
    // Just out of reach at right angles, and just in reach along.
    let above = HalfSpace::new([0.0, 1.0, 0.0], -0.51).unwrap();
    assert!(!centroid_bound(&above, &sliver, 0.0).may_touch);
    let aside = HalfSpace::new([1.0, 0.0, 0.0], 0.001).unwrap();
    assert!(centroid_bound(&aside, &sliver, 0.0).may_touch);
}

/// Of a true distance nothing farther than the element is wide is kept.
#[test]
fn the_cull_drops_what_is_far() {
    let mut random = Random::of_test();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning == Meaning::Exact) {
        for _ in 0..300 {
            let simplex = random_simplex::<3>(&mut random, 3.0 * scene.size);
            let reach = simplex.max_distance_from(simplex.centroid());
            let value = scene.value(simplex.centroid());
            let margin = 0.1 * scene.size;
            assert_eq!(
                centroid_bound(scene, &simplex, margin).may_touch,
                value <= margin + reach + 1e-12,
                "{}",
                scene.name
            );
        }
    }
}

#[test]
fn one_lane_of_the_cull_equals_the_scalar_bit_for_bit() {
    fn check<R: Float, const L: usize, const N: usize>() {
        let mut random = Random::of_test();
        for scene in scenes(1.0) {
            for _ in 0..40 {
                let alone: [Simplex<R, N>; L] = std::array::from_fn(|_| cast(&random_simplex(&mut random, scene.size)));
                let margins: [R; L] = std::array::from_fn(|_| R::from_f64(random.between(-0.3, 0.5)));
                let together = centroid_bound(&scene, &simplices_side_by_side(&alone), Lanes(margins));
                for lane in 0..L {
                    let cull = centroid_bound(&scene, &alone[lane], margins[lane]);
                    assert_eq!(cull.may_touch, together.may_touch.0[lane], "{} on {:?}", scene.name, alone[lane]);
                    let (ours, theirs) = (cull.lower_bound.to_f64(), together.lower_bound.0[lane].to_f64());
                    assert_eq!(ours.to_bits(), theirs.to_bits(), "{} on {:?}", scene.name, alone[lane]);
                }
            }
        }
    }
    check::<f32, 8, 1>();
    check::<f32, 8, 2>();
    check::<f32, 8, 3>();
    check::<f64, 4, 1>();
    check::<f64, 4, 2>();
    check::<f64, 4, 3>();
}

fn contacts_of<const N: usize>(scene: &Scene, method: &Method, elements: &[Element<f64, N>]) -> Vec<Contact<f64>>
where
    Method: Minimizer<N>,
{
    let outcomes = elements.iter().map(|element| contact(scene, method, 0.05, element));
    outcomes.filter_map(|outcome| if let Outcome::Contact(contact) = outcome { Some(contact) } else { None }).collect()
}

#[test]
fn contacts_of_a_union_are_the_union_of_contacts_in_any_order() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::of_test();
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
fn a_contact_says_what_the_field_says() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::of_test();
        // Steps of φ from as far as the size, some ten roundings each.
        let slack = 64.0 * R::EPSILON;
        let mut seen = 0;
        for scene in scenes(1.0) {
            for id in 0..60 {
                let element = element(id, cast::<R, N>(&random_simplex(&mut random, scene.size)));
                for method in methods(N, 24) {
                    let Outcome::Contact(contact) = contact(&scene, &method, R::from_f64(0.1), &element) else {
                        continue;
                    };
                    seen += 1;
                    let told = format!("{} by {method:?}: {contact:?} of {element:?}", scene.name);
                    assert_eq!(contact.distance, scene.value(contact.point), "{told}");
                    assert_eq!(contact.element, id, "{told}");
                    assert!(contact.distance <= R::from_f64(0.1), "{told}");
                    assert!(contact.lower_bound <= contact.distance, "{told}");
                    let normal = contact.normal.map(Float::to_f64);
                    assert!((normal.norm() - 1.0).abs() < slack || normal.norm() == 0.0, "{told}");
                    let uphill = scene.evaluate(contact.point).gradient.map(Float::to_f64);
                    assert!((normal * uphill.norm() - uphill).norm() < slack * scene.slope_bound(), "{told}");
                    // Within rounding of an axis or a crease the gradient is rounding's.
                    let aside = random.direction().map(|x| R::from_f64(x * 1e3 * R::EPSILON * scene.size));
                    let beside = scene.evaluate(contact.point + aside).gradient.map(Float::to_f64);
                    if scene.meaning == Meaning::Exact && (beside - uphill).norm() < 0.1 {
                        let left = scene.value(contact.surface_point).to_f64().abs();
                        assert!(left < slack * 4.0 * scene.size, "{told}: surface point off by {left}");
                        let way = (contact.point - contact.surface_point).map(Float::to_f64).norm();
                        assert!((way - contact.distance.to_f64().abs()).abs() < slack * scene.size, "{told}");
                    }
                    let minimum = method.minimize(&scene, &element.simplex);
                    assert_eq!(contact.evaluations, minimum.evaluations.to_f64() as u32 + 1, "{told}");
                    let status = minimum.sample.status;
                    let expected = if status.degenerate_gradient || normal.norm() == 0.0 {
                        ContactStatus::DegenerateGradient
                    } else if status.outside_grid {
                        ContactStatus::OutsideGrid
                    } else if minimum.converged {
                        ContactStatus::Converged
                    } else {
                        ContactStatus::BudgetSpent
                    };
                    assert_eq!(contact.status, expected, "{told}");
                }
            }
        }
        assert!(seen > 300, "{seen} contacts");
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
        let mut random = Random::of_test();
        let lattice: Vec<[R; N]> = lattice_weights::<N>(12).into_iter().map(|w| w.map(R::from_f64)).collect();
        for scene in scenes(1.0) {
            for id in 0..60 {
                let element = element(id, cast::<R, N>(&random_simplex(&mut random, scene.size)));
                for method in methods(N, 2) {
                    let Outcome::Contact(contact) = contact(&scene, &method, R::from_f64(0.1), &element) else {
                        continue;
                    };
                    let least = lattice.iter().map(|weights| scene.value(element.simplex.point(*weights)));
                    let least = least.reduce(Real::min).unwrap();
                    assert!(contact.lower_bound <= least, "{}: {contact:?}, but {least:?}", scene.name);
                }
            }
        }
    }
    check::<f32, 3>();
    check::<f64, 2>();
    check::<f64, 3>();
}

#[test]
fn a_value_at_the_margin_is_a_contact_and_one_above_is_not() {
    fn check<R: Float>(above: impl Fn(f64) -> R) {
        let plane = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
        let point = element(0, Simplex { corners: [Vector3::new(R::zero(), R::zero(), R::from_f64(0.25))] });
        let method = FrankWolfe::default();
        assert_eq!(found(contact(&plane, &method, R::from_f64(0.25), &point)).distance, R::from_f64(0.25));
        assert!(matches!(contact(&plane, &method, above(0.25), &point), Outcome::Separated(_)));
        assert_eq!(contact(&plane, &method, R::from_f64(0.2), &point), Outcome::Culled);
        let edge = element(
            0,
            Simplex { corners: [R::from_f64(0.25), R::one()].map(|z| Vector3::new(R::zero(), R::zero(), z)) },
        );
        assert_eq!(found(contact(&plane, &method, R::from_f64(0.25), &edge)).feature, Feature::Vertex(0));
        assert!(matches!(contact(&plane, &method, above(0.25), &edge), Outcome::Separated(_)));
    }
    check::<f32>(|margin| (margin as f32).next_down());
    check::<f64>(|margin| margin.next_down());
}

/// Three spheres under a large triangle: under a corner, under the middle of an edge, under its middle.
#[test]
fn a_contact_names_the_feature_that_it_lies_on() {
    let corners = [Vector3::new(0.0, 0.0, 0.0), Vector3::new(4.0, 0.0, 0.0), Vector3::new(0.0, 4.0, 0.0)];
    let ball = |x: f64, y: f64| Placed {
        field: Sphere::new(0.5).unwrap(),
        placement: Rigid::new([x, y, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(),
    };
    let face = Element { id: 7, vertices: [30, 20, 10], simplex: Simplex { corners } };
    let method = ProjectedGradient { iterations: 400, ..ProjectedGradient::default() };
    let at = |x, y| found(contact(&ball(x, y), &method, 0.0, &face));
    assert_eq!(at(4.0, 0.0).feature, Feature::Vertex(20));
    assert_eq!(at(2.0, 2.0).feature, Feature::Edge([10, 20]));
    assert_eq!(at(2.0, 0.0).feature, Feature::Edge([20, 30]));
    assert_eq!(at(1.0, 1.0).feature, Feature::Face(7));
    assert_eq!(at(1.0, 1.0).kind, ElementKind::Face);
    // The same edge or vertex of the mesh is named the same by all elements that share it.
    let edge = Element { id: 3, vertices: [10, 20], simplex: Simplex { corners: [corners[2], corners[1]] } };
    assert_eq!(found(contact(&ball(2.0, 2.0), &method, 0.0, &edge)).feature, Feature::Edge([10, 20]));
    assert_eq!(found(contact(&ball(4.0, 0.0), &method, 0.0, &edge)).feature, Feature::Vertex(20));
    assert_eq!(found(contact(&ball(4.0, 0.0), &method, 0.0, &edge)).kind, ElementKind::Edge);
    let vertex = Element { id: 20, vertices: [20], simplex: Simplex { corners: [corners[1]] } };
    assert_eq!(found(contact(&ball(4.0, 0.0), &method, 0.0, &vertex)).feature, Feature::Vertex(20));
}

#[test]
fn keys_are_unique_and_stay_from_frame_to_frame() {
    let mut random = Random::of_test();
    let all = scenes(1.0);
    let scene = all.iter().find(|scene| scene.name == "sphere").unwrap();
    let mut names: HashMap<u64, (ElementKind, u32)> = HashMap::new();
    let (mut kept, mut seen) = (0, 0);
    for id in [0, 1, 2, 77, 65_535, 65_536, u32::MAX].into_iter().chain(100..200) {
        let triangle = Simplex { corners: [(); 3].map(|()| random.in_cube(1.0)) };
        let [a, b, c] = triangle.corners;
        let (kind, id) = (|kind| (kind, id), id);
        let vertex = contact(
            scene,
            &FrankWolfe::default(),
            1.0,
            &Element { id, vertices: [5], simplex: Simplex { corners: [a] } },
        );
        let edge = contact(
            scene,
            &GoldenSection::default(),
            1.0,
            &Element { id, vertices: [5, 6], simplex: Simplex { corners: [a, b] } },
        );
        let face = |corners| {
            contact(
                scene,
                &FrankWolfe::default(),
                1.0,
                &Element { id, vertices: [5, 6, 7], simplex: Simplex { corners } },
            )
        };
        let one = found(face([a, b, c]));
        for (key, name) in [
            (found(vertex).key(), kind(ElementKind::Vertex)),
            (found(edge).key(), kind(ElementKind::Edge)),
            (one.key(), kind(ElementKind::Face)),
        ] {
            assert_eq!(names.insert(key, name), None, "{key:x} names two");
            assert_eq!(key & 0xffff_ffff, u64::from(id));
        }
        // A frame later everything has moved by a thousandth.
        let moved = [a, b, c].map(|corner| corner + random.in_cube(1e-3));
        let next = found(face(moved));
        seen += 1;
        if next.feature == one.feature {
            assert_eq!(next.key(), one.key());
            kept += 1;
        }
    }
    assert!(kept * 10 > seen * 8, "{kept} of {seen} features kept");
}

#[test]
fn all_contacts_of_an_element_begin_with_the_deepest_and_have_keys_of_their_own() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        let search = AllMinima::default();
        let (mut places, mut minima) = (vec![SimplexCell::default(); 1024], vec![Minimum::default(); 64]);
        for scene in scenes(1.0) {
            for id in 0..8 {
                let element = element(id, cast::<R, N>(&random_simplex(random, scene.size)));
                let margin = R::from_f64(0.2 * scene.size);
                let mut contacts = vec![];
                let outcome = all_contacts(&scene, &search, margin, &element, &mut places, &mut minima, |contact| {
                    contacts.push(*contact);
                });
                let alone = contact(&scene, &search.search, margin, &element);
                let told = || format!("{}: {outcome:?} and {alone:?} and {contacts:?} of {element:?}", scene.name);
                let (Outcome::Contact(first), Outcome::Contact(alone)) = (outcome, alone) else {
                    assert!(outcome == alone && contacts.is_empty(), "{}", told());
                    continue;
                };
                assert_eq!(contacts.first(), Some(&first), "{}", told());
                assert!(contacts.iter().all(|contact| contact.distance <= margin), "{}", told());
                assert!(first.distance <= alone.distance && first.lower_bound <= first.distance, "{}", told());
                let keys: BTreeSet<u64> = contacts.iter().map(Contact::key).collect();
                assert_eq!(keys.len(), contacts.len(), "{}", told());
            }
        }
    }
    let mut random = Random::of_test();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f32, 3>(&mut random);
}

#[test]
fn a_tetrahedron_is_no_element_of_a_mesh() {
    let cuboid = Cuboid::new([1.0; 3]).unwrap();
    let solid = element(0, Simplex { corners: [Vector3::<f64>::zeros(), Vector3::x(), Vector3::y(), Vector3::z()] });
    assert_eq!(contact(&cuboid, &FrankWolfe::default(), 0.0, &solid), Outcome::NotFinite);
}

/// Feature names follow the weights, whatever the method: its own points all lie inside.
#[test]
fn sampled_points_of_a_face_lie_on_the_face() {
    let sphere = Sphere::new(1.0).unwrap();
    let face = element(4, Simplex { corners: [Vector3::<f64>::zeros(), Vector3::x(), Vector3::y()] });
    assert_eq!(found(contact(&sphere, &PointSampling { samples: 64 }, 0.0, &face)).feature, Feature::Face(4));
}

/// Told nothing of a level.
struct WithoutLevel(Certified);

impl<const N: usize> Minimizer<N> for WithoutLevel {
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        self.0.minimize(field, simplex)
    }
}

/// A search that stops where no value can be within the margin finds the same contacts, to the last bit.
#[test]
fn a_search_that_knows_the_margin_finds_the_same_contacts() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        let (mut contacts, mut stopped) = (0, 0);
        for scene in scenes(1.0) {
            for id in 0..24 {
                let reach = 10.0_f64.powf(random.between(-2.0, 0.0));
                let shrink = |corner: Vector3<f64>, first: Vector3<f64>| first + (corner - first) * reach;
                let whole = random_simplex::<N>(random, scene.size);
                let corners = whole.corners.map(|corner| shrink(corner, whole.corners[0]));
                let element = element(id, cast::<R, N>(&Simplex { corners }));
                let search = Certified { evaluations: [0, 16, 256][id as usize % 3], ..Certified::default() };
                let least = Minimizer::<N>::minimize(&search, &scene, &element.simplex);
                let steps = [-0.1, -1e-3, -1e-6, 0.0, 1e-6, 1e-3, 0.1].map(|step| R::from_f64(step * scene.size));
                for margin in steps.map(|step| least.sample.value + step) {
                    let knowing = contact(&scene, &search, margin, &element);
                    let told = || format!("{}: {knowing:?} of {element:?} within {margin:?}", scene.name);
                    match (knowing, contact(&scene, &WithoutLevel(search), margin, &element)) {
                        (Outcome::Separated(knowing), Outcome::Separated(other)) => {
                            assert!(knowing == other || margin < knowing.lower_bound, "{} and {other:?}", told());
                            assert!(other.sample.value <= knowing.sample.value, "{} and {other:?}", told());
                            stopped += usize::from(knowing != other);
                        }
                        (knowing, other) => {
                            assert!(knowing == other, "{} and {other:?}", told());
                            contacts += usize::from(matches!(other, Outcome::Contact(_)));
                        }
                    }
                }
            }
        }
        assert!(contacts > 500 && (N < 3 || stopped > 20), "{contacts} contacts, {stopped} stopped, of {N} corners");
    }
    let mut random = Random::of_test();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f32, 2>(&mut random);
    check::<f32, 3>(&mut random);
}
