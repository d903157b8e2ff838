//! Culls and margins that hold with equality: what touches with the very last of a margin is found, and hardly less finds nothing.
//!
//! Random elements seldom lie where a bound is reached. Here a segment stands along ∇φ, so that φ at its far end less slope · length is φ
//! at its near end: no bound may be shorter by anything, and a test that it is nearly reached shows that the case is sharp.

use nalgebra::Vector3;
use sdf_core::contact::{
    ClusterKey, Clusters, Element, ElementMemory, Outcome, cluster_count, contact, contact_again, speculative_margin,
};
use sdf_core::minimize::FrankWolfe;
use sdf_core::moving::{Morphing, MovingSdf, RigidMotion, Travelling};
use sdf_core::placed::{Placement, Rigid};
use sdf_core::shapes::{HalfSpace, Sphere, Torus};
use sdf_core::{Aabb, DynSdf, EnclosedSdf, Float, Real, Sdf, Simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{IDENTITY, Steep};

use crate::random_pose;

type Point = Vector3<f64>;

/// Fields that are distances, but for a factor.
fn fields(random: &mut Random) -> Vec<Box<dyn DynSdf>> {
    let plane = HalfSpace::new(random.direction().into(), 0.1).unwrap();
    let steep = Steep { field: plane, steepness: 3.0 };
    vec![Box::new(plane), Box::new(steep), Box::new(Sphere::new(0.7).unwrap()), Box::new(Torus::new(0.8, 0.3).unwrap())]
}

/// A segment along ∇φ, its near end first. `None` where φ does not rise evenly along it.
fn segment(field: &dyn DynSdf, random: &mut Random) -> Option<[Point; 2]> {
    let near = random.in_cube(1.5);
    let direction = field.sample(near).gradient.normalize();
    let length = random.between(0.01, 0.3);
    let far = near + direction * length;
    let rise = field.value(far) - field.value(near);
    ((rise - field.slope_bound() * length).abs() < 1e-9).then_some([near, far])
}

fn element<R: Float, const N: usize>(corners: [Point; N]) -> Element<R, N> {
    let corners = corners.map(|corner| corner.map(<R as Real>::from_f64));
    Element { id: 0, vertices: std::array::from_fn(|k| k as u32), simplex: Simplex { corners } }
}

fn found<R: Float, F: EnclosedSdf, const N: usize>(field: &F, margin: R, element: &Element<R, N>) -> Option<R> {
    match contact(field, &FrankWolfe::default(), margin, element) {
        Outcome::Contact(contact) => Some(contact.distance),
        _ => None,
    }
}

/// Is the cluster of one segment visited within a margin?
fn is_visited<R: Float>(field: &dyn DynSdf, margin: R, local: [Point; 2], pose: Option<&Rigid>) -> bool {
    let (mut scratch, mut order, mut boxes) = ([ClusterKey::default()], [0], [Aabb::EVERYWHERE; cluster_count(1)]);
    let points = local.map(<[f64; 3]>::from);
    let clusters = Clusters::build(&points, &[[0, 1]], &mut scratch, &mut order, &mut boxes).unwrap();
    let mut is_visited = false;
    clusters.visit_near(&field, margin, pose, |_| is_visited = true);
    is_visited
}

#[test]
fn a_cluster_is_visited_within_the_very_distance_of_its_contact() {
    fn check<R: Float>(field: &dyn DynSdf, ends: [Point; 2], pose: Option<&Rigid>) -> bool {
        let local = ends.map(|end| pose.map_or(end, |pose| pose.pull(end).point));
        let world = local.map(|end| pose.map_or(end, |pose| pose.push(end)));
        let distance: R = found(&field, R::from_f64(100.0), &element(world)).unwrap();
        assert!(is_visited(field, distance, local, pose), "{distance:?}");
        let length = R::from_f64((ends[1] - ends[0]).norm());
        is_visited(field, distance - length * R::from_f64(0.02), local, pose)
    }
    let mut random = Random::seeded();
    let (mut checked, mut loose) = (0, 0);
    for _ in 0..300 {
        // Far off, so that rounding counts.
        let pose = random_pose(&mut random, 100.0);
        let shift = Rigid::new(random.point_in_cube(100.0), IDENTITY).unwrap();
        for field in fields(&mut random) {
            let field: &dyn DynSdf = &*field;
            let Some(ends) = segment(field, &mut random) else { continue };
            for pose in [None, Some(&pose), Some(&shift)] {
                loose += u32::from(check::<f64>(field, ends, pose)) + u32::from(check::<f32>(field, ends, pose));
                checked += 2;
            }
        }
    }
    assert!(checked > 1000 && 4 * loose < checked, "{checked} checked, {loose} of them visited within less");
}

#[test]
fn a_speculative_margin_reaches_what_touches_at_the_last_moment() {
    let mut random = Random::seeded();
    let mut checked = 0;
    for _ in 0..300 {
        let (from, shift) = (random_pose(&mut random, 0.5), random.in_cube(0.3));
        let to = Rigid::new((Vector3::from(from.translation()) + shift).into(), from.rotation()).unwrap();
        for field in fields(&mut random) {
            let field: &dyn DynSdf = &*field;
            let Some([near, far]) = segment(field, &mut random) else { continue };
            let (thickness, value) = (field.value(near) + 1e-12, field.value(far));
            let still = speculative_margin(&field, thickness, &[[far, near]]);
            assert!(found(&field, still, &element([far])).is_some(), "{still} for {value}");
            // It is no wider than the way allows.
            assert!(still < value + 1e-6, "{still} for {value}");
            let travelling = Travelling { field: &field, motion: RigidMotion::between(from, to) };
            let path = [[from.push(far), to.push(near)]];
            let margin = speculative_margin(&travelling, thickness, &path);
            assert!(found(&travelling.at(0.0), margin, &element([path[0][0]])).is_some(), "{margin} for {value}");
            checked += 1;
        }
        // A ball that swells reaches a point that stands still.
        let (small, large) = (random.between(0.2, 1.0), random.between(1.0, 2.0));
        let swelling = Morphing::animated(Sphere::new(small).unwrap(), Sphere::new(large).unwrap());
        let point = random.direction() * large;
        let margin = speculative_margin(&swelling, 1e-12, &[[point, point]]);
        assert!(found(&swelling.at(0.0), margin, &element([point])).is_some(), "{margin} for {}", large - small);
    }
    assert!(checked > 500, "{checked}");
}

#[test]
fn a_memory_asks_again_when_its_bound_is_used_up_and_not_long_before() {
    let mut random = Random::seeded();
    let (mut checked, mut skipped) = (0, 0);
    for _ in 0..300 {
        for field in fields(&mut random) {
            let field: &dyn DynSdf = &*field;
            let Some([near, far]) = segment(field, &mut random) else { continue };
            let (method, length) = (FrankWolfe::default(), (far - near).norm());
            let mut memory = ElementMemory::default();
            contact_again(&field, &method, 100.0, &element([far]), 0.0, &mut memory);
            let mut earlier = memory;
            let margin = found(&field, 100.0, &element([near])).unwrap();
            let outcome =
                contact_again(&field, &method, margin, &element([near]), field.slope_bound() * length, &mut memory);
            assert!(matches!(outcome, Outcome::Contact(_)), "{outcome:?} within {margin}");
            earlier.recede(0.99 * field.slope_bound() * length);
            skipped += u32::from(earlier.is_apart(&field, margin, &element([near])));
            checked += 1;
        }
    }
    assert!(checked > 500 && skipped == checked, "{skipped} of {checked}");
}
