//! Arithmetic of affine bounds: how the formula of a shape becomes a bound of the shape. See the table in
//! `relaxation`.

use core::array::from_fn;

use nalgebra::Vector3;

use super::at_corners;
use crate::number::{Float, Real};

#[cfg(test)]
mod tests;

/// Affine bounds of a function u on a simplex, by their values at its corners; and u at one point, where nonlinear
/// operations put their tangent planes. Rounding is not included.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AffineBounds<R> {
    pub value: R,
    pub lower: [R; 4],
    pub upper: [R; 4],
}

impl<R: Float> AffineBounds<R> {
    /// The coordinates x, y and z.
    pub fn coordinates(about: Vector3<R>, corners: &[Vector3<R>]) -> [Self; 3] {
        let points = at_corners(corners, |corner| corner);
        from_fn(|axis| {
            let at = points.map(|point| point[axis]);
            Self { value: about[axis], lower: at, upper: at }
        })
    }

    pub fn constant(value: R) -> Self {
        Self { value, lower: [value; 4], upper: [value; 4] }
    }

    /// Lower bound of u on the simplex.
    pub fn min_value(&self) -> R {
        smallest(self.lower)
    }

    /// Upper bound of u on the simplex.
    pub fn max_value(&self) -> R {
        largest(self.upper)
    }

    /// u + `distance`.
    pub fn shift(self, distance: R) -> Self {
        Self {
            value: self.value + distance,
            lower: self.lower.map(|lower| lower + distance),
            upper: self.upper.map(|upper| upper + distance),
        }
    }

    /// u · `factor`; a negative factor swaps the bounds.
    pub fn scale(self, factor: R) -> Self {
        let (lower, upper) = if factor < R::zero() { (self.upper, self.lower) } else { (self.lower, self.upper) };
        Self {
            value: self.value * factor,
            lower: lower.map(|lower| lower * factor),
            upper: upper.map(|upper| upper * factor),
        }
    }

    /// u + v.
    pub fn add(self, other: Self) -> Self {
        Self {
            value: self.value + other.value,
            lower: from_fn(|k| self.lower[k] + other.lower[k]),
            upper: from_fn(|k| self.upper[k] + other.upper[k]),
        }
    }

    /// √(Σ u_i²). Lower bound: Σ g_i u_i, where g is the unit vector along u at `value` (Cauchy-Schwarz), and zero. Upper
    /// bound: the chord of √(Σ max(|lower_i|, |upper_i|)²), which is convex.
    pub fn norm<const M: usize>(parts: [Self; M]) -> Self {
        let length = |values: [R; M]| values.iter().fold(R::zero(), |sum, value| sum + *value * *value).sqrt();
        let value = length(parts.map(|part| part.value));
        let first = from_fn(|i| if i == 0 { R::one() } else { R::zero() });
        let unit: [R; M] = if value.is_negligible() { first } else { parts.map(|part| part.value / value) };
        Self {
            value,
            lower: highest_mean(weighted_lower(&parts, unit), [R::zero(); 4]),
            upper: from_fn(|k| length(parts.map(|part| Real::max(part.lower[k].abs(), part.upper[k].abs())))),
        }
    }

    /// |u| = max(u, −u). Zero is a lower bound as well.
    pub fn abs(self) -> Self {
        let negative = self.scale(-R::one());
        Self {
            value: self.value.abs(),
            lower: highest_mean(highest_mean(self.lower, negative.lower), [R::zero(); 4]),
            upper: from_fn(|k| Real::max(self.lower[k].abs(), self.upper[k].abs())),
        }
    }
}

/// Σ g_i u_i from below: by u_i's lower bound where g_i ≥ 0, else by its upper bound.
pub(crate) fn weighted_lower<R: Float, const M: usize>(parts: &[AffineBounds<R>; M], weights: [R; M]) -> [R; 4] {
    let mut sum = [R::zero(); 4];
    for (part, weight) in parts.iter().zip(weights) {
        let term = part.scale(weight);
        sum.iter_mut().zip(term.lower).for_each(|(sum, term)| *sum += term);
    }
    sum
}

/// The affine function (1 − λ) a + λ b, 0 ≤ λ ≤ 1, with the highest minimum, which is that of max(a, b) on the simplex (a
/// linear program and its dual). λ is 0, 1 or where two corners have the same value.
pub(crate) fn highest_mean<R: Float>(a: [R; 4], b: [R; 4]) -> [R; 4] {
    let (lowest_a, lowest_b) = (smallest(a), smallest(b));
    // Where b is below a at the lowest corner of a, every mean of the two is lower there.
    if (0..4).any(|k| a[k] <= lowest_a && b[k] <= a[k]) {
        return a;
    }
    if (0..4).any(|k| b[k] <= lowest_b && a[k] <= b[k]) {
        return b;
    }
    let (mut highest, mut best) = if lowest_a < lowest_b { (lowest_b, b) } else { (lowest_a, a) };
    for i in 0..4 {
        for j in 0..i {
            let (a_gap, b_gap) = (a[i] - a[j], b[j] - b[i]);
            // NaN where both are parallel, and then not better.
            let weight = a_gap / (a_gap + b_gap);
            if !(R::zero() <= weight && weight <= R::one()) {
                continue;
            }
            let mean = from_fn(|k| a[k] * (R::one() - weight) + b[k] * weight);
            if highest < smallest(mean) {
                (highest, best) = (smallest(mean), mean);
            }
        }
    }
    best
}

/// The affine function between a and b with the lowest maximum.
pub(crate) fn lowest_mean<R: Float>(a: [R; 4], b: [R; 4]) -> [R; 4] {
    highest_mean(a.map(|a| -a), b.map(|b| -b)).map(|value| -value)
}

pub(crate) fn smallest<R: Float>(values: [R; 4]) -> R {
    let [a, b, c, d] = values;
    Real::min(Real::min(a, b), Real::min(c, d))
}

pub(crate) fn largest<R: Float>(values: [R; 4]) -> R {
    let [a, b, c, d] = values;
    Real::max(Real::max(a, b), Real::max(c, d))
}
