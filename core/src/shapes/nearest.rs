//! The minimum of a ball, a capsule or an ellipsoid on a segment or triangle, without a search.
//!
//! φ is the distance from an axis, or from a point, less the radius; of an ellipsoid in coordinates in which it is a ball. It is least where
//! the element is nearest to that: where the axis crosses it, nearest to an end of the axis, or on an edge (Ericson 2005, "Real-Time
//! Collision Detection", §5.1). φ is convex: the tangent plane there is nowhere above it.

use core::array::from_fn;

use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::rounding::{FieldScale, rounding};
use crate::simplex::{corner_weights, max_distance};
use crate::vector::{largest_component, norm_squared};
use crate::{ExactMinimum, Sample, Sdf, Simplex};

/// Sine of the angle between two edges, as a multiple of [`Real::EPSILON`], below which a triangle is a sliver: there what of one edge is
/// normal to the other is known to 1/256.
const MIN_SINE: f64 = 256.0;

/// The minimum of a φ that is nowhere below −`radius`, at the point that [`nearest_to_axis`] gave. `None` on a segment where rounding hides
/// how near that point is to the minimum.
pub(super) fn minimum_at<R: Float, F: Sdf, const N: usize>(
    field: &F,
    radius: R,
    simplex: &Simplex<R, N>,
    weights: [R; N],
) -> Option<ExactMinimum<R, N>> {
    let sample = field.evaluate(simplex.point(weights));
    let lower_bound = lower_bound_at(FieldScale::new(field), radius, simplex, weights, sample)?;
    Some(ExactMinimum { weights, value: sample.value, lower_bound, evaluations: 1 })
}

#[inline(never)]
fn lower_bound_at<R: Float, const N: usize>(
    scale: FieldScale<R>,
    radius: R,
    simplex: &Simplex<R, N>,
    weights: [R; N],
    Sample { value, gradient, .. }: Sample<R>,
) -> Option<R> {
    let point = simplex.point(weights);
    let slope = |corner: &Vector3<R>| gradient.dot(&(corner - point));
    let fall = simplex.corners.iter().fold(R::zero(), |fall, corner| Real::min(fall, slope(corner)));
    let reach = max_distance(point, &simplex.corners);
    let rounding = rounding(scale, point, reach, value);
    // The direction from the axis is off by the rounding of coordinates over its length.
    let by_tangent = value + fall - rounding * (reach / (value + radius));
    let is_known = R::zero() - radius < by_tangent;
    let lower_bound = Real::min(value, if is_known { by_tangent } else { R::zero() - radius });
    let is_tight = value - lower_bound <= rounding;
    (N > 2 || is_tight).then_some(lower_bound)
}

/// Weights of the point of a segment or triangle that is nearest to an axis, whose ends may be one point. `None` in a sliver, and in single
/// precision: a GPU has no registers left for it, and answers in single precision are the same everywhere.
#[inline(never)]
pub(super) fn nearest_to_axis<R: Float, const N: usize>(
    corners: [Vector3<R>; N],
    axis: [Vector3<R>; 2],
) -> Option<[R; N]> {
    if R::EPSILON > 1e-10 {
        return None;
    }
    let mut nearest = ([R::zero(); N], R::from_f64(f64::INFINITY));
    let mut add = |weights: [R; N]| {
        let distance_sq = norm_squared(from_axis(Simplex { corners }.point(weights), axis));
        if distance_sq < nearest.1 {
            nearest = (weights, distance_sq);
        }
    };
    let is_point = axis[0] == axis[1];
    let mut is_inside = false;
    if let &[a, b, c] = corners.as_slice() {
        let crossing = crossing([a, b, c], axis);
        let centers = [crossing, Some(axis[0]), if is_point { None } else { Some(axis[1]) }];
        for center in centers.into_iter().flatten() {
            let in_plane = weights_in_plane([a, b, c].map(|corner| corner - center))?;
            if in_plane.iter().all(|weight| R::zero() <= *weight) {
                add(from_fn(|k| in_plane.get(k).copied().unwrap_or(R::zero())));
                is_inside |= is_point || Some(center) == crossing;
            }
        }
    }
    if !is_inside {
        // A segment has the first edge alone.
        for (first, second) in [(0, 1), (1, 2), (2, 0)] {
            if let [Some(from), Some(to)] = [first, second].map(|end| corners.get(end).copied()) {
                let place = place_nearest_to_axis([from, to], axis);
                let (from, to): ([R; N], [R; N]) = (corner_weights(first), corner_weights(second));
                add(from_fn(|k| from[k] * (R::one() - place) + to[k] * place));
            }
        }
    }
    let (weights, distance_sq) = nearest;
    distance_sq.is_finite().then_some(weights)
}

