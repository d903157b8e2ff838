//! The generalized winding number of a triangle soup (Jacobson et al. 2013), summed over a tree whose far nodes count
//! as one dipole and its first correction (Barill et al. 2018, "Fast winding numbers for soups and clouds", §4, orders
//! 1 and 2).

use std::f64::consts::PI;

use sdf_core::nalgebra::{Matrix3, Vector3};

use crate::tree::{FAN, STACK, Tree};

/// A node is far when it is farther than this many of its radii, the paper's own choice. More costs time, less precision.
const FAR_RADII: f64 = 2.0;

/// How far a sum with [`FAR_RADII`] may be off. The largest error seen is 0.042: within round shells all errors add up.
pub(crate) const WINDING_ERROR: f64 = 0.1;

/// Nearer to one half than [`WINDING_ERROR`] the sum is taken again with this many radii, and seen to be off by 1e-3.
const SURE_FAR_RADII: f64 = 5.0;

/// Sums over the triangles below each node of a tree.
pub(crate) struct WindingNumbers {
    /// In the order of the tree's levels.
    levels: Vec<Vec<Moments>>,
    /// Of each triangle, in the order of the tree: its sense, and zero for one that does not count.
    senses: Vec<f64>,
}

#[derive(Clone)]
struct Moments {
    center: Vector3<f64>,
    /// Of the ball around all corners, squared.
    radius_sq: f64,
    /// Σ area · normal.
    dipole: Vector3<f64>,
    /// Σ (centroid − center) (area · normal)ᵀ.
    quadrupole: Matrix3<f64>,
}

impl WindingNumbers {
    /// `senses`: 1 for each triangle of the tree wound outward, −1 inward, 0 where it is not to count.
    pub fn new(tree: &Tree, senses: Vec<f64>) -> Self {
        let mut levels: Vec<Vec<Moments>> = Vec::new();
        let mut triangles_below = FAN;
        for nodes in tree.level_sizes() {
            let moments = (0..nodes).map(|node| {
                let from = node * triangles_below;
                let to = tree.corners.len().min(from + triangles_below);
                moments(&tree.corners[from..to], &senses[from..to])
            });
            levels.push(moments.collect());
            triangles_below *= FAN;
        }
        Self { levels, senses }
    }

    /// Off by less than [`WINDING_ERROR`], and by much less where that could change the side.
    pub fn at(&self, tree: &Tree, point: Vector3<f64>) -> f64 {
        let winding = self.sum(tree, point, FAR_RADII);
        let is_sure = (winding.abs() - 0.5).abs() > WINDING_ERROR;
        if is_sure { winding } else { self.sum(tree, point, SURE_FAR_RADII) }
    }

    fn sum(&self, tree: &Tree, point: Vector3<f64>, far_radii: f64) -> f64 {
        let mut sum = 0.0;
        let mut stack = [(0, 0); STACK];
        let mut waiting = 1;
        stack[0] = (self.levels.len() - 1, 0);
        while waiting > 0 {
            waiting -= 1;
            let (level, node) = stack[waiting];
            let moments = &self.levels[level][node];
            let way = moments.center - point;
            let distance_sq = way.norm_squared();
            if distance_sq > far_radii * far_radii * moments.radius_sq {
                sum += moments.seen_from(way, distance_sq);
            } else if level > 0 {
                for child in node * FAN..self.levels[level - 1].len().min((node + 1) * FAN) {
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

/// The curve that bounds a mesh: where its triangles, turned to agree, do not cancel along an edge. By Stokes' theorem
/// the winding number varies away from the triangles as this curve alone says, by the law of Biot and Savart.
pub(crate) struct Rim {
    edges: Vec<RimEdge>,
}

struct RimEdge {
    middle: Vector3<f64>,
    half_length: f64,
    /// Length times how many triangles more run along it one way than the other.
    weight: f64,
}

/// With more edges than this the bound would cost more than the winding numbers that it saves.
const MOST_RIM_EDGES: usize = 20_000;

impl Rim {
    /// Edges as their two ends and their multiplicity.
    pub fn new(edges: impl Iterator<Item = ([Vector3<f64>; 2], f64)>) -> Self {
        let edges = edges.map(|([from, to], times)| {
            let length = (to - from).norm();
            RimEdge { middle: (from + to) * 0.5, half_length: 0.5 * length, weight: length * times.abs() }
        });
        Self { edges: edges.collect() }
    }

    /// The most that the winding number changes over a unit of distance in a ball, other than across triangles.
    pub fn winding_slope(&self, center: Vector3<f64>, radius: f64) -> f64 {
        if self.edges.len() > MOST_RIM_EDGES {
            return f64::INFINITY;
        }
        let slope_of = |edge: &RimEdge| {
            let distance = (edge.middle - center).norm() - edge.half_length - radius;
            if distance > 0.0 { edge.weight / (4.0 * PI * distance * distance) } else { f64::INFINITY }
        };
        self.edges.iter().map(slope_of).sum()
    }
}

impl Moments {
    #[inline]
    fn seen_from(&self, way: Vector3<f64>, distance_sq: f64) -> f64 {
        let second = self.quadrupole.trace() - 3.0 * way.dot(&(self.quadrupole * way)) / distance_sq;
        (self.dipole.dot(&way) + second) / (4.0 * PI * distance_sq * distance_sq.sqrt())
    }
}

fn moments(triangles: &[[Vector3<f64>; 3]], senses: &[f64]) -> Moments {
    let centroid = |[a, b, c]: &[Vector3<f64>; 3]| (a + b + c) / 3.0;
    let weighted = || triangles.iter().zip(senses).map(|(corners, sense)| (corners, area_vector(*corners) * *sense));
    let area: f64 = weighted().map(|(_, vector)| vector.norm()).sum();
    let center = if area > 0.0 {
        weighted().map(|(corners, vector)| centroid(corners) * (vector.norm() / area)).sum()
    } else {
        centroid(&triangles[0])
    };
    let radius_sq = triangles.iter().flatten().map(|corner| (corner - center).norm_squared()).fold(0.0_f64, f64::max);
    Moments {
        center,
        radius_sq,
        dipole: weighted().map(|(_, vector)| vector).sum(),
        quadrupole: weighted().map(|(corners, vector)| (centroid(corners) - center) * vector.transpose()).sum(),
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
