//! The minimum of a ball, an ellipsoid, a capsule or a half-space on a segment or triangle, in closed form: its bound is below what a search
//! finds, and its value is that of the search. On triangles of all kinds: far away, tiny, slivers, across the centre or along the axis.

use nalgebra::Vector3;
use sdf_core::minimize::{Certified, Minimizer, Minimum, Newton};

use sdf_core::shapes::{Capsule, Ellipsoid, HalfSpace, Sphere};
use sdf_core::{Aabb, EnclosedSdf, Float, Goal, Real, Sample, Sdf, Simplex};
use sdf_tests::oracle::cast;
use sdf_tests::random::Random;

/// The same convex field without its closed form.
struct Searched<'a, F>(&'a F);

impl<F: Sdf> Sdf for Searched<'_, F> {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.0.evaluate(point)
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        self.0.slope_bound()
    }
    fn magnitude<R: Real>(&self) -> R {
        self.0.magnitude()
    }
    fn extent<R: Real>(&self) -> R {
        self.0.extent()
    }
}

impl<F: Sdf> EnclosedSdf for Searched<'_, F> {
    const IS_CONVEX: bool = true;
}

/// Corners about a place, in a size, flattened or drawn along a direction.
fn element<const N: usize>(random: &mut Random, along: Vector3<f64>) -> [Vector3<f64>; N] {
    let size = random.pick(&[1e-6, 1e-3, 0.1, 1.0, 1.0, 3.0, 100.0]);
    let place = match random.pick(&[0, 1, 2, 3]) {
        0 => Vector3::zeros(),
        1 => along * random.between(-1.0, 1.0),
        _ => random.in_cube(2.0),
    };
    let mut corners = [(); N].map(|()| random.in_cube(size));
    match random.pick(&[0, 1, 2, 3, 4]) {
        // A sliver, a repeated corner, an edge along the axis, one in its plane.
        0 => {
            corners[N - 1] =
                corners[0] + (corners[1] - corners[0]) * random.between(-1.0, 1.0) + random.in_cube(1e-5 * size)
        }
        1 => corners[N - 1] = corners[0],
        2 => corners[1] = corners[0] + along * random.between(-1.0, 1.0),
        3 => corners[1] = corners[0] + along * random.between(-1.0, 1.0) + random.in_cube(1e-9 * size),
        _ => {}
    }
    corners.map(|corner| place + corner)
}

fn check<R: Float, F: Sdf + EnclosedSdf, const N: usize>(
    field: &F,
    along: Vector3<f64>,
    random: &mut Random,
    known: &mut usize,
) {
    let simplex = cast::<R, N>(&Simplex { corners: element(random, along) });
    let corners = simplex.corners;
    let search = Certified { evaluations: 4096, tolerance: 1e-3, local: Newton { iterations: 64, tolerance: 1e-12 } };
    let searched: Minimum<R, N> = search.minimize(&Searched(field), &simplex);
    let found: Minimum<R, N> = search.minimize(field, &simplex);
    // 32 operations that round at the size of the coordinates, and as many of the search.
    let largest =
        corners.iter().flat_map(|corner| corner.iter().copied()).fold(1.0, |a: f64, x| a.max(x.to_f64().abs()));
    let rounding = 128.0 * R::EPSILON * largest;
    let [value, of_search] = [found, searched].map(|minimum| minimum.sample.value.to_f64());
    let context = || format!("{found:?} and {searched:?} on {corners:?}");
    assert!(found.converged, "{}", context());
    assert!(found.lower_bound.to_f64() <= of_search, "above what a search finds: {}", context());
    assert!(searched.lower_bound.to_f64() <= value, "below the bound of a search: {}", context());
    let tolerance = 1e-9 * simplex.longest_edge().to_f64();
    assert!(value <= of_search + tolerance + rounding, "higher than what a search finds: {}", context());
    // A search cuts and rounds weights again and again.
    let sum: f64 = found.weights.iter().map(|weight| weight.to_f64()).sum();
    assert!(found.weights.iter().all(|weight| R::zero() <= *weight) && (sum - 1.0).abs() <= 8.0 * R::EPSILON);
    *known += usize::from(field.exact_minimum(corners, Goal::exact()).is_some());
}

fn check_all<F: Sdf + EnclosedSdf>(field: &F, along: Vector3<f64>, random: &mut Random) {
    let (count, mut known, mut in_single) = (20_000, 0, 0);
    for _ in 0..count {
        check::<f64, _, 3>(field, along, random, &mut known);
        check::<f64, _, 2>(field, along, random, &mut known);
        check::<f32, _, 3>(field, along, random, &mut in_single);
        check::<f32, _, 2>(field, along, random, &mut in_single);
    }
    // Slivers, and segments that rounding leaves open, are searched; so are all in single precision, but on a half-space.
    assert!(known as f64 > 0.7 * 2.0 * f64::from(count), "{known} of {} are known", 2 * count);
    assert!(in_single == 0 || in_single == 2 * count as usize, "{in_single}");
}

#[test]
fn the_minimum_that_a_shape_knows_is_that_of_a_search() {
    let random = &mut Random::seeded();
    check_all(&Sphere::new(1.0).unwrap(), Vector3::x(), random);
    for radii in [[1.0, 0.7, 0.5], [0.02, 1.0, 1.0], [1e-6, 1.0, 0.3]] {
        check_all(&Ellipsoid::new(radii).unwrap(), Vector3::z(), random);
    }
    let (a, b) = ([-0.4, 0.1, 0.3], [0.5, -0.2, 0.4]);
    check_all(&Capsule::new(a, b, 0.3).unwrap(), Vector3::from(b) - Vector3::from(a), random);
    check_all(&Capsule::new(a, a, 0.3).unwrap(), Vector3::from(a), random);
    check_all(&HalfSpace::new([0.3, -0.2, 0.9], 0.1).unwrap(), Vector3::x(), random);
}
