//! Certified error of interpolation in the cells of one slot, as far as the band reaches.
//!
//! Blocks of 2 × 2 × 2 cells are refined from the worst on: each has at first a cheap upper bound of its error, then
//! its error, then the errors of its cells. Refinement ends when no block can be worse than the worst cell.

use std::cmp::Ordering;

use sdf_core::grid::sparse::BRICK;

use super::SparseBaker;
use super::brick_map::middle;
use crate::error::block::{ErrorBlock, Query};
use crate::error::normal_cones::MAX_ERROR;
use crate::error::{BoundedBlock, BrickErrors};
use crate::simd::LANES;

/// A block whose error is at most this many times that of the worst cell so far stands for its cells. Compared with 1,
/// it saves a tenth of the time.
const GOOD_ENOUGH: f64 = 1.05;

/// A block that is not refined to cells.
#[derive(Clone, Copy)]
struct Candidate {
    block: usize,
    /// Upper bound of the block's error.
    error: f64,
    /// Is `error` the block's own, not the cheap bound?
    is_exact: bool,
}

impl Candidate {
    /// Greater is refined earlier: of equal errors, bounds before exact ones, then the first block.
    fn priority(&self, other: &Self) -> Ordering {
        let by_error = self.error.total_cmp(&other.error);
        by_error.then(other.is_exact.cmp(&self.is_exact)).then(other.block.cmp(&self.block))
    }
}

impl SparseBaker<'_> {
    /// Error bounds of bricks in these slots, lengths, as by [`Certify::Tight`](super::Certify::Tight) whatever the grid was certified by. Of
    /// interpolation alone: samples are taken as exact. `None` unless the mesh bounds one solid.
    pub fn tight_errors(&self, slots: &[[u32; 3]]) -> Option<Vec<f64>> {
        self.mesh.solid_normals()?;
        let error = |slot: [u32; 3]| {
            let mut guess = 0;
            self.slot_error(slot, 0.0, |step| {
                let (distance, triangle) = self.mesh.distance_within(self.node(slot, step), guess, 0.0);
                guess = triangle;
                (distance, triangle)
            })
        };
        Some(sdf_parallel::map(slots.len(), |index| error(slots[index])))
    }

    /// Bound of the error of a slot's cells, a length, by the normals near all of the slot. `nearest` returns distance and
    /// triangle of the tree at the node in its middle.
    pub(super) fn whole_slot_error(&self, slot: [u32; 3], nearest: impl FnOnce([usize; 3]) -> (f64, usize)) -> f64 {
        let spacing = self.lattice.spacing();
        let step = [BRICK as usize / 2; 3];
        let (center, (distance, triangle)) = (self.node(slot, step), nearest(step));
        let block = ErrorBlock { center, half_side: 0.5 * f64::from(BRICK) * spacing };
        let at_center = ErrorBlock { half_side: 0.0, ..block };
        let mut errors = BrickErrors::new(self.mesh, at_center, block.half_side, distance);
        let bounded = errors.bound_blocks(&[Query { block, distance, slot: triangle }]);
        spacing * bounded.first().map_or(MAX_ERROR, |block| block.error_bound.min(MAX_ERROR))
    }

    /// Bound of the error of a slot's cells, a length: not tightened below `sufficient`, which takes less time. `nearest` returns
    /// distance and triangle of the tree at the nodes in the middle of 2 × 2 × 2 cells; a distance beyond W can be any number beyond W.
    pub(super) fn slot_error(
        &self,
        slot: [u32; 3],
        sufficient: f64,
        nearest: impl FnMut([usize; 3]) -> (f64, usize),
    ) -> f64 {
        let spacing = self.lattice.spacing();
        if self.mesh.solid_normals().is_none() {
            return MAX_ERROR * spacing;
        }
        let queries = self.block_queries(slot, nearest);
        let max_distance = queries.iter().map(|query| query.distance).fold(0.0, f64::max);
        // The blocks' centers are one spacing inside the slot.
        let half_side = (0.5 * f64::from(BRICK) - 1.0) * spacing;
        let centers = ErrorBlock { center: middle(&self.lattice, slot.map(|n| n as usize)), half_side };
        let mut errors = BrickErrors::new(self.mesh, centers, spacing, max_distance);
        let blocks: Vec<BoundedBlock> =
            queries.chunks(LANES).flat_map(|queries| errors.bound_blocks(queries)).collect();
        spacing * self.worst_cell(&mut errors, &blocks, sufficient / spacing)
    }

    /// Blocks of a slot that the band can enter.
    fn block_queries(&self, slot: [u32; 3], mut nearest: impl FnMut([usize; 3]) -> (f64, usize)) -> Vec<Query> {
        let mut queries = vec![];
        for step in (0..64).map(|index| [index % 4, index / 4 % 4, index / 16].map(|n: usize| 2 * n + 1)) {
            let node: [u32; 3] = std::array::from_fn(|axis| slot[axis] * BRICK + step[axis] as u32);
            // Blocks beyond the last node contain no cell.
            let is_in_lattice = (0..3).all(|axis| node[axis] < self.lattice.nodes()[axis]);
            let (distance, slot) = nearest(step);
            if is_in_lattice && distance <= self.map.exact_within() {
                let block = ErrorBlock { center: self.lattice.node(node).into(), half_side: self.lattice.spacing() };
                queries.push(Query { block, distance, slot });
            }
        }
        queries
    }

    /// Error of the worst cell, in voxels, or of a block hardly worse, or a bound of all that is at most `sufficient`.
    fn worst_cell(&self, errors: &mut BrickErrors, blocks: &[BoundedBlock], sufficient: f64) -> f64 {
        let candidate =
            |(block, bounded): (usize, &BoundedBlock)| Candidate { block, error: bounded.error_bound, is_exact: false };
        let mut candidates: Vec<Candidate> = blocks.iter().enumerate().map(candidate).collect();
        let mut worst_cell = 0.0_f64;
        while let Some(worst) = candidates.iter_mut().max_by(|a, b| a.priority(b)) {
            let block = &blocks[worst.block];
            if worst.error <= worst_cell {
                break;
            } else if worst.error <= sufficient || (worst.is_exact && worst.error <= GOOD_ENOUGH * worst_cell) {
                return worst.error;
            } else if !worst.is_exact {
                *worst = Candidate { error: errors.block_error(block), is_exact: true, ..*worst };
            } else {
                worst_cell = errors.cell_error(block, self.map.band(), worst_cell);
                worst.error = f64::NEG_INFINITY;
            }
        }
        worst_cell
    }
}

