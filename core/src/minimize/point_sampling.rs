//! Fixed sample points on a simplex: no search, but the baseline that searches are compared with.

use nalgebra::Vector3;

use super::descent_state::DescentState;
use super::{Minimizer, Minimum};
use crate::number::kernel::{LaneKernel, run_into};
use crate::number::{Mask, Real};
use crate::{EnclosedSdf, Simplex};

/// The lowest of a fixed set of points: the baseline of the paper's §8.3, not a minimizer. It never converges.
///
/// On a triangle these are the triangular van der Corput points (Basu and Owen 2015, "Low discrepancy constructions in
/// the triangle", §3): the base-4 digits of the point's number choose the middle or a corner quarter of the triangle,
/// again and again. On a segment they are the middles of equal parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointSampling {
    /// Number of points. The paper takes 4, 16 and 64: powers of 4 cover a triangle evenly. 0 counts as 1 without corners.
    pub samples: u32,
    /// Take the corners, too, before the points. The paper does not; programs that collide vertices take them alone.
    pub corners: bool,
}

impl Default for PointSampling {
    fn default() -> Self {
        Self { samples: 16, corners: false }
    }
}

impl Minimizer<3> for PointSampling {
    const LOCKSTEP: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 3>) -> Minimum<R, 3> {
        lowest_of(field, simplex, self, |number| {
            WEIGHT_TABLE.get(number as usize).copied().unwrap_or_else(|| triangle_weights(number))
        })
    }
}

impl Minimizer<2> for PointSampling {
    const LOCKSTEP: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 2>) -> Minimum<R, 2> {
        lowest_of(field, simplex, self, |number| {
            let t = (f64::from(number) + 0.5) / f64::from(self.samples.max(1));
            [1.0 - t, t]
        })
    }
}

impl Minimizer<1> for PointSampling {
    const LOCKSTEP: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 1>) -> Minimum<R, 1> {
        lowest_of(field, simplex, &Self { samples: 1, corners: false }, |_| [1.0])
    }
}

/// Compares values alone. The lowest point is evaluated once more for its gradient, and counted once.
#[inline(always)]
fn lowest_of<R: Real, F: EnclosedSdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
    sampling: &PointSampling,
    point_weights: impl Fn(u32) -> [f64; N],
) -> Minimum<R, N> {
    let corners = if sampling.corners { N as u32 } else { 0 };
    let count = corners.saturating_add(sampling.samples).max(1);
    let weights = |number: u32| match number.checked_sub(corners) {
        Some(number) => point_weights(number),
        None => core::array::from_fn(|corner| if corner as u32 == number { 1.0 } else { 0.0 }),
    };
    let mut current = weights(0);
    let first = current.map(R::from_f64);
    let point = simplex.point(first);
    let mut value = field.value(point);
    let mut after = ((first, [value]), point);
    for number in 1..count {
        let next = weights(number);
        run_into(&Step { current, next }, (*simplex, after.0, [value]), &mut after);
        (current, value) = (next, field.value(after.1));
    }
    run_into(&Step { current, next: current }, (*simplex, after.0, [value]), &mut after);
    let ((best, _), _) = after;
    let mut state = DescentState::new(field, simplex, best);
    state.evaluations = R::from_f64(f64::from(count));
    state.finish(R::Mask::NONE)
}

/// From the best weights and value so far, and the value at the current weights, to the better of both and the next
/// point.
struct Step<const N: usize> {
    current: [f64; N],
    next: [f64; N],
}

impl<const N: usize> LaneKernel for Step<N> {
    type From<R: Real> = (Simplex<R, N>, ([R; N], [R; 1]), [R; 1]);
    type To<R: Real> = (([R; N], [R; 1]), Vector3<R>);

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, (mut weights, [lowest]), [value]): Self::From<R>) -> Self::To<R> {
        let is_lower = value.lt(lowest);
        for k in 0..N {
            weights[k] = R::select(is_lower, R::from_f64(self.current[k]), weights[k]);
        }
        ((weights, [R::select(is_lower, value, lowest)]), simplex.point(self.next.map(R::from_f64)))
    }
}

/// [`triangle_weights`] of the first 64 points, the most that the paper takes.
const WEIGHT_TABLE: [[f64; 3]; 64] = {
    let mut table = [[0.0; 3]; 64];
    let mut number = 0;
    while number < table.len() {
        table[number] = triangle_weights(number as u32);
        number += 1;
    }
    table
};

/// Barycentric weights of the van der Corput point with this number.
const fn triangle_weights(number: u32) -> [f64; 3] {
    let mut triangle = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let mut digits = number;
    while digits > 0 {
        let [a, b, c] = triangle;
        let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
        triangle = match digits % 4 {
            0 => [bc, ca, ab],
            1 => [a, ab, ca],
            2 => [ab, b, bc],
            _ => [ca, bc, c],
        };
        digits /= 4;
    }
    let [[a0, a1, a2], [b0, b1, b2], [c0, c1, c2]] = triangle;
    [(a0 + b0 + c0) / 3.0, (a1 + b1 + c1) / 3.0, (a2 + b2 + c2) / 3.0]
}

const fn middle([a0, a1, a2]: [f64; 3], [b0, b1, b2]: [f64; 3]) -> [f64; 3] {
    [0.5 * (a0 + b0), 0.5 * (a1 + b1), 0.5 * (a2 + b2)]
}
