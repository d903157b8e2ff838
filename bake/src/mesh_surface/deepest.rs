//! How deep inside of a mesh is the deepest point of an element?
//!
//! Branch and bound, best first. A part is quartered, by halving it twice across its longest side. Its bound is the value of a game
//! (`game`) of convex functions that the depth does not exceed on the part:
//!
//! - The distance to one triangle: those nearest to its corners and its middle.
//! - depth(b) + max over n of −n·(x − b) from a corner b, with the outward normals n of the triangles that can be nearest to a point of
//!   the part (`nearby`): the depth's slope is one of them, or between them where an edge or a corner is nearest. Over a smooth mesh
//!   this is close where a part has many triangles around it, and it tells what is outside.
//!
//! A part without such normals whose corners are all outside and that meets no triangle has no point inside.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use sdf_core::nalgebra::Vector3;

use super::game::game_value;
use super::nearby::{Distances, reach};
use super::{MeshSurface, SurfacePoint};
use crate::rounding::PRUNE_SLACK;
use crate::simd::LANES;

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

/// Pieces into which a part is split.
const PIECES: usize = 4;

/// A part of the element that is not settled.
#[derive(Clone, Copy)]
struct Part {
    /// Indices of points; only the first of as many as the element has corners count.
    corners: [u32; 3],
    upper: f64,
    /// Where the convex functions are highest, in the element's corners.
    highest: [f64; 3],
    /// Range of its triangles, if it has few.
    list: Option<[u32; 2]>,
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

/// A measured point of the element.
#[derive(Clone, Copy)]
struct Point {
    weights: [f64; 3],
    query: Vector3<f64>,
    /// Of its nearest triangle.
    slot: u32,
    depth: f64,
}

struct Search<'a> {
    surface: &'a MeshSurface,
    corners: &'a [Vector3<f64>],
    limits: DepthLimits,
    points: Vec<Point>,
    /// Lists of triangles, of all parts.
    lists: Vec<u32>,
    distances: Distances,
    best: Probe,
    evaluations: u32,
    /// The highest bound of all parts that are settled.
    settled: f64,
}

impl MeshSurface {
    /// The deepest point of an element of one to three corners, or the nearest one known where none is inside. `known` are points of
    /// it that were measured, at least one.
    pub fn deepest(&self, corners: &[Vector3<f64>], known: &[Probe], limits: DepthLimits) -> Deepest {
        let best = known.iter().copied().fold(known[0], |a, b| if b.at.distance < a.at.distance { b } else { a });
        let mut search = Search {
            surface: self,
            corners,
            limits,
            points: vec![],
            lists: vec![],
            distances: Distances::new(),
            best,
            evaluations: 0,
            settled: f64::NEG_INFINITY,
        };
        let is_settled = search.run(known[0].at.slot);
        let lower_bound = search.best.at.distance.min(-search.settled);
        Deepest { probe: search.best, lower_bound, is_settled, evaluations: search.evaluations }
    }
}

