//! How deep inside of a mesh is the deepest point of an element?
//!
//! Branch and bound, best first. A part is quartered, by halving it twice across its longest side; `bound` tells how deep it can be. The
//! triangles near a part stand in a list (`nearby`), and all points that a split makes are measured in one pass over it.

mod bound;

use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::ops::Range;

use sdf_core::nalgebra::Vector3;

use super::nearby::{Ball, Distances, FIRST_FOOT, MAX_TRIANGLES, Nearest, Sieve};
use super::{MeshSurface, SurfacePoint};
use crate::simd::{LANES, lane_of};

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

/// Pieces into which a part is split, and the corners that this makes.
const PIECES: usize = 4;
const NEW: usize = FIRST_FOOT;

/// Room for the points of nearly all searches.
const POINTS: usize = 64;

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
    /// Slot of the nearest triangle.
    slot: u32,
    depth: f64,
}

/// The triangles around a part.
struct Sifted {
    list: [u32; 2],
    /// Distances of the part's corners to the triangle nearest to its middle.
    to_nearest: [f64; 3],
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
            points: Vec::with_capacity(POINTS),
            lists: Vec::with_capacity(2 * MAX_TRIANGLES),
            distances: Distances::new(),
            best,
            evaluations: 0,
            settled: f64::NEG_INFINITY,
        };
        let is_settled = search.run(known[0]);
        let lower_bound = search.best.at.distance.min(-search.settled);
        Deepest { probe: search.best, lower_bound, is_settled, evaluations: search.evaluations }
    }
}

