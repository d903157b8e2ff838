//! Certified search: its gap, its budget, and several minima.

use nalgebra::Vector3;
use sdf_core::combine::{Compound, Difference, Intersection, Offset, Shell, Union};
use sdf_core::minimize::{Certified, Minimizer, Minimum, PointSampling};
use sdf_core::placed::{Affine, Placed, Similarity, Stretch};
use sdf_core::shapes::{Cone, Cuboid, HalfSpace, Sphere, Torus};
use sdf_core::{DynSdf, Float, Sdf, Simplex};
use sdf_tests::oracle::{cast, convex_minimum, face_near_surface, lattice_minimum, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, scenes, shifted};

#[test]
fn a_certified_bound_holds_and_is_within_the_tolerance() {
    fn check<R: Float, const N: usize>(random: &mut Random, unit: f64) {
        for scene in scenes(unit) {
            let mut converged = 0;
            for round in 0..40 {
                let simplex = cast::<R, N>(&random_simplex(random, scene.size));
                let method = Certified { evaluations: [16, 400, 4000][round % 3], ..Certified::default() };
                let minimum = method.minimize(&scene.field, &simplex);
                let context = || format!("{} by {method:?} on {simplex:?}: {minimum:?}", scene.name);
                let lowest = lattice_minimum(&scene.field, &simplex, 24);
                assert!(minimum.lower_bound <= lowest && minimum.lower_bound <= minimum.sample.value, "{}", context());
                if minimum.converged {
                    converged += 1;
                    let gap = (minimum.sample.value - minimum.lower_bound).to_f64();
                    // Eight times the 32 roundings that a bound allows, of coordinates and edges up to six sizes.
                    let rounding = 6.0 * 8.0 * 32.0 * R::EPSILON * scene.size * scene.slope_bound().max(1.0);
                    let length = simplex.longest_edge().to_f64().min(scene.extent());
                    let allowed = method.tolerance * length * scene.slope_bound();
                    assert!(gap <= allowed + rounding, "{gap} > {allowed}: {}", context());
                }
            }
            // A third of the budgets is deliberately too small.
            assert!(converged > 12, "{}: {converged} of 40 in time", scene.name);
        }
    }
    let mut random = Random::seeded();
    check::<f64, 1>(&mut random, 1.0);
    check::<f64, 2>(&mut random, 1.0);
    check::<f64, 3>(&mut random, 1.0);
    check::<f32, 2>(&mut random, 1.0);
    check::<f32, 3>(&mut random, 1.0);
    // Single precision, which grids exclude cells in, does not hold the squares of these lengths.
    check::<f64, 2>(&mut random, 1e25);
    check::<f64, 3>(&mut random, 1e25);
}

/// The default of `sdftool contacts`, with slivers, collinear and degenerate elements.
#[test]
fn within_256_evaluations_convex_fields_are_certified_to_a_thousandth_of_an_edge() {
    fn failures<const N: usize>(random: &mut Random, rounds: usize) -> (usize, usize) {
        let (mut failures, mut queries) = (0, 0);
        for scene in scenes(1.0).iter().filter(|scene| scene.convex) {
            for _ in 0..rounds {
                let simplex = random_simplex::<N>(random, scene.size);
                let method = Certified { evaluations: 256, ..Certified::default() };
                let value = method.minimize(&scene.field, &simplex).sample.value;
                let allowed = 1e-3 * simplex.longest_edge() * scene.slope_bound() + 1e-12 * scene.size;
                failures += usize::from(value > convex_minimum(&scene.field, &simplex) + allowed);
                queries += 1;
            }
        }
        (failures, queries)
    }
    let mut random = Random::seeded();
    assert_eq!(failures::<2>(&mut random, 100).0, 0);
    let (failures, queries) = failures::<3>(&mut random, 60);
    assert_eq!(failures, 0, "of {queries}");
}

