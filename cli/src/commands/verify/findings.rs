//! How far is a field from the exact distance? Statistics over the samples; in a sparse grid within and beyond the band.

use sdf_bake::MeshDistance;
use sdf_bake::sparse::{code_step, node_rounding};
use sdf_core::Aabb;
use sdf_core::grid::Storage;
use sdf_core::grid::owned::{ErrorRegions, OwnedGrid};
use sdf_core::grid::sparse::BRICK;
use sdf_procedural::random::unit_at;
use serde::Serialize;

use super::far::{FarErrors, FarNodes, FarValues};
use super::sampling::{PointSample, Surface, cell_at, point_in_box, sample, sample_coarse_nodes, sample_nodes};
use crate::args::VerifyArgs;

/// Tolerance of a node of a dense grid, as a fraction of the mesh's diagonal: many times what f64 rounds of its distance.
const DENSE_TOLERANCE: f64 = 1e-6;

/// Tolerance of positions far from the origin, as a fraction of the largest coordinate: of nodes, and of the surface's nearest points.
const POSITION_TOLERANCE: f64 = 64.0 * f64::EPSILON;

/// Relative tolerance of a gradient's norm above a certified bound.
pub const SLOPE_TOLERANCE: f64 = 1e-6;

/// A grid to verify, and what its file states.
pub struct StatedGrid<'a> {
    pub grid: &'a OwnedGrid,
    /// Half width of a sparse grid's band.
    pub band: Option<f64>,
    pub error_bound: f64,
    /// Where the error may be more than elsewhere, for open meshes.
    pub error_regions: Option<&'a ErrorRegions>,
    pub slope_bound: f64,
    /// See [`About::padding`](sdf_formats::grid_file::About::padding).
    pub padding: f64,
    /// Are samples distances but for one rounding? Those of a blob may have been rounded again: they are as good as its error bound.
    pub has_exact_nodes: bool,
}

#[derive(Serialize)]
pub struct Findings {
    /// Errors of all nodes; in a sparse grid of those whose sample is exact. `None` for shapes in closed form.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes: Option<Errors>,
    /// Other nodes of a sparse grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub far_nodes: Option<FarNodes>,
    /// Errors in the whole box; in a sparse grid within its band.
    pub points: Errors,
    /// Errors beyond the band of a sparse grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub far: Option<FarErrors>,
    /// Number of points of the surface that were looked up in a sparse grid.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub surface_points: Option<usize>,
    /// Number of points on the surface or in the band whose cell has a corner in no brick.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing_cells: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub slope: Option<Slope>,
    /// Length by which a node may be off, beside the rounding of its precision.
    #[serde(skip)]
    pub node_tolerance: f64,
    /// The error bound that the file certifies.
    #[serde(skip)]
    pub bound: Option<f64>,
    /// Number of points with an error above the bound of their own brick.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beyond_their_brick: Option<usize>,
    /// Number of points with an error above what the file states of the region that they are in, or of all outside of regions.
    #[serde(skip)]
    pub beyond_their_region: usize,
    /// Number of points where the stored bounds of blocks exclude the samples around or the slope.
    #[serde(skip)]
    pub beyond_block_bounds: usize,
    /// The padding that a file states, and how far the faces of the box are from the mesh by the mesh and by the samples, whichever is more.
    #[serde(skip)]
    pub padding: Option<[f64; 2]>,
}

/// The largest norm of a sampled gradient, and the bound that the file certifies.
#[derive(Serialize)]
pub struct Slope {
    pub steepest: f64,
    pub bound: f64,
}

/// Statistics of |field − distance|.
#[derive(Serialize)]
pub struct Errors {
    #[serde(rename = "asked")]
    pub sample_count: usize,
    pub mean: f64,
    pub p95: f64,
    pub p99_9: f64,
    pub max: f64,
    /// `[mean, p95, p99_9, max]` in voxels.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub voxels: Option<[f64; 4]>,
    /// Maximum of error minus rounding.
    #[serde(skip)]
    pub beyond_rounding: f64,
    /// Number of samples with the wrong sign and a distance above the tolerance.
    pub wrong_signs: usize,
}

