//! Laws of minimizers: promises 3, 4, 8 and 9, asked of every method, field, number type and kind of simplex.

use nalgebra::Vector3;
use sdf_core::combine::Union;
use sdf_core::minimize::{Certified, FrankWolfe, GoldenSection, Minimizer, Minimum, PointSampling, ProjectedGradient};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Cone, HalfSpace, Sphere};
use sdf_core::{Aabb, EnclosedSdf, Float, Real, Sample, Sdf, Simplex};
use sdf_tests::any_field::same;
use sdf_tests::dual::Dual;
use sdf_tests::lanes::{sample_of_lane, simplices_side_by_side};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, lattice_weights, least_of_convex, least_on_lattice, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, Scene, scenes};

/// All that a minimum says, as bits, in one lane.
fn bits<R: Real, const N: usize>(minimum: &Minimum<R, N>, to_f64: impl Fn(R) -> f64) -> Vec<u64> {
    let Minimum { weights, point, sample, lower_bound, evaluations, .. } = minimum;
    let numbers = weights.iter().chain(point.iter()).chain(sample.gradient.iter());
    numbers.chain([&sample.value, lower_bound, evaluations]).map(|x| to_f64(*x).to_bits()).collect()
}

fn one_lane_equals_the_scalar<R: Float, const L: usize, const N: usize>()
where
    Method: Minimizer<N>,
{
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        for method in methods(N, 24) {
            for _ in 0..12 {
                let alone: [Simplex<R, N>; L] = std::array::from_fn(|_| cast(&random_simplex(&mut random, scene.size)));
                let together = method.minimize(&scene, &simplices_side_by_side(&alone));
                for (lane, simplex) in alone.iter().enumerate() {
                    let alone = method.minimize(&scene, simplex);
                    let told = format!("{} by {method:?} on {simplex:?}", scene.name);
                    assert_eq!(bits(&alone, R::to_f64), bits(&together, |x| x.0[lane].to_f64()), "{told}");
                    assert_eq!(alone.converged, together.converged.0[lane], "{told}");
                    assert_eq!(alone.sample.status, sample_of_lane(&together.sample, lane).status, "{told}");
                }
            }
        }
    }
}

#[test]
fn one_lane_of_a_minimizer_equals_the_scalar_bit_for_bit_in_f32() {
    one_lane_equals_the_scalar::<f32, 8, 1>();
    one_lane_equals_the_scalar::<f32, 8, 2>();
    one_lane_equals_the_scalar::<f32, 8, 3>();
}

#[test]
fn one_lane_of_a_minimizer_equals_the_scalar_bit_for_bit_in_f64() {
    one_lane_equals_the_scalar::<f64, 4, 1>();
    one_lane_equals_the_scalar::<f64, 4, 2>();
    one_lane_equals_the_scalar::<f64, 4, 3>();
}

/// Calls the law on random simplices of every kind with every field and method.
fn everywhere<R: Real<Mask = bool>, const N: usize>(
    budget: u32,
    rounds: usize,
    law: impl Fn(&str, &Scene, &Method, &Simplex<R, N>),
) where
    Method: Minimizer<N>,
{
    let mut random = Random::of_test();
    for scene in scenes(1.0) {
        for _ in 0..rounds {
            let simplex = cast(&random_simplex(&mut random, scene.size));
            for method in methods(N, budget) {
                law(&format!("{} by {method:?} on {simplex:?}", scene.name), &scene, &method, &simplex);
            }
        }
    }
}

#[test]
fn weights_sum_to_one_and_are_never_negative() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        // A step rounds each weight about twice, and 40 steps may round the same way.
        let tolerance = 40.0 * 2.0 * N as f64 * R::EPSILON;
        everywhere::<R, N>(40, 60, |told, scene, method, simplex| {
            let weights = method.minimize(scene, simplex).weights.map(R::to_f64);
            assert!(weights.iter().all(|weight| *weight >= 0.0), "{told}: {weights:?}");
            assert!((weights.iter().sum::<f64>() - 1.0).abs() <= tolerance, "{told}: {weights:?}");
        });
    }
    check::<f32, 1>();
    check::<f32, 2>();
    check::<f32, 3>();
    check::<f64, 1>();
    check::<f64, 2>();
    check::<f64, 3>();
}

