use nalgebra::Vector3;

use super::search::Search;
use super::{Minimizer, Minimum};
use crate::number::kernel::LaneKernel;
use crate::number::kernel::run;
use crate::number::{Mask, Real};
use crate::{EnclosedSdf, Simplex};

/// The least of a fixed set of points: the baseline of §8.3, not a minimizer. It never converges.
///
/// On a triangle the points are the triangular van der Corput points of Basu and Owen 2015 ("Low discrepancy
/// constructions in the triangle", §3): the triangle is cut into its middle and three corner quarters again and again,
/// as the base-4 digits of the point's number say. On a segment they are the middles of equal parts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PointSampling {
    /// The paper takes 4, 16 and 64; at powers of 4 a triangle is covered evenly. None at all counts as one.
    pub samples: u32,
}

impl Default for PointSampling {
    fn default() -> Self {
        Self { samples: 16 }
    }
}

impl Minimizer<3> for PointSampling {
    const LOCKSTEP: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 3>) -> Minimum<R, 3> {
        least_of(field, simplex, self.samples, |number| {
            FIRST_WEIGHTS.get(number as usize).copied().unwrap_or_else(|| triangle_weights(number))
        })
    }
}

impl Minimizer<2> for PointSampling {
    const LOCKSTEP: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 2>) -> Minimum<R, 2> {
        least_of(field, simplex, self.samples, |number| {
            let share = (f64::from(number) + 0.5) / f64::from(self.samples.max(1));
            [1.0 - share, share]
        })
    }
}

impl Minimizer<1> for PointSampling {
    const LOCKSTEP: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, 1>) -> Minimum<R, 1> {
        least_of(field, simplex, 1, |_| [1.0])
    }
}

/// By values alone. Where the least is, the field is asked once more, for the gradient; the point is counted once.
#[inline(always)]
fn least_of<R: Real, F: EnclosedSdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
    samples: u32,
    weights: impl Fn(u32) -> [f64; N],
) -> Minimum<R, N> {
    let mut asked = weights(0);
    let mut value = field.value(simplex.point(asked.map(R::from_f64)));
    let mut best = (asked.map(R::from_f64), [value]);
    for number in 1..samples {
        let next = weights(number);
        let point;
        (best, point) = run(&Step { asked, next }, (*simplex, best, [value]));
        (asked, value) = (next, field.value(point));
    }
    (best, _) = run(&Step { asked, next: asked }, (*simplex, best, [value]));
    let mut search = Search::from(field, simplex, best.0);
    search.evaluations = R::from_f64(f64::from(samples.max(1)));
    search.finish(R::Mask::NONE)
}

/// From the weights that were asked last, the same in all lanes, and their value to the weights and the value of the least so
/// far, and to the next point.
struct Step<const N: usize> {
    asked: [f64; N],
    next: [f64; N],
}

impl<const N: usize> LaneKernel for Step<N> {
    type From<R: Real> = (Simplex<R, N>, ([R; N], [R; 1]), [R; 1]);
    type To<R: Real> = (([R; N], [R; 1]), Vector3<R>);

    #[inline(always)]
    fn apply<R: Real>(&self, (simplex, (mut weights, [least]), [value]): Self::From<R>) -> Self::To<R> {
        let is_less = value.lt(least);
        for k in 0..N {
            weights[k] = R::select(is_less, R::from_f64(self.asked[k]), weights[k]);
        }
        ((weights, [R::select(is_less, value, least)]), simplex.point(self.next.map(R::from_f64)))
    }
}

/// Of as many points as the paper takes at most.
const FIRST_WEIGHTS: [[f64; 3]; 64] = {
    let mut all = [[0.0; 3]; 64];
    let mut number = 0;
    while number < all.len() {
        all[number] = triangle_weights(number as u32);
        number += 1;
    }
    all
};

/// Barycentric weights of the point with this number.
pub const fn triangle_weights(number: u32) -> [f64; 3] {
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