#[cfg(test)]
mod tests {
    use sdf_core::grid::sparse::brick_counts;
    use sdf_procedural::{CrackedNut, SpikedBall};

    use super::*;
    use crate::{MeshDistance, TriangleMesh, lattice_around};

    /// A bound of a whole slot holds for all of its cells. Where the mesh is flat, it is as low as theirs.
    #[test]
    fn the_bound_of_a_whole_slot_is_at_least_that_of_its_cells() {
        let mut flat = 0;
        let nut = CrackedNut { cells: 2, cracks: [0; 2], gap: 0.0 };
        for mesh in [nut.mesh(), SpikedBall { levels: 1, radius: 0.5 }.mesh()] {
            let mesh = TriangleMesh::new(&mesh.points, &mesh.triangles).unwrap();
            let distance = MeshDistance::new(&mesh, None);
            distance.tree().prepare_packets();
            let spacing = mesh.bounds().longest_side() / 120.0;
            let lattice = lattice_around(&mesh.bounds(), spacing, 2).unwrap();
            let baker = SparseBaker::new(&distance, &lattice, 3.0 * spacing).unwrap();
            let [x, y, z] = brick_counts(&lattice);
            let slots = (0..x * y * z).map(|n| [n % x, n / x % y, n / x / y]);
            for slot in slots {
                let nearest = |step| {
                    let nearest = distance.nearest(baker.node(slot, step), 0);
                    (nearest.distance, nearest.guess)
                };
                let (whole, cells) = (baker.whole_slot_error(slot, nearest), baker.slot_error(slot, 0.0, nearest));
                // The same normals in another order: each bound is rounded up by more.
                assert!(whole >= cells * (1.0 - 1e-12), "{slot:?}: {whole} of the slot, {cells} of a cell");
                flat += usize::from(cells > 0.0 && whole < 0.01 * spacing);
            }
        }
        assert!(flat > 0);
    }
}
