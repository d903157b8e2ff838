//! Voxels as large as a wanted error allows.
//!
//! Of a mesh whose signed distance is continuous, an interpolant of exact distances is off by √3/2 voxels at most, so some
//! voxel always suffices. Where the mesh is smooth, larger ones do, and [`Plan::interpolation_error`] certifies it of each
//! size that is tried, from coarse to fine: those are the cheaper ones.

use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::brick_counts;
use thiserror::Error;

use crate::error::normal_cones::MAX_ERROR;
use crate::rounding::{BOUND_ROUNDING, DEQUANTIZED_ROUNDING};
use crate::sparse::{Plan, Quantize, SparseGrid};
use crate::{MeshDistance, lattice_around};

/// What is wanted of a sparse grid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Budget {
    /// As a length: nowhere within the band may the grid be further from the distance than this.
    pub max_error: f64,
    /// In voxels.
    pub band: f64,
    /// Cells around the mesh's box.
    pub padding: u32,
    /// Bytes of memory that the grid may take while it is baked.
    pub most_bytes: usize,
}

/// How samples are kept. f32 never pays: in u16 they round by less than 2e-4 voxels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Precision {
    U8,
    U16,
}

/// The grid that takes the least memory of those that were found to keep within an error.
pub struct Choice<'a> {
    pub plan: Plan<'a>,
    pub precision: Precision,
    /// The grid's own will be no more.
    pub error_bound: f64,
    /// The most that baking it takes.
    pub bytes: usize,
}

/// A sparse grid, by the kind of its samples.
#[derive(Clone, Debug, PartialEq)]
pub enum AnyGrid {
    U8(SparseGrid<u8>),
    U16(SparseGrid<u16>),
}

/// A grid whose `error_bound` is at most the budget's.
#[derive(Clone, Debug, PartialEq)]
pub struct Baked {
    pub lattice: Lattice,
    pub grid: AnyGrid,
}

/// An error that any mesh's grid keeps within with the memory allowed, and what it takes, about.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reachable {
    pub error: f64,
    /// The side of its voxels.
    pub spacing: f64,
    pub bytes: usize,
}

#[derive(Clone, Debug, Error, PartialEq)]
pub enum ErrorBudgetError {
    #[error("no length: an error of {0} is asked for")]
    NoLength(f64),
    #[error(
        "around the holes of the mesh the sign of the distance jumps ({verdict}), and no voxel is small enough for that"
    )]
    SignJumps { verdict: String },
    #[error("an error of {max_error} takes {}, and {most_bytes} are allowed{}", about(*bytes), with_those(reachable))]
    TooLarge {
        max_error: f64,
        /// What voxels take that suffice for any mesh, extrapolated from larger ones. `None` where no size fits, or where
        /// there is no number for it.
        bytes: Option<usize>,
        most_bytes: usize,
        /// `None` where no size fits.
        reachable: Option<Reachable>,
    },
}

fn about(bytes: Option<usize>) -> String {
    bytes.map_or_else(|| "more bytes".to_owned(), |bytes| format!("about {bytes} bytes"))
}

fn with_those(reachable: &Option<Reachable>) -> String {
    reachable.map_or_else(String::new, |Reachable { error, spacing, bytes }| {
        format!(": with {bytes} it can be {error}, by voxels of {spacing}")
    })
}

/// No mesh is baked to fewer voxels along its longest side only because that is good enough.
const FEWEST_CELLS: f64 = 8.0;

/// Between sizes an octave apart, the one that suffices and the one that does not, the gap is halved this often.
const HALVINGS: u32 = 3;

impl Precision {
    /// The most that a sample is rounded by, in voxels. The samples of a brick differ by no more than 7 voxels along each
    /// axis; half a step is lost, and what f32 loses of numbers no larger than the band and all of that.
    fn rounding(self, band: f64) -> f64 {
        const RANGE: f64 = 21.0;
        let codes = match self {
            Self::U8 => f64::from(u8::MAX),
            Self::U16 => f64::from(u16::MAX),
        };
        // A sample, its scale's two numbers and what they make of a code are each rounded.
        0.5 * RANGE / codes + DEQUANTIZED_ROUNDING * (band + 2.0 * RANGE)
    }
}

