use nalgebra::Vector3;

use crate::grid::exact::polynomial::Polynomial;
use crate::number::{Float, Real};

/// The coefficients of 1, s, s² and s³.
pub(super) struct Cubic<R>([R; 4]);

impl<R: Float> Cubic<R> {
    /// A cell's interpolant at `start` + s · `way`, both counted in cells from its first corner.
    #[inline(always)]
    pub fn along(corners: [R; 8], start: Vector3<R>, way: Vector3<R>) -> Self {
        let Polynomial { constant, linear, xy, yz, zx, xyz } = Polynomial::new(corners);
        let (x, y, z) = (linear.x, linear.y, linear.z);
        let (sx, sy, sz) = (start.x, start.y, start.z);
        let (wx, wy, wz) = (way.x, way.y, way.z);
        let value =
            constant + x * sx + y * sy + z * sz + xy * sx * sy + yz * sy * sz + zx * sz * sx + xyz * sx * sy * sz;
        let slope = (x + xy * sy + zx * sz + xyz * sy * sz) * wx
            + (y + xy * sx + yz * sz + xyz * sz * sx) * wy
            + (z + yz * sy + zx * sx + xyz * sx * sy) * wz;
        let bend = (xy + xyz * sz) * wx * wy + (yz + xyz * sx) * wy * wz + (zx + xyz * sy) * wz * wx;
        Self([value, slope, bend, xyz * wx * wy * wz])
    }

    #[inline(always)]
    fn at(&self, s: R) -> R {
        let [d, c, b, a] = self.0;
        d + s * (c + s * (b + s * a))
    }

    /// Where s is from 0 to 1, and the value there: at an end, or where the derivative, a quadratic, has its upward zero.
    #[inline(always)]
    pub fn least(&self) -> (R, R) {
        let [_, c, b, a] = self.0;
        let (start, end) = (self.at(R::zero()), self.at(R::one()));
        let is_end = end < start;
        let (share, value) = (R::select(is_end, R::one(), R::zero()), R::select(is_end, end, start));
        // Of the two zeros the one where the derivative rises, in the form that does not cancel. Without one the root is no
        // number, and no comparison with it holds.
        let root = Real::sqrt(b * b - R::from_f64(3.0) * a * c);
        let is_convex = R::zero() < b;
        let numerator = R::select(is_convex, -c, root - b);
        let divisor = R::select(is_convex, b + root, R::from_f64(3.0) * a);
        let between = numerator / divisor;
        let there = self.at(between);
        let is_lower = (R::zero() < numerator * divisor) & (numerator.abs() < divisor.abs()) & (there < value);
        (R::select(is_lower, between, share), R::select(is_lower, there, value))
    }
}