/// So that it is neither below the truth nor made up: the value is the field's own at a point of the simplex.
#[test]
fn the_sample_is_the_fields_own_at_the_point_of_the_weights() {
    fn check<R: Real<Mask = bool>, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        everywhere::<R, N>(24, 40, |told, scene, method, simplex| {
            let minimum = method.minimize(scene, simplex);
            assert_eq!(minimum.point, simplex.point(minimum.weights), "{told}");
            let sample = scene.evaluate(minimum.point);
            assert!(sample.value.le(minimum.sample.value) && minimum.sample.value.le(sample.value), "{told}");
            assert_eq!(sample.status, minimum.sample.status, "{told}");
        });
    }
    check::<f32, 1>();
    check::<f32, 2>();
    check::<f32, 3>();
    check::<f64, 1>();
    check::<f64, 2>();
    check::<f64, 3>();
}

#[test]
fn a_dual_number_walks_the_same_way_as_its_value() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        everywhere::<f64, N>(16, 20, |told, scene, method, simplex| {
            let dual = method.minimize(scene, &cast::<Dual<f64>, N>(simplex));
            let alone = method.minimize(scene, simplex);
            assert_eq!(bits(&alone, |x| x), bits(&dual, |x| x.value), "{told}");
        });
    }
    check::<1>();
    check::<2>();
    check::<3>();
}

#[test]
fn where_a_brief_search_converges_it_answers_what_the_method_does() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let (converged, left_over) = (std::cell::Cell::new(0), std::cell::Cell::new(0));
        everywhere::<R, N>(24, 20, |told, scene, method, simplex| {
            let Some(quick_pass) = Minimizer::<N>::quick_pass(method) else { return };
            let found = quick_pass.minimize(scene, simplex);
            if !found.converged {
                left_over.set(left_over.get() + 1);
                return;
            }
            converged.set(converged.get() + 1);
            let whole = method.minimize(scene, simplex);
            assert!(whole.converged, "{told}");
            assert_eq!(bits(&found, R::to_f64), bits(&whole, R::to_f64), "{told}");
        });
        assert!(converged.get() > 0 && (N == 1 || left_over.get() > 0), "not both are seen");
    }
    check::<f32, 2>();
    check::<f32, 3>();
    check::<f64, 1>();
    check::<f64, 2>();
    check::<f64, 3>();
}

/// Points sampled on a segment are left out: more of them are other points, and may be worse ones.
#[test]
fn more_iterations_never_make_it_worse() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::of_test();
        for scene in scenes(1.0) {
            for _ in 0..10 {
                let simplex = cast::<R, N>(&random_simplex(&mut random, scene.size));
                let corners = simplex.corners.map(|corner| scene.value(corner));
                for which in 0..methods(N, 0).len() {
                    let mut last: Option<Minimum<R, N>> = None;
                    for budget in 0..40 {
                        let method = methods(N, budget)[which];
                        let points = matches!(method, Method::PointSampling(_));
                        if points && N == 2 {
                            continue;
                        }
                        let now = method.minimize(&scene, &simplex);
                        let told = format!("{} by {method:?} on {simplex:?}", scene.name);
                        if !points {
                            // A corner is asked at first + (corner − first), which rounds.
                            let rounding = R::EPSILON * 8.0 * scene.size * scene.slope_bound();
                            let value = now.sample.value.to_f64() - rounding;
                            assert!(corners.iter().all(|corner| value <= corner.to_f64()), "{told}");
                        }
                        if let Some(last) = last {
                            assert!(now.sample.value <= last.sample.value, "{told}");
                            assert!(now.evaluations >= last.evaluations, "{told}");
                            assert!(now.converged >= last.converged, "{told}: converged, and then no more");
                        }
                        last = Some(now);
                    }
                }
            }
        }
    }
    check::<f32, 2>();
    check::<f32, 3>();
    check::<f64, 1>();
    check::<f64, 2>();
    check::<f64, 3>();
}

/// Straight up a plane's normal the slope bound is met, and only rounding is left between bound and value.
#[test]
fn the_lower_bound_holds_where_the_slope_bound_is_met() {
    fn check<R: Float>() {
        let mut random = Random::of_test();
        let middle = PointSampling { samples: 1 };
        for _ in 0..5000 {
            let normal = random.direction();
            let plane = HalfSpace::new(normal.into(), random.between(-1.0, 1.0)).unwrap();
            let (from, length) = (random.in_cube(2.0), random.between(0.0, 2.0));
            let simplex = cast::<R, 2>(&Simplex { corners: [from, from + normal * length] });
            let minimum = middle.minimize(&plane, &simplex);
            let lowest = simplex.corners.map(|corner| plane.value(corner)).into_iter().reduce(Real::min).unwrap();
            assert!(minimum.lower_bound <= lowest, "{minimum:?} on {simplex:?}, but {lowest:?}");
        }
    }
    check::<f32>();
    check::<f64>();
}

