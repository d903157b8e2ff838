//! Normals of contacts on grids: near the true ones, and without jumps at the faces of cells.

use nalgebra::Vector3;
use sdf_core::contact::{Outcome, contact};
use sdf_core::grid::PlainNormals;
use sdf_core::minimize::{Certified, FrankWolfe};
use sdf_core::shapes::{Cuboid, Sphere};
use sdf_core::{Float, Sdf, Simplex};
use sdf_tests::methods::Method;
use sdf_tests::oracle::{cast, element, random_simplex};
use sdf_tests::random::Random;
use sdf_tests::scenes::{cube_lattice, measured_grid, noise, sampled, sampled_in_bricks, scenes};
use sdf_tests::stability::jitter::quantile;
use sdf_tests::stability::normals::smooth_bodies;

#[test]
fn normals_on_grids_are_the_bodys_own_and_do_not_jump() {
    let certified = Method::Certified(Certified::default());
    for body in smooth_bodies() {
        for (layout, grid) in &body.grids {
            let errors = body.normal_errors(grid, &certified, 2000);
            let (good, worst, turn) =
                (quantile(&errors.off, 0.99), quantile(&errors.off, 1.0), quantile(&errors.turns, 1.0));
            let context = || format!("{} {layout}: {good} {worst} {turn} {}", body.name, errors.jumps);
            assert!(errors.off.len() > 700, "{}", context());
            assert!(good <= 0.02 && worst <= 0.1 && turn <= 0.05, "{}", context());
            // A triangle whose two lowest points are equally deep.
            assert!(errors.jumps <= 2, "{}", context());
        }
    }
}

/// The bound in `grid/smooth.rs`: 2 (5/3)³ L / h for each component along its own axis. Here for all together, in any direction.
#[test]
fn smooth_gradients_of_grids_do_not_jump_at_cells_borders_or_bands() {
    const STEP: f64 = 1e-9;
    let mut random = Random::seeded();
    let lattice = cube_lattice(1.0, 24);
    let spacing = lattice.spacing();
    let ball = Sphere::new(0.5).unwrap();
    let check = |field: &dyn Fn(Vector3<f64>) -> Vector3<f64>, slope_bound: f64, random: &mut Random, name: &str| {
        for _ in 0..4000 {
            // On a face between cells, on the border, or beyond it.
            let mut point = random.in_cube(1.25);
            let axis = random.below(3);
            point[axis] = (point[axis] / spacing).round() * spacing;
            let direction = random.direction() * STEP;
            let jump = (field(point + direction) - field(point - direction)).norm();
            let bound = 27.0 * slope_bound * 2.0 * STEP / spacing + 1e-7 * slope_bound;
            assert!(jump <= bound, "{name}: {jump} > {bound} at {point:?}");
        }
    };
    let dense = sampled(&ball, lattice, 1.0);
    check(&|p| dense.evaluate_smooth(p).gradient, dense.slope_bound(), &mut random, "dense");
    let sparse = sampled_in_bricks::<f32>(&ball, lattice, spacing);
    check(&|p| sparse.evaluate_smooth(p).gradient, sparse.slope_bound(), &mut random, "sparse");
    let coded = sampled_in_bricks::<u8>(&ball, lattice, spacing);
    check(&|p| coded.evaluate_smooth(p).gradient, coded.slope_bound(), &mut random, "sparse in u8");
    let rough = measured_grid(lattice, noise(&lattice, [0.1, 0.2], &mut random));
    check(&|p| rough.evaluate_smooth(p).gradient, rough.slope_bound(), &mut random, "noise");
}

/// A spline that reproduces cubic polynomials: its gradient is theirs, at the border too where they are linear.
#[test]
fn smooth_gradients_of_sampled_polynomials_are_their_own() {
    let mut random = Random::seeded();
    for cells in [1, 2, 3, 4, 5, 6, 20] {
        let lattice = cube_lattice(1.0, cells);
        let linear: [f64; 4] = std::array::from_fn(|_| random.between(-1.0, 1.0));
        let cubic: [f64; 3] = std::array::from_fn(|_| if cells == 20 { random.between(-1.0, 1.0) } else { 0.0 });
        let value = |p: Vector3<f64>| {
            linear[3]
                + (0..3).map(|k| linear[k] * p[k] + cubic[k] * p[k].powi(3)).sum::<f64>()
                + cubic[0] * p.x * p.y * p.z
        };
        let gradient = |p: Vector3<f64>| {
            let own = |k: usize| linear[k] + 3.0 * cubic[k] * p[k] * p[k];
            Vector3::new(own(0), own(1), own(2)) + Vector3::new(p.y * p.z, p.x * p.z, p.x * p.y) * cubic[0]
        };
        let [x, y, z] = lattice.nodes();
        let nodes = (0..z).flat_map(|k| (0..y).flat_map(move |j| (0..x).map(move |i| [i, j, k])));
        let samples = nodes.map(|node| value(lattice.node(node).into()) as f32).collect();
        let grid = measured_grid(lattice, samples);
        for _ in 0..200 {
            let point = random.in_cube(if cells == 20 { 0.75 } else { 1.0 });
            let error = (grid.evaluate_smooth(point).gradient - gradient(point)).norm();
            // Samples are rounded to f32, and a spacing divides them.
            assert!(error < 40.0 * f64::from(f32::EPSILON) / lattice.spacing(), "{cells} cells: {error} at {point:?}");
        }
    }
}

