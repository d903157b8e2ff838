use nalgebra::Vector3;

use super::cell::Cell;
use super::face::Face;
use crate::grid::exact::polynomial::MixedDerivatives;
use crate::grid::exact::segment::Lowest;
use crate::number::{Float, Real};
use crate::rounding::DIRECTIONAL_DERIVATIVE;
use crate::vector::norm;

/// Steps of Newton's method inside of a cell: a cubic that is curved upwards is nearly a parabola there.
const STEPS: u32 = 4;

/// The second derivatives along the triangle, by the weights of its second and third corner.
pub(super) struct Hessian<R> {
    uu: R,
    uv: R,
    vv: R,
}

impl<R: Float> Hessian<R> {
    fn new(bends: &MixedDerivatives<R>, [u, v]: [Vector3<R>; 2]) -> Self {
        let (by_u, by_v) = (bends.times(u), bends.times(v));
        Self { uu: by_u.dot(&u), uv: by_u.dot(&v), vv: by_v.dot(&v) }
    }

    fn determinant(&self) -> R {
        self.uu * self.vv - self.uv * self.uv
    }

    fn is_positive_definite(&self) -> bool {
        R::zero() < self.uu && R::zero() < self.determinant()
    }

    /// Where a function with these slopes is level, as steps by the weights.
    fn step(&self, [u, v]: [R; 2]) -> [R; 2] {
        let determinant = self.determinant();
        [(self.uv * v - self.vv * u) / determinant, (self.uv * u - self.uu * v) / determinant]
    }
}

impl<R: Float> Cell<R> {
    /// By how much a value inside of the polygon may be less than what was found, or is on its boundary.
    pub fn least_inside(&self, face: &Face<R>, found: &mut Lowest<R>) -> R {
        let bends = self.field.bends(self.middle);
        let [u, v] = face.sides();
        let hessian = Hessian::new(&bends, [u, v]);
        // Of a saddle the way along which it curves downwards the most, over one of the edges.
        let other = match () {
            () if !(R::zero() < hessian.uu && R::zero() < hessian.vv) => u,
            () if hessian.vv < hessian.uu => v - u * (hessian.uv / hessian.uu),
            () => u - v * (hessian.uv / hessian.vv),
        };
        let bend = [u, v, v - u, other]
            .into_iter()
            .fold(R::from_f64(f64::INFINITY), |least, way| Real::min(least, self.bend(&bends, way)));
        let deficit = bend * R::from_f64(0.125);
        if deficit <= R::zero() || !hessian.is_positive_definite() {
            return deficit;
        }
        let gradient = self.field.gradient(self.middle, &bends);
        let step = hessian.step([gradient.dot(&u), gradient.dot(&v)]);
        let downhill = u * step[0] + v * step[1];
        let (rise, spread) = self.rise(gradient, &bends, downhill);
        let rounding = norm(gradient) * norm(downhill) * R::from_f64(DIRECTIONAL_DERIVATIVE * R::EPSILON);
        if rise + spread + rounding < R::zero() {
            return R::zero();
        }
        let off = self.newton(face, found);
        let least_hessian = Hessian {
            uu: hessian.uu - self.more_bend(u, u),
            uv: hessian.uv.abs() + self.more_bend(u, v),
            vv: hessian.vv - self.more_bend(v, v),
        };
        if least_hessian.is_positive_definite() { Real::min(deficit, off) } else { deficit }
    }

    /// From what was found to where the field is level. Of a bowl that is all of the part, it answers how much the least may
    /// be below what was found.
    fn newton(&self, face: &Face<R>, found: &mut Lowest<R>) -> R {
        let [u, v] = face.sides();
        let unknown = R::from_f64(f64::INFINITY);
        let [_, mut s, mut t] = found.weights;
        let mut off = unknown;
        for step in 0..=STEPS {
            let at = face.point([R::zero(), s, t]) - self.first;
            let bends = self.field.bends(at);
            let gradient = self.field.gradient(at, &bends);
            let slopes = [gradient.dot(&u), gradient.dot(&v)];
            off = slopes[0].abs() + slopes[1].abs();
            let hessian = Hessian::new(&bends, [u, v]);
            if step == STEPS {
                break;
            }
            if !hessian.is_positive_definite() {
                return unknown;
            }
            let by = hessian.step(slopes);
            (s, t) = (s + by[0], t + by[1]);
        }
        let at = face.point([R::zero(), s, t]) - self.first;
        if !self.holds(at) {
            return unknown;
        }
        let weights = [R::one() - s - t, s, t];
        if !weights.iter().all(|weight| R::zero() <= *weight) {
            // The least of the bowl is outside of the triangle, and so that of the polygon is on its boundary.
            return off * (R::one() + s.abs() + t.abs());
        }
        let value = self.field.value(at);
        if value < found.value {
            (found.weights, found.value) = (weights, value);
        }
        off
    }
}
