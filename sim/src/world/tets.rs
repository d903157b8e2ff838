//! Neo-Hookean tetrahedra as two constraints (Macklin and Müller 2021): hydrostatic C_H = det F − 1 − μ/λ with compliance
//! 1/(λV), deviatoric C_D = |F| with compliance 1/(μV). Their energies add up to μ/2 (|F|² − 3) + λ/2 (det F − 1 − μ/λ)².

use sdf_core::nalgebra::Matrix3;

use super::World;
use crate::V3;

/// A tetrahedron of elastic matter.
#[derive(Clone, Debug, PartialEq)]
pub struct Tet {
    /// The particles.
    pub corners: [u32; 4],
    /// Inverse of the rest edges from the first corner, as columns.
    pub inv_rest: Matrix3<f64>,
    /// Volume at rest.
    pub volume: f64,
    /// First Lamé parameter, a pressure.
    pub lambda: f64,
    /// Shear modulus, a pressure.
    pub mu: f64,
}

impl Tet {
    /// Edges over rest edges: the identity at rest.
    pub fn deformation(&self, x: &[V3]) -> Matrix3<f64> {
        let [o, a, b, c] = self.corners.map(|corner| x[corner as usize]);
        Matrix3::from_columns(&[a - o, b - o, c - o]) * self.inv_rest
    }
}

impl World {
    /// Both constraints of a tetrahedron; `reversed` takes the hydrostatic one first.
    pub(super) fn deform(&mut self, index: usize, inv_dt_sq: f64, reversed: bool) {
        for kind in if reversed { [1, 0] } else { [0, 1] } {
            let tet = &self.tets[index];
            let f = tet.deformation(&self.x);
            let (value, derivative, stiffness) = if kind == 1 {
                let [a, b, c] = [0, 1, 2].map(|column| f.column(column).into_owned());
                let cofactors = Matrix3::from_columns(&[b.cross(&c), c.cross(&a), a.cross(&b)]);
                (f.determinant() - 1.0 - tet.mu / tet.lambda, cofactors, tet.lambda * tet.volume)
            } else {
                let norm = f.norm();
                (norm, f / norm.max(f64::MIN_POSITIVE), tet.mu * tet.volume)
            };
            let of_edges = derivative * tet.inv_rest.transpose();
            let [a, b, c] = [0, 1, 2].map(|column| of_edges.column(column).into_owned());
            let gradients = [-(a + b + c), a, b, c];
            let corners = tet.corners.map(|corner| corner as usize);
            let masses = gradients.iter().zip(corners);
            let weight: f64 = masses.map(|(gradient, corner)| self.inv_mass[corner] * gradient.norm_squared()).sum();
            let softness = inv_dt_sq / stiffness;
            if weight <= 0.0 {
                continue;
            }
            let multiplier = &mut self.tet_multipliers[index][kind];
            let step = (-value - softness * *multiplier) / (weight + softness);
            *multiplier += step;
            for (gradient, corner) in gradients.iter().zip(corners) {
                self.x[corner] += gradient * (step * self.inv_mass[corner]);
            }
        }
    }

    /// Energy of the tetrahedra, zero at rest.
    pub(super) fn elastic_energy(&self) -> f64 {
        let of_tet = |tet: &Tet| {
            let f = tet.deformation(&self.x);
            let ratio = tet.mu / tet.lambda;
            let hydrostatic = f.determinant() - 1.0 - ratio;
            let shear = 0.5 * tet.mu * (f.norm_squared() - 3.0);
            tet.volume * (shear + 0.5 * tet.lambda * (hydrostatic * hydrostatic - ratio * ratio))
        };
        self.tets.iter().map(of_tet).sum()
    }

    /// The smallest det F of all tetrahedra, negative for an inverted one; 1 where there is none.
    pub fn min_volume_ratio(&self) -> f64 {
        self.tets.iter().map(|tet| tet.deformation(&self.x).determinant()).fold(1.0, f64::min)
    }
}
