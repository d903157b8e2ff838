//! Knowledge of an element from the frame before: how far was it from the field, and where was it nearest?
//!
//! If φ ≥ l on an element, and since then φ at its points has fallen by no more than m, then φ ≥ l − m. So an element whose l − m is
//! above the margin need not be asked again. m is slope bound · the longest way of a corner, plus what the field itself has fallen:
//! [`MovingSdf::approach_bound`](crate::moving::MovingSdf::approach_bound).
//!
//! The same bound makes margins for motions to come (speculative contacts): an element that gets within `thickness` of the field
//! before the next detection is within thickness + m of it now: [`speculative_margin`].

use nalgebra::Vector3;

use super::cull::{self, box_rounding};
use super::{Element, Outcome, classify};

use crate::EnclosedSdf;
use crate::minimize::Minimizer;
use crate::moving::MovingSdf;
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, NESTED_FIELDS};

/// The bound and the weights that the last query of an element has left.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ElementMemory<R: Real, const N: usize> {
    /// Lower bound of φ on the element as it is now; −∞ where nothing is known.
    lower_bound: R,
    /// Weights of the lowest point that was found; NaN before the first.
    weights: [R; N],
}

/// Nothing is known: the element will be asked.
impl<R: Real, const N: usize> Default for ElementMemory<R, N> {
    fn default() -> Self {
        Self { lower_bound: R::from_f64(f64::NEG_INFINITY), weights: [R::from_f64(f64::NAN); N] }
    }
}

impl<R: Float, const N: usize> ElementMemory<R, N> {
    /// Lower bound of φ on the element.
    pub fn lower_bound(&self) -> R {
        self.lower_bound
    }

    /// Weights of the lowest point that the last search found, if there was one.
    pub fn weights(&self) -> Option<[R; N]> {
        self.weights.iter().all(|weight| weight.is_finite()).then_some(self.weights)
    }

    /// Tells of a motion since the last query: at no point of the element has φ fallen by more than `fall`.
    pub fn recede(&mut self, fall: R) {
        let sum = Real::max(self.lower_bound.abs(), fall) * R::from_f64(4.0 * R::EPSILON);
        self.lower_bound -= fall + sum;
    }

    /// Is all of the element certainly above the margin, so that nothing need be asked?
    pub fn is_apart<F: EnclosedSdf>(&self, field: &F, margin: R, element: &Element<R, N>) -> bool {
        let rounding = box_rounding(FieldScale::new(field), margin, &element.simplex) * R::from_f64(NESTED_FIELDS);
        element.simplex.is_representable() && margin + rounding < self.lower_bound
    }

    /// Keeps what a query with this margin has found. An element that was culled has all its values above the margin.
    pub fn record(&mut self, margin: R, outcome: &Outcome<R, N>) {
        match outcome {
            Outcome::NotFinite => *self = Self::default(),
            Outcome::Culled => self.lower_bound = Real::max(self.lower_bound, margin),
            Outcome::Separated(minimum) => *self = Self { lower_bound: minimum.lower_bound, weights: minimum.weights },
            Outcome::Contact(contact) => {
                self.lower_bound = contact.lower_bound;
                self.weights.iter_mut().zip(contact.weights).for_each(|(kept, weight)| *kept = weight);
            }
        }
    }
}

/// [`contact`](super::contact()) of an element that was searched before. `fall` is an upper bound of how far φ has fallen at its points
/// since then. Nothing within the margin is skipped: an element that is certainly above it is [`Outcome::Culled`] without a look at
/// the field, and any other is searched from where it was nearest ([`Minimizer::minimize_from`]).
pub fn contact_again<R, F, M, const N: usize>(
    field: &F,
    minimizer: &M,
    margin: R,
    element: &Element<R, N>,
    fall: R,
    memory: &mut ElementMemory<R, N>,
) -> Outcome<R, N>
where
    R: Float,
    F: EnclosedSdf,
    M: Minimizer<N>,
{
    memory.recede(fall);
    if memory.is_apart(field, margin, element) {
        return Outcome::Culled;
    }
    let outcome = match cull::bound(field, margin, element) {
        None => Outcome::NotFinite,
        Some(lower_bound) if margin < lower_bound => {
            // The bound itself is kept, and not only that it is above the margin.
            memory.lower_bound = lower_bound;
            return Outcome::Culled;
        }
        Some(lower_bound) => {
            let minimum = match memory.weights() {
                Some(start) => minimizer.minimize_from(field, &element.simplex, margin, start),
                None => minimizer.minimize_below(field, &element.simplex, margin),
            };
            classify(field, margin, element, &minimum, lower_bound)
        }
    };
    memory.record(margin, &outcome);
    outcome
}

/// A margin for an element that moves linearly from its corners at time 0 to those at time 1, while the field moves, too: if some
/// point of it reaches φ ≤ `thickness` before time 1, it has a point with φ ≤ this now. `thickness` + the bound of −dφ/dt.
///
/// ```
/// use sdf_core::contact::{Element, Outcome, Row, contact, speculative_margin};
/// use sdf_core::moving::{MovingSdf, RigidMotion, Travelling};
/// use sdf_core::{Simplex, minimize::Certified, nalgebra::Vector3, placed::Rigid, shapes::Sphere};
///
/// let pose = |x| Rigid::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
/// // A ball that flies two units along x before the next detection, at a face that stands still.
/// let ball = Travelling { field: Sphere::new(0.5).unwrap(), motion: RigidMotion::between(pose(-2.0), pose(0.0)) };
/// let corners = [Vector3::new(0.0_f64, -1.0, -1.0), Vector3::new(0.0, 1.0, -1.0), Vector3::new(0.0, 0.0, 1.0)];
/// let margin = speculative_margin(&ball, 0.01, &corners.map(|corner| [corner, corner]));
/// let element = Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners } };
/// let Outcome::Contact(contact) = contact(&ball.at(0.0), &Certified::default(), margin, &element) else { panic!() };
/// let row = Row::from_contact(&contact, 0.01).unwrap();
/// let row = row.with_surface_velocity(ball.surface_velocity(contact.surface_point, 0.0));
/// assert!((row.gap - 1.49).abs() < 1e-3 && (row.surface_velocity.x - 2.0).abs() < 1e-12);
/// ```
pub fn speculative_margin<R: Float, F: MovingSdf, const N: usize>(
    field: &F,
    thickness: R,
    path: &[[Vector3<R>; 2]; N],
) -> R {
    let path = path.map(|corner| corner.map(|point| point.map(Float::to_f64)));
    let fall = R::from_f64(field.approach_bound(&path, 0.0, 1.0));
    thickness + fall + Real::max(thickness.abs(), fall) * R::from_f64(4.0 * R::EPSILON)
}
