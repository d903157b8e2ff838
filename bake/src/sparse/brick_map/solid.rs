//! Sides of a marked map by pseudo-normals.
//!
//! Slots without nodes near the surface are on one side with their neighbours, so one search tells the side of each
//! connected part of them, and of the nodes beside them.

use sdf_core::grid::sparse::BRICK;

use super::marked::Marked;
use super::{BrickMap, middle};

/// Distance of a slot's middle from its corners, in voxels, rounded up.
const HALF_DIAGONAL: f32 = 6.9283;

impl BrickMap {
    /// Fills in the sides and magnitudes of a closed mesh that pseudo-normals sign.
    pub(super) fn with_sides_of_solid(mut self, marked: &Marked) -> Self {
        let slots_inside = self.far_slots_inside(marked);
        let row = self.counts[0] as usize + 1;
        let nodes: Vec<[u32; 3]> = self.map_coarse_nodes(|node| node);
        let rows = sdf_parallel::map(nodes.len() / row, |line| {
            let mut guess = 0;
            let nodes = nodes[line * row..(line + 1) * row].iter();
            nodes.map(|node| self.solid_node(marked, &slots_inside, *node, &mut guess)).collect::<Vec<_>>()
        });
        let (magnitudes, nodes_inside) = rows.into_iter().flatten().unzip();
        self.set_magnitudes(marked.mesh, magnitudes, nodes_inside);
        let far = |(slot, is_inside): (usize, bool)| match (marked.is_near(slot), is_inside) {
            (true, _) => 0.0,
            (false, true) => -f32::INFINITY,
            (false, false) => f32::INFINITY,
        };
        self.distances = slots_inside.into_iter().enumerate().map(far).collect();
        self.is_solid = true;
        self
    }

    /// Sides of the slots that are not near.
    fn far_slots_inside(&self, marked: &Marked) -> Vec<bool> {
        let slots = marked.gaps.len();
        let mut inside = vec![false; slots];
        let mut is_open: Vec<bool> = (0..slots).map(|slot| !marked.is_near(slot)).collect();
        let mut stack = vec![];
        let steps = [1, self.counts[0] as usize, (self.counts[0] * self.counts[1]) as usize];
        for first in 0..slots {
            if !is_open[first] {
                continue;
            }
            let at = middle(marked.lattice, self.slot(first).map(|n| n as usize));
            let is_inside = marked.mesh.nearest(at, 0).is_inside;
            is_open[first] = false;
            stack.push(first);
            while let Some(index) = stack.pop() {
                inside[index] = is_inside;
                let slot = self.slot(index);
                for axis in 0..3 {
                    let before = (slot[axis] > 0).then(|| index - steps[axis]);
                    let after = (slot[axis] + 1 < self.counts[axis]).then(|| index + steps[axis]);
                    for next in [before, after].into_iter().flatten() {
                        if std::mem::take(&mut is_open[next]) {
                            stack.push(next);
                        }
                    }
                }
            }
        }
        inside
    }

    /// Magnitude and side of a node of the coarse grid. `guess` is a triangle, and becomes one near this node.
    fn solid_node(&self, marked: &Marked, slots_inside: &[bool], node: [u32; 3], guess: &mut usize) -> (f32, bool) {
        let mesh = marked.mesh;
        if mesh.is_cancelled() {
            return (0.0, false);
        }
        let at = marked.node(self, node);
        let is_far = |index: &usize| !marked.is_near(*index);
        let own = (0..3).all(|axis| node[axis] < self.counts[axis]).then(|| self.index(node)).filter(is_far);
        // The segment from the middle of such a slot to the node is clear.
        let is_clear = |index: &usize| is_far(index) && marked.gaps[*index] + 0.5 * BRICK as f32 > HALF_DIAGONAL;
        let side = own.or_else(|| self.slots_around(node).find(is_clear)).map(|index| slots_inside[index]);
        if at.is_beside_deep && side == Some(false) {
            return (marked.outside_magnitude(self, &at, 0.0), false);
        }
        let upper = marked.nearest_around(self.slots_around(node), at.position, guess);
        if upper <= self.exact_within() - self.spacing {
            // All slots around have bricks, whose sides do not ask for that of the node, and its magnitude is W on
            // either side: a slot without a brick has its last node beyond K = W + √3/2 h, and this one is within
            // √3 h of it.
            return (self.inside_magnitude(0.0), false);
        }
        let (tolerance, distance, is_inside);
        if let Some(side) = side {
            is_inside = side;
            tolerance = if side { marked.tolerance_inside(self, &at) } else { marked.tolerance_outside(self, upper) };
            (distance, *guess) = mesh.distance_within(at.position, *guess, tolerance);
        } else {
            let nearest = mesh.nearest(at.position, *guess);
            (tolerance, distance, is_inside, *guess) = (0.0, nearest.distance, nearest.is_inside, nearest.guess);
        }
        let outside = || marked.outside_magnitude(self, &at, distance - tolerance);
        (if is_inside { self.inside_magnitude(distance as f32) } else { outside() }, is_inside)
    }
}