/// A size of voxels, and the certified error of interpolation as a length.
#[derive(Clone, Copy)]
struct Certified {
    spacing: f64,
    interpolation: f64,
}

impl Budget {
    /// Chooses, bakes, and sees to it that the grid's own bound is within the budget. `on_places_done` as in [`Plan::bake`].
    pub fn bake(
        &self,
        mesh: &MeshDistance,
        on_places_done: &(dyn Fn(usize) + Sync),
    ) -> Result<Baked, ErrorBudgetError> {
        let mut asked = *self;
        loop {
            let choice = asked.choose(mesh)?;
            let lattice = *choice.plan.lattice();
            let (grid, error_bound) = match choice.precision {
                Precision::U8 => within::<u8>(&choice.plan, on_places_done, AnyGrid::U8),
                Precision::U16 => within::<u16>(&choice.plan, on_places_done, AnyGrid::U16),
            };
            if error_bound <= self.max_error {
                return Ok(Baked { lattice, grid });
            }
            // Not seen yet: what is measured is less than what was promised of it.
            asked.max_error *= 0.9;
        }
    }

    /// Tries sizes from coarse to fine. The same on any number of threads.
    pub fn choose<'a>(&self, mesh: &'a MeshDistance<'a>) -> Result<Choice<'a>, ErrorBudgetError> {
        if !(self.max_error > 0.0 && self.max_error.is_finite()) {
            return Err(ErrorBudgetError::NoLength(self.max_error));
        }
        if !mesh.is_continuous() {
            return Err(ErrorBudgetError::SignJumps { verdict: mesh.verdict().to_owned() });
        }
        let (certified, fitting) = self.certified(mesh)?;
        let choices = [Precision::U8, Precision::U16].into_iter().filter_map(|precision| {
            let sizes = certified.iter().copied().chain([self.sure_size(mesh, precision)]);
            let sufficing = sizes.filter(|size| self.error(*size, precision) <= self.max_error);
            let largest = sufficing.max_by(|a, b| a.spacing.total_cmp(&b.spacing))?;
            let plan = self.plan(mesh, largest.spacing)?;
            let bytes = bytes(&plan, precision);
            Some(Choice { plan, precision, error_bound: self.error(largest, precision), bytes })
        });
        let least = choices.min_by_key(|choice| choice.bytes);
        let chosen =
            least.as_ref().map(|choice| Size { spacing: choice.plan.lattice().spacing(), bytes: choice.bytes });
        least.filter(|choice| choice.bytes <= self.most_bytes).ok_or_else(|| self.refusal(mesh, chosen.or(fitting)))
    }

    fn error(&self, size: Certified, precision: Precision) -> f64 {
        (size.interpolation + precision.rounding(self.band) * size.spacing) * (1.0 + BOUND_ROUNDING)
    }

    /// What always suffices.
    fn sure_size(&self, mesh: &MeshDistance, precision: Precision) -> Certified {
        // Once for `error`, once for this very division.
        let spacing = self.max_error
            / (MAX_ERROR + precision.rounding(self.band))
            / (1.0 + BOUND_ROUNDING)
            / (1.0 + BOUND_ROUNDING);
        let spacing = spacing.min(mesh.bounds().longest_side() / FEWEST_CELLS);
        Certified { spacing, interpolation: MAX_ERROR * spacing }
    }

