//! Where is an open mesh's grid as good as a closed one's? The error bound of each cell, and where the large ones are.
//!
//! A cell in which the signed distance is continuous errs by at most √3/2 h and rounding (`dense::error_bound`). So does one with
//! corners of one sign, unless the jump of the sign passes between them. In a cell with both signs, the jump is where the winding
//! number w is ½ modulo 1. The triangles do not change w modulo 1. With c the cell's center and r = √3/2 h,
//!
//! ```text
//! |w(c) mod 1 − ½| > error + r max |∇w|   excludes a jump (`winding::boundary`).
//! ```
//!
//! The ball of a slot decides for all of its cells, or else its octants and theirs do. All other cells may err by 2 max |φ at the corners| more. They are joined to regions: cells that share a corner.

use std::collections::HashMap;

use sdf_core::Aabb;
use sdf_core::grid::Storage;
use sdf_core::grid::owned::{ErrorRegion, ErrorRegions, Layout, OwnedGrid, Precision};
use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES, brick_counts};
use sdf_core::nalgebra::Vector3;

use crate::error::normal_cones::MAX_ERROR;
use crate::rounding::DEQUANTIZED_ROUNDING;
use crate::sign::winding::Estimate;
use crate::simd::{max, min};
use crate::{MeshDistance, SignMethod};

const SIDE: usize = BRICK as usize;

/// Largest number of regions that are reported one by one.
pub const MAX_REGIONS: usize = 8;

/// Error to which a winding number is computed where the boundary does not give its fraction.
const MAX_WINDING_ERROR: f64 = 0.1;

/// A cell in which the sign may jump, and the largest magnitude at its corners.
type JumpCell = ([u32; 3], f32);

impl MeshDistance<'_> {
    /// The error of a grid that was baked from this mesh, by region; `band` is that of a sparse grid, a length. `None` where the
    /// signed distance is continuous: then one bound holds everywhere.
    pub fn error_regions(&self, grid: &OwnedGrid, band: Option<f64>) -> Option<ErrorRegions> {
        if self.is_continuous() {
            return None;
        }
        let (lattice, storage) = (grid.lattice(), grid.storage());
        let spacing = lattice.spacing();
        let half_diagonal = MAX_ERROR * spacing;
        let exact_within = band.map_or(f64::INFINITY, |band| band + 2.0 * half_diagonal) as f32;
        let jumps_in = |slot: [u32; 3]| {
            let mut found = JumpsOfSlot::new(grid, slot).find(self.tree().arch, exact_within);
            // What a ball excludes, all balls in it exclude: most slots are decided at once.
            for side in [BRICK, BRICK / 2, BRICK / 4, 1] {
                let mut excluded = [None; BRICK_SAMPLES];
                found.jumps.retain(|(cell, _)| {
                    let [x, y, z] = cell.map(|n| (n % BRICK / side) as usize);
                    let exclude = || {
                        let middle = cell.map(|n| f64::from(n / side * side) + 0.5 * f64::from(side));
                        let center = |axis: usize| lattice.origin()[axis] + spacing * middle[axis];
                        self.excludes_jump([0, 1, 2].map(center).into(), f64::from(side) * half_diagonal)
                    };
                    let at = (z * BRICK as usize + y) * BRICK as usize + x;
                    !*excluded[at].get_or_insert_with(exclude)
                });
            }
            found
        };
        let all = match storage.layout() {
            Layout::Dense => {
                let [row, rows, layers] = brick_counts(lattice);
                let slot = |index: u32| [index % row, index / row % rows, index / row / rows];
                (0..row * rows * layers).map(slot).collect()
            }
            Layout::Sparse => storage.slots().to_vec(),
        };
        let found = sdf_parallel::map(all.len(), |index| jumps_in(all[index]));
        let count = found.into_iter().fold(Jumps::default(), Jumps::joined);
        // Half a step of a code, and the roundings of f32.
        let is_coded = storage.precision() != Precision::F32;
        let step = storage.scales().iter().filter(|_| is_coded).map(|scale| scale.step).fold(0.0, f32::max);
        let rounding = f64::from(count.max_magnitude) * DEQUANTIZED_ROUNDING + 0.5 * f64::from(step);
        let error_bound = half_diagonal + rounding;
        let mut regions = regions(&count.jumps, |cell| lattice.node(cell), spacing, error_bound);
        regions.sort_by(|a, b| {
            b.cells.cmp(&a.cells).then(a.bounds.min.partial_cmp(&b.bounds.min).unwrap_or(std::cmp::Ordering::Equal))
        });
        let region_count = regions.len();
        regions.truncate(MAX_REGIONS);
        let cells_within = count.cells - count.jumps.len() as u64;
        Some(ErrorRegions { cells: count.cells, cells_within, error_bound, regions, region_count })
    }

    /// Does the sign change at triangles alone, in a ball?
    fn excludes_jump(&self, center: Vector3<f64>, radius: f64) -> bool {
        if self.sign_method() != SignMethod::Winding {
            return false;
        }
        let slope = self.boundary().slope_bound(center, radius);
        if slope * radius >= 0.5 {
            return false;
        }
        let known = self.boundary().winding_fraction(center);
        let Estimate { value, error } = known.unwrap_or_else(|| self.winding_estimate(center, MAX_WINDING_ERROR));
        (value - value.floor() - 0.5).abs() > error + slope * radius
    }
}

/// Findings in some of the cells.
#[derive(Default)]
struct Jumps {
    cells: u64,
    max_magnitude: f32,
    jumps: Vec<JumpCell>,
}

impl Jumps {
    fn joined(mut self, other: Self) -> Self {
        self.cells += other.cells;
        self.max_magnitude = self.max_magnitude.max(other.max_magnitude);
        self.jumps.extend(other.jumps);
        self
    }
}

/// Nodes of the cells of one slot.
struct JumpsOfSlot {
    slot: [u32; 3],
    /// Cells along each axis.
    cells: [usize; 3],
    /// Values, x fastest. Rows are copied eight nodes at a time.
    values: [[[f32; 2 * SIDE]; SIDE + 1]; SIDE + 1],
}

impl JumpsOfSlot {
    fn new(grid: &OwnedGrid, slot: [u32; 3]) -> Self {
        let first = slot.map(|n| n * BRICK);
        let cells: [usize; 3] =
            std::array::from_fn(|axis| grid.lattice().cells()[axis].saturating_sub(first[axis]).min(BRICK) as usize);
        let mut values = [[[0.0; 2 * SIDE]; SIDE + 1]; SIDE + 1];
        for (z, layer) in (first[2]..).zip(&mut values[..=cells[2]]) {
            for (y, row) in (first[1]..).zip(&mut layer[..=cells[1]]) {
                grid.storage().copy_row([first[0], y, z], cells[0] as u32 + 1, row);
            }
        }
        Self { slot, cells, values }
    }

    /// Cells with corners of both signs and none beyond `exact_within`.
    fn find(&self, arch: pulp::Arch, exact_within: f32) -> Jumps {
        arch.dispatch(|| self.find_in_lanes(exact_within))
    }

    #[inline(always)]
    fn find_in_lanes(&self, exact_within: f32) -> Jumps {
        let mut found = Jumps::default();
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
                    found.cells += 1;
                    found.max_magnitude = max(magnitude, found.max_magnitude);
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
