//! Fields stored as samples on a regular grid and interpolated trilinearly.
//!
//! ```text
//! lattice ──────────┐   where the nodes are
//! dense │ sparse ───┤   where the samples are: a `Storage`
//! block_bounds ─────┘   bounds of 8 × 8 × 8 nodes beside a storage
//! blob                  all of that in one little-endian file, read where it lies
//!        Grid ──┬─ evaluate (trilinear)    φ and ∇φ at a point
//!               ├─ smooth                  a gradient without jumps at the faces of cells
//!               ├─ slope                   Lipschitz constants
//!               ├─ error                   bounds of |φ − d|
//!               ├─ gradient_range          intervals of φ and ∇φ in a box
//!               └─ exact                   minimum on a segment or triangle, on a copy of its nodes (node_box)
//! ```

pub mod blob;
mod block_bounds;
#[cfg(feature = "alloc")]
mod blocks;
mod brick;
mod dense;
mod error;
#[cfg(feature = "alloc")]
mod error_regions;
mod evaluate;
mod exact;
mod gradient_range;
mod kind;
mod lattice;
mod node_box;
#[cfg(feature = "alloc")]
pub mod owned;
mod plain_normals;
mod slope;
mod smooth;
pub mod sparse;
mod storage;
mod trilinear;

use nalgebra::Vector3;

pub use blob::Blob;
pub use block_bounds::WithBlockBounds;
use brick::brick_slot;
pub use dense::Dense;
pub use error::{CellErrors, JumpLimits, Sampling};
use gradient_range::GradientRange;
pub use kind::{Layout, Precision};
pub use lattice::Lattice;
pub use plain_normals::PlainNormals;
use slope::lowest_boundary_sample;
pub use slope::{cell_slope, measure_slope_bound, slope_bound_with_outside};
pub use storage::{Storage, TEAM_LANES};

use crate::number::interval::Interval;
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::max_distance;
use crate::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, ExactMinimum, Goal, Parameter, Sample, Sdf};

/// Bounds of a block of nodes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockBounds {
    /// Interval that holds every sample.
    pub range: Interval<f32>,
    /// Lipschitz constant of the interpolant in every cell with a corner in the block.
    pub slope_bound: f32,
}

impl BlockBounds {
    /// Bounds of an empty set of nodes: the neutral element of [`union`](Self::union).
    pub const EMPTY: Self = Self { range: Interval::<f32>::EMPTY, slope_bound: 0.0 };

    /// Bounds of two blocks together.
    #[inline(always)]
    pub fn union(self, other: Self) -> Self {
        Self { range: self.range.hull(other.range), slope_bound: self.slope_bound.max(other.slope_bound) }
    }
}

/// A field of samples. Inside its box φ is the trilinear interpolant and ∇φ the derivative of that interpolant,
/// one-sided on the faces between cells.
///
/// Outside the box, with P its nearest point and d the distance to it, φ is hypot(d, φ(P)) and `outside_grid` is set.
/// This is continuous and never more than the distance to a surface inside the box. §6 of the paper proposes φ(P) +
/// d, which can exceed that distance: a cull by it would drop contacts. Where φ(P) is negative the solid may continue
/// beyond the box and nothing is known there; φ is φ(P) + d for continuity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid<S> {
    lattice: Lattice,
    storage: S,
    slope_bound: Parameter,
    band: Parameter,
    error_bound: f64,
    deep_error: f64,
    inside_reaches_box: bool,
}

impl<S: Storage> Grid<S> {
    /// `slope_bound` must be at least what [`measure_slope_bound`] returns. `None` unless it is finite and not
    /// negative.
    pub fn new(lattice: Lattice, storage: S, slope_bound: f64) -> Option<Self> {
        (slope_bound.is_finite() && slope_bound >= 0.0).then_some(Self {
            lattice,
            storage,
            slope_bound: slope_bound.into(),
            band: f64::INFINITY.into(),
            error_bound: f64::INFINITY,
            deep_error: f64::INFINITY,
            inside_reaches_box: false,
        })
    }

    /// The same grid with the same samples in a storage of another type, such as one variant of an enum of storages.
    pub fn with_storage<T: Storage>(&self, storage: T) -> Grid<T> {
        let Self { lattice, slope_bound, band, error_bound, deep_error, inside_reaches_box, .. } = *self;
        Grid { lattice, storage, slope_bound, band, error_bound, deep_error, inside_reaches_box }
    }

    /// The same grid with another band: samples with |φ| ≥ `band` get the status [`beyond_band`](crate::Status::beyond_band).
    /// Infinite unless set, as for dense grids.
    pub fn with_band(self, band: f64) -> Self {
        Self { band: band.into(), ..self }
    }

    /// See [`with_band`](Self::with_band).
    pub fn band(&self) -> f64 {
        self.band.double
    }

