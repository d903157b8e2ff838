//! Values at the margin, and searches that stop once none can be within it.

use nalgebra::Vector3;
use sdf_core::contact::{Contact, Feature, Outcome, contact};
use sdf_core::minimize::{Certified, FrankWolfe, Minimizer, Minimum};
use sdf_core::shapes::HalfSpace;
use sdf_core::{EnclosedSdf, Float, Real, Simplex};
use sdf_tests::oracle::{cast, element, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::scenes;

use super::expect_contact;

#[test]
fn a_value_at_the_margin_is_a_contact_and_one_above_is_not() {
    fn check<R: Float>(next_down: impl Fn(f64) -> R) {
        let plane = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
        let point = element(0, Simplex { corners: [Vector3::new(R::zero(), R::zero(), R::from_f64(0.25))] });
        let method = FrankWolfe::default();
        assert_eq!(expect_contact(contact(&plane, &method, R::from_f64(0.25), &point)).distance, R::from_f64(0.25));
        assert!(matches!(contact(&plane, &method, next_down(0.25), &point), Outcome::Separated(_)));
        assert_eq!(contact(&plane, &method, R::from_f64(0.2), &point), Outcome::Culled);
        let edge = element(
            0,
            Simplex { corners: [R::from_f64(0.25), R::one()].map(|z| Vector3::new(R::zero(), R::zero(), z)) },
        );
        assert_eq!(expect_contact(contact(&plane, &method, R::from_f64(0.25), &edge)).feature, Feature::Vertex(0));
        assert!(matches!(contact(&plane, &method, next_down(0.25), &edge), Outcome::Separated(_)));
    }
    check::<f32>(|margin| (margin as f32).next_down());
    check::<f64>(|margin| margin.next_down());
}

/// A search that ignores the level.
struct WithoutLevel(Certified);

impl<const N: usize> Minimizer<N> for WithoutLevel {
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        self.0.minimize(field, simplex)
    }
}

/// A search that knows the margin stops once no value can be within it, and finds the same contacts, to the last bit, but for the rounding of
/// weights where the way there is another. Where the other's tolerance leaves open whether a value is within the margin, it goes on.
#[test]
fn a_search_that_knows_the_margin_finds_the_same_contacts() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        let (mut contacts, mut stopped, mut decided) = (0, 0, 0);
        for scene in scenes(1.0) {
            for id in 0..24 {
                let factor = 10.0_f64.powf(random.between(-2.0, 0.0));
                let shrink = |corner: Vector3<f64>, first: Vector3<f64>| first + (corner - first) * factor;
                let whole = random_simplex::<N>(random, scene.size);
                let corners = whole.corners.map(|corner| shrink(corner, whole.corners[0]));
                let element = element(id, cast::<R, N>(&Simplex { corners }));
                let search = Certified { evaluations: [0, 16, 256][id as usize % 3], ..Certified::default() };
                let minimum = Minimizer::<N>::minimize(&search, &scene.field, &element.simplex);
                let steps = [-0.1, -1e-3, -1e-6, 0.0, 1e-6, 1e-3, 0.1].map(|step| R::from_f64(step * scene.size));
                for margin in steps.map(|step| minimum.sample.value + step) {
                    let stopping = contact(&scene.field, &search, margin, &element);
                    let context = || format!("{}: {stopping:?} of {element:?} within {margin:?}", scene.name);
                    match (stopping, contact(&scene.field, &WithoutLevel(search), margin, &element)) {
                        (Outcome::Separated(stopping), Outcome::Separated(other)) => {
                            let is_proven = margin < stopping.lower_bound;
                            assert!(
                                stopping == other || is_proven || other.lower_bound <= margin,
                                "{} and {other:?}",
                                context()
                            );
                            stopped += usize::from(is_proven && stopping != other);
                        }
                        // The search went on until it knew.
                        (Outcome::Contact(found), Outcome::Separated(other)) => {
                            assert!(
                                found.distance <= margin && other.lower_bound <= margin,
                                "{} and {other:?}",
                                context()
                            );
                            decided += 1;
                        }
                        (Outcome::Contact(found), Outcome::Contact(other)) => {
                            let same_place = Contact { weights: other.weights, ..found };
                            let rounding = R::from_f64(2.0 * R::EPSILON);
                            let is_rounded = |(a, b): (&R, &R)| (*a - *b).abs() <= rounding;
                            let is_same =
                                same_place == other && found.weights.iter().zip(&other.weights).all(is_rounded);
                            assert!(is_same, "{} and {other:?}", context());
                            contacts += 1;
                        }
                        (stopping, other) => assert!(stopping == other, "{} and {other:?}", context()),
                    }
                }
            }
        }
        let context = || format!("{contacts} contacts, {stopped} stopped, {decided} decided, of {N} corners");
        assert!(contacts > 500 && (N < 3 || stopped > 20 && (R::EPSILON > 1e-10 || decided > 0)), "{}", context());
    }
    let mut random = Random::seeded();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f32, 2>(&mut random);
    check::<f32, 3>(&mut random);
}
