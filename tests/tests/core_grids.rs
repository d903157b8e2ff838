//! Laws of grids: what is stored, what is between, and what may be said outside.

use nalgebra::Vector3;
use sdf_core::contact::{Element, Outcome, contact};
use sdf_core::grid::{Dense, Grid, Storage, measure_slope_bound};
use sdf_core::minimize::{FrankWolfe, ProjectedGradient};
use sdf_core::shapes::Sphere;
use sdf_core::{Aabb, EnclosedSdf, Float, Goal, Sdf, Simplex, project_weights};
use sdf_tests::oracle::lattice_weights;
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, Scene, cube_lattice, sampled, sampled_in_bricks, scenes};

fn nearest_of(bounds: &Aabb, point: Vector3<f64>) -> Vector3<f64> {
    Vector3::from_fn(|k, _| point[k].clamp(bounds.min[k], bounds.max[k]))
}

#[test]
fn at_a_node_the_value_is_the_sample() {
    let mut random = Random::of_test();
    let lattice = cube_lattice(1.0, 8);
    let samples: Vec<f32> = (0..lattice.node_count()).map(|_| random.between(-1.0, 1.0) as f32).collect();
    let grid = Grid::new(lattice, Dense::new(&lattice, &samples).unwrap(), 100.0).unwrap();
    for index in 0..lattice.node_count() as u32 {
        let node = [index % 9, index / 9 % 9, index / 81];
        let sample = grid.evaluate(Vector3::from(lattice.node(node)));
        assert_eq!(sample.value, f64::from(samples[lattice.index(node)]), "{node:?}");
        assert!(!sample.status.outside_grid, "{node:?}");
    }
}

/// On every axis alone a trilinear interpolant is linear: one with the coefficients of 1, x, y, z, xy, yz, zx, xyz is met
/// exactly, gradient and all.
#[test]
fn a_trilinear_function_is_interpolated_as_itself() {
    let mut random = Random::of_test();
    let c: [f64; 8] = std::array::from_fn(|_| random.between(-1.0, 1.0));
    let value = |p: Vector3<f64>| {
        c[0] + c[1] * p.x
            + c[2] * p.y
            + c[3] * p.z
            + c[4] * p.x * p.y
            + c[5] * p.y * p.z
            + c[6] * p.z * p.x
            + c[7] * p.x * p.y * p.z
    };
    let gradient = |p: Vector3<f64>| {
        Vector3::new(
            c[1] + c[4] * p.y + c[6] * p.z + c[7] * p.y * p.z,
            c[2] + c[4] * p.x + c[5] * p.z + c[7] * p.x * p.z,
            c[3] + c[5] * p.y + c[6] * p.x + c[7] * p.x * p.y,
        )
    };
    let lattice = sdf_core::grid::Lattice::new([-0.5, 0.25, -1.0], 0.25, [6, 4, 9]).unwrap();
    let [x, y, z] = lattice.nodes();
    let mut samples = vec![];
    for (k, j, i) in (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| (k, j, i)))) {
        samples.push(value(Vector3::from(lattice.node([i, j, k]))) as f32);
    }
    let grid = Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), 100.0).unwrap();
    let bounds = lattice.bounds();
    for _ in 0..2000 {
        let point = Vector3::from_fn(|axis, _| random.between(bounds.min[axis], bounds.max[axis]));
        let sample = grid.evaluate(point);
        // Samples are rounded to f32, of at most 8, and differences of them are divided by the spacing.
        assert!((sample.value - value(point)).abs() < 1e-6, "{point:?}: {sample:?}");
        assert!((sample.gradient - gradient(point)).norm() < 1e-5, "{point:?}: {sample:?}");
    }
}

