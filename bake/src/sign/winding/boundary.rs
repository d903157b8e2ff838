//! Boundary of a mesh, and how fast it lets the winding number change.
//!
//! A boundary edge has triangles that do not cancel: used forward m times more than backward, m ≠ 0. By Stokes' theorem
//! the gradient of w away from the triangles is an integral over these edges alone (the law of Biot and Savart),
//!
//! ```text
//! ∇w(x) = (1/4π) Σ_edges m ∫ (y − x) × dy/|y − x|³,     so     |∇w(x)| ≤ (1/4π) Σ_edges |m| ∫ h ds/|y − x|³,
//! ```
//!
//! h the distance of x from the edge's line. For an edge of length ℓ at distance d ≥ h from x, the last integral is at most
//! min(ℓ/d², 2/d): the first as |y − x| ≥ d. The second is the integral over the whole line if d = h. Else the edge is on one side of
//! the line's nearest point, and the integral over all of that side farther than d is at most h/d². Both fall with d. So in a ball of radius r about x an edge contributes at most |m| min(ℓ/(d − r)², 2/(d − r)).

use std::f64::consts::PI;

use sdf_core::nalgebra::Vector3;

use super::boundary_cone::BoundaryCone;
use super::{Estimate, MAX_CONGRUENT_ERROR, nearest_congruent};
use crate::rounding::SUM_SLACK;
use crate::simd::{LANES, Lanes, VectorX8, max, min};
use sdf_core::hilbert::{BITS, hilbert_index};

/// Boundary edges of an oriented mesh.
pub(crate) struct MeshBoundary {
    /// Edges in Hilbert order, eight to an item.
    edges: Vec<EdgesX8>,
    /// Balls around the items of [`Self::edges`], eight to an item.
    groups: Vec<GroupsX8>,
    /// Empty if the boundary has too many edges for it.
    cone: BoundaryCone,
}

/// Groups of edges side by side, each in a ball. Lanes after the last repeat the first with weight zero.
struct GroupsX8 {
    center: VectorX8<f64>,
    radius: Lanes<f64>,
    weight: Lanes<f64>,
}

/// Edges side by side. Lanes after the last repeat the first with multiplicity zero.
struct EdgesX8 {
    from: VectorX8<f64>,
    offset: VectorX8<f64>,
    inv_length_sq: Lanes<f64>,
    length: Lanes<f64>,
    /// |m|.
    multiplicity: Lanes<f64>,
}

/// Edges in a ball.
struct EdgeGroup {
    center: Vector3<f64>,
    radius: f64,
    /// Σ |m| · length.
    weight: f64,
}

/// Most edges with a slope bound. With more, the bound costs more than the winding numbers that it saves.
const MAX_SLOPE_EDGES: usize = 20_000;

/// Most edges, by multiplicity, of a boundary cone. With more, it costs about as much as the mesh itself.
const MAX_CONE_EDGES: f64 = 2000.0;

/// A group farther than this many of its radii counts as one edge.
const BETA: f64 = 2.0;

impl MeshBoundary {
    /// Takes each edge by its two ends and its multiplicity.
    pub fn new(edges: impl Iterator<Item = ([Vector3<f64>; 2], f64)>) -> Self {
        let mut edges: Vec<_> = edges.collect();
        let ends = || edges.iter().flat_map(|(ends, _)| ends);
        let Some(low) = ends().copied().reduce(|a, b| a.inf(&b)) else {
            return Self { edges: vec![], groups: vec![], cone: BoundaryCone::new(Vector3::zeros(), &[]) };
        };
        let apex = ends().sum::<Vector3<f64>>() / (2.0 * edges.len() as f64);
        let side = ends().map(|end| (end - low).max()).fold(0.0, f64::max);
        let curve_index = |[from, to]: [Vector3<f64>; 2]| {
            let cells = ((from + to) * 0.5 - low) * (f64::from((1_u32 << BITS) - 1) / side);
            hilbert_index(std::array::from_fn(|axis| cells[axis] as u32))
        };
        edges.sort_by_cached_key(|(ends, _)| curve_index(*ends));
        let singles: Vec<EdgeGroup> = edges.iter().map(EdgeGroup::single).collect();
        let groups: Vec<EdgeGroup> = singles.chunks(LANES).map(EdgeGroup::merged).collect();
        let cone_edge_count: f64 = edges.iter().map(|(_, multiplicity)| multiplicity.abs()).sum();
        let cone_edges = &edges[..if cone_edge_count > MAX_CONE_EDGES { 0 } else { edges.len() }];
        Self {
            edges: edges.chunks(LANES).map(EdgesX8::new).collect(),
            groups: groups.chunks(LANES).map(GroupsX8::new).collect(),
            cone: BoundaryCone::new(apex, cone_edges),
        }
    }

    /// Winding number modulo 1; 0 for a closed mesh. `None` without a cone, or near one of its edges.
    pub fn winding_fraction(&self, point: Vector3<f64>) -> Option<Estimate> {
        match (self.is_empty(), self.has_cone()) {
            (true, _) => Some(Estimate { value: 0.0, error: 0.0 }),
            (false, true) => self.cone.winding_fraction(point),
            (false, false) => None,
        }
    }

    /// The number nearest to an estimate that has the fraction at the point. `None` if the fraction is unknown or the
    /// error admits several.
    pub fn refine(&self, estimate: Estimate, point: Vector3<f64>) -> Option<Estimate> {
        if estimate.error > MAX_CONGRUENT_ERROR {
            return None;
        }
        let Estimate { value: fraction, error } = self.winding_fraction(point)?;
        Some(Estimate { value: nearest_congruent(estimate, fraction)?, error })
    }

