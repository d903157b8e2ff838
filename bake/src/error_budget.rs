//! Choice of the largest voxels whose certified error is within a budget.
//!
//! For a continuous signed distance, an interpolant of exact distances errs by at most √3/2 voxels, so
//!
//! ```text
//! h = max_error / (√3/2 + rounding of samples in voxels)
//! ```
//!
//! always suffices, but for what rounds at any size: an error below that is refused at once. Where the mesh is smooth,
//! larger voxels do. [`SparseBaker::interpolation_error`] certifies each size that is tried: from coarse to fine by
//! octaves, for coarse grids are cheap to certify, then by bisection of the last octave. Of the sufficient sizes and
//! precisions, the one that takes the least memory is baked.

mod refusal;

pub use refusal::{AchievableError, ErrorBudgetError};
use sdf_core::grid::owned::Precision;
use sdf_core::grid::sparse::brick_counts;

use crate::error::beyond_band::least_brick_error;
use crate::error::normal_cones::MAX_ERROR;
use crate::rounding::{
    BOUND_ROUNDING, BRICK_DISTANCE_ROUNDING, DEQUANTIZED_ROUNDING, NODE_POSITION_ROUNDING, max_coordinate,
};
use crate::sparse::{Certify, SparseBaker};
use crate::{BakedGrid, MeshDistance, Progress, lattice_around};

/// Requirements of a sparse grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorBudget {
    /// Largest difference of the grid from the distance anywhere within the band, as a length.
    pub max_error: f64,
    /// Half width of the band, in voxels.
    pub band: f64,
    /// Cells around the mesh's box on each side.
    pub padding: u32,
    /// Memory that baking may take, by the estimate of [`SparseBaker::max_bytes`].
    pub max_bytes: usize,
}

/// Grid that takes the least memory of those that were found to be within the budget.
pub struct Plan<'a> {
    /// The sparse grid's lattice, band and bricks, ready to bake.
    pub baker: SparseBaker<'a>,
    /// Type of a sample.
    pub precision: Precision,
    /// Upper bound of the grid's `error_bound`.
    pub error_bound: f64,
    /// Largest memory of baking it.
    pub bytes: usize,
}

/// Smallest number of voxels along the longest side of the mesh, even if fewer were within the budget.
const MIN_CELLS: f64 = 8.0;

/// Bisections of the octave between a size that suffices and one that does not.
const BISECTIONS: u32 = 3;

/// A size that would need this many times the memory allowed, if the error fell with the square of the size, is beyond
/// hope. It can fall faster once: where the band no longer contains both sides of a thin shape.
const HOPELESS: f64 = 16.0;

/// Factor between sizes of which the first that fits is named where an error is refused.
const COARSER: f64 = 1.125;

/// Memory of the finest size that is looked for to be named: to see that one fits takes time, a second for so much.
const SEARCHED_BYTES: usize = 1 << 28;

/// Largest rounding of a sample, in voxels: half a step of the code, and the roundings of f32.
///
/// The samples of a brick differ by at most 7 voxels along each axis, 21 in all. u16 rounds by less than 2e-4 voxels, so that
/// f32 is never planned.
pub(crate) fn rounding(precision: Precision, band: f64) -> f64 {
    const RANGE: f64 = 21.0;
    let steps = match precision {
        Precision::U8 => f64::from(u8::MAX),
        Precision::U16 => f64::from(u16::MAX),
        Precision::F32 => f64::INFINITY,
    };
    0.5 * RANGE / steps + DEQUANTIZED_ROUNDING * (band + 2.0 * RANGE)
}

/// Largest rounding of a distance in a brick, a length: relative to a point's coordinates in a triangle's frame and the
/// triangle's length, which are together at most 2.5 diagonals of the mesh, and a brick's size.
pub(crate) fn distance_rounding(mesh: &MeshDistance, spacing: f64) -> f64 {
    const DIAGONALS: f64 = 2.5;
    f64::from(BRICK_DISTANCE_ROUNDING) * DIAGONALS * mesh.bounds().diagonal() + VOXEL_ROUNDING * spacing
}

/// Part of [`distance_rounding`] that grows with the voxels, relative to their side: a brick's size is at most 60 of them.
const VOXEL_ROUNDING: f64 = 60.0 * BRICK_DISTANCE_ROUNDING as f64;

