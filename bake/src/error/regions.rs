//! Where is an open mesh's grid as good as a closed one's? The error bound of each cell, and where the large ones are.
//!
//! A cell in which the signed distance is continuous errs by at most √3/2 h and rounding (`dense::error_bound`). So does one with
//! corners of one sign, which all of its points have then (`docs/error-bounds.md`, "What is added"). In a cell with both signs, the jump is
//! where the winding number w is ½ modulo 1. The triangles do not change w modulo 1. With c the cell's center and r = √3/2 h,
//!
//! ```text
//! |w(c) mod 1 − ½| > error + r max |∇w|   excludes a jump (`winding::boundary`).
//! ```
//!
//! The ball of a slot decides for all of its cells, or else its octants and theirs do. All other cells may err by 2 max |φ at the corners| more. They are joined to regions: cells that share a corner.

use std::collections::HashMap;

use sdf_core::Aabb;
use sdf_core::grid::owned::{ErrorRegion, ErrorRegions, OwnedGrid, Precision};
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, Scale, brick_counts};
use sdf_core::grid::{Lattice, Storage};
use sdf_core::nalgebra::Vector3;

use crate::error::node_bounds::{BandCells, HaloBlock};
use crate::error::normal_cones::MAX_ERROR;
use crate::rounding::{DEQUANTIZED_ROUNDING, node_position_rounding};
use crate::sign::winding::Estimate;
use crate::simd::{max, min};
use crate::{BakedGrid, MeshDistance, SignMethod};

const SIDE: usize = BRICK as usize;

/// Largest number of regions that are reported one by one.
pub const MAX_REGIONS: usize = 8;

/// Distance up to which the samples at a cell's corners are exact, in a sparse grid with this band.
pub fn cells_within(band: f64, spacing: f64) -> f32 {
    (band + 2.0 * (MAX_ERROR * spacing)) as f32
}

/// Error to which a winding number is computed where the boundary does not give its fraction.
const MAX_WINDING_ERROR: f64 = 0.1;

/// Slots along a side of a block: one ball around it may exclude jumps in all of them.
const BLOCK: u32 = 4;

/// A cell in which the sign may jump, and the largest magnitude at its corners.
type JumpCell = ([u32; 3], f32);

/// Cells of a grid in which the sign of an open mesh may jump.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SignJumps {
    pub(crate) cells: BandCells,
    pub(crate) jumps: Vec<JumpCell>,
}

impl SignJumps {
    /// Adds others.
    pub(crate) fn add(&mut self, other: Self) {
        self.cells = self.cells.joined(other.cells);
        self.jumps.extend(other.jumps);
    }

    fn joined(mut self, other: Self) -> Self {
        self.add(other);
        self
    }

    /// The error by region of a grid with these jumps. `step` is the largest difference of two codes, zero of samples in f32.
    pub fn regions(&self, lattice: &Lattice, step: f32) -> ErrorRegions {
        let Self { cells: BandCells { count, max_magnitude }, jumps } = self;
        // Half a step of a code, the roundings of f32, and of the positions of nodes.
        let rounding =
            f64::from(*max_magnitude) * DEQUANTIZED_ROUNDING + 0.5 * f64::from(step) + node_position_rounding(lattice);
        let error_bound = MAX_ERROR * lattice.spacing() + rounding;
        let mut regions = regions(jumps, |cell| lattice.node(cell), lattice.spacing(), error_bound);
        regions.sort_by(|a, b| {
            b.cells.cmp(&a.cells).then(a.bounds.min.partial_cmp(&b.bounds.min).unwrap_or(std::cmp::Ordering::Equal))
        });
        let region_count = regions.len();
        regions.truncate(MAX_REGIONS);
        let cells_within = count - jumps.len() as u64;
        ErrorRegions { cells: *count, cells_within, error_bound, regions, region_count }
    }
}

/// Blocks of slots without a jump of the sign, looked up one after the other.
#[derive(Default)]
pub(crate) struct JumpFreeBlocks {
    last: Option<([u32; 3], bool)>,
}

impl JumpFreeBlocks {
    /// Does the sign change at triangles alone in a slot's cells, by the ball around its block or around itself?
    fn contain(&mut self, mesh: &MeshDistance, lattice: &Lattice, slot: [u32; 3]) -> bool {
        let excludes =
            |first: [u32; 3], slots: u32| mesh.excludes_jump_in(lattice, first.map(|n| n * BRICK), slots * BRICK);
        let block = slot.map(|n| n / BLOCK * BLOCK);
        let last = self.last.filter(|(last, _)| *last == block);
        let (_, is_free) = *self.last.insert(last.unwrap_or_else(|| (block, excludes(block, BLOCK))));
        is_free || excludes(slot, 1)
    }
}

