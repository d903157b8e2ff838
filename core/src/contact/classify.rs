//! Is an element whose minimum is known a contact? It is separated if that is above the margin, else a [`Contact`]: normal from the
//! smooth gradient, surface point by one step along it, feature from the weights, status from all that is in doubt.

use nalgebra::Vector3;

use super::{Contact, ContactStatus, Element, ElementKind, NO_VERTEX, Outcome};
use crate::minimize::Minimum;
use crate::number::{Float, Real};
use crate::vector::norm;
use crate::{Aabb, EnclosedSdf, ErrorBound, Sample};

/// The second half of [`contact`](super::contact): the outcome of an element that [`cull`](super::cull) leaves, from its minimum and the
/// lower bound there.
pub fn classify<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    margin: R,
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
) -> Outcome<R, N> {
    if is_separated(margin, minimum) {
        return Outcome::Separated(*minimum);
    }
    report(field, element, minimum, lower_bound, 0).map_or(Outcome::NotFinite, Outcome::Contact)
}

/// Is the minimum finite and above the margin?
pub(super) fn is_separated<R: Float, const N: usize>(margin: R, minimum: &Minimum<R, N>) -> bool {
    margin < minimum.sample.value && minimum.sample.value.is_finite()
}

/// The direction out of the shape at a point, and the way to the surface.
struct Normal<R: Float> {
    normal: Vector3<R>,
    slope: R,
    /// From the surface to the point.
    from_surface: Vector3<R>,
}

impl<R: Float> Normal<R> {
    /// `None` where the gradient has no direction. The way to the surface is φ / |∇φ|, but where the slope is below half of
    /// `full_slope` that is taken in its place: near a medial axis |∇φ| goes to zero and φ does not. The surface is at least
    /// |φ| / slope bound away, and the way is never more than 2 |φ| / `full_slope`.
    fn new(value: R, gradient: Vector3<R>, full_slope: R) -> Option<Self> {
        let slope = norm(gradient);
        let normal = gradient / slope;
        let distance = value / Real::max(slope, full_slope * R::from_f64(0.5));
        let is_valid = !slope.is_negligible() && slope.is_finite() && distance.is_finite();
        is_valid.then_some(Self { normal, slope, from_surface: normal * distance })
    }
}

/// The contact at a minimum; `None` where its value is not finite. `lower_bound` holds on the whole element; `rank` counts its
/// minima.
pub(super) fn report<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
    rank: u32,
) -> Option<Contact<R>> {
    Some(with_error(field, element, minimum, describe(field, element, minimum, lower_bound, rank)?))
}

/// The contact at a minimum, with a field's error for its own: of a whole union, where it was made by the parts that are lowest there.
pub fn with_error<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    contact: Contact<R>,
) -> Contact<R> {
    Contact {
        error_bound: ErrorBound::at_point(field, &Aabb::from_corners(&[minimum.point]), &minimum.sample),
        shape_lower_bound: field
            .error_bound(&Aabb::from_corners(&element.simplex.corners))
            .lowest_distance(contact.lower_bound),
        ..contact
    }
}

/// [`report`] without the field's error, whose bounds are in f64.
pub(super) fn describe<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
    rank: u32,
) -> Option<Contact<R>> {
    let kind = ElementKind::from_corner_count(N).filter(|_| minimum.sample.value.is_finite())?;
    let Sample { value, gradient, status } = minimum.sample;
    // A true distance has slope 1, and no field is steeper than its slope bound.
    let full_slope = Real::min(field.slope_bound_as::<R>(), R::one());
    let smooth = if F::IS_SMOOTH_AS_IT_IS { gradient } else { field.evaluate_smooth(minimum.point).gradient };
    let smooth = Normal::new(value, smooth, full_slope);
    let is_degenerate = status.degenerate_gradient || smooth.is_none();
    let zero = Normal { normal: Vector3::zeros(), slope: R::zero(), from_surface: Vector3::zeros() };
    let Normal { normal, slope, from_surface } =
        smooth.or_else(|| Normal::new(value, gradient, full_slope)).unwrap_or(zero);
    let trust = match () {
        () if is_degenerate => ContactStatus::DegenerateGradient,
        () if status.outside_grid => ContactStatus::OutsideGrid,
        () if status.beyond_band => ContactStatus::BeyondBand,
        () if !minimum.converged => ContactStatus::BudgetSpent,
        () => ContactStatus::Converged,
    };
    let (mut weights, mut vertices) = ([R::zero(); 3], [NO_VERTEX; 3]);
    weights.iter_mut().zip(minimum.weights).for_each(|(weight, known)| *weight = known);
    vertices.iter_mut().zip(element.vertices).for_each(|(vertex, known)| *vertex = known);
    Some(Contact {
        kind,
        element: element.id,
        vertices,
        rank,
        feature: element.feature(minimum.weights),
        weights,
        point: minimum.point,
        surface_point: minimum.point - from_surface,
        normal,
        slope,
        distance: value,
        lower_bound: Real::max(minimum.lower_bound, lower_bound),
        error_bound: R::from_f64(f64::INFINITY),
        shape_lower_bound: R::from_f64(f64::NEG_INFINITY),
        evaluations: minimum.evaluations.to_count(),
        status: trust,
    })
}
