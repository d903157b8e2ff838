//! Exact minima of grids on segments and triangles.

use nalgebra::Vector3;
use sdf_core::grid::{Dense, Grid, Lattice};
use sdf_core::shapes::Sphere;
use sdf_core::{EnclosedSdf, Float, Goal, Sdf, Simplex, project_weights};
use sdf_tests::oracle::{lattice_weights, random_triangle};
use sdf_tests::random::Random;
use sdf_tests::scenes::{Meaning, cube_lattice, dense_grid, measured_grid, node_indices, noise, sampled, scenes};

/// Compared with 1001 points of the segment, in grids of every storage, placed and combined.
#[test]
fn the_exact_minimum_on_a_segment_is_below_all_its_points() {
    fn check<R: Float>(tolerance: f64) {
        let mut random = Random::seeded();
        for scene in scenes(1.0).iter().filter(|scene| scene.meaning == Meaning::Samples) {
            let mut answered = 0;
            for round in 0..300 {
                let a = random.in_cube(0.6 * scene.size);
                let length = scene.size * 10.0_f64.powf(random.between(-3.0, 0.0));
                let mut b = a + random.in_cube(length);
                match round % 8 {
                    0 => b.y = a.y,
                    1 => b = a + Vector3::x() * 0.3,
                    2 => b = a,
                    // Along faces of cells, from node to node.
                    3 => b = b.map(|x| (x * 16.0).round() / 16.0),
                    _ => {}
                }
                let a = if round % 8 == 3 { a.map(|x| (x * 16.0).round() / 16.0) } else { a };
                let ends = [a, b].map(|end| end.map(R::from_f64));
                let Some(minimum) = scene.exact_minimum(ends, Goal::exact()) else { continue };
                answered += 1;
                let value_at = |t: R| scene.value(ends[0] + (ends[1] - ends[0]) * t).to_f64();
                let context = || format!("{}: {minimum:?} on {ends:?}", scene.name);
                let value = value_at(minimum.weights[1]);
                assert!((value - minimum.value.to_f64()).abs() <= tolerance, "{}: {value}", context());
                for step in 0..=1000 {
                    let value = value_at(R::from_f64(f64::from(step) / 1000.0));
                    assert!(minimum.value.to_f64() <= value + tolerance, "{}, but {value} at {step}", context());
                }
            }
            if scene.name.ends_with("grid of a sphere") {
                assert!(answered > 200, "{}: {answered} of 300", scene.name);
            }
        }
    }
    // Some tens of roundings of coordinates and samples, times a slope of at most 5.
    check::<f64>(1e-13);
    check::<f32>(1e-5);
}

/// The same for triangles, among them ones in faces of cells, slivers, segments and points.
#[test]
fn the_exact_minimum_on_a_triangle_is_below_all_its_points() {
    fn check<R: Float>(tolerance: f64) {
        let mut random = Random::seeded();
        let lattice = lattice_weights::<3>(20);
        for scene in scenes(1.0) {
            let mut answered = 0;
            for round in 0..200 {
                let length = scene.size * 10.0_f64.powf(random.between(-3.0, 0.0));
                let a = random.in_cube(0.6 * scene.size);
                let mut corners = random_triangle(a, length, &mut random);
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
                let gap = R::from_f64(1e-3 * length);
                let Some(minimum) = scene.exact_minimum(corners, Goal { level: R::from_f64(f64::INFINITY), gap })
                else {
                    continue;
                };
                answered += 1;
                let simplex = Simplex { corners };
                let value_at = |weights: [R; 3]| scene.value(simplex.point(weights)).to_f64();
                let context = || format!("{}: {minimum:?} on {corners:?}", scene.name);
                let value = value_at(minimum.weights);
                assert!((value - minimum.value.to_f64()).abs() <= tolerance, "{}: {value}", context());
                assert!(minimum.lower_bound <= minimum.value, "{}", context());
                for weights in &lattice {
                    let value = value_at(weights.map(R::from_f64));
                    let is_below = minimum.lower_bound.to_f64() <= value + tolerance;
                    assert!(is_below, "{}, but {value} at {weights:?}", context());
                }
                let at_level = scene.exact_minimum(corners, Goal { level: minimum.value, gap }).unwrap();
                for (met, known) in [(at_level.value, minimum.value), (at_level.lower_bound, minimum.lower_bound)] {
                    let change = (met - known).to_f64().abs();
                    assert!(change <= tolerance, "{}, but {at_level:?} with its level", context());
                }
            }
            if scene.name.ends_with("grid of a sphere") {
                assert!(answered > 100, "{}: {answered} of 200", scene.name);
            }
        }
    }
    check::<f64>(1e-13);
    check::<f32>(1e-5);
}