#[test]
fn the_lower_bound_is_below_every_value_on_the_simplex() {
    fn check<R: Float, const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let lattice: Vec<[R; N]> = lattice_weights::<N>(12).into_iter().map(|w| w.map(R::from_f64)).collect();
        for budget in [0, 1, 24] {
            everywhere::<R, N>(budget, 40, |told, scene, method, simplex| {
                let minimum = method.minimize(scene, simplex);
                assert!(minimum.lower_bound <= minimum.sample.value, "{told}");
                for weights in &lattice {
                    let value = scene.value(simplex.point(*weights));
                    assert!(minimum.lower_bound <= value, "{told}: {minimum:?} at {weights:?}: {value:?}");
                }
            });
        }
    }
    check::<f32, 1>();
    check::<f32, 2>();
    check::<f32, 3>();
    check::<f64, 1>();
    check::<f64, 2>();
    check::<f64, 3>();
}

/// The lattice misses the truth by at most slope bound · longest edge / parts.
#[test]
fn the_value_is_not_below_what_a_lattice_allows() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        const PARTS: usize = 16;
        everywhere::<f64, N>(24, 40, |told, scene, method, simplex| {
            let minimum = method.minimize(scene, simplex);
            let least = least_on_lattice(scene, simplex, PARTS);
            let slack = scene.slope_bound() * simplex.longest_edge() / PARTS as f64;
            let rounding = 1e-12 * scene.size;
            assert!(minimum.sample.value >= least - slack - rounding, "{told}: {} < {least}", minimum.sample.value);
        });
    }
    check::<1>();
    check::<2>();
    check::<3>();
}

/// A field that counts how often it is asked.
struct Counted<'a>(&'a Scene, std::cell::Cell<u32>);

impl Sdf for Counted<'_> {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.1.set(self.1.get() + 1);
        self.0.evaluate(point)
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        self.0.slope_bound()
    }
}

impl EnclosedSdf for Counted<'_> {}

#[test]
fn evaluations_are_at_how_many_points_the_field_was_asked() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        everywhere::<f64, N>(24, 10, |told, scene, method, simplex| {
            let counted = Counted(scene, Default::default());
            let minimum = method.minimize(&counted, simplex);
            // Point sampling asks the lowest of its points a second time, for the gradient.
            let again = u32::from(matches!(method, Method::PointSampling(_)));
            assert_eq!(minimum.evaluations, f64::from(counted.1.get() - again), "{told}");
        });
    }
    check::<1>();
    check::<2>();
    check::<3>();
}

/// A field that keeps the least value that it answered.
struct Remembered<'a>(&'a Scene, std::cell::Cell<f64>);

impl Sdf for Remembered<'_> {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let sample = self.0.evaluate(point);
        self.1.set(self.1.get().min(sample.value.lane(0).to_f64()));
        sample
    }
    fn bounds(&self, level: f64) -> Aabb {
        self.0.bounds(level)
    }
    fn slope_bound(&self) -> f64 {
        self.0.slope_bound()
    }
}

impl EnclosedSdf for Remembered<'_> {}

/// The certified search is left out: what it found in a piece it asks anew at the weights in the whole, and that rounds.
#[test]
fn the_value_is_the_least_that_the_field_answered() {
    fn check<const N: usize>(budget: u32)
    where
        Method: Minimizer<N>,
    {
        everywhere::<f64, N>(budget, 10, |told, scene, method, simplex| {
            if matches!(method, Method::Certified(_)) {
                return;
            }
            let remembered = Remembered(scene, f64::INFINITY.into());
            let minimum = method.minimize(&remembered, simplex);
            assert_eq!(minimum.sample.value, remembered.1.get(), "{told}");
        });
    }
    // Small budgets end before the condition for a minimum does, and what was asked last is often the least.
    for budget in [0, 1, 2, 3, 24] {
        check::<1>(budget);
        check::<2>(budget);
        check::<3>(budget);
    }
}

