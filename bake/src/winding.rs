//! The generalized winding number of a triangle soup (Jacobson et al. 2013), summed over a tree whose far nodes count
//! as one dipole and its first correction (Barill et al. 2018, "Fast winding numbers for soups and clouds", §4, orders
//! 1 and 2).

mod cap;
mod lanes;
mod moments;
mod rim;

use std::f64::consts::PI;

use rayon::prelude::*;
use sdf_core::nalgebra::Vector3;

use crate::tree::Tree;
use moments::{Fan, Moments, Weighted};
pub(crate) use rim::Rim;

/// How many children a node has. They are summed side by side.
const FAN: usize = 8;

/// No tree of u32 triangles is deeper; 7 of 8 children of each level wait at most.
const STACK: usize = 11 * FAN;

/// A node is far when it is farther than this many of its radii, the paper's own choice. More costs time, less precision.
const FAR_RADII: f64 = 2.0;

/// How far a sum with [`FAR_RADII`] may be off. The largest error seen is 0.042: within round shells all errors add up.
pub(crate) const WINDING_ERROR: f64 = 0.1;

/// Nearer to one half than [`WINDING_ERROR`] the sum is taken again with this many radii, and seen to be off by 1e-3.
const SURE_FAR_RADII: f64 = 5.0;

/// By how much less than this may two sums of the same terms differ, each rounded in its own way: that in lanes and the
/// plain one.
const LANES_ERROR: f64 = 1e-6;

/// Sums over the triangles below each node of a tree.
pub(crate) struct WindingNumbers {
    /// From the triangles up: of the groups of [`FAN`] triangles, of the groups of those, and so on to the root. Each level
    /// holds as many nodes at a time as have one parent.
    levels: Vec<Vec<Fan>>,
    /// How many nodes each level has.
    sizes: Vec<usize>,
    /// Of each triangle, in the order of the tree: its sense, and zero for one that does not count.
    senses: Vec<f64>,
}

impl WindingNumbers {
    /// `senses`: 1 for each triangle of the tree wound outward, −1 inward, 0 where it is not to count.
    pub fn new(tree: &Tree, senses: Vec<f64>) -> Self {
        let triangles: Vec<Weighted> =
            tree.corners.par_iter().zip(&senses).map(|(corners, sense)| Weighted::new(corners, *sense)).collect();
        let (mut levels, mut sizes) = (vec![], vec![]);
        let mut triangles_below = FAN;
        loop {
            let of_node = |from: usize| {
                let to = triangles.len().min(from + triangles_below);
                Moments::new(&tree.corners[from..to], &triangles[from..to])
            };
            let moments: Vec<Moments> =
                (0..triangles.len()).into_par_iter().step_by(triangles_below).map(of_node).collect();
            levels.push(moments.chunks(FAN).map(Fan::new).collect());
            sizes.push(moments.len());
            if moments.len() == 1 {
                return Self { levels, sizes, senses };
            }
            triangles_below *= FAN;
        }
    }

    /// Off by less than [`WINDING_ERROR`], and by much less where that could change the side.
    pub fn at(&self, tree: &Tree, point: Vector3<f64>) -> f64 {
        let winding = self.sum(tree, point, FAR_RADII);
        let is_sure = (winding.abs() - 0.5).abs() > WINDING_ERROR;
        if is_sure { winding } else { self.sum(tree, point, SURE_FAR_RADII) }
    }

    /// On the side of one half that [`Self::at`] is on, and as exact, sooner. At a point on a triangle that side is a matter of
    /// rounding, and takes longer.
    pub fn near(&self, tree: &Tree, point: Vector3<f64>, is_on_surface: bool) -> f64 {
        let sooner = if is_on_surface { None } else { self.sure_sum(tree, point) };
        sooner.unwrap_or_else(|| self.at(tree, point))
    }

    /// `None` where the plain sum might tell another side.
    fn sure_sum(&self, tree: &Tree, point: Vector3<f64>) -> Option<f64> {
        let off_half = |winding: f64| (winding.abs() - 0.5).abs();
        let winding = self.sum_in_lanes(tree, point, FAR_RADII);
        if off_half(winding) > WINDING_ERROR + LANES_ERROR {
            return Some(winding);
        }
        let is_taken_again = off_half(winding) < WINDING_ERROR - LANES_ERROR;
        let winding = self.sum_in_lanes(tree, point, SURE_FAR_RADII);
        (is_taken_again && off_half(winding) > LANES_ERROR).then_some(winding)
    }

    /// Of each triangle, in the order of the tree.
    pub fn senses(&self) -> &[f64] {
        &self.senses
    }

    fn sum(&self, tree: &Tree, point: Vector3<f64>, far_radii: f64) -> f64 {
        let mut sum = 0.0;
        let mut stack = [(0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (level, node) = stack[waiting];
            let moments = self.levels[level][node / FAN].of(node % FAN);
            let way = moments.center - point;
            let distance_sq = way.norm_squared();
            if distance_sq > far_radii * far_radii * moments.radius_sq {
                sum += moments.seen_from(way, distance_sq);
            } else if level > 0 {
                for child in node * FAN..self.sizes[level - 1].min((node + 1) * FAN) {
                    stack[waiting] = (level - 1, child);
                    waiting += 1;
                }
            } else {
                for slot in node * FAN..tree.corners.len().min((node + 1) * FAN) {
                    let corners = tree.corners[slot].map(|corner| corner - point);
                    sum += self.senses[slot] * solid_angle(corners) / (4.0 * PI);
                }
            }
        }
        sum
    }
}

/// Of the triangle's area in length, along its normal.
pub(crate) fn area_vector([a, b, c]: [Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a)) * 0.5
}

/// The angle that a triangle fills as seen from the origin, positive from its back side. (Van Oosterom and Strackee
/// 1983, "The solid angle of a plane triangle", eq. 8.)
pub(crate) fn solid_angle([a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let lengths = [a.norm(), b.norm(), c.norm()];
    let triple = a.dot(&b.cross(&c));
    let denominator =
        lengths[0] * lengths[1] * lengths[2] + a.dot(&b) * lengths[2] + b.dot(&c) * lengths[0] + c.dot(&a) * lengths[1];
    2.0 * triple.atan2(denominator)
}