#[test]
fn across_the_box_the_value_is_continuous_and_outside_the_status_says_so() {
    let mut random = Random::of_test();
    const STEP: f64 = 1e-9;
    // Those that are a grid around the origin, and nothing more.
    let is_grid = |scene: &&Scene| {
        let is_more = scene.name.starts_with("turned") || scene.name.starts_with("union");
        scene.meaning == Meaning::Samples && !is_more
    };
    for scene in scenes(1.0).iter().filter(is_grid) {
        let half = if scene.name == "grid of a piece of a cuboid" { 0.4375 } else { 0.75 };
        for _ in 0..3000 {
            let mut on_box = random.in_cube(half);
            for _ in 0..=random.below(3) {
                on_box[random.below(3)] = random.pick(&[-half, half]);
            }
            let inward = on_box * (1.0 - STEP);
            let outward = on_box * (1.0 + STEP);
            let (within, beyond) = (scene.evaluate(inward), scene.evaluate(outward));
            let most = scene.slope_bound() * (outward - inward).norm() + 1e-14;
            assert!((within.value - beyond.value).abs() <= most, "{} at {on_box:?}: {within:?} {beyond:?}", scene.name);
            assert!(!within.status.outside_grid && beyond.status.outside_grid, "{} at {on_box:?}", scene.name);
        }
    }
}

/// The surface lies in the box, so hypot(d, φ(P)) is no more than the distance but for the interpolation's own error: a
/// sphere's distance is convex along each axis, with a curvature of at most 1/|x|, so its interpolant is above it by at
/// most 3·spacing²/8 over the radius at the box.
#[test]
fn outside_the_value_is_never_more_than_the_distance() {
    let mut random = Random::of_test();
    let sphere = Sphere::new(0.5).unwrap();
    for (half, cells) in [(0.55, 11), (0.75, 24), (0.51, 32)] {
        let grid = sampled(&sphere, cube_lattice(half, cells), 1.0);
        let spacing = grid.lattice().spacing();
        let above = 3.0 / 8.0 * spacing * spacing / half + 1e-6;
        let mut farthest_below: f64 = 0.0;
        for _ in 0..20_000 {
            let reach = random.pick(&[1.0, 3.0, 30.0]);
            let point = random.in_cube(reach);
            let sample = grid.evaluate(point);
            let outside = point.amax() > half;
            assert_eq!(sample.status.outside_grid, outside, "{point:?}");
            if outside {
                let distance = sphere.value(point);
                assert!(sample.value <= distance + above, "{point:?}: {} of {distance}", sample.value);
                farthest_below = farthest_below.max((distance - sample.value) / distance);
                let box_distance = (point - nearest_of(&grid.lattice().bounds(), point)).norm();
                assert!(sample.value >= box_distance, "{point:?}: {} is less than to the box", sample.value);
            }
        }
        // It is of use: far away it is nearly the distance.
        assert!(farthest_below < 0.6, "{farthest_below}");
    }
}

/// A slope bound is a promise to the cull. Straight outward from where the inside reaches the box it was once broken: the
/// value rises by the distance and, along the box, by the samples' own slope.
#[test]
fn where_the_inside_reaches_the_box_the_slope_bound_holds_beyond_it() {
    let mut random = Random::of_test();
    let plane = sdf_core::shapes::HalfSpace::new([1.0, 0.0, 0.0], 0.5).unwrap();
    let grid = sampled(&plane, cube_lattice(1.0, 4), 1.0);
    for _ in 0..10_000 {
        let point = random.in_cube(2.0);
        let gradient = grid.evaluate(point).gradient;
        assert!(gradient.norm() <= grid.slope_bound() + 1e-12, "{point:?}: {}", gradient.norm());
    }
    let below = grid.bounds(0.0);
    assert!(grid.value(Vector3::new(-0.5, 0.0, 1.75)) < 0.0 && below.max[2] >= 1.75, "{below:?}");
}

