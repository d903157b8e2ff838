//! Which triangles can be nearest to a point of a box, and how much their normals turn.
//!
//! With distance d and offset d·f of a box's middle from a triangle, e and D those of the nearest, and R the farthest point
//! of the box, a triangle can be nearest to a point middle + v of the box only if (docs/error-bounds.md, "Which triangles
//! can be nearest")
//!
//! ```text
//! d − A ≤ max over v of v·(k e − f),   A = √(D² + R²),   k = D / A.
//! ```
//!
//! The same test over the cells of a box gives the normals that bound its error: all lie in a cap of half angle θ, so the
//! interpolant errs by at most (√3/2) sin θ.

use super::frame::{greater, lesser};
use super::packed::{PackedTriangles, View, WIDTH, Wide};
use crate::rounding::CHAIN_SLACK_F32;
use crate::simd::greater_magnitude;

/// A box of points around the middle of some nodes, from `lower` to `upper`, in voxels.
#[derive(Clone, Copy)]
pub(super) struct Region {
    pub lower: [f32; 3],
    pub upper: [f32; 3],
}

impl Region {
    #[inline(always)]
    pub fn radius_sq(&self) -> f32 {
        let farthest = [0, 1, 2].map(|axis: usize| greater(-self.lower[axis], self.upper[axis]));
        farthest[0] * farthest[0] + farthest[1] * farthest[1] + farthest[2] * farthest[2]
    }
}

/// Test of which triangles can be nearest to a point of a region.
pub(super) struct NearestTest {
    region: Region,
    /// A, the largest distance in the region along the tangent.
    distance: f32,
    /// k e.
    slope: [f32; 3],
    margin: f32,
    max_distance_sq: f32,
}

impl NearestTest {
    #[inline(always)]
    pub fn new(region: Region, nearest_sq: f32, offset: [f32; 3], rounding: f32) -> Self {
        let distance = (nearest_sq + region.radius_sq()).sqrt();
        let slope = offset.map(|x| x / distance);
        // An error of each distance and offset by `rounding` moves the test by at most this.
        let margin = 8.0 * rounding * (distance + 8.0);
        Self { region, distance, slope, margin, max_distance_sq: f32::INFINITY }
    }

    /// As [`new`](Self::new); triangles farther from the middle do not pass.
    #[inline(always)]
    pub fn within(self, max_distance: f32) -> Self {
        Self { max_distance_sq: max_distance * max_distance * (1.0 + CHAIN_SLACK_F32), ..self }
    }

    /// Bits of the triangles that pass.
    #[inline(always)]
    pub fn pass(&self, view: &View) -> u32 {
        let mut bits = [0_u32; WIDTH];
        for lane in 0..WIDTH {
            let distance = view.distances_sq[lane].sqrt();
            let mut most = self.distance * distance;
            for axis in 0..3 {
                let difference = self.slope[axis].mul_add(distance, -view.offsets[axis][lane]);
                most += greater(self.region.lower[axis] * difference, self.region.upper[axis] * difference);
            }
            let margin = CHAIN_SLACK_F32.mul_add(most.abs() + view.distances_sq[lane], self.margin);
            let most = lesser(most + margin, self.max_distance_sq);
            bits[lane] = u32::from(view.distances_sq[lane] <= most) << lane;
        }
        bits.iter().fold(0, |all, bit| all | bit)
    }
}

/// Largest sine of the angles between the mean of the normals of the masks and each of them; 1 if one is unknown or at a
/// right angle or more.
#[inline(always)]
pub(super) fn largest_sine(packed: &[PackedTriangles], masks: &[u32]) -> f32 {
    let mut sums = [[0.0_f32; WIDTH]; 3];
    for (pack, mask) in packed.iter().zip(masks) {
        if *mask == 0 {
            continue;
        }
        for lane in 0..WIDTH {
            let share = (*mask >> lane & 1) as f32;
            let normal = pack.normal(lane);
            for axis in 0..3 {
                sums[axis][lane] = share.mul_add(normal[axis], sums[axis][lane]);
            }
        }
    }
    let sum = sums.map(|lanes: Wide| lanes.iter().sum::<f32>());
    let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
    let axis = sum.map(|x| x / greater(length, 1e-6));
    let (mut cosines, mut sines_sq) = ([1.0_f32; WIDTH], [0.0_f32; WIDTH]);
    for (pack, mask) in packed.iter().zip(masks) {
        if *mask == 0 {
            continue;
        }
        let before = cosines;
        for lane in 0..WIDTH {
            let normal = pack.normal(lane);
            let cosine = normal[0].mul_add(axis[0], normal[1].mul_add(axis[1], normal[2] * axis[2]));
            let mut sine_sq = 0.0;
            for k in 0..3 {
                let across = (-cosine).mul_add(axis[k], normal[k]);
                sine_sq += across * across;
            }
            let is_masked = *mask >> lane & 1 == 1;
            cosines[lane] = if is_masked { lesser(cosine, before[lane]) } else { before[lane] };
            sines_sq[lane] = greater_magnitude(if is_masked { sine_sq } else { 0.0 }, sines_sq[lane]);
        }
    }
    let cosine = cosines.into_iter().fold(1.0, lesser);
    let sine = sines_sq.into_iter().fold(0.0, greater).sqrt();
    // An axis off its length by a rounding, and normals rounded to f32.
    if cosine > CHAIN_SLACK_F32 { lesser(sine + CHAIN_SLACK_F32, 1.0) } else { 1.0 }
}
