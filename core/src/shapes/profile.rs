//! Plane figures, and the solids that they generate by revolution and extrusion.
//!
//! With f a signed distance in the plane (Quilez, "Distance functions", iquilezles.org; Hart 1996, appendix A):
//!
//! ```text
//! revolution about z     φ(x) = f(ρ, z),   ρ = √(x² + y²)
//! extrusion along z      φ(x) = corner(f(x, y), |z| − h)
//! corner(d₁, …, d_n)     √(Σ max(d_k, 0)²)  if some d_k > 0,  else max_k d_k
//! ```

use core::array::from_fn;

use nalgebra::Vector3;

use super::mirror::reflect_derivative;
use crate::Sample;
use crate::number::{Float, Mask, Real};
use crate::relaxation::{AffineBounds, highest_mean, weighted_lower};

/// A signed distance in the plane.
#[derive(Clone, Copy)]
pub(super) struct Profile<R: Real> {
    pub value: R,
    /// Derivatives along the plane's two axes.
    pub gradient: [R; 2],
    pub is_degenerate: R::Mask,
}

impl<R: Real> Profile<R> {
    #[inline]
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self {
            value: R::select(mask, yes.value, no.value),
            gradient: from_fn(|k| R::select(mask, yes.gradient[k], no.gradient[k])),
            is_degenerate: (mask & yes.is_degenerate) | (!mask & no.is_degenerate),
        }
    }

    /// √(a² + b²): the distance from a point, with [a, b] the vector from it. The gradient at the point is [1, 0].
    #[inline]
    pub fn norm([a, b]: [R; 2]) -> Self {
        let length = (a * a + b * b).sqrt();
        let is_degenerate = length.is_negligible();
        let divisor = R::select(is_degenerate, R::one(), length);
        Self {
            value: length,
            gradient: [
                R::select(is_degenerate, R::one(), a / divisor),
                R::select(is_degenerate, R::zero(), b / divisor),
            ],
            is_degenerate,
        }
    }
}

/// The solid of revolution about z. `profile` maps [ρ, z] to a signed distance in that half-plane.
#[inline]
pub(super) fn revolve<R: Real>(point: Vector3<R>, profile: impl FnOnce([R; 2]) -> Profile<R>) -> Sample<R> {
    let rho = Profile::norm([point.x, point.y]);
    let profile = profile([rho.value, point.z]);
    let [radial, axial] = profile.gradient;
    // On the axis ∇ρ is undefined, which matters only where ∂f/∂ρ ≠ 0.
    let is_degenerate = profile.is_degenerate | (rho.is_degenerate & !radial.is_zero());
    let gradient = Vector3::new(radial * rho.gradient[0], radial * rho.gradient[1], axial);
    Sample::with_degenerate(profile.value, gradient, is_degenerate)
}

/// The solid that a figure in x and y sweeps along z, from −`half_height` to `half_height`.
#[inline]
pub(super) fn extrude<R: Real>(figure: Profile<R>, z: R, half_height: R) -> Sample<R> {
    let corner = corner([figure.value, z.abs() - half_height]);
    let [by_figure, by_height] = corner.gradient;
    let (by_z, is_mid_plane) = reflect_derivative(by_height, z);
    let gradient = Vector3::new(by_figure * figure.gradient[0], by_figure * figure.gradient[1], by_z);
    let is_degenerate = corner.is_degenerate | is_mid_plane | (figure.is_degenerate & !by_figure.is_zero());
    Sample::with_degenerate(corner.value, gradient, is_degenerate)
}

/// The signed distance from a convex corner of `N` orthogonal walls.
pub(super) struct Corner<R: Real, const N: usize> {
    pub value: R,
    /// Derivatives by the distances from the walls.
    pub gradient: [R; N],
    pub is_degenerate: R::Mask,
}

/// The corner formula of the module header. `walls` are the signed distances from the walls.
#[inline]
pub(super) fn corner<R: Real, const N: usize>(walls: [R; N]) -> Corner<R, N> {
    let legs = walls.map(|wall| wall.max(R::zero()));
    let outside = legs.iter().fold(R::zero(), |sum, leg| sum + *leg * *leg).sqrt();
    let is_inside = outside.is_negligible();
    let divisor = R::select(is_inside, R::one(), outside);

    let (mut nearest, mut nearest_gradient, mut is_tie) = (walls[0], [R::zero(); N], R::Mask::NONE);
    nearest_gradient[0] = R::one();
    for k in 1..N {
        let is_nearer = nearest.lt(walls[k]);
        is_tie = (is_tie & !is_nearer) | (nearest.le(walls[k]) & !is_nearer);
        nearest = R::select(is_nearer, walls[k], nearest);
        for (j, derivative) in nearest_gradient.iter_mut().enumerate() {
            let unit = if j == k { R::one() } else { R::zero() };
            *derivative = R::select(is_nearer, unit, *derivative);
        }
    }
    Corner {
        value: R::select(is_inside, nearest, outside),
        gradient: from_fn(|k| R::select(is_inside, nearest_gradient[k], legs[k] / divisor)),
        is_degenerate: is_inside & is_tie,
    }
}

/// Bounds of [`corner`], which is convex, homogeneous and increases with each wall. Below stand its tangent plane Σ g_k d_k,
/// g_k ≥ 0, and each wall; above stands the chord.
pub(super) fn corner_bounds<R: Float, const N: usize>(walls: [AffineBounds<R>; N]) -> AffineBounds<R> {
    let Corner { value, gradient, .. } = corner(walls.map(|wall| wall.value));
    let tangent = weighted_lower(&walls, gradient);
    AffineBounds {
        value,
        lower: walls.iter().fold(tangent, |lower, wall| highest_mean(lower, wall.lower)),
        upper: from_fn(|k| corner(walls.map(|wall| wall.upper[k])).value),
    }
}
