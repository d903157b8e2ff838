//! Laws of the certified search of unions, which goes part by part: it finds what brute force finds on the whole, its
//! bound holds, the order of the parts does not matter, and a part that lies far away costs next to nothing.

use sdf_bake::SparseGrid;
use sdf_core::combine::{Compound, Union};
use sdf_core::grid::sparse::Sparse;
use sdf_core::grid::{Dense, Grid};
use sdf_core::minimize::{Certified, Minimizer, Minimum};
use sdf_core::placed::{Placed, Rigid, Similarity};
use sdf_core::shapes::{Capsule, Cone, Cuboid, HalfSpace, Sphere, Torus};
use sdf_core::{DynSdf, EnclosedSdf, Float, Sdf, Simplex};
use sdf_tests::lanes::{lane_sample, pack_simplices};
use sdf_tests::oracle::{cast, lattice_minimum, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{cube_lattice, sampled, sampled_in_bricks};

const UNTURNED: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Stored fields, baked once.
struct Grids {
    dense: Grid<Dense<Vec<f32>>>,
    sparse: Grid<Sparse<SparseGrid<u16>>>,
}

impl Grids {
    fn new() -> Self {
        let block = Cuboid::new([0.25, 0.5, 0.375]).unwrap();
        let ring = Torus::new(0.4, 0.2).unwrap();
        Self {
            dense: sampled(&ring, cube_lattice(0.75, 20), 1.0),
            sparse: sampled_in_bricks(&block, cube_lattice(0.75, 40), 0.05),
        }
    }
}

type Part<'a> = Box<dyn DynSdf + 'a>;

fn random_turn(random: &mut Random) -> [f64; 4] {
    [0; 4].map(|_| random.between(-1.0, 1.0))
}

fn random_part<'a>(grids: &'a Grids, random: &mut Random) -> Part<'a> {
    let pose = Rigid::new(random.in_cube(0.8).into(), random_turn(random)).unwrap();
    let scaled = Similarity::new(random.in_cube(0.8).into(), random_turn(random), random.between(0.5, 1.5)).unwrap();
    match random.below(8) {
        0 => Box::new(Placed { field: Sphere::new(random.between(0.1, 0.5)).unwrap(), placement: pose }),
        1 => Box::new(Placed { field: Torus::new(0.4, 0.15).unwrap(), placement: pose }),
        2 => Box::new(HalfSpace::new(random.direction().into(), -0.5).unwrap()),
        3 => Box::new(Placed { field: Cuboid::new([0.2, 0.3, 0.4]).unwrap(), placement: scaled }),
        4 => Box::new(Placed { field: Cone::new(0.3, 0.8).unwrap(), placement: pose }),
        5 => Box::new(&grids.dense),
        6 => Box::new(Placed { field: &grids.dense, placement: scaled }),
        _ => Box::new(Placed { field: &grids.sparse, placement: pose }),
    }
}

fn random_parts<'a>(grids: &'a Grids, random: &mut Random) -> Vec<Part<'a>> {
    (0..2 + random.below(5)).map(|_| random_part(grids, random)).collect()
}

fn compound<'a, 'b>(parts: &'b [Part<'a>]) -> Compound<Vec<&'b (dyn DynSdf + 'a)>> {
    Compound::new(parts.iter().map(|part| &**part).collect::<Vec<_>>()).unwrap()
}

/// Eight nested fields, each with the 32 roundings of an evaluation, at coordinates and values of up to six units.
fn rounding<R: Float>(field: &impl EnclosedSdf) -> f64 {
    6.0 * 8.0 * 32.0 * R::EPSILON * field.slope_bound().max(1.0)
}

/// Points of the lattice along an edge.
fn lattice_parts<const N: usize>() -> usize {
    if N == 3 { 48 } else { 200 }
}

