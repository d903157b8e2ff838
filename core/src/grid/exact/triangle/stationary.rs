//! Bisection of a cell around stationary points of φ along the triangle.
//!
//! Applied to cells that `interior_minimum` leaves undecided. A box of the cell is dropped if the triangle misses it, or if φ is
//! monotonic or concave there along some direction, accepted if a stationary point in it cannot be lower than the lowest
//! value by more than `gap`, and else cut in two.
//!
//! A stationary point s in the box and in the triangle's plane is bounded by Taylor's theorem. With p the projection
//! of the box's centre into the plane and r = |h|, |p − s| ≤ r, so
//!
//! ```text
//! φ(s) ≥ φ(p) − ½ ‖H‖ r²,    ‖H‖ ≤ √(2(H_xy² + H_yz² + H_zx²)) + |c_xyz| √2 r     (Frobenius norm, which bounds the
//! spectral)
//! ```

use nalgebra::Vector3;

use super::LowestPoint;
use super::cell::Cell;
use super::directions::Directions;
use super::grid_triangle::GridTriangle;
use super::separating_planes::SeparatingPlanes;
use crate::number::{Float, Real};

/// Depth of the stack of boxes. The last box is always cut first, so the stack grows by one box per bisection.
const MAX_BOXES: usize = 24;

/// Most boxes examined in a cell.
const MAX_EXAMINED: u32 = 96;

impl<R: Float> Cell<R> {
    /// Upper bound of (lowest value) − (value of a stationary point in the cell). Infinity if the budget is exhausted.
    pub fn stationary_deficit(
        &self,
        triangle: &GridTriangle<R>,
        planes: &SeparatingPlanes<R>,
        directions: &Directions<R>,
        gap: R,
        lowest: &LowestPoint<R>,
    ) -> R {
        let mut boxes = [(self.center, self.half_extents); MAX_BOXES];
        let first = triangle.first_node();
        let (mut count, mut deficit) = (1_usize, R::zero());
        for _ in 0..MAX_EXAMINED {
            let Some(last) = count.checked_sub(1) else { return deficit };
            count = last;
            let Some((center, half_extents)) = boxes.get(last).copied() else { break };
            let part = Self { center, half_extents, ..*self };
            if planes.is_disjoint(part.origin - first + part.center, part.half_extents)
                || part.directional_bounds(directions).is_monotonic()
                || part.excludes_minimum(triangle)
            {
                continue;
            }
            let excess = part.excess_over_stationary(triangle, lowest);
            if excess <= gap {
                deficit = Real::max(deficit, excess);
                continue;
            }
            let Some([a, b, ..]) = boxes.get_mut(last..) else { break };
            [*a, *b] = part.bisect();
            count = count.saturating_add(2);
        }
        R::from_f64(f64::INFINITY)
    }

    /// Upper bound of (lowest value) − φ(s) for a stationary point s in the box: see the module header.
    fn excess_over_stationary(&self, triangle: &GridTriangle<R>, lowest: &LowestPoint<R>) -> R {
        let normal_sq = triangle.normal.dot(&triangle.normal);
        let height = triangle.normal.dot(&(self.origin + self.center - triangle.corners[0]));
        let from_plane = if R::zero() < normal_sq { triangle.normal * (height / normal_sq) } else { Vector3::zeros() };
        let mixed = self.polynomial.mixed_derivatives(self.center);
        let radius_sq = self.half_extents.dot(&self.half_extents);
        let [xy, yz, zx] = [mixed.xy, mixed.yz, mixed.zx];
        let hessian_norm = Real::sqrt((xy * xy + yz * yz + zx * zx) * R::from_f64(2.0))
            + self.polynomial.xyz.abs() * Real::sqrt(radius_sq * R::from_f64(2.0));
        lowest.value - self.polynomial.value(self.center - from_plane) + hessian_norm * radius_sq * R::from_f64(0.5)
    }

    /// Centres and half extents of the two halves across the longest side.
    fn bisect(&self) -> [(Vector3<R>, Vector3<R>); 2] {
        let half = self.half_extents;
        let axis = if half.x < half.y {
            if half.y < half.z { 2 } else { 1 }
        } else if half.x < half.z {
            2
        } else {
            0
        };
        let quarter = Vector3::from_fn(|k, _| if k == axis { half[k % 3] * R::from_f64(0.5) } else { R::zero() });
        [quarter, -quarter].map(|offset| (self.center + offset, half - quarter))
    }
}