/// §3.2 of the paper with i from 0 goes to a corner first, whatever the start: after one step only the three corners
/// could come out.
#[test]
fn frank_wolfe_does_not_forget_where_it_started() {
    let mut random = Random::of_test();
    let once = FrankWolfe { iterations: 1, ..FrankWolfe::default() };
    let mut results: Vec<[f64; 3]> = vec![];
    for scene in scenes(1.0) {
        for _ in 0..100 {
            let weights = once.minimize(&scene, &random_simplex::<3>(&mut random, scene.size)).weights;
            if !results.contains(&weights) {
                results.push(weights);
            }
        }
    }
    assert!(results.len() > 3, "only {results:?}");
}

/// Every minimum over the table at one scale, from the same random numbers.
fn minima_at<R: Float, const N: usize>(scale: f64) -> Vec<(String, Minimum<R, N>)>
where
    Method: Minimizer<N>,
{
    let mut random = Random::of_test();
    let mut minima = vec![];
    for (scene, unscaled) in scenes(scale).iter().zip(scenes(1.0)) {
        for _ in 0..15 {
            let mut simplex = random_simplex::<N>(&mut random, unscaled.size);
            for corner in &mut simplex.corners {
                // In single precision before the scaling, so that it is exact.
                *corner = corner.map(|x| f64::from(x as f32) * scale);
            }
            for method in methods(N, 32) {
                let told = format!("{} by {method:?} on {simplex:?}", scene.name);
                minima.push((told, method.minimize(scene, &cast::<R, N>(&simplex))));
            }
        }
    }
    minima
}

/// Powers of two multiply without rounding, so nothing may change but exponents.
#[test]
fn scaling_by_powers_of_two_leaves_weights_bit_for_bit() {
    fn check<R: Float, const N: usize>(powers: &[i32])
    where
        Method: Minimizer<N>,
    {
        let plain = minima_at::<R, N>(1.0);
        for power in powers {
            let scale = 2.0_f64.powi(*power);
            for ((told, was), (_, is)) in plain.iter().zip(minima_at::<R, N>(scale)) {
                assert_eq!(was.weights, is.weights, "{told}, by 2^{power}");
                assert_eq!(was.sample.gradient, is.sample.gradient, "{told}, by 2^{power}");
                assert_eq!((was.evaluations, was.converged), (is.evaluations, is.converged), "{told}, by 2^{power}");
                for (was, is) in [(was.sample.value, is.sample.value), (was.lower_bound, is.lower_bound)] {
                    assert_eq!(was.to_f64() * scale, is.to_f64(), "{told}, by 2^{power}");
                }
            }
        }
    }
    // The squares of lengths, and of coordinates near zero, stay within each type's normal numbers.
    check::<f64, 2>(&[-60, -3, 10, 60]);
    check::<f64, 3>(&[-60, -3, 10, 60]);
    check::<f32, 2>(&[-12, -3, 10, 20]);
    check::<f32, 3>(&[-12, -3, 10, 20]);
}

/// By other factors every number is rounded anew, and where two corners are equally low a method's path can part: single
/// elements may stop elsewhere, but no more than one of fifty.
#[test]
fn scaling_by_any_factor_multiplies_distances() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let plain = minima_at::<f64, N>(1.0);
        for scale in [1e-6, 1e-3, 1e3, 1e6] {
            let mut apart = 0;
            for ((told, was), (_, is)) in plain.iter().zip(minima_at::<f64, N>(scale)) {
                let error = (was.sample.value - is.sample.value / scale).abs();
                let moved = (0..N).map(|k| (was.weights[k] - is.weights[k]).abs()).fold(0.0, f64::max);
                // Samples are stored in f32: at another scale they are other numbers, by 6e-8 of themselves, and may get
                // another code: a brick's values range over at most 0.43.
                let precision = match () {
                    () if told.contains("in u8") => 0.43 / 255.0,
                    () if told.contains("in u16") => 0.43 / 65_535.0,
                    () if told.contains("grid") => 1e-6,
                    () => 1e-9,
                };
                if error > precision || moved > 1e3 * precision {
                    apart += 1;
                }
            }
            // A method that depended on the scale would part nearly everywhere.
            assert!(apart * 50 < plain.len(), "by {scale}: {apart} of {} differ", plain.len());
        }
    }
    check::<2>();
    check::<3>();
}

