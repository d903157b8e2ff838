//! Positions of a packet's nodes.

use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;

use super::octants::corner;
use crate::rounding::SINGLE_SLACK;
use crate::simd::{LANES, VectorX8};

/// Nodes of a packet along each side.
pub(crate) const SIDE: usize = 8;

pub(crate) const NODES: usize = SIDE * SIDE * SIDE;

/// Cuts the nodes of a grid, x fastest, into groups of rows: all packets with the same y and z share a group. Returns
/// each group's first y and z, and its rows.
pub(crate) fn packet_rows<T>(nodes: &mut [T], [row, rows, layers]: [usize; 3]) -> Vec<([usize; 2], Vec<&mut [T]>)> {
    let groups_along_y = rows.div_ceil(SIDE);
    let first = |group: usize| [group % groups_along_y * SIDE, group / groups_along_y * SIDE];
    let mut groups: Vec<_> = (0..groups_along_y * layers.div_ceil(SIDE)).map(|group| (first(group), vec![])).collect();
    for (index, nodes) in nodes.chunks_mut(row).enumerate() {
        groups[index / rows / SIDE * groups_along_y + index % rows / SIDE].1.push(nodes);
    }
    groups
}

/// Up to 8 × 8 × 8 nodes of a regular grid. A node is addressed by its steps from the first along each axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PacketNodes {
    /// Coordinates along each axis, of equal spacing.
    pub axes: [[f64; SIDE]; 3],
    pub spacing: f64,
    /// Nodes that belong to the packet along each axis. `axes` goes on beyond them.
    pub counts: [usize; 3],
}

impl PacketNodes {
    /// Nodes of a lattice from `first` on.
    pub fn new(lattice: &Lattice, first: [usize; 3], counts: [usize; 3]) -> Self {
        let mut axes = [[0.0; SIDE]; 3];
        for step in 0..SIDE {
            let node = lattice.node(first.map(|n| (n + step) as u32));
            for axis in 0..3 {
                axes[axis][step] = node[axis];
            }
        }
        Self { axes, spacing: lattice.spacing(), counts }
    }

    pub fn position(&self, step: [usize; 3]) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| self.axes[axis][step[axis]])
    }

    /// Does the node at `step` belong to the packet?
    pub(super) fn contains(&self, step: [usize; 3]) -> bool {
        (0..3).all(|axis| step[axis] < self.counts[axis])
    }

    /// The 2 × 2 × 2 nodes from `first` on.
    #[inline(always)]
    pub(super) fn eight_from(&self, first: [usize; 3]) -> VectorX8<f64> {
        let mut points: VectorX8<f64> = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            for axis in 0..3 {
                points[axis][lane] = self.axes[axis][first[axis] + corner(lane)[axis]];
            }
        }
        points
    }

    /// Center of a cube of nodes.
    pub(super) fn center(&self, first: [usize; 3], side: usize) -> Vector3<f64> {
        Vector3::from_fn(|axis, _| 0.5 * (self.axes[axis][first[axis]] + self.axes[axis][first[axis] + side - 1]))
    }

    /// Upper bound of the distance from a cube's center to its nodes.
    pub(super) fn radius(&self, first: [usize; 3], side: usize) -> f64 {
        let center = self.center(first, side);
        let offset = Vector3::from_fn(|axis, _| {
            let ends = [first[axis], first[axis] + side - 1].map(|step| self.axes[axis][step]);
            (center[axis] - ends[0]).abs().max((center[axis] - ends[1]).abs())
        });
        offset.norm() * (1.0 + SINGLE_SLACK)
    }

    /// Largest magnitude of a coordinate.
    pub(super) fn max_coordinate(&self) -> f64 {
        self.axes.iter().flat_map(|axis| [axis[0], axis[SIDE - 1]]).fold(0.0, |max, x| max.max(x.abs()))
    }

    /// First and last coordinate, along each axis, of the nodes in a cube that belong to the packet.
    #[inline(always)]
    pub(super) fn ends(&self, first: [usize; 3], side: usize) -> [[f64; 2]; 3] {
        let last = |axis: usize| (first[axis] + side).min(self.counts[axis]).max(first[axis] + 1) - 1;
        [0, 1, 2].map(|axis: usize| [self.axes[axis][first[axis]], self.axes[axis][last(axis)]])
    }

    /// A node of the packet near a point.
    pub(super) fn step_near(&self, point: Vector3<f64>) -> [usize; 3] {
        [0, 1, 2].map(|axis: usize| {
            let step = ((point[axis] - self.axes[axis][0]) / self.spacing).round().max(0.0) as usize;
            step.min(self.counts[axis].clamp(1, SIDE) - 1)
        })
    }
}
