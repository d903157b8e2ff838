//! Fields whose values overflow in a part of an element: is what a search says of the element true all the same?

use sdf_core::combine::{SmoothUnion, Union};
use sdf_core::contact::{Element, all_contacts};
use sdf_core::grid::{Dense, Grid, Lattice, measure_slope_bound};
use sdf_core::minimize::{AllMinima, Certified, Minimizer, Minimum, SimplexCell};
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::{Placed, Stretch};
use sdf_core::shapes::{RoundedBox, Sphere};
use sdf_core::{EnclosedSdf, Float, Sdf, Simplex};

type Overflowing = Placed<SmoothUnion<Sphere, RoundedBox>, Stretch>;

/// Squares of the segment's ends overflow in the frame of the shapes, and a smooth union takes ∞ from ∞. Its middle has a value.
fn overflowing() -> (Overflowing, Simplex<f64, 2>) {
    let shapes =
        SmoothUnion::new(Sphere::new(1e-51).unwrap(), RoundedBox::new([0.6, 0.9, 0.6], 0.9).unwrap(), 0.6).unwrap();
    let field = Placed { field: shapes, placement: Stretch::new([8e-278, 1e-8, -1.0]).unwrap() };
    (field, Simplex { corners: [Vector3::new(-1.0, -1.0, 0.4), Vector3::new(1.0, 0.8, -0.9)] })
}

/// Found by fuzzing: the lower bound was NaN.
#[test]
fn a_certified_search_proves_nothing_where_a_corner_has_no_value() {
    let (field, simplex) = overflowing();
    let twice = Union(field, field);
    for evaluations in 0..80 {
        let search = Certified { evaluations, ..Certified::default() };
        for minimum in [search.minimize(&field, &simplex), search.minimize(&twice, &simplex)] {
            assert_eq!(
                (minimum.lower_bound, minimum.converged),
                (f64::NEG_INFINITY, false),
                "{evaluations}: {minimum:?}"
            );
        }
    }
}

/// Found by fuzzing: the lower bound was NaN.
#[test]
fn contacts_of_all_minima_have_bounds_where_a_corner_has_no_value() {
    let (field, simplex) = overflowing();
    let element = Element { id: 0, vertices: [0, 1], simplex };
    let search = AllMinima {
        search: Certified { evaluations: 64, ..Certified::default() },
        max_cells: 256,
        ..AllMinima::default()
    };
    let (mut cells, mut minima) = (vec![SimplexCell::default(); 256], vec![Minimum::default(); 16]);
    let mut count = 0;
    all_contacts(&field, &search, 3.0, &element, &mut cells, &mut minima, |found| {
        count += 1;
        assert!(found.lower_bound <= found.distance, "{found:?}");
        assert!(found.shape_lower_bound <= found.lower_bound, "{found:?}");
    });
    let summary = search.minima(&field, &element.simplex, 3.0, &mut cells, &mut minima);
    assert!(count > 0 && summary.lower_bound == f64::NEG_INFINITY && !summary.is_complete, "{summary:?}");
}

/// Planes whose direction underflows exclude no cell: a sliver as thin as the least number has its minimum at the corner where φ is 0.
#[test]
fn a_sliver_thinner_than_the_least_normal_number_has_its_minimum() {
    let lattice = Lattice::new([0.0; 3], 0.125, [4, 4, 10]).unwrap();
    let samples: Vec<f32> = (0..160).map(|index| if index < 16 { 0.0 } else { 1.0 }).collect();
    let dense = Dense::new(&lattice, &samples[..]).unwrap();
    let grid = Grid::new(lattice, dense, measure_slope_bound(&lattice, &dense)).unwrap();
    fn check<R: Float, F: EnclosedSdf>(grid: &F, thickness: R) {
        let at = |z: f64| Vector3::new(R::zero(), R::zero(), R::from_f64(z));
        let corners = [Vector3::new(thickness, R::zero(), R::zero()), at(1.0), at(0.5)];
        let minimum = Certified::default().minimize(grid, &Simplex { corners });
        assert!(
            minimum.sample.value.to_f64() < 1e-3 && minimum.lower_bound.to_f64() <= 0.0,
            "{thickness:?}: {minimum:?}"
        );
    }
    [1e-36, 1e-39, 1e-40, 1e-45, 0.0_f32].into_iter().for_each(|thickness| check(&grid, thickness));
    [1e-300, 1e-308, 1e-309, 1e-320, 0.0_f64].into_iter().for_each(|thickness| check(&grid, thickness));
}

/// Samples between whose neighbours f32 cannot square the difference: no bound is above the field. Noise of a fixed seed.
#[test]
fn bounds_on_segments_hold_where_squares_overflow() {
    let lattice = Lattice::new([-3.0, -2.0, -3.0], 1.0, [7, 6, 8]).unwrap();
    let mut state = 7_u64;
    let mut random = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 40) as f32 / 16_777_216.0 * 2.0 - 1.0
    };
    for size in [1e15, 3e19, 1e20, 1e25_f32] {
        let samples: Vec<f32> = (0..336).map(|_| random() * size).collect();
        let dense = Dense::new(&lattice, &samples[..]).unwrap();
        let grid = Grid::new(lattice, dense, measure_slope_bound(&lattice, &dense)).unwrap();
        for _ in 0..300 {
            let mut end = || Vector3::from_fn(|_, _| random() * 2.0);
            let corners = [end(), end()];
            let minimum = Certified::default().minimize(&grid, &Simplex { corners });
            let values = (0..=400).map(|step| {
                let weight = f64::from(step) / 400.0;
                grid.value((corners[0] * (1.0 - weight as f32) + corners[1] * weight as f32).map(f64::from))
            });
            let lowest = values.fold(f64::INFINITY, f64::min);
            // 32 ε of values and of points, at slopes of up to 4 sizes in a cell, are 2e-5 sizes.
            let rounding = f64::from(size) * 1e-4;
            assert!(f64::from(minimum.lower_bound) <= lowest + rounding, "{size}: {lowest}, {minimum:?}");
        }
    }
}
