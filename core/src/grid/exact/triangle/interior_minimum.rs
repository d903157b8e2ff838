//! The minimum inside a polygon: one cell's polynomial on its part of the triangle.
//!
//! With x = a + s u + t v the Hessian by (s, t) is
//!
//! ```text
//! ⎡ uu  uv ⎤   uu = uᵀH u,  uv = uᵀH v,  vv = vᵀH v
//! ⎣ uv  vv ⎦
//! ```
//!
//! 1. **Not convex enough.** On a chord of length l |d| along d with curvature dᵀH d ≤ κ, φ ≥ the lower end value − κ
//!    l²/8. So the deficit is at most κ l²/8 for the best of some d: u, v, w, and v − u·(uv/uu), along which the
//!    curvature is smallest. That one is vv − uv²/uu, the Schur complement of uu, negative for a saddle: then the
//!    minimum is on the boundary.
//! 2. **Monotonic.** Newton's step from the centre is a descent direction. If φ falls along it everywhere, no point
//!    is stationary.
//! 3. **Newton's method**, four steps. If the Hessian is positive definite in the whole cell, φ is convex there and
//!    φ(x) ≥ φ(p) + ∇φ(p)·(x − p): the deficit is at most |∂φ/∂s| + |∂φ/∂t| at the last iterate p. The Hessian is linear
//!    along each axis, and a mean of positive definite matrices is one: the corners of the cell tell.
//!
//! The first two also exclude minima from a part of a cell, but for the bound by the ends of a chord: what is on the border of a part is not
//! known.

use nalgebra::Vector3;

use super::LowestPoint;
use super::cell::Cell;
use super::grid_triangle::GridTriangle;
use crate::grid::exact::polynomial::MixedDerivatives;
use crate::number::{Float, Real};
use crate::rounding::{DIRECTIONAL_DERIVATIVE, HESSIAN_DETERMINANT};
use crate::vector::norm;

/// Newton steps in a cell. A cubic that is convex on the cell is nearly a parabola there.
const NEWTON_STEPS: u32 = 4;

/// The second derivatives by the weights of the triangle's second and third corner.
struct Hessian<R> {
    uu: R,
    uv: R,
    vv: R,
}

impl<R: Float> Hessian<R> {
    fn new(mixed: &MixedDerivatives<R>, [u, v]: [Vector3<R>; 2]) -> Self {
        let (hu, hv) = (mixed.times(u), mixed.times(v));
        Self { uu: hu.dot(&u), uv: hu.dot(&v), vv: hv.dot(&v) }
    }

    fn determinant(&self) -> R {
        self.uu * self.vv - self.uv * self.uv
    }

    fn is_positive_definite(&self) -> bool {
        R::zero() < self.uu && R::zero() < self.determinant()
    }

    /// Weights of u and v in the direction of the smallest curvature among u + r v or v + r u.
    fn flattest(&self) -> [R; 2] {
        match () {
            () if !(R::zero() < self.uu && R::zero() < self.vv) => [R::one(), R::zero()],
            () if self.vv < self.uu => [-self.uv / self.uu, R::one()],
            () => [R::one(), -self.uv / self.vv],
        }
    }

    /// Newton's step −H⁻¹ (∂φ/∂s, ∂φ/∂t).
    fn newton_step(&self, [u, v]: [R; 2]) -> [R; 2] {
        let determinant = self.determinant();
        [(self.uv * v - self.vv * u) / determinant, (self.uv * u - self.uu * v) / determinant]
    }
}

/// Directions in the triangle along which the second derivative may be small: u, v, w and the flattest.
fn flat_directions<R: Float>(hessian: &Hessian<R>, [u, v]: [Vector3<R>; 2]) -> [Vector3<R>; 4] {
    let [s, t] = hessian.flattest();
    [u, v, v - u, u * s + v * t]
}

impl<R: Float> Cell<R> {
    /// Upper bound of (lowest value, that of the polygon's boundary included) − (minimum inside the polygon). Lowers
    /// `lowest` if it finds a point inside.
    pub fn interior_deficit(&self, triangle: &GridTriangle<R>, lowest: &mut LowestPoint<R>) -> R {
        let mixed = self.polynomial.mixed_derivatives(self.center);
        let [u, v] = triangle.edges();
        let hessian = Hessian::new(&mixed, [u, v]);
        let curvature =
            flat_directions(&hessian, [u, v]).into_iter().fold(R::from_f64(f64::INFINITY), |lowest, direction| {
                Real::min(lowest, self.chord_curvature(&mixed, direction))
            });
        let deficit = curvature * R::from_f64(0.125);
        if deficit <= R::zero() || !hessian.is_positive_definite() {
            return deficit;
        }
        if self.falls_along_newton_step(&mixed, &hessian, [u, v]) {
            return R::zero();
        }
        let newton_deficit = self.newton(triangle, lowest);
        if self.is_convex(&mixed, &hessian, [u, v]) { Real::min(deficit, newton_deficit) } else { deficit }
    }

