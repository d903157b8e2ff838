//! The lattice around a mesh.

use sdf_bake::lattice_around;
use sdf_core::Aabb;
use sdf_core::grid::Lattice;

use crate::meshes;
use crate::oracle::Baked;
use crate::random::Random;

/// Rounding of an extent that [`lattice_around`] tolerates, in cells.
const ROUNDING: f64 = 2e-9;

fn assert_covers(lattice: &Lattice, bounds: &Aabb, padding: u32) {
    let (spacing, covered) = (lattice.spacing(), lattice.bounds());
    let margin = (f64::from(padding) - ROUNDING) * spacing;
    for axis in 0..3 {
        let rounding = 4.0 * f64::EPSILON * covered.min[axis].abs().max(covered.max[axis].abs());
        let (below, above) = (bounds.min[axis] - covered.min[axis], covered.max[axis] - bounds.max[axis]);
        assert!(below >= margin - rounding && above >= margin - rounding, "{below} and {above} of {spacing}");
        assert!((below - above).abs() <= ROUNDING * spacing + 2.0 * rounding, "not centered: {below} and {above}");
        let max_margin = margin + spacing * (1.0 + 2.0 * ROUNDING) + rounding;
        assert!(below <= max_margin && above <= max_margin, "{below} and {above} are too wide");
    }
}

#[test]
fn the_grid_covers_the_box_and_its_padding_on_all_sides_and_no_more() {
    let mut random = Random::from_env();
    for _ in 0..20_000 {
        let size = 10.0_f64.powf(random.between(-20.0, 20.0));
        let far = size * 10.0_f64.powf(random.between(-3.0, 3.0));
        let min = random.point_in_cube(far);
        let extents = [0, 1, 2].map(|_| if random.below(8) == 0 { 0.0 } else { size * random.unit() });
        let bounds = Aabb { min: min.into(), max: [0, 1, 2].map(|axis| min[axis] + extents[axis]) };
        let cells = random.between(0.5, 2000.0);
        if bounds.longest_side() > 0.0 {
            let padding = random.below(6) as u32;
            let lattice = lattice_around(&bounds, bounds.longest_side() / cells, padding).unwrap();
            assert_covers(&lattice, &bounds, padding);
        }
    }
}

#[test]
fn the_longest_side_has_as_many_cells_as_requested() {
    let mut random = Random::from_env();
    for cells in (1..600).chain([1000, 1023, 4096, 99_999, 1_000_000]) {
        let longest = random.between(0.1, 10.0) * 10.0_f64.powf(random.between(-15.0, 15.0));
        let min = random.point_in_cube(longest);
        let max = [min.x + longest * 0.5, min.y + longest, min.z];
        let bounds = Aabb { min: min.into(), max };
        let lattice = lattice_around(&bounds, bounds.longest_side() / f64::from(cells), 3).unwrap();
        assert_eq!(lattice.cells()[1], cells + 6, "{bounds:?}");
    }
}

#[test]
fn a_flat_mesh_lies_in_the_middle_of_its_grid() {
    let sheet = meshes::sheet(4).baked();
    for padding in [0, 1, 4] {
        let lattice = lattice_around(&sheet.bounds(), 0.125, padding).unwrap();
        assert_eq!(lattice.cells(), [16 + 2 * padding, 16 + 2 * padding, (2 * padding).max(1)]);
        assert_covers(&lattice, &sheet.bounds(), padding);
    }
    let baked = Baked::from_mesh(&meshes::sheet(4), None, 16);
    for (node, distance) in baked.nodes() {
        let beside = (node.abs().add_scalar(-1.0)).map(|x| x.max(0.0)).xy().norm();
        assert!((distance - beside.hypot(node.z)).abs() < 1e-6, "{distance} at {node:?}");
    }
}

#[test]
fn a_lattice_that_cannot_exist_is_none() {
    let cube = Aabb::centered([1.0; 3]);
    for spacing in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-9, 1e-300, f64::MIN_POSITIVE] {
        assert_eq!(lattice_around(&cube, spacing, 2), None, "{spacing}");
    }
    for padding in [Lattice::MAX_NODES / 2, u32::MAX] {
        assert_eq!(lattice_around(&cube, 0.1, padding), None, "{padding}");
    }
    // Each axis fits, but the number of all nodes overflows usize.
    assert_eq!(lattice_around(&cube, 2.0 / 16e6, 0), None);
    assert_eq!(lattice_around(&Aabb::EVERYWHERE, 1.0, 0), None);
}