#[test]
fn the_measured_slope_bound_is_met_and_not_exceeded() {
    let mut random = Random::of_test();
    for scene in scenes(1.0).iter().filter(|scene| scene.meaning == Meaning::Samples) {
        let mut steepest: f64 = 0.0;
        for point in scene.random_points(&mut random, 20_000) {
            steepest = steepest.max(scene.evaluate(point).gradient.norm());
        }
        // Rounding of the samples to f32 is in both, that of the interpolation in one.
        assert!(steepest <= scene.slope_bound() * (1.0 + 1e-12), "{}: {steepest}", scene.name);
        assert!(steepest > 0.5 * scene.slope_bound(), "{}: {steepest} of {}", scene.name, scene.slope_bound());
    }
}

/// A sphere in a box that it nearly fills, and a triangle with one corner 0.1 deep and two far outside: an upper bound
/// of the distance outside the box culls it.
#[test]
fn a_triangle_far_outside_with_one_corner_inside_is_found() {
    fn check<R: Float>() {
        let grid = sampled(&Sphere::new(0.5).unwrap(), cube_lattice(0.55, 44), 1.0);
        let corners = [[0.37280, 0.10252, 0.10252], [2.81360, 1.12729, 0.42019], [2.81360, 0.42019, 1.12729]];
        let corners = corners.map(|corner| Vector3::from(corner).map(R::from_f64));
        let element = Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } };
        let depth = |outcome: Outcome<R, 3>| match outcome {
            Outcome::Contact(contact) => contact.distance.to_f64(),
            other => panic!("{other:?}"),
        };
        for margin in [0.0, -0.05] {
            let margin = R::from_f64(margin);
            // The corner is 0.1 deep; the grid is off by less than spacing²/8 over the corner's radius of 0.4, thrice.
            assert!((depth(contact(&grid, &FrankWolfe::default(), margin, &element)) + 0.1).abs() < 2e-3);
            assert!((depth(contact(&grid, &ProjectedGradient::default(), margin, &element)) + 0.1).abs() < 2e-3);
        }
    }
    check::<f32>();
    check::<f64>();
}

#[test]
fn samples_that_are_not_finite_come_back_as_a_status() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let lattice = cube_lattice(1.0, 4);
        let mut samples = vec![0.5; lattice.node_count()];
        samples[lattice.index([2, 2, 2])] = bad;
        let storage = Dense::new(&lattice, samples).unwrap();
        let grid = Grid::new(lattice, storage, 1.0).unwrap();
        for point in [[0.0, 0.0, 0.0], [0.1, -0.2, 0.3]] {
            let sample = grid.sample(Vector3::<f64>::from(point));
            assert!(sample.status.not_finite && sample.value.is_finite(), "{sample:?}");
        }
        let beside = grid.sample(Vector3::<f64>::repeat(0.9));
        assert!(!beside.status.not_finite && beside.value == 0.5, "{beside:?}");
    }
}

/// In bricks, across their borders and far from all of them, where the coarse grid fills in.
#[test]
fn the_corners_of_a_cell_of_a_sparse_grid_are_its_nodes() {
    let lattice = cube_lattice(1.0, 40);
    let grid = sampled_in_bricks::<f32>(&Sphere::new(0.7).unwrap(), lattice, 0.05);
    let (mut in_bricks, mut far) = (0, 0);
    for index in 0..40_u32.pow(3) {
        let cell = [index % 40, index / 40 % 40, index / 1600];
        let nodes: [_; 8] =
            std::array::from_fn(|corner| [0, 1, 2].map(|axis| cell[axis] + (corner as u32 >> axis & 1)));
        let has_brick = nodes.map(|node| grid.storage().brick_at(node.map(|node| node / 8)).is_some());
        in_bricks += usize::from(has_brick == [true; 8]);
        far += usize::from(has_brick == [false; 8]);
        assert_eq!(grid.storage().corners(cell), nodes.map(|node| grid.storage().node(node)), "{cell:?}");
    }
    assert!(in_bricks > 1000 && far > 1000, "{in_bricks} cells in bricks, {far} far from them");
}

