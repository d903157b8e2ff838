//! How deep inside of a mesh is the deepest point of an element?
//!
//! Inside, the depth is the least of the distances to all triangles, and each is a convex function. So on a part of the element the depth
//! is at most the value of a game (`game`) of some of these functions: those of the triangles nearest to its corners, and to the point
//! where their interpolants are highest. Branch and bound, best first: the part with the highest bound is measured there, then halved
//! across its longest side. A part whose corners are all outside and that meets no triangle has no point inside.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use sdf_core::nalgebra::Vector3;

use super::game::game_value;
use super::{MeshSurface, SurfacePoint};
use crate::rounding::PRUNE_SLACK;

/// A point of the element and the nearest point of the mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Probe {
    /// Barycentric on the element; zero beyond its corners.
    pub weights: [f64; 3],
    /// The answer for that point.
    pub at: SurfacePoint,
}

/// The deepest point found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deepest {
    /// The point.
    pub probe: Probe,
    /// Lower bound of the signed distance on the whole element.
    pub lower_bound: f64,
    /// Is the bound within the tolerance of the point's distance, or above the margin?
    pub is_settled: bool,
    /// Points measured.
    pub evaluations: u32,
}

/// Limits of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DepthLimits {
    /// Stop when the bound is so near to the depth found.
    pub tolerance: f64,
    /// Stop when no point is deeper than this.
    pub least_depth: f64,
    /// Points measured at most.
    pub evaluations: u32,
}

/// Triangles beside those nearest to the corners that take part in a part's bound.
const EXTRA: usize = 3;

/// A part of the element that is not settled.
#[derive(Clone, Copy)]
struct Part {
    /// Indices of probes; only the first of as many as the element has corners count.
    corners: [u32; 3],
    extra: [u32; EXTRA],
    upper: f64,
    /// Where the interpolants are highest, in the part's own corners.
    weights: [f64; 3],
}

impl Ord for Part {
    fn cmp(&self, other: &Self) -> Ordering {
        self.upper.total_cmp(&other.upper).then_with(|| other.corners.cmp(&self.corners))
    }
}

impl PartialOrd for Part {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Part {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Part {}

struct Search<'a> {
    surface: &'a MeshSurface,
    corners: &'a [Vector3<f64>],
    limits: DepthLimits,
    probes: Vec<Probe>,
    /// Index of the deepest probe.
    best: usize,
    evaluations: u32,
    /// The highest bound of all parts that are settled.
    settled: f64,
}

impl MeshSurface {
    /// The deepest point of an element of one to three corners, or the nearest one known where none is inside. `known` are points of
    /// it that were measured, at least one.
    pub fn deepest(&self, corners: &[Vector3<f64>], known: &[Probe], limits: DepthLimits) -> Deepest {
        let mut search = Search {
            surface: self,
            corners,
            limits,
            probes: known.to_vec(),
            best: 0,
            evaluations: 0,
            settled: f64::NEG_INFINITY,
        };
        search.best =
            (0..known.len()).fold(0, |best, probe| if search.depth(probe) > search.depth(best) { probe } else { best });
        let first = search.probes.len() as u32;
        for corner in 0..corners.len() {
            search.measure(std::array::from_fn(|index| f64::from(u8::from(index == corner))), known[0].at.slot);
        }
        if corners.len() == 1 {
            search.settled = search.depth(search.best);
            return search.result(true);
        }
        let mut extra = [known[0].at.slot as u32; EXTRA];
        known.iter().zip(&mut extra).for_each(|(probe, extra)| *extra = probe.at.slot as u32);
        let root = Part { corners: [first, first + 1, first + 2], extra, upper: f64::INFINITY, weights: [0.0; 3] };
        let mut open = BinaryHeap::new();
        open.extend(search.bounded(root));
        while let Some(part) = open.pop() {
            if part.upper <= search.target() {
                search.settled = search.settled.max(part.upper);
                break;
            }
            if search.evaluations >= limits.evaluations {
                search.settled = search.settled.max(part.upper);
                return search.result(false);
            }
            if let Some(part) = search.refined(part) {
                open.extend(search.halves(part).into_iter().filter_map(|half| search.bounded(half)));
            }
        }
        search.result(true)
    }
}

impl Search<'_> {
    fn depth(&self, probe: usize) -> f64 {
        -self.probes[probe].at.distance
    }

    /// A part whose bound is no higher is settled.
    fn target(&self) -> f64 {
        (self.depth(self.best) + self.limits.tolerance).max(self.limits.least_depth)
    }

    fn corner(&self, part: &Part, corner: usize) -> &Probe {
        &self.probes[part.corners[corner] as usize]
    }

