//! From eight points at once, roughly in f32, how near a triangle can be to all that is around them.
//!
//! Whatever its errors, what is found is sure: a point of the triangle is an upper bound, wherever it lies on it; and the
//! triangle lies behind the plane across any direction through its foremost corner, a lower bound for all points around.

use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use crate::rounding::{APPROX_DISTANCE_ROUNDING, MIN_SQ_F32};
use crate::simd::{LANES, Lanes, VectorX8, dot, lane_of, max, sub};
use crate::triangle::is_sliver;

/// Where f32 is at home: a mesh from -1 to 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct UnitFrame {
    middle: Vector3<f64>,
    pub inv_length: f64,
}

/// A triangle in a [`UnitFrame`], and what of its nearest point does not depend on where it is seen from.
#[derive(Clone, Copy)]
pub(crate) struct ApproxTriangle {
    pub is_sliver: bool,
    a: [f32; 3],
    ab: [f32; 3],
    ac: [f32; 3],
    ab_sq: f32,
    ac_sq: f32,
    ab_ac: f32,
    inv_ab_sq: f32,
    inv_ac_sq: f32,
    inv_bc_sq: f32,
    inv_area_sq: f32,
}

/// A triangle as seen from eight points. Without the length of the way, whose root would have to be waited for.
#[derive(Clone, Copy)]
pub(crate) struct ApproxDistance {
    /// From a point of the triangle, near to the nearest.
    pub way: VectorX8<f32>,
    /// So the triangle is no farther than its root, but for rounding.
    pub way_sq: Lanes<f32>,
    /// From a point at v from the point itself, the triangle is no nearer than (`along` + v · `way`) / |`way`|, but for rounding.
    /// Zero, and then it says nothing, where the way is shorter than 1e-18.
    pub along: Lanes<f32>,
}

impl UnitFrame {
    pub fn around(bounds: &Aabb) -> Self {
        let middle = Vector3::from_fn(|axis, _| 0.5 * bounds.min[axis] + 0.5 * bounds.max[axis]);
        Self { middle, inv_length: 2.0 / bounds.longest_side() }
    }

    pub fn scaled(&self, point: Vector3<f64>) -> Vector3<f64> {
        (point - self.middle) * self.inv_length
    }

    #[inline(always)]
    pub fn local(&self, point: Vector3<f64>) -> [f32; 3] {
        [0, 1, 2].map(|axis: usize| ((point[axis] - self.middle[axis]) * self.inv_length) as f32)
    }

    /// What bounds are off by at most, seen from points up to `reach` along each axis.
    pub fn rounding(reach: f32) -> f32 {
        APPROX_DISTANCE_ROUNDING * (1.0 + reach)
    }
}

impl ApproxTriangle {
    pub fn new(corners: [Vector3<f64>; 3], frame: &UnitFrame) -> Self {
        let [a, b, c] = corners.map(|corner| frame.local(corner));
        let [ab, ac] = [sub(b, a), sub(c, a)];
        let [ab_sq, ac_sq, ab_ac] = [dot(ab, ab), dot(ac, ac), dot(ab, ac)];
        let area_sq = ab_sq * ac_sq - ab_ac * ab_ac;
        Self {
            is_sliver: is_sliver(corners),
            a,
            ab,
            ac,
            ab_sq,
            ac_sq,
            ab_ac,
            inv_ab_sq: inverse(ab_sq),
            inv_ac_sq: inverse(ac_sq),
            inv_bc_sq: inverse(ab_sq + ac_sq - 2.0 * ab_ac),
            // Without an area nothing is inside: all comparisons fail.
            inv_area_sq: if area_sq > MIN_SQ_F32 { 1.0 / area_sq } else { f32::NAN },
        }
    }

    pub fn first_corner(&self) -> [f32; 3] {
        self.a
    }

    #[inline(always)]
    pub fn corners(&self) -> [[f32; 3]; 3] {
        let from_a = |way: [f32; 3]| [self.a[0] + way[0], self.a[1] + way[1], self.a[2] + way[2]];
        [self.a, from_a(self.ab), from_a(self.ac)]
    }

    /// Of a ball around it. A third of the longest edge's square is enough (Jung's theorem), but for rounding.
    #[inline(always)]
    pub fn radius_sq(&self) -> f32 {
        0.34 * max(max(self.ab_sq, self.ac_sq), self.ab_sq + self.ac_sq - 2.0 * self.ab_ac)
    }