    /// The same grid with another bound of |φ − d|, where d, the signed distance to the shape that was sampled, is within the band.
    /// The surface of the shape lies inside the box. Infinite unless set: nothing is known.
    pub fn with_error_bound(self, error_bound: f64) -> Self {
        Self { error_bound, ..self }
    }

    /// The same grid with another bound of |φ − d| beyond the band where d is negative. Infinite unless set.
    pub fn with_deep_error(self, deep_error: f64) -> Self {
        Self { deep_error, ..self }
    }

    /// The bound that [`with_deep_error`](Self::with_deep_error) set.
    pub fn deep_error(&self) -> f64 {
        self.deep_error
    }

    /// The same grid, with or without the inside of the shape reaching the faces of the box, as that of an open mesh may: then nothing is
    /// known of the error outside. False unless set.
    pub fn with_inside_at_box(self, inside_reaches_box: bool) -> Self {
        Self { inside_reaches_box, ..self }
    }

    /// The answer that [`with_inside_at_box`](Self::with_inside_at_box) set.
    pub fn inside_reaches_box(&self) -> bool {
        self.inside_reaches_box
    }

    /// The bound that [`with_error_bound`](Self::with_error_bound) set; one of a region is [`EnclosedSdf::error_bound`].
    pub fn global_error_bound(&self) -> f64 {
        self.error_bound
    }

    /// Lowest sample on the faces of the box. Reads all of them.
    pub fn lowest_boundary_sample(&self) -> f64 {
        lowest_boundary_sample(&self.lattice, &self.storage)
    }

    /// Positions of the nodes.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// The samples.
    pub fn storage(&self) -> &S {
        &self.storage
    }
}

impl<S: Storage> Sdf for Grid<S> {
    #[cfg_attr(feature = "std", inline(always))]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let mut sample = evaluate::evaluate(&self.lattice, &self.storage, point);
        sample.status.beyond_band = R::from_parameter(self.band).le(sample.value.abs());
        sample
    }

    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        let value_at_box = |on_box| self.value(on_box);
        let gradient = smooth::smooth_gradient(&self.lattice, &self.storage, point, value_at_box);
        Sample { gradient, ..self.evaluate(point) }
    }

    /// Reads all samples on the faces of the box: a sample −s there can make φ ≤ level up to level + s outside.
    fn bounds(&self, level: f64) -> Aabb {
        let depth = -self.lowest_boundary_sample().min(0.0);
        self.lattice.bounds().inflate((level + depth).max(0.0))
    }

    #[inline(always)]
    fn slope_bound(&self) -> f64 {
        self.slope_bound.double
    }

    #[inline(always)]
    fn slope_bound_as<R: Real>(&self) -> R {
        R::from_parameter(self.slope_bound)
    }

    /// The origin's largest coordinate: the other end of the grid is no farther from it than the point is.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        let ([x, y, z], ..) = self.lattice.in_numbers::<R>();
        x.abs().max(y.abs()).max(z.abs())
    }

    /// Longest side of the box.
    #[inline(always)]
    fn extent<R: Real>(&self) -> R {
        let ((_, spacing, _), [x, y, z]) = (self.lattice.in_numbers::<R>(), self.lattice.cells());
        spacing * R::from_f64(f64::from(x.max(y).max(z)))
    }

    /// None for several lanes.
    #[inline(always)]
    fn lowest_about<R: Real>(&self, point: Vector3<R>) -> R {
        let mut lowest = R::from_f64(f64::NEG_INFINITY);
        if R::LANES == 1 && S::HAS_BLOCK_BOUNDS {
            lowest.set_lane(0, self.lowest_in_block(point.map(|x| x.lane(0))));
        }
        lowest
    }
}

impl<S: Storage> Grid<S> {
    /// Lower bound of φ in the block of a point's cell.
    #[inline(always)]
    fn lowest_in_block<R: Float>(&self, point: Vector3<R>) -> R {
        let none = R::from_f64(f64::NEG_INFINITY);
        let Some(cell) = evaluate::cell_of(&self.lattice, point) else { return none };
        // All corners are in one block, or there is no bound.
        if brick_slot(cell) != brick_slot(cell.map(|first| first.saturating_add(1))) {
            return none;
        }
        self.storage.block_bounds(cell, cell).map_or(none, |bounds| R::from_stored(bounds.range.lower))
    }
}

impl<S: Storage> EnclosedSdf for Grid<S> {
    const SLOPES_TAKE_LONG: bool = S::SLOPES_TAKE_LONG;

