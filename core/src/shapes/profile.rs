//! Plane figures, and the solids that they sweep.

use core::array::from_fn;

use nalgebra::Vector3;

use crate::Sample;
use crate::number::{Mask, Real};

/// A signed distance in the plane with its derivatives along the plane's two axes.
#[derive(Clone, Copy)]
pub(super) struct Profile<R: Real> {
    pub value: R,
    pub gradient: [R; 2],
    pub degenerate: R::Mask,
}

impl<R: Real> Profile<R> {
    #[inline]
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self {
            value: R::select(mask, yes.value, no.value),
            gradient: from_fn(|k| R::select(mask, yes.gradient[k], no.gradient[k])),
            degenerate: (mask & yes.degenerate) | (!mask & no.degenerate),
        }
    }

    /// The distance from a point, with `offset` the way from it.
    #[inline]
    pub fn from_point([a, b]: [R; 2]) -> Self {
        let length = (a * a + b * b).sqrt();
        let degenerate = length.is_negligible();
        let divisor = R::select(degenerate, R::one(), length);
        Self {
            value: length,
            gradient: [R::select(degenerate, R::one(), a / divisor), R::select(degenerate, R::zero(), b / divisor)],
            degenerate,
        }
    }
}

/// The solid of revolution around z of a figure in the half-plane (distance from the axis, z).
#[inline]
pub(super) fn revolve<R: Real>(point: Vector3<R>, figure: impl FnOnce([R; 2]) -> Profile<R>) -> Sample<R> {
    let from_axis = Profile::from_point([point.x, point.y]);
    let profile = figure([from_axis.value, point.z]);
    let [radial, axial] = profile.gradient;
    // On the axis only a slope across it is undefined.
    let degenerate = profile.degenerate | (from_axis.degenerate & !radial.is_zero());
    let gradient = Vector3::new(radial * from_axis.gradient[0], radial * from_axis.gradient[1], axial);
    Sample::with_degenerate(profile.value, gradient, degenerate)
}

/// The solid that a figure in x and y sweeps along z from −`half_height` to `half_height`.
#[inline]
pub(super) fn extrude<R: Real>(figure: Profile<R>, z: R, half_height: R) -> Sample<R> {
    let corner = corner([figure.value, z.abs() - half_height]);
    let [across, along] = corner.gradient;
    let (along, on_mid_plane) = super::fold::unfold_axis(along, z);
    let gradient = Vector3::new(across * figure.gradient[0], across * figure.gradient[1], along);
    let degenerate = corner.degenerate | on_mid_plane | (figure.degenerate & !across.is_zero());
    Sample::with_degenerate(corner.value, gradient, degenerate)
}

/// The signed distance from a corner where `N` walls meet at right angles, and its derivatives by them.
pub(super) struct Corner<R: Real, const N: usize> {
    pub value: R,
    pub gradient: [R; N],
    pub degenerate: R::Mask,
}

/// `walls` are the signed distances from the walls: outside, those still positive are the legs of a right triangle;
/// inside, the nearest wall alone counts.
#[inline]
pub(super) fn corner<R: Real, const N: usize>(walls: [R; N]) -> Corner<R, N> {
    let legs = walls.map(|wall| wall.max(R::zero()));
    let outside = legs.iter().fold(R::zero(), |sum, leg| sum + *leg * *leg).sqrt();
    let is_inside = outside.is_negligible();
    let divisor = R::select(is_inside, R::one(), outside);

    let (mut nearest, mut nearest_gradient, mut tie) = (walls[0], [R::zero(); N], R::Mask::NONE);
    nearest_gradient[0] = R::one();
    for k in 1..N {
        let nearer = nearest.lt(walls[k]);
        tie = (tie & !nearer) | (nearest.le(walls[k]) & !nearer);
        nearest = R::select(nearer, walls[k], nearest);
        for (j, derivative) in nearest_gradient.iter_mut().enumerate() {
            let this = if j == k { R::one() } else { R::zero() };
            *derivative = R::select(nearer, this, *derivative);
        }
    }
    Corner {
        value: R::select(is_inside, nearest, outside),
        gradient: from_fn(|k| R::select(is_inside, nearest_gradient[k], legs[k] / divisor)),
        degenerate: is_inside & tie,
    }
}
