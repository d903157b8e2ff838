//! The search for all minima of an element: it misses none below the level, and invents none.

use std::collections::HashMap;

use nalgebra::Vector3;
use sdf_core::combine::Union;
use sdf_core::minimize::{AllMinima, Certified, MinimaSummary, Minimum, SimplexCell};
use sdf_core::placed::{Placed, Rigid};
use sdf_core::shapes::{Sphere, Torus};
use sdf_core::{EnclosedSdf, Float, Sdf, Simplex};
use sdf_tests::oracle::{cast, lattice_weights, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{scenes, shifted};

const CELLS: usize = 4096;

fn minima<R: Float, const N: usize>(
    search: &AllMinima,
    field: &impl EnclosedSdf,
    simplex: &Simplex<R, N>,
    level: f64,
    cells: usize,
) -> (MinimaSummary<R, N>, Vec<Minimum<R, N>>) {
    let mut minima = vec![Minimum::default(); 64];
    let found =
        search.minima(field, simplex, R::from_f64(level), &mut vec![SimplexCell::default(); cells], &mut minima);
    minima.truncate(found.count);
    (found, minima)
}

/// Points of a lattice on a simplex, with their neighbours.
struct LatticeGraph<const N: usize> {
    weights: Vec<[f64; N]>,
    neighbours: Vec<Vec<usize>>,
}

impl<const N: usize> LatticeGraph<N> {
    fn new(parts: usize) -> Self {
        let weights = lattice_weights::<N>(parts);
        let key = |w: &[f64; N]| w.map(|w| (w * parts as f64).round() as i64);
        let index: HashMap<_, usize> = weights.iter().enumerate().map(|(i, w)| (key(w), i)).collect();
        let mut neighbours = vec![vec![]; weights.len()];
        for (weights, neighbours) in weights.iter().zip(&mut neighbours) {
            for (from, to) in (0..N).flat_map(|a| (0..N).map(move |b| (a, b))).filter(|(a, b)| a != b) {
                let mut beside = key(weights);
                (beside[from], beside[to]) = (beside[from] - 1, beside[to] + 1);
                neighbours.extend(index.get(&beside));
            }
        }
        Self { weights, neighbours }
    }

    fn values<R: Float>(&self, field: &impl EnclosedSdf, simplex: &Simplex<R, N>) -> Vec<f64> {
        self.weights.iter().map(|w| field.value(simplex.point(w.map(R::from_f64))).to_f64()).collect()
    }

    /// The points that a path over values of at most `pass` connects with a point.
    fn basin(&self, values: &[f64], from: usize, pass: f64) -> Vec<bool> {
        let mut is_reached = vec![false; values.len()];
        is_reached[from] = true;
        let mut open = vec![from];
        while let Some(point) = open.pop() {
            for &neighbour in &self.neighbours[point] {
                if !is_reached[neighbour] && values[neighbour] <= pass {
                    is_reached[neighbour] = true;
                    open.push(neighbour);
                }
            }
        }
        is_reached
    }

    fn nearest(&self, weights: [f64; N]) -> usize {
        let distance_sq = |w: &[f64; N]| -> f64 { w.iter().zip(weights).map(|(a, b)| (a - b).powi(2)).sum() };
        (0..self.weights.len())
            .min_by(|a, b| distance_sq(&self.weights[*a]).total_cmp(&distance_sq(&self.weights[*b])))
            .unwrap()
    }
}

#[test]
fn from_every_point_below_the_level_a_path_that_hardly_rises_leads_to_a_minimum() {
    fn check<R: Float, const N: usize>(random: &mut Random, rounds: usize) {
        let search = AllMinima { tolerance: 0.03, ..AllMinima::default() };
        let parts = if N == 3 { 40 } else { 200 };
        let graph = LatticeGraph::<N>::new(parts);
        let mut total = (0, 0);
        for scene in scenes(1.0) {
            let (mut complete, mut queries) = (0, 0);
            for _ in 0..rounds {
                let simplex = cast::<R, N>(&random_simplex(random, scene.size));
                let level = random.between(-0.2, 0.6) * scene.size;
                let (found, minima) = minima(&search, &scene.field, &simplex, level, CELLS);
                complete += usize::from(found.is_complete);
                queries += 1;
                if !found.is_complete {
                    continue;
                }
                let values = graph.values(&scene.field, &simplex);
                let edge = simplex.longest_edge().to_f64() * scene.slope_bound();
                // Between two lattice points the value may rise and fall again by half an interval's slope, and also between a
                // minimum and the lattice point nearest to it.
                let slack = 2.0 * edge / parts as f64 + 1e3 * R::EPSILON * scene.size;
                let nearest_to_minima: Vec<usize> =
                    minima.iter().map(|m| graph.nearest(m.weights.map(R::to_f64))).collect();
                for point in (0..12).map(|_| random.below(values.len())).filter(|i| values[*i] <= level) {
                    let context = || {
                        format!("{} from {:?} of {simplex:?} at {level}: {minima:?}", scene.name, graph.weights[point])
                    };
                    let basin = graph.basin(&values, point, values[point] + search.tolerance * edge + slack);
                    assert!(nearest_to_minima.iter().any(|point| basin[*point]), "{}", context());
                    assert!(found.lower_bound.to_f64() <= values[point], "{}", context());
                }
            }
            // On a convex field one evaluation is enough. On a field that has only its slope bound, a triangle can exhaust the
            // cells.
            assert!(
                if scene.convex { complete == queries } else { complete * 4 >= queries },
                "{}: {complete} of {queries} complete",
                scene.name
            );
            total = (total.0 + complete, total.1 + queries);
        }
        assert!(total.0 * 10 >= total.1 * 8, "{} of {} complete", total.0, total.1);
    }
    let mut random = Random::seeded();
    check::<f64, 1>(&mut random, 4);
    check::<f64, 2>(&mut random, 6);
    check::<f64, 3>(&mut random, 3);
    check::<f32, 2>(&mut random, 4);
    check::<f32, 3>(&mut random, 3);
}

#[test]
fn minima_are_the_fields_own_values_in_rising_order_and_below_the_level() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        for _ in 0..8 {
            let simplex: Simplex<f64, 3> = random_simplex(&mut random, scene.size);
            let level = random.between(-0.2, 0.6) * scene.size;
            let (found, minima) = minima(&AllMinima::default(), &scene.field, &simplex, level, CELLS);
            for minimum in &minima {
                let context = || format!("{}: {minimum:?} of {simplex:?}", scene.name);
                let sum: f64 = minimum.weights.iter().sum();
                assert!((sum - 1.0).abs() < 1e-12 && minimum.weights.iter().all(|w| *w >= 0.0), "{}", context());
                assert_eq!(minimum.point, simplex.point(minimum.weights), "{}", context());
                assert_eq!(minimum.sample, scene.evaluate(minimum.point), "{}", context());
                assert!(minimum.sample.value <= level && found.lower_bound <= minimum.sample.value, "{}", context());
            }
            assert!(minima.is_sorted_by(|a, b| a.sample.value <= b.sample.value), "{}", scene.name);
        }
    }
}

