//! Prefilter in f32: which triangles can be nearest to a point, and then to a corner, of each of eight cubes?
//!
//! Let the triangle nearest to a cube's center c be at distance D, in direction −e. A point c + v of the cube has
//! |v|² ≤ ρ² = 3 s² and lies from that triangle's nearest point at
//!
//! ```text
//! √(D² + 2 D v·e + ρ²) ≤ A + k v·e,   A = √(D² + ρ²), k = D/A   (a root lies below its tangent),
//! ```
//!
//! and from another triangle, at distance d in direction −f, at d + v·f or more, as that lies behind the plane across
//! f. So the other is nearest to no point of the cube if d > A + s ‖k e − f‖₁.

use super::octants::Octants;
use crate::nearest::octant_cull::{NearestPoints, OctantCull};
use crate::simd::{LANES, LaneLists, Lanes, VectorX8, min, or_lanes};
use crate::triangle::approx::{ApproxDistance, ApproxTriangle};

/// Nearest triangles of eight centers, so far.
struct NearestApproxX8 {
    slots: Lanes<u32>,
    distances: ApproxDistance,
}

/// Upper bound A + k v·e of the distance from a point of each cube.
struct UpperBounds {
    /// A, rounded up.
    constants: Lanes<f32>,
    /// k e.
    slopes: VectorX8<f32>,
}

/// Scratch buffers of the filter, and its results.
pub(super) struct Prefilter {
    /// Slots: what the octant cull left, and in the end the survivors of each cube, one after the other.
    survivors: Vec<u32>,
    survivor_ends: Lanes<usize>,
    /// Distances of what the octant cull left from the eight centers.
    distances: Vec<(u32, ApproxDistance)>,
    /// For each triangle 1 for the cubes in which it can be nearest, else 0.
    keeps: Vec<Lanes<u32>>,
    /// Slots that can be nearest in each cube.
    lists: LaneLists,
    /// For the entries of `lists` one after the other, [`ApproxDistance::distance_sq`] and [`ApproxDistance::gap`]
    /// from the corners of their cube.
    corner_distances: Vec<(Lanes<f32>, Lanes<f32>)>,
    /// Slot of the triangle nearest to each center.
    nearest: Lanes<u32>,
}

impl Prefilter {
    pub fn new() -> Self {
        Self {
            survivors: vec![],
            survivor_ends: [0; LANES],
            distances: vec![],
            keeps: vec![],
            lists: LaneLists::new(),
            corner_distances: vec![],
            nearest: [0; LANES],
        }
    }

    /// Slot of the triangle nearest to a cube's center, approximately.
    pub fn nearest(&self, cube: usize) -> u32 {
        self.nearest[cube]
    }

    /// Finds which of the triangles in `slots` can be nearest to a point of each cube.
    #[inline(always)]
    pub fn filter(&mut self, triangles: &[ApproxTriangle], slots: &[u32], cubes: &Octants) {
        let Octants { half_side, rounding, .. } = *cubes;
        let centers = cubes.centers();
        let mut nearest = NearestApproxX8::by_first_corners(triangles, slots, &centers);
        let cull = OctantCull::new(centers, half_side, nearest.points(&centers), rounding);
        // Masks go to memory first, so that they are made and combined in vectors.
        self.keeps.clear();
        for slot in slots {
            let triangle = &triangles[*slot as usize];
            self.keeps.push(cull.keeps_triangle(&triangle.corners(), triangle.radius_sq()));
        }
        self.survivors.clear();
        self.survivors.resize(slots.len(), 0);
        let mut count = 0;
        for (slot, keeps) in slots.iter().zip(&self.keeps) {
            self.survivors[count] = *slot;
            count += or_lanes(keeps) as usize;
        }
        self.distances.clear();
        for slot in &self.survivors[..count] {
            let distances = triangles[*slot as usize].distances_from(&centers);
            nearest.update(*slot, &distances);
            self.distances.push((*slot, distances));
        }
        let bounds = nearest.upper_bounds(half_side, rounding);
        self.keeps.clear();
        for (_, distances) in &self.distances {
            self.keeps.push(bounds.keeps(distances, half_side));
        }
        self.lists.clear(self.distances.len());
        for ((slot, _), keeps) in self.distances.iter().zip(&self.keeps) {
            self.lists.push(*slot, keeps);
        }
        self.nearest = nearest.slots;
    }

    /// Lower bound of the distance of each cube's corners from all triangles: d − √3 s, rounded down.
    #[inline(always)]
    pub fn lower_bounds(&self, cubes: &Octants) -> Lanes<f32> {
        let mut lower = [f32::INFINITY; LANES];
        for (_, ApproxDistance { distance_sq, gap, .. }) in &self.distances {
            for lane in 0..LANES {
                // An overflow of f32 bounds nothing.
                let is_bound = (gap[lane] > 0.0) & (gap[lane] < f32::INFINITY) & (distance_sq[lane] < f32::INFINITY);
                let distance = if is_bound { gap[lane] / distance_sq[lane].sqrt() } else { 0.0 };
                lower[lane] = min(distance, lower[lane]);
            }
        }
        lower.map(|lower| lower - 3.0_f32.sqrt() * cubes.half_side - 2.0 * cubes.rounding)
    }

