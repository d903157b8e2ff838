//! When does a moving element first come within a thickness of a field? Conservative advancement (Mirtich 1996, "Impulse-based
//! Dynamic Simulation of Rigid Body Systems", §2.3; Zhang, Lee and Kim 2006) on certified lower bounds of φ.
//!
//! ```text
//! t ← 0
//! loop  φ > thickness until s, as a tangent plane says:  t ← s, and never touches where s = 1
//!       l ≤ min φ(·, t) on the element, and r ≥ −dφ/dt at all of its points from t on
//!       min φ ≤ thickness + tolerance:   touches at t
//!       l − r (1 − t) > thickness:       never touches
//!       t ← t + (l − thickness) / r      before that, nothing can have come within the thickness
//! ```
//!
//! The tangent plane is that at the middle of the way ahead: φ lies below it by no more than
//! [`linearization_error`](EnclosedSdf::linearization_error). It knows the direction of the motion, and r only its speed: an element that
//! slides along a plane a small gap above it would need a step for each gap of the way.
//!
//! So the time is never late. It is early only in that φ ≤ thickness + tolerance holds there in place of φ ≤ thickness: by no more
//! than tolerance / s where the element goes on to approach at a speed s. As l is proven to within half of the tolerance, each step is
//! at least tolerance / (2 r) long, and the loop ends.

use nalgebra::Vector3;

use super::Element;
use crate::minimize::{Certified, Minimizer, Minimum, reference_length};
use crate::moving::{MovingSdf, position, product, swept_bounds};
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, NESTED_FIELDS, rounding};
use crate::{EnclosedSdf, Simplex};

/// A vertex, edge or face whose corners move linearly between the times 0 and 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MovingElement<R: Real, const N: usize> {
    /// The index among the elements of this kind.
    pub id: u32,
    /// The mesh's vertices at the corners.
    pub vertices: [u32; N],
    /// Positions of each corner at the times 0 and 1.
    pub path: [[Vector3<R>; 2]; N],
}

impl<R: Float, const N: usize> MovingElement<R, N> {
    /// The element at a time.
    pub fn at(&self, time: f64) -> Element<R, N> {
        let corners = self.path.map(|corner| position(&corner, time));
        Element { id: self.id, vertices: self.vertices, simplex: Simplex { corners } }
    }
}

/// The search for the first time at which an element comes within a thickness of a field.
///
/// ```
/// use sdf_core::contact::{FirstTouch, MovingElement, Touch};
/// use sdf_core::{nalgebra::Vector3, shapes::Sphere};
/// // A vertex that flies through a ball of radius 1, from x = -3 to 5: it is at x = -1 after a quarter of the time.
/// let path = [[Vector3::new(-3.0, 0.0, 0.0), Vector3::new(5.0, 0.0, 0.0)]];
/// let bullet = MovingElement { id: 0, vertices: [0], path };
/// let search = FirstTouch { tolerance: 1e-6, ..FirstTouch::default() };
/// let Touch::At { time, .. } = search.first_touch(&Sphere::new(1.0).unwrap(), 0.0, &bullet) else { panic!() };
/// assert!(0.25 - 1e-6 / 8.0 <= time && time <= 0.25);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstTouch {
    /// A length: φ ≤ thickness + tolerance at the time that is found. Less than the rounding of φ counts as that.
    pub tolerance: f64,
    /// Largest number of evaluations of the field, those that a search counts as one included.
    pub evaluations: u32,
}

impl Default for FirstTouch {
    fn default() -> Self {
        Self { tolerance: 1e-4, evaluations: 1 << 16 }
    }
}

/// When an element first touches. Times are those of the motion, 0 to 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Touch<R: Real, const N: usize> {
    /// A corner, the thickness or the field's answer is NaN or infinite, or a corner exceeds
    /// [`MAX_COORDINATE`](crate::Real::MAX_COORDINATE).
    NotFinite,
    /// φ is above the thickness at all times.
    Never,
    /// φ is above the thickness at all earlier times, and at this one at most thickness + tolerance at the minimum's point. A contact
    /// is made of it by [`contact_at`](super::contact_at).
    At {
        /// The first time, early by the tolerance at most. 0 where the element touches from the start.
        time: f64,
        /// The lowest point at that time.
        minimum: Minimum<R, N>,
    },
    /// φ is above the thickness at all times before this one; then the budget ended.
    BudgetSpent {
        /// Nothing touches before.
        time: f64,
    },
}

/// A search stops once the bound is within this fraction of the way that is left, as the lowest value so far tells: a longer step costs
/// more.
const COARSE_GAP: f64 = 0.25;

