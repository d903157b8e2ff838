use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::vector::norm;

/// Of a square that eight half-spaces cut, one corner more each.
const MAX_CORNERS: usize = 12;

/// A convex polygon in a plane, by corners relative to a point of it.
#[derive(Clone, Copy)]
pub(super) struct Polygon<R> {
    corners: [Vector3<R>; MAX_CORNERS],
    count: usize,
}

pub(super) struct Extent<R: Real> {
    pub area: R,
    pub centroid: Vector3<R>,
}

impl<R: Float> Polygon<R> {
    /// A square across a unit normal, that reaches `half` to all sides; of the opposite normal the very same.
    pub fn square(normal: Vector3<R>, half: R) -> Self {
        let largest = normal.iter().fold(R::zero(), |most, along| if most.abs() < along.abs() { *along } else { most });
        let normal = normal * largest.sign();
        let [x, y, z]: [R; 3] = normal.map(R::abs).into();
        let (one, zero) = (R::one(), R::zero());
        let axis = match () {
            () if x <= y && x <= z => Vector3::new(one, zero, zero),
            () if y <= z => Vector3::new(zero, one, zero),
            () => Vector3::new(zero, zero, one),
        };
        let across = axis.cross(&normal);
        let across = across * (half / norm(across));
        let along = normal.cross(&across);
        let mut corners = [Vector3::zeros(); MAX_CORNERS];
        let square = [across + along, along - across, -across - along, across - along];
        corners.iter_mut().zip(square).for_each(|(corner, of_square)| *corner = of_square);
        Self { corners, count: 4 }
    }

    /// What of it has slope · x ≤ most (Sutherland and Hodgman 1974, "Reentrant polygon clipping").
    pub fn clip(&self, slope: Vector3<R>, most: R) -> Self {
        let mut clipped = Self { corners: [Vector3::zeros(); MAX_CORNERS], count: 0 };
        let corners = || self.corners.iter().take(self.count);
        for (from, to) in corners().zip(corners().cycle().skip(1)) {
            let (over, next_over) = (slope.dot(from) - most, slope.dot(to) - most);
            if over <= R::zero() {
                clipped.push(*from);
            }
            if (over <= R::zero()) != (next_over <= R::zero()) {
                clipped.push(from + (to - from) * (over / (over - next_over)));
            }
        }
        clipped
    }

    fn push(&mut self, corner: Vector3<R>) {
        if let Some(slot) = self.corners.get_mut(self.count) {
            *slot = corner;
            self.count = self.count.wrapping_add(1);
        }
    }

    /// `None` where nothing is left.
    pub fn extent(&self) -> Option<Extent<R>> {
        let (first, rest) = self.corners.get(..self.count)?.split_first()?;
        let (mut twice, mut sum) = (R::zero(), Vector3::zeros());
        for (a, b) in rest.iter().zip(rest.iter().skip(1)) {
            let of_triangle = norm((a - first).cross(&(b - first)));
            twice += of_triangle;
            sum += (a - first + b - first) * (of_triangle * R::from_f64(1.0 / 3.0));
        }
        let area = twice * R::from_f64(0.5);
        (R::zero() < area).then(|| Extent { area, centroid: first + sum / twice })
    }
}