impl Search<'_> {
    fn run(&mut self, start: Probe) -> bool {
        if self.corners.len() == 1 {
            let corner = self.measured([1.0, 0.0, 0.0], start.at.slot);
            self.points.push(corner);
            self.settled = self.depth();
            return true;
        }
        let root = self.root(start);
        let mut open = BinaryHeap::new();
        open.extend(root);
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

    /// The whole element; `None` where its first bound settles it.
    fn root(&mut self, start: Probe) -> Option<Part> {
        let (count, guess) = (self.corners.len(), start.at.slot);
        let unit = |corner| std::array::from_fn(|index| f64::from(u8::from(index == corner)));
        for corner in 0..count {
            let weights = unit(corner);
            let query = self.position(weights);
            self.points.push(Point { weights, query, slot: guess as u32, depth: 0.0 });
        }
        let corners = [0, 1, 2];
        let weights = self.middle(corners);
        let middle = self.position(weights);
        let radius = self.radius(corners, middle);
        // Not farther than the start's triangle.
        let distance = start.at.distance.abs() + (middle - start.at.query).norm();
        let is_listed = self.surface.gather(middle, distance, radius, &mut self.lists);
        let part = Part { corners, upper: f64::INFINITY, highest: [0.0; 3], list: None };
        if !is_listed {
            for corner in 0..count {
                self.points[corner] = self.measured(unit(corner), guess);
            }
            let middle = self.measured(weights, guess);
            return self.bounded(part, middle.slot, None);
        }
        let list = 0..self.lists.len();
        let mut queries = [middle; NEW + 1];
        (0..count).for_each(|corner| queries[corner] = self.points[corner].query);
        self.distances.measure(&self.surface.tree, &self.lists[list.clone()], &queries);
        for corner in 0..count {
            self.points[corner] = self.noted_nearest(unit(corner), queries[corner], self.distances.nearest(corner));
        }
        let nearest = self.distances.nearest(NEW);
        if nearest.distance > self.depth() {
            self.noted_nearest(weights, middle, nearest);
        }
        let Sifted { list, to_nearest } = self.sifted(list, corners, middle, 0);
        self.bounded(Part { list: Some(list), ..part }, nearest.slot, Some(to_nearest))
    }

    /// A point whose nearest triangle is known.
    fn noted_nearest(&mut self, weights: [f64; 3], query: Vector3<f64>, nearest: Nearest) -> Point {
        let at = self.surface.nearest_on(query, nearest.slot as usize, Some(&self.best.at));
        self.noted(Probe { weights, at })
    }

    /// The triangles of a list that can be nearest to a point of a part, appended to the lists. The distances are those of the list, and
    /// the part's middle is the point of a piece.
    fn sifted(&mut self, list: Range<usize>, corners: [u32; 3], middle: Vector3<f64>, piece: usize) -> Sifted {
        let Nearest { slot, distance } = self.distances.nearest(NEW + piece);
        let mut known = [(middle, distance); 3];
        let to_nearest = self.distances_to(slot, corners);
        for ((known, corner), distance) in known.iter_mut().zip(self.corners_of(corners)).zip(to_nearest) {
            *known = (corner.query, distance);
        }
        let ball = Ball { middle, distance, radius: self.radius(corners, middle) };
        let sieve = Sieve::new(ball, &known[..self.corners.len()]);
        let start = self.lists.len() as u32;
        for (entry, position) in list.enumerate() {
            let foot = lane_of(&self.distances.feet[entry], piece);
            if sieve.keeps(foot.into(), self.distances.squared[entry][NEW + piece]) {
                self.lists.push(self.lists[position]);
            }
        }
        Sifted { list: [start, self.lists.len() as u32], to_nearest }
    }

    /// Distances of a part's corners to a triangle.
    fn distances_to(&self, slot: u32, corners: [u32; 3]) -> [f64; 3] {
        let mut distances = [0.0; 3];
        for (distance, corner) in distances.iter_mut().zip(self.corners_of(corners)) {
            let measured = || self.surface.distance_to_triangle(corner.query, slot as usize);
            *distance = if corner.slot == slot { corner.depth.abs() } else { measured() };
        }
        distances
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

    fn measured(&mut self, weights: [f64; 3], guess: usize) -> Point {
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
        let nearest = match list.clone() {
            Some(list) => self.measure_by_list(list, first, &middles, part.highest),
            None => self.measure_by_tree(first, &middles, part.highest),
        };
        std::array::from_fn(|piece| {
            let (corners, query) = (pieces[piece], self.position(middles[piece]));
            let Nearest { slot, distance } = nearest[piece];
            let (own, to_nearest) = match &list {
                Some(list) => {
                    let Sifted { list, to_nearest } = self.sifted(list.clone(), corners, query, piece);
                    (Some(list), Some(to_nearest))
                }
                None => {
                    let start = self.lists.len() as u32;
                    let radius = self.radius(corners, query);
                    let is_listed = self.surface.gather(query, distance, radius, &mut self.lists);
                    (is_listed.then_some([start, self.lists.len() as u32]), None)
                }
            };
            self.bounded(Part { corners, list: own, ..part }, slot, to_nearest)
        })
    }

    /// Measures the new points from `first` on, the middles of the pieces and the highest point of a part, all in one pass over its
    /// triangles. A point that is no corner needs its sign only if it may be the deepest.
    fn measure_by_list(
        &mut self,
        list: Range<usize>,
        first: usize,
        middles: &[[f64; 3]; PIECES],
        highest: [f64; 3],
    ) -> [Nearest; PIECES] {
        let mut weights = [highest; LANES];
        (0..NEW).for_each(|lane| weights[lane] = self.points[first + lane].weights);
        weights[NEW..NEW + PIECES].copy_from_slice(middles);
        let queries = weights.map(|weights| self.position(weights));
        self.distances.measure(&self.surface.tree, &self.lists[list], &queries);
        for lane in 0..LANES {
            let nearest = self.distances.nearest(lane);
            let is_new = lane < NEW + PIECES || is_away_from_corners(highest);
            if lane < NEW || (is_new && nearest.distance > self.depth()) {
                let point = self.noted_nearest(weights[lane], queries[lane], nearest);
                if lane < NEW {
                    self.points[first + lane] = point;
                }
            }
        }
        std::array::from_fn(|piece| self.distances.nearest(NEW + piece))
    }

    /// The same, one point after the other.
    fn measure_by_tree(&mut self, first: usize, middles: &[[f64; 3]; PIECES], highest: [f64; 3]) -> [Nearest; PIECES] {
        for index in first..first + NEW {
            let Point { weights, slot, .. } = self.points[index];
            self.points[index] = self.measured(weights, slot as usize);
        }
        let guess = self.points[first].slot as usize;
        if is_away_from_corners(highest) {
            self.measured(highest, guess);
        }
        middles.map(|middle| {
            let Point { slot, depth, .. } = self.measured(middle, guess);
            Nearest { slot, distance: depth.abs() }
        })
    }
}

/// Is a point of an element worth a measurement? Its corners have been measured.
fn is_away_from_corners(weights: [f64; 3]) -> bool {
    weights.iter().all(|weight| *weight < 0.999)
}
