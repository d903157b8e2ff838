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
//! All other cells may err by 2 max |φ at the corners| more. They are joined to regions: cells that share a corner.

use std::collections::HashMap;

use sdf_core::Aabb;
use sdf_core::grid::Storage;
use sdf_core::grid::owned::{ErrorRegion, ErrorRegions, Layout, OwnedGrid, Precision};
use sdf_core::grid::sparse::BRICK;
use sdf_core::nalgebra::Vector3;

use crate::error::normal_cones::MAX_ERROR;
use crate::rounding::DEQUANTIZED_ROUNDING;
use crate::sign::winding::Estimate;
use crate::{MeshDistance, SignMethod};

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
        let [nx, ny, nz] = lattice.cells();
        let spacing = lattice.spacing();
        let half_diagonal = MAX_ERROR * spacing;
        let exact_within = band.map_or(f64::INFINITY, |band| band + 2.0 * half_diagonal) as f32;
        let visit = |count: &mut Jumps, cell: [u32; 3]| {
            let corners = storage.corners(cell);
            let magnitude = corners.iter().fold(0.0_f32, |max, corner| max.max(corner.abs()));
            if magnitude > exact_within {
                return;
            }
            count.cells += 1;
            count.max_magnitude = count.max_magnitude.max(magnitude);
            let inside = corners.iter().filter(|corner| **corner < 0.0).count();
            let center = lattice.node(cell).map(|x| x + 0.5 * spacing).into();
            if inside % 8 != 0 && !self.excludes_jump(center, half_diagonal) {
                count.jumps.push((cell, magnitude));
            }
        };
        let count = if grid.storage().layout() == Layout::Dense {
            let layer = |z: u32| {
                let mut count = Jumps::default();
                (0..ny).for_each(|y| (0..nx).for_each(|x| visit(&mut count, [x, y, z])));
                count
            };
            let layers = sdf_parallel::map(nz as usize, |z| layer(z as u32));
            layers.into_iter().fold(Jumps::default(), Jumps::joined)
        } else {
            let brick = |slot: &[u32; 3]| {
                let mut count = Jumps::default();
                let ends: [u32; 3] = std::array::from_fn(|axis| ((slot[axis] + 1) * BRICK).min(lattice.cells()[axis]));
                for z in slot[2] * BRICK..ends[2] {
                    for y in slot[1] * BRICK..ends[1] {
                        (slot[0] * BRICK..ends[0]).for_each(|x| visit(&mut count, [x, y, z]));
                    }
                }
                count
            };
            let bricks = sdf_parallel::map(storage.slots().len(), |index| brick(&storage.slots()[index]));
            bricks.into_iter().fold(Jumps::default(), Jumps::joined)
        };
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
