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
//!
//! Edges that form a loop are also the boundary of any surface across it, whose dipoles give the same gradient. With area A and distance d
//! from the ball that is at most (1/4π) 2A/d³: of a small hole far away much less than the edges by themselves, whose parts cancel.

mod loops;

use std::f64::consts::PI;
use std::ops::Range;

use sdf_core::nalgebra::Vector3;

use super::boundary_cone::BoundaryCone;
use super::{Estimate, MAX_CONGRUENT_ERROR, nearest_congruent};
use crate::rounding::SUM_SLACK;
use crate::simd::{LANES, Lanes, VectorX8, max, min};
use loops::{is_closed, loops};
use sdf_core::hilbert::{BITS, hilbert_index};

/// Boundary edges of an oriented mesh.
pub(crate) struct MeshBoundary {
    /// Edges of small loops, and eight at a time those of others.
    edges: Vec<EdgesX8>,
    /// Up to eight items of [`Self::edges`] each: small loops near each other, or parts of a large one.
    groups: Vec<Group>,
    /// The groups, eight to an item.
    clusters: Vec<PartsX8>,
    edge_count: usize,
    /// Empty if the boundary has too many edges for it.
    cone: BoundaryCone,
}

/// Edges side by side. Lanes after the last repeat the first with length zero.
struct EdgesX8 {
    from: VectorX8<f64>,
    offset: VectorX8<f64>,
    inv_length_sq: Lanes<f64>,
    length: Lanes<f64>,
}

/// Items of edges near each other.
struct Group {
    parts: PartsX8,
    edges: Range<usize>,
}

/// Edges in a ball.
#[derive(Clone, Copy)]
struct Part {
    center: Vector3<f64>,
    radius: f64,
    /// Sum of the lengths.
    weight: f64,
    /// Area of a surface in the ball whose boundary the edges are. Infinite if they are not closed.
    area: f64,
}

/// Parts side by side. Lanes after the last repeat the first.
struct PartsX8 {
    center: VectorX8<f64>,
    radius: Lanes<f64>,
    weight: Lanes<f64>,
    area: Lanes<f64>,
}

/// Most edges with a slope bound. With more, the bound costs more than the winding numbers that it saves.
const MAX_SLOPE_EDGES: usize = 20_000;

/// Most edges, by multiplicity, of a boundary cone. With more, it costs about as much as the mesh itself.
const MAX_CONE_EDGES: usize = 2000;

/// A part farther than this many of its radii counts as one.
const BETA: f64 = 1.0;

impl MeshBoundary {
    /// Takes each edge by its two points and its multiplicity.
    pub fn new(points: &[Vector3<f64>], edges: impl Iterator<Item = ([u32; 2], f64)>) -> Self {
        let at = |edge: &[u32; 2]| edge.map(|point| points[point as usize]);
        let mut loops: Vec<(Vec<[Vector3<f64>; 2]>, bool)> =
            loops(points.len(), edges).iter().map(|edges| (edges.iter().map(at).collect(), is_closed(edges))).collect();
        let edge_count = loops.iter().map(|(edges, _)| edges.len()).sum();
        let ends = || loops.iter().flat_map(|(edges, _)| edges.iter().flatten());
        let Some(low) = ends().copied().reduce(|a, b| a.inf(&b)) else {
            let cone = BoundaryCone::new(Vector3::zeros(), &[]);
            return Self { edges: vec![], groups: vec![], clusters: vec![], edge_count, cone };
        };
        let apex = ends().sum::<Vector3<f64>>() / (2.0 * edge_count as f64);
        let side = ends().map(|end| (end - low).max()).fold(0.0, f64::max);
        loops.sort_by_cached_key(|(edges, _)| {
            let cells = (middle(edges) - low) * (f64::from((1_u32 << BITS) - 1) / side);
            hilbert_index(std::array::from_fn(|axis| cells[axis] as u32))
        });
        let (items_of_groups, parts_of_groups): (Vec<_>, Vec<_>) = groups(&loops).into_iter().unzip();
        let (mut edges, mut groups) = (vec![], vec![]);
        for items in &items_of_groups {
            let first = edges.len();
            edges.extend(items.iter().map(|item| EdgesX8::new(&item.edges)));
            let parts: Vec<Part> = items.iter().map(|item| item.part).collect();
            groups.push(Group { parts: PartsX8::new(&parts), edges: first..edges.len() });
        }
        let cone_edges: Vec<_> = loops.into_iter().flat_map(|(edges, _)| edges).collect();
        let cone_edges = if edge_count > MAX_CONE_EDGES { &[] } else { cone_edges.as_slice() };
        let clusters = parts_of_groups.chunks(LANES).map(PartsX8::new).collect();
        Self { edges, groups, clusters, edge_count, cone: BoundaryCone::new(apex, cone_edges) }
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
        self.edge_count <= MAX_SLOPE_EDGES
    }

