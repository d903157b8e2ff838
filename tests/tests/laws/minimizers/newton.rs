//! Newton's method between cutting planes: its rate of convergence, and what its "converged" means.

use nalgebra::Vector3;
use sdf_core::combine::Intersection;
use sdf_core::minimize::{FrankWolfe, Minimizer, Newton};
use sdf_core::shapes::{HalfSpace, Sphere};
use sdf_core::{Aabb, EnclosedSdf, Real, Sample, Sdf, Simplex};
use sdf_tests::oracle::{convex_minimum, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::scenes;

use super::{converged_and_wrong, sorted_errors};

/// A triangle in a plane at the given height over the origin, and the distance of the perpendicular's foot from the nearest
/// edge, over the longest edge: negative if the foot is outside the triangle.
fn triangle_over_origin(random: &mut Random, height: f64, max_shift: f64) -> (Simplex<f64, 3>, f64) {
    let (x, y) = loop {
        let (x, candidate) = (random.direction(), random.direction());
        let y = candidate - x * x.dot(&candidate);
        if y.norm() > 0.1 {
            break (x, y.normalize());
        }
    };
    let foot = x.cross(&y) * height;
    let shift = [random.between(-max_shift, max_shift), random.between(-max_shift, max_shift)];
    let flat = [0.0, 2.1, 4.2].map(|angle: f64| {
        let (angle, radius) = (angle + random.between(-0.5, 0.5), random.between(0.3, 1.0));
        [radius * angle.cos() + shift[0], radius * angle.sin() + shift[1]]
    });
    let distance = |a: [f64; 2], b: [f64; 2]| (a[0] * b[1] - a[1] * b[0]) / (b[0] - a[0]).hypot(b[1] - a[1]);
    let inside = (0..3).map(|k| distance(flat[k], flat[(k + 1) % 3])).fold(f64::INFINITY, f64::min);
    let simplex = Simplex { corners: flat.map(|at| foot + x * at[0] + y * at[1]) };
    (simplex, inside / simplex.longest_edge())
}

/// Three steps raise the error of the value, in edge lengths, to the power 3/2 or better: one step for each number of a plane's
/// curvature. A method that converges linearly multiplies the error by a constant.
#[test]
fn newton_converges_superlinearly_where_the_field_is_smooth() {
    let mut random = Random::seeded();
    let (mut cases, mut worst, mut after_eight) = (0, 0.0_f64, vec![]);
    while cases < 500 {
        let height = random.between(0.5, 2.0);
        let (triangle, inside) = triangle_over_origin(&mut random, height, 0.2);
        if inside < 0.02 {
            continue;
        }
        cases += 1;
        let sphere = Sphere::new(0.3).unwrap();
        let unit = triangle.longest_edge();
        let error = |iterations: u32| {
            let newton = Newton { iterations, tolerance: 0.0 };
            (newton.minimize(&sphere, &triangle).sample.value - (height - 0.3)) / unit
        };
        let errors: Vec<f64> = (0..12).map(error).collect();
        for (was, is) in errors.iter().zip(&errors[3..]) {
            worst = worst.max((is - 1e-14) / was.abs().powf(1.5));
        }
        after_eight.push(errors[5]);
    }
    after_eight.sort_by(f64::total_cmp);
    println!("worst {worst}, after eight evaluations {:e}, {:e}", after_eight[250], after_eight[475]);
    assert!(worst < 1.0, "{worst}");
    assert!(after_eight[475] < 1e-9, "{:e}", after_eight[475]);
}

/// The third weight is exactly zero, and does not merely shrink from step to step.
#[test]
fn a_minimum_on_an_edge_is_found_on_that_edge() {
    let mut random = Random::seeded();
    let mut beyond = 0;
    while beyond < 500 {
        let height = random.between(0.2, 2.0);
        let (triangle, inside) = triangle_over_origin(&mut random, height, 1.0);
        if inside > -0.01 {
            continue;
        }
        beyond += 1;
        let minimum = Newton::default().minimize(&Sphere::new(0.3).unwrap(), &triangle);
        assert!(minimum.weights.contains(&0.0), "{minimum:?} on {triangle:?}");
        assert!(minimum.converged && minimum.evaluations <= 16.0, "{minimum:?} on {triangle:?}");
    }
}

/// Each cut is one of the three planes.
#[test]
fn the_minimum_of_three_planes_is_exact_after_a_few_evaluations() {
    fn check<const N: usize>(random: &mut Random) {
        let mut max_evaluations = 0.0_f64;
        for _ in 0..1000 {
            let mut plane = || HalfSpace::new(random.direction().into(), random.between(-0.5, 0.5)).unwrap();
            let field = Intersection(plane(), Intersection(plane(), plane()));
            let triangle = random_simplex::<N>(random, 1.0);
            let minimum = Newton::default().minimize(&field, &triangle);
            let error = minimum.sample.value - convex_minimum(&field, &triangle);
            assert!(error <= 2e-9, "{error:e}: {minimum:?} of {field:?} on {triangle:?}");
            assert!(minimum.converged, "{minimum:?} of {field:?} on {triangle:?}");
            max_evaluations = max_evaluations.max(minimum.evaluations);
        }
        println!("{N} corners: at most {max_evaluations} evaluations");
        assert!(max_evaluations <= 12.0, "{max_evaluations}");
    }
    let mut random = Random::seeded();
    check::<2>(&mut random);
    check::<3>(&mut random);
}

/// Σ|x_i − c_i|^power: convex, smooth, and flatter at its minimum than a quadratic function. Newton's method approaches it from
/// one side, by a constant fraction in each step.
struct Flat {
    power: i32,
    center: Vector3<f64>,
}

impl Sdf for Flat {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let offset = point - self.center.map(R::from_f64);
        let power = |x: R, power: i32| (0..power).fold(R::one(), |product, _| product * x);
        let value = offset.iter().fold(R::zero(), |sum, x| sum + power(*x, self.power));
        Sample::new(value, offset.map(|x| power(x, self.power - 1) * R::from_f64(f64::from(self.power))))
    }
    fn bounds(&self, _level: f64) -> Aabb {
        Aabb::EVERYWHERE
    }
    /// Valid where no coordinate differs from the center's by more than 1.
    fn slope_bound(&self) -> f64 {
        f64::from(self.power) * 3.0_f64.sqrt()
    }
}

