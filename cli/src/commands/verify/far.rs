//! Beyond a sparse grid's band its values are not distances: what are they, and which ones are wrong?

use sdf_bake::MeshDistance;
use sdf_core::grid::Storage;
use sdf_core::grid::owned::OwnedGrid;
use serde::Serialize;

use super::sampling::{PointSample, cell_at};

/// Values that a sparse grid may hold beyond its band.
#[derive(Clone, Copy)]
pub struct FarValues {
    pub band: f64,
    /// Nodes of bricks hold their distance up to here, and beyond it no less than this: band + √3 · spacing.
    pub exact_within: f64,
    /// Largest difference from the distance inside; infinite where the file or an open mesh states none.
    deep_error: f64,
    /// Does the file state that samples in bricks are no less than [`exact_within`](Self::exact_within)?
    has_least: bool,
}

impl FarValues {
    pub fn new(grid: &OwnedGrid, band: f64, truth: &MeshDistance) -> Self {
        let has_least = grid.deep_error() < f64::INFINITY;
        let deep_error = if truth.is_continuous() { grid.deep_error() } else { f64::INFINITY };
        Self { band, exact_within: band + 3.0_f64.sqrt() * grid.lattice().spacing(), deep_error, has_least }
    }

    /// Length by which the sample of a node of a brick is beyond what it may be, rounding granted.
    fn excess(&self, node: &PointSample) -> f64 {
        let (value, distance) = (node.value.abs(), node.truth.abs());
        let least = if self.has_least { self.exact_within } else { 0.0 };
        let least = if node.truth < 0.0 { least.max(distance - self.deep_error) } else { least };
        (least - value).max(value - distance) - node.rounding
    }
}

/// Nodes in bricks whose distance is beyond band + √3 · spacing, and nodes in no brick.
#[derive(Serialize)]
pub struct FarNodes {
    #[serde(rename = "asked")]
    pub sample_count: usize,
    /// Largest length by which a sample is beyond what it may be. In a brick: less than band + √3 · spacing, more than its
    /// distance, or inside less by more than the file states. In no brick: outside more than its distance.
    pub excess: f64,
    pub wrong_signs: usize,
}

impl FarNodes {
    pub fn new(in_bricks: &[PointSample], in_no_brick: &[PointSample], values: &FarValues) -> Self {
        let all = || in_bricks.iter().chain(in_no_brick);
        let over = |node: &PointSample| if node.truth < 0.0 { 0.0 } else { node.value - node.truth - node.rounding };
        let excess = in_bricks.iter().map(|node| values.excess(node)).chain(in_no_brick.iter().map(over));
        Self {
            sample_count: all().count(),
            excess: excess.fold(0.0, f64::max),
            wrong_signs: all().filter(|node| node.has_wrong_sign(0.0)).count(),
        }
    }
}

/// Differences of |field| and |distance| beyond a sparse grid's band, where the field is a lower bound.
#[derive(Serialize)]
pub struct FarErrors {
    #[serde(rename = "asked")]
    pub sample_count: usize,
    /// Maximum of |distance| − |field|.
    pub falls_short: f64,
    /// Maximum of |field| − |distance|.
    pub over: f64,
    /// The same outside, where the value is a lower bound.
    #[serde(skip)]
    pub over_outside: f64,
    /// Length by which the error inside is greater than the file states, at most.
    #[serde(skip)]
    pub beyond_deep_error: f64,
    /// Not counted: points of cells through which the sign of an open mesh jumps, if all corners have their own sign. There the
    /// interpolant passes through zero where the distance does not.
    pub wrong_signs: usize,
}

impl FarErrors {
    pub fn new(samples: &[PointSample], grid: &OwnedGrid, truth: &MeshDistance, values: &FarValues) -> Self {
        let error_bound = grid.global_error_bound();
        let is_crossed = |sample: &PointSample| is_crossed_by_a_true_jump(grid, truth, sample.point, error_bound);
        let has_wrong_sign = |sample: &&PointSample| sample.has_wrong_sign(error_bound) && !is_crossed(sample);
        let over = |sample: &PointSample| sample.value.abs() - sample.truth.abs();
        let is_inside = |sample: &&PointSample| sample.truth < 0.0;
        let beyond_deep_error = |sample: &PointSample| sample.error() - values.deep_error;
        Self {
            sample_count: samples.len(),
            falls_short: samples.iter().map(|sample| -over(sample)).fold(0.0, f64::max),
            over: samples.iter().map(over).fold(0.0, f64::max),
            over_outside: samples.iter().filter(|sample| !is_inside(sample)).map(over).fold(0.0, f64::max),
            beyond_deep_error: samples.iter().filter(is_inside).map(beyond_deep_error).fold(0.0, f64::max),
            wrong_signs: samples.iter().filter(has_wrong_sign).count(),
        }
    }
}

/// Does a point's cell have corners on both sides, each on the side of the mesh that the file says?
fn is_crossed_by_a_true_jump(grid: &OwnedGrid, truth: &MeshDistance, point: [f64; 3], sign_tolerance: f64) -> bool {
    let lattice = grid.lattice();
    let cell = cell_at(lattice, point);
    let stored = grid.storage().corners(cell);
    let is_true = |corner: usize| {
        let node = std::array::from_fn(|axis| cell[axis] + (corner >> axis & 1) as u32);
        !PointSample::new(truth, lattice.node(node), stored[corner].into()).has_wrong_sign(sign_tolerance)
    };
    let inside_count = stored.iter().filter(|value| **value < 0.0).count();
    (1..8).contains(&inside_count) && (0..8).all(is_true)
}
