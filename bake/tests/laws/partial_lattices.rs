//! Lattices that do not hold the whole mesh, and bands that are not lengths.

use sdf_bake::error_budget::{ErrorBudget, ErrorBudgetError};
use sdf_bake::sparse::{InvalidBand, SparseBaker};
use sdf_bake::{BakedGrid, MeshDistance, SignMethod, dense, lattice_around, sparse};
use sdf_core::grid::Lattice;
use sdf_core::{Aabb, EnclosedSdf, Sdf};

use crate::meshes;
use crate::random::Random;

const BAND: f64 = 0.3;

fn bakes(distance: &MeshDistance, lattice: &Lattice) -> [BakedGrid; 2] {
    let sparse = sparse::bake::<u16>(distance, lattice, BAND, &|_| ()).unwrap();
    [dense::bake(distance, lattice, &|_| ()).into_grid(lattice), sparse.into_grid(lattice, BAND)]
}

/// Half of a ball, a box inside of it, one beside it: in the box the error is certified, outside nothing is known.
#[test]
fn the_error_outside_of_a_lattice_that_does_not_hold_the_mesh_is_unknown() {
    let mesh = meshes::icosphere(1).baked();
    let lattices = [
        Lattice::new([0.0, -1.5, -1.5], 0.1, [16, 31, 31]),
        Lattice::new([-0.2; 3], 0.05, [9; 3]),
        Lattice::new([1.5, -0.5, -0.5], 0.1, [20; 3]),
    ];
    let whole = lattice_around(&mesh.bounds(), 0.1, 0).unwrap();
    let mut random = Random::from_env();
    for sign in [SignMethod::PseudoNormal, SignMethod::Winding] {
        let distance = MeshDistance::new(&mesh, Some(sign));
        for lattice in lattices.map(Option::unwrap) {
            let bounds = lattice.bounds();
            for BakedGrid { grid, .. } in bakes(&distance, &lattice) {
                assert!(grid.inside_reaches_box());
                let beyond = Aabb { min: bounds.min.map(|x| x - 1.0), max: bounds.min };
                assert_eq!(grid.error_bound(&beyond).near, f64::INFINITY);
                for _ in 0..2000 {
                    let point: [f64; 3] = random.point_in_box(bounds.min, bounds.max).into();
                    let (sample, truth) = (grid.sample(point.into()), distance.signed_distance(point));
                    let error = grid.error_bound(&Aabb { min: point, max: point });
                    assert!(error.near.is_finite());
                    if truth.abs() <= BAND {
                        assert!((sample.value - truth).abs() <= error.near, "{point:?}: {} for {truth}", sample.value);
                    }
                    assert!(sample.value - truth <= error.above, "{point:?}: {} for {truth}", sample.value);
                }
            }
        }
        assert!(bakes(&distance, &whole).iter().all(|baked| !baked.grid.inside_reaches_box()));
    }
}

#[test]
fn a_band_that_is_not_a_length_is_refused() {
    let mesh = meshes::icosphere(1).baked();
    let (distance, lattice) = (MeshDistance::new(&mesh, None), lattice_around(&mesh.bounds(), 0.1, 3).unwrap());
    for band in [f64::NAN, f64::INFINITY, -1.0] {
        let refused = SparseBaker::new(&distance, &lattice, band).err().expect("a refusal").to_string();
        assert_eq!(refused, InvalidBand(band).to_string());
        let budget = ErrorBudget { max_error: 0.1, band, padding: 2, max_bytes: 1 << 28 };
        assert!(matches!(budget.plan(&distance, &|_| ()).err(), Some(ErrorBudgetError::InvalidBand(_))), "{band}");
    }
    assert!(SparseBaker::new(&distance, &lattice, 0.0).is_ok());
}