/// Largest difference of two codes of a grid, zero of samples in f32.
pub fn code_step(precision: Precision, scales: &[Scale]) -> f32 {
    let is_coded = precision != Precision::F32;
    scales.iter().filter(|_| is_coded).map(|scale| scale.step).fold(0.0, f32::max)
}

impl MeshDistance<'_> {
    /// Is the sign right wherever it is continuous? Winding numbers say what inside is. Pseudo-normals are wrong in whole regions of a mesh
    /// that does not bound one solid.
    pub fn is_sign_certain(&self) -> bool {
        self.sign_method() == SignMethod::Winding || self.is_continuous()
    }

    /// The error of a grid that was baked from this mesh, by region. `None` where the signed distance is continuous: then one bound holds
    /// everywhere; and where the sign is not certain: then none does.
    pub fn error_regions(&self, BakedGrid { grid, jumps, .. }: &BakedGrid) -> Option<ErrorRegions> {
        if self.is_continuous() || !self.is_sign_certain() {
            return None;
        }
        let (lattice, storage) = (grid.lattice(), grid.storage());
        let step = code_step(storage.precision(), storage.scales());
        let regions = |jumps: &SignJumps| jumps.regions(lattice, step);
        Some(jumps.as_ref().map_or_else(|| regions(&self.jumps_of_dense(grid)), regions))
    }

    fn jumps_of_dense(&self, grid: &OwnedGrid) -> SignJumps {
        let lattice = grid.lattice();
        let [row, rows, layers] = brick_counts(lattice);
        let slot = |index: usize| [index as u32 % row, index as u32 / row % rows, index as u32 / row / rows];
        let found = sdf_parallel::map_chunks((row * rows * layers) as usize, |slots| {
            let mut free = JumpFreeBlocks::default();
            let jumps_in = |index: usize| {
                let slot = slot(index);
                let mut found = SlotNodes::from_grid(grid, slot).jumps(self.tree().arch, f32::INFINITY);
                if !found.jumps.is_empty() && free.contain(self, lattice, slot) {
                    found.jumps.clear();
                }
                self.retain_jumps(lattice, &mut found.jumps);
                found
            };
            slots.map(jumps_in).fold(SignJumps::default(), SignJumps::joined)
        });
        found.into_iter().fold(SignJumps::default(), SignJumps::joined)
    }

    /// Cells of a slot in which the sign may jump, of those with corners of both signs and none beyond `exact_within`.
    pub(crate) fn jumps_in(
        &self,
        lattice: &Lattice,
        slot: [u32; 3],
        halo: &HaloBlock,
        exact_within: f32,
        free: &mut JumpFreeBlocks,
    ) -> Vec<JumpCell> {
        // What a ball excludes, all balls in it exclude: most slots are decided at once.
        if free.contain(self, lattice, slot) {
            return vec![];
        }
        let mut found = SlotNodes::from_halo(lattice, slot, halo).jumps(self.tree().arch, exact_within).jumps;
        self.retain_jumps(lattice, &mut found);
        found
    }

    /// Keeps the cells of a slot in which the sign may jump: by the balls around its octants, theirs, and the cells.
    fn retain_jumps(&self, lattice: &Lattice, jumps: &mut Vec<JumpCell>) {
        for side in [BRICK / 2, BRICK / 4, 1] {
            let mut excluded = [None; BRICK_SAMPLES];
            jumps.retain(|(cell, _)| {
                let [x, y, z] = cell.map(|n| (n % BRICK / side) as usize);
                let exclude = || self.excludes_jump_in(lattice, cell.map(|n| n / side * side), side);
                let at = (z * BRICK as usize + y) * BRICK as usize + x;
                !*excluded[at].get_or_insert_with(exclude)
            });
        }
    }

    /// Does the sign change at triangles alone, by the ball around a cube of cells? `first` is its first cell, `side` their number.
    fn excludes_jump_in(&self, lattice: &Lattice, first: [u32; 3], side: u32) -> bool {
        let middle = first.map(|n| f64::from(n) + 0.5 * f64::from(side));
        let center = |axis: usize| lattice.origin()[axis] + lattice.spacing() * middle[axis];
        self.excludes_jump([0, 1, 2].map(center).into(), f64::from(side) * MAX_ERROR * lattice.spacing())
    }

    /// Does the sign change at triangles alone, in a ball?
    fn excludes_jump(&self, center: Vector3<f64>, radius: f64) -> bool {
        if self.sign_method() != SignMethod::Winding {
            return false;
        }
        let slope = self.boundary().slope_bound(center, radius, 0.5 / radius);
        if slope * radius >= 0.5 {
            return false;
        }
        let known = self.boundary().winding_fraction(center);
        let Estimate { value, error } = known.unwrap_or_else(|| self.winding_estimate(center, MAX_WINDING_ERROR));
        (value - value.floor() - 0.5).abs() > error + slope * radius
    }
}

