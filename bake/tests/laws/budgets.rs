//! Grids baked to an error budget.

use std::sync::atomic::{AtomicU64, Ordering};

use sdf_bake::error_budget::{ErrorBudget, ErrorBudgetError};
use sdf_bake::{MeshDistance, Progress, TriangleMesh};
use sdf_core::Sdf;
use sdf_core::grid::owned::OwnedGrid;
use sdf_core::nalgebra::Vector3;

use crate::meshes::{self, Mesh};
use crate::random::Random;

fn solids(random: &mut Random) -> Vec<(&'static str, Mesh)> {
    let turn = random.rotation();
    vec![
        ("cube", meshes::cube().turned(&turn)),
        ("sphere", meshes::icosphere(4)),
        ("torus", meshes::torus(1.0, 0.4, 60, 30).turned(&turn)),
        ("star", meshes::star(1, 3, 1.5)),
        ("two cubes", meshes::cube().and(meshes::cube().scaled(0.3).moved(3.0, 0.0, 0.0))),
        ("hull of voxels", meshes::with_edges_of_four_faces().remove(0).1.turned(&turn)),
    ]
}

fn budget(max_error: f64) -> ErrorBudget {
    ErrorBudget { max_error, band: 3.0, padding: 2, max_bytes: 1 << 28 }
}

fn worst_error(mesh: &TriangleMesh, distance: &MeshDistance, field: &OwnedGrid, random: &mut Random) -> f64 {
    let band = 3.0 * field.lattice().spacing();
    let error = |_| {
        let [a, b, c] = mesh.corners(random.below(mesh.triangle_count())).map(Vector3::from);
        let (u, v) = (random.unit(), random.unit());
        let point = a + (b - a) * u.min(v) + (c - b) * (u - v).abs() * u.min(v) + random.point_in_cube(0.5 * band);
        let exact = distance.signed_distance(point.into());
        if exact.abs() > band { 0.0 } else { (field.value(point) - exact).abs() }
    };
    (0..5000).map(error).fold(0.0, f64::max)
}

#[test]
fn a_grid_baked_to_a_budget_is_off_by_no_more() {
    let mut random = Random::from_env();
    for (name, mesh) in solids(&mut random) {
        let mesh = mesh.baked();
        let distance = MeshDistance::new(&mesh, None);
        for fraction in [0.3, 0.02] {
            let budget = budget(fraction * mesh.bounds().longest_side());
            let plan = budget.plan(&distance, &|_| ()).unwrap();
            let baked = budget.bake(&distance, &|_| ()).unwrap();
            assert_eq!(
                *baked.grid.lattice(),
                *plan.baker.lattice(),
                "{name}: the first plan was not within the budget"
            );
            assert!(baked.error_bound <= plan.error_bound && plan.error_bound <= budget.max_error, "{name}");
            let worst = worst_error(&mesh, &distance, &baked.grid, &mut random);
            assert!(worst <= budget.max_error, "{name}: off by {worst}, more than {}", budget.max_error);
            let cells = mesh.bounds().longest_side() / baked.grid.lattice().spacing();
            println!("{name}: {:.2} of the budget by {cells:.0} cells, {:?}", worst / budget.max_error, plan.precision);
        }
    }
}

/// A voxel of length 1 is nothing beside a mesh of 1e18, yet its rounding counts. Powers of two scale without rounding.
#[test]
fn a_budget_is_met_by_the_same_voxels_in_any_unit() {
    let needle = |unit: f64| {
        let mut cube = meshes::cube().scaled(unit);
        for point in &mut cube.points {
            (point.y, point.z) = (0.01 * point.y, 0.01 * point.z);
        }
        cube.baked()
    };
    let planned = |unit: f64| {
        let mesh = needle(unit);
        let distance = MeshDistance::new(&mesh, None);
        let plan = budget(0.02 * mesh.bounds().longest_side()).plan(&distance, &|_| ()).unwrap();
        (plan.baker.lattice().spacing() / unit, plan.error_bound / unit, plan.bytes)
    };
    let expected = planned(1.0);
    for exponent in [-70, -20, 20, 50, 60, 70] {
        assert_eq!(planned(f64::from(exponent).exp2()), expected, "2^{exponent}");
    }
}

#[test]
fn a_smooth_mesh_gets_larger_voxels_than_an_arbitrary_one() {
    let mesh = meshes::icosphere(5).baked();
    let distance = MeshDistance::new(&mesh, None);
    let budget = budget(0.005);
    let baked = budget.bake(&distance, &|_| ()).unwrap();
    let arbitrary = budget.max_error / 0.75_f64.sqrt();
    assert!(
        baked.grid.lattice().spacing() > 3.0 * arbitrary,
        "{}, {arbitrary} for any mesh",
        baked.grid.lattice().spacing()
    );
}