impl Findings {
    pub fn from_points(points: Errors) -> Self {
        Self {
            nodes: None,
            far_nodes: None,
            points,
            far: None,
            surface_points: None,
            missing_cells: None,
            slope: None,
            node_tolerance: 0.0,
            bound: None,
            beyond_their_brick: None,
            beyond_their_region: 0,
            beyond_block_bounds: 0,
            padding: None,
        }
    }

    /// The findings for a grid, and the samples at points behind them.
    pub fn from_grid(
        args: &VerifyArgs,
        stated: &StatedGrid,
        truth: &MeshDistance,
        surface: &Surface,
    ) -> (Self, Vec<PointSample>) {
        let StatedGrid { grid, band, error_bound: bound, error_regions, slope_bound, padding, has_exact_nodes } =
            *stated;
        let lattice = grid.lattice();
        let (bounds, spacing) = (lattice.bounds(), lattice.spacing());
        let box_point = |seed: u64| move |index: u64| point_in_box(seed, index, &bounds);
        let far_values = band.map(|band| FarValues::new(grid, band, truth));
        let with_signs_of_cells = |mut samples: Vec<PointSample>| {
            if !truth.is_continuous() {
                samples.iter_mut().for_each(|sample| sample.take_sign_of_cell(grid));
            }
            samples
        };
        let coarse_nodes = far_values.map_or(vec![], |_| sample_coarse_nodes(args, grid, truth));
        let (samples, far, missing, beyond) = match far_values {
            Some(values) => {
                let band = values.band;
                let brick_errors = grid.storage().brick_errors();
                let near = |index: u64| {
                    let offset: [f64; 3] =
                        std::array::from_fn(|axis| 2.0 * unit_at(!args.seed, 8 * index + 3 + axis as u64) - 1.0);
                    let point = surface.point(!args.seed, 8 * index);
                    std::array::from_fn(|axis| point[axis] + band * offset[axis])
                };
                let is_inside = |point: [f64; 3]| bounds.encloses(&Aabb { min: point, max: point });
                let mut samples = with_signs_of_cells(sample(args, grid, truth, near));
                samples.retain(|sample| sample.truth.abs() <= band && is_inside(sample.point));
                let mut far = sample(args, grid, truth, box_point(args.seed));
                far.extend(coarse_nodes.iter().copied());
                let mut far = with_signs_of_cells(far);
                far.retain(|sample| sample.truth.abs() > band);
                let own_brick = |point: [f64; 3]| grid.storage().brick_at(cell_at(lattice, point).map(|n| n / BRICK));
                let is_beyond = |sample: &&PointSample| {
                    own_brick(sample.point).is_none_or(|brick| sample.error() > f64::from(brick_errors[brick]))
                };
                let is_whole = |point: [f64; 3]| {
                    let cell = cell_at(lattice, point);
                    let corner = |corner: u32| std::array::from_fn(|axis| (cell[axis] + (corner >> axis & 1)) / BRICK);
                    (0..8).all(|index| grid.storage().brick_at(corner(index)).is_some())
                };
                let is_missing = |index: usize| !is_whole(surface.point(args.seed, 8 * index as u64));
                let missing = sdf_parallel::filter(args.points as usize, is_missing).len();
                let missing_near = samples.iter().filter(|sample| !is_whole(sample.point)).count();
                let beyond = samples.iter().filter(is_beyond).count();
                let far = FarErrors::new(&far, grid, truth, &values);
                (samples, Some(far), Some(missing + missing_near), Some(beyond))
            }
            None => {
                let mut samples = with_signs_of_cells(sample(args, grid, truth, box_point(!args.seed)));
                // A dense blob that was sampled from a sparse grid has a band, too.
                samples.retain(|sample| sample.truth.abs() <= grid.band());
                (samples, None, None, None)
            }
        };
        let coordinates = bounds.min.into_iter().chain(bounds.max);
        let rounding = POSITION_TOLERANCE * coordinates.fold(0.0, |largest: f64, x| largest.max(x.abs()));
        let node_tolerance = match far_values {
            _ if !has_exact_nodes => bound,
            Some(values) => node_rounding(truth, lattice, values.band),
            None => DENSE_TOLERANCE * truth.bounds().diagonal() + rounding,
        };
        // A sign may be lost only where a distance is rounded to zero.
        let coarsest = f64::from(code_step(grid.storage().precision(), grid.storage().scales()));
        let sign_tolerance = if has_exact_nodes { spacing * 1e-6 + coarsest + rounding } else { bound };
        // Nowhere in a cell with right signs at its nodes is the wrong one farther from the surface than its diagonal.
        let point_sign_tolerance = if bound.is_finite() { bound } else { spacing * 3.0_f64.sqrt() };
        let is_exact = |node: &PointSample| far_values.is_none_or(|values| node.truth.abs() <= values.exact_within);
        let (nodes, far_nodes): (Vec<_>, Vec<_>) = sample_nodes(args, grid, truth).into_iter().partition(is_exact);
        let steepest = samples.iter().map(|sample| sample.slope).fold(0.0, f64::max);
        let findings = Self {
            nodes: Some(Errors::new(&nodes, sign_tolerance, Some(spacing))),
            far_nodes: far_values.map(|values| FarNodes::new(&far_nodes, &coarse_nodes, &values)),
            points: Errors::new(&samples, point_sign_tolerance, Some(spacing)),
            far,
            surface_points: missing.map(|_| args.points as usize),
            missing_cells: missing,
            slope: Some(Slope { steepest, bound: slope_bound }),
            node_tolerance,
            bound: Some(bound),
            beyond_their_brick: beyond,
            beyond_their_region: error_regions
                .map_or(0, |regions| samples.iter().filter(|sample| is_beyond_region(regions, sample)).count()),
            beyond_block_bounds: samples.iter().filter(|sample| is_beyond_bounds(grid, sample)).count(),
            padding: Some([padding, grid.lowest_boundary_sample().max(room_around(&truth.bounds(), &bounds))]),
        };
        (findings, samples)
    }
}

