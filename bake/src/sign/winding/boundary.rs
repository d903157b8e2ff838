use std::f64::consts::PI;

use sdf_core::nalgebra::Vector3;

use super::boundary_cone::BoundaryCone;
use super::{Estimate, MAX_DOUBT, round_to_fraction};
use crate::bvh::hilbert::{BITS, hilbert_index};
use crate::rounding::SUM_SLACK;
use crate::simd::{LANES, Lanes, VectorX8};

/// The curve that bounds a mesh: where its triangles, turned to agree, do not cancel along an edge. By Stokes' theorem
/// the winding number varies away from the triangles as this curve alone says, by the law of Biot and Savart.
pub(crate) struct MeshBoundary {
    /// Neighbours together.
    edges: Vec<Edges>,
    /// Each part the edges of one of [`Self::edges`].
    groups: Vec<Parts>,
    /// Without an edge where the rim has too many to be of use.
    boundary_cone: BoundaryCone,
}

/// Parts of the rim side by side, each within a ball. In the places after the last stands the first once more, without
/// weight.
struct Parts {
    center: VectorX8<f64>,
    radius: Lanes<f64>,
    /// Length times how many triangles more run along it one way than the other.
    weight: Lanes<f64>,
}

/// Edges of the rim side by side. In the places after the last stands the first once more, without weight.
struct Edges {
    from: VectorX8<f64>,
    way: VectorX8<f64>,
    /// One over the length's square.
    inv_length_sq: Lanes<f64>,
    length: Lanes<f64>,
    /// How many triangles more run along it one way than the other.
    times: Lanes<f64>,
}

struct Part {
    center: Vector3<f64>,
    radius: f64,
    weight: f64,
}

/// With more edges than this the bound would cost more than the winding numbers that it saves.
const MAX_RIM_EDGES: usize = 20_000;

/// With more edges than this, each as often as it is there, the cap takes about as long as the mesh.
const MAX_CAP_EDGES: f64 = 2000.0;

/// A group farther than this many of its radii counts as one.
const FAR_RADII: f64 = 2.0;

impl MeshBoundary {
    /// Edges as their two ends and their multiplicity.
    pub fn new(edges: impl Iterator<Item = ([Vector3<f64>; 2], f64)>) -> Self {
        let mut edges: Vec<_> = edges.collect();
        let ends = || edges.iter().flat_map(|(ends, _)| ends);
        let Some(low) = ends().copied().reduce(|a, b| a.inf(&b)) else {
            return Self { edges: vec![], groups: vec![], boundary_cone: BoundaryCone::new(Vector3::zeros(), &[]) };
        };
        let middle = ends().sum::<Vector3<f64>>() / (2.0 * edges.len() as f64);
        let side = ends().map(|end| (end - low).max()).fold(0.0, f64::max);
        let place = |[from, to]: [Vector3<f64>; 2]| {
            let cells = ((from + to) * 0.5 - low) * (f64::from((1_u32 << BITS) - 1) / side);
            hilbert_index(std::array::from_fn(|axis| cells[axis] as u32))
        };
        edges.sort_by_cached_key(|(ends, _)| place(*ends));
        let parts: Vec<Part> = edges.iter().map(Part::of_edge).collect();
        let groups: Vec<Part> = parts.chunks(LANES).map(Part::around).collect();
        let of_cap: f64 = edges.iter().map(|(_, times)| times.abs()).sum();
        let with_cap = &edges[..if of_cap > MAX_CAP_EDGES { 0 } else { edges.len() }];
        Self {
            edges: edges.chunks(LANES).map(Edges::new).collect(),
            groups: groups.chunks(LANES).map(Parts::new).collect(),
            boundary_cone: BoundaryCone::new(middle, with_cap),
        }
    }

    /// The winding number but for a whole number: together with the cap turned around, the mesh is closed. `None` where that
    /// is not known.
    pub fn winding_fraction(&self, point: Vector3<f64>) -> Option<Estimate> {
        match (self.is_empty(), self.has_cap()) {
            (true, _) => Some(Estimate { value: 0.0, error: 0.0 }),
            (false, true) => self.boundary_cone.winding_fraction(point),
            (false, false) => None,
        }
    }