    /// Finds which triangles can be nearest to a corner of each cube that is wanted. Measures all cubes before it
    /// decides for any, so that no decision waits for the last measurement.
    #[inline(always)]
    pub fn filter_by_corners(&mut self, triangles: &[ApproxTriangle], cubes: &Octants, is_wanted: &Lanes<bool>) {
        let mut min_distances_sq = [[f32::INFINITY; LANES]; LANES];
        self.corner_distances.clear();
        for cube in 0..LANES {
            if !is_wanted[cube] {
                self.lists.clear_lane(cube);
            }
            let corners = cubes.corners_of(cube);
            for slot in self.lists.lane(cube) {
                let ApproxDistance { distance_sq, gap, .. } = triangles[*slot as usize].distances_from(&corners);
                for lane in 0..LANES {
                    let min_sq = &mut min_distances_sq[cube][lane];
                    *min_sq = min(distance_sq[lane], *min_sq);
                }
                self.corner_distances.push((distance_sq, gap));
            }
        }
        self.survivors.clear();
        self.survivors.resize(self.corner_distances.len(), 0);
        let (mut first, mut count) = (0, 0);
        for cube in 0..LANES {
            let upper = min_distances_sq[cube].map(|min_sq| min_sq.sqrt() + 2.0 * cubes.rounding);
            let slots = self.lists.lane(cube);
            for (slot, (distance_sq, gap)) in slots.iter().zip(&self.corner_distances[first..]) {
                self.survivors[count] = *slot;
                let mut keeps = 0;
                for lane in 0..LANES {
                    // The lower bound is gap / √distance_sq.
                    let is_beyond = gap[lane] * gap[lane].abs() > upper[lane] * upper[lane] * distance_sq[lane];
                    keeps |= if is_beyond { 0 } else { 1 };
                }
                count += keeps & usize::from(*slot != self.nearest[cube]);
            }
            first += slots.len();
            self.survivor_ends[cube] = count;
        }
    }

    /// Slots that can be nearest to a corner of a cube, except [`Self::nearest`].
    pub fn survivors(&self, cube: usize) -> &[u32] {
        let first = if cube == 0 { 0 } else { self.survivor_ends[cube - 1] };
        &self.survivors[first..self.survivor_ends[cube]]
    }
}

impl NearestApproxX8 {
    /// Starts from the triangles whose first corners are nearest.
    #[inline(always)]
    fn by_first_corners(triangles: &[ApproxTriangle], slots: &[u32], centers: &VectorX8<f32>) -> Self {
        let mut points = NearestPoints::NONE;
        for slot in slots {
            points.update(*slot, triangles[*slot as usize].first_corner(), centers);
        }
        let mut last = points.ids[0];
        let mut nearest = Self { slots: [last; LANES], distances: triangles[last as usize].distances_from(centers) };
        for slot in points.ids {
            if slot != last {
                nearest.update(slot, &triangles[slot as usize].distances_from(centers));
                last = slot;
            }
        }
        nearest
    }

    /// Nearest points of these triangles.
    #[inline(always)]
    fn points(&self, centers: &VectorX8<f32>) -> VectorX8<f32> {
        let mut points = *centers;
        for axis in 0..3 {
            for lane in 0..LANES {
                points[axis][lane] -= self.distances.offset[axis][lane];
            }
        }
        points
    }

    #[inline(always)]
    fn update(&mut self, slot: u32, other: &ApproxDistance) {
        let best = &mut self.distances;
        for lane in 0..LANES {
            let is_nearer = other.distance_sq[lane] < best.distance_sq[lane];
            self.slots[lane] = if is_nearer { slot } else { self.slots[lane] };
            best.distance_sq[lane] = if is_nearer { other.distance_sq[lane] } else { best.distance_sq[lane] };
            for axis in 0..3 {
                let offset = &mut best.offset[axis][lane];
                *offset = if is_nearer { other.offset[axis][lane] } else { *offset };
            }
        }
    }

    #[inline(always)]
    fn upper_bounds(&self, half_side: f32, rounding: f32) -> UpperBounds {
        let mut bounds = UpperBounds { constants: [0.0; LANES], slopes: [[0.0; LANES]; 3] };
        for lane in 0..LANES {
            let hypotenuse = (self.distances.distance_sq[lane] + 3.0 * half_side * half_side).sqrt();
            bounds.constants[lane] = hypotenuse + 2.0 * rounding;
            for axis in 0..3 {
                bounds.slopes[axis][lane] = self.distances.offset[axis][lane] / hypotenuse;
            }
        }
        bounds
    }
}

impl UpperBounds {
    /// 1 for the cubes where d ≤ A + s ‖k e − f‖₁, else 0. Both sides are multiplied by d.
    #[inline(always)]
    fn keeps(&self, distances: &ApproxDistance, half_side: f32) -> Lanes<u32> {
        let (mut lengths, mut sums, mut keeps) = ([0.0; LANES], [0.0; LANES], [0; LANES]);
        for lane in 0..LANES {
            lengths[lane] = distances.distance_sq[lane].sqrt();
        }
        for axis in 0..3 {
            for lane in 0..LANES {
                sums[lane] += lengths[lane].mul_add(self.slopes[axis][lane], -distances.offset[axis][lane]).abs();
            }
        }
        for lane in 0..LANES {
            let upper = lengths[lane].mul_add(self.constants[lane], half_side * sums[lane]);
            keeps[lane] = if distances.gap[lane] > upper { 0 } else { 1 };
        }
        keeps
    }
}
