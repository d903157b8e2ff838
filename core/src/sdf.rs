//! The trait of all fields, [`Sdf`], and the result of an evaluation, [`Sample`].

mod plug_in;
mod pointers;
mod sample;

use nalgebra::Vector3;

pub use plug_in::DynSdf;
pub use sample::{Sample, Status};

use crate::Aabb;
use crate::number::{Float, Mask, Real};

/// A field of signed distances: negative inside, zero on the surface, positive outside, in the unit of the points.
///
/// Implement [`evaluate`](Self::evaluate), [`bounds`](Self::bounds) and [`slope_bound`](Self::slope_bound); the rest has
/// defaults. They are generic over the number type, so one `impl` serves scalars, lanes and dual numbers. Searches also ask
/// for an [`EnclosedSdf`](crate::EnclosedSdf), whose methods all have defaults:
///
/// ```
/// use sdf_core::{Aabb, EnclosedSdf, Real, Sample, Sdf, nalgebra::Vector3};
///
/// /// Everything below z = 0.
/// struct Ground;
///
/// impl Sdf for Ground {
///     fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
///         Sample::new(point.z, Vector3::z())
///     }
///     fn bounds(&self, level: f64) -> Aabb {
///         Aabb { max: [f64::INFINITY, f64::INFINITY, level], ..Aabb::EVERYWHERE }
///     }
///     fn slope_bound(&self) -> f64 {
///         1.0
///     }
/// }
///
/// impl EnclosedSdf for Ground {}
///
/// assert_eq!(Ground.sample(Vector3::new(0.0_f32, 2.0, -0.5)).value, -0.5);
/// ```
pub trait Sdf {
    /// Is [`evaluate_smooth`](Self::evaluate_smooth) the same as [`evaluate`](Self::evaluate), so that nobody need ask for both?
    const IS_SMOOTH_AS_IT_IS: bool = false;

    /// φ and ∇φ at a point whose coordinates are finite and within ±[`Real::MAX_COORDINATE`]. Any other point may give NaN;
    /// [`sample`](Self::sample) takes those too.
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R>;

    /// A box that holds every point with φ ≤ level.
    fn bounds(&self, level: f64) -> Aabb;

    /// Lipschitz constant of the field: |φ(x) − φ(y)| ≤ slope_bound · |x − y|. 1 for a true distance.
    fn slope_bound(&self) -> f64;

    /// [`slope_bound`](Self::slope_bound) in any number type. A grid does not convert it, for processors without doubles.
    #[inline(always)]
    fn slope_bound_as<R: Real>(&self) -> R {
        R::from_f64(self.slope_bound())
    }

    /// Largest length that an evaluation near the surface adds to or subtracts from the point's coordinates: the translation of a
    /// placed field, the origin of a grid. Values are rounded by ε · slope bound · this, however near to zero the point's own coordinates
    /// are; culls and lower bounds grant it.
    ///
    /// By default the largest finite coordinate of the shape's box, [`bounds`](Self::bounds) at level 0: enough for a formula whose
    /// centres and lengths are no larger.
    fn magnitude<R: Real>(&self) -> R {
        R::from_f64(self.bounds(0.0).largest_finite_coordinate())
    }

    /// Length of the surface: the longest side of the box around it, or around its largest part; infinite where it has no end.
    ///
    /// A certified search of an element that is larger takes its tolerance as a fraction of this length. By default from
    /// [`bounds`](Self::bounds).
    fn extent<R: Real>(&self) -> R {
        R::from_f64(self.bounds(0.0).longest_side())
    }

    /// φ alone: the same bits as [`evaluate`](Self::evaluate), under the same condition.
    #[inline(always)]
    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        self.evaluate(point).value
    }

    /// Lower bound of φ in a region about a point, to within the rounding of a value there, and in less time than that takes; −∞ where
    /// there is none. A grid with block bounds has that of the block in which the point's cell lies. A union passes over parts by it.
    #[inline(always)]
    fn lowest_about<R: Real>(&self, _point: Vector3<R>) -> R {
        R::from_f64(f64::NEG_INFINITY)
    }

    /// φ, and in place of ∇φ a gradient that is continuous wherever φ's own is so but for its interpolation: what a contact's
    /// normal is made of. A grid averages its gradient over a cell about the point; closed forms return ∇φ itself.
    ///
    /// The condition is that of [`evaluate`](Self::evaluate), and the value has the same bits. A field that wraps another asks
    /// that one's `evaluate_smooth`.
    #[inline]
    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        self.evaluate(point)
    }

    /// φ and ∇φ at any point. The status is [`not_finite`](Status::not_finite), the value MAX_COORDINATE and the gradient
    /// zero where the point is not finite or exceeds [`Real::MAX_COORDINATE`], here or in a frame that the field is placed
    /// in, and where stored samples are not finite. In a part of a combination the other part may hide that.
    fn sample<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let [x, y, z] = [point.x, point.y, point.z].map(Real::is_representable);
        let is_representable = x & y & z;
        let sample = self.evaluate(point.map(|x| R::select(is_representable, x, R::zero())));
        let is_valid = sample.gradient.iter().fold(sample.value.is_finite(), |all, slope| all & slope.is_finite());
        let refusal = Sample {
            value: R::from_f64(R::MAX_COORDINATE),
            gradient: Vector3::zeros(),
            status: Status { not_finite: !R::Mask::NONE, ..Status::GOOD },
        };
        Sample::select(is_representable & is_valid, sample, refusal)
    }
}
