use sdf_core::nalgebra::Vector3;

use super::bit_block::SIDE;
use super::{NodeBlock, Winding};
use crate::MeshDistance;
use crate::sign::winding::{Estimate, round_to_fraction};

/// What the rim says of the winding numbers at nodes that lie together.
///
/// In a ball without a part of the rim the winding number is smooth but for whole numbers at triangles: it changes along a way,
/// however long, as much as along the straight one. So along free ways all nodes have the number of the middle, by an error
/// of the slope times the farthest node's way from there.
#[derive(Clone, Copy)]
pub(super) struct Region {
    /// The winding number at the middle but for a whole number. None where it takes too long to tell.
    fraction: Option<f64>,
    /// By how much those at the nodes may differ, other than by whole numbers.
    error: f64,
    /// By how much they change at most for each spacing of the way, as far as any neighbour of a node.
    pub slope: f64,
}

/// Regions of cubes of nodes, and of the smaller cubes in them where those are asked for. None where there is no rim.
pub(super) struct Regions {
    of_cubes: Vec<Option<Region>>,
    of_parts: Vec<Option<Box<Parts>>>,
    counts: [usize; 3],
    /// More than one by how much farther from each other nodes may be than the lattice says.
    free_way: f64,
}

#[derive(Clone)]
struct Parts {
    halves: [Option<Region>; 8],
    quarters: [Option<Region>; 64],
}

/// With more, what is carried on leaves too much doubt about which whole number to add.
const MAX_CARRIED_ERROR: f64 = 0.2;

/// The same of what is off by more and more from node to node, for it is renewed nowhere.
const MAX_ACCUMULATED_ERROR: f64 = 0.3;

impl Regions {
    pub fn new(counts: [usize; 3], mesh: &MeshDistance, free_way: f64) -> Self {
        let counts = if mesh.boundary().is_empty() { [0; 3] } else { counts.map(|n| n.div_ceil(SIDE)) };
        let cubes = counts.iter().product();
        Self { of_cubes: vec![None; cubes], of_parts: vec![None; cubes], counts, free_way }
    }

    pub fn are_none(&self) -> bool {
        self.of_cubes.is_empty()
    }

    fn cube(&self, node: [usize; 3]) -> usize {
        let [x, y, z] = node.map(|n| n / SIDE);
        (z * self.counts[1] + y) * self.counts[0] + x
    }

    /// Of the cube around a node.
    pub fn whole<P>(&mut self, block: &NodeBlock<P>, mesh: &MeshDistance, node: [usize; 3]) -> Region
    where
        P: Fn([usize; 3]) -> Vector3<f64>,
    {
        let cube = self.cube(node);
        *self.of_cubes[cube].get_or_insert_with(|| Region::new(block, mesh, node, SIDE, self.free_way))
    }

    /// Of the smaller cube around a node with so many nodes along a side: 4 or 2.
    pub fn part<P>(&mut self, block: &NodeBlock<P>, mesh: &MeshDistance, node: [usize; 3], side: usize) -> Region
    where
        P: Fn([usize; 3]) -> Vector3<f64>,
    {
        let cube = self.cube(node);
        let none = || Box::new(Parts { halves: [None; 8], quarters: [None; 64] });
        let parts = self.of_parts[cube].get_or_insert_with(none);
        let along = SIDE / side;
        let [x, y, z] = node.map(|n| n % SIDE / side);
        let place = (z * along + y) * along + x;
        let part = if side == 4 { &mut parts.halves[place] } else { &mut parts.quarters[place] };
        *part.get_or_insert_with(|| Region::new(block, mesh, node, side, self.free_way))
    }
}

impl Region {
    fn new<P>(block: &NodeBlock<P>, mesh: &MeshDistance, node: [usize; 3], side: usize, free_way: f64) -> Self
    where
        P: Fn([usize; 3]) -> Vector3<f64>,
    {
        let first = node.map(|n| n / side * side);
        let last = std::array::from_fn(|axis| (first[axis] + side).min(block.counts[axis]) - 1);
        let [low, high] = [first, last].map(&block.position);
        let (middle, half_diagonal) = ((low + high) * 0.5, 0.5 * (high - low).norm() * free_way);
        // So that along no way it is nothing, where there is no bound of it.
        let slope_within = |radius: f64| mesh.boundary().winding_slope(middle, radius).min(f64::MAX);
        let error = slope_within(half_diagonal) * half_diagonal;
        let fraction = if error > MAX_CARRIED_ERROR { None } else { mesh.boundary().winding_fraction(middle) };
        let slope = slope_within(half_diagonal + 3.0_f64.sqrt() * block.spacing * free_way);
        Self {
            fraction: fraction.map(|fraction| fraction.value),
            error: error + fraction.map_or(0.0, |fraction| fraction.error),
            slope: (slope * block.spacing * free_way).min(f64::MAX),
        }
    }

    /// At all nodes on free ways from one that lies so many spacings, on a free way, from a point. `None` where there is too
    /// much doubt.
    pub fn carry(&self, of: Winding, way: f64, has_fractions: bool) -> Option<Winding> {
        let reached = f64::from(of.error) + way * self.slope;
        let (found, most) = match self.fraction {
            Some(fraction) => {
                let about = Estimate { value: of.value.into(), error: reached + self.error };
                let value = round_to_fraction(about, fraction)?;
                (Estimate { value, error: self.error }, MAX_CARRIED_ERROR)
            }
            None if has_fractions => return None,
            None => {
                let error = reached + 2.0 * self.error;
                (Estimate { value: of.value.into(), error }, MAX_ACCUMULATED_ERROR)
            }
        };
        let found = (found.error <= most).then(|| Winding::new(found))?;
        found.is_sure().then_some(found)
    }
}
