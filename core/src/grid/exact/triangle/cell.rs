//! A clipped cell with its polynomial: intervals of directional derivatives, and bounds of curvature.
//!
//! With m the centre of the part, |δ_i| ≤ h_i, and H the Hessian at m, the polynomial gives exactly
//!
//! ```text
//! ∇φ(m + δ)  = ∇φ(m) + H δ + c_xyz (δ_y δ_z, δ_z δ_x, δ_x δ_y)
//! ∇φ(m + δ)·d ∈ ∇φ(m)·d ± (Σ_i h_i |(H d)_i| + |c_xyz| Σ_i |d_i| h_j h_k)          mean value form (Moore 1966, ch. 6)
//! aᵀH(m + δ)b ∈ aᵀH b ± |c_xyz| (|a_x b_y + a_y b_x| h_z + |a_y b_z + a_z b_y| h_x + |a_z b_x + a_x b_z| h_y)
//! ```

use nalgebra::Vector3;

use super::directions::{DirectionalBounds, Directions};
use crate::grid::exact::polynomial::{MixedDerivatives, Polynomial};
use crate::number::Float;

/// A box within a cell, and the polynomial there.
#[derive(Clone, Copy)]
pub(super) struct Cell<R: Float> {
    /// The cell's first corner.
    pub origin: Vector3<R>,
    pub polynomial: Polynomial<R>,
    /// m: centre of the box, counted from `origin`.
    pub center: Vector3<R>,
    /// h: half extents of the box.
    pub half_extents: Vector3<R>,
}

/// The terms of the mean value form of ∇φ, by axis.
pub(super) struct MeanValueForm<T> {
    /// ∇φ(m).
    gradient: [T; 3],
    /// H_xy, H_yz and H_zx at m.
    mixed: [T; 3],
    half_extents: [T; 3],
    /// |c_xyz| h_j h_k.
    third_order: [T; 3],
}

impl<R: Float> MeanValueForm<R> {
    /// Interval \[lower, upper\] of ∇φ·d over the box for direction `k`, rounding included.
    #[inline(always)]
    pub fn directional_range(&self, directions: &Directions<R>, k: usize) -> [R; 2] {
        let (x, y, z) = (directions.x[k % 4], directions.y[k % 4], directions.z[k % 4]);
        let ([xy, yz, zx], half, third_order) = (self.mixed, self.half_extents, self.third_order);
        let central = self.gradient[0] * x + self.gradient[1] * y + self.gradient[2] * z;
        let radius = (xy * y + zx * z).abs() * half[0]
            + (xy * x + yz * z).abs() * half[1]
            + (zx * x + yz * y).abs() * half[2]
            + (x.abs() * third_order[0] + y.abs() * third_order[1] + z.abs() * third_order[2])
            + directions.rounding[k % 4];
        [central - radius, central + radius]
    }
}

impl<R: Float> Cell<R> {
    /// Bounds over the whole box, including points that are not in the triangle.
    #[inline(always)]
    pub fn directional_bounds(&self, directions: &Directions<R>) -> DirectionalBounds<R> {
        let form = self.mean_value_form();
        let mut bounds = DirectionalBounds::empty();
        for k in 0..4 {
            [bounds.lower[k], bounds.upper[k]] = form.directional_range(directions, k);
        }
        bounds
    }

    #[inline(always)]
    pub fn mean_value_form(&self) -> MeanValueForm<R> {
        let mixed = self.polynomial.mixed_derivatives(self.center);
        let gradient = self.polynomial.gradient(self.center, &mixed);
        let (half, third_derivative) = (self.half_extents, self.polynomial.xyz.abs());
        MeanValueForm {
            gradient: gradient.into(),
            mixed: [mixed.xy, mixed.yz, mixed.zx],
            half_extents: half.into(),
            third_order: [
                half.y * half.z * third_derivative,
                half.z * half.x * third_derivative,
                half.x * half.y * third_derivative,
            ],
        }
    }

    /// ∇φ·d at m, and the radius of its interval over the box. `gradient` and `mixed` are those at m.
    pub fn directional_derivative(
        &self,
        gradient: Vector3<R>,
        mixed: &MixedDerivatives<R>,
        direction: Vector3<R>,
    ) -> (R, R) {
        let (change, half) = (mixed.times(direction), self.half_extents);
        let third_order = direction.x.abs() * half.y * half.z
            + direction.y.abs() * half.z * half.x
            + direction.z.abs() * half.x * half.y;
        let second_order = change.x.abs() * half.x + change.y.abs() * half.y + change.z.abs() * half.z;
        (gradient.dot(&direction), second_order + self.polynomial.xyz.abs() * third_order)
    }

    /// max(κ, 0)·l², with κ the largest dᵀH d over the box and l ≤ 1 the length of its longest chord along d, in
    /// units of |d|: l = min(1, min_i 2h_i / |d_i|). `mixed` is H at m.
    pub fn chord_curvature(&self, mixed: &MixedDerivatives<R>, direction: Vector3<R>) -> R {
        let curvature = self.largest_curvature(mixed, direction);
        if curvature <= R::zero() {
            return R::zero();
        }
        let axes = direction.iter().zip(&self.half_extents);
        let chord = axes.fold(R::one(), |chord, (component, half)| {
            let (component, extent) = (component.abs(), *half * R::from_f64(2.0));
            if extent < component * chord { extent / component } else { chord }
        });
        curvature * chord * chord
    }

    /// The largest dᵀH d over the box. `mixed` is H at m.
    pub fn largest_curvature(&self, mixed: &MixedDerivatives<R>, direction: Vector3<R>) -> R {
        let change = self.curvature_change(direction, direction);
        mixed.times(direction).dot(&direction) + (change.x.abs() + change.y.abs() + change.z.abs())
    }

    /// Change of aᵀH b from m to the upper face of the box, for each axis. To the lower face it has the other sign.
    pub fn curvature_change(&self, a: Vector3<R>, b: Vector3<R>) -> Vector3<R> {
        let crossed = Vector3::new(a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z, a.x * b.y + a.y * b.x);
        crossed.component_mul(&self.half_extents) * self.polynomial.xyz
    }

    /// Is a point, counted from `origin`, in the box?
    pub fn contains(&self, point: Vector3<R>) -> bool {
        (point - self.center).iter().zip(&self.half_extents).all(|(offset, half)| offset.abs() <= *half)
    }
}