    /// Whether [`Self::winding_fraction`] is known at nearly all points, though the mesh is open.
    pub fn has_cone(&self) -> bool {
        !self.cone.is_empty()
    }

    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// Whether [`Self::slope_bound`] is finite away from the edges.
    pub fn has_slope_bound(&self) -> bool {
        self.edges.len() * LANES <= MAX_SLOPE_EDGES
    }

    /// Upper bound of |∇w| in a ball, other than across triangles. Infinite if an edge meets the ball.
    pub fn slope_bound(&self, center: Vector3<f64>, radius: f64) -> f64 {
        if !self.has_slope_bound() {
            return f64::INFINITY;
        }
        pulp::Arch::new().dispatch(SlopeSum { boundary: self, center, radius })
    }
}

struct SlopeSum<'a> {
    boundary: &'a MeshBoundary,
    center: Vector3<f64>,
    radius: f64,
}

impl pulp::WithSimd for SlopeSum<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        let Self { boundary, center, radius } = self;
        let mut sums = [0.0; LANES];
        for (groups, edges) in boundary.groups.iter().zip(boundary.edges.chunks(LANES)) {
            let distances = groups.distances(center, radius);
            let mut far = groups.slopes(distances);
            for (group, edges) in edges.iter().enumerate() {
                if distances[group] <= BETA * groups.radius[group] {
                    far[group] = 0.0;
                    let slopes = edges.slopes(center, radius);
                    (0..LANES).for_each(|lane| sums[lane] += slopes[lane]);
                }
            }
            (0..edges.len()).for_each(|lane| sums[lane] += far[lane]);
        }
        sums.iter().sum::<f64>() / (4.0 * PI)
    }
}

impl EdgeGroup {
    fn single(([from, to], multiplicity): &([Vector3<f64>; 2], f64)) -> Self {
        let length = (to - from).norm();
        Self { center: (from + to) * 0.5, radius: 0.5 * length, weight: length * multiplicity.abs() }
    }

    fn merged(parts: &[Self]) -> Self {
        let center = parts.iter().map(|part| part.center).sum::<Vector3<f64>>() / parts.len() as f64;
        let farthest = |part: &Self| (part.center - center).norm() + part.radius;
        let radius = parts.iter().map(farthest).fold(0.0, f64::max) * (1.0 + SUM_SLACK);
        Self { center, radius, weight: parts.iter().map(|part| part.weight).sum() }
    }
}

impl EdgesX8 {
    fn new(edges: &[([Vector3<f64>; 2], f64)]) -> Self {
        let edge = |lane: usize| edges.get(lane).unwrap_or(&edges[0]);
        let offset = |lane: usize| edge(lane).0[1] - edge(lane).0[0];
        Self {
            from: std::array::from_fn(|axis| std::array::from_fn(|lane| edge(lane).0[0][axis])),
            offset: std::array::from_fn(|axis| std::array::from_fn(|lane| offset(lane)[axis])),
            inv_length_sq: std::array::from_fn(|lane| 1.0 / offset(lane).norm_squared()),
            length: std::array::from_fn(|lane| offset(lane).norm()),
            multiplicity: std::array::from_fn(|lane| edges.get(lane).map_or(0.0, |(_, times)| times.abs())),
        }
    }

    /// |m| min(ℓ/(d − r)², 2/(d − r)) of each edge; infinite for d ≤ r.
    #[inline(always)]
    fn slopes(&self, center: Vector3<f64>, radius: f64) -> Lanes<f64> {
        let mut slopes = [0.0; LANES];
        for lane in 0..LANES {
            let [x, y, z] =
                [center.x - self.from[0][lane], center.y - self.from[1][lane], center.z - self.from[2][lane]];
            let [along_x, along_y, along_z] = [self.offset[0][lane], self.offset[1][lane], self.offset[2][lane]];
            let t = (x * along_x + y * along_y + z * along_z) * self.inv_length_sq[lane];
            let t = min(max(t, 0.0), 1.0);
            let [x, y, z] = [x - t * along_x, y - t * along_y, z - t * along_z];
            let distance = (x * x + y * y + z * z).sqrt();
            let gap = distance * (1.0 - SUM_SLACK) - radius;
            let slope = self.multiplicity[lane] * min(self.length[lane], 2.0 * gap) / (gap * gap);
            slopes[lane] = if gap > 0.0 { slope } else { f64::INFINITY };
        }
        slopes
    }
}

impl GroupsX8 {
    fn new(groups: &[EdgeGroup]) -> Self {
        let group = |lane: usize| groups.get(lane).unwrap_or(&groups[0]);
        Self {
            center: std::array::from_fn(|axis| std::array::from_fn(|lane| group(lane).center[axis])),
            radius: std::array::from_fn(|lane| group(lane).radius),
            weight: std::array::from_fn(|lane| groups.get(lane).map_or(0.0, |group| group.weight)),
        }
    }

    /// Lower bounds of the distances between a ball and the groups.
    #[inline(always)]
    fn distances(&self, center: Vector3<f64>, radius: f64) -> Lanes<f64> {
        let mut distances = [0.0; LANES];
        for lane in 0..LANES {
            let [x, y, z] = [0, 1, 2].map(|axis| self.center[axis][lane] - center[axis]);
            distances[lane] = (x * x + y * y + z * z).sqrt() - self.radius[lane] - radius;
        }
        distances
    }

    /// weight/distance² of each group; infinite for distances that are not positive.
    #[inline(always)]
    fn slopes(&self, distances: Lanes<f64>) -> Lanes<f64> {
        let mut slopes = [0.0; LANES];
        for lane in 0..LANES {
            let slope = self.weight[lane] / (distances[lane] * distances[lane]);
            slopes[lane] = if distances[lane] > 0.0 { slope } else { f64::INFINITY };
        }
        slopes
    }
}

#[cfg(test)]
mod tests;