    /// A winding number at a point, with the fraction that the rim gives there. `None` where that is not known, or too much doubt
    /// is left which whole number to add.
    pub fn sharpen(&self, about: Estimate, point: Vector3<f64>) -> Option<Estimate> {
        if about.error > MAX_DOUBT {
            return None;
        }
        let Estimate { value: fraction, error } = self.winding_fraction(point)?;
        Some(Estimate { value: round_to_fraction(about, fraction)?, error })
    }

    /// It tells the fraction at most points.
    pub fn has_cap(&self) -> bool {
        !self.boundary_cone.is_empty()
    }

    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// There is a bound of the slope.
    pub fn tells_slopes(&self) -> bool {
        self.edges.len() * LANES <= MAX_RIM_EDGES
    }

    /// The most that the winding number changes over a unit of distance in a ball, other than across triangles.
    pub fn winding_slope(&self, center: Vector3<f64>, radius: f64) -> f64 {
        if !self.tells_slopes() {
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
                if distances[group] <= FAR_RADII * groups.radius[group] {
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

impl Part {
    fn of_edge(([from, to], times): &([Vector3<f64>; 2], f64)) -> Self {
        let length = (to - from).norm();
        Self { center: (from + to) * 0.5, radius: 0.5 * length, weight: length * times.abs() }
    }

    fn around(parts: &[Self]) -> Self {
        let center = parts.iter().map(|part| part.center).sum::<Vector3<f64>>() / parts.len() as f64;
        let reach = |part: &Self| (part.center - center).norm() + part.radius;
        let radius = parts.iter().map(reach).fold(0.0, f64::max) * (1.0 + SUM_SLACK);
        Self { center, radius, weight: parts.iter().map(|part| part.weight).sum() }
    }
}

impl Edges {
    fn new(edges: &[([Vector3<f64>; 2], f64)]) -> Self {
        let edge = |lane: usize| edges.get(lane).unwrap_or(&edges[0]);
        let way = |lane: usize| edge(lane).0[1] - edge(lane).0[0];
        Self {
            from: std::array::from_fn(|axis| std::array::from_fn(|lane| edge(lane).0[0][axis])),
            way: std::array::from_fn(|axis| std::array::from_fn(|lane| way(lane)[axis])),
            inv_length_sq: std::array::from_fn(|lane| 1.0 / way(lane).norm_squared()),
            length: std::array::from_fn(|lane| way(lane).norm()),
            times: std::array::from_fn(|lane| edges.get(lane).map_or(0.0, |(_, times)| times.abs())),
        }
    }

    /// What each adds at most. From a point at a distance d of an edge the integral of one over the square of the distance, along
    /// it, is at most length/d²; and at most π/d, that along the line on both sides. In a ball of radius r around that point no
    /// distance is less by a factor of more than (d − r)/d.
    #[inline(always)]
    fn slopes(&self, center: Vector3<f64>, radius: f64) -> Lanes<f64> {
        let mut slopes = [0.0; LANES];
        for lane in 0..LANES {
            let [x, y, z] =
                [center.x - self.from[0][lane], center.y - self.from[1][lane], center.z - self.from[2][lane]];
            let [along_x, along_y, along_z] = [self.way[0][lane], self.way[1][lane], self.way[2][lane]];
            let share = (x * along_x + y * along_y + z * along_z) * self.inv_length_sq[lane];
            let share = if share > 0.0 { share } else { 0.0 };
            let share = if share < 1.0 { share } else { 1.0 };
            let [x, y, z] = [x - share * along_x, y - share * along_y, z - share * along_z];
            let distance = (x * x + y * y + z * z).sqrt();
            let most = PI * distance;
            let most = if self.length[lane] < most { self.length[lane] } else { most };
            let least = distance * (1.0 - SUM_SLACK) - radius;
            let slope = self.times[lane] * most / (least * least);
            slopes[lane] = if least > 0.0 { slope } else { f64::INFINITY };
        }
        slopes
    }
}

impl Parts {
    fn new(parts: &[Part]) -> Self {
        let part = |lane: usize| parts.get(lane).unwrap_or(&parts[0]);
        Self {
            center: std::array::from_fn(|axis| std::array::from_fn(|lane| part(lane).center[axis])),
            radius: std::array::from_fn(|lane| part(lane).radius),
            weight: std::array::from_fn(|lane| parts.get(lane).map_or(0.0, |part| part.weight)),
        }
    }

    /// From a ball, at least.
    #[inline(always)]
    fn distances(&self, center: Vector3<f64>, radius: f64) -> Lanes<f64> {
        let mut distances = [0.0; LANES];
        for lane in 0..LANES {
            let [x, y, z] = [0, 1, 2].map(|axis| self.center[axis][lane] - center[axis]);
            distances[lane] = (x * x + y * y + z * z).sqrt() - self.radius[lane] - radius;
        }
        distances
    }

    /// What each adds at most.
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
mod tests {
    use super::*;
    use crate::sign::winding::solid_angle;
    use crate::testing::{random, random_vector};

    /// A crumpled sheet, `cells` by `cells` squares cut in two, some of which are left out, and its rim.
    fn sheet(cells: usize, state: &mut u64) -> (Vec<[Vector3<f64>; 3]>, MeshBoundary) {
        let side = cells + 1;
        let points: Vec<Vector3<f64>> = (0..side * side)
            .map(|index| Vector3::new((index % side) as f64, (index / side) as f64, 0.0) / cells as f64)
            .map(|point| point + random_vector(state) * (0.2 / cells as f64))
            .collect();
        let mut triangles = vec![];
        let mut excess = std::collections::BTreeMap::new();
        for index in (0..side * cells).filter(|index| index % side < cells) {
            for corners in [[index, index + 1, index + side + 1], [index, index + side + 1, index + side]] {
                if random(state) < -0.6 {
                    continue;
                }
                triangles.push(corners.map(|corner| points[corner]));
                for corner in 0..3 {
                    let [from, to] = [corners[corner], corners[(corner + 1) % 3]];
                    *excess.entry([from.min(to), from.max(to)]).or_insert(0.0) += if from < to { 1.0 } else { -1.0 };
                }
            }
        }
        let boundary = excess.into_iter().filter(|(_, times)| *times != 0.0);
        (triangles, MeshBoundary::new(boundary.map(|(ends, times)| (ends.map(|end| points[end]), times))))
    }

    fn winding(triangles: &[[Vector3<f64>; 3]], point: Vector3<f64>) -> f64 {
        triangles.iter().map(|corners| solid_angle(corners.map(|corner| corner - point))).sum::<f64>() / (4.0 * PI)
    }

    #[test]
    fn the_rim_tells_the_winding_number_but_for_a_whole_number() {
        let mut state = 41;
        for cells in [1, 4, 12] {
            let (triangles, boundary) = sheet(cells, &mut state);
            for _ in 0..1000 {
                let point = random_vector(&mut state) * 1.5;
                let fraction = boundary.winding_fraction(point).unwrap();
                let off = winding(&triangles, point) - fraction.value;
                assert!((off - off.round()).abs() < fraction.error.min(1e-9) + 1e-13, "{off} at {point}");
            }
            let edge = &boundary.edges[0];
            let middle = Vector3::from_fn(|axis, _| edge.from[axis][0] + 0.5 * edge.way[axis][0]);
            assert!(boundary.winding_fraction(middle).is_none());
        }
    }

    #[test]
    fn the_winding_number_changes_no_faster_than_the_rim_allows() {
        let mut state = 43;
        let mut tightest = 0.0_f64;
        for cells in [1, 4, 12, 30] {
            let (triangles, boundary) = sheet(cells, &mut state);
            for _ in 0..1000 {
                let center = random_vector(&mut state) * 1.5;
                let radius = 0.1 * random(&mut state).abs();
                let slope = boundary.winding_slope(center, radius);
                let [a, b] = [0, 1].map(|_| center + random_vector(&mut state).normalize() * radius);
                let change = winding(&triangles, b) - winding(&triangles, a);
                let smooth = (change - change.round()).abs();
                let allowed = slope * (b - a).norm();
                assert!(allowed > 0.5 || smooth <= allowed + 1e-12, "{smooth} > {allowed} at {center}, {radius}");
                tightest = tightest.max(smooth / allowed);
            }
        }
        assert!(tightest > 0.2, "{tightest}: the bound is wider than it need be");
    }
}
