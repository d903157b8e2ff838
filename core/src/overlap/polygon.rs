//! A convex polygon in a plane: a square that half-spaces clip (Sutherland and Hodgman 1974, "Reentrant polygon
//! clipping"), its area and its centroid.

use nalgebra::Vector3;

use crate::number::{Float, Real};
use crate::vector::norm;

/// Four of a square, and one more for each of up to eight half-spaces.
const MAX_CORNERS: usize = 12;

/// Corners relative to a point of the plane.
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
    /// The square with a unit normal whose sides are `half` from its centre. The opposite normal gives the same square,
    /// bit for bit.
    pub fn square(normal: Vector3<R>, half: R) -> Self {
        let largest = normal.iter().fold(R::zero(), |max, x| if max.abs() < x.abs() { *x } else { max });
        let normal = normal * largest.sign();
        let [x, y, z]: [R; 3] = normal.map(R::abs).into();
        let (one, zero) = (R::one(), R::zero());
        let axis = match () {
            () if x <= y && x <= z => Vector3::new(one, zero, zero),
            () if y <= z => Vector3::new(zero, one, zero),
            () => Vector3::new(zero, zero, one),
        };
        let u = axis.cross(&normal);
        let u = u * (half / norm(u));
        let v = normal.cross(&u);
        let mut corners = [Vector3::zeros(); MAX_CORNERS];
        let square = [u + v, v - u, -u - v, u - v];
        corners.iter_mut().zip(square).for_each(|(slot, corner)| *slot = corner);
        Self { corners, count: 4 }
    }

    /// The part with normal · x ≤ offset.
    pub fn clip(&self, normal: Vector3<R>, offset: R) -> Self {
        let mut clipped = Self { corners: [Vector3::zeros(); MAX_CORNERS], count: 0 };
        let corners = || self.corners.iter().take(self.count);
        for (from, to) in corners().zip(corners().cycle().skip(1)) {
            let (excess, next_excess) = (normal.dot(from) - offset, normal.dot(to) - offset);
            if excess <= R::zero() {
                clipped.push(*from);
            }
            if (excess <= R::zero()) != (next_excess <= R::zero()) {
                clipped.push(from + (to - from) * (excess / (excess - next_excess)));
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

    /// Area and centroid, from the triangles of a fan about the first corner; `None` if the area is zero.
    pub fn extent(&self) -> Option<Extent<R>> {
        let (first, rest) = self.corners.get(..self.count)?.split_first()?;
        let (mut doubled_area, mut moment) = (R::zero(), Vector3::zeros());
        for (a, b) in rest.iter().zip(rest.iter().skip(1)) {
            let doubled = norm((a - first).cross(&(b - first)));
            doubled_area += doubled;
            moment += (a - first + b - first) * (doubled * R::from_f64(1.0 / 3.0));
        }
        let area = doubled_area * R::from_f64(0.5);
        (R::zero() < area).then(|| Extent { area, centroid: first + moment / doubled_area })
    }
}