impl EnclosedSdf for Flat {}

#[test]
fn on_flat_fields_a_converged_search_is_within_the_tolerance() {
    fn check<const N: usize>(random: &mut Random) {
        let mut converged = 0;
        for round in 0..3000 {
            let field = Flat { power: [2, 4, 8][round % 3], center: random.in_cube(0.5) };
            let simplex = Simplex { corners: [(); N].map(|()| random.in_cube(0.5)) };
            let tolerance = [1e-3, 1e-6, 1e-9][round / 3 % 3];
            let minimum = Newton { tolerance, iterations: 100 }.minimize(&field, &simplex);
            let error = minimum.sample.value - convex_minimum(&field, &simplex);
            let allowed = field.slope_bound() * simplex.longest_edge() * tolerance + 1e-14;
            let Flat { power, center } = field;
            assert!(
                !minimum.converged || error <= allowed,
                "{error:e} > {allowed:e}: power {power} at {center}, to {tolerance} on {simplex:?}: {minimum:?}"
            );
            converged += usize::from(minimum.converged);
        }
        println!("{N} corners: {converged} of 3000 converged");
        assert!(converged > 2900, "{converged} of 3000");
    }
    let mut random = Random::seeded();
    check::<2>(&mut random);
    check::<3>(&mut random);
}

#[test]
fn on_convex_fields_a_converged_search_is_within_the_tolerance() {
    fn check<const N: usize>(random: &mut Random) {
        for scene in scenes(1.0).iter().filter(|scene| scene.convex) {
            let mut converged = 0;
            for round in 0..60 {
                let simplex = random_simplex::<N>(random, scene.size);
                let newton = Newton { tolerance: [1e-2, 1e-4, 1e-6][round % 3], ..Newton::default() };
                let minimum = newton.minimize(&scene.field, &simplex);
                let error = minimum.sample.value - convex_minimum(&scene.field, &simplex);
                let allowed = scene.slope_bound() * simplex.longest_edge() * (newton.tolerance + 1e-9);
                assert!(
                    !minimum.converged || error <= allowed + 1e-14 * scene.size,
                    "{error:e}: {} by {newton:?} on {simplex:?}: {minimum:?}",
                    scene.name
                );
                converged += usize::from(minimum.converged);
            }
            assert!(converged >= 57, "{}: {converged} of 60", scene.name);
        }
    }
    let mut random = Random::seeded();
    check::<1>(&mut random);
    check::<2>(&mut random);
    check::<3>(&mut random);
}

/// Tries fields that are not convex.
#[test]
fn a_converged_search_is_seldom_off_a_local_minimum() {
    fn check<const N: usize>(random: &mut Random) {
        let (converged, wrong) = converged_and_wrong::<N>(random, false, &Newton::default());
        println!("{N} corners: {wrong} of {converged}");
        assert!(wrong * 70 < converged, "{N} corners: {wrong} of {converged}");
    }
    let mut random = Random::seeded();
    check::<2>(&mut random);
    check::<3>(&mut random);
}

/// The 90th percentile over all shapes, and over all grids, with eight evaluations each.
#[test]
fn newton_is_nearer_than_frank_wolfe_after_as_many_evaluations() {
    fn check<const N: usize>(random: &mut Random) {
        let iterations = 8 - N as u32;
        let newton = Newton { iterations, ..Newton::default() };
        let frank_wolfe = FrankWolfe { iterations, ..FrankWolfe::default() };
        for is_grid in [false, true] {
            let errors = sorted_errors::<N>(random, is_grid, &newton, &frank_wolfe);
            let [newton, frank_wolfe] = errors.map(|errors| errors[errors.len() * 9 / 10]);
            println!("{N} corners, in grids {is_grid}: {newton:e}, Frank-Wolfe {frank_wolfe:e}");
            assert!(newton * 3.0 < frank_wolfe, "{N} corners: {newton:e}, Frank-Wolfe {frank_wolfe:e}");
        }
    }
    let mut random = Random::seeded();
    check::<2>(&mut random);
    check::<3>(&mut random);
}
