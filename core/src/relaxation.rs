//! Relaxations: affine lower and upper bounds of a field on a simplex, with errors of second order in its size.
//!
//! An affine function ℓ is given by its values at the corners: ℓ(Σ w_k x_k) = Σ w_k ℓ_k. Its minimum is min_k ℓ_k. So
//! ℓ ≤ φ bounds φ, and fields combine corner by corner: McCormick 1976, "Computability of Global Solutions to
//! Factorable Nonconvex Programs", in the affine form of Mitsos, Chachuat and Barton 2009, "McCormick-Based Relaxations
//! of Algorithms".
//!
//! | u | lower bound | upper bound |
//! |---|---|---|
//! | convex | a tangent plane | the chord: the affine function with the values of u at the corners |
//! | max(u, v) | any mean (1 − λ) ℓ_u + λ ℓ_v: the one with the highest minimum, `highest_mean` | larger value at each corner |
//! | G(u₁, …), G convex | Σ ∂_i G (u_i), with ℓ_i where ∂_i G ≥ 0, else the upper bound | chord of G's largest value |
//!
//! A tangent plane and a chord differ from a smooth u by at most ½ ‖∇²u‖ d², with d the diameter of the simplex (Taylor).
//! A bound by the slope alone is off by |∇u| d.

mod affine;

use nalgebra::{Matrix3, Vector3};

pub(crate) use affine::{AffineBounds, highest_mean, largest, lowest_mean, smallest, weighted_lower};

use crate::number::interval::Interval;
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::max_distance;
use crate::{Enclosure, GradientBox, Sdf};

/// Affine bounds of a field on the convex hull of one to four points, rounding included, and the enclosure that they
/// give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxation<R: Real> {
    /// Bounds of φ and ∇φ on the hull.
    pub enclosure: Enclosure<R>,
    /// Values at the corners of an affine function that is nowhere above φ. Unused places repeat the first corner.
    pub lower: [R; 4],
    /// Values at the corners of an affine function that is nowhere below φ.
    pub upper: [R; 4],
}

impl<R: Float> Relaxation<R> {
    /// Mean value form (Moore 1966): φ(about) + \[∇φ\]·(x − about) is concave below and convex above, so its values at
    /// the corners are those of affine bounds. Or the range itself, where that is narrower.
    pub fn from_enclosure<F: Sdf + ?Sized>(
        field: &F,
        enclosure: Enclosure<R>,
        about: Vector3<R>,
        corners: &[Vector3<R>],
    ) -> Self {
        let Enclosure { value, range, gradients } = enclosure;
        let constant = Self { enclosure, lower: [range.lower; 4], upper: [range.upper; 4] };
        let slopes = gradients.lower.iter().chain(&gradients.upper);
        let steepest = slopes.fold(R::zero(), |steepest, slope| Real::max(steepest, slope.abs()));
        if !Real::is_finite(steepest) {
            return constant;
        }
        let scale = FieldScale { slope_bound: steepest, magnitude: field.magnitude() };
        let rounding = rounding(scale, about, max_distance(about, corners), value);
        let changes = at_corners(corners, |corner| gradients.change_along(corner - about));
        let lower = highest_mean(constant.lower, changes.map(|change| value + change.lower - rounding));
        let upper = lowest_mean(constant.upper, changes.map(|change| value + change.upper + rounding));
        Self { enclosure, lower, upper }
    }

    /// Bounds of a convex φ: two tangent planes below, the chord above.
    pub fn from_convex<F: Sdf + ?Sized>(field: &F, about: Vector3<R>, corners: &[Vector3<R>]) -> Self {
        let (value, lower) = tangent_planes(field, about, corners);
        let upper = at_corners(corners, |corner| field.value(corner));
        let gradients = GradientBox::from_slope(field.slope_bound());
        Self::new(value, lower, upper, gradients).widen_by_rounding(field, about, corners)
    }

    /// Bounds of a shape with lengths up to `size`, computed in the operations of its formula.
    pub(crate) fn from_affine<F: Sdf>(
        field: &F,
        bounds: AffineBounds<R>,
        size: f64,
        about: Vector3<R>,
        corners: &[Vector3<R>],
    ) -> Self {
        let (value, slope_bound) = (field.value(about), field.slope_bound());
        let unrounded = Self::new(value, bounds.lower, bounds.upper, GradientBox::from_slope(slope_bound));
        let length = Real::max(max_distance(about, corners), R::from_f64(size));
        unrounded.widen(rounding(FieldScale::new(field), about, length, value))
    }