impl FirstTouch {
    /// The first time at which some point of the element has φ ≤ `thickness`.
    pub fn first_touch<R: Float, F: MovingSdf, const N: usize>(
        &self,
        field: &F,
        thickness: R,
        element: &MovingElement<R, N>,
    ) -> Touch<R, N> {
        let path = element.path.map(|corner| corner.map(|point| point.map(Float::to_f64)));
        let is_representable = [0.0, 1.0].map(|time| element.at(time).simplex.is_representable());
        if is_representable != [true; 2] || !thickness.is_representable() {
            return Touch::NotFinite;
        }
        let farthest = R::from_f64(path.iter().flatten().map(Vector3::amax).fold(0.0, f64::max));
        let (mut time, mut evaluations) = (0.0, 0_u32);
        // How far ahead a tangent plane looks, and the last step without one.
        let (mut ahead, mut step) = (1.0, 0.0);
        while evaluations < self.evaluations {
            let now = field.at(time);
            let approach = field.approach_bound(&path, time, 1.0);
            let simplex = element.at(time).simplex;
            let slack = self.slack(&now, thickness, &simplex, farthest);
            // No point whose value is above this now can touch.
            let reach = thickness + slack + R::from_f64(product(1.0 - time, approach));
            let region = swept_bounds(&path, time, 1.0);
            let fall = product(1.0 - time, field.fall_bound(&region, time, 1.0));
            if thickness + slack < R::from_f64(now.enclose_box(&region).range.lower - fall) {
                return Touch::Never;
            }
            let mut free = time;
            if ahead < 2.0 * step {
                ahead *= 2.0;
            } else {
                let until = (time + ahead).min(1.0);
                free = field.free_until(&path, time, until, (thickness + slack).to_f64());
                evaluations = evaluations.saturating_add(1);
                match () {
                    () if free == 1.0 => return Touch::Never,
                    () if free == until => {
                        (time, ahead) = (until, 2.0 * ahead);
                        continue;
                    }
                    () => ahead *= 0.25,
                }
            }
            let (minimum, spent) = self.minimum(&now, thickness, reach, &simplex, evaluations);
            evaluations = evaluations.saturating_add(spent);
            if !minimum.sample.value.is_finite() {
                return Touch::NotFinite;
            }
            if minimum.sample.value <= thickness + Real::max(R::from_f64(self.tolerance), slack) {
                return Touch::At { time, minimum };
            }
            let gap = (minimum.lower_bound - thickness).to_f64();
            if reach < minimum.lower_bound {
                return Touch::Never;
            }
            // The field may be calmer nearby than on the whole way: it is bounded anew for the next step.
            let near = (time + 2.0 * gap / approach).min(1.0);
            let local = field.approach_bound(&path, time, near);
            step = (gap / local).min(near - time) * (1.0 - 8.0 * f64::EPSILON);
            let next = free.max(time + step);
            if next.is_nan() || next <= time {
                return Touch::BudgetSpent { time };
            }
            time = next.min(1.0);
        }
        Touch::BudgetSpent { time }
    }

    /// Rounding of values near the thickness on the simplex, and of the place of its corners, which is that of the `farthest` coordinate on
    /// their way.
    fn slack<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        thickness: R,
        simplex: &Simplex<R, N>,
        farthest: R,
    ) -> R {
        let centroid = simplex.centroid();
        let radius = Real::max(simplex.max_distance_from(centroid), farthest);
        rounding(FieldScale::new(field), centroid, radius, thickness) * R::from_f64(2.0 * NESTED_FIELDS)
    }

    /// The minimum on the element at a moment, its bound so near to its value that a step is worth it, and what that cost.
    fn minimum<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        thickness: R,
        reach: R,
        simplex: &Simplex<R, N>,
        spent: u32,
    ) -> (Minimum<R, N>, u32) {
        let left = self.evaluations.saturating_sub(spent);
        // Half of the tolerance, as a fraction as a search takes it. At a point there is nothing to search.
        let unit = reference_length(field, simplex.longest_edge()).to_f64() * field.slope_bound();
        let fraction = |gap: f64| if unit > 0.0 { gap / unit } else { 0.0 };
        let finest = fraction(0.5 * self.tolerance);
        // Some point is so far above the thickness: the minimum at most.
        let mut ahead = (field.value(simplex.centroid()) - thickness).to_f64();
        let mut cost = 1_u32;
        loop {
            let tolerance = finest.max(fraction(COARSE_GAP * ahead));
            let evaluations = left.saturating_sub(cost);
            let method = Certified { evaluations, tolerance, ..Certified::default() };
            let found = method.minimize_below(field, simplex, reach);
            cost = cost.saturating_add(found.evaluations.to_f64() as u32);
            let above = found.sample.value - thickness;
            let is_tight = above * R::from_f64(0.5) <= found.lower_bound - thickness;
            if is_tight || tolerance <= finest || reach < found.lower_bound || left <= cost {
                return (found, cost);
            }
            // Less than half, as the bound is not tight; where rounding is all that is left, the finest search is the last.
            let above = above.to_f64();
            ahead = if above < 0.5 * ahead { above } else { 0.0 };
        }
    }
}