/// Random faces of 0.1 to 1.5 of the body's size near its surface. Prints the share of each field.
#[test]
fn within_256_evaluations_all_shapes_are_certified_on_99_percent_of_random_faces() {
    const FACES: u32 = 400;
    let method = Certified { evaluations: 256, ..Certified::default() };
    let mut random = Random::seeded();
    let mut failures = vec![];
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning != Meaning::Samples) {
        let (mut certified, mut evaluations) = (0, 0.0);
        for _ in 0..FACES {
            let minimum = method.minimize(&scene.field, &face_near_surface(&scene.field, scene.size, &mut random));
            certified += u32::from(minimum.converged);
            evaluations += minimum.evaluations / f64::from(FACES);
        }
        println!("{}: {certified} of {FACES}, {evaluations:.1} evaluations in the mean", scene.name);
        if certified * 100 < FACES * 99 {
            failures.push(format!("{}: {certified} of {FACES}", scene.name));
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

/// The parts near an element matter, in whatever order all are listed.
#[test]
fn within_256_evaluations_unions_of_many_parts_are_certified_on_99_percent_of_random_faces() {
    const FACES: u32 = 400;
    let method = Certified { evaluations: 256, ..Certified::default() };
    let mut random = Random::seeded();
    for count in [30, 200] {
        let part = |random: &mut Random| {
            let rotation = [(); 4].map(|()| random.between(-1.0, 1.0));
            let placement = Similarity::new(random.in_cube(1.0).into(), rotation, 1.0).unwrap();
            Placed { field: Torus::new(0.3, 0.1).unwrap(), placement }
        };
        let parts: Vec<_> = (0..count).map(|_| part(&mut random)).collect();
        let union = Compound::new(parts).unwrap();
        let minima = (0..FACES).map(|_| method.minimize(&union, &face_near_surface(&union, 1.0, &mut random)));
        let (mut certified, mut evaluations) = (0, 0.0);
        for minimum in minima {
            certified += u32::from(minimum.converged);
            evaluations += minimum.evaluations / f64::from(FACES);
            assert!(minimum.evaluations <= 256.0);
        }
        println!("{count} tori: {certified} of {FACES}, {evaluations:.1} evaluations in the mean");
        assert!(certified * 100 >= FACES * 99, "{count} tori: {certified} of {FACES}");
    }
}

/// A floor of two triangles is as precise as one of many: faces of 10 to 1000 sizes, each through a point near the body.
#[test]
fn a_face_larger_than_the_field_is_certified_to_a_fraction_of_the_fields_extent() {
    const FACES: usize = 60;
    let method = Certified::default();
    let mut random = Random::seeded();
    let mut failures = vec![];
    for scene in scenes(1.0) {
        let extent: f64 = scene.extent();
        // The bodies of the tests are of about this size, and the grids around them no larger than twice that.
        let is_bounded = extent.is_finite();
        assert!(!is_bounded || (0.3 * scene.size..8.0 * scene.size).contains(&extent), "{}: {extent}", scene.name);
        let mut certified = 0;
        for _ in 0..FACES {
            let size = 10.0_f64.powf(random.between(1.0, 3.0)) * scene.size;
            let (center, corners) = (random.in_cube(scene.size * 0.5), [(); 3].map(|()| random.in_cube(size)));
            let simplex = Simplex { corners };
            let shift = center - simplex.centroid();
            let simplex = Simplex { corners: corners.map(|corner| corner + shift) };
            let minimum = method.minimize(&scene.field, &simplex);
            let gap = minimum.sample.value - minimum.lower_bound;
            let allowed = 1e-3 * simplex.longest_edge().min(extent) * scene.slope_bound() + 1e-10 * size;
            assert!(!minimum.converged || gap <= allowed, "{}: {gap} > {allowed} on {simplex:?}", scene.name);
            certified += usize::from(minimum.converged);
        }
        println!("{}: {certified} of {FACES}", scene.name);
        // One rises by its slope bound in a single cell; the other's surface goes on outside of the box, where little is known of it.
        let is_hard = ["steep grid", "grid of a piece of a cuboid"].contains(&scene.name);
        if certified * 100 < FACES * if is_hard { 10 } else { 95 } {
            failures.push(format!("{}: {certified} of {FACES}", scene.name));
        }
    }
    assert!(failures.is_empty(), "{failures:?}");
}

/// Three balls under an edge, the outer ones larger: bisection ends at the middle one.
#[test]
fn the_lowest_of_several_minima_is_certified() {
    let ball = |radius, x| shifted(Sphere::new(radius).unwrap(), [x, 0.0, 0.0]);
    let balls = Union(ball(0.3, 0.0), Union(ball(0.1, 2.0), ball(0.3, 4.0)));
    let edge = Simplex { corners: [Vector3::zeros(), Vector3::new(4.0, 0.0, 0.0)] };
    let minimum = Certified::default().minimize(&balls, &edge);
    assert!((minimum.sample.value + 0.3_f64).abs() < 1e-12 && minimum.converged, "{minimum:?}");
    // Away from the corners: the lowest of three minima, under the middle of a triangle.
    let balls = Union(ball(0.2, 1.0), Union(ball(0.35, 1.7), ball(0.3, 2.5)));
    let triangle =
        Simplex { corners: [[-1.0, -2.0, 0.5], [5.0, -2.0, 0.5], [1.7, 4.0, 0.5]].map(Vector3::<f64>::from) };
    let minimum = Certified::default().minimize(&balls, &triangle);
    assert!((minimum.sample.value - 0.15).abs() < 6e-3 && minimum.converged, "{minimum:?}");
    assert!((minimum.point - Vector3::new(1.7, 0.0, 0.5)).norm() < 0.1, "{minimum:?}");
}

/// A cone's apex through the interior of a triangle, which sampling and fixed steps miss (Fig. 2 of the paper).
#[test]
fn the_apex_of_a_cone_is_found_within_128_evaluations() {
    let mut random = Random::seeded();
    let (mut found, mut missed_by_sampling) = (0, 0);
    const CASES: usize = 300;
    for _ in 0..CASES {
        let angle = random.between(2.0, 30.0_f64).to_radians();
        let cone = Cone::new(angle, 2.0).unwrap();
        // The apex is above the plane of the triangle by at most a hundredth of the edge's length.
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
        let sampled = PointSampling { samples: 64, corners: false }.minimize(&cone, &triangle);
        missed_by_sampling += usize::from(sampled.sample.value > truth + tolerance);
    }
    assert!(found * 100 >= CASES * 99, "{found} of {CASES}");
    assert!(missed_by_sampling * 2 > CASES, "too easy: sampling misses only {missed_by_sampling} of {CASES}");
}

/// Elements along a plane ten thousand of their sizes away: their values differ by rounding alone, and a bound that ignored it
/// would be above some of them.
#[test]
fn a_certified_bound_holds_where_values_differ_by_rounding_alone() {
    fn check<R: Float>(random: &mut Random) {
        for _ in 0..200 {
            let normal = random.direction();
            let plane = HalfSpace::new(normal.into(), 1e4).unwrap();
            let on_plane = |offset: Vector3<f64>| normal * 1e4 + offset - normal * normal.dot(&offset);
            let corners = [(); 3].map(|()| on_plane(random.in_cube(1.0)));
            let simplex = cast::<R, 3>(&Simplex { corners });
            let minimum = Certified::default().minimize(&plane, &simplex);
            let lowest = lattice_minimum(&plane, &simplex, 12);
            assert!(minimum.lower_bound <= lowest, "{minimum:?} on {simplex:?}, but {lowest:?}");
        }
    }
    let mut random = Random::seeded();
    check::<f32>(&mut random);
    check::<f64>(&mut random);
}

/// The longest side of the box around the surface, where that is shorter than the element: also where the surface is stretched, or only a
/// part of each of two.
#[test]
fn a_converged_value_of_a_large_element_is_known_to_a_fraction_of_the_surfaces_box() {
    let search = Certified { evaluations: 20_000, ..Certified::default() };
    let mut random = Random::seeded();
    let ring = Torus::new(1.0, 0.01).unwrap();
    let stretched = Placed { field: ring, placement: Stretch::new([1.0, 1.0, 100.0]).unwrap() };
    let twice = Placed {
        field: Placed { field: ring, placement: Stretch::new([1.0, 1.0, 0.01]).unwrap() },
        placement: Stretch::new([1.0, 1.0, 100.0]).unwrap(),
    };
    let linear = [[0.6, 0.0, 80.0], [0.0, 1.0, 0.0], [-0.8, 0.0, 60.0]];
    let affine = Placed { field: ring, placement: Affine::new([3.0, 0.0, 1.0], linear).unwrap() };
    let bar = |half: [f64; 3]| Cuboid::new(half).unwrap();
    let crossed = Intersection(bar([500.0, 1.0, 1.0]), Difference(bar([1.0, 500.0, 1.0]), ring));
    let mut converged = 0;
    let mut check = |field: &dyn DynSdf| {
        let side = field.bounds(0.0).longest_side();
        for _ in 0..40 {
            let simplex = Simplex { corners: [0; 3].map(|_| random.in_cube(3.0) * side) };
            let found: Minimum<f64, 3> = search.minimize(&field, &simplex);
            let allowed = search.tolerance * side * Sdf::slope_bound(&field) * (1.0 + 1e-9);
            let gap = found.sample.value - found.lower_bound;
            assert!(!found.converged || gap <= allowed, "{gap} > {allowed} on {simplex:?}");
            converged += u32::from(found.converged);
        }
    };
    let grown_again = |distance: f64| {
        let fat = Torus::new(1.0, 0.3).unwrap();
        Offset::new(Offset::new(fat, -distance).unwrap(), distance).unwrap()
    };
    let thin_again = Shell::new(Offset::new(Torus::new(1.0, 0.3).unwrap(), -0.29).unwrap(), 0.02).unwrap();
    for distance in [0.1, 0.29, 0.299] {
        check(&grown_again(distance));
    }
    check(&Offset::new(Torus::new(1.0, 0.3).unwrap(), -0.29).unwrap());
    check(&thin_again);
    check(&stretched);
    check(&twice);
    check(&affine);
    check(&crossed);
    assert!(converged > 80, "{converged}");
}

/// A level within rounding below the minimum is one that no search tells from it: the budget is not spent on it.
#[test]
fn a_level_that_rounding_alone_tells_from_the_minimum_costs_no_budget() {
    let search = Certified { evaluations: 100_000, ..Certified::default() };
    let corners = [Vector3::new(0.1, 0.0, 1.0), Vector3::new(1.0, 0.2, 1.0), Vector3::new(0.3, 0.9, 1.0)];
    let ground = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
    let level_with = Simplex { corners };
    for below in [0.0, 1e-16, 4e-16, 1e-15] {
        let found: Minimum<f64, 3> = search.minimize_below(&ground, &level_with, 1.0 - below);
        assert!(found.evaluations < 1000.0, "{below}: {} evaluations", found.evaluations);
    }
}

/// However little a minimum is below the level, the search goes on until it is there, or has nothing left.
#[test]
fn a_minimum_just_below_the_level_is_found_with_evaluations_enough() {
    let mut random = Random::seeded();
    let field = Union(
        Torus::new(1.0, 0.2).unwrap(),
        Intersection(Sphere::new(0.9).unwrap(), Cuboid::new([0.7, 0.8, 0.9]).unwrap()),
    );
    let search = Certified { evaluations: 100_000, ..Certified::default() };
    let exact = Certified { tolerance: 1e-12, ..search };
    let mut without = 0;
    for _ in 0..200 {
        let simplex = Simplex { corners: [0; 3].map(|_| random.in_cube(1.3)) };
        let truth: Minimum<f64, 3> = exact.minimize(&field, &simplex);
        for above in [1e-8, 1e-6, 1e-5, 1e-4] {
            let level = truth.sample.value + above;
            let found: Minimum<f64, 3> = search.minimize_below(&field, &simplex, level);
            without += u32::from(search.minimize(&field, &simplex).sample.value > level);
            assert!(
                found.sample.value <= level,
                "{} above {level}, {above:e} above the minimum, on {simplex:?}",
                found.sample.value
            );
        }
    }
    assert!(without > 10, "{without}: the level asks nothing");
}