/// A size of voxels and its certified error of exact distances, interpolated and rounded: a length.
#[derive(Clone, Copy)]
struct CertifiedSize {
    spacing: f64,
    interpolation: f64,
}

/// A size of voxels and the largest memory of baking it.
#[derive(Clone, Copy)]
struct SizeInMemory {
    spacing: f64,
    bytes: usize,
}

impl ErrorBudget {
    /// Plans and bakes a grid, and repeats with a smaller error until the grid's own bound is within the budget. How many steps there
    /// are is known size by size.
    pub fn bake(
        &self,
        mesh: &MeshDistance,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<BakedGrid, ErrorBudgetError> {
        let mut tightened = *self;
        loop {
            let plan = tightened.plan(mesh, on_progress).map_err(|refusal| refusal.about(self.max_error))?;
            on_progress(Progress::Total(plan.baker.slot_count() as u64));
            let on_done = |slots: usize| on_progress(Progress::Done(slots as u64));
            let baked = plan.baker.bake_as(plan.precision, &on_done);
            // What a cancelled bake returns is not used: the caller checks the flag.
            if baked.error_bound <= self.max_error || mesh.is_cancelled() {
                return Ok(baked);
            }
            // Not observed yet: the grid's own bound is smaller than the plan's.
            tightened.max_error *= 0.9;
        }
    }

    /// Finds the grid to bake. The result does not depend on the number of threads.
    pub fn plan<'a>(
        &self,
        mesh: &'a MeshDistance<'a>,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<Plan<'a>, ErrorBudgetError> {
        if !(self.max_error > 0.0 && self.max_error.is_finite()) {
            return Err(ErrorBudgetError::InvalidError(self.max_error));
        }
        if !(self.band >= 0.0 && self.band.is_finite()) {
            return Err(ErrorBudgetError::InvalidBand(self.band));
        }
        if !mesh.is_continuous() {
            return Err(ErrorBudgetError::SignJumps { sign_reason: mesh.sign_reason().to_owned() });
        }
        let Some(sufficient) = self.sufficient_size(mesh, Precision::U8) else {
            let achievable = self.achievable(mesh, None);
            let rounding = self.rounding_at(mesh, 0.0);
            return Err(ErrorBudgetError::BelowRounding { max_error: self.max_error, rounding, achievable });
        };
        let (certified, fitting) = self.certified_sizes(mesh, sufficient.spacing, on_progress)?;
        // The finest sizes, which suffice for any mesh, would be laid out now.
        if mesh.is_cancelled() {
            return Err(ErrorBudgetError::Cancelled);
        }
        let plans = [Precision::U8, Precision::U16].into_iter().filter_map(|precision| {
            let sizes = certified.iter().copied().chain(self.sufficient_size(mesh, precision));
            let sufficient = sizes.filter(|size| self.error(mesh, *size, precision) <= self.max_error);
            let largest = sufficient.max_by(|a, b| a.spacing.total_cmp(&b.spacing))?;
            let baker = self.baker(mesh, largest.spacing)?;
            let bytes = baker.max_bytes_as(precision);
            Some(Plan { baker, precision, error_bound: self.error(mesh, largest, precision), bytes })
        });
        let smallest = plans.min_by_key(|plan| plan.bytes);
        let planned =
            smallest.as_ref().map(|plan| SizeInMemory { spacing: plan.baker.lattice().spacing(), bytes: plan.bytes });
        smallest
            .filter(|plan| plan.bytes <= self.max_bytes)
            .ok_or_else(|| self.too_large(mesh, sufficient.spacing, planned.or(fitting)))
    }

    fn error(&self, mesh: &MeshDistance, size: CertifiedSize, precision: Precision) -> f64 {
        let CertifiedSize { spacing, interpolation } = size;
        let of_samples = rounding(precision, self.band) * spacing;
        let beyond_band = least_brick_error(of_samples + self.rounding_at(mesh, spacing), spacing, self.band * spacing);
        (interpolation + of_samples).max(beyond_band) * (1.0 + BOUND_ROUNDING)
    }