    /// The sizes of more than what always suffices that were found to, the last the largest. Refuses as soon as it is clear
    /// that none which may suffice fits the memory. With a size that does.
    fn certified(&self, mesh: &MeshDistance) -> Result<(Vec<Certified>, Option<Size>), ErrorBudgetError> {
        let sure = self.sure_size(mesh, Precision::U8).spacing;
        let spacing = |octaves: f64| sure * octaves.exp2();
        let coarsest = (mesh.bounds().longest_side() / FEWEST_CELLS / sure).log2();
        let mut found = vec![];
        // The size below suffices, or does not fit.
        let mut below = 0.0;
        let mut last = None;
        for octave in (1..=coarsest as u32).rev() {
            let Some(plan) = self.fitting_plan(mesh, spacing(octave.into())) else {
                return Err(self.refusal(mesh, last));
            };
            let sized = Size { spacing: spacing(octave.into()), bytes: bytes(&plan, Precision::U8) };
            last = Some(sized);
            let Some(size) = certify(mesh, &plan, sized.spacing, f64::INFINITY) else { break };
            let error = self.error(size, Precision::U8);
            if error <= self.max_error {
                below = octave.into();
                found.push(size);
                break;
            }
            // At best the error falls with the square of the size, as the bytes rise.
            if sized.bytes as f64 * (error / self.max_error) > HOPELESS * self.most_bytes as f64 {
                return Err(self.refusal(mesh, last));
            }
        }
        for halving in 1..=HALVINGS {
            let tried = below + (-f64::from(halving)).exp2();
            let plan = if tried > coarsest { None } else { self.fitting_plan(mesh, spacing(tried)) };
            let size = plan.and_then(|plan| certify(mesh, &plan, spacing(tried), self.max_error));
            if let Some(size) = size.filter(|size| self.error(*size, Precision::U8) <= self.max_error) {
                below = tried;
                found.push(size);
            }
        }
        Ok((found, last))
    }

    fn fitting_plan<'a>(&self, mesh: &'a MeshDistance<'a>, spacing: f64) -> Option<Plan<'a>> {
        self.plan(mesh, spacing).filter(|plan| bytes(plan, Precision::U8) <= self.most_bytes)
    }

    /// `None` where the table of its places alone takes more than the memory.
    fn plan<'a>(&self, mesh: &'a MeshDistance<'a>, spacing: f64) -> Option<Plan<'a>> {
        let lattice = lattice_around(&mesh.bounds(), spacing, self.padding)?;
        let places = brick_counts(&lattice).iter().try_fold(1, |n: usize, along| n.checked_mul(*along as usize + 1))?;
        let table = places.checked_mul(size_of::<[f32; 4]>())?;
        (table <= self.most_bytes).then(|| Plan::new(mesh, &lattice, self.band * spacing))
    }

    /// From what a size takes, what others do: bricks are as many as the surface has squares of their size.
    fn refusal(&self, mesh: &MeshDistance, known: Option<Size>) -> ErrorBudgetError {
        let sure = self.sure_size(mesh, Precision::U8).spacing;
        let needed = known.map(|Size { spacing, bytes }| bytes as f64 * (spacing / sure).powi(2));
        let reachable = known.map(|Size { spacing, bytes }| {
            let spacing = spacing * (bytes as f64 / self.most_bytes as f64).sqrt();
            let error = self.error(Certified { spacing, interpolation: MAX_ERROR * spacing }, Precision::U8);
            Reachable { error, spacing, bytes: self.most_bytes }
        });
        let bytes = needed.filter(|bytes| *bytes < usize::MAX as f64).map(|bytes| bytes as usize);
        ErrorBudgetError::TooLarge { max_error: self.max_error, bytes, most_bytes: self.most_bytes, reachable }
    }
}

/// The most memory that a size of voxels takes.
#[derive(Clone, Copy)]
struct Size {
    spacing: f64,
    bytes: usize,
}

/// How many times the memory allowed a size would take that is out of the question. Where a band no longer holds both sides
/// of a shape, the error falls faster than by the square once.
const HOPELESS: f64 = 16.0;

/// `None` where the error is more than `most`, or the mesh lets nothing be certified.
fn certify(mesh: &MeshDistance, plan: &Plan, spacing: f64, most: f64) -> Option<Certified> {
    mesh.normals_of_one_solid()?;
    Some(Certified { spacing, interpolation: plan.interpolation_error(most)? })
}

fn bytes(plan: &Plan, precision: Precision) -> usize {
    match precision {
        Precision::U8 => plan.most_bytes::<u8>(),
        Precision::U16 => plan.most_bytes::<u16>(),
    }
}

fn within<C: Quantize>(
    plan: &Plan,
    on_places_done: &(dyn Fn(usize) + Sync),
    any: impl Fn(SparseGrid<C>) -> AnyGrid,
) -> (AnyGrid, f64) {
    let grid = plan.bake::<C>(on_places_done);
    let error_bound = grid.error_bound;
    (any(grid), error_bound)
}
