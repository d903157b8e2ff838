//! Scene and simplex scaled or moved together: the weights stay.

use nalgebra::Vector3;
use sdf_core::minimize::{Minimizer, Minimum, ProjectedGradient};
use sdf_core::placed::{Placed, Placement, Posed, Similarity};
use sdf_core::shapes::Sphere;
use sdf_core::{EnclosedSdf, Float, Simplex};
use sdf_tests::methods::{Method, methods};
use sdf_tests::oracle::{cast, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{cube_lattice, sampled, scenes, shifted};

/// A minimum, and the scene and method that it is from.
type Named<R, const N: usize> = (&'static str, Method, Minimum<R, N>);

/// Every minimum over the table at one scale, with the same random numbers.
fn minima_at<R: Float, const N: usize>(scale: f64) -> Vec<Named<R, N>>
where
    Method: Minimizer<N>,
{
    let mut random = Random::seeded();
    let mut minima = vec![];
    for (scene, unscaled) in scenes(scale).iter().zip(scenes(1.0)) {
        for _ in 0..8 {
            let mut simplex = random_simplex::<N>(&mut random, unscaled.size);
            for corner in &mut simplex.corners {
                // Rounded to f32 before the scaling, so that scaling by a power of two is exact.
                *corner = corner.map(|x| f64::from(x as f32) * scale);
            }
            for method in methods(N, 32) {
                minima.push((scene.name, method, method.minimize(&scene.field, &cast::<R, N>(&simplex))));
            }
        }
    }
    minima
}

/// Multiplication by a power of two does not round: only exponents may change.
#[test]
fn scaling_by_powers_of_two_leaves_weights_bit_for_bit() {
    fn check<R: Float, const N: usize>(powers: &[i32])
    where
        Method: Minimizer<N>,
    {
        let plain = minima_at::<R, N>(1.0);
        for power in powers {
            let scale = 2.0_f64.powi(*power);
            for ((name, method, was), (_, _, is)) in plain.iter().zip(minima_at::<R, N>(scale)) {
                let context = || format!("{name} by {method:?}, scaled by 2^{power}: {was:?}, {is:?}");
                assert_eq!(was.weights, is.weights, "{}", context());
                assert_eq!(was.sample.gradient, is.sample.gradient, "{}", context());
                assert_eq!((was.evaluations, was.converged), (is.evaluations, is.converged), "{}", context());
                for (was, is) in [(was.sample.value, is.sample.value), (was.lower_bound, is.lower_bound)] {
                    assert_eq!(was.to_f64() * scale, is.to_f64(), "{}", context());
                }
            }
        }
    }
    // Squares of lengths, and of coordinates near zero, stay normal in each type.
    check::<f64, 2>(&[-60, -1, 60]);
    check::<f64, 3>(&[-60, -1, 60]);
    check::<f32, 2>(&[-12, 1, 20]);
    check::<f32, 3>(&[-12, 1, 20]);
}

/// Other factors round every number again, and where two corners are equally low a method's path can change: single elements
/// may end elsewhere, but no more than one of fifty.
#[test]
fn scaling_by_any_factor_multiplies_distances() {
    fn check<const N: usize>()
    where
        Method: Minimizer<N>,
    {
        let plain = minima_at::<f64, N>(1.0);
        for scale in [1e-6, 1e-3, 1e3, 1e6] {
            let mut differing = 0;
            for ((name, _, was), (_, _, is)) in plain.iter().zip(minima_at::<f64, N>(scale)) {
                let error = (was.sample.value - is.sample.value / scale).abs();
                let moved = (0..N).map(|k| (was.weights[k] - is.weights[k]).abs()).fold(0.0, f64::max);
                // Samples are stored in f32: at another scale they differ by a relative 6e-8, and may be quantized to another
                // code; a brick's values range over at most 0.43.
                let precision = match () {
                    () if name.contains("in u8") => 0.43 / 255.0,
                    () if name.contains("in u16") => 0.43 / 65_535.0,
                    () if name.contains("grid") => 1e-6,
                    () => 1e-9,
                };
                if error > precision || moved > 1e3 * precision {
                    differing += 1;
                }
            }
            // A method that depended on the scale would differ nearly everywhere.
            assert!(differing * 50 < plain.len(), "scaled by {scale}: {differing} of {} differ", plain.len());
        }
    }
    check::<2>();
    check::<3>();
}

/// Coordinates near 1e6 are multiples of 1e-10. The triangles avoid the sphere's centre, where the gradient turns within one
/// step and any difference grows.
#[test]
fn far_from_the_origin_weights_are_the_same_as_near_it() {
    let mut random = Random::seeded();
    let all = scenes(1.0);
    let near = all.iter().find(|scene| scene.name == "sphere").unwrap();
    let away = Vector3::new(1e6, -1e6, 1e6);
    let far = SceneField::new(shifted(near.field.clone(), away.into()));
    for _ in 0..300 {
        let simplex = Simplex { corners: [(); 3].map(|()| random.in_cube(1.0) + Vector3::z() * 1.5) };
        let moved = Simplex { corners: simplex.corners.map(|corner| corner + away) };
        for method in methods(3, 32) {
            let (was, is) = (method.minimize(&near.field, &simplex), method.minimize(&far, &moved));
            let context = || format!("{method:?} on {simplex:?}: {was:?}, far away {is:?}");
            // A search ends where it falls by no more than a millionth of the longest edge.
            assert!((was.sample.value - is.sample.value).abs() < 1e-6 * simplex.longest_edge(), "{}", context());
            assert!((0..3).all(|k| (was.weights[k] - is.weights[k]).abs() < 1e-4), "{}", context());
        }
    }
}

/// The first step is equal if the corners are exact at both places: its slopes come from edges. The slopes of §3.1 of the paper
/// come from the corners themselves, and lose the digits that the coordinates take.
#[test]
fn far_from_the_origin_the_first_step_is_bit_for_bit_the_same() {
    fn check<R: Float>(away: f64, parts: f64) {
        let mut random = Random::seeded();
        let sphere = Sphere::new(0.75).unwrap();
        let far = shifted(sphere, [away, -away, away]);
        let once = ProjectedGradient { iterations: 1, ..ProjectedGradient::default() };
        let (mut steps, mut ties) = (0, 0);
        for _ in 0..500 {
            let corners = [(); 3].map(|()| random.in_cube(2.0).map(|x| (x * parts).round() / parts));
            let moved = corners.map(|corner| corner + Vector3::new(away, -away, away));
            let was = once.minimize(&sphere, &cast::<R, 3>(&Simplex { corners }));
            let is = once.minimize(&far, &cast::<R, 3>(&Simplex { corners: moved }));
            let is_corner = [was.weights, is.weights].map(|weights| weights.contains(&R::one()));
            if is_corner[0] != is_corner[1] {
                // Start and step are equally low to rounding, and the other one is returned.
                ties += 1;
                continue;
            }
            assert_eq!(was.weights, is.weights, "{corners:?}");
            steps += usize::from(!is_corner[0]);
        }
        assert!(steps > 100 && ties < 5, "{steps} steps, {ties} ties");
    }
    check::<f32>(1024.0, 256.0);
    check::<f64>(1048576.0, 1024.0);
}

/// A placement that is known at run time gives the bits of one that is part of the type: goals are scaled as distances are. Without
/// one it gives the field's own.
#[test]
fn a_posed_field_is_searched_as_a_placed_one() {
    fn check<R: Float, F: EnclosedSdf, const N: usize>(field: &F, placement: Similarity, random: &mut Random)
    where
        Method: Minimizer<N>,
    {
        let placed = Placed { field, placement };
        let posed = Posed { field, pose: Some(placement) };
        let unmoved: Posed<&F, Similarity> = Posed { field, pose: None };
        for _ in 0..40 {
            let size = random.pick(&[0.1, 0.5, 2.0]) * placement.scale();
            let simplex = cast::<R, N>(&random_simplex(random, size));
            for level in [0.0, 0.1 * size, f64::INFINITY].map(R::from_f64) {
                for method in methods(N, 32) {
                    let [one, other] = [
                        method.minimize_below(&placed, &simplex, level),
                        method.minimize_below(&posed, &simplex, level),
                    ];
                    assert_eq!(one, other, "{method:?} below {level:?} on {simplex:?}");
                    let own = method.minimize_below(&field, &simplex, level);
                    assert_eq!(own, method.minimize_below(&unmoved, &simplex, level), "{method:?} on {simplex:?}");
                }
            }
        }
    }
    let mut random = Random::seeded();
    let ball = Sphere::new(0.5).unwrap();
    let grid = sampled(&ball, cube_lattice(0.75, 16), 1.0);
    for scale in [1.0, 1.5, 100.0, 1e-3] {
        let placement = Similarity::new([0.1, 0.0, 0.3], [0.5, 0.5, 0.5, 0.5], scale).unwrap();
        check::<f64, _, 3>(&grid, placement, &mut random);
        check::<f32, _, 2>(&grid, placement, &mut random);
        check::<f64, _, 3>(&ball, placement, &mut random);
    }
}