#[test]
fn a_slope_bound_that_is_no_number_makes_no_grid() {
    let lattice = cube_lattice(1.0, 2);
    let samples = vec![0.0_f32; lattice.node_count()];
    let storage = Dense::new(&lattice, &samples[..]).unwrap();
    for bad in [f64::NAN, f64::INFINITY, -1.0] {
        assert!(Grid::new(lattice, storage, bad).is_none());
    }
    assert_eq!(measure_slope_bound(&lattice, &storage), 1.0);
    assert!(Dense::new(&lattice, &samples[1..]).is_none());
}

/// Against as many points of the segment as it has thousandths, in grids of every storage, placed and offset.
#[test]
fn the_least_on_a_segment_is_below_all_its_points() {
    fn check<R: Float>(tolerance: f64) {
        let mut random = Random::of_test();
        for scene in scenes(1.0).iter().filter(|scene| scene.meaning == Meaning::Samples) {
            let mut answered = 0;
            for round in 0..300 {
                let a = random.in_cube(0.6 * scene.size);
                let reach = scene.size * 10.0_f64.powf(random.between(-3.0, 0.0));
                let mut b = a + random.in_cube(reach);
                match round % 8 {
                    0 => b.y = a.y,
                    1 => b = a + Vector3::x() * 0.3,
                    2 => b = a,
                    // Along the faces of cells, from node to node.
                    3 => b = b.map(|x| (x * 16.0).round() / 16.0),
                    _ => {}
                }
                let a = if round % 8 == 3 { a.map(|x| (x * 16.0).round() / 16.0) } else { a };
                let ends = [a, b].map(|end| end.map(R::from_f64));
                let Some(least) = scene.exact_minimum(ends, Goal::exact()) else { continue };
                answered += 1;
                let at = |share: R| scene.value(ends[0] + (ends[1] - ends[0]) * share).to_f64();
                let told = format!("{}: {least:?} on {ends:?}", scene.name);
                assert!(
                    (at(least.weights[1]) - least.value.to_f64()).abs() <= tolerance,
                    "{told}: {}",
                    at(least.weights[1])
                );
                for step in 0..=1000 {
                    let value = at(R::from_f64(f64::from(step) / 1000.0));
                    assert!(least.value.to_f64() <= value + tolerance, "{told}, but {value} at {step}");
                }
            }
            if scene.name.ends_with("grid of a sphere") {
                assert!(answered > 200, "{}: {answered} of 300", scene.name);
            }
        }
    }
    // Some tens of roundings of coordinates and samples, times a slope of at most five.
    check::<f64>(1e-13);
    check::<f32>(1e-5);
}

/// The same of a triangle: among them such as lie in the faces of cells, slivers, segments and points.
#[test]
fn the_least_on_a_triangle_is_below_all_its_points() {
    fn check<R: Float>(tolerance: f64) {
        let mut random = Random::of_test();
        let all_over = lattice_weights::<3>(20);
        for scene in scenes(1.0) {
            let mut answered = 0;
            for round in 0..200 {
                let reach = scene.size * 10.0_f64.powf(random.between(-3.0, 0.0));
                let a = random.in_cube(0.6 * scene.size);
                let mut corners = [a, a + random.in_cube(reach), a + random.in_cube(reach)];
                match round % 10 {
                    0 => corners.iter_mut().for_each(|corner| corner.y = a.y),
                    1 => corners = corners.map(|corner| corner.map(|x| (x * 16.0).round() / 16.0)),
                    2 => corners[2] = corners[0] + (corners[1] - corners[0]) * 0.3,
                    3 => corners[2] = corners[0] + (corners[1] - corners[0]) * 0.3 + random.in_cube(1e-9),
                    4 => corners = [a; 3],
                    5 => corners
                        .iter_mut()
                        .for_each(|corner| corner.z = 0.25 * (1.0 + random.between(-1.0, 1.0) * 4.0 * R::EPSILON)),
                    _ => {}
                }
                let corners = corners.map(|corner| corner.map(R::from_f64));
                let gap = R::from_f64(1e-3 * reach);
                let Some(least) = scene.exact_minimum(corners, Goal { level: R::from_f64(f64::INFINITY), gap }) else {
                    continue;
                };
                answered += 1;
                let simplex = Simplex { corners };
                let at = |weights: [R; 3]| scene.value(simplex.point(weights)).to_f64();
                let told = format!("{}: {least:?} on {corners:?}", scene.name);
                assert!((at(least.weights) - least.value.to_f64()).abs() <= tolerance, "{told}: {}", at(least.weights));
                assert!(least.lower_bound <= least.value, "{told}");
                for weights in &all_over {
                    let value = at(weights.map(R::from_f64));
                    assert!(least.lower_bound.to_f64() <= value + tolerance, "{told}, but {value} at {weights:?}");
                }
                let enough = scene.exact_minimum(corners, Goal { level: least.value, gap }).unwrap();
                assert_eq!(enough, least, "a level that is met changes nothing");
            }
            if scene.name.ends_with("grid of a sphere") {
                assert!(answered > 100, "{}: {answered} of 200", scene.name);
            }
        }
    }
    check::<f64>(1e-13);
    check::<f32>(1e-5);
}