/// Compares a minimum with the lowest value on a lattice of weights, which is above the true minimum by no more than
/// slope bound · longest edge / parts. Returns that lowest value.
fn check_against_brute_force<R: Float, const N: usize>(
    field: &impl EnclosedSdf,
    simplex: &Simplex<R, N>,
    minimum: &Minimum<R, N>,
    tolerance: f64,
) -> f64 {
    let parts = lattice_parts::<N>();
    let lowest = lattice_minimum(field, simplex, parts).to_f64();
    let unit = field.slope_bound() * simplex.longest_edge().to_f64();
    let rounding = rounding::<R>(field);
    let (value, lower_bound) = (minimum.sample.value.to_f64(), minimum.lower_bound.to_f64());
    let case = || format!("{minimum:?} on {simplex:?}, but {lowest} on the lattice");
    assert_eq!(minimum.sample, field.evaluate(minimum.point), "{}", case());
    assert_eq!(minimum.point, simplex.point(minimum.weights), "{}", case());
    assert!(lower_bound <= lowest && lower_bound <= value, "the bound does not hold: {}", case());
    assert!(value >= lowest - unit / parts as f64 - rounding, "below the truth: {}", case());
    if minimum.converged {
        let gap = tolerance * unit + rounding;
        assert!(value <= lowest + gap, "not the global minimum: {}", case());
        assert!(value - lower_bound <= gap, "the bound is not tight: {}", case());
    }
    lowest
}

#[test]
fn a_union_of_any_parts_is_searched_to_what_brute_force_finds() {
    fn check<R: Float, const N: usize>(grids: &Grids, random: &mut Random, rounds: usize) {
        // Shared by the parts.
        let method = Certified { evaluations: 16_000, ..Certified::default() };
        let mut converged = 0;
        for _ in 0..rounds {
            let parts = random_parts(grids, random);
            let union = compound(&parts);
            for _ in 0..4 {
                let simplex = cast::<R, N>(&random_simplex(random, 1.0));
                let minimum = method.minimize(&union, &simplex);
                check_against_brute_force(&union, &simplex, &minimum, method.tolerance);
                converged += usize::from(minimum.converged);
            }
        }
        assert!(converged * 100 >= rounds * 4 * 95, "{converged} of {} converged", rounds * 4);
    }
    let (grids, mut random) = (Grids::new(), Random::seeded());
    check::<f64, 1>(&grids, &mut random, 20);
    check::<f64, 2>(&grids, &mut random, 60);
    check::<f64, 3>(&grids, &mut random, 60);
    check::<f32, 2>(&grids, &mut random, 40);
    check::<f32, 3>(&grids, &mut random, 40);
}

#[test]
fn a_union_of_known_types_is_searched_to_what_brute_force_finds() {
    fn check<R: Float, const N: usize>(field: &impl EnclosedSdf, random: &mut Random) {
        // Shared by the parts.
        let method = Certified { evaluations: 16_000, ..Certified::default() };
        let mut converged = 0;
        for _ in 0..25 {
            let simplex = cast::<R, N>(&random_simplex(random, 1.0));
            let minimum = method.minimize(field, &simplex);
            check_against_brute_force(field, &simplex, &minimum, method.tolerance);
            converged += usize::from(minimum.converged);
        }
        assert!(converged >= 23, "{converged} of 25 converged");
    }
    fn check_all(field: &impl EnclosedSdf, random: &mut Random) {
        check::<f64, 2>(field, random);
        check::<f64, 3>(field, random);
        check::<f32, 2>(field, random);
        check::<f32, 3>(field, random);
    }
    let (grids, mut random) = (Grids::new(), Random::seeded());
    let ground = HalfSpace::new([0.0, 0.0, 1.0], -0.4).unwrap();
    let ball =
        |x: f64| Placed { field: Sphere::new(0.3).unwrap(), placement: Rigid::new([x, 0.1, 0.0], UNTURNED).unwrap() };
    let posed = Placed {
        field: &grids.sparse,
        placement: Similarity::new([0.3, -0.2, 0.1], [0.1, 0.2, 0.3, 0.9], 1.25).unwrap(),
    };
    check_all(&Union(&grids.dense, ground), &mut random);
    check_all(&Union(Union(ball(-0.4), Capsule::new([0.0; 3], [0.5; 3], 0.1).unwrap()), posed), &mut random);
    check_all(&Union(&posed, &grids.dense), &mut random);
    check_all(&Compound::new(vec![ball(-0.6), ball(0.0), ball(0.5)]).unwrap(), &mut random);
    check_all(
        &Compound::new(vec![Union(ball(-0.6), &grids.dense), Union(ball(0.5), &grids.dense)]).unwrap(),
        &mut random,
    );
}

