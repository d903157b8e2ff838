use nalgebra::Vector3;

use super::cell::Cell;
use super::directions::Directions;
use super::face::Face;
use crate::grid::exact::segment::Lowest;
use crate::number::{Float, Real};

/// Parts of a cell that wait to be looked at. The last is always cut first, so it is one for each cut of the smallest.
const MAX_PARTS: usize = 24;

/// How many parts of a cell are looked at.
const MAX_CUTS: u32 = 96;

impl<R: Float> Cell<R> {
    /// By how much a value where the field is level along the triangle may be less than what was found: part by part, each
    /// cut in two until it holds no such point, or is so small that the field cannot have fallen by much on the way to it.
    pub fn minimum_near_stationary(
        &self,
        face: &Face<R>,
        directions: &Directions<R>,
        gap: R,
        found: &mut Lowest<R>,
    ) -> R {
        let mut parts = [(self.middle, self.half); MAX_PARTS];
        let (mut count, mut deficit) = (1_usize, R::zero());
        for _ in 0..MAX_CUTS {
            let Some(last) = count.checked_sub(1) else { return deficit };
            count = last;
            let Some((middle, half)) = parts.get(last).copied() else { break };
            let part = Self { middle, half, ..*self };
            if face.separating_planes.is_disjoint(part.first + part.middle, part.half)
                || part.directional_bounds(directions).is_steep()
            {
                continue;
            }
            let below = part.excess_over_stationary(face, found);
            if below <= gap {
                deficit = Real::max(deficit, below);
                continue;
            }
            let Some([a, b, ..]) = parts.get_mut(last..) else { break };
            [*a, *b] = part.halves();
            count = count.saturating_add(2);
        }
        R::from_f64(f64::INFINITY)
    }

    /// Where the field is level its value is less than at another point by no more than half of what it curves by over the way
    /// between: here from where the middle meets the triangle's plane.
    fn excess_over_stationary(&self, face: &Face<R>, found: &Lowest<R>) -> R {
        let square = face.normal.dot(&face.normal);
        let height = face.normal.dot(&(self.first + self.middle - face.corners[0]));
        let off = if R::zero() < square { face.normal * (height / square) } else { Vector3::zeros() };
        let bends = self.field.bends(self.middle);
        let radius_sq = self.half.dot(&self.half);
        // The length of the matrix bounds how much it stretches.
        let [xy, yz, zx] = [bends.xy, bends.yz, bends.zx];
        let bend = Real::sqrt((xy * xy + yz * yz + zx * zx) * R::from_f64(2.0))
            + self.field.xyz.abs() * Real::sqrt(radius_sq * R::from_f64(2.0));
        found.value - self.field.value(self.middle - off) + bend * radius_sq * R::from_f64(0.5)
    }

    /// In two across its longest side.
    fn halves(&self) -> [(Vector3<R>, Vector3<R>); 2] {
        let half = self.half;
        let axis = if half.x < half.y {
            if half.y < half.z { 2 } else { 1 }
        } else if half.x < half.z {
            2
        } else {
            0
        };
        let quarter = Vector3::from_fn(|k, _| if k == axis { half[k % 3] * R::from_f64(0.5) } else { R::zero() });
        [quarter, -quarter].map(|to| (self.middle + to, half - quarter))
    }
}
