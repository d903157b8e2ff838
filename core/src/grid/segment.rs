use nalgebra::Vector3;

use super::polynomial::Polynomial;
use super::{Grid, Storage};
use crate::real::{Float, Real};
use crate::survey::bounds;
use crate::vector::lift;

/// Where on a segment a field is least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SegmentMinimum<R> {
    /// Of the way from the first end to the second.
    pub share: R,
    /// φ there, but for rounding.
    pub value: R,
    /// How many cells were looked at.
    pub looks: u32,
}

/// A segment through more cells is not followed: asked piece by piece, most of it is dropped at once.
const MOST_CELLS: u32 = 256;

impl<S: Storage> Grid<S> {
    /// Cell by cell: on a straight line a trilinear interpolant is a cubic, whose least value on an interval is at an end or
    /// where its derivative, a quadratic, has its upward zero. `None` where the segment leaves the box or meets many cells.
    pub(super) fn least_on<R: Float>(&self, ends: [Vector3<R>; 2]) -> Option<SegmentMinimum<R>> {
        if !self.lattice.bounds().encloses(&bounds(&ends)) {
            return None;
        }
        let way = (ends[1] - ends[0]) * R::lift(self.lattice.per_spacing());
        self.follow(self.in_cells(ends[0]), way, R::lift(f64::INFINITY))
    }

    /// Counted in cells from the first node.
    pub(super) fn in_cells<R: Float>(&self, point: Vector3<R>) -> Vector3<R> {
        (point - lift(self.lattice.origin())) * R::lift(self.lattice.per_spacing())
    }

    /// From a point over a way, both counted in cells. Where no value is below `known`, that is the value and its place is
    /// of no account.
    pub(super) fn follow<R: Float>(&self, from: Vector3<R>, way: Vector3<R>, known: R) -> Option<SegmentMinimum<R>> {
        let last = lift::<R>(self.lattice.cells().map(f64::from)).map(|cells| cells - R::one());
        let mut least = SegmentMinimum { share: R::zero(), value: known, looks: 0 };
        let mut entry = R::zero();
        // Where it enters a cell through a face, the point itself cannot tell on which side of it the cell lies.
        let mut cell = from.zip_map(&last, |x, last| Real::min(x.trunc(), last));
        let leaves_at = |cell: R, last: R, from: R, way: R| {
            // The face of the box is never left through: rounding alone leads there.
            let is_at_box = if way < R::zero() { cell <= R::zero() } else { last <= cell };
            let face = if way < R::zero() { cell } else { cell + R::one() };
            if way == R::zero() || is_at_box { R::lift(f64::INFINITY) } else { (face - from) / way }
        };
        let mut leaves = Vector3::from_fn(|k, _| leaves_at(cell[k], last[k], from[k], way[k]));
        while least.looks < MOST_CELLS {
            let exit = leaves.iter().fold(R::one(), |exit, leaves| Real::min(exit, Real::max(*leaves, entry)));
            let corners = R::gather(cell.into(), |cell| self.storage.corners(cell));
            least.looks = least.looks.saturating_add(1);
            // The interpolant is never below all of its corners, if they are numbers.
            if !corners.iter().all(|sample| least.value <= *sample && sample.is_finite()) {
                let cubic = Cubic::along(corners, from + way * entry - cell, way * (exit - entry));
                let (share, value) = cubic.least();
                // Where a sample is no number, nothing is certain.
                if !value.is_finite() {
                    return None;
                }
                if value < least.value {
                    (least.share, least.value) = (entry + (exit - entry) * share, value);
                }
            }
            if R::one() <= exit {
                return Some(least);
            }
            for k in 0..3 {
                if leaves[k % 3] <= exit {
                    cell[k % 3] += way[k % 3].sign();
                    leaves[k % 3] = leaves_at(cell[k % 3], last[k % 3], from[k % 3], way[k % 3]);
                }
            }
            entry = exit;
        }
        None
    }
}

/// The coefficients of 1, s, s² and s³.
struct Cubic<R>([R; 4]);

impl<R: Float> Cubic<R> {
    /// A cell's interpolant at `start` + s · `way`, both counted in cells from its first corner.
    fn along(corners: [R; 8], start: Vector3<R>, way: Vector3<R>) -> Self {
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

    fn at(&self, s: R) -> R {
        let [d, c, b, a] = self.0;
        d + s * (c + s * (b + s * a))
    }

    /// Where s is from 0 to 1, and the value there.
    fn least(&self) -> (R, R) {
        let [_, c, b, a] = self.0;
        let lower = |least: (R, R), s: R| {
            let value = self.at(s);
            if value < least.1 { (s, value) } else { least }
        };
        let ends = lower((R::zero(), self.at(R::zero())), R::one());
        let discriminant = b * b - R::lift(3.0) * a * c;
        if discriminant < R::zero() {
            return ends;
        }
        // Of the two zeros the one where the derivative rises, in the form that does not cancel.
        let root = Real::sqrt(discriminant);
        let (numerator, divisor) = if R::zero() < b { (-c, b + root) } else { (root - b, R::lift(3.0) * a) };
        let is_between = R::zero() < numerator * divisor && numerator.abs() < divisor.abs();
        if is_between { lower(ends, numerator / divisor) } else { ends }
    }
}