    /// Size that suffices for any mesh; `None` if rounding alone exceeds the error.
    fn sufficient_size(&self, mesh: &MeshDistance, precision: Precision) -> Option<CertifiedSize> {
        let rest = self.before_rounding() - self.rounding_at(mesh, 0.0);
        let spacing = rest / (MAX_ERROR + rounding(precision, self.band) + self.voxel_rounding());
        let spacing = spacing.min(mesh.bounds().longest_side() / MIN_CELLS);
        let interpolation = MAX_ERROR * spacing + self.rounding_at(mesh, spacing);
        (spacing > 0.0).then_some(CertifiedSize { spacing, interpolation })
    }

    /// The error allowed, less rounding: once that of `error`, once that of a difference and a division.
    fn before_rounding(&self) -> f64 {
        self.max_error / (1.0 + BOUND_ROUNDING) / (1.0 + BOUND_ROUNDING)
    }

    /// Largest rounding of a node's exact distance, a length: what `splat` measures, and the positions of nodes and of the surface.
    fn rounding_at(&self, mesh: &MeshDistance, spacing: f64) -> f64 {
        let positions = NODE_POSITION_ROUNDING * max_coordinate(&mesh.bounds()) + mesh.rounding();
        distance_rounding(mesh, 0.0) + positions + self.voxel_rounding() * spacing
    }

    /// Part of [`Self::rounding_at`] that grows with the voxels, relative to their side: a brick, the band, and the padding, which
    /// nodes lie beyond the mesh by.
    fn voxel_rounding(&self) -> f64 {
        let distances = VOXEL_ROUNDING + f64::from(BRICK_DISTANCE_ROUNDING) * 3.0_f64.sqrt() * self.band;
        distances + NODE_POSITION_ROUNDING * (f64::from(self.padding) + 1.0)
    }

