//! Minimizers: where on a simplex is φ lowest? (Macklin et al. 2020, "Local Optimization for Robust Signed Distance
//! Field Collision", §3 and §4, and methods that find more.)
//!
//! | method | finds | file |
//! |---|---|---|
//! | [`Certified`] | the global minimum, with a proven lower bound | `certified` |
//! | [`AllMinima`] | every isolated minimum | `all_minima` |
//! | [`Newton`] | a local minimum, on faces more often the lowest | `newton`, `cuts`, `curvature` |
//! | [`ProjectedGradient`] | a local minimum, in the shortest time on fields that are cheap to evaluate | `projected_gradient` |
//! | [`FrankWolfe`], [`GoldenSection`] | a local minimum | one each |
//! | [`PointSampling`] | the lowest of fixed points | `point_sampling` |
//!
//! Every local method starts at the lowest corner and keeps the best point so far (`descent_state`). It stops by its
//! own condition, or when its budget is spent. `sub_simplex` holds the parts that a subdivision cuts.

mod all_minima;
mod certified;
mod curvature;
mod cuts;
mod descent_state;
mod frank_wolfe;
mod golden_section;
mod newton;
mod point_sampling;
mod projected_gradient;
mod sub_simplex;

pub use all_minima::{AllMinima, MinimaSummary, SimplexCell};
pub use certified::Certified;
pub(crate) use certified::reference_length;
pub use frank_wolfe::FrankWolfe;
pub use golden_section::GoldenSection;
pub use newton::Newton;
pub use point_sampling::PointSampling;
pub use projected_gradient::ProjectedGradient;

use nalgebra::Vector3;

use crate::number::kernel::LaneBundle;
use crate::number::{Mask, Real};
use crate::{EnclosedSdf, Sample, Simplex, Status};

/// A method that minimizes a field on simplices of `N` corners.
///
/// ```
/// use sdf_core::minimize::{FrankWolfe, Minimizer};
/// use sdf_core::{Simplex, nalgebra::Vector3, shapes::Sphere};
/// let segment = Simplex { corners: [Vector3::new(-2.0, 0.0, 3.0), Vector3::new(2.0, 0.0, 3.0)] };
/// let minimum = FrankWolfe::default().minimize(&Sphere::new(1.0).unwrap(), &segment);
/// assert!((minimum.sample.value - 2.0_f64).abs() < 1e-2);
/// ```
pub trait Minimizer<const N: usize> {
    /// `true` if several simplices in SIMD lanes ([`Lanes`](crate::Lanes)) run faster than one at a time: so for
    /// methods whose steps are alike and cheap, not for those that branch, whose lanes wait for the slowest.
    const LOCKSTEP: bool = false;

    /// `true` if the search of one simplex gains from SIMD instructions itself, so that it pays to compile it for wide
    /// vectors.
    const USES_SIMD: bool = Self::LOCKSTEP;

    /// A cheap first pass in lanes: the same method with a small budget. Where it converges, its answer is that of the
    /// method itself, bit for bit. The other simplices are searched again with the full budget.
    fn quick_pass(&self) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// Minimizes φ on a simplex whose corners are finite and within ±[`Real::MAX_COORDINATE`].
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N>;

    /// [`minimize`](Self::minimize), for a caller who needs only minima of at most `level`. A method with a lower bound
    /// may stop once every value is proven above `level`; it then returns the lowest value so far.
    #[inline(always)]
    fn minimize_below<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>, _level: R) -> Minimum<R, N> {
        self.minimize(field, simplex)
    }

    /// [`minimize_below`](Self::minimize_below), for a caller who knows a point that is probably near the minimum, such as that of
    /// the last frame. Local descents start from it where it is lower than the corners, for one evaluation more, and never end
    /// above it. Other methods take no notice.
    #[inline(always)]
    fn minimize_from<R: Real, F: EnclosedSdf>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        level: R,
        _start: [R; N],
    ) -> Minimum<R, N> {
        self.minimize_below(field, simplex, level)
    }
}

/// The lowest point found on a simplex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Minimum<R: Real, const N: usize> {
    /// Barycentric weights: not negative, with sum 1.
    pub weights: [R; N],
    /// The point of the weights.
    pub point: Vector3<R>,
    /// φ and ∇φ at the point.
    pub sample: Sample<R>,
    /// Lower bound of φ on the simplex: from the search, or from the sample and the slope bound.
    pub lower_bound: R,
    /// Number of evaluations of the field, a whole number.
    pub evaluations: R,
    /// The method's condition for a minimum was met before its budget was spent.
    pub converged: R::Mask,
}

/// All zero: fills buffers.
impl<R: Real, const N: usize> Default for Minimum<R, N> {
    fn default() -> Self {
        Self {
            weights: [R::zero(); N],
            point: Vector3::zeros(),
            sample: Sample { value: R::zero(), gradient: Vector3::zeros(), status: Status::GOOD },
            lower_bound: R::zero(),
            evaluations: R::zero(),
            converged: R::Mask::NONE,
        }
    }
}

impl<R: Real, const N: usize> Minimum<R, N> {
    /// The minimum in one of the lanes.
    #[inline]
    pub(crate) fn lane(&self, lane: usize) -> Minimum<R::Lane, N> {
        Minimum {
            weights: self.weights.lane(lane),
            point: self.point.lane(lane),
            sample: self.sample.lane(lane),
            lower_bound: self.lower_bound.lane(lane),
            evaluations: self.evaluations.lane(lane),
            converged: self.converged.lane(lane),
        }
    }

    fn set_lane(&mut self, lane: usize, minimum: Minimum<R::Lane, N>) {
        self.weights.iter_mut().zip(minimum.weights).for_each(|(all, one)| all.set_lane(lane, one));
        self.point.iter_mut().zip(&minimum.point).for_each(|(all, one)| all.set_lane(lane, *one));
        self.sample.set_lane(lane, minimum.sample);
        self.lower_bound.set_lane(lane, minimum.lower_bound);
        self.evaluations.set_lane(lane, minimum.evaluations);
        self.converged.set_lane(lane, minimum.converged);
    }
}