/// Triangles over fewer and more cells than there are lanes, in blocks of every shape. One sample is low, so a cell that is
/// skipped shows.
#[test]
fn every_cell_that_a_triangle_meets_is_searched() {
    let mut random = Random::seeded();
    let lattice = Lattice::new([0.0; 3], 1.0, [41, 23, 19]).unwrap();
    let mut answered = 0;
    for _ in 0..3000 {
        let extents = [0, 1, 2].map(|_| 10.0_f64.powf(random.between(-1.0, 1.4)));
        let corner = |random: &mut Random| Vector3::from([0, 1, 2].map(|axis| random.between(0.0, extents[axis])));
        let first = Vector3::new(random.between(0.0, 40.0), random.between(0.0, 22.0), random.between(0.0, 18.0));
        let inside = |point: Vector3<f64>| point.zip_map(&Vector3::new(40.0, 22.0, 18.0), |x, end: f64| x.min(end));
        let corners = [0, 1, 2].map(|_| inside(first + corner(&mut random)));
        let simplex = Simplex { corners };
        let weights = project_weights([0, 1, 2].map(|_| random.between(-0.2, 1.0)));
        let lowest = simplex.point(weights);
        let node = [0, 1, 2].map(|axis| lowest[axis].round() as u32);
        let mut samples = vec![1.0_f32; lattice.node_count()];
        samples[lattice.index(node)] = 0.0;
        let grid = dense_grid(lattice, samples, 2.0);
        let Some(minimum) = grid.exact_minimum(corners, Goal { level: f64::INFINITY, gap: 1e-3 }) else { continue };
        answered += 1;
        let value = grid.value(lowest);
        assert!(minimum.lower_bound <= value + 1e-12, "{minimum:?} on {simplex:?}, but {value} at {lowest}");
    }
    assert!(answered > 1000, "{answered} of 3000");
}

/// −(xy + yz + zx) is reproduced exactly. On a plane x + y + z = const it has its minimum at x = y = z.
#[test]
fn a_minimum_in_the_interior_of_a_cell_is_found() {
    let mut random = Random::seeded();
    let lattice = cube_lattice(1.0, 8);
    let nodes = node_indices(lattice.nodes()).map(|node| lattice.node(node));
    let samples = nodes.map(|[x, y, z]| -(x * y + y * z + z * x) as f32).collect();
    let grid = dense_grid(lattice, samples, 4.0);
    for _ in 0..300 {
        let middle = Vector3::repeat(random.between(-0.8, 0.8));
        let offsets = [0, 1].map(|_| random.in_cube(0.15));
        let [a, b] = offsets.map(|offset| (offset - Vector3::repeat(offset.mean())) * 0.5);
        let corners = [middle + a, middle + b, middle - a * 0.4 - b * 0.7];
        let gap = 1e-9;
        let Some(minimum) = grid.exact_minimum(corners, Goal { level: f64::INFINITY, gap }) else { continue };
        let value = -3.0 * middle.x * middle.x;
        assert!((minimum.value - value).abs() <= gap, "{minimum:?} on {corners:?}, but {value} at {middle}");
        assert!(minimum.lower_bound <= value + 1e-13, "{minimum:?} on {corners:?}, but {value} at {middle}");
    }
}

/// Uses white noise, where cells have interior minima.
#[test]
fn the_exact_minimum_on_a_triangle_in_noise_is_below_all_its_points() {
    let mut random = Random::seeded();
    let lattice = cube_lattice(1.0, 8);
    let weights = lattice_weights::<3>(60);
    let mut near = 0;
    for _ in 0..300 {
        let grid = measured_grid(lattice, noise(&lattice, [-1.0, 1.0], &mut random));
        let length = random.between(0.05, 0.6);
        let simplex = Simplex { corners: random_triangle(random.in_cube(0.4), length, &mut random) };
        let gap = 1e-3 * length * grid.slope_bound();
        let Some(minimum) = grid.exact_minimum(simplex.corners, Goal { level: f64::INFINITY, gap }) else { continue };
        near += usize::from(minimum.value - 2.0 * gap <= minimum.lower_bound);
        for weights in &weights {
            let value = grid.value(simplex.point(*weights));
            assert!(minimum.lower_bound <= value + 1e-13, "{minimum:?} on {simplex:?}, but {value} at {weights:?}");
        }
    }
    assert!(near > 200, "{near} of 300 are near");
}