/// As many cells as are looked at side by side, fewer and more; in blocks of every shape, of which each cell counts: only there
/// a sample is low.
#[test]
fn every_cell_that_a_triangle_meets_is_looked_at() {
    let mut random = Random::of_test();
    let lattice = sdf_core::grid::Lattice::new([0.0; 3], 1.0, [41, 23, 19]).unwrap();
    let mut answered = 0;
    for _ in 0..3000 {
        let reach = [0, 1, 2].map(|_| 10.0_f64.powf(random.between(-1.0, 1.4)));
        let corner = |random: &mut Random| Vector3::from([0, 1, 2].map(|axis| random.between(0.0, reach[axis])));
        let first = Vector3::new(random.between(0.0, 40.0), random.between(0.0, 22.0), random.between(0.0, 18.0));
        let inside = |point: Vector3<f64>| point.zip_map(&Vector3::new(40.0, 22.0, 18.0), |x, most: f64| x.min(most));
        let corners = [0, 1, 2].map(|_| inside(first + corner(&mut random)));
        let simplex = Simplex { corners };
        let weights = project_weights([0, 1, 2].map(|_| random.between(-0.2, 1.0)));
        let lowest = simplex.point(weights);
        let node = [0, 1, 2].map(|axis| lowest[axis].round() as u32);
        let mut samples = vec![1.0_f32; lattice.node_count()];
        samples[lattice.index(node)] = 0.0;
        let grid = Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), 2.0).unwrap();
        let Some(least) = grid.exact_minimum(corners, Goal { level: f64::INFINITY, gap: 1e-3 }) else { continue };
        answered += 1;
        let value = grid.value(lowest);
        assert!(least.lower_bound <= value + 1e-12, "{least:?} on {simplex:?}, but {value} at {lowest}");
    }
    assert!(answered > 1000, "{answered} of 3000");
}

/// −(xy + yz + zx) is interpolated as itself. Where x + y + z is constant it is a bowl around x = y = z.
#[test]
fn the_least_of_a_bowl_within_a_cell_is_found() {
    let mut random = Random::of_test();
    let lattice = cube_lattice(1.0, 8);
    let nodes = (0..lattice.node_count() as u32).map(|n| lattice.node([n % 9, n / 9 % 9, n / 81]));
    let samples: Vec<f32> = nodes.map(|[x, y, z]| -(x * y + y * z + z * x) as f32).collect();
    let grid = Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), 4.0).unwrap();
    for _ in 0..300 {
        let middle = Vector3::repeat(random.between(-0.8, 0.8));
        let mut ways = [0, 1].map(|_| random.in_cube(0.15)).map(|way| way - Vector3::repeat(way.mean()));
        ways.iter_mut().for_each(|way| *way *= 0.5);
        let corners = [middle + ways[0], middle + ways[1], middle - ways[0] * 0.4 - ways[1] * 0.7];
        let gap = 1e-9;
        let Some(least) = grid.exact_minimum(corners, Goal { level: f64::INFINITY, gap }) else { continue };
        let value = -3.0 * middle.x * middle.x;
        assert!((least.value - value).abs() <= gap, "{least:?} on {corners:?}, but {value} at {middle}");
        assert!(least.lower_bound <= value + 1e-13, "{least:?} on {corners:?}, but {value} at {middle}");
    }
}

