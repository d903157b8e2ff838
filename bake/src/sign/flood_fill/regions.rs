//! Winding numbers of all nodes of a cube at once, from the boundary far away.
//!
//! In a ball that no boundary edge meets, w is smooth but for jumps by whole numbers at triangles. So along any path of
//! clear segments, however long, w changes as along the straight line: for a cube with middle c and a node x,
//! |w(x) − w(c)| ≤ slope · |x − c| modulo 1, with the slope bound of [`MeshBoundary`](crate::sign::winding::MeshBoundary).

use super::bit_block::SIDE;
use super::{NodeBlock, Winding};
use crate::MeshDistance;
use crate::sign::winding::{Estimate, nearest_congruent};

/// Bounds of w at the nodes of a cube, from the boundary.
#[derive(Clone, Copy)]
pub(super) struct Region {
    /// w at the middle, modulo 1. `None` if the error is too large or the boundary has too many edges.
    fraction: Option<f64>,
    /// Upper bound of |w(node) − w(middle)| modulo 1, with the error of the fraction.
    error: f64,
    /// Upper bound of the change of w over one spacing, anywhere in the cube or up to a neighbour of its nodes.
    pub slope: f64,
}

/// Regions of the cubes of 8³ nodes, and of the smaller cubes in them. They are computed on first use.
pub(super) struct Regions {
    /// Empty if the mesh has no boundary.
    cubes: Vec<Option<Region>>,
    sub_cubes: Vec<Option<Box<SubRegions>>>,
    counts: [usize; 3],
    clearance: f64,
}

/// Regions of the cubes of 4³ and of 2³ nodes.
#[derive(Clone)]
struct SubRegions {
    halves: [Option<Region>; 8],
    quarters: [Option<Region>; 64],
}

/// Length of segments, in spacings, along which a slope tells the change of w. Along a shorter one its bound may be infinite.
const MIN_LENGTH: f64 = 0.25;

/// Largest error of a carried value that has its fraction from the boundary.
const MAX_CARRIED_ERROR: f64 = 0.2;

/// Largest error of a carried value without a fraction: it grows from node to node.
const MAX_ACCUMULATED_ERROR: f64 = 0.3;

impl Regions {
    pub fn new(counts: [usize; 3], mesh: &MeshDistance, clearance: f64) -> Self {
        let counts = if mesh.boundary().is_empty() { [0; 3] } else { counts.map(|n| n.div_ceil(SIDE)) };
        let cube_count = counts.iter().product();
        Self { cubes: vec![None; cube_count], sub_cubes: vec![None; cube_count], counts, clearance }
    }

    pub fn is_empty(&self) -> bool {
        self.cubes.is_empty()
    }

    fn cube_index(&self, node: [usize; 3]) -> usize {
        let [x, y, z] = node.map(|n| n / SIDE);
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Region of the cube of 8³ nodes that holds a node.
    pub fn cube(&mut self, block: &NodeBlock, mesh: &MeshDistance, node: [usize; 3]) -> Region {
        let cube = self.cube_index(node);
        *self.cubes[cube].get_or_insert_with(|| Region::new(block, mesh, node, SIDE, self.clearance))
    }

    /// Region of the smaller cube that holds a node. `side` is 4 or 2.
    pub fn sub_cube(&mut self, block: &NodeBlock, mesh: &MeshDistance, node: [usize; 3], side: usize) -> Region {
        let cube = self.cube_index(node);
        let none = || Box::new(SubRegions { halves: [None; 8], quarters: [None; 64] });
        let regions = self.sub_cubes[cube].get_or_insert_with(none);
        let per_side = SIDE / side;
        let [x, y, z] = node.map(|n| n % SIDE / side);
        let index = (z * per_side + y) * per_side + x;
        let region = if side == 4 { &mut regions.halves[index] } else { &mut regions.quarters[index] };
        *region.get_or_insert_with(|| Region::new(block, mesh, node, side, self.clearance))
    }
}

impl Region {
    fn new(block: &NodeBlock, mesh: &MeshDistance, node: [usize; 3], side: usize, clearance: f64) -> Self {
        let first = node.map(|n| n / side * side);
        let last = std::array::from_fn(|axis| (first[axis] + side).min(block.counts[axis]) - 1);
        let [low, high] = [first, last].map(block.position);
        let (middle, half_diagonal) = ((low + high) * 0.5, 0.5 * (high - low).norm() * clearance);
        let step = block.spacing * clearance;
        // Finite, so that a segment of length zero times it is zero and not NaN. A change of 1/2 tells nothing.
        let slope_within =
            |radius: f64, length: f64| mesh.boundary().slope_bound(middle, radius, 0.5 / length).min(f64::MAX);
        let error = slope_within(half_diagonal, half_diagonal) * half_diagonal;
        let fraction = if error > MAX_CARRIED_ERROR { None } else { mesh.boundary().winding_fraction(middle) };
        let slope = slope_within(half_diagonal + 3.0_f64.sqrt() * step, MIN_LENGTH * step);
        Self {
            fraction: fraction.map(|fraction| fraction.value),
            error: error + fraction.map_or(0.0, |fraction| fraction.error),
            slope: (slope * step).min(f64::MAX),
        }
    }

    /// One value for all nodes that clear segments reach from a node of the cube. `None` if its error is too large.
    ///
    /// `winding` holds at a point `length` spacings away from that node on a clear segment. `has_fractions`: the
    /// boundary has a cone, so a region without a fraction is too near to it.
    pub fn carry(&self, winding: Winding, length: f64, has_fractions: bool) -> Option<Winding> {
        let node_error = f64::from(winding.error) + length * self.slope;
        let (carried, max_error) = match self.fraction {
            Some(fraction) => {
                let estimate = Estimate { value: winding.value.into(), error: node_error + self.error };
                let value = nearest_congruent(estimate, fraction)?;
                (Estimate { value, error: self.error }, MAX_CARRIED_ERROR)
            }
            None if has_fractions => return None,
            None => {
                let error = node_error + 2.0 * self.error;
                (Estimate { value: winding.value.into(), error }, MAX_ACCUMULATED_ERROR)
            }
        };
        let carried = (carried.error <= max_error).then(|| Winding::new(carried))?;
        carried.is_certain().then_some(carried)
    }
}
