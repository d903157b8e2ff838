//! Moments of groups of triangles: the coefficients of a far-field expansion of the winding number.
//!
//! A triangle t has a centroid c_t, an area A_t and a unit normal n_t. A group with center c has the dipole Σ A_t n_t,
//! the quadrupole Q = Σ (c_t − c)(A_t n_t)ᵀ (Barill et al. 2018, §4.1, orders 1 and 2) and, to bound what these
//! neglect, the inertia ∫ |y − c|² over all its points y. [`super::sum`] evaluates them.

use sdf_core::nalgebra::{Matrix3, Vector3};

use crate::rounding::SUM_SLACK;
use crate::simd::{Lanes, VectorX8};
use crate::triangle::area_vector;

/// Moments of one triangle about its centroid.
pub(super) struct WeightedTriangle {
    centroid: Vector3<f64>,
    /// Area times unit normal times orientation.
    area_vector: Vector3<f64>,
    area: f64,
    /// ∫ |y − centroid|² over its points y: area/12 · Σ |corner − centroid|².
    inertia: f64,
}

/// Moments of a group of triangles about its center.
pub(super) struct Moments {
    center: Vector3<f64>,
    /// Radius of the ball around all corners.
    radius: f64,
    dipole: Vector3<f64>,
    quadrupole: Matrix3<f64>,
    inertia: f64,
}

/// Moments of all nodes with one parent, side by side. Lanes after the last node have a NaN radius.
pub(super) struct MomentsX8 {
    pub center: VectorX8<f64>,
    pub radius: Lanes<f64>,
    pub dipole: VectorX8<f64>,
    /// Column by column.
    pub quadrupole: [Lanes<f64>; 9],
    pub inertia: Lanes<f64>,
}

impl WeightedTriangle {
    pub fn new(corners: &[Vector3<f64>; 3], orientation: f64) -> Self {
        let [a, b, c] = corners;
        let area_vector = area_vector(*corners) * orientation;
        let (centroid, area) = ((a + b + c) / 3.0, area_vector.norm());
        let inertia = corners.iter().map(|corner| (corner - centroid).norm_squared()).sum::<f64>() * area / 12.0;
        Self { centroid, area_vector, area, inertia }
    }
}

impl Moments {
    pub fn new(corners: &[[Vector3<f64>; 3]], triangles: &[WeightedTriangle]) -> Self {
        let area: f64 = triangles.iter().map(|triangle| triangle.area).sum();
        let center = if area > 0.0 {
            triangles.iter().map(|triangle| triangle.centroid * (triangle.area / area)).sum()
        } else {
            triangles[0].centroid
        };
        let radius_sq = corners.iter().flatten().map(|corner| (corner - center).norm_squared()).fold(0.0_f64, f64::max);
        // Mean of differences: far from the origin a centroid by itself is rounded as its coordinates are.
        let offsets =
            || corners.iter().map(|corners| corners.iter().map(|corner| corner - center).sum::<Vector3<f64>>() / 3.0);
        let quadrupole =
            triangles.iter().zip(offsets()).map(|(triangle, offset)| offset * triangle.area_vector.transpose()).sum();
        // Parallel axis theorem.
        let inertia = triangles
            .iter()
            .zip(offsets())
            .map(|(triangle, offset)| triangle.inertia + triangle.area * offset.norm_squared());
        Self {
            center,
            radius: radius_sq.sqrt() * (1.0 + SUM_SLACK),
            dipole: triangles.iter().map(|triangle| triangle.area_vector).sum(),
            quadrupole,
            inertia: inertia.sum::<f64>() * (1.0 + SUM_SLACK),
        }
    }
}

impl MomentsX8 {
    pub fn new(nodes: &[Moments]) -> Self {
        let lanes =
            |number: &dyn Fn(&Moments) -> f64| std::array::from_fn(|node| nodes.get(node).map_or(f64::NAN, number));
        Self {
            center: std::array::from_fn(|axis| lanes(&|node| node.center[axis])),
            radius: lanes(&|node| node.radius),
            dipole: std::array::from_fn(|axis| lanes(&|node| node.dipole[axis])),
            quadrupole: std::array::from_fn(|index| lanes(&|node| node.quadrupole[index])),
            inertia: lanes(&|node| node.inertia),
        }
    }
}
