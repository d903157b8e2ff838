//! Invalid queries, small buffers and budgets, and samples that are not finite.

use nalgebra::Vector3;
use sdf_core::overlap::{BoxNode, DeepestPoint, DepthSearch, MortonLeaf, NoRegion, Pair};
use sdf_core::shapes::HalfSpace;
use sdf_core::{Aabb, Sdf};
use sdf_tests::scene_field::SceneField;
use sdf_tests::scenes::{cube_lattice, dense_grid, node_indices, sampled};

use super::{deepest, minima, patch, ring_and_bar, shifted, sphere};

#[test]
fn invalid_queries_are_reported() {
    let (ball, floor) = (sphere(1.0), SceneField::new(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap()));
    for margin in [0.0, 1.0] {
        assert_eq!(Pair::new(&floor, &floor, margin).err(), Some(NoRegion::Unbounded));
    }
    for margin in [f64::NAN, f64::INFINITY] {
        assert!(Pair::new(&ball, &ball, margin).is_err(), "{margin}");
    }
    assert!(Pair::new(&ball, &sphere(1e200), 0.0).is_ok());
    let pair = Pair::new(&ball, &floor, 0.0).unwrap();
    for resolution in [0.0, -1.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE] {
        let found = pair.patch::<f64>(resolution, 500, |_| ());
        assert!(
            found.resolution > 0.0 && found.resolution.is_finite() && found.evaluations < 520,
            "{resolution}: {found:?}"
        );
    }
    assert!(!pair.patch::<f64>(1e-3, 500, |_| ()).is_complete);
    let short = pair.minima::<f64>(0.1, 1 << 20, &mut [MortonLeaf::empty(); 8], &mut [None; 4]);
    assert!(!short.is_complete && short.leaf_count > 8, "{short:?}");
    let within = Aabb { min: [0.2, -1.0, -1.0], max: [1.0; 3] };
    let part = pair.restrict(&within).unwrap();
    assert!(within.encloses(&part.region()) && deepest::<f64>(&part, 1e-4).point.unwrap().point.x >= 0.2);
}

#[test]
fn with_small_buffers_or_budgets_the_bounds_still_hold() {
    let [ring, bar] = ring_and_bar();
    let pair = Pair::new(&ring, &bar, 0.0).unwrap();
    for pieces in [0, 1, 2, 3, 5, 8, 20, 100] {
        for evaluations in [0, 1, 10, 100, 1000, 10_000] {
            let found: DeepestPoint<f64> =
                pair.deepest(&DepthSearch { evaluations, tolerance: 1e-6 }, &mut vec![BoxNode::EMPTY; pieces]);
            assert!(
                found.lower_bound <= -0.025 && found.point.unwrap().value >= -0.025 - 1e-12,
                "{pieces} {evaluations}: {found:?}"
            );
            assert!(!found.converged, "{pieces} {evaluations}: {found:?}");
            assert!(found.evaluations <= evaluations + 98, "{pieces} {evaluations}: {found:?}");
        }
    }
}

#[test]
fn samples_that_are_not_finite_prove_nothing_and_stop_nothing() {
    let ball = sphere(0.5);
    let lattice = cube_lattice(0.75, 12);
    let whole = sampled(&ball, lattice, 1.0);
    let value = |node| whole.value(Vector3::from(lattice.node(node))) as f32;
    let mut samples: Vec<f32> = node_indices(lattice.nodes()).map(value).collect();
    for bad in [f32::NAN, f32::INFINITY] {
        samples.iter_mut().skip(lattice.index([6, 6, 9])).take(3).for_each(|sample| *sample = bad);
        let broken = SceneField::new(dense_grid(lattice, samples.clone(), 2.0));
        let other = shifted(&ball, [0.05, 0.0, 0.8]);
        let pair = Pair::new(&broken, &other, 0.0).unwrap();
        let search = DepthSearch { evaluations: 1 << 12, tolerance: 1e-3 };
        let found: DeepestPoint<f64> = pair.deepest(&search, &mut [BoxNode::EMPTY; 1024]);
        assert!(!found.converged && found.lower_bound == f64::NEG_INFINITY, "{found:?}");
        assert!(found.point.is_some_and(|at| at.value < -0.05 && at.point.iter().all(|x| x.is_finite())), "{found:?}");
        let (all, points) = patch::<f64>(&pair, 0.05);
        assert!(
            all.undefined_count > 0 && all.area.is_finite() && points.iter().all(|piece| piece.point.value.is_finite()),
            "{all:?}"
        );
        let (all, points) = minima(&pair, 0.05);
        assert!(all.undefined_count > 0 && points.iter().all(|at| at.value.is_finite()), "{all:?}");
    }
    // All samples NaN.
    let broken = SceneField::new(dense_grid(lattice, vec![f32::NAN; lattice.node_count()], 2.0));
    let pair = Pair::new(&broken, &ball, 0.0).unwrap();
    let found: DeepestPoint<f64> =
        pair.deepest(&DepthSearch { evaluations: 100, tolerance: 1e-3 }, &mut [BoxNode::EMPTY; 64]);
    assert!(found.point.is_none() && found.lower_bound == f64::NEG_INFINITY && !found.converged, "{found:?}");
}