/// On samples that are as rough as can be, where cells have minima of their own inside.
#[test]
fn the_least_on_a_triangle_in_noise_is_below_all_its_points() {
    let mut random = Random::of_test();
    let lattice = cube_lattice(1.0, 8);
    let all_over = lattice_weights::<3>(60);
    let mut near = 0;
    for _ in 0..300 {
        let samples: Vec<f32> = (0..lattice.node_count()).map(|_| random.between(-1.0, 1.0) as f32).collect();
        let storage = Dense::new(&lattice, samples).unwrap();
        let steepest = measure_slope_bound(&lattice, &storage);
        let grid = Grid::new(lattice, storage, steepest).unwrap();
        let reach = random.between(0.05, 0.6);
        let a = random.in_cube(0.4);
        let simplex = Simplex { corners: [a, a + random.in_cube(reach), a + random.in_cube(reach)] };
        let gap = 1e-3 * reach * steepest;
        let Some(least) = grid.exact_minimum(simplex.corners, Goal { level: f64::INFINITY, gap }) else { continue };
        near += usize::from(least.value - 2.0 * gap <= least.lower_bound);
        for weights in &all_over {
            let value = grid.value(simplex.point(*weights));
            assert!(least.lower_bound <= value + 1e-13, "{least:?} on {simplex:?}, but {value} at {weights:?}");
        }
    }
    assert!(near > 200, "{near} of 300 are near");
}

/// On a face between cells, and on an edge or a node, the gradient is another on each side: what is certain of a hull there
/// holds for all, or a search would pass over the crease.
#[test]
fn a_survey_at_a_node_knows_the_gradients_of_all_cells_around_it() {
    let mut random = Random::of_test();
    let lattice = cube_lattice(1.0, 8);
    let samples: Vec<f32> = (0..lattice.node_count()).map(|_| random.between(-1.0, 1.0) as f32).collect();
    let storage = Dense::new(&lattice, samples).unwrap();
    let steepest = measure_slope_bound(&lattice, &storage);
    let grid = Grid::new(lattice, storage, steepest).unwrap();
    for _ in 0..200 {
        let node = [0, 1, 2].map(|_| 1 + random.below(7) as u32);
        let at = Vector3::from(lattice.node(node));
        let across = if random.below(2) == 0 { at } else { at + Vector3::new(0.0, 0.11, 0.07) };
        let enclosure = grid.enclosure(at, &[at, across]);
        for _ in 0..30 {
            let beside = at + random.direction() * 1e-7;
            let gradient = grid.evaluate(beside).gradient;
            for axis in 0..3 {
                let (least, greatest) = (enclosure.gradients.lower[axis], enclosure.gradients.upper[axis]);
                assert!(
                    least - 1e-4 <= gradient[axis] && gradient[axis] <= greatest + 1e-4,
                    "{gradient} of {enclosure:?}"
                );
            }
        }
    }
}