#[test]
fn a_budget_beyond_the_memory_limit_is_refused_with_what_fits_the_limit() {
    let mut random = Random::from_env();
    for (name, mesh) in solids(&mut random).into_iter().filter(|(name, _)| ["sphere", "two cubes"].contains(name)) {
        let mesh = mesh.baked();
        let distance = MeshDistance::new(&mesh, None);
        for (fraction, max_bytes) in
            [(1e-4, 3 << 20), (1e-5, 3 << 20), (1e-6, 3 << 20), (1e-12, 4 << 20), (1e-30, 1 << 20)]
        {
            let budget = ErrorBudget { max_bytes, ..budget(fraction * mesh.bounds().longest_side()) };
            let Err(refusal) = budget.plan(&distance, &|_| ()) else { panic!("{name}: {fraction} in {max_bytes}") };
            println!("{name}: {refusal}");
            let (max_error, achievable) = match &refusal {
                ErrorBudgetError::TooLarge { max_error, bytes: Some(bytes), achievable, .. } if fraction >= 1e-5 => {
                    assert!(*bytes > max_bytes, "{name}: {bytes}");
                    (*max_error, *achievable)
                }
                ErrorBudgetError::BelowRounding { max_error, rounding, achievable } if fraction < 1e-5 => {
                    assert!(rounding > max_error, "{name}: {rounding}");
                    (*max_error, *achievable)
                }
                _ => panic!("{name}: {refusal}"),
            };
            assert_eq!(max_error, budget.max_error, "{name}: not the error that was asked for");
            let achievable = achievable.unwrap();
            assert!(achievable.error > budget.max_error && achievable.bytes <= max_bytes, "{name}: {achievable:?}");
            let again = ErrorBudget { max_error: achievable.error, ..budget }.bake(&distance, &|_| ());
            assert!(again.unwrap().error_bound <= achievable.error, "{name}");
        }
        let nothing = ErrorBudget { max_bytes: 1000, ..budget(0.1) }.plan(&distance, &|_| ()).err();
        assert!(matches!(nothing, Some(ErrorBudgetError::TooLarge { achievable: None, .. })), "{name}: {nothing:?}");
    }
}

/// Far from the origin positions are rounded more than distances: no size makes up for it, and none is baked to find that out.
#[test]
fn an_error_below_the_rounding_of_positions_is_refused_at_once() {
    let mesh = meshes::icosphere(2).moved(2.0_f64.powi(40), 0.0, 0.0).baked();
    let distance = MeshDistance::new(&mesh, None);
    let (total, done) = (AtomicU64::new(0), AtomicU64::new(0));
    let count = |progress: Progress| {
        match progress {
            Progress::Total(slots) => total.fetch_add(slots, Ordering::Relaxed),
            Progress::Done(slots) => done.fetch_add(slots, Ordering::Relaxed),
        };
    };
    let bake = |max_error| budget(max_error).bake(&distance, &count);
    let refusal = bake(0.003).unwrap_err();
    let ErrorBudgetError::BelowRounding { max_error: 0.003, achievable: Some(achievable), .. } = refusal else {
        panic!("{refusal}")
    };
    assert_eq!(done.load(Ordering::Relaxed), 0);
    assert!(bake(achievable.error).unwrap().error_bound <= achievable.error);
    // Just above the rounding, one bake is enough.
    for slots in [&total, &done] {
        slots.store(0, Ordering::Relaxed);
    }
    let one_bake = budget(0.02).plan(&distance, &count).unwrap().baker.slot_count() as u64;
    let planned = [&total, &done].map(|slots| slots.swap(0, Ordering::Relaxed));
    assert_eq!(planned[0], planned[1], "sizes that are given up count as done");
    assert!(bake(0.02).unwrap().error_bound <= 0.02);
    assert_eq!([total.into_inner(), done.into_inner()], planned.map(|slots| slots + one_bake));
}

#[test]
fn a_budget_that_no_voxel_size_meets_is_refused() {
    let open = meshes::icosphere(2).without(&[0, 1, 2]).baked();
    let refusal = budget(0.1).bake(&MeshDistance::new(&open, None), &|_| ()).unwrap_err();
    assert!(matches!(refusal, ErrorBudgetError::SignJumps { .. }), "{refusal}");
    let closed = meshes::icosphere(2).baked();
    for error in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refusal = budget(error).bake(&MeshDistance::new(&closed, None), &|_| ()).unwrap_err();
        assert!(matches!(refusal, ErrorBudgetError::InvalidError(_)), "{refusal}");
    }
}

#[test]
fn threads_choose_the_same() {
    let mesh = meshes::torus(1.0, 0.4, 40, 20).baked();
    let distance = MeshDistance::new(&mesh, None);
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| budget(0.02).bake(&distance, &|_| ()).unwrap())
    };
    let one = on(1);
    assert!([2, 5].into_iter().all(|threads| on(threads) == one));
}
