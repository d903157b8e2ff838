//! How deep can a part of an element be?
//!
//! Its bound is the value of a game (`game`) of convex functions that the depth does not exceed on the part:
//!
//! - The distance to one triangle: those nearest to its corners and its middle.
//! - depth(b) + max over n of −n·(x − b) from a corner b, with the outward normals n of the triangles that can be nearest to a point of
//!   the part: the depth's gradient is −n, or between two of them where an edge or a corner is nearest. Over a smooth mesh this is close
//!   where a part has many triangles around it, and it tells what is outside.
//!
//! A unit vector between normals is Σ aₙ n with Σ aₙ = 1 / |a mean of the n|, at most 1 / the least cosine to one of them.
//!
//! A part without such normals whose corners are all outside and that meets no triangle has no point inside.

use sdf_core::nalgebra::Vector3;

use super::{Part, Point, Search};
use crate::mesh_surface::game::game_value;
use crate::rounding::{NORMAL_SLACK, PRUNE_SLACK};
use crate::simd::{max, min};

/// Triangles in the bound of a part, at most: those nearest to its corners and its middle.
const TRIANGLES: usize = 4;

/// Normals that turn farther from the middle's tell too little of the slopes between them.
const MIN_COSINE: f64 = 0.3;

impl Search<'_> {
    /// The part with its bound; `None` where that settles it. `nearest` is the triangle nearest to its middle,
    /// `to_nearest` the distances of the corners to it, where they are known.
    pub(super) fn bounded(&mut self, part: Part, nearest: u32, to_nearest: Option<[f64; 3]>) -> Option<Part> {
        let count = self.corners.len();
        let points = part.corners.map(|corner| self.points[(corner as usize).min(self.points.len() - 1)]);
        let points = &points[..count];
        let mut rows = [[0.0; 3]; 3 + TRIANGLES];
        let slopes = self.slopes(&part, points, nearest);
        let mut used = 0;
        if let Some(slopes) = &slopes {
            rows[..3].copy_from_slice(slopes);
            used = count;
        }
        let mut value = game_value(&rows[..used], count, self.target());
        if value.upper > self.target() {
            let slots = [0, 1, 2].map(|corner| points.get(corner).map_or(nearest, |point| point.slot));
            for (index, slot) in slots.into_iter().chain([nearest]).enumerate() {
                if slots[..index.min(3)].contains(&slot) {
                    continue;
                }
                let known = to_nearest.filter(|_| slot == nearest);
                rows[used] = known.unwrap_or_else(|| self.distances_to(slot, part.corners));
                used += 1;
            }
            value = game_value(&rows[..used], count, self.target());
        }
        let upper = value.upper.min(part.upper);
        if upper <= self.target() {
            self.settled = self.settled.max(upper);
            return None;
        }
        if slopes.is_none() && self.is_outside(points) {
            return None;
        }
        let highest = std::array::from_fn(|index| {
            points.iter().zip(value.weights).map(|(point, weight)| point.weights[index] * weight).sum()
        });
        Some(Part { upper, highest, ..part })
    }

    /// Values at all corners of depth(b) + max over the slopes of slope·(x − b), for each corner b; `None` where a slope is unknown.
    fn slopes(&self, part: &Part, points: &[Point], nearest: u32) -> Option<[[f64; 3]; 3]> {
        let [from, to] = part.list?;
        let axis = self.surface.outward(nearest as usize);
        // Greatest height of a corner over another along a normal.
        let mut falls = [[f64::NEG_INFINITY; 3]; 3];
        let mut least_cosine = f64::INFINITY;
        for slot in &self.lists[from as usize..to as usize] {
            let normal = self.surface.outward(*slot as usize);
            least_cosine = min(normal.dot(&axis), least_cosine);
            let mut heights = [0.0; 3];
            points
                .iter()
                .zip(&mut heights)
                .for_each(|(point, height)| *height = normal.dot(&(point.query - points[0].query)));
            for base in 0..3 {
                for corner in 0..3 {
                    falls[base][corner] = max(heights[base] - heights[corner], falls[base][corner]);
                }
            }
        }
        if least_cosine < MIN_COSINE {
            return None;
        }
        let longer = 1.0 / least_cosine;
        let mut rows = [[0.0; 3]; 3];
        for (base, point) in points.iter().enumerate() {
            for corner in 0..points.len() {
                let rounding = NORMAL_SLACK * (point.query - points[corner].query).norm();
                let fall = falls[base][corner] + rounding;
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
        let rounding = PRUNE_SLACK * points.iter().map(|point| point.amax()).fold(0.0, f64::max);
        let touch = rounding + self.surface.error_bound(points, 0.0);
        self.surface.closest(points, Some(corners[0].slot as usize), touch).is_none()
    }
}