    #[inline(always)]
    pub fn seen_from(&self, points: &VectorX8<f32>) -> ApproxDistance {
        let mut seen = ApproxDistance { way: [[0.0; LANES]; 3], way_sq: [0.0; LANES], along: [0.0; LANES] };
        for lane in 0..LANES {
            let from_a = sub(lane_of(points, lane), self.a);
            let [along_ab, along_ac] = self.nearest_weights(dot(self.ab, from_a), dot(self.ac, from_a));
            let way = |axis: usize| from_a[axis] - (self.ab[axis] * along_ab + self.ac[axis] * along_ac);
            let way = [way(0), way(1), way(2)];
            let way_sq = dot(way, way);
            let foremost = max(max(dot(self.ab, way), dot(self.ac, way)), 0.0);
            let along = dot(from_a, way) - foremost;
            seen.way_sq[lane] = way_sq;
            seen.along[lane] = if way_sq > MIN_SQ_F32 { along } else { 0.0 };
            for axis in 0..3 {
                seen.way[axis][lane] = way[axis];
            }
        }
        seen
    }

    /// Of a point's nearest on the triangle, about: its weights of b and c.
    #[inline(always)]
    fn nearest_weights(&self, d1: f32, d2: f32) -> [f32; 2] {
        let inside_ab = (self.ac_sq * d1 - self.ab_ac * d2) * self.inv_area_sq;
        let inside_ac = (self.ab_sq * d2 - self.ab_ac * d1) * self.inv_area_sq;
        let is_inside = (inside_ab >= 0.0) & (inside_ac >= 0.0) & (inside_ab + inside_ac <= 1.0);
        let on_ab = clamp(d1 * self.inv_ab_sq);
        let on_ac = clamp(d2 * self.inv_ac_sq);
        let on_bc = clamp((d2 - d1 + self.ab_sq - self.ab_ac) * self.inv_bc_sq);
        // The squared distances to points on the edges, less that to a.
        let of_ab = on_ab * (on_ab * self.ab_sq - 2.0 * d1);
        let of_ac = on_ac * (on_ac * self.ac_sq - 2.0 * d2);
        let rest = 1.0 - on_bc;
        let of_bc = rest * (rest * self.ab_sq - 2.0 * d1)
            + on_bc * (on_bc * self.ac_sq - 2.0 * d2)
            + 2.0 * on_bc * rest * self.ab_ac;
        let is_ac = of_ac < of_ab;
        let [of_edge, edge_ab, edge_ac] =
            [if is_ac { of_ac } else { of_ab }, if is_ac { 0.0 } else { on_ab }, if is_ac { on_ac } else { 0.0 }];
        let is_bc = of_bc < of_edge;
        let [edge_ab, edge_ac] = [if is_bc { rest } else { edge_ab }, if is_bc { on_bc } else { edge_ac }];
        [if is_inside { inside_ab } else { edge_ab }, if is_inside { inside_ac } else { edge_ac }]
    }
}

/// Zero of what has no length: its points are all the same.
#[inline(always)]
fn inverse(square: f32) -> f32 {
    if square > MIN_SQ_F32 { 1.0 / square } else { 0.0 }
}

#[inline(always)]
fn clamp(share: f32) -> f32 {
    let share = max(share, 0.0);
    if share < 1.0 { share } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{random, random_vector};
    use crate::triangle::nearest_on_triangle;

    #[test]
    fn a_triangle_is_between_its_bounds_from_all_points_around() {
        let mut state = 23;
        println!("seed {state}");
        let frame = UnitFrame { middle: Vector3::zeros(), inv_length: 1.0 };
        for round in 0..20_000 {
            let size = [1.0, 0.1, 1e-3, 0.0][round % 4];
            let thickness = [1.0, 1e-3, 1e-6, 0.0][round / 4 % 4];
            let distance = [0.001, 1.0, 50.0, 1e4][round / 16 % 4];
            let a = random_vector(&mut state) * 0.5;
            let b = a + random_vector(&mut state) * (0.5 * size);
            let c = a + (b - a) * random(&mut state) + random_vector(&mut state) * (0.1 * size * thickness);
            let corners = [a, b, c];
            let points: [Vector3<f64>; LANES] =
                std::array::from_fn(|_| (a + random_vector(&mut state) * distance).map(|x| f64::from(x as f32)));
            let lanes = [0, 1, 2].map(|axis| points.map(|point| point[axis] as f32));
            let seen = ApproxTriangle::new(corners, &frame).seen_from(&lanes);
            for (lane, point) in points.into_iter().enumerate() {
                let step = random_vector(&mut state) * (0.3 * distance);
                let rounding = f64::from(UnitFrame::rounding((point.abs() + step.abs()).max() as f32));
                let at_point = nearest_on_triangle(point, corners).distance_sq.sqrt();
                let length = f64::from(seen.way_sq[lane]).sqrt();
                assert!(length + rounding >= at_point, "{corners:?} {point:?}");
                let there = nearest_on_triangle(point + step, corners).distance_sq.sqrt();
                let way = Vector3::from_fn(|axis, _| f64::from(seen.way[axis][lane]));
                let least = (f64::from(seen.along[lane]) + way.dot(&step)) / length;
                assert!(
                    length < 1e-18 || least - rounding <= there,
                    "{corners:?} {point:?} {step:?}: {least} > {there}"
                );
            }
        }
    }
}