#[test]
fn a_convex_field_has_one_minimum() {
    let mut random = Random::seeded();
    for scene in scenes(1.0).iter().filter(|scene| scene.convex) {
        for _ in 0..20 {
            let simplex: Simplex<f64, 3> = random_simplex(&mut random, scene.size);
            let (found, minima) = minima(&AllMinima::default(), &scene.field, &simplex, 10.0 * scene.size, CELLS);
            assert!(!found.is_complete || minima.len() == 1, "{}: {minima:?} of {simplex:?}", scene.name);
        }
    }
}

fn ball(radius: f64, center: [f64; 3]) -> Placed<Sphere, Rigid> {
    shifted(Sphere::new(radius).unwrap(), center)
}

/// The example of the paper's notes on §9: bisection finds −0.1, but the minimum is −0.3 at both ends.
#[test]
fn three_balls_under_an_edge_are_three_minima() {
    let balls = Union(ball(0.3, [0.0; 3]), Union(ball(0.1, [2.0, 0.0, 0.0]), ball(0.3, [4.0, 0.0, 0.0])));
    let edge: Simplex<f64, 2> = Simplex { corners: [Vector3::zeros(), Vector3::new(4.0, 0.0, 0.0)] };
    let (found, all) = minima(&AllMinima::default(), &balls, &edge, 0.0, CELLS);
    assert!(found.is_complete, "{found:?}");
    let points: Vec<(f64, f64)> = all.iter().map(|m| (m.point.x, m.sample.value)).collect();
    let expected = [(0.0, -0.3), (4.0, -0.3), (2.0, -0.1)];
    assert_eq!(points.len(), 3, "{points:?}");
    for (x, value) in expected {
        assert!(points.iter().any(|m| (m.0 - x).abs() < 1e-3 && (m.1 - value).abs() < 1e-3), "{points:?}");
    }
    let (_, deep) = minima(&AllMinima::default(), &balls, &edge, -0.2, CELLS);
    assert_eq!(deep.len(), 2, "{deep:?}");
}

/// A level above every value leaves none out, however high it is.
#[test]
fn a_level_above_every_value_finds_the_minima_of_any_other() {
    fn check<R: Float>() {
        let balls = Union(ball(0.2, [0.0; 3]), Union(ball(0.2, [1.0, 0.0, 0.0]), ball(0.2, [0.0, 1.0, 0.0])));
        let corners = [[-1.0, -1.0, 0.2], [3.0, -1.0, 0.2], [-1.0, 3.0, 0.2]].map(Vector3::from);
        let triangle = cast::<R, 3>(&Simplex { corners });
        let (_, expected) = minima(&AllMinima::default(), &balls, &triangle, 10.0, CELLS);
        assert_eq!(expected.len(), 3, "{expected:?}");
        for level in [1e3, 1e4, 1e13, 1e30, f64::MAX, f64::INFINITY] {
            let (found, minima) = minima(&AllMinima::default(), &balls, &triangle, level, CELLS);
            assert!(found.is_complete && minima == expected, "{level}: {minima:?}");
        }
    }
    check::<f64>();
    check::<f32>();
}

