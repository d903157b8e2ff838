//! Has a grid a node inside? A solid thinner than a voxel may pass between all nodes: its grid has no surface, and finds no contact.

use sdf_core::grid::owned::OwnedGrid;
use sdf_core::grid::sparse::{BRICK, brick_counts};
use sdf_core::grid::{Lattice, Storage};

/// Is a sample negative? By the bounds of each block of 8 × 8 × 8 nodes.
pub(crate) fn has_inside(grid: &OwnedGrid) -> bool {
    let [nx, ny, nz] = brick_counts(grid.lattice());
    let is_inside = |slot: [u32; 3]| {
        let node = slot.map(|count| count * BRICK);
        grid.storage().lowest(node, node).is_some_and(|lowest| lowest < 0.0)
    };
    (0..nz).any(|z| (0..ny).any(|y| (0..nx).any(|x| is_inside([x, y, z]))))
}

/// The side of a voxel, where the mesh is closed and no node is inside of its solid.
pub(super) fn thin_voxel(is_closed: bool, has_inside: bool, lattice: &Lattice) -> Option<f64> {
    (is_closed && !has_inside).then(|| lattice.spacing())
}