/// Cells with a stationary point in the triangle, about as often a minimum as a saddle, and near where φ is no longer convex.
#[test]
fn a_stationary_point_of_a_cell_is_bounded_whether_a_minimum_or_a_saddle() {
    let mut random = Random::seeded();
    let lattice = Lattice::new([0.0; 3], 1.0, [2; 3]).unwrap();
    let weights = lattice_weights::<3>(80);
    let (mut inside, mut near) = (0, 0);
    for round in 0..4000 {
        let corners = [0, 1, 2].map(|_| Vector3::repeat(0.5) + random.in_cube(0.5));
        let simplex = Simplex { corners };
        let stationary = simplex.point(project_weights([0, 1, 2].map(|_| random.between(0.0, 0.7))));
        let [xy, yz, zx] = [0, 1, 2].map(|_| random.between(-1.0, 1.0));
        let xyz = random.between(-1.0, 1.0) * [0.1, 1.0, 3.0][round % 3];
        let curved = |p: Vector3<f64>| xy * p.x * p.y + yz * p.y * p.z + zx * p.z * p.x + xyz * p.x * p.y * p.z;
        let [x, y, z] = stationary.into();
        let slope =
            Vector3::new(xy * y + zx * z + xyz * y * z, xy * x + yz * z + xyz * z * x, yz * y + zx * x + xyz * x * y);
        let nodes = node_indices(lattice.nodes()).map(|node| Vector3::from(lattice.node(node)));
        let samples = nodes.map(|node| (curved(node) - slope.dot(&node)) as f32).collect();
        let grid = dense_grid(lattice, samples, 20.0);
        for gap in [1e-3, 1e-6] {
            let minimum = grid.exact_minimum(corners, Goal { level: f64::INFINITY, gap }).unwrap();
            let values = weights.iter().map(|weights| (grid.value(simplex.point(*weights)), weights));
            let (lowest, at) = values.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
            assert!(minimum.lower_bound <= lowest + 1e-13, "{minimum:?} on {simplex:?}, but {lowest} at {at:?}");
            inside += usize::from(at.iter().all(|weight| *weight > 0.0));
            near += usize::from(minimum.value - 2.0 * gap <= minimum.lower_bound);
        }
    }
    assert!(inside > 300 && near > 7000, "{inside} minima inside, {near} of 8000 are near");
}

/// An end on the face of the box, or within rounding of it, does not stop the walk through the cells.
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
                    let minimum = grid.exact_minimum([end(near, -0.9), end(far, 0.9)], Goal::exact()).unwrap();
                    assert!(
                        (minimum.weights[1].to_f64() - 0.5).abs() < 0.02,
                        "{minimum:?} from {near} to {far} along {axis}"
                    );
                }
            }
        }
    }
    check::<f32>();
    check::<f64>();
}

#[test]
fn a_segment_that_overflows_between_finite_samples_has_no_exact_minimum() {
    let lattice = cube_lattice(1.0, 8);
    let alternating = |[x, _, _]: [u32; 3]| if x.is_multiple_of(2) { -3e38 } else { 3e38 };
    let grid = dense_grid(lattice, node_indices(lattice.nodes()).map(alternating).collect(), 10.0);
    let node = |node: [u32; 3]| Vector3::from(lattice.node(node)).map(|x| x as f32);
    for row in 0..4 {
        let [from, to] = [node([2, row, 3]), node([3, row, 3])];
        let segment = [from * 0.75 + to * 0.25, from * 0.25 + to * 0.75];
        assert_eq!(grid.exact_minimum(segment, Goal::exact()), None, "row {row}");
    }
}

/// Random positive samples with one that is not finite, and that node.
fn broken_grid(bad: f32, random: &mut Random) -> (Grid<Dense<Vec<f32>>>, Vector3<f64>) {
    let (lattice, node) = (cube_lattice(1.0, 8), [3, 4, 5]);
    let mut samples = noise(&lattice, [0.5, 1.0], random);
    samples[lattice.index(node)] = bad;
    (dense_grid(lattice, samples, 10.0), Vector3::from(lattice.node(node)))
}

/// An exact minimum would be certain; the search that replaces it is not.
#[test]
fn a_segment_through_samples_that_are_not_finite_has_no_exact_minimum() {
    let mut random = Random::seeded();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let (grid, node) = broken_grid(bad, &mut random);
        for _ in 0..100 {
            let offset = random.direction() * random.between(0.05, 0.3);
            // Through a cell of that node, and through cells without it.
            let middle = node + random.in_cube(0.2);
            assert_eq!(
                grid.exact_minimum([middle - offset, middle + offset], Goal::exact()),
                None,
                "{bad} at {middle}"
            );
            let beyond = middle - Vector3::z() * 0.9;
            assert!(
                grid.exact_minimum([beyond, beyond + Vector3::y() * 0.2], Goal::exact()).is_some(),
                "{bad} at {beyond}"
            );
        }
    }
}

#[test]
fn a_triangle_through_samples_that_are_not_finite_has_no_exact_minimum() {
    let mut random = Random::seeded();
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let (grid, node) = broken_grid(bad, &mut random);
        for _ in 0..100 {
            let middle = node + random.in_cube(0.2);
            let (a, b) = (random.direction() * 0.1, random.direction() * 0.1);
            let corners = [middle + a, middle + b, middle - a - b];
            let goal = Goal::exact();
            assert_eq!(grid.exact_minimum(corners, goal), None, "{bad} at {middle}");
            let beyond = corners.map(|corner| corner - Vector3::z() * 0.75);
            assert!(grid.exact_minimum(beyond, goal).is_some(), "{bad} at {middle}");
        }
    }
}