    /// Upper bound of |∇w| in a ball, other than across triangles. Infinite if an edge meets the ball, and if the bound is more than
    /// `max_slope`: that takes a few edges to tell where there are many, while the bound takes all.
    pub fn slope_bound(&self, center: Vector3<f64>, radius: f64, max_slope: f64) -> f64 {
        if !self.has_slope_bound() || max_slope <= 0.0 {
            return f64::INFINITY;
        }
        pulp::Arch::new().dispatch(SlopeSum { boundary: self, center, radius, max_slope })
    }
}

struct SlopeSum<'a> {
    boundary: &'a MeshBoundary,
    center: Vector3<f64>,
    radius: f64,
    max_slope: f64,
}

impl pulp::WithSimd for SlopeSum<'_> {
    type Output = f64;
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> f64 {
        let Self { boundary, center, radius, max_slope } = self;
        let max_sum = 4.0 * PI * max_slope;
        let mut sums = [0.0; LANES];
        for (cluster, groups) in boundary.clusters.iter().zip(boundary.groups.chunks(LANES)) {
            let near = cluster.add_far_slopes(center, radius, groups.len(), &mut sums);
            for group in groups.iter().zip(near).filter(|(_, is_near)| *is_near).map(|(group, _)| group) {
                let edges = &boundary.edges[group.edges.clone()];
                let near = group.parts.add_far_slopes(center, radius, edges.len(), &mut sums);
                for edges in edges.iter().zip(near).filter(|(_, is_near)| *is_near).map(|(edges, _)| edges) {
                    let slopes = edges.slopes(center, radius);
                    (0..LANES).for_each(|lane| sums[lane] += slopes[lane]);
                }
            }
            if sums.iter().sum::<f64>() > max_sum {
                return f64::INFINITY;
            }
        }
        sums.iter().sum::<f64>() / (4.0 * PI)
    }
}

fn middle(edges: &[[Vector3<f64>; 2]]) -> Vector3<f64> {
    edges.iter().flatten().sum::<Vector3<f64>>() / (2.0 * edges.len() as f64)
}

/// A loop of up to eight edges, or eight edges of a longer one.
struct Item {
    edges: Vec<[Vector3<f64>; 2]>,
    part: Part,
}

/// Groups of up to eight items, and each as one part. Small loops share groups with those beside them, a longer one has groups of its own.
/// With each loop comes whether it is closed.
fn groups(loops: &[(Vec<[Vector3<f64>; 2]>, bool)]) -> Vec<(Vec<Item>, Part)> {
    let mut groups = vec![];
    let mut add = |items: Vec<Item>, area: Option<f64>| {
        let mut rest = items.into_iter().peekable();
        while rest.peek().is_some() {
            // Lists of their own: `split_off` would leave each the room of all that come after it.
            let items: Vec<Item> = rest.by_ref().take(LANES).collect();
            let merged = Part::merged(&items);
            groups.push((items, Part { area: area.unwrap_or(merged.area), ..merged }));
        }
    };
    let item =
        |edges: &[[Vector3<f64>; 2]], is_closed| Item { edges: edges.to_vec(), part: Part::new(edges, is_closed) };
    let (small, large): (Vec<_>, Vec<_>) = loops.iter().partition(|(edges, _)| edges.len() <= LANES);
    add(small.into_iter().map(|(edges, is_closed)| item(edges, *is_closed)).collect(), None);
    for (edges, is_closed) in large {
        let items: Vec<Item> = edges.chunks(LANES).map(|edges| item(edges, false)).collect();
        let area = (items.len() <= LANES).then(|| Part::new(edges, *is_closed).area);
        add(items, area);
    }
    groups
}