/// At 1e6 a coordinate is a multiple of 1e-10. The triangles stay off the sphere's centre, where the gradient turns faster
/// than a step is long and any difference grows.
#[test]
fn far_from_the_origin_weights_are_as_near_it() {
    let mut random = Random::of_test();
    let all = scenes(1.0);
    let near = all.iter().find(|scene| scene.name == "sphere").unwrap();
    let away = Vector3::new(1e6, -1e6, 1e6);
    let placement = Rigid::new(away.into(), [0.0, 0.0, 0.0, 1.0]).unwrap();
    let far = Placed { field: near, placement };
    for _ in 0..300 {
        let simplex = Simplex { corners: [(); 3].map(|()| random.in_cube(1.0) + Vector3::z() * 1.5) };
        let moved = Simplex { corners: simplex.corners.map(|corner| corner + away) };
        for method in methods(3, 32) {
            let (was, is) = (method.minimize(near, &simplex), method.minimize(&far, &moved));
            let told = format!("{method:?} on {simplex:?}: {was:?}, far away {is:?}");
            // Which of two points is lower decides how long its steps are; cut short, it ends elsewhere.
            if matches!(method, Method::LineSearch(_)) && !(was.converged && is.converged) {
                continue;
            }
            assert!((was.sample.value - is.sample.value).abs() < 1e-8, "{told}");
            assert!((0..3).all(|k| (was.weights[k] - is.weights[k]).abs() < 1e-4), "{told}");
        }
    }
}