#[test]
fn the_order_of_the_parts_does_not_matter() {
    let (grids, mut random) = (Grids::new(), Random::seeded());
    let method = Certified { evaluations: 4000, ..Certified::default() };
    let mut compared = 0;
    for _ in 0..80 {
        let mut parts = random_parts(&grids, &mut random);
        let simplex = random_simplex::<3>(&mut random, 1.0);
        let first = method.minimize(&compound(&parts), &simplex);
        random.shuffle(&mut parts);
        let union = compound(&parts);
        let other = method.minimize(&union, &simplex);
        check_against_brute_force(&union, &simplex, &other, method.tolerance);
        assert!(first.lower_bound <= other.sample.value && other.lower_bound <= first.sample.value);
        if first.converged && other.converged {
            compared += 1;
            let gap = method.tolerance * union.slope_bound() * simplex.longest_edge() + rounding::<f64>(&union);
            let difference = (first.sample.value - other.sample.value).abs();
            assert!(difference <= gap, "{first:?} and {other:?} on {simplex:?}");
        }
    }
    assert!(compared > 60, "{compared}");
}

/// With a level the search may stop early, and parts above it are skipped: what is said of the whole must hold
/// nevertheless.
#[test]
fn below_a_level_bound_and_convergence_hold_for_all_parts() {
    fn check<R: Float, const N: usize>(grids: &Grids, random: &mut Random) {
        let method = Certified { evaluations: 4000, ..Certified::default() };
        let (mut stopped, mut found) = (0, 0);
        for _ in 0..80 {
            let parts = random_parts(grids, random);
            let union = compound(&parts);
            let simplex = cast::<R, N>(&random_simplex(random, 1.0));
            let whole = method.minimize(&union, &simplex);
            let truth = whole.sample.value.to_f64();
            for level in [truth - 1.0, truth - 0.1, truth - 0.01, truth + 0.01, truth + 0.3] {
                let level = R::from_f64(level);
                let minimum = method.minimize_below(&union, &simplex, level);
                let lowest = check_against_brute_force(&union, &simplex, &minimum, method.tolerance);
                if lowest <= level.to_f64() && minimum.converged {
                    found += 1;
                    assert!(minimum.sample.value <= level, "{minimum:?} on {simplex:?}, but {lowest}");
                } else if !minimum.converged && whole.converged {
                    stopped += 1;
                    assert!(level < minimum.lower_bound, "{minimum:?} on {simplex:?} at {level:?}");
                }
            }
        }
        assert!(stopped > 20 && found > 20, "{stopped} stopped, {found} found");
    }
    let (grids, mut random) = (Grids::new(), Random::seeded());
    check::<f64, 2>(&grids, &mut random);
    check::<f64, 3>(&grids, &mut random);
    check::<f32, 3>(&grids, &mut random);
}

#[test]
fn a_half_space_beside_a_grid_costs_little_more_than_the_grid_alone() {
    fn check<R: Float, const N: usize>(grids: &Grids, random: &mut Random) {
        let method = Certified { evaluations: 256, ..Certified::default() };
        let (mut alone, mut together, mut worst) = (0.0, 0.0, 0.0_f64);
        for _ in 0..200 {
            let ground = HalfSpace::new(random.direction().into(), random.between(-0.8, 0.2)).unwrap();
            let simplex = cast::<R, N>(&random_simplex(random, 0.5));
            let on_grid = method.minimize(&grids.dense, &simplex);
            let grid_alone = on_grid.evaluations.to_f64();
            let parts: [[&dyn DynSdf; 2]; 2] = [[&grids.dense, &ground], [&ground, &grids.dense]];
            for parts in parts {
                let union = Compound::new(&parts[..]).unwrap();
                let minimum = method.minimize(&union, &simplex);
                check_against_brute_force(&union, &simplex, &minimum, method.tolerance);
                assert!(minimum.converged || !on_grid.converged, "{minimum:?} on {simplex:?}");
                let evaluations = minimum.evaluations.to_f64();
                worst = worst.max(evaluations - grid_alone);
                together += evaluations;
                alone += grid_alone;
            }
        }
        println!("{N}: {alone} alone, {together} together, at most {worst} more");
        assert!(together <= 1.2 * alone + 400.0 * 12.0 && worst <= 32.0, "{alone} alone, {together} together, {worst}");
    }
    let (grids, mut random) = (Grids::new(), Random::seeded());
    check::<f64, 2>(&grids, &mut random);
    check::<f64, 3>(&grids, &mut random);
    check::<f32, 3>(&grids, &mut random);
}