    fn new(value: R, lower: [R; 4], upper: [R; 4], gradients: GradientBox<R>) -> Self {
        let range = Interval { lower: smallest(lower), upper: largest(upper) };
        Self { enclosure: Enclosure { value, range, gradients }, lower, upper }
    }

    /// The same with the enclosure's range no wider than that of the affine bounds.
    pub(crate) fn tighten(self) -> Self {
        let range = Interval {
            lower: Real::max(self.enclosure.range.lower, smallest(self.lower)),
            upper: Real::min(self.enclosure.range.upper, largest(self.upper)),
        };
        Self { enclosure: Enclosure { range, ..self.enclosure }, ..self }
    }

    /// Bounds of −φ.
    pub fn negate(self) -> Self {
        Self {
            enclosure: self.enclosure.negate(),
            lower: self.upper.map(|upper| -upper),
            upper: self.lower.map(|lower| -lower),
        }
    }

    /// Bounds of the minimum of two fields.
    pub fn min(self, other: Self) -> Self {
        let lower = core::array::from_fn(|k| Real::min(self.lower[k], other.lower[k]));
        let upper = lowest_mean(self.upper, other.upper);
        Self { enclosure: self.enclosure.min(other.enclosure), lower, upper }.tighten()
    }

    /// Bounds of the maximum of two fields: max(a, b) = −min(−a, −b).
    pub fn max(self, other: Self) -> Self {
        self.negate().min(other.negate()).negate()
    }

    /// The same for a φ that is nowhere below `least`.
    pub fn raise(self, least: R) -> Self {
        Self { lower: highest_mean(self.lower, [least; 4]), ..self }.tighten()
    }

    /// Bounds of φ + `distance`.
    pub fn shift(self, distance: R) -> Self {
        Self {
            enclosure: self.enclosure.shift(distance),
            lower: self.lower.map(|lower| lower + distance),
            upper: self.upper.map(|upper| upper + distance),
        }
    }

    /// Bounds of φ(`jacobian` · x) · `scale`. Corners keep their weights.
    pub fn pull_back(self, jacobian: &Matrix3<R>, scale: R) -> Self {
        Self {
            enclosure: self.enclosure.pull_back(jacobian, scale),
            lower: self.lower.map(|lower| lower * scale),
            upper: self.upper.map(|upper| upper * scale),
        }
    }

    /// The same with values that may be off by the rounding of the field's formula.
    pub(crate) fn widen_by_rounding<F: Sdf + ?Sized>(
        self,
        field: &F,
        about: Vector3<R>,
        corners: &[Vector3<R>],
    ) -> Self {
        let distance = max_distance(about, corners);
        self.widen(rounding(FieldScale::new(field), about, distance, self.enclosure.value))
    }

    /// The same with values that may be off by `rounding`.
    pub fn widen(self, rounding: R) -> Self {
        Self {
            enclosure: self.enclosure.widen(rounding),
            lower: self.lower.map(|lower| lower - rounding),
            upper: self.upper.map(|upper| upper + rounding),
        }
    }
}

/// φ(about) of a convex φ, and the values at the corners of an affine lower bound: the highest mean of two tangent
/// planes (Kelley 1960). The second touches φ at the corner where the first is lowest: across a crease of φ, such as the
/// medial surface in a box, the one falls and the other rises.
pub(crate) fn tangent_planes<R: Float, F: Sdf + ?Sized>(
    field: &F,
    about: Vector3<R>,
    corners: &[Vector3<R>],
) -> (R, [R; 4]) {
    let sample = field.evaluate(about);
    let plane = at_corners(corners, |corner| sample.value + sample.gradient.dot(&(corner - about)));
    let lowest = smallest(plane);
    let Some((corner, _)) = corners.iter().zip(plane).find(|(_, value)| *value <= lowest) else {
        return (sample.value, plane);
    };
    let touching = field.evaluate(*corner);
    let other = at_corners(corners, |to| touching.value + touching.gradient.dot(&(to - corner)));
    (sample.value, highest_mean(plane, other))
}

/// A function's values at one to four corners. Unused places repeat the first.
pub(crate) fn at_corners<R: Float, T: Copy>(corners: &[Vector3<R>], value: impl Fn(Vector3<R>) -> T) -> [T; 4] {
    let mut values = [value(corners.first().copied().unwrap_or_else(Vector3::zeros)); 4];
    values.iter_mut().zip(corners).skip(1).for_each(|(slot, corner)| *slot = value(*corner));
    values
}