    /// Sizes above [`Self::sufficient_size`] that are certified to suffice, the last the largest, and the last size
    /// that fits the memory. An error as soon as it is clear that no size which may suffice fits.
    fn certified_sizes(
        &self,
        mesh: &MeshDistance,
        sufficient: f64,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Result<(Vec<CertifiedSize>, Option<SizeInMemory>), ErrorBudgetError> {
        let spacing = |octaves: f64| sufficient * octaves.exp2();
        let coarsest = (mesh.bounds().longest_side() / MIN_CELLS / sufficient).log2();
        let mut certified = vec![];
        // In octaves: this size suffices, or does not fit.
        let mut lower = 0.0;
        let mut last = None;
        for octave in (1..=coarsest as u32).rev() {
            let Some(baker) = self.fitting_baker(mesh, spacing(octave.into())) else {
                return Err(self.too_large(mesh, sufficient, last));
            };
            let tried = SizeInMemory { spacing: spacing(octave.into()), bytes: baker.max_bytes_as(Precision::U8) };
            last = Some(tried);
            let Some(size) = self.certify(mesh, &baker, f64::INFINITY, on_progress) else { break };
            let error = self.error(mesh, size, Precision::U8);
            if error <= self.max_error {
                lower = octave.into();
                certified.push(size);
                break;
            }
            // At best the error falls with the square of the size, as the memory grows.
            if tried.bytes as f64 * (error / self.max_error) > HOPELESS * self.max_bytes as f64 {
                return Err(self.too_large(mesh, sufficient, last));
            }
        }
        for bisection in (1..=BISECTIONS).take_while(|_| !mesh.is_cancelled()) {
            let middle = lower + (-f64::from(bisection)).exp2();
            let baker = if middle > coarsest { None } else { self.fitting_baker(mesh, spacing(middle)) };
            let size = baker.and_then(|baker| self.certify(mesh, &baker, self.max_error, on_progress));
            if let Some(size) = size.filter(|size| self.error(mesh, *size, Precision::U8) <= self.max_error) {
                lower = middle;
                certified.push(size);
            }
        }
        Ok((certified, last))
    }

    fn fitting_baker<'a>(&self, mesh: &'a MeshDistance<'a>, spacing: f64) -> Option<SparseBaker<'a>> {
        self.baker(mesh, spacing).filter(|baker| baker.max_bytes_as(Precision::U8) <= self.max_bytes)
    }

    /// `None` if the table of brick slots alone exceeds the memory.
    fn baker<'a>(&self, mesh: &'a MeshDistance<'a>, spacing: f64) -> Option<SparseBaker<'a>> {
        let lattice = lattice_around(&mesh.bounds(), spacing, self.padding)?;
        let slots = brick_counts(&lattice).iter().try_fold(1, |n: usize, count| n.checked_mul(*count as usize + 1))?;
        // What `BrickMap::bytes` has for a slot and for a node of the coarse grid.
        let table = slots.checked_mul(size_of::<([f32; 4], [f32; 4])>())?;
        let baker = (table <= self.max_bytes).then(|| SparseBaker::new(mesh, &lattice, self.band * spacing))?;
        Some(baker.ok()?.certified(Certify::Tight))
    }

    /// Extrapolates from the memory of a known size: the number of bricks grows with the inverse square of the size.
    fn too_large(&self, mesh: &MeshDistance, sufficient: f64, known: Option<SizeInMemory>) -> ErrorBudgetError {
        let needed = known.map(|SizeInMemory { spacing, bytes }| bytes as f64 * (spacing / sufficient).powi(2));
        let bytes = needed.filter(|bytes| *bytes < usize::MAX as f64).map(|bytes| bytes as usize);
        let achievable = self.achievable(mesh, known);
        ErrorBudgetError::TooLarge { max_error: self.max_error, bytes, max_bytes: self.max_bytes, achievable }
    }

    /// Error that suits any mesh, by a size that is found to fit. `known` tells where to look for it.
    fn achievable(&self, mesh: &MeshDistance, known: Option<SizeInMemory>) -> Option<AchievableError> {
        let measured = |spacing| {
            let bytes = self.fitting_baker(mesh, spacing)?.max_bytes_as(Precision::U8);
            Some(SizeInMemory { spacing, bytes })
        };
        let extrapolated = |size: SizeInMemory, bytes: usize| size.spacing * (size.bytes as f64 / bytes as f64).sqrt();
        let coarsest = mesh.bounds().longest_side() / MIN_CELLS;
        let mut fitting = match known {
            Some(known) if known.bytes <= self.max_bytes => known,
            Some(known) => {
                let mut spacing = extrapolated(known, self.max_bytes);
                loop {
                    match measured(spacing.min(coarsest)) {
                        Some(fitting) => break fitting,
                        None if spacing >= coarsest => return None,
                        None => spacing *= COARSER,
                    }
                }
            }
            None => measured(coarsest)?,
        };
        // Coarse sizes take more bricks than the square tells: extrapolated again from each that is found.
        loop {
            let spacing = extrapolated(fitting, self.max_bytes.min(SEARCHED_BYTES));
            let finer = (COARSER * spacing < fitting.spacing).then(|| measured(spacing)).flatten();
            match finer {
                Some(finer) => fitting = finer,
                None => break,
            }
        }
        let SizeInMemory { spacing, bytes } = fitting;
        let interpolation = MAX_ERROR * spacing + self.rounding_at(mesh, spacing);
        let error = self.error(mesh, CertifiedSize { spacing, interpolation }, Precision::U8);
        // More than `sufficient_size` takes off.
        Some(AchievableError { error: error * (1.0 + 4.0 * BOUND_ROUNDING), spacing, bytes })
    }

    /// `None` if the error exceeds `max_error` or the mesh does not bound one solid. The error is a bound of no more than the budget needs.
    fn certify(
        &self,
        mesh: &MeshDistance,
        baker: &SparseBaker,
        max_error: f64,
        on_progress: &(dyn Fn(Progress) + Sync),
    ) -> Option<CertifiedSize> {
        mesh.solid_normals()?;
        let spacing = baker.lattice().spacing();
        let of_samples = rounding(Precision::U8, self.band) * spacing;
        let sufficient = self.before_rounding() - of_samples - self.rounding_at(mesh, spacing);
        on_progress(Progress::Total(baker.slot_count() as u64));
        let on_done = |slots: usize| on_progress(Progress::Done(slots as u64));
        let exact = baker.interpolation_error(sufficient, max_error, &on_done)?;
        let interpolation = exact + self.rounding_at(mesh, spacing);
        Some(CertifiedSize { spacing, interpolation })
    }
}
