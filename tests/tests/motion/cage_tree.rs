//! The tree over a cage's tetrahedra and their inverses: what is near is found, in cages of all sizes and tetrahedra of all shapes.

use nalgebra::Vector3;
use sdf_core::Aabb;
use sdf_core::cage::{TetFrame, TetLocator, sort_tets, tet_tree_size};
use sdf_core::contact::{ClusterKey, TetPoint};
use sdf_tests::random::Random;

use crate::cage_lattice::{Lattice, with_locator};
use crate::random_weights;

/// Every tetrahedron that holds a point is found, at all numbers of tetrahedra up to a tree of four levels, and buffers of another
/// length are refused.
#[test]
fn the_tree_finds_what_a_look_at_every_tetrahedron_finds() {
    let mut random = Random::seeded();
    for count in (0..80).chain([511, 512, 513, 600, 4095, 4096, 4097]) {
        let points: Vec<[f64; 3]> = (0..4 * count).map(|_| random.in_cube(1.0).into()).collect();
        let tets: Vec<[u32; 4]> = (0..count as u32).map(|tet| [0, 1, 2, 3].map(|k| 4 * tet + k)).collect();
        let lattice = Lattice { points, tets };
        // Deformed, so that the order is no longer that of the boxes; and some are lost.
        let lost = random.below(8);
        let moved = |(index, point): (usize, &[f64; 3])| match index % 37 == lost {
            true => [f64::NAN; 3],
            false => (Vector3::from(*point) + random.in_cube(0.4)).into(),
        };
        let now: Vec<[f64; 3]> = lattice.points.iter().enumerate().map(moved).collect();
        let mut random = Random::seeded();
        with_locator(&lattice, &now, |locator| {
            for _ in 0..40 {
                let point = random.in_cube(1.0);
                let weights = |tet: u32| locator.weights(tet, point);
                let depth = |weights: [f64; 4]| weights.into_iter().fold(f64::INFINITY, f64::min);
                let depths = (0..count as u32).filter_map(|tet| Some((depth(weights(tet)?), tet)));
                let deepest = depths.filter(|(depth, _)| *depth >= 0.0).max_by(|a, b| a.0.total_cmp(&b.0));
                assert_eq!(locator.locate(point).map(|at| at.tet), deepest.map(|(_, tet)| tet), "of {count}");
            }
        });
        let (mut order, mut frames) = (vec![0; count], vec![TetFrame::ILL_CONDITIONED; count]);
        let mut keys = vec![ClusterKey::default(); count];
        assert!(!sort_tets(&lattice.points, &lattice.tets, &mut keys, &mut vec![0; count + 1]));
        assert!(sort_tets(&lattice.points, &lattice.tets, &mut keys, &mut order));
        let mut boxes = vec![Aabb::EVERYWHERE; tet_tree_size(count) + 1];
        assert!(TetLocator::new(&now, &lattice.tets, &order, &mut boxes, &mut frames).is_none());
    }
}

/// Inverses of tetrahedra from round to flat: each accepted one gives weights that lead back, to what its shape allows.
#[test]
fn weights_lead_back_in_tetrahedra_of_all_shapes() {
    let mut random = Random::seeded();
    let mut good = 0;
    for step in 0..4000 {
        let flat = 10_f64.powf(-10.0 * f64::from(step) / 4000.0);
        let size = 10_f64.powf(random.between(-12.0, 12.0));
        let corners = [0; 4].map(|_| {
            let corner = random.in_cube(1.0);
            (Vector3::new(corner.x, corner.y, corner.z * flat) * size).into()
        });
        let lattice = Lattice { points: corners.to_vec(), tets: vec![[0, 1, 2, 3]] };
        with_locator(&lattice, &corners, |locator| {
            let wanted: [f64; 4] = random_weights(&mut random);
            let point = locator.point(&TetPoint { tet: 0, weights: wanted }).unwrap();
            let Some(found) = locator.weights(0, point) else { return };
            good += 1;
            let worst = found.iter().zip(wanted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(worst < 1e-14 * 1e3 / flat, "{worst} at {flat}");
        });
    }
    assert!(good > 2000, "{good}");
}