    /// From the block bounds of the nodes of all cells that the box meets, after it was clamped to the grid.
    #[cfg_attr(feature = "std", inline(always))]
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        let global = BoxEnclosure { slope_bound: self.slope_bound(), ..BoxEnclosure::ANYTHING };
        if !S::HAS_BLOCK_BOUNDS {
            return global;
        }
        let Some([first, last]) = self.lattice.nodes_around(region) else { return global };
        let Some(nodes) = self.storage.block_bounds(first, last) else { return global };
        let (lower, upper) = (f64::from(nodes.range.lower), f64::from(nodes.range.upper));
        let slope = f64::from(nodes.slope_bound);
        let bounds = self.lattice.bounds();
        let is_inside = bounds.encloses(region);
        if is_inside {
            return BoxEnclosure { range: Interval { lower, upper }, slope_bound: slope.min(self.slope_bound()) };
        }
        // φ outside is hypot(d, φ(P)) or φ(P) + d, both increasing in d: see `Grid`.
        let gap = |k: usize| (bounds.min[k] - region.max[k]).max(region.min[k] - bounds.max[k]).max(0.0);
        let distance = libm::hypot(libm::hypot(gap(0), gap(1)), gap(2));
        let may_be_negative = lower < 0.0;
        let lower = if may_be_negative { lower + distance } else { libm::hypot(lower, distance) };
        let slope_bound = slope_bound_with_outside(slope, may_be_negative);
        let range = Interval { lower, upper: f64::INFINITY };
        BoxEnclosure { range, slope_bound: slope_bound.min(self.slope_bound()) }
    }

    /// Outside the box φ exceeds d by no more than at its border: φ(x) = √(s² + φ(P)²) for the nearest point P of the box, s away,
    /// and d(x) ≥ √(s² + d(P)²) for a shape inside the box. By how much d exceeds φ there is not known.
    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        let error = self.error_of_cells(region);
        let is_inside = self.lattice.bounds().encloses(region);
        if self.inside_reaches_box && !is_inside {
            return ErrorBound::UNKNOWN;
        }
        let below = if is_inside { error.below } else { f64::INFINITY };
        ErrorBound { fails_outside: [false, !is_inside], below, ..error }
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        match *corners.as_slice() {
            [a, b] => self.minimum_on_segment([a, b]).map(resize),
            [a, b, c] => self.minimum_on_triangle([a, b, c], goal).map(resize),
            _ => None,
        }
    }

    /// Lower bound from samples alone. Outside, a point is as far from the grid as along one
    /// axis at least.
    #[inline(always)]
    fn lowest_in_box(&self, region: &Aabb) -> f64 {
        let nodes = if S::HAS_LOWEST { self.lattice.nodes_around(region) } else { None };
        let Some(lowest) = nodes.and_then(|[first, last]| self.storage.lowest(first, last)) else {
            return f64::NEG_INFINITY;
        };
        let (bounds, lowest) = (self.lattice.bounds(), f64::from(lowest));
        let gap = |k: usize| (bounds.min[k] - region.max[k]).max(region.min[k] - bounds.max[k]);
        let distance = gap(0).max(gap(1)).max(gap(2)).max(0.0);
        if lowest < 0.0 { lowest + distance } else { lowest.max(distance) }
    }

    /// φ(c) + ∇φ(c)·(x − c) − φ(x) ≤ ½ (upper − lower)·s, with all gradients in \[lower, upper\] and s the box's
    /// extents.
    fn linearization_error(&self, region: &Aabb) -> f64 {
        let Some(GradientRange { gradients, .. }) = self.gradient_range::<f64>(region) else { return f64::INFINITY };
        let spread = gradients.upper - gradients.lower;
        spread.dot(&Vector3::from(region.extents())) * 0.5
    }

    /// Mean value form of interval arithmetic (Moore 1966, "Interval Analysis", ch. 6) if the hull meets few cells:
    /// φ(x) ∈ φ(about) + \[∇φ\]·(x − about), intersected with the range of the samples. Its error shrinks with the
    /// square of the hull's size, that of a bound from the slope only with the size.
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let Some(inside) = self.gradient_range::<R>(&Aabb::from_corners(corners)) else {
            return Enclosure::from_slope(self, about, corners);
        };
        let value = self.value(about);
        let (mut fall, mut rise) = (R::zero(), R::zero());
        for corner in corners {
            let change = inside.gradients.change_along(corner - about);
            (fall, rise) = (Real::min(fall, change.lower), Real::max(rise, change.upper));
        }
        let unrounded = Enclosure {
            value,
            range: Interval {
                lower: Real::max(value + fall, inside.range.lower),
                upper: Real::min(value + rise, inside.range.upper),
            },
            gradients: inside.gradients,
        };
        unrounded.widen(rounding(FieldScale::new(self), about, max_distance(about, corners), value))
    }
}

/// The same minimum as one on a simplex of `N` corners, where `N` = `M` at run time.
#[inline(always)]
fn resize<R: Float, const M: usize, const N: usize>(minimum: ExactMinimum<R, M>) -> ExactMinimum<R, N> {
    let mut weights = [R::zero(); N];
    weights.iter_mut().zip(minimum.weights).for_each(|(weight, known)| *weight = known);
    ExactMinimum { weights, value: minimum.value, lower_bound: minimum.lower_bound, evaluations: minimum.evaluations }
}
