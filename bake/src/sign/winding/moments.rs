use sdf_core::nalgebra::{Matrix3, Vector3};

use crate::rounding::SUM_SLACK;
use crate::simd::{Lanes, VectorX8};
use crate::triangle::area_vector;

/// What a triangle is as seen from afar.
pub(super) struct Weighted {
    centroid: Vector3<f64>,
    /// Area · normal, turned by the triangle's sense.
    vector: Vector3<f64>,
    area: f64,
    /// ∫ |y − centroid|² over its points y.
    inertia: f64,
}

pub(super) struct Moments {
    pub center: Vector3<f64>,
    /// Of the ball around all corners.
    radius: f64,
    /// Σ area · normal.
    dipole: Vector3<f64>,
    /// Σ (centroid − center) (area · normal)ᵀ.
    quadrupole: Matrix3<f64>,
    /// ∫ |y − center|² over the points y of all triangles that count.
    inertia: f64,
}

/// The moments of nodes with one parent, side by side. After the last node there are some with a radius that is not a number.
pub(super) struct MomentsX8 {
    pub center: VectorX8<f64>,
    pub radius: Lanes<f64>,
    pub dipole: VectorX8<f64>,
    /// By columns.
    pub quadrupole: [Lanes<f64>; 9],
    pub inertia: Lanes<f64>,
}

impl Weighted {
    pub fn new(corners: &[Vector3<f64>; 3], orientation: f64) -> Self {
        let [a, b, c] = corners;
        let vector = area_vector(*corners) * orientation;
        let (centroid, area) = ((a + b + c) / 3.0, vector.norm());
        let inertia = corners.iter().map(|corner| (corner - centroid).norm_squared()).sum::<f64>() * area / 12.0;
        Self { centroid, vector, area, inertia }
    }
}

impl Moments {
    pub fn new(corners: &[[Vector3<f64>; 3]], triangles: &[Weighted]) -> Self {
        let area: f64 = triangles.iter().map(|triangle| triangle.area).sum();
        let center = if area > 0.0 {
            triangles.iter().map(|triangle| triangle.centroid * (triangle.area / area)).sum()
        } else {
            triangles[0].centroid
        };
        let radius_sq = corners.iter().flatten().map(|corner| (corner - center).norm_squared()).fold(0.0_f64, f64::max);
        // Of differences, for far off a centroid by itself is rounded as its coordinates are.
        let ways =
            || corners.iter().map(|corners| corners.iter().map(|corner| corner - center).sum::<Vector3<f64>>() / 3.0);
        let quadrupole = triangles.iter().zip(ways()).map(|(triangle, way)| way * triangle.vector.transpose()).sum();
        let inertia = triangles.iter().zip(ways()).map(|(of, way)| of.inertia + of.area * way.norm_squared());
        Self {
            center,
            radius: radius_sq.sqrt() * (1.0 + SUM_SLACK),
            dipole: triangles.iter().map(|triangle| triangle.vector).sum(),
            quadrupole,
            inertia: inertia.sum::<f64>() * (1.0 + SUM_SLACK),
        }
    }
}

impl MomentsX8 {
    pub fn new(nodes: &[Moments]) -> Self {
        let number = |of: &dyn Fn(&Moments) -> f64| std::array::from_fn(|node| nodes.get(node).map_or(f64::NAN, of));
        Self {
            center: std::array::from_fn(|axis| number(&|node| node.center[axis])),
            radius: number(&|node| node.radius),
            dipole: std::array::from_fn(|axis| number(&|node| node.dipole[axis])),
            quadrupole: std::array::from_fn(|index| number(&|node| node.quadrupole[index])),
            inertia: number(&|node| node.inertia),
        }
    }
}