#[test]
fn smooth_values_are_the_values_and_smooth_gradients_of_closed_forms_are_gradients() {
    fn check<R: Float>(random: &mut Random) {
        for scene in scenes(1.0) {
            for point in scene.random_points(random, 200) {
                let point = point.map(R::from_f64);
                let (plain, smooth) = (scene.evaluate(point), scene.evaluate_smooth(point));
                assert_eq!((plain.value, plain.status), (smooth.value, smooth.status), "{} at {point:?}", scene.name);
                if !scene.name.contains("grid") {
                    assert_eq!(plain.gradient, smooth.gradient, "{} at {point:?}", scene.name);
                }
            }
        }
    }
    let mut random = Random::seeded();
    check::<f32>(&mut random);
    check::<f64>(&mut random);
}

/// |surface point − point| ≤ 2 |φ| / min(L, 1), near medial axes too, where |∇φ| goes to zero and φ does not.
#[test]
fn surface_points_are_within_twice_the_distance() {
    fn check<R: Float>(random: &mut Random) {
        for scene in scenes(1.0) {
            let reach = 2.0 / scene.slope_bound().min(1.0);
            for id in 0..40 {
                let element = element(id, cast::<R, 3>(&random_simplex(random, scene.size)));
                if let Outcome::Contact(contact) =
                    contact(&scene.field, &Certified::default(), R::from_f64(0.3 * scene.size), &element)
                {
                    let way = (contact.point - contact.surface_point).map(Float::to_f64).norm();
                    let allowed = contact.distance.to_f64().abs() * reach * 1.000_01 + 1e-6 * scene.size;
                    assert!(way <= allowed, "{}: {way} > {allowed} of {contact:?}", scene.name);
                }
            }
        }
    }
    let mut random = Random::seeded();
    check::<f32>(&mut random);
    check::<f64>(&mut random);
    // The middle of a block: φ = −0.5, and the sides pull against each other.
    let grid = sampled(&Cuboid::new([0.5; 3]).unwrap(), cube_lattice(0.75, 24), 1.0);
    let corners = [[-1e-3_f64, 0.0, 0.0], [1e-3, 1e-3, 0.0], [0.0, -1e-3, 1e-4]].map(Vector3::from);
    let deep = super::expect_contact(contact(&grid, &Certified::default(), 0.0, &element(0, Simplex { corners })));
    assert!(deep.slope < 0.1 && (deep.point - deep.surface_point).norm() <= 2.0 * deep.distance.abs(), "{deep:?}");
}

#[test]
fn contacts_name_their_vertices_and_the_slope_of_their_normal() {
    let mut random = Random::seeded();
    for scene in scenes(1.0) {
        for id in 0..20 {
            let element = element(id, random_simplex::<3>(&mut random, scene.size));
            let outcome = contact(&scene.field, &Certified::default(), 0.2 * scene.size, &element);
            let Outcome::Contact(contact) = outcome else { continue };
            assert_eq!(contact.vertices, element.vertices);
            assert_eq!(contact.corner_vertices(), element.vertices);
            if contact.slope > 1e-6 {
                let gradient = scene.evaluate_smooth(contact.point).gradient;
                assert!((contact.normal * contact.slope - gradient).norm() < 1e-9, "{}: {contact:?}", scene.name);
            }
        }
    }
}

/// A grid with plain normals is no nearer to its body than the grid itself.
#[test]
fn plain_normals_leave_the_bound_of_the_error_as_it_is() {
    let mut random = Random::seeded();
    let (mut seen, mut inexact) = (0, 0);
    for scene in scenes(1.0) {
        for id in 0..50 {
            let element = element(id, random_simplex::<3>(&mut random, scene.size));
            let margin = 0.2 * scene.size;
            let found = [
                contact(&scene.field, &FrankWolfe::default(), margin, &element),
                contact(&PlainNormals(&scene.field), &FrankWolfe::default(), margin, &element),
            ];
            let [Outcome::Contact(smooth), Outcome::Contact(plain)] = found else { continue };
            assert_eq!(plain.error_bound, smooth.error_bound, "{}: {element:?}", scene.name);
            seen += 1;
            inexact += usize::from(smooth.error_bound > 0.0);
        }
    }
    assert!(seen > 500 && inexact > 50, "{seen} contacts, {inexact} with an error");
}