/// A triangle that rests on four balls touches each of them.
#[test]
fn a_triangle_on_bumps_touches_each_of_them() {
    let mut random = Random::seeded();
    for _ in 0..40 {
        let triangle: Simplex<f64, 3> =
            Simplex { corners: [[-2.0, -2.0, 0.0], [3.0, -2.0, 0.0], [-2.0, 3.0, 0.0]].map(Vector3::from) };
        let spots = [[0.1, 0.2, 0.7], [0.7, 0.1, 0.2], [0.2, 0.7, 0.1], [0.34, 0.33, 0.33]];
        let bump = |spot: usize, depth: f64| {
            let at = triangle.point(spots[spot]);
            ball(0.3, [at.x, at.y, -0.3 + depth])
        };
        let depths: Vec<f64> = (0..4).map(|_| random.between(0.001, 0.1)).collect();
        let bumps = Union(Union(bump(0, depths[0]), bump(1, depths[1])), Union(bump(2, depths[2]), bump(3, depths[3])));
        let (found, minima) = minima(&AllMinima::default(), &bumps, &triangle, 0.0, CELLS);
        assert!(found.is_complete && minima.len() == 4, "{depths:?}: {minima:?}");
        for (spot, depth) in depths.iter().enumerate() {
            let at = triangle.point(spots[spot]);
            let is_there = |m: &Minimum<f64, 3>| (m.point - at).norm() < 0.05 && (m.sample.value + depth).abs() < 1e-3;
            assert!(minima.iter().any(is_there), "{depths:?}: {minima:?}");
        }
    }
}

#[test]
fn too_small_a_buffer_or_budget_is_reported() {
    let mut random = Random::seeded();
    let balls = Union(ball(0.3, [0.0; 3]), Union(ball(0.1, [2.0, 0.0, 0.0]), ball(0.3, [4.0, 0.0, 0.0])));
    let edge: Simplex<f64, 2> = Simplex { corners: [Vector3::zeros(), Vector3::new(4.0, 0.0, 0.0)] };
    for cells in 0..4 {
        let (found, all) = minima(&AllMinima::default(), &balls, &edge, 0.0, cells);
        assert!(!found.is_complete && all.iter().all(|m| !m.converged), "{found:?}");
    }
    let small_budget = AllMinima { max_cells: 3, ..AllMinima::default() };
    assert!(!minima(&small_budget, &balls, &edge, 0.0, CELLS).0.is_complete);
    let mut one = [minima(&AllMinima::default(), &balls, &edge, 0.0, CELLS).1[2]];
    let found = AllMinima::default().minima(&balls, &edge, 0.0, &mut vec![SimplexCell::default(); CELLS], &mut one);
    // A buffer for one keeps the deepest.
    assert!(!found.is_complete && found.count == 1 && one[0].sample.value < -0.29, "{found:?}");
    let far: Simplex<f64, 3> = Simplex { corners: [0, 1, 2].map(|_| random.in_cube(1.0) + Vector3::x() * 50.0) };
    let (found, minima) = minima(&AllMinima::default(), &balls, &far, 0.0, CELLS);
    assert!(found.is_complete && minima.is_empty(), "{found:?}");
}

/// With any budget: a minimum that has converged is the lowest to within the tolerance of the search for the global one.
#[test]
fn converged_minima_are_the_lowest_to_within_the_tolerance() {
    let mut random = Random::seeded();
    let (mut converged, mut others) = (0, 0);
    for scene in scenes(1.0) {
        for evaluations in [6, 12, 24, 1024] {
            let simplex = random_simplex::<3>(&mut random, scene.size);
            let search = Certified { evaluations, tolerance: 1e-6, ..Certified::default() };
            let search = AllMinima { search, ..AllMinima::default() };
            let (found, minima) = minima(&search, &scene.field, &simplex, 10.0 * scene.size, CELLS);
            let gap = 2e-6 * scene.field.slope_bound() * simplex.longest_edge() + 1e-9 * scene.size;
            if let Some(minimum) = minima.first() {
                let is_lowest = minimum.sample.value - gap <= found.lower_bound;
                assert!(is_lowest || !minimum.converged, "{}: {minimum:?} on {simplex:?}", scene.name);
                *if minimum.converged { &mut converged } else { &mut others } += 1;
            }
        }
    }
    assert!(converged > 20 && others > 20, "{converged} and {others}");
}

/// No bound of a torus proves how far a way on it rises: the descent goes on past the border of what it searched.
#[test]
fn an_edge_that_comes_down_to_a_torus_has_one_minimum() {
    let torus = Torus::new(1.0, 0.25).unwrap();
    let corners = [[0.448, -0.647, -0.138], [0.036, -0.702, -1.609], [0.601, -0.614, -1.246]].map(Vector3::from);
    let (found, minima) = minima::<f64, 3>(&AllMinima::default(), &torus, &Simplex { corners }, 0.1, CELLS);
    assert!(found.is_complete);
    assert_eq!(minima.iter().map(|minimum| minimum.weights).collect::<Vec<_>>(), [[1.0, 0.0, 0.0]], "{minima:?}");
}
