//! Enclosures: bounds of values, slopes, gradients, rises and linearization errors over boxes and hulls.

use nalgebra::Vector3;
use sdf_core::shapes::Sphere;
use sdf_core::{Aabb, EnclosedSdf, Float, Sdf, Simplex};
use sdf_tests::oracle::{cast, lattice_weights, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{cube_lattice, measured_grid, noise, sampled, scenes, shifted};

/// Boxes from tiny to larger than the shape, some of them partly outside a grid.
#[test]
fn the_enclosure_of_a_box_holds_at_all_of_its_points() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        let mut informed = 0;
        for _ in 0..200 {
            let center = random.in_cube(1.5 * scene.size);
            let half = scene.size * 10.0_f64.powf(random.between(-4.0, 0.5));
            let region = Aabb { min: center.into(), max: center.into() }.inflate(half);
            let enclosure = scene.enclose_box(&region);
            informed += u32::from(enclosure.range.lower.is_finite());
            assert!(enclosure.slope_bound <= scene.slope_bound(), "{}: {enclosure:?}", scene.name);
            let points: Vec<_> = (0..40).map(|_| center + random.in_cube(half)).collect();
            let values: Vec<f64> = points.iter().map(|point| scene.value(*point)).collect();
            // Interpolation is in f64, but samples and their bounds are f32.
            let rounding = 4.0 * f64::from(f32::EPSILON) * scene.slope_bound() * scene.size;
            for (a, value) in values.iter().enumerate() {
                assert!(
                    enclosure.range.lower <= value + rounding,
                    "{}: {enclosure:?}, but {value} in {region:?}",
                    scene.name
                );
                assert!(
                    *value <= enclosure.range.upper + rounding,
                    "{}: {enclosure:?}, but {value} in {region:?}",
                    scene.name
                );
                for b in 0..a {
                    let allowed = enclosure.slope_bound * (points[a] - points[b]).norm() + rounding;
                    let change = (value - values[b]).abs();
                    assert!(change <= allowed, "{}: {change} > {allowed} in {region:?}: {enclosure:?}", scene.name);
                }
            }
        }
        if scene.name.starts_with("sparse") || scene.name.starts_with("bounded") {
            assert!(informed > 50, "{}: no lower bound for {} of 200 boxes", scene.name, 200 - informed);
        }
    }
}

#[test]
fn an_enclosure_holds_on_the_whole_hull() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        let lattice = lattice_weights::<N>(if N == 4 { 6 } else { 12 });
        for scene in scenes(1.0) {
            for _ in 0..150 {
                let simplex = cast::<R, N>(&random_simplex(random, 1.5 * scene.size));
                let enclosure = scene.enclosure(simplex.centroid(), &simplex.corners);
                let context = || format!("{}: {enclosure:?} of {simplex:?}", scene.name);
                assert!(
                    enclosure.range.lower <= enclosure.value && enclosure.value <= enclosure.range.upper,
                    "{}",
                    context()
                );
                for weights in &lattice {
                    let value = scene.value(simplex.point(weights.map(R::from_f64)));
                    assert!(
                        enclosure.range.lower <= value && value <= enclosure.range.upper,
                        "{value:?} at {weights:?}, {}",
                        context()
                    );
                    let gradient = scene.evaluate(simplex.point(weights.map(R::from_f64))).gradient;
                    let rounding = R::from_f64(1e3 * R::EPSILON * scene.slope_bound());
                    let is_within = gradient
                        .iter()
                        .zip(&enclosure.gradients.lower)
                        .all(|(g, lower)| *lower - rounding <= *g)
                        && gradient.iter().zip(&enclosure.gradients.upper).all(|(g, upper)| *g <= *upper + rounding);
                    assert!(is_within, "{gradient:?} at {weights:?}, {}", context());
                }
            }
        }
    }
    let mut random = Random::seeded();
    check::<f64, 1>(&mut random);
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f64, 4>(&mut random);
    check::<f32, 2>(&mut random);
    check::<f32, 3>(&mut random);
}

#[test]
fn no_path_to_a_corner_rises_by_more_than_its_bound() {
    fn check<R: Float, const N: usize>(random: &mut Random) {
        for scene in scenes(1.0) {
            for _ in 0..60 {
                let simplex = cast::<R, N>(&random_simplex(random, 1.5 * scene.size));
                let rises = scene.max_rise_to_corners(&simplex.corners);
                let edge = simplex.longest_edge().to_f64() * scene.slope_bound();
                let rounding = 1e3 * R::EPSILON * (scene.size + edge);
                for weights in lattice_weights::<N>(5) {
                    for (corner, rise) in simplex.corners.iter().zip(rises) {
                        let from = simplex.point(weights.map(R::from_f64));
                        let values: Vec<f64> = (0..=24)
                            .map(|step| {
                                scene.value(from + (corner - from) * R::from_f64(f64::from(step) / 24.0)).to_f64()
                            })
                            .collect();
                        let total: f64 = values.windows(2).map(|pair| (pair[1] - pair[0]).max(0.0)).sum();
                        assert!(
                            total <= rise.to_f64() + rounding,
                            "{total} > {rise:?}: {} from {weights:?} to {corner:?} of {simplex:?}",
                            scene.name
                        );
                    }
                }
            }
        }
    }
    let mut random = Random::seeded();
    check::<f64, 2>(&mut random);
    check::<f64, 3>(&mut random);
    check::<f32, 3>(&mut random);
}