/// With corners that are exact at either place the first step is too: its slopes come from edges. Those of §3.1 of the
/// paper, from the corners themselves, have lost the digits that the coordinates take.
#[test]
fn far_from_the_origin_the_first_step_is_bit_for_bit_the_same() {
    fn check<R: Float>(away: f64, parts: f64) {
        let mut random = Random::of_test();
        let sphere = Sphere::new(0.75).unwrap();
        let placement = Rigid::new([away, -away, away], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let far = Placed { field: sphere, placement };
        let once = ProjectedGradient { iterations: 1, ..ProjectedGradient::default() };
        let (mut steps, mut parted) = (0, 0);
        for _ in 0..500 {
            let corners = [(); 3].map(|()| random.in_cube(2.0).map(|x| (x * parts).round() / parts));
            let moved = corners.map(|corner| corner + Vector3::new(away, -away, away));
            let was = once.minimize(&sphere, &cast::<R, 3>(&Simplex { corners }));
            let is = once.minimize(&far, &cast::<R, 3>(&Simplex { corners: moved }));
            let stays = [was.weights, is.weights].map(|weights| weights.contains(&R::one()));
            if stays[0] != stays[1] {
                // Start and step are as low but for the rounding of their values, and the other one is the best.
                parted += 1;
                continue;
            }
            assert_eq!(was.weights, is.weights, "{corners:?}");
            steps += usize::from(!stays[0]);
        }
        assert!(steps > 100 && parted < 5, "{steps} steps, {parted} parted");
    }
    check::<f32>(1024.0, 256.0);
    check::<f64>(1048576.0, 1024.0);
}

/// The error over longest edge · slope bound that each method may leave on a convex field after 32 steps: in the median,
/// and at worst. Worst is what a wedge costs, where the gradient jumps at the minimum: Frank-Wolfe comes back to it as
/// 2/(i + 2), a fixed step jumps over it, a line search along it ends, and they were seen to leave up to 0.3. Half of the parts of a segment, 1/66, is the
/// most that 33 points leave; of a triangle, about the diameter of a sixteenth, 1/4. Golden section ends at its tolerance; so does
/// a certified search, with the 128 evaluations that it has here, nearly always.
#[test]
fn on_convex_fields_every_method_comes_near_the_truth() {
    fn check<const N: usize>(allowed: &[(&str, f64, f64)])
    where
        Method: Minimizer<N>,
    {
        let mut random = Random::of_test();
        let mut errors: Vec<Vec<f64>> = vec![vec![]; allowed.len()];
        for scene in scenes(1.0).iter().filter(|scene| scene.convex) {
            for _ in 0..40 {
                let simplex = random_simplex::<N>(&mut random, scene.size);
                let unit = scene.slope_bound() * simplex.longest_edge();
                let truth = least_of_convex(scene, &simplex);
                for (which, method) in methods(N, 32).iter().enumerate() {
                    let minimum = method.minimize(scene, &simplex);
                    let error = minimum.sample.value - truth;
                    let told = format!("{} by {method:?} on {simplex:?}: off by {error}", scene.name);
                    assert!(error >= -1e-9 * scene.size, "{told}: below the truth");
                    if unit > 1e-6 {
                        errors[which].push(error / unit);
                    }
                }
            }
        }
        for ((name, median, worst), mut errors) in allowed.iter().zip(errors) {
            errors.sort_by(f64::total_cmp);
            let (middle, last) = (errors[errors.len() / 2], errors[errors.len() - 1]);
            println!("{name}: median {middle:e}, worst {last:e} of {}", errors.len());
            assert!(middle <= *median && last <= *worst, "{name}: median {middle:e}, worst {last:e}");
        }
    }
    check::<2>(&[
        ("Frank-Wolfe", 1e-9, 0.5),
        ("projected gradient", 1e-9, 0.5),
        ("points", 0.01, 1.0 / 66.0 + 1e-9),
        ("line search", 1e-9, 0.5),
        ("Newton", 1e-9, 1e-3),
        ("certified", 1e-4, 1.1e-3),
        ("golden section", 1e-9, 2e-6),
    ]);
    check::<3>(&[
        ("Frank-Wolfe", 1e-9, 0.5),
        ("projected gradient", 1e-9, 0.5),
        ("points", 0.05, 0.25),
        ("line search", 1e-9, 0.5),
        ("Newton", 1e-9, 1e-3),
        ("certified", 1e-4, 1.5e-3),
    ]);
}

/// The paper's open point: several minima on one element. Corners are asked first, so the ends are not lost.
#[test]
fn three_spheres_under_an_edge_do_not_hide_its_ends() {
    let at = |x: f64, radius: f64| Placed {
        field: Sphere::new(radius).unwrap(),
        placement: Rigid::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(),
    };
    let spheres = Union(Union(at(0.0, 0.3), at(2.0, 0.1)), at(4.0, 0.3));
    let edge = Simplex { corners: [Vector3::zeros(), Vector3::new(4.0, 0.0, 0.0)] };
    let minimum = GoldenSection::default().minimize(&spheres, &edge);
    assert_eq!(minimum.sample.value, -0.3);
}

#[test]
fn a_budget_of_nothing_still_answers() {
    let sphere = Sphere::new(1.0).unwrap();
    let edge = Simplex { corners: [Vector3::new(2.0, 0.0, 0.0), Vector3::new(3.0, 0.0, 0.0)] };
    let none = [
        FrankWolfe { iterations: 0, ..FrankWolfe::default() }.minimize(&sphere, &edge),
        ProjectedGradient { iterations: 0, ..ProjectedGradient::default() }.minimize(&sphere, &edge),
        GoldenSection { iterations: 0, ..GoldenSection::default() }.minimize(&sphere, &edge),
    ];
    for minimum in none {
        assert_eq!((minimum.weights, minimum.sample.value, minimum.converged), ([1.0, 0.0], 1.0, false));
    }
    assert_eq!(PointSampling { samples: 0 }.minimize(&sphere, &edge).sample.value, 1.5);
}

/// A field that notes where it is asked, in f64.
struct Noted(std::cell::RefCell<Vec<Vector3<f64>>>);

impl Sdf for Noted {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        self.0.borrow_mut().extend(same::<_, Vector3<f64>>(point));
        Sample::new(R::zero(), Vector3::zeros())
    }
    fn bounds(&self, _level: f64) -> Aabb {
        Aabb::EVERYWHERE
    }
    fn slope_bound(&self) -> f64 {
        0.0
    }
}

impl EnclosedSdf for Noted {}

/// The weights of the points that a triangle is sampled at.
fn sampled_weights(samples: u32) -> Vec<[f64; 3]> {
    let noted = Noted(Default::default());
    // Where the second and third weight are x and y.
    let triangle = Simplex::<f64, 3> { corners: [Vector3::zeros(), Vector3::x(), Vector3::y()] };
    PointSampling { samples }.minimize(&noted, &triangle);
    let mut points = noted.0.into_inner();
    // Where the least is, the field is asked a second time, for the gradient.
    let again = points.pop().expect("a point that was asked");
    assert!(points.contains(&again));
    points.into_iter().map(|point| [1.0 - point.x - point.y, point.x, point.y]).collect()
}