    /// Does the second derivative along some direction, or the first along Newton's step, tell that no minimum is in this part of a cell,
    /// its border included?
    pub fn excludes_minimum(&self, triangle: &GridTriangle<R>) -> bool {
        let mixed = self.polynomial.mixed_derivatives(self.center);
        let edges = triangle.edges();
        let hessian = Hessian::new(&mixed, edges);
        let is_concave = |direction| self.largest_curvature(&mixed, direction) < R::zero();
        flat_directions(&hessian, edges).into_iter().any(is_concave)
            || self.falls_along_newton_step(&mixed, &hessian, edges)
    }

    /// Does φ fall everywhere in the box along Newton's step from its centre? `mixed` and `hessian` are those there.
    fn falls_along_newton_step(
        &self,
        mixed: &MixedDerivatives<R>,
        hessian: &Hessian<R>,
        [u, v]: [Vector3<R>; 2],
    ) -> bool {
        let gradient = self.polynomial.gradient(self.center, mixed);
        let step = hessian.newton_step([gradient.dot(&u), gradient.dot(&v)]);
        let downhill = u * step[0] + v * step[1];
        let (derivative, radius) = self.directional_derivative(gradient, mixed, downhill);
        // The two terms may cancel.
        let length = norm(u) * step[0].abs() + norm(v) * step[1].abs();
        let rounding = norm(gradient) * length * R::from_f64(DIRECTIONAL_DERIVATIVE * R::EPSILON);
        derivative + radius + rounding < R::zero()
    }

    /// Is the Hessian positive definite at all corners of the box, beyond rounding? `mixed` and `hessian` are those at its centre.
    fn is_convex(&self, mixed: &MixedDerivatives<R>, hessian: &Hessian<R>, [u, v]: [Vector3<R>; 2]) -> bool {
        let changes = [self.curvature_change(u, u), self.curvature_change(u, v), self.curvature_change(v, v)];
        let half = self.half_extents;
        let largest =
            mixed.xy.abs() + mixed.yz.abs() + mixed.zx.abs() + self.polynomial.xyz.abs() * (half.x + half.y + half.z);
        let rounding = largest * largest * (u.dot(&u) * v.dot(&v)) * R::from_f64(HESSIAN_DETERMINANT * R::EPSILON);
        (0..8_u32).all(|corner| {
            let sign = |bit: u32| if corner & bit == 0 { -R::one() } else { R::one() };
            let signs = Vector3::new(sign(1), sign(2), sign(4));
            let [uu, uv, vv] = changes.map(|change| change.dot(&signs));
            let hessian = Hessian { uu: hessian.uu + uu, uv: hessian.uv + uv, vv: hessian.vv + vv };
            R::zero() < hessian.uu && rounding < hessian.determinant()
        })
    }

    /// Newton's method from the lowest point so far; lowers `lowest` if it ends inside. Returns the deficit if φ is
    /// convex on the whole box, infinity where the method fails.
    fn newton(&self, triangle: &GridTriangle<R>, lowest: &mut LowestPoint<R>) -> R {
        let [u, v] = triangle.edges();
        let failure = R::from_f64(f64::INFINITY);
        let [_, mut s, mut t] = lowest.weights;
        let mut residual = failure;
        for step in 0..=NEWTON_STEPS {
            let point = triangle.point([R::zero(), s, t]) - self.origin;
            let mixed = self.polynomial.mixed_derivatives(point);
            let gradient = self.polynomial.gradient(point, &mixed);
            let slopes = [gradient.dot(&u), gradient.dot(&v)];
            residual = slopes[0].abs() + slopes[1].abs();
            let hessian = Hessian::new(&mixed, [u, v]);
            if step == NEWTON_STEPS {
                break;
            }
            if !hessian.is_positive_definite() {
                return failure;
            }
            let [ds, dt] = hessian.newton_step(slopes);
            (s, t) = (s + ds, t + dt);
        }
        let point = triangle.point([R::zero(), s, t]) - self.origin;
        if !self.contains(point) {
            return failure;
        }
        let weights = [R::one() - s - t, s, t];
        if !weights.iter().all(|weight| R::zero() <= *weight) {
            // The minimum of the convex φ is outside of the triangle, that of the polygon on its boundary. A point of
            // the triangle differs from (s, t) by at most 1 + |s| + |t|.
            return residual * (R::one() + s.abs() + t.abs());
        }
        let value = self.polynomial.value(point);
        if value < lowest.value {
            (lowest.weights, lowest.value) = (weights, value);
        }
        residual
    }
}
