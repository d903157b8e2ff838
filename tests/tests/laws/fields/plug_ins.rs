//! Laws of fields behind a pointer: `&dyn DynSdf` returns the bits of the field itself, in every number type that it
//! serves by one virtual call, and lane by lane in the others.

use nalgebra::Vector3;
use sdf_core::combine::{Compound, Difference, Shell, SmoothUnion, Union};
use sdf_core::grid::{BlockBounds, Dense, Grid, WithBlockBounds};
use sdf_core::minimize::{Certified, Minimizer};
use sdf_core::placed::{Placed, Rigid, Similarity, Stretch};
use sdf_core::shapes::{Bowl, Cuboid, Ellipsoid, HalfSpace, Horseshoe, Sphere, Torus};
use sdf_core::{
    Aabb, BoxEnclosure, DynSdf, EnclosedSdf, ExactMinimum, Float, Goal, Lanes, Mask, Real, Sample, Simplex, Status,
};
use sdf_tests::lanes::pack_points;
use sdf_tests::oracle::{cast, random_simplex};
use sdf_tests::own_number::OwnNumber;
use sdf_tests::random::Random;
use sdf_tests::scenes::{cube_lattice, sampled, sampled_in_bricks, with_block_bounds};

/// A law of two fields that should be one: the field itself, and the same behind a pointer.
trait Law {
    fn check<F: EnclosedSdf>(&mut self, name: &str, field: &F, behind_pointer: &dyn DynSdf);
}

fn for_each_field(law: &mut impl Law) {
    fn check<F: EnclosedSdf>(law: &mut impl Law, name: &str, field: F) {
        law.check(name, &field, &field);
    }
    let (ball, block) = (Sphere::new(0.5).unwrap(), Cuboid::new([0.25, 0.5, 0.375]).unwrap());
    let pose = Rigid::new([0.1, 0.2, -0.1], [0.1, 0.2, 0.3, 0.9]).unwrap();
    let scaled = Similarity::new([0.1, 0.0, 0.3], [0.5, 0.5, 0.5, 0.5], 1.5).unwrap();
    let dense = || sampled(&ball, cube_lattice(0.75, 16), 1.0);
    check(law, "sphere", ball);
    check(law, "half-space", HalfSpace::new([2.0, -4.0, 4.0], 0.25).unwrap());
    check(law, "cuboid", block);
    check(law, "ellipsoid", Ellipsoid::new([0.25, 0.5, 1.0]).unwrap());
    check(law, "torus", Torus::new(0.6, 0.25).unwrap());
    check(law, "bowl", Bowl::new(0.75, 0.25, 0.1875).unwrap());
    check(law, "horseshoe", Horseshoe::new(0.5, 0.25, 1.0, 0.25, 0.3).unwrap());
    check(law, "difference", Difference(block, ball));
    check(law, "shell", Shell::new(block, 0.1).unwrap());
    check(law, "smooth union", SmoothUnion::new(ball, Placed { field: ball, placement: pose }, 0.25).unwrap());
    check(law, "stretched", Placed { field: ball, placement: Stretch::new([1.0, 1.5, 0.5]).unwrap() });
    check(law, "dense grid", dense());
    check(law, "turned grid", Placed { field: dense(), placement: scaled });
    check(law, "sparse grid", sampled_in_bricks::<u16>(&block, cube_lattice(0.75, 40), 0.05));
    let with_bounds: Grid<WithBlockBounds<Dense<Vec<f32>>, Vec<BlockBounds>>> = with_block_bounds(dense());
    check(law, "grid with bounds", with_bounds);
}

/// Bits of a number, lane by lane.
fn bits<R: Real>(number: R) -> Vec<u64> {
    (0..R::LANES).map(|lane| number.lane(lane).to_f64().to_bits()).collect()
}

fn flags<R: Real>(status: Status<R::Mask>) -> Vec<[bool; 4]> {
    let Status { degenerate_gradient, outside_grid, beyond_band, not_finite } = status;
    (0..R::LANES)
        .map(|lane| [degenerate_gradient, outside_grid, beyond_band, not_finite].map(|mask| mask.lane(lane)))
        .collect()
}

fn sample_bits<R: Real>(sample: &Sample<R>) -> (Vec<Vec<u64>>, Vec<[bool; 4]>) {
    let numbers = [sample.value].into_iter().chain(sample.gradient.iter().copied());
    (numbers.map(bits).collect(), flags::<R>(sample.status))
}

/// Points near the field and far away.
fn random_points<R: Float, const L: usize>(random: &mut Random) -> [Vector3<R>; L] {
    let half = random.pick(&[1.0, 1.0, 20.0]);
    std::array::from_fn(|_| random.in_cube(half).map(R::from_f64))
}

/// Names of [`Sdf`](sdf_core::Sdf)'s methods are those of [`EnclosedSdf`] too: generic code is what calls both alike.
fn evaluate<R: Real, F: EnclosedSdf>(field: F, point: Vector3<R>) -> (Sample<R>, R) {
    (field.evaluate(point), field.value(point))
}

