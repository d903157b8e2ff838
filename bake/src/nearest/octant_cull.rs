//! Eight cubes, for each a point of the mesh near it, and in f32 whether something else may be nearer to a point of the cube.
//!
//! With v from the middle c of a cube to a point x of it, along each axis no more than s, and p the point of the mesh,
//! |x − t|² − |x − p|² = |c − t|² − |c − p|² + 2v·(p − t) ≥ |c − t|² − 2s |p − t|₁ − |c − p|². Where that is positive for every point
//! t of a triangle, the triangle is nearest to no point of the cube.

use crate::bvh::bounding_disc::BoundingDisc;
use crate::simd::{LANES, Lanes, VectorX8, dot, lane_of, sub};

pub(crate) struct OctantCull {
    middles: VectorX8<f32>,
    half_side: f32,
    /// Of the mesh.
    points: VectorX8<f32>,
    /// What of |c − t|² rounding leaves.
    kept: Lanes<f32>,
    /// |c − p|², and what rounding adds.
    most: Lanes<f32>,
    rounding: f32,
}

/// The nearest of some points to each of eight others.
pub(crate) struct NearestPoints {
    /// What the points were called.
    pub names: Lanes<u32>,
    pub points: VectorX8<f32>,
    distances_sq: Lanes<f32>,
}

impl NearestPoints {
    pub const NONE: Self = Self { names: [0; LANES], points: [[0.0; LANES]; 3], distances_sq: [f32::INFINITY; LANES] };

    #[inline(always)]
    pub fn consider(&mut self, name: u32, point: [f32; 3], from: &VectorX8<f32>) {
        for lane in 0..LANES {
            let way = sub(lane_of(from, lane), point);
            let distance_sq = dot(way, way);
            let is_nearer = distance_sq < self.distances_sq[lane];
            self.names[lane] = if is_nearer { name } else { self.names[lane] };
            self.distances_sq[lane] = if is_nearer { distance_sq } else { self.distances_sq[lane] };
            for axis in 0..3 {
                self.points[axis][lane] = if is_nearer { point[axis] } else { self.points[axis][lane] };
            }
        }
    }
}

impl OctantCull {
    /// `rounding`: what lengths are off by at most. Squares and products of lengths ℓ so are off by less than 2ℓ of it; of
    /// |c − t| =: d that is at most d²/L + L, for any L.
    #[inline(always)]
    pub fn new(middles: VectorX8<f32>, half_side: f32, points: VectorX8<f32>, rounding: f32) -> Self {
        let (mut kept, mut most) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let way = sub(lane_of(&middles, lane), lane_of(&points, lane));
            let distance_sq = dot(way, way);
            let length = distance_sq.sqrt() + 4.0 * half_side + 8.0 * rounding;
            kept[lane] = 1.0 - rounding / length;
            most[lane] = distance_sq + 2.0 * rounding * length;
        }
        Self { middles, half_side, points, kept, most, rounding }
    }

    /// In which cubes a point of a triangle may be nearer: 1, else 0.
    ///
    /// With weights w, of t = Σ wᵢ tᵢ the square |c − t|² is Σ wᵢ |c − tᵢ|² less Σ wᵢ |tᵢ − t|², which is no more than the
    /// square of the radius r of a ball around the triangle; and |p − t|₁ ≤ Σ wᵢ |p − tᵢ|₁. So the least is that of a corner, less r².
    #[inline(always)]
    pub fn may_hold_triangle(&self, corners: &[[f32; 3]; 3], radius_sq: f32) -> Lanes<u32> {
        let mut holds = [0; LANES];
        for lane in 0..LANES {
            let mut least = f32::INFINITY;
            for corner in corners {
                let from_corner = self.at_point(lane, *corner);
                least = if from_corner < least { from_corner } else { least };
            }
            holds[lane] = if least - radius_sq > self.most[lane] { 0 } else { 1 };
        }
        holds
    }

    #[inline(always)]
    fn at_point(&self, lane: usize, point: [f32; 3]) -> f32 {
        let way = sub(lane_of(&self.middles, lane), point);
        self.kept[lane] * dot(way, way) - 2.0 * self.half_side * self.apart(lane, point)
    }

    /// |p − t|₁.
    #[inline(always)]
    fn apart(&self, lane: usize, point: [f32; 3]) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| (self.points[axis][lane] - point[axis]).abs());
        x + y + z
    }

    /// In which cubes a point of a patch may be nearer: 1, else 0.
    ///
    /// With a from the patch's middle m to c, parts of it along and across the patch's normal, and as parts of u = t − m no more
    /// than h and ρ: |c − t|² ≥ |a|² − 2h |a along| − 2 |a across| |u across| + |u across|², and |p − t|₁ ≤ |p − m|₁ + √3 (h + |u across|).
    #[inline(always)]
    pub fn may_hold_patch(&self, bounding_disc: &BoundingDisc) -> Lanes<u32> {
        let BoundingDisc { middle, normal, radius, half_thickness, .. } = *bounding_disc;
        let root_of_three = 3.0_f32.sqrt();
        let diagonal = root_of_three * self.half_side + self.rounding;
        let mut holds = [0; LANES];
        for lane in 0..LANES {
            let way = sub(lane_of(&self.middles, lane), middle);
            let along = dot(way, normal);
            let across = [0, 1, 2].map(|axis: usize| way[axis] - along * normal[axis]);
            let across = dot(across, across).sqrt() + diagonal;
            let reach = if radius < across { radius } else { across };
            let least = self.kept[lane] * dot(way, way)
                - 2.0 * self.half_side * self.apart(lane, middle)
                - reach * (2.0 * across - reach)
                - 2.0 * half_thickness * (along.abs() + diagonal);
            holds[lane] = if least > self.most[lane] { 0 } else { 1 };
        }
        holds
    }
}

