use super::search::Search;
use super::{Minimizer, Minimum};
use crate::real::{Mask, Real};
use crate::{Sdf, Simplex};

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
    const PAYS_IN_LANES: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: Sdf>(&self, field: &F, simplex: &Simplex<R, 3>) -> Minimum<R, 3> {
        least_of(field, simplex, self.samples, triangle_weights)
    }
}

impl Minimizer<2> for PointSampling {
    const PAYS_IN_LANES: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: Sdf>(&self, field: &F, simplex: &Simplex<R, 2>) -> Minimum<R, 2> {
        least_of(field, simplex, self.samples, |number| {
            let share = (f64::from(number) + 0.5) / f64::from(self.samples.max(1));
            [1.0 - share, share]
        })
    }
}

impl Minimizer<1> for PointSampling {
    const PAYS_IN_LANES: bool = true;

    #[inline(always)]
    fn minimize<R: Real, F: Sdf>(&self, field: &F, simplex: &Simplex<R, 1>) -> Minimum<R, 1> {
        least_of(field, simplex, 1, |_| [1.0])
    }
}

#[inline(always)]
fn least_of<R: Real, F: Sdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
    samples: u32,
    weights: impl Fn(u32) -> [f64; N],
) -> Minimum<R, N> {
    let mut search = Search::from(field, simplex, weights(0).map(R::lift));
    for number in 1..samples {
        search.visit(weights(number).map(R::lift), !R::Mask::NONE);
    }
    search.finish(R::Mask::NONE)
}

/// Barycentric weights of the point with this number.
pub fn triangle_weights(number: u32) -> [f64; 3] {
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
    let [a, b, c] = triangle;
    core::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0)
}

fn middle(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    core::array::from_fn(|k| 0.5 * (a[k] + b[k]))
}