/// Nodes of the cells of one slot.
struct SlotNodes {
    slot: [u32; 3],
    /// Cells along each axis.
    cells: [usize; 3],
    /// Values, x fastest. Rows are copied eight nodes at a time.
    values: [[[f32; 2 * SIDE]; SIDE + 1]; SIDE + 1],
}

impl SlotNodes {
    fn empty(lattice: &Lattice, slot: [u32; 3]) -> Self {
        let cells =
            std::array::from_fn(|axis| lattice.cells()[axis].saturating_sub(slot[axis] * BRICK).min(BRICK) as usize);
        Self { slot, cells, values: [[[0.0; 2 * SIDE]; SIDE + 1]; SIDE + 1] }
    }

    fn from_grid(grid: &OwnedGrid, slot: [u32; 3]) -> Self {
        let first = slot.map(|n| n * BRICK);
        let mut nodes = Self::empty(grid.lattice(), slot);
        let cells = nodes.cells;
        for (z, layer) in (first[2]..).zip(&mut nodes.values[..=cells[2]]) {
            for (y, row) in (first[1]..).zip(&mut layer[..=cells[1]]) {
                grid.storage().copy_row([first[0], y, z], cells[0] as u32 + 1, row);
            }
        }
        nodes
    }

    fn from_halo(lattice: &Lattice, slot: [u32; 3], halo: &HaloBlock) -> Self {
        let mut nodes = Self::empty(lattice, slot);
        for (layer, halo) in nodes.values.iter_mut().zip(&halo.values[1..]) {
            for (row, halo) in layer.iter_mut().zip(&halo[1..]) {
                row[..=SIDE].copy_from_slice(&halo[1..SIDE + 2]);
            }
        }
        nodes
    }

    /// Cells with corners of both signs and none beyond `exact_within`.
    fn jumps(&self, arch: pulp::Arch, exact_within: f32) -> SignJumps {
        arch.dispatch(|| self.jumps_in_lanes(exact_within))
    }

    #[inline(always)]
    fn jumps_in_lanes(&self, exact_within: f32) -> SignJumps {
        let mut found = SignJumps::default();
        for z in 0..self.cells[2] {
            for y in 0..self.cells[1] {
                let rows = [[y, z], [y + 1, z], [y, z + 1], [y + 1, z + 1]].map(|[y, z]| &self.values[z][y]);
                let (mut lower, mut upper) = ([f32::INFINITY; SIDE], [f32::NEG_INFINITY; SIDE]);
                for row in rows {
                    for x in 0..SIDE {
                        lower[x] = min(min(row[x], row[x + 1]), lower[x]);
                        upper[x] = max(max(row[x], row[x + 1]), upper[x]);
                    }
                }
                for x in 0..self.cells[0] {
                    let magnitude = max(upper[x], -lower[x]);
                    if magnitude > exact_within {
                        continue;
                    }
                    found.cells.count += 1;
                    found.cells.max_magnitude = max(magnitude, found.cells.max_magnitude);
                    if lower[x] < 0.0 && upper[x] >= 0.0 {
                        let [i, j, k] = self.slot.map(|n| n * BRICK);
                        found.jumps.push(([i + x as u32, j + y as u32, k + z as u32], magnitude));
                    }
                }
            }
        }
        found
    }
}

/// Cells that share a corner with each other, directly or through others. `node` is the position of a cell's first corner.
fn regions(
    jumps: &[JumpCell],
    node: impl Fn([u32; 3]) -> [f64; 3],
    spacing: f64,
    error_bound: f64,
) -> Vec<ErrorRegion> {
    let place: HashMap<[u32; 3], usize> = (0..).zip(jumps).map(|(place, (cell, _))| (*cell, place)).collect();
    let mut is_visited = vec![false; jumps.len()];
    let mut regions = vec![];
    for first in 0..jumps.len() {
        if std::mem::replace(&mut is_visited[first], true) {
            continue;
        }
        let (mut waiting, mut cells, mut max_magnitude, mut bounds) = (vec![first], 0, 0.0_f32, None::<Aabb>);
        while let Some(next) = waiting.pop() {
            let (cell, magnitude) = jumps[next];
            let min = node(cell);
            let own = Aabb { min, max: min.map(|x| x + spacing) };
            bounds = Some(bounds.map_or(own, |bounds| bounds.union(&own)));
            (cells, max_magnitude) = (cells + 1, max_magnitude.max(magnitude));
            for step in 0..27_u32 {
                let step = [step % 3, step / 3 % 3, step / 9];
                let beside = std::array::from_fn(|axis| (cell[axis] + step[axis]).wrapping_sub(1));
                if let Some(place) = place.get(&beside)
                    && !std::mem::replace(&mut is_visited[*place], true)
                {
                    waiting.push(*place);
                }
            }
        }
        let error_bound = error_bound + 2.0 * f64::from(max_magnitude);
        regions.extend(bounds.map(|bounds| ErrorRegion { bounds, cells, error_bound }));
    }
    regions
}

#[cfg(test)]
mod tests;