/// Branch and bound is fast for this reason: halving the hull shrinks the enclosure by more than half.
#[test]
fn enclosures_of_convex_shapes_shrink_faster_than_the_hull() {
    let mut random = Random::seeded();
    for scene in scenes(1.0).iter().filter(|scene| scene.convex) {
        let mut ratios: Vec<f64> = vec![];
        for _ in 0..200 {
            let corners = [0, 1, 2].map(|_| random.in_cube(1.0));
            let middle = random.in_cube(0.6 * scene.size);
            let scaled = |size: f64| Simplex { corners: corners.map(|corner| middle + corner * size * scene.size) };
            let [large, small] = [scaled(1e-2), scaled(1e-3)].map(|simplex| {
                // The bound's excess over the fall of the value along the hull, which every bound has.
                let lattice = lattice_weights::<3>(8).into_iter().map(|w| scene.value(simplex.point(w)));
                let enclosure = scene.enclosure(simplex.centroid(), &simplex.corners);
                lattice.fold(f64::INFINITY, f64::min) - enclosure.range.lower
            });
            ratios.push(small / large.max(1e-12));
        }
        ratios.sort_by(f64::total_cmp);
        assert!(ratios[ratios.len() / 2] < 0.05, "{}: {}", scene.name, ratios[ratios.len() / 2]);
    }
}

/// The gradient differs from side to side of a cell's faces, edges and nodes. The enclosure of a hull there contains all of
/// them, or a search would pass over the crease.
#[test]
fn an_enclosure_at_a_node_contains_the_gradients_of_all_cells_around_it() {
    let mut random = Random::seeded();
    let lattice = cube_lattice(1.0, 8);
    let grid = measured_grid(lattice, noise(&lattice, [-1.0, 1.0], &mut random));
    for _ in 0..200 {
        let node = [0, 1, 2].map(|_| 1 + random.below(7) as u32);
        let at = Vector3::from(lattice.node(node));
        let across = if random.below(2) == 0 { at } else { at + Vector3::new(0.0, 0.11, 0.07) };
        let enclosure = grid.enclosure(at, &[at, across]);
        for _ in 0..30 {
            let beside = at + random.direction() * 1e-7;
            let gradient = grid.evaluate(beside).gradient;
            for axis in 0..3 {
                let (lower, upper) = (enclosure.gradients.lower[axis], enclosure.gradients.upper[axis]);
                assert!(
                    lower - 1e-4 <= gradient[axis] && gradient[axis] <= upper + 1e-4,
                    "{gradient} of {enclosure:?}"
                );
            }
        }
    }
}

#[test]
fn no_value_is_below_the_linearization_by_more_than_its_error() {
    let mut random = Random::seeded();
    let grid = sampled(&Sphere::new(0.5).unwrap(), cube_lattice(0.75, 24), 1.0);
    let [here, there] = [0.0, 8.0].map(|x| Aabb { min: [x + 0.25, 0.25, 0.25], max: [x + 0.375, 0.375, 0.375] });
    assert!(grid.linearization_error(&here) < 0.1);
    assert_eq!(shifted(&grid, [8.0, 0.0, 0.0]).linearization_error(&there), grid.linearization_error(&here));
    let mut bounded = 0;
    for scene in scenes(1.0) {
        for round in 0..300 {
            let middle = random.in_cube(1.2 * scene.size);
            let half: [f64; 3] = [0; 3].map(|_| random.between(0.0, if round % 2 == 0 { 0.05 } else { 0.5 }));
            let region = Aabb {
                min: std::array::from_fn(|k| middle[k] - half[k]),
                max: std::array::from_fn(|k| middle[k] + half[k]),
            };
            let error = scene.linearization_error(&region);
            assert!(error >= 0.0, "{}", scene.name);
            if error.is_infinite() {
                continue;
            }
            bounded += 1;
            let at = scene.sample(middle);
            for _ in 0..20 {
                let point = Vector3::from_fn(|k, _| random.between(region.min[k], region.max[k]));
                let linear = at.value + at.gradient.dot(&(point - middle));
                assert!(scene.value(point) >= linear - error - 1e-9, "{}: {point} in {region:?}", scene.name);
            }
        }
    }
    assert!(bounded > 3000, "{bounded}");
}