/// The way to a point from the nearest point of an axis.
fn from_axis<R: Float>(point: Vector3<R>, [start, end]: [Vector3<R>; 2]) -> Vector3<R> {
    let (between, along) = (point - start, end - start);
    between - along * within_segment(between.dot(&along), norm_squared(along))
}

/// Where an axis crosses the plane of a triangle.
fn crossing<R: Float>([a, b, c]: [Vector3<R>; 3], [start, end]: [Vector3<R>; 2]) -> Option<Vector3<R>> {
    let normal = (b - a).cross(&(c - a));
    let (before, after) = (normal.dot(&(start - a)), normal.dot(&(end - a)));
    let crosses = (before < R::zero()) != (after < R::zero());
    crosses.then(|| start + (end - start) * (before / (before - after)))
}

/// Weights of the point of a triangle's plane that is nearest to the origin: from the projection on one edge, and on what of the other is
/// normal to that, twice, as the first answer is off by rounding over the triangle's width. `None` in a sliver.
fn weights_in_plane<R: Float>([a, b, c]: [Vector3<R>; 3]) -> Option<[R; 3]> {
    let (u, v) = (b - a, c - a);
    let inverse = R::one() / Real::max(largest_component(u), largest_component(v));
    let (a, u, v) = (a * inverse, u * inverse, v * inverse);
    let (uu, vv) = (norm_squared(u), norm_squared(v));
    let along = u.dot(&v) / uu;
    let across = v - u * along;
    let across_sq = norm_squared(across);
    let (mut s, mut t) = (R::zero(), R::zero());
    for _ in 0..2 {
        let point = a + u * s + v * t;
        let of_u = point.dot(&u) / uu;
        let of_across = (point - u * of_u).dot(&across) / across_sq;
        (s, t) = (s - of_u + of_across * along, t - of_across);
    }
    // False where a length is NaN.
    let is_wide = vv * R::from_f64((MIN_SINE * R::EPSILON) * (MIN_SINE * R::EPSILON)) < across_sq;
    (is_wide && s.is_finite() && t.is_finite()).then_some([R::one() - s - t, s, t])
}

/// Where a segment is nearest to an axis: from 0, its start, to 1, its end. If they are parallel, beside the middle of it, or at the end of
/// the axis that is nearest to that (Ericson 2005, §5.1.9).
fn place_nearest_to_axis<R: Float>([from, to]: [Vector3<R>; 2], [start, end]: [Vector3<R>; 2]) -> R {
    let (along, axis, between) = (to - from, end - start, from - start);
    let inverse =
        R::one() / Real::max(largest_component(along), Real::max(largest_component(axis), largest_component(between)));
    let (along, axis, between) = (along * inverse, axis * inverse, between * inverse);
    let (aa, ax, xx) = (norm_squared(along), along.dot(&axis), norm_squared(axis));
    let (ab, xb) = (along.dot(&between), axis.dot(&between));
    let determinant = norm_squared(along.cross(&axis));
    let meets = R::zero() < determinant;
    let place = if meets { within_segment(xb * ax - ab * xx, determinant) } else { R::from_f64(0.5) };
    let on_axis = within_segment(xb + place * ax, xx);
    within_segment(on_axis * ax - ab, aa)
}

/// numerator / denominator, clamped to 0 to 1; 0 where the quotient is NaN or infinite.
fn within_segment<R: Float>(numerator: R, denominator: R) -> R {
    let place = numerator / denominator;
    if place.is_finite() { Real::clamp(place, R::zero(), R::one()) } else { R::zero() }
}