impl Search<'_> {
    fn run(&mut self, guess: usize) -> bool {
        let count = self.corners.len();
        for corner in 0..count {
            let weights = std::array::from_fn(|index| f64::from(u8::from(index == corner)));
            let point = self.measured_by_tree(weights, guess);
            self.points.push(point);
        }
        if count == 1 {
            self.settled = self.depth();
            return true;
        }
        let mut open = BinaryHeap::new();
        let corners = [0, 1, 2];
        let middle = self.measured_by_tree(self.middle(corners), guess);
        let mut list = std::mem::take(&mut self.lists);
        let found = self.surface.gather(middle.query, middle.depth.abs(), self.radius(corners, middle.query), &mut list);
        self.lists = list;
        let list = found.then_some([0, self.lists.len() as u32]);
        let root = Part { corners, upper: f64::INFINITY, highest: [0.0; 3], list };
        open.extend(self.bounded(root, middle.slot));
        while let Some(part) = open.pop() {
            if part.upper <= self.target() {
                self.settled = self.settled.max(part.upper);
                return true;
            }
            if self.evaluations >= self.limits.evaluations {
                self.settled = self.settled.max(part.upper);
                return false;
            }
            open.extend(self.pieces(part).into_iter().flatten());
        }
        true
    }

    fn depth(&self) -> f64 {
        -self.best.at.distance
    }

    /// A part whose bound is no higher is settled.
    fn target(&self) -> f64 {
        (self.depth() + self.limits.tolerance).max(self.limits.least_depth)
    }

    fn position(&self, weights: [f64; 3]) -> Vector3<f64> {
        self.corners.iter().zip(weights).map(|(corner, weight)| corner * weight).sum()
    }

    fn corners_of(&self, corners: [u32; 3]) -> impl Iterator<Item = &Point> {
        corners.into_iter().take(self.corners.len()).map(|corner| &self.points[corner as usize])
    }

    fn middle(&self, corners: [u32; 3]) -> [f64; 3] {
        let share = 1.0 / self.corners.len() as f64;
        std::array::from_fn(|index| self.corners_of(corners).map(|corner| corner.weights[index] * share).sum())
    }

    fn radius(&self, corners: [u32; 3], middle: Vector3<f64>) -> f64 {
        self.corners_of(corners).map(|corner| (corner.query - middle).norm()).fold(0.0, f64::max)
    }

    fn measured_by_tree(&mut self, weights: [f64; 3], guess: usize) -> Point {
        let query = self.position(weights);
        let at = self.surface.nearest(query, guess, Some(&self.best.at));
        self.noted(Probe { weights, at })
    }

    fn noted(&mut self, probe: Probe) -> Point {
        self.evaluations += 1;
        if probe.at.distance < self.best.at.distance {
            self.best = probe;
        }
        let Probe { weights, at } = probe;
        Point { weights, query: at.query, slot: at.slot as u32, depth: -at.distance }
    }

    /// Both halves of a part, across its longest side.
    fn halves(&mut self, corners: [u32; 3]) -> [[u32; 3]; 2] {
        let sides: &[(usize, usize)] = if self.corners.len() == 2 { &[(0, 1)] } else { &[(0, 1), (1, 2), (2, 0)] };
        let point = |corner: usize| &self.points[corners[corner] as usize];
        let length = |(a, b): (usize, usize)| (point(a).query - point(b).query).norm_squared();
        let longest =
            sides.iter().copied().fold(sides[0], |best, side| if length(side) > length(best) { side } else { best });
        let (a, b) = longest;
        let weights = std::array::from_fn(|index| 0.5 * (point(a).weights[index] + point(b).weights[index]));
        let query = self.position(weights);
        self.points.push(Point { weights, query, ..*point(a) });
        let middle = self.points.len() as u32 - 1;
        [a, b].map(|replaced| {
            let mut half = corners;
            half[replaced] = middle;
            half
        })
    }

    /// Four pieces of a part that are not settled.
    fn pieces(&mut self, part: Part) -> [Option<Part>; PIECES] {
        let first = self.points.len();
        let halves = self.halves(part.corners);
        let quarters = halves.map(|half| self.halves(half));
        let pieces = [quarters[0][0], quarters[0][1], quarters[1][0], quarters[1][1]];
        let middles = pieces.map(|piece| self.middle(piece));
        let list = part.list.map(|[from, to]| from as usize..to as usize);
        let is_new = part.highest.iter().all(|weight| *weight < NEAR_A_CORNER);
        let mut centers = [(0, 0.0); PIECES];
        if let Some(list) = &list {
            let mut weights = [part.highest; LANES];
            (0..3).for_each(|lane| weights[lane] = self.points[first + lane].weights);
            weights[3..3 + PIECES].copy_from_slice(&middles);
            let queries = weights.map(|weights| self.position(weights));
            let slots = &self.lists[list.clone()];
            self.distances.measure(&self.surface.tree, slots, &queries);
            for lane in 0..LANES {
                let (slot, distance) = (self.distances.nearest[lane], self.distances.least[lane].sqrt());
                if (3..3 + PIECES).contains(&lane) {
                    centers[lane - 3] = (slot, distance);
                }
                if lane < 3 || (distance > self.depth() && (lane < LANES - 1 || is_new)) {
                    let at = self.surface.nearest_on(queries[lane], slot as usize, Some(&self.best.at));
                    let point = self.noted(Probe { weights: weights[lane], at });
                    if lane < 3 {
                        self.points[first + lane] = point;
                    }
                }
            }
        } else {
            for index in first..first + 3 {
                self.points[index] = self.measured_by_tree(self.points[index].weights, self.points[index].slot as usize);
            }
            if is_new {
                self.measured_by_tree(part.highest, self.points[first].slot as usize);
            }
            for piece in 0..PIECES {
                let middle = self.measured_by_tree(middles[piece], self.points[first].slot as usize);
                centers[piece] = (middle.slot, middle.depth.abs());
            }
        }
        let mut found = [None; PIECES];
        for (piece, corners) in pieces.into_iter().enumerate() {
            let middle = self.position(middles[piece]);
            let (slot, distance) = centers[piece];
            let radius = self.radius(corners, middle);
            let start = self.lists.len();
            let has_list = if let Some(list) = &list {
                let within = reach(middle, distance, radius);
                for (position, squared) in self.distances.squared.iter().enumerate() {
                    if squared[3 + piece] <= within * within {
                        self.lists.push(self.lists[list.start + position]);
                    }
                }
                true
            } else {
                self.surface.gather(middle, distance, radius, &mut self.lists)
            };
            let list = has_list.then_some([start as u32, self.lists.len() as u32]);
            found[piece] = self.bounded(Part { corners, list, ..part }, slot);
        }
        found
    }

    /// The part with its bound; `None` where that settles it. `nearest` is the triangle nearest to its middle.
    fn bounded(&mut self, part: Part, nearest: u32) -> Option<Part> {
        let count = self.corners.len();
        let points = part.corners.map(|corner| self.points[(corner as usize).min(self.points.len() - 1)]);
        let points = &points[..count];
        let mut rows = [[0.0; 3]; 3 + 4];
        let mut used = 0;
        if let Some(slopes) = self.slopes(&part, points, nearest) {
            rows[..3].copy_from_slice(&slopes);
            used = count;
        }
        let has_slopes = used > 0;
        let mut value = game_value(&rows[..used], count, self.target());
        if value.upper > self.target() {
            let mut slots = [u32::MAX; 4];
            for (index, slot) in points.iter().map(|point| point.slot).chain([nearest]).enumerate() {
                if slots.contains(&slot) {
                    continue;
                }
                slots[index] = slot;
                for (corner, point) in points.iter().enumerate() {
                    let is_nearest = point.slot == slot;
                    rows[used][corner] = if is_nearest {
                        point.depth.abs()
                    } else {
                        self.surface.distance_to_triangle(point.query, slot as usize)
                    };
                }
                used += 1;
            }
            value = game_value(&rows[..used], count, self.target());
        }
        let upper = value.upper.min(part.upper);
        if upper <= self.target() {
            self.settled = self.settled.max(upper);
            return None;
        }
        if !has_slopes && self.is_outside(points) {
            return None;
        }
        let highest = std::array::from_fn(|index| {
            points.iter().zip(value.weights).map(|(point, weight)| point.weights[index] * weight).sum()
        });
        Some(Part { upper, highest, ..part })
    }

    /// For each corner b the values of depth(b) + max over the slopes of slope·(x − b) at all corners; `None` where a slope is unknown.
    fn slopes(&self, part: &Part, points: &[Point], nearest: u32) -> Option<[[f64; 3]; 3]> {
        let [from, to] = part.list?;
        let axis = self.surface.outward(nearest as usize);
        // Greatest height of a corner over another along a normal.
        let mut falls = [[f64::NEG_INFINITY; 3]; 3];
        let mut least_cosine = f64::INFINITY;
        for slot in &self.lists[from as usize..to as usize] {
            let normal = self.surface.outward(*slot as usize);
            least_cosine = least_cosine.min(normal.dot(&axis));
            let mut heights = [0.0; 3];
            points.iter().zip(&mut heights).for_each(|(point, height)| *height = normal.dot(&(point.query - points[0].query)));
            for base in 0..3 {
                for corner in 0..3 {
                    falls[base][corner] = f64::max(falls[base][corner], heights[base] - heights[corner]);
                }
            }
        }
        if least_cosine < MIN_COSINE {
            return None;
        }
        // A unit vector between normals is longer than their mean.
        let longer = 1.0 / least_cosine;
        let mut rows = [[0.0; 3]; 3];
        for (base, point) in points.iter().enumerate() {
            for corner in 0..points.len() {
                let fall = falls[base][corner];
                rows[base][corner] = point.depth + if fall > 0.0 { fall * longer } else { fall };
            }
        }
        Some(rows)
    }

    /// Are all points of a part outside, given its corners?
    fn is_outside(&self, corners: &[Point]) -> bool {
        if !self.surface.is_continuous() || corners.iter().any(|at| at.depth >= 0.0) {
            return false;
        }
        let mut points = [Vector3::zeros(); 3];
        corners.iter().zip(&mut points).for_each(|(at, point)| *point = at.query);
        let points = &points[..corners.len()];
        // A ball about a point outside that reaches no triangle is outside.
        let reach = |from: Vector3<f64>| points.iter().map(|point| (point - from).norm()).fold(0.0, f64::max);
        if corners.iter().any(|at| -at.depth > reach(at.query)) {
            return true;
        }
        // Two edges that cross come within rounding of each other.
        let touch = PRUNE_SLACK * points.iter().map(|point| point.amax()).fold(0.0, f64::max);
        self.surface.closest(points, points[0], touch).is_none()
    }
}

/// A weight above which the point is not measured again: its corner was.
const NEAR_A_CORNER: f64 = 0.999;

/// Normals that turn farther from the middle's tell too little of the slopes between them.
const MIN_COSINE: f64 = 0.3;