/// An end on the face of the box, or a rounding from it, does not end the way through the cells.
#[test]
fn a_segment_along_the_face_of_the_box_is_followed_to_its_end() {
    fn check<R: Float>() {
        let grid = sampled(&Sphere::new(0.5).unwrap(), cube_lattice(1.0, 128), 1.0);
        for axis in 0..3 {
            for (near, far) in [(1.0, 1.0), (1.0 - 0.5 * R::EPSILON, 1.0), (1.0, 1.0 - 0.5 * R::EPSILON)] {
                for side in [-1.0, 1.0] {
                    let end = |on_face: f64, along: f64| {
                        let mut end = Vector3::repeat(R::from_f64(0.0));
                        end[axis] = R::from_f64(side * on_face);
                        end[(axis + 1) % 3] = R::from_f64(along);
                        end
                    };
                    let least = grid.exact_minimum([end(near, -0.9), end(far, 0.9)], Goal::exact()).unwrap();
                    assert!(
                        (least.weights[1].to_f64() - 0.5).abs() < 0.02,
                        "{least:?} from {near} to {far} along {axis}"
                    );
                }
            }
        }
    }
    check::<f32>();
    check::<f64>();
}

#[test]
fn a_segment_on_which_numbers_end_between_finite_samples_has_no_least_in_closed_form() {
    let lattice = cube_lattice(1.0, 8);
    let of_layer = |node: usize| if (node % 9).is_multiple_of(2) { -3e38 } else { 3e38 };
    let samples: Vec<f32> = (0..lattice.node_count()).map(of_layer).collect();
    let grid = Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), 10.0).unwrap();
    let node = |node: [u32; 3]| Vector3::from(lattice.node(node)).map(|x| x as f32);
    for row in 0..4 {
        let [from, to] = [node([2, row, 3]), node([3, row, 3])];
        let segment = [from * 0.75 + to * 0.25, from * 0.25 + to * 0.75];
        assert_eq!(grid.exact_minimum(segment, Goal::exact()), None, "row {row}");
    }
}

/// What a search does then is not sure of what it says; the closed form would be.
#[test]
fn a_segment_through_samples_that_are_not_finite_has_no_least_in_closed_form() {
    let mut random = Random::of_test();
    let lattice = cube_lattice(1.0, 8);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut samples: Vec<f32> = (0..lattice.node_count()).map(|_| random.between(0.5, 1.0) as f32).collect();
        let at = [3, 4, 5];
        samples[lattice.index(at)] = bad;
        let grid = Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), 10.0).unwrap();
        for _ in 0..100 {
            let way = random.direction() * random.between(0.05, 0.3);
            // Through a cell of that node, and through cells that have none of it.
            let middle = Vector3::from(lattice.node(at)) + random.in_cube(0.2);
            assert_eq!(grid.exact_minimum([middle - way, middle + way], Goal::exact()), None, "{bad} at {middle}");
            let beyond = middle - Vector3::z() * 0.9;
            assert!(
                grid.exact_minimum([beyond, beyond + Vector3::y() * 0.2], Goal::exact()).is_some(),
                "{bad} at {beyond}"
            );
        }
    }
}

/// The same of a triangle.
#[test]
fn a_triangle_through_samples_that_are_not_finite_has_no_least_in_closed_form() {
    let mut random = Random::of_test();
    let lattice = cube_lattice(1.0, 8);
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut samples: Vec<f32> = (0..lattice.node_count()).map(|_| random.between(0.5, 1.0) as f32).collect();
        let at = [3, 4, 5];
        samples[lattice.index(at)] = bad;
        let grid = Grid::new(lattice, Dense::new(&lattice, samples).unwrap(), 10.0).unwrap();
        for _ in 0..100 {
            let middle = Vector3::from(lattice.node(at)) + random.in_cube(0.2);
            let (a, b) = (random.direction() * 0.1, random.direction() * 0.1);
            let corners = [middle + a, middle + b, middle - a - b];
            let goal = Goal::exact();
            assert_eq!(grid.exact_minimum(corners, goal), None, "{bad} at {middle}");
            let beyond = corners.map(|corner| corner - Vector3::z() * 0.75);
            assert!(grid.exact_minimum(beyond, goal).is_some(), "{bad} at {middle}");
        }
    }
}