/// Is a point's error more than the bound of the regions that it is in, or outside of all of them? Nothing is known where a file lists only the
/// largest of its regions.
fn is_beyond_region(stated: &ErrorRegions, sample: &PointSample) -> bool {
    let at = Aabb { min: sample.point, max: sample.point };
    let regions = stated.regions.iter().filter(|region| region.bounds.encloses(&at));
    let bound = regions.map(|region| region.error_bound).fold(stated.error_bound, f64::max);
    stated.regions.len() == stated.region_count && sample.error() > bound
}

/// Do the bounds that the blocks around a point's cell state exclude a sample at a corner of the cell, or the slope at the point?
fn is_beyond_bounds(grid: &OwnedGrid, sample: &PointSample) -> bool {
    let cell = cell_at(grid.lattice(), sample.point);
    let Some(stated) = grid.storage().block_bounds(cell, cell.map(|n| n + 1)) else { return false };
    let is_outside = |corner: &f32| *corner < stated.range.lower || stated.range.upper < *corner;
    grid.storage().corners(cell).iter().any(is_outside)
        || sample.slope > f64::from(stated.slope_bound) * (1.0 + SLOPE_TOLERANCE)
}

/// Least distance of the mesh's box from a face of the grid's.
fn room_around(mesh: &Aabb, grid: &Aabb) -> f64 {
    let room = |axis: usize| (mesh.min[axis] - grid.min[axis]).min(grid.max[axis] - mesh.max[axis]);
    (0..3).map(room).fold(f64::INFINITY, f64::min)
}

impl Errors {
    pub fn new(samples: &[PointSample], sign_tolerance: f64, spacing: Option<f64>) -> Self {
        let mut errors: Vec<f64> = samples.iter().map(PointSample::error).collect();
        errors.sort_unstable_by(f64::total_cmp);
        let last = errors.len().saturating_sub(1);
        let quantile = |fraction: f64| errors.get((last as f64 * fraction) as usize).copied().unwrap_or(0.0);
        let mean = errors.iter().sum::<f64>() / errors.len().max(1) as f64;
        let [p95, p99_9, max] = [0.95, 0.999, 1.0].map(quantile);
        Self {
            sample_count: errors.len(),
            mean,
            p95,
            p99_9,
            max,
            voxels: spacing.map(|spacing| [mean, p95, p99_9, max].map(|error| error / spacing)),
            beyond_rounding: samples.iter().map(|sample| sample.error() - sample.rounding).fold(0.0, f64::max),
            wrong_signs: samples.iter().filter(|sample| sample.has_wrong_sign(sign_tolerance)).count(),
        }
    }
}
