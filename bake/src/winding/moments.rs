use std::f64::consts::PI;

use sdf_core::nalgebra::{Matrix3, Vector3};

use super::{FAN, area_vector};

/// What a triangle is as seen from afar.
pub(super) struct Weighted {
    centroid: Vector3<f64>,
    /// Area · normal, turned by the triangle's sense.
    vector: Vector3<f64>,
    area: f64,
}

pub(super) struct Moments {
    pub center: Vector3<f64>,
    /// Of the ball around all corners, squared.
    pub radius_sq: f64,
    /// Σ area · normal.
    dipole: Vector3<f64>,
    /// Σ (centroid − center) (area · normal)ᵀ.
    quadrupole: Matrix3<f64>,
}

/// The moments of nodes with one parent, side by side. After the last node there are some with a radius that is not a number.
pub(super) struct Fan {
    pub center: [[f64; FAN]; 3],
    pub radius_sq: [f64; FAN],
    pub dipole: [[f64; FAN]; 3],
    /// By columns.
    pub quadrupole: [[f64; FAN]; 9],
}

impl Weighted {
    pub fn new(corners: &[Vector3<f64>; 3], sense: f64) -> Self {
        let [a, b, c] = corners;
        let vector = area_vector(*corners) * sense;
        Self { centroid: (a + b + c) / 3.0, vector, area: vector.norm() }
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
        let quadrupole =
            triangles.iter().map(|triangle| (triangle.centroid - center) * triangle.vector.transpose()).sum();
        Self { center, radius_sq, dipole: triangles.iter().map(|triangle| triangle.vector).sum(), quadrupole }
    }

    #[inline]
    pub fn seen_from(&self, way: Vector3<f64>, distance_sq: f64) -> f64 {
        let second = self.quadrupole.trace() - 3.0 * way.dot(&(self.quadrupole * way)) / distance_sq;
        (self.dipole.dot(&way) + second) / (4.0 * PI * distance_sq * distance_sq.sqrt())
    }
}

impl Fan {
    pub fn new(nodes: &[Moments]) -> Self {
        let number = |of: &dyn Fn(&Moments) -> f64| std::array::from_fn(|node| nodes.get(node).map_or(f64::NAN, of));
        Self {
            center: std::array::from_fn(|axis| number(&|node| node.center[axis])),
            radius_sq: number(&|node| node.radius_sq),
            dipole: std::array::from_fn(|axis| number(&|node| node.dipole[axis])),
            quadrupole: std::array::from_fn(|index| number(&|node| node.quadrupole[index])),
        }
    }

    /// Of one of its nodes.
    pub fn of(&self, node: usize) -> Moments {
        Moments {
            center: Vector3::from_fn(|axis, _| self.center[axis][node]),
            radius_sq: self.radius_sq[node],
            dipole: Vector3::from_fn(|axis, _| self.dipole[axis][node]),
            quadrupole: Matrix3::from_iterator(self.quadrupole.iter().map(|of| of[node])),
        }
    }
}
