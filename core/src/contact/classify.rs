use nalgebra::Vector3;

use super::{Contact, ContactStatus, Element, ElementKind, Outcome};
use crate::minimize::Minimum;
use crate::number::{Float, Real};
use crate::vector::norm;

/// The outcome of an element that passed the cull with this lower bound, from its minimum.
pub(super) fn classify<R: Float, const N: usize>(
    margin: R,
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
) -> Outcome<R, N> {
    if is_separated(margin, minimum) {
        return Outcome::Separated(*minimum);
    }
    report(element, minimum, lower_bound, 0).map_or(Outcome::NotFinite, Outcome::Contact)
}

/// Is the minimum finite and above the margin?
pub(super) fn is_separated<R: Float, const N: usize>(margin: R, minimum: &Minimum<R, N>) -> bool {
    margin < minimum.sample.value && minimum.sample.value.is_finite()
}

/// The contact at a minimum; `None` where its value is not finite. `lower_bound` holds on the whole element; `rank` counts its
/// minima.
pub(super) fn report<R: Float, const N: usize>(
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
    rank: u32,
) -> Option<Contact<R>> {
    let kind = ElementKind::from_corner_count(N).filter(|_| minimum.sample.value.is_finite())?;
    let gradient = minimum.sample.gradient;
    let length = norm(gradient);
    let step = minimum.sample.value / length;
    // The square of a gradient can overflow or underflow where the gradient does not.
    let has_normal = !length.is_negligible() && length.is_finite() && step.is_finite();
    let normal = if has_normal { gradient / length } else { Vector3::zeros() };
    let from_surface = if has_normal { normal * step } else { Vector3::zeros() };
    let status = match () {
        () if minimum.sample.status.degenerate_gradient || !has_normal => ContactStatus::DegenerateGradient,
        () if minimum.sample.status.outside_grid => ContactStatus::OutsideGrid,
        () if !minimum.converged => ContactStatus::BudgetSpent,
        () => ContactStatus::Converged,
    };
    let mut weights = [R::zero(); 3];
    weights.iter_mut().zip(minimum.weights).for_each(|(weight, known)| *weight = known);
    Some(Contact {
        kind,
        element: element.id,
        rank,
        feature: element.feature(minimum.weights),
        weights,
        point: minimum.point,
        surface_point: minimum.point - from_surface,
        normal,
        distance: minimum.sample.value,
        lower_bound: Real::max(minimum.lower_bound, lower_bound),
        evaluations: (minimum.evaluations.to_f64() as u32).saturating_add(1),
        status,
    })
}