#[test]
fn a_part_far_away_costs_at_most_two_evaluations() {
    let (grids, mut random) = (Grids::new(), Random::seeded());
    let far = |x: f64| Placed {
        field: Torus::new(0.4, 0.15).unwrap(),
        placement: Rigid::new([x, 0.0, 0.0], UNTURNED).unwrap(),
    };
    let others: Vec<_> = (0..10).map(|i| far(20.0 + 2.0 * f64::from(i))).collect();
    let mut parts: Vec<&dyn DynSdf> = vec![&grids.dense];
    parts.extend(others.iter().map(|other| other as &dyn DynSdf));
    let union = Compound::new(&parts[..]).unwrap();
    for _ in 0..100 {
        let simplex = random_simplex::<3>(&mut random, 1.0);
        // A part may take as many evaluations as it may alone.
        let method = Certified::default();
        let [alone, minimum] = [method.minimize(&grids.dense, &simplex), method.minimize(&union, &simplex)];
        assert_eq!((minimum.weights, minimum.sample), (alone.weights, alone.sample), "{simplex:?}");
        assert_eq!((minimum.lower_bound, minimum.converged), (alone.lower_bound, alone.converged), "{simplex:?}");
        // Those of one part of eleven, two for each, and those of the whole: its sample, and its corners where the budget ended.
        let most = (alone.evaluations / 11.0).ceil() + 2.0 + 4.0;
        assert!(minimum.evaluations <= most, "{minimum:?}, alone {alone:?}");
    }
}

#[test]
fn one_lane_of_a_union_equals_the_scalar_bit_for_bit() {
    let (grids, mut random) = (Grids::new(), Random::seeded());
    for _ in 0..20 {
        let parts = random_parts(&grids, &mut random);
        let union = compound(&parts);
        let alone: [Simplex<f64, 3>; 4] = std::array::from_fn(|_| random_simplex(&mut random, 1.0));
        let together = Certified::default().minimize(&union, &pack_simplices(&alone));
        for (lane, simplex) in alone.iter().enumerate() {
            let alone = Certified::default().minimize(&union, simplex);
            assert_eq!(alone.weights, together.weights.map(|weight| weight.0[lane]), "{simplex:?}");
            assert_eq!(alone.sample, lane_sample(&together.sample, lane), "{simplex:?}");
            assert_eq!(
                (alone.lower_bound, alone.evaluations, alone.converged),
                (together.lower_bound.0[lane], together.evaluations.0[lane], together.converged.0[lane]),
                "{simplex:?}"
            );
        }
    }
}

/// A NaN in one part proves nothing of the whole, wherever the part stands.
#[test]
fn a_hole_in_one_part_leaves_the_union_without_a_bound() {
    let (grids, mut random) = (Grids::new(), Random::seeded());
    let lattice = *grids.dense.lattice();
    let holes = Grid::new(lattice, Dense::new(&lattice, vec![f32::NAN; lattice.node_count()]).unwrap(), 2.0).unwrap();
    let ball = Sphere::new(0.3).unwrap();
    let triangle: Simplex<f64, 3> = Simplex { corners: [(); 3].map(|()| random.in_cube(0.5)) };
    let parts: [[&dyn DynSdf; 2]; 2] = [[&ball, &holes], [&holes, &ball]];
    for parts in parts {
        let union = Compound::new(&parts[..]).unwrap();
        let minimum = Certified::default().minimize(&union, &triangle);
        assert!(!minimum.converged && minimum.lower_bound == f64::NEG_INFINITY, "{minimum:?}");
    }
}