impl Part {
    /// Edges in their order. `is_closed`: do they form a loop? Then their surface is the fan around the mean of their ends.
    fn new(edges: &[[Vector3<f64>; 2]], is_closed: bool) -> Self {
        let center = middle(edges);
        let radius = edges.iter().flatten().map(|end| (end - center).norm()).fold(0.0, f64::max);
        let weight = edges.iter().map(|[from, to]| (to - from).norm()).sum();
        let area: f64 = edges.iter().map(|[from, to]| 0.5 * (from - center).cross(&(to - center)).norm()).sum();
        let area = if is_closed { area * (1.0 + SUM_SLACK) } else { f64::INFINITY };
        Self { center, radius: radius * (1.0 + SUM_SLACK), weight, area }
    }

    fn merged(items: &[Item]) -> Self {
        let parts = || items.iter().map(|item| &item.part);
        let center = parts().map(|part| part.center).sum::<Vector3<f64>>() / items.len() as f64;
        let farthest = |part: &Self| (part.center - center).norm() + part.radius;
        let radius = parts().map(farthest).fold(0.0, f64::max) * (1.0 + SUM_SLACK);
        let sum = |value: fn(&Self) -> f64| parts().map(value).sum();
        Self { center, radius, weight: sum(|part| part.weight), area: sum(|part| part.area) }
    }
}

impl EdgesX8 {
    fn new(edges: &[[Vector3<f64>; 2]]) -> Self {
        let [from, to] = [0, 1].map(|end| move |lane: usize| edges.get(lane).unwrap_or(&edges[0])[end]);
        let offset = |lane: usize| to(lane) - from(lane);
        Self {
            from: std::array::from_fn(|axis| std::array::from_fn(|lane| from(lane)[axis])),
            offset: std::array::from_fn(|axis| std::array::from_fn(|lane| offset(lane)[axis])),
            inv_length_sq: std::array::from_fn(|lane| 1.0 / offset(lane).norm_squared()),
            length: std::array::from_fn(|lane| if lane < edges.len() { offset(lane).norm() } else { 0.0 }),
        }
    }

    /// min(ℓ/(d − r)², 2/(d − r)) of each edge; infinite for d ≤ r.
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
            let slope = min(self.length[lane], 2.0 * gap) / (gap * gap);
            slopes[lane] = if gap > 0.0 { slope } else { f64::INFINITY };
        }
        slopes
    }
}

impl PartsX8 {
    fn new(parts: &[Part]) -> Self {
        let part = |lane: usize| parts.get(lane).unwrap_or(&parts[0]);
        Self {
            center: std::array::from_fn(|axis| std::array::from_fn(|lane| part(lane).center[axis])),
            radius: std::array::from_fn(|lane| part(lane).radius),
            weight: std::array::from_fn(|lane| part(lane).weight),
            area: std::array::from_fn(|lane| part(lane).area),
        }
    }

    /// Adds the slopes in a ball from those of the first `count` parts that are far from it: min(weight/d², 2 area/d³) with the distance d.
    /// Which are near?
    #[inline(always)]
    fn add_far_slopes(&self, center: Vector3<f64>, radius: f64, count: usize, sums: &mut Lanes<f64>) -> [bool; LANES] {
        let (mut is_near, mut slopes) = ([false; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let [x, y, z] = [0, 1, 2].map(|axis: usize| self.center[axis][lane] - center[axis]);
            let distance = (x * x + y * y + z * z).sqrt() * (1.0 - SUM_SLACK) - self.radius[lane] - radius;
            is_near[lane] = distance <= BETA * self.radius[lane];
            let inv_sq = 1.0 / (distance * distance);
            let slope = min(self.weight[lane], 2.0 * self.area[lane] / distance) * inv_sq;
            slopes[lane] = if is_near[lane] { 0.0 } else { slope };
        }
        (0..count).for_each(|lane| sums[lane] += slopes[lane]);
        is_near
    }
}

#[cfg(test)]
mod tests;
