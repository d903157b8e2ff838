//! Winding numbers from neighbours that no clear grid edge joins to a node.
//!
//! 1. Along a clear diagonal of a cell face or of a cell, w is carried on as along a grid edge.
//! 2. Across triangles, w jumps by the sum of their orientations. Exact orientation predicates (Shewchuk 1997, "Adaptive
//!    precision floating-point arithmetic and fast robust geometric predicates", crate `robust`) find the triangles
//!    that a segment crosses: [`MeshDistance::winding_change`](crate::MeshDistance::winding_change).

use super::{FloodFill, Winding};
use crate::sign::winding::Estimate;

/// Neighbours tried per node. A crossing seldom fails except near the boundary.
const MAX_TRIES: usize = 3;

impl FloodFill<'_> {
    /// Adopts the winding number of a known neighbour across a face or a cell with a clear segment.
    pub(super) fn copy_from_diagonal(&mut self, index: usize) {
        let is_usable = |(neighbour, length): &(usize, f64)| {
            let is_diagonal = *length > 1.0 && self.windings[*neighbour].is_known();
            is_diagonal && self.is_clear(index, self.distances[*neighbour], *length)
        };
        let usable: Vec<_> = self.neighbours(index).filter(is_usable).take(MAX_TRIES).collect();
        for (neighbour, length) in usable {
            self.adopt(index, self.windings[neighbour], length, |flood| flood.position(neighbour));
            if self.windings[index].is_known() {
                return;
            }
        }
    }

    /// Adopts the winding number of a known neighbour plus the jump across the triangles between.
    pub(super) fn cross_triangles(&mut self, index: usize) {
        if self.is_on_surface(index) {
            return;
        }
        let is_usable =
            |(neighbour, _): &(usize, f64)| self.windings[*neighbour].is_certain() && !self.is_on_surface(*neighbour);
        let usable: Vec<_> = self.neighbours(index).filter(is_usable).take(MAX_TRIES).collect();
        for (neighbour, length) in usable {
            let before = Estimate::from(self.windings[neighbour]);
            let Some(step) = self.mesh.winding_change([neighbour, index].map(|end| self.position(end))) else {
                continue;
            };
            let after = Winding::new(Estimate { value: before.value + step, ..before });
            self.adopt(index, after, length, |flood| flood.position(neighbour));
            if self.windings[index].is_known() {
                return;
            }
        }
    }

    /// The 26 neighbours of a node, with their distances from it in spacings.
    fn neighbours(&self, index: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let strides = self.strides;
        let first = index - strides.iter().sum::<usize>();
        NEIGHBOURS.into_iter().map(move |steps| {
            let length = (steps.iter().filter(|step| **step != 1).count() as f64).sqrt();
            (first + (0..3).map(|axis| steps[axis] * strides[axis]).sum::<usize>(), length)
        })
    }
}

/// Steps along each axis to the neighbours, counted from the first of them at (−1, −1, −1).
const NEIGHBOURS: [[usize; 3]; 26] = {
    let mut neighbours = [[0; 3]; 26];
    let mut index = 0;
    while index < 26 {
        let cell = if index < 13 { index } else { index + 1 };
        neighbours[index] = [cell % 3, cell / 3 % 3, cell / 9];
        index += 1;
    }
    neighbours
};
