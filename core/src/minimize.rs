//! Where on a simplex a field is least: the local optimization of Macklin et al. 2020, §3 and §4.
//!
//! Every method starts at the corner with the least value, keeps the best point it has seen, and stops by itself or when
//! its budget is spent. None but [`Certified`] and [`AllMinima`] know whether another, lower minimum exists. Of the others
//! [`Newton`] takes the fewest evaluations, and [`FrankWolfe`] the least time on a field that is quick to answer.

mod all_minima;
mod certified;
mod curvature;
mod cuts;
mod frank_wolfe;
mod golden_section;
mod line_search;
mod newton;
mod point_sampling;
mod projected_gradient;
mod search;
mod sub_simplex;

pub use all_minima::{AllMinima, Found, Place};
pub use certified::Certified;
pub use frank_wolfe::FrankWolfe;
pub use golden_section::GoldenSection;
pub use line_search::LineSearch;
pub use newton::Newton;
pub use point_sampling::PointSampling;
pub use projected_gradient::ProjectedGradient;

use nalgebra::Vector3;

use crate::number::kernel::LaneBundle;
use crate::number::{Mask, Real};
use crate::{EnclosedSdf, Sample, Simplex, Status};

/// A method that looks for the least value of a field on simplices of `N` corners.
///
/// ```
/// use sdf_core::minimize::{FrankWolfe, Minimizer};
/// use sdf_core::{Simplex, nalgebra::Vector3, shapes::Sphere};
/// let segment = Simplex { corners: [Vector3::new(-2.0, 0.0, 3.0), Vector3::new(2.0, 0.0, 3.0)] };
/// let least = FrankWolfe::default().minimize(&Sphere::new(1.0).unwrap(), &segment);
/// assert!((least.sample.value - 2.0_f64).abs() < 1e-2);
/// ```
pub trait Minimizer<const N: usize> {
    /// Whether it searches many simplices faster side by side in [`Lanes`](crate::Lanes) than one by one: where each takes
    /// the same steps as the others it does, where all wait for the one that takes most it does not.
    const LOCKSTEP: bool = false;

    /// Whether a search of one simplex works side by side within itself, so that it pays to compile it for wide vectors.
    const USES_SIMD: bool = Self::LOCKSTEP;

    /// The same method with so small a budget that it is worth a try on many simplices side by side, before the whole budget is
    /// spent on those that it leaves over. Where it converges it answers what the method itself does, bit for bit.
    fn quick_pass(&self) -> Option<Self>
    where
        Self: Sized,
    {
        None
    }

    /// All corners must be finite and within ±[`Real::MAX_COORDINATE`].
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N>;

    /// The same where the least value that it finds is at most `level`. Where it is not, a method that can tell may stop as
    /// soon as it is certain that none is.
    #[inline(always)]
    fn minimize_below<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>, _level: R) -> Minimum<R, N> {
        self.minimize(field, simplex)
    }
}

/// The least value that was seen, and where.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Minimum<R: Real, const N: usize> {
    /// Barycentric: none negative, their sum one.
    pub weights: [R; N],
    pub point: Vector3<R>,
    pub sample: Sample<R>,
    /// No point of the simplex has a value below this, by the field's slope bound and the sample.
    pub lower_bound: R,
    /// At how many points the field was asked; a whole number.
    pub evaluations: R,
    /// The method's own condition for a local minimum was met before its budget was spent.
    pub converged: R::Mask,
}

/// All zero: room for one that is still to be found.
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
