//! Fixed sample points on a simplex: no search, but the baseline that searches are compared with.

use nalgebra::Vector3;

use super::descent_state::DescentState;
use super::{Minimizer, Minimum};
use crate::number::kernel::{LaneKernel, run_into};
use crate::number::{Mask, Parameter, Real};
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
        lowest_of(field, simplex, self, weights_of)
    }
}

impl Minimizer<2> for PointSampling {
    const LOCKSTEP: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 2>) -> Minimum<R, 2> {
        lowest_of(field, simplex, self, |number| {
            let samples = self.samples.max(1);
            let double = (f64::from(number) + 0.5) / f64::from(samples);
            let single = (number as f32 + 0.5) / samples as f32;
            let t = R::from_parameter(Parameter { double, single });
            [R::one() - t, t]
        })
    }
}

impl Minimizer<1> for PointSampling {
    const LOCKSTEP: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 1>) -> Minimum<R, 1> {
        lowest_of(field, simplex, &Self { samples: 1, corners: false }, |_| [R::one()])
    }
}

/// Compares values alone. The lowest point is evaluated once more for its gradient, and counted once.
#[inline(always)]
fn lowest_of<R: Real, F: EnclosedSdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
    sampling: &PointSampling,
    point_weights: impl Fn(u32) -> [R; N],
) -> Minimum<R, N> {
    let corners = if sampling.corners { N as u32 } else { 0 };
    let count = corners.saturating_add(sampling.samples).max(1);
    let weights = |number: u32| match number.checked_sub(corners) {
        Some(number) => point_weights(number),
        None => core::array::from_fn(|corner| if corner as u32 == number { R::one() } else { R::zero() }),
    };
    let mut current = weights(0);
    let point = simplex.point(current);
    let mut value = field.value(point);
    let mut after = ((current, [value]), point);
    for number in 1..count {
        let next = weights(number);
        run_into(&Step, (*simplex, after.0, (current, [value]), next), &mut after);
        (current, value) = (next, field.value(after.1));
    }
    run_into(&Step, (*simplex, after.0, (current, [value]), current), &mut after);
    let ((best, _), _) = after;
    let mut state = DescentState::new(field, simplex, best);
    state.evaluations = R::from_f64(f64::from(count));
    state.finish(R::Mask::NONE)
}

/// From the best weights and value so far, those of the current point, and the next weights, to the better of both and the next point.
struct Step<const N: usize>;

impl<const N: usize> LaneKernel for Step<N> {
    type From<R: Real> = (Simplex<R, N>, ([R; N], [R; 1]), ([R; N], [R; 1]), [R; N]);
    type To<R: Real> = (([R; N], [R; 1]), Vector3<R>);

    #[inline(always)]
    fn apply<R: Real>(
        &self,
        (simplex, (mut weights, [lowest]), (current, [value]), next): Self::From<R>,
    ) -> Self::To<R> {
        let is_lower = value.lt(lowest);
        for k in 0..N {
            weights[k] = R::select(is_lower, current[k], weights[k]);
        }
        ((weights, [R::select(is_lower, value, lowest)]), simplex.point(next))
    }
}

/// Points whose weights are in a table, the most that the paper takes.
const TABLE_LEN: usize = 64;

/// [`triangle_weights`], by number, in f64. Those in f32 are in a table of their own: a program in f32 links no doubles.
const DOUBLES: [[f64; 3]; TABLE_LEN] = {
    let mut table = [[0.0; 3]; TABLE_LEN];
    let mut number = 0;
    while number < TABLE_LEN {
        let [a, b, c] = triangle_weights(number as u32);
        table[number] = [a.double, b.double, c.double];
        number += 1;
    }
    table
};

/// The same in f32.
const SINGLES: [[f32; 3]; TABLE_LEN] = {
    let mut table = [[0.0; 3]; TABLE_LEN];
    let mut number = 0;
    while number < TABLE_LEN {
        let [a, b, c] = triangle_weights(number as u32);
        table[number] = [a.single, b.single, c.single];
        number += 1;
    }
    table
};

/// Weights of a point, from the tables if they are there.
///
/// One by one: in a loop some compilers compute the other precision, too.
#[inline(always)]
fn weights_of<R: Real>(number: u32) -> [R; 3] {
    let number_of = |double, single| R::from_parameter(Parameter { double, single });
    if let (Some([a, b, c]), Some([x, y, z])) = (DOUBLES.get(number as usize), SINGLES.get(number as usize)) {
        return [number_of(*a, *x), number_of(*b, *y), number_of(*c, *z)];
    }
    let [a, b, c] = triangle_weights(number);
    [R::from_parameter(a), R::from_parameter(b), R::from_parameter(c)]
}

/// Barycentric weights of the van der Corput point with this number.
#[inline(always)]
const fn triangle_weights(number: u32) -> [Parameter; 3] {
    let ([a, b, c], sum) = weight_parts(number);
    [quotient(a, sum), quotient(b, sum), quotient(c, sum)]
}

/// Integers in the ratio of the weights, and their sum.
const fn weight_parts(number: u32) -> ([u32; 3], u32) {
    // Corners in parts of `unit`, at most 2¹⁶.
    let mut triangle = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
    let (mut unit, mut digits) = (1_u32, number);
    while digits > 0 {
        let [a, b, c] = triangle;
        let (ab, bc, ca) = (sum(a, b), sum(b, c), sum(c, a));
        triangle = match digits % 4 {
            0 => [bc, ca, ab],
            1 => [sum(a, a), ab, ca],
            2 => [ab, sum(b, b), bc],
            _ => [ca, bc, sum(c, c)],
        };
        unit = unit.wrapping_mul(2);
        digits /= 4;
    }
    let [a, b, c] = triangle;
    (sum(sum(a, b), c), unit.wrapping_mul(3))
}

const fn sum([a0, a1, a2]: [u32; 3], [b0, b1, b2]: [u32; 3]) -> [u32; 3] {
    [a0.wrapping_add(b0), a1.wrapping_add(b1), a2.wrapping_add(b2)]
}

/// Quotient of integers below 2²⁴: in f32 that of f64, rounded.
#[inline(always)]
const fn quotient(a: u32, b: u32) -> Parameter {
    Parameter { double: a as f64 / b as f64, single: a as f32 / b as f32 }
}