fn is_within(weights: [f64; 3], triangle: &[[f64; 3]; 3]) -> bool {
    // In barycentric weights every edge of a quarter, of a quarter's quarter, … is one weight equal to a constant.
    (0..3).all(|k| {
        let (low, high) = triangle.iter().fold((1.0_f64, 0.0_f64), |(low, high), at| (low.min(at[k]), high.max(at[k])));
        (low..=high).contains(&weights[k])
    })
}

fn quarters(of: Vec<[[f64; 3]; 3]>) -> Vec<[[f64; 3]; 3]> {
    let middle = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|k| (a[k] + b[k]) / 2.0);
    of.into_iter()
        .flat_map(|[a, b, c]| {
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            [[bc, ca, ab], [a, ab, ca], [ab, b, bc], [ca, bc, c]]
        })
        .collect()
}

/// Basu and Owen 2015, §3: the first is the centroid, the next three are the corner quarters' own, and the first 4ᵏ
/// points put one into each of the 4ᵏ equal parts.
#[test]
fn sampled_points_cover_a_triangle_as_published() {
    let sixths: Vec<_> = sampled_weights(4).into_iter().map(|w| w.map(|w| (w * 6e12).round() / 1e12)).collect();
    assert_eq!(sixths, [[2.0, 2.0, 2.0], [4.0, 1.0, 1.0], [1.0, 4.0, 1.0], [1.0, 1.0, 4.0]]);

    let mut parts = vec![[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]];
    for count in [4, 16, 64, 256] {
        parts = quarters(parts);
        let points = sampled_weights(count);
        assert_eq!(points.len(), count as usize);
        for (i, point) in points.iter().enumerate() {
            assert!(point.iter().all(|weight| *weight > 0.0), "{point:?}");
            assert!(!points[..i].contains(point), "{point:?} comes twice");
        }
        for part in &parts {
            let held = points.iter().filter(|point| is_within(**point, part)).count();
            assert_eq!(held, 1, "{held} of {count} points in {part:?}");
        }
    }
}

#[test]
fn point_sampling_returns_the_least_of_exactly_these_points() {
    let mut random = Random::of_test();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning != Meaning::Samples) {
        let simplex = random_simplex::<3>(&mut random, scene.size);
        for samples in [1, 4, 16, 64] {
            let values = sampled_weights(samples).into_iter().map(|weights| scene.value(simplex.point(weights)));
            let least = values.fold(f64::INFINITY, f64::min);
            let minimum = PointSampling { samples }.minimize(scene, &simplex);
            assert_eq!((minimum.sample.value, minimum.evaluations), (least, f64::from(samples)), "{}", scene.name);
            assert!(!minimum.converged);
        }
    }
}

#[test]
fn what_is_certified_holds_and_is_as_near_as_was_asked() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        for scene in scenes(1.0) {
            let mut converged = 0;
            for round in 0..40 {
                let simplex = cast::<R, N>(&random_simplex(random, scene.size));
                let method = Certified { evaluations: [16, 400, 4000][round % 3], ..Certified::default() };
                let minimum = method.minimize(&scene, &simplex);
                let told = || format!("{} by {method:?} on {simplex:?}: {minimum:?}", scene.name);
                let least = least_on_lattice(&scene, &simplex, 24);
                assert!(minimum.lower_bound <= least && minimum.lower_bound <= minimum.sample.value, "{}", told());
                if minimum.converged {
                    converged += 1;
                    let gap = (minimum.sample.value - minimum.lower_bound).to_f64();
                    // Eight times the 32 roundings that a bound allows for, of coordinates and edges up to six sizes.
                    let rounding = 6.0 * 8.0 * 32.0 * R::EPSILON * scene.size * scene.slope_bound().max(1.0);
                    let most = method.tolerance * simplex.longest_edge().to_f64() * scene.slope_bound();
                    assert!(gap <= most + rounding, "{gap} > {most}: {}", told());
                }
            }
            // A third of the budgets is too small on purpose.
            assert!(converged > 12, "{}: {converged} of 40 in time", scene.name);
        }
    }
    let mut random = Random::of_test();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f32, 2>(&mut random);
    check::<f32, 3>(&mut random);
}