fn evaluate_smooth<R: Float, F: EnclosedSdf>(field: F, point: Vector3<R>) -> Sample<R> {
    field.evaluate_smooth(point)
}

struct Evaluations(Random);

impl Evaluations {
    fn same_bits<R: Real, F: EnclosedSdf>(name: &str, field: &F, behind: &dyn DynSdf, point: Vector3<R>) {
        let ((sample, value), (other_sample, other_value)) = (evaluate(field, point), evaluate(behind, point));
        assert_eq!(sample_bits(&sample), sample_bits(&other_sample), "{name} at {point:?}");
        assert_eq!(bits(value), bits(other_value), "{name} at {point:?}");
    }

    fn lane_by_lane<R: Float, F: EnclosedSdf, const L: usize>(&mut self, name: &str, field: &F, behind: &dyn DynSdf) {
        let points: [Vector3<R>; L] = random_points(&mut self.0);
        let (samples, values) = evaluate(behind, pack_points(&points));
        for (lane, point) in points.into_iter().enumerate() {
            let (sample, value) = evaluate(field, point);
            let status = flags::<Lanes<R, L>>(samples.status)[lane];
            assert_eq!(bits(sample.value), bits(samples.value.0[lane]), "{name} at {point:?}");
            let gradient = samples.gradient.map(|x| x.0[lane]);
            assert_eq!(sample.gradient, gradient, "{name} at {point:?}");
            assert_eq!(flags::<R>(sample.status)[0], status, "{name} at {point:?}");
            assert_eq!(bits(value), bits(values.0[lane]), "{name} at {point:?}");
        }
    }
}

impl Law for Evaluations {
    fn check<F: EnclosedSdf>(&mut self, name: &str, field: &F, behind: &dyn DynSdf) {
        for _ in 0..50 {
            let [in_f32] = random_points::<f32, 1>(&mut self.0);
            let [in_f64] = random_points::<f64, 1>(&mut self.0);
            Self::same_bits(name, field, behind, in_f32);
            Self::same_bits(name, field, behind, in_f64);
            Self::same_bits(name, field, behind, pack_points(&random_points::<f32, 8>(&mut self.0)));
            Self::same_bits(name, field, behind, pack_points(&random_points::<f64, 8>(&mut self.0)));
            self.lane_by_lane::<f32, F, 4>(name, field, behind);
            self.lane_by_lane::<f64, F, 4>(name, field, behind);
        }
    }
}

#[test]
fn a_field_behind_a_pointer_evaluates_to_the_same_bits() {
    for_each_field(&mut Evaluations(Random::seeded()));
}

/// Everything that a field encloses on the first `count` corners of a tetrahedron, as text: floats print to the bit.
fn enclosed<R: Float, F: EnclosedSdf>(field: F, corners: &[Vector3<R>; 4], count: usize) -> String {
    let corners = &corners[..count];
    let mut mean = Vector3::zeros();
    corners.iter().for_each(|corner| mean += corner * R::from_f64(1.0 / count as f64));
    format!(
        "{:?} {:?} {} {:?}",
        field.enclosure(mean, corners),
        field.relaxation(mean, corners),
        field.is_convex_on(corners),
        &field.max_rise_to_corners(corners)[..count]
    )
}

/// Minima on a segment and a triangle.
type ExactMinima<R> = (Option<ExactMinimum<R, 2>>, Option<ExactMinimum<R, 3>>);

fn exact<R: Float, F: EnclosedSdf>(field: F, corners: &[Vector3<R>; 4], level: f64) -> ExactMinima<R> {
    let goal = Goal { level: R::from_f64(level), gap: R::from_f64(1e-3) };
    let [a, b, c, _] = *corners;
    (field.exact_minimum([a, b], goal), field.exact_minimum([a, b, c], goal))
}

/// Everything that a field knows of a box without an evaluation.
fn limits<F: EnclosedSdf>(field: F, region: &Aabb) -> (Aabb, f64, BoxEnclosure, f64) {
    (field.bounds(0.25), field.slope_bound(), field.enclose_box(region), field.linearization_error(region))
}

struct Enclosures {
    random: Random,
    exact_count: usize,
}

impl Enclosures {
    fn same_in<R: Float, F: EnclosedSdf>(&mut self, name: &str, field: &F, behind: &dyn DynSdf) {
        let size = self.random.pick(&[1.0, 0.3, 0.05]);
        let first = self.random.in_cube(0.6);
        let corners = std::array::from_fn(|_| (first + self.random.in_cube(size)).map(R::from_f64));
        for count in 1..=4 {
            assert_eq!(enclosed(field, &corners, count), enclosed(behind, &corners, count), "{name} on {corners:?}");
        }
        let level = self.random.between(-0.2, 0.5);
        let (one, other) = (exact(field, &corners, level), exact(behind, &corners, level));
        assert_eq!(one, other, "{name} on {corners:?}");
        let [a, b, _, _] = corners;
        self.exact_count += usize::from(field.exact_minimum([a, b], Goal::exact()).is_some());
    }
}

