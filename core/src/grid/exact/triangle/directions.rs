use nalgebra::Vector3;

use super::face::Face;
use crate::number::{Float, Real};
use crate::rounding::{DIRECTIONAL_DERIVATIVE, MIN_SINE_SQ};

/// Ways along the triangle: from the first corner to the second and to the third, from the second to the third, and
/// uphill from the middle. Each axis for itself, so that a processor takes several at once.
pub(super) struct Directions<R> {
    pub x: [R; 4],
    pub y: [R; 4],
    pub z: [R; 4],
    /// What a rise over each may be off by rounding.
    pub rounding: [R; 4],
}

impl<R: Float> Directions<R> {
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new(face: &Face<R>, gradient: Vector3<R>, slope_bound: R) -> Self {
        let [a, b, c] = face.corners;
        let (u, v, normal) = (b - a, c - a, face.normal);
        let square = normal.dot(&normal);
        // Of a sliver rounding alone may tell where it lies.
        let is_valid = u.dot(&u) * v.dot(&v) * R::from_f64(MIN_SINE_SQ) < square;
        let uphill = if is_valid { gradient - normal * (normal.dot(&gradient) / square) } else { Vector3::zeros() };
        let along = [u, v, c - b, uphill];
        let part = slope_bound * R::from_f64(DIRECTIONAL_DERIVATIVE * R::EPSILON);
        Self {
            x: along.map(|way| way.x),
            y: along.map(|way| way.y),
            z: along.map(|way| way.z),
            rounding: along.map(|way| (way.x.abs() + way.y.abs() + way.z.abs()) * part),
        }
    }
}

/// The least and the most that φ rises over each of the [`Directions`], as fast as it does anywhere in a part of the grid.
#[derive(Clone, Copy)]
pub(super) struct DirectionalBounds<R> {
    pub least: [R; 4],
    pub most: [R; 4],
}

impl<R: Float> DirectionalBounds<R> {
    pub fn none() -> Self {
        Self { least: [R::from_f64(f64::INFINITY); 4], most: [R::from_f64(f64::NEG_INFINITY); 4] }
    }

    /// Whether φ is not level along some way.
    #[inline(always)]
    pub fn is_steep(&self) -> bool {
        let of_way = |way: usize| R::zero() < self.least[way % 4] || self.most[way % 4] < R::zero();
        of_way(0) || of_way(1) || of_way(2) || of_way(3)
    }

    /// What no value on the way between two points of these values is below: the field falls no faster from either.
    pub fn least_between(&self, way: usize, [from, to]: [R; 2]) -> R {
        let (fall, rise) = (self.least[way % 4], self.most[way % 4]);
        let share = Real::clamp((to - from - rise) / (fall - rise), R::zero(), R::one());
        Real::min(from + fall * share, to - rise * (R::one() - share))
    }

    /// The most that φ falls from the mean of the corners, as a rise.
    pub fn fall(&self) -> R {
        let [[u, v, w, _], [most_u, most_v, most_w, _]] = [self.least, self.most];
        Real::min(-most_u - most_v, Real::min(u - most_w, v + w)) * R::from_f64(1.0 / 3.0)
    }
}
