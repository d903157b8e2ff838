//! Cull of candidates for eight cubes at once, in f32: can a triangle, or a disc around triangles, be nearer to some
//! point of a cube than a given point of the mesh?
//!
//! Let c be the center of a cube, s its half side, p the point of the mesh, and x = c + v, |vᵢ| ≤ s. For a point t,
//!
//! ```text
//! |x − t|² − |x − p|² = |c − t|² − |c − p|² + 2 v·(p − t) ≥ |c − t|² − 2 s ‖p − t‖₁ − |c − p|².
//! ```
//!
//! If that is positive for every t of a triangle, the triangle is nearest to no point of the cube.

use crate::bvh::bounding_disc::BoundingDisc;
use crate::simd::{LANES, Lanes, VectorX8, fused_dot, lane_of, min, sub};

/// Eight cubes, and for each a point of the mesh.
pub(crate) struct OctantCull {
    centers: VectorX8<f32>,
    half_side: f32,
    /// p of each cube.
    points: VectorX8<f32>,
    /// 1 − rounding: the part of |c − t|² that is certain.
    certain: Lanes<f32>,
    /// |c − p|², rounded up.
    threshold: Lanes<f32>,
    rounding: f32,
}

/// The nearest of some points to each of eight centers, so far.
pub(crate) struct NearestPoints {
    /// The caller's names of the points.
    pub ids: Lanes<u32>,
    pub points: VectorX8<f32>,
    distances_sq: Lanes<f32>,
}

impl NearestPoints {
    pub const NONE: Self = Self { ids: [0; LANES], points: [[0.0; LANES]; 3], distances_sq: [f32::INFINITY; LANES] };

    #[inline(always)]
    pub fn update(&mut self, id: u32, point: [f32; 3], centers: &VectorX8<f32>) {
        for lane in 0..LANES {
            let offset = sub(lane_of(centers, lane), point);
            let distance_sq = fused_dot(offset, offset);
            let is_nearer = distance_sq < self.distances_sq[lane];
            self.ids[lane] = if is_nearer { id } else { self.ids[lane] };
            self.distances_sq[lane] = if is_nearer { distance_sq } else { self.distances_sq[lane] };
            for axis in 0..3 {
                self.points[axis][lane] = if is_nearer { point[axis] } else { self.points[axis][lane] };
            }
        }
    }
}

impl OctantCull {
    /// `rounding` is the largest error of a length, so squares and products of lengths ℓ are off by less than 2 ℓ ·
    /// rounding. For d = |c − t| that is at most (d²/L + L) · rounding, for any L > 0; L is about |c − p|.
    #[inline(always)]
    pub fn new(centers: VectorX8<f32>, half_side: f32, points: VectorX8<f32>, rounding: f32) -> Self {
        let (mut certain, mut threshold) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let offset = sub(lane_of(&centers, lane), lane_of(&points, lane));
            let distance_sq = fused_dot(offset, offset);
            let length = distance_sq.sqrt() + 4.0 * half_side + 8.0 * rounding;
            certain[lane] = 1.0 - rounding / length;
            threshold[lane] = distance_sq + 2.0 * rounding * length;
        }
        Self { centers, half_side, points, certain, threshold, rounding }
    }

    /// 1 for the cubes with a point that a triangle can be nearer to than p, else 0.
    ///
    /// For t = Σ wᵢ tᵢ with weights w of the corners tᵢ, |c − t|² = Σ wᵢ |c − tᵢ|² − Σ wᵢ |tᵢ − t|². The last sum is
    /// at most r², with r the radius of a ball around the triangle; and ‖p − t‖₁ ≤ Σ wᵢ ‖p − tᵢ‖₁. So the minimum over
    /// t is at least that over the corners, less r².
    #[inline(always)]
    pub fn keeps_triangle(&self, corners: &[[f32; 3]; 3], radius_sq: f32) -> Lanes<u32> {
        let mut keeps = [0; LANES];
        for lane in 0..LANES {
            let mut lower = f32::INFINITY;
            for corner in corners {
                lower = min(self.lower_at(lane, *corner), lower);
            }
            keeps[lane] = if lower - radius_sq > self.threshold[lane] { 0 } else { 1 };
        }
        keeps
    }

    /// Lower bound of |c − t|² − 2 s ‖p − t‖₁ at a point t.
    #[inline(always)]
    fn lower_at(&self, lane: usize, point: [f32; 3]) -> f32 {
        let offset = sub(lane_of(&self.centers, lane), point);
        self.certain[lane] * fused_dot(offset, offset) - 2.0 * self.half_side * self.distance_l1(lane, point)
    }

    /// ‖p − t‖₁.
    #[inline(always)]
    fn distance_l1(&self, lane: usize, point: [f32; 3]) -> f32 {
        let [x, y, z] = [0, 1, 2].map(|axis: usize| (self.points[axis][lane] - point[axis]).abs());
        x + y + z
    }

    /// 1 for the cubes with a point that a triangle in a disc can be nearer to than p, else 0.
    ///
    /// Let a = c − m be the offset from the disc's center m, and u = t − m. Their parts along the normal are a∥ and
    /// |u∥| ≤ h, those across it a⊥ and |u⊥| ≤ ρ. Then
    ///
    /// ```text
    /// |c − t|² + 2 v·(p − t) ≥ |a|² − 2 h (|a∥| + |v|) − 2 |a⊥ + v⊥| |u⊥| + |u⊥|² + 2 v·(p − m).
    /// ```
    ///
    /// Where |a⊥| > ρ + |v|, that is least for |u⊥| = ρ; with |a⊥ + v⊥| ≤ |a⊥| + v·e + |v|² / 2|a⊥| and e = a⊥ / |a⊥|, it is
    ///
    /// ```text
    /// ≥ |a|² − 2 h (|a∥| + √3 s) − ρ (2 |a⊥| − ρ) − 3 s² ρ / |a⊥| − 2 s ‖p − m − ρ e‖₁.
    /// ```
    ///
    /// Elsewhere |a⊥ + v⊥| ≤ |a⊥| + √3 s, and −v·(p − m) ≤ s ‖p − m‖₁.
    #[inline(always)]
    pub fn keeps_disc(&self, disc: &BoundingDisc) -> Lanes<u32> {
        let BoundingDisc { center, normal, radius, half_thickness, .. } = *disc;
        let diagonal = 3.0_f32.sqrt() * self.half_side + self.rounding;
        let mut keeps = [0; LANES];
        for lane in 0..LANES {
            let offset = sub(lane_of(&self.centers, lane), center);
            let along = fused_dot(offset, normal);
            let across = [0, 1, 2].map(|axis: usize| offset[axis] - along * normal[axis]);
            let length = fused_dot(across, across).sqrt();
            let is_far = length > radius + diagonal;
            // The |u⊥| of the minimum, and its offset along e.
            let nearest_radius = if is_far { radius } else { min(radius, length + diagonal) };
            let shift = if is_far { radius / length } else { 0.0 };
            let bent = if is_far { self.rounding + 1.5 * self.half_side * self.half_side / length } else { diagonal };
            let l1 = [0, 1, 2].map(|axis: usize| (self.points[axis][lane] - center[axis] - shift * across[axis]).abs());
            let lower = self.certain[lane] * fused_dot(offset, offset)
                - 2.0 * self.half_side * (l1[0] + l1[1] + l1[2])
                - nearest_radius * (2.0 * (length + bent) - nearest_radius)
                - 2.0 * half_thickness * (along.abs() + diagonal);
            keeps[lane] = if lower > self.threshold[lane] { 0 } else { 1 };
        }
        keeps
    }
}

#[cfg(test)]
mod tests;