impl Law for Enclosures {
    fn check<F: EnclosedSdf>(&mut self, name: &str, field: &F, behind: &dyn DynSdf) {
        for _ in 0..60 {
            let corner = self.random.in_cube(1.0);
            let size = self.random.between(0.01, 0.5);
            let region = Aabb { min: corner.into(), max: corner.map(|x| x + size).into() };
            assert_eq!(limits(field, &region), limits(behind, &region), "{name} in {region:?}");
            self.same_in::<f32, F>(name, field, behind);
            self.same_in::<f64, F>(name, field, behind);
        }
    }
}

#[test]
fn a_field_behind_a_pointer_encloses_the_same_bits() {
    let mut law = Enclosures { random: Random::seeded(), exact_count: 0 };
    for_each_field(&mut law);
    assert!(law.exact_count > 100, "{} exact minima", law.exact_count);
}

struct Searches(Random);

impl Searches {
    fn same_in<R: Float, F: EnclosedSdf, const N: usize>(&mut self, name: &str, field: &F, behind: &dyn DynSdf) {
        let simplex = cast::<R, N>(&random_simplex(&mut self.0, 1.0));
        for method in [Certified::default(), Certified { evaluations: 16, ..Certified::default() }] {
            let (one, other) = (method.minimize(field, &simplex), method.minimize(&behind, &simplex));
            assert_eq!(one, other, "{name} on {simplex:?}");
        }
    }
}

/// All that a search asks of any field is compared in f32 and f64 by [`Enclosures`]. So here one number type per element is enough,
/// and one field for each way through the search: convex, bounded by curvature, by its parts, with exact minima, and posed.
/// The others would only cost the compiler their searches.
impl Law for Searches {
    fn check<F: EnclosedSdf>(&mut self, name: &str, field: &F, behind: &dyn DynSdf) {
        for _ in 0..40 {
            self.same_in::<f32, F, 3>(name, field, behind);
            self.same_in::<f64, F, 2>(name, field, behind);
        }
    }
}

#[test]
fn a_field_behind_a_pointer_is_searched_to_the_same_bits() {
    let mut law = Searches(Random::seeded());
    let (ball, block) = (Sphere::new(0.5).unwrap(), Cuboid::new([0.25, 0.5, 0.375]).unwrap());
    let (torus, difference) = (Torus::new(0.6, 0.25).unwrap(), Difference(block, ball));
    let placement = Similarity::new([0.1, 0.0, 0.3], [0.5, 0.5, 0.5, 0.5], 1.5).unwrap();
    let turned = Placed { field: sampled(&ball, cube_lattice(0.75, 16), 1.0), placement };
    law.check("cuboid", &block, &block);
    law.check("torus", &torus, &torus);
    law.check("difference", &difference, &difference);
    law.check("turned grid", &turned, &turned);
}

struct OwnNumbers(Random);

impl Law for OwnNumbers {
    fn check<F: EnclosedSdf>(&mut self, name: &str, field: &F, behind: &dyn DynSdf) {
        for _ in 0..50 {
            let [point] = random_points::<f64, 1>(&mut self.0);
            let own = point.map(OwnNumber);
            Evaluations::same_bits(name, field, behind, own);
            Evaluations::same_bits(name, field, behind, own.map(|x| Lanes([x; 3])));
            let (smooth, other) = (evaluate_smooth(field, own), evaluate_smooth(behind, own));
            assert_eq!(sample_bits(&smooth), sample_bits(&other), "{name} at {point:?}");
            let simplex = cast::<OwnNumber, 3>(&random_simplex(&mut self.0, 1.0));
            let minimum = Certified::default().minimize(&behind, &simplex);
            let value = |corner: &Vector3<OwnNumber>| field.value(*corner).0;
            let lowest = simplex.corners.iter().map(value).fold(f64::INFINITY, f64::min);
            assert!(minimum.sample.value.0 <= lowest, "{name} on {simplex:?}: {minimum:?}");
        }
    }
}

#[test]
fn a_field_behind_a_pointer_answers_in_a_number_type_of_a_users_own() {
    for_each_field(&mut OwnNumbers(Random::seeded()));
}

/// Behind a pointer a union is one field: its bits are its own, and a search does not see its parts.
#[test]
fn a_union_behind_a_pointer_evaluates_to_the_same_bits() {
    let (ball, ground) = (Sphere::new(0.5).unwrap(), HalfSpace::new([0.0, 0.0, 1.0], -0.25).unwrap());
    let parts: [&dyn DynSdf; 2] = [&ball, &ground];
    let compound = Compound::new(&parts[..]).unwrap();
    let mut law = Evaluations(Random::seeded());
    law.check("compound", &compound, &compound);
    law.check("union", &Union(ball, ground), &Union(ball, ground));
    let (union, simplex) = (Union(ball, ground), Simplex { corners: [Vector3::x(), Vector3::y(), Vector3::z() * 0.8] });
    let behind: &dyn DynSdf = &union;
    let (one, other) =
        (Certified::default().minimize(&union, &simplex), Certified::default().minimize(&behind, &simplex));
    let (one_value, other_value): (f64, f64) = (one.sample.value, other.sample.value);
    assert!((one_value - other_value).abs() < 2e-3 && other.converged, "{one:?} {other:?}");
}