#[cfg(test)]
mod tests {
    use sdf_core::Aabb;
    use sdf_core::nalgebra::Vector3;

    use super::*;
    use crate::testing::random_vector;
    use crate::triangle::approx::{ApproxTriangle, UnitFrame};
    use crate::triangle::nearest_on_triangle;

    /// Nearer than a point to a corner of a cube: as much as half of the rounding.
    fn is_nearer(
        triangles: &[[Vector3<f64>; 3]],
        middle: Vector3<f64>,
        half_side: f64,
        point: Vector3<f64>,
        rounding: f64,
    ) -> bool {
        (0..8_u32).any(|corner| {
            let side = |axis: usize, _| if corner >> axis & 1 == 0 { -half_side } else { half_side };
            let corner = middle + Vector3::from_fn(side);
            let away = |triangle: &[Vector3<f64>; 3]| nearest_on_triangle(corner, *triangle).distance_sq.sqrt();
            triangles.iter().map(away).fold(f64::INFINITY, f64::min) < (corner - point).norm() + 0.5 * rounding
        })
    }

    /// Whether a triangle, and a patch of triangles that it is one of, may be nearer than a point to a cube.
    struct Held {
        rough: ApproxTriangle,
        bounding_disc: BoundingDisc,
        middle: Vector3<f64>,
        half_side: f64,
        rounding: f32,
    }

    impl Held {
        fn of(&self, kind: usize, point: Vector3<f64>) -> bool {
            let [middles, points] =
                [self.middle, point].map(|at| [0, 1, 2].map(|axis: usize| [at[axis] as f32; LANES]));
            let near = OctantCull::new(middles, self.half_side as f32, points, self.rounding);
            let of_triangle = || near.may_hold_triangle(&self.rough.corners(), self.rough.radius_sq());
            let held = if kind == 0 { of_triangle() } else { near.may_hold_patch(&self.bounding_disc) };
            assert!(held.iter().all(|one| *one == held[0]));
            held[0] == 1
        }
    }

    #[test]
    fn nothing_that_is_dropped_is_nearer_to_a_corner_of_a_cube_even_where_it_is_only_just_dropped() {
        let frame = UnitFrame::around(&Aabb { min: [-1.0; 3], max: [1.0; 3] });
        let mut state = 31;
        println!("seed {state}");
        let mut dropped = [0; 2];
        for round in 0..40_000 {
            let size = [0.3, 0.05, 0.005, 1e-5][round % 4];
            let half_side = [0.1, 0.02, 0.0, 1e-4][round / 4 % 4];
            let reach = [0.7, 0.1, 1e-3][round / 16 % 3];
            let flatness = [1.0, 0.02][round / 48 % 2];
            let (at, turned) = (random_vector(&mut state) * 0.5, random_vector(&mut state).normalize());
            let mut corner = || {
                let way = random_vector(&mut state) * size;
                at + way - turned * (way.dot(&turned) * (1.0 - flatness))
            };
            let triangles: [[Vector3<f64>; 3]; 4] = std::array::from_fn(|_| std::array::from_fn(|_| corner()));
            let bounding_disc = BoundingDisc::around(&triangles, 0, 4, &frame);
            let middle = at + random_vector(&mut state) * reach;
            let rough = ApproxTriangle::new(triangles[0], &frame);
            let held = Held { rough, bounding_disc, middle, half_side, rounding: UnitFrame::rounding(1.0) };
            // From the patch's middle toward the cube: from nowhere is a point nearer to the cube than about so far.
            let from = triangles[held.bounding_disc.slot as usize][0];
            let axis = Vector3::from_fn(|axis, _| if axis == round % 3 { 1.0 } else { 0.0 });
            let toward = (random_vector(&mut state) * [1.0, 0.1][round / 96 % 2] + axis).normalize();
            let toward = toward * (middle - from).dot(&toward).signum();
            let far = (middle - from).dot(&toward) - half_side * toward.abs().sum();
            for kind in 0..2 {
                if far <= 0.0 || held.of(kind, from + toward * far) {
                    continue;
                }
                let [mut low, mut high] = [0.0, far];
                for _ in 0..20 {
                    let between = 0.5 * (low + high);
                    *(if held.of(kind, from + toward * between) { &mut low } else { &mut high }) = between;
                }
                dropped[kind] += 1;
                let (triangles, point) = (&triangles[..[1, 4][kind]], from + toward * high);
                let is_nearer = is_nearer(triangles, middle, half_side, point, f64::from(held.rounding));
                assert!(!is_nearer, "{kind} {triangles:?} {middle:?} {half_side} {point:?}");
            }
        }
        assert!(dropped.iter().all(|count| *count > 4000), "{dropped:?}");
    }
}