    fn measure(&mut self, weights: [f64; 3], near: usize) -> usize {
        let query = self.corners.iter().zip(weights).map(|(corner, weight)| corner * weight).sum();
        let at = self.surface.nearest(query, near, Some(&self.probes[self.best].at));
        self.evaluations += 1;
        self.probes.push(Probe { weights, at });
        let probe = self.probes.len() - 1;
        if self.depth(probe) > self.depth(self.best) {
            self.best = probe;
        }
        probe
    }

    /// The part with its bound; `None` where that settles it.
    fn bounded(&mut self, part: Part) -> Option<Part> {
        let count = self.corners.len();
        let mut slots = [0; 3 + EXTRA];
        let mut rows = [[0.0; 3]; 3 + EXTRA];
        let mut used = 0;
        let own = (0..count).map(|corner| self.corner(&part, corner).at.slot);
        for slot in own.chain(part.extra.iter().map(|slot| *slot as usize)) {
            if slots[..used].contains(&slot) {
                continue;
            }
            slots[used] = slot;
            for corner in 0..count {
                let at = &self.corner(&part, corner).at;
                let is_nearest = at.slot == slot;
                rows[used][corner] =
                    if is_nearest { at.distance.abs() } else { self.surface.distance_to_triangle(at.query, slot) };
            }
            used += 1;
        }
        let value = game_value(&rows[..used], count, self.target());
        let upper = value.upper.min(part.upper);
        if upper <= self.target() {
            self.settled = self.settled.max(upper);
            return None;
        }
        (!self.is_outside(&part)).then_some(Part { upper, weights: value.weights, ..part })
    }

    /// Measures the part where its bound is highest. `None` where that settles it.
    fn refined(&mut self, part: Part) -> Option<Part> {
        let count = self.corners.len();
        if part.weights.iter().any(|weight| *weight > NEAR_A_CORNER) {
            return Some(part);
        }
        let mut weights = [0.0; 3];
        for corner in 0..count {
            let at_corner = self.corner(&part, corner).weights;
            (0..3).for_each(|index| weights[index] += part.weights[corner] * at_corner[index]);
        }
        let probe = self.measure(weights, self.corner(&part, 0).at.slot);
        let mut extra = part.extra;
        extra.rotate_right(1);
        extra[0] = self.probes[probe].at.slot as u32;
        self.bounded(Part { extra, ..part })
    }

    /// Both halves of a part, across its longest side.
    fn halves(&mut self, part: Part) -> [Part; 2] {
        let sides: &[(usize, usize)] = if self.corners.len() == 2 { &[(0, 1)] } else { &[(0, 1), (1, 2), (2, 0)] };
        let length =
            |(a, b): (usize, usize)| (self.corner(&part, a).at.query - self.corner(&part, b).at.query).norm_squared();
        let longest =
            sides.iter().copied().fold(sides[0], |best, side| if length(side) > length(best) { side } else { best });
        let (a, b) = longest;
        let (start, end) = (*self.corner(&part, a), *self.corner(&part, b));
        let middle = std::array::from_fn(|index| 0.5 * (start.weights[index] + end.weights[index]));
        let middle = self.measure(middle, start.at.slot) as u32;
        [a, b].map(|replaced| {
            let mut half = part;
            half.corners[replaced] = middle;
            half
        })
    }

    /// Are all points of the part outside?
    fn is_outside(&self, part: &Part) -> bool {
        let corners = || (0..self.corners.len()).map(|corner| self.corner(part, corner).at);
        if !self.surface.is_continuous() || corners().any(|at| at.distance <= 0.0) {
            return false;
        }
        let mut points = [Vector3::zeros(); 3];
        corners().zip(&mut points).for_each(|(at, point)| *point = at.query);
        let points = &points[..self.corners.len()];
        // A ball about a point outside that reaches no triangle is outside.
        let reach = |from: Vector3<f64>| points.iter().map(|point| (point - from).norm()).fold(0.0, f64::max);
        if corners().any(|at| at.distance > reach(at.query)) {
            return true;
        }
        // Two edges that cross come within rounding of each other.
        let touch = PRUNE_SLACK * points.iter().map(|point| point.amax()).fold(0.0, f64::max);
        self.surface.closest(points, points[0], touch).is_none()
    }

    fn result(&self, is_settled: bool) -> Deepest {
        let probe = self.probes[self.best];
        let lower_bound = probe.at.distance.min(-self.settled);
        Deepest { probe, lower_bound, is_settled, evaluations: self.evaluations }
    }
}

/// A weight above which the point is not measured again: its corner was.
const NEAR_A_CORNER: f64 = 0.999;