/// What `sdftool contacts` does unasked: slivers, collinear and pointlike ones among the elements.
#[test]
fn within_256_evaluations_convex_fields_are_certified_to_a_thousandth_of_an_edge() {
    fn off<const N: usize>(random: &mut Random, rounds: usize) -> (usize, usize) {
        let (mut off, mut asked) = (0, 0);
        for scene in scenes(1.0).iter().filter(|scene| scene.convex) {
            for _ in 0..rounds {
                let simplex = random_simplex::<N>(random, scene.size);
                let method = Certified { evaluations: 256, ..Certified::default() };
                let found = method.minimize(scene, &simplex).sample.value;
                let most = 1e-3 * simplex.longest_edge() * scene.slope_bound() + 1e-12 * scene.size;
                off += usize::from(found > least_of_convex(scene, &simplex) + most);
                asked += 1;
            }
        }
        (off, asked)
    }
    let mut random = Random::of_test();
    assert_eq!(off::<2>(&mut random, 100).0, 0);
    let (off, asked) = off::<3>(&mut random, 60);
    assert!(off * 200 <= asked, "{off} of {asked}");
}

/// Three balls under an edge, the outer ones larger: a search that halves its bracket ends at the middle one.
#[test]
fn of_several_minima_the_lowest_is_certified() {
    let ball = |radius, x| Placed {
        field: Sphere::new(radius).unwrap(),
        placement: Rigid::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(),
    };
    let balls = Union(ball(0.3, 0.0), Union(ball(0.1, 2.0), ball(0.3, 4.0)));
    let edge = Simplex { corners: [Vector3::zeros(), Vector3::new(4.0, 0.0, 0.0)] };
    let minimum = Certified::default().minimize(&balls, &edge);
    assert!((minimum.sample.value + 0.3_f64).abs() < 1e-12 && minimum.converged, "{minimum:?}");
    // Neither at a corner: the lowest of nine dents, under the middle of a triangle.
    let dents = Union(ball(0.2, 1.0), Union(ball(0.35, 1.7), ball(0.3, 2.5)));
    let triangle =
        Simplex { corners: [[-1.0, -2.0, 0.5], [5.0, -2.0, 0.5], [1.7, 4.0, 0.5]].map(Vector3::<f64>::from) };
    let minimum = Certified::default().minimize(&dents, &triangle);
    assert!((minimum.sample.value - 0.15).abs() < 6e-3 && minimum.converged, "{minimum:?}");
    assert!((minimum.point - Vector3::new(1.7, 0.0, 0.5)).norm() < 0.1, "{minimum:?}");
}

/// A cone's apex through the inside of a triangle: what sampling and fixed steps miss (Fig. 2 of the paper).
#[test]
fn the_apex_of_a_cone_is_found_within_128_evaluations() {
    let mut random = Random::of_test();
    let (mut found, mut missed_by_sampling) = (0, 0);
    const CASES: usize = 300;
    for _ in 0..CASES {
        let angle = random.between(2.0, 30.0_f64).to_radians();
        let cone = Cone::new(angle, 2.0).unwrap();
        // The apex stands a hundredth of the edge's length above the plane of the triangle, or less.
        let depth = 10.0_f64.powf(random.between(-4.0, -2.0));
        let mut weights = [random.unit() + 0.05, random.unit() + 0.05, random.unit() + 0.05];
        let sum: f64 = weights.iter().sum();
        weights = weights.map(|weight| weight / sum);
        let corners = [0, 1, 2].map(|_| Vector3::new(random.between(-0.5, 0.5), random.between(-0.5, 0.5), 0.0));
        let through = Simplex { corners }.point(weights);
        let triangle = Simplex { corners: corners.map(|corner| corner - through - Vector3::z() * depth) };
        let method = Certified { evaluations: 128 - 15, tolerance: 1e-3, ..Certified::default() };
        let minimum = method.minimize(&cone, &triangle);
        let truth = -depth * angle.sin();
        assert!(minimum.evaluations <= 130.0);
        let tolerance = 1e-3 * triangle.longest_edge();
        found += usize::from(minimum.sample.value <= truth + tolerance);
        let sampled = PointSampling { samples: 64 }.minimize(&cone, &triangle);
        missed_by_sampling += usize::from(sampled.sample.value > truth + tolerance);
    }
    assert!(found * 100 >= CASES * 99, "{found} of {CASES}");
    assert!(missed_by_sampling * 2 > CASES, "no test of it: sampling misses {missed_by_sampling} of {CASES}");
}
