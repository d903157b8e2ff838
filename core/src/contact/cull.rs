//! Which elements cannot touch: by bounds of φ in their boxes, then by φ(centroid) − slope bound · distance to the corners.

use super::{Element, ElementKind, Outcome};
use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::{Aabb, EnclosedSdf, Sdf, Simplex};

/// The first half of [`contact`](super::contact): a lower bound of φ on an element, or why there is nothing to search.
///
/// With the minimum of a search it makes a contact: see [`contact_at`](super::contact_at).
pub fn cull<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    margin: R,
    element: &Element<R, N>,
) -> Result<R, Outcome<R, N>> {
    match bound(field, margin, element) {
        None => Err(Outcome::NotFinite),
        Some(lower_bound) if margin < lower_bound => Err(Outcome::Culled),
        Some(lower_bound) => Ok(lower_bound),
    }
}

/// The first half of [`lean_contact`](super::lean_contact): a lower bound of φ on an element by [`centroid_bound`], or why there is
/// nothing to search. Where all of a grid's block about the centroid is far off, no sample is read.
///
/// With the minimum of a search it makes an outcome: see [`lean_contact_at`](super::lean_contact_at).
#[inline(always)]
pub fn lean_cull<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    margin: R,
    element: &Element<R, N>,
) -> Result<R, Outcome<R, N>> {
    let simplex = &element.simplex;
    if ElementKind::from_corner_count(N).is_none() || !simplex.is_representable() {
        return Err(Outcome::NotFinite);
    }
    let (scale, centroid) = (FieldScale::new(field), simplex.centroid());
    if margin < simplex.lower_bound(scale, scale.slope_bound, centroid, field.lowest_about(centroid)) {
        return Err(Outcome::Culled);
    }
    let CentroidBound { may_touch, lower_bound } = centroid_bound(field, simplex, margin);
    if may_touch { Ok(lower_bound) } else { Err(Outcome::Culled) }
}

/// A lower bound of φ on an element, the first that is above the margin if one is. `None` where something is not finite.
#[inline(always)]
pub(super) fn bound<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    margin: R,
    element: &Element<R, N>,
) -> Option<R> {
    let simplex = &element.simplex;
    if ElementKind::from_corner_count(N).is_none() || !simplex.is_representable() {
        return None;
    }
    let rounding = box_rounding(FieldScale::new(field), margin, simplex);
    let in_box = BoxBound::new(field, &simplex.bounds(), rounding);
    if margin < in_box.lower {
        return Some(in_box.lower);
    }
    let centroid = simplex.centroid();
    let from_slope = simplex.lower_bound(FieldScale::new(field), in_box.slope_bound, centroid, field.value(centroid));
    let lower_bound = Real::max(from_slope, in_box.lower);
    // Neither above nor within: one of the two is NaN.
    (margin.lt(from_slope) || lower_bound.le(margin)).then_some(lower_bound)
}

/// Bounds of φ in an element's box.
#[derive(Clone, Copy)]
pub(super) struct BoxBound<R> {
    /// Lower bound of φ, rounding included.
    pub lower: R,
    pub slope_bound: R,
}

impl<R: Float> BoxBound<R> {
    #[inline(always)]
    pub fn new<F: EnclosedSdf>(field: &F, region: &Aabb, rounding: R) -> Self {
        let local = field.enclose_box(region);
        Self { lower: R::from_f64(local.range.lower) - rounding, slope_bound: R::from_f64(local.slope_bound) }
    }
}

/// Bound of the rounding of values of φ on the element that are no larger than the margin.
#[inline(always)]
pub(super) fn box_rounding<R: Real, const N: usize>(field: FieldScale<R>, margin: R, simplex: &Simplex<R, N>) -> R {
    let centroid = simplex.centroid();
    rounding(field, centroid, simplex.max_distance_from(centroid), margin)
}

/// Verdict of one evaluation at an element's centroid.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CentroidBound<R: Real> {
    /// False only if no point of the element has a value of at most the margin; true where either is NaN.
    pub may_touch: R::Mask,
    /// Lower bound of φ on the element.
    pub lower_bound: R,
}

/// The cull of an element by its centroid: φ ≥ φ(centroid) − slope bound · max |corner − centroid|, rounding included.
///
/// §3.3 of the paper rejects an element where φ(centroid) ≥ the distance to its corners. Here a contact is made where
/// φ ≤ margin, and a field may be steeper than one, so that it takes φ(centroid) > margin + slope bound · distance.
#[inline]
pub fn centroid_bound<R: Real, F: Sdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
    margin: R,
) -> CentroidBound<R> {
    let centroid = simplex.centroid();
    let scale = FieldScale::new(field);
    let lower_bound = simplex.lower_bound(scale, scale.slope_bound, centroid, field.value(centroid));
    CentroidBound { may_touch: !margin.lt(lower_bound), lower_bound }
}
