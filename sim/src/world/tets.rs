//! Corotated tetrahedra (Stomakhin et al. 2012, "Energetically Consistent Invertible Elasticity") as two constraints: C_D = |F − R| with
//! compliance 1/(2μV), where R is the rotation nearest to F, and C_H = det F − 1 with compliance 1/(λV). Their energies are μ |F − R|²
//! and λ/2 (det F − 1)² for each unit of volume, for small strains those of Hooke's law.
//!
//! Both are zero at rest. Those of Macklin and Müller (2021), |F| and det F − 1 − μ/λ, are not: at rest each holds against the other. One
//! after the other they shrink a stiff tetrahedron, and together they leave shear to the positions before the step, which explodes where
//! a shear wave crosses a tetrahedron in a step.

use sdf_core::nalgebra::{Matrix3, Quaternion, UnitQuaternion};

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

    /// The rotation nearest to the deformation, whatever it is.
    pub(super) fn rotation(&self, x: &[V3]) -> UnitQuaternion<f64> {
        let f = self.deformation(x);
        // For larger ones it would be sought for ever.
        if f.norm_squared() < 1e100 {
            UnitQuaternion::from_matrix_eps(&f, 1e-9, 100, UnitQuaternion::identity())
        } else {
            UnitQuaternion::identity()
        }
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
                (f.determinant() - 1.0, cofactors, tet.lambda * tet.volume)
            } else {
                let rotation = &mut self.tet_rotations[index];
                *rotation = nearest_rotation(&f, rotation);
                let strain = f - rotation.to_rotation_matrix().matrix();
                let norm = strain.norm();
                (norm, strain / norm.max(f64::MIN_POSITIVE), 2.0 * tet.mu * tet.volume)
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
        let of_tet = |(index, tet): (usize, &Tet)| {
            let f = tet.deformation(&self.x);
            // Before the first step there is none to begin with.
            let known = self.tet_rotations.get(index);
            let rotation = known.map_or_else(|| tet.rotation(&self.x), |known| nearest_rotation(&f, known));
            let (strain, growth) = (f - rotation.to_rotation_matrix().matrix(), f.determinant() - 1.0);
            tet.volume * (tet.mu * strain.norm_squared() + 0.5 * tet.lambda * growth * growth)
        };
        self.tets.iter().enumerate().map(of_tet).sum()
    }

    /// The smallest det F of all tetrahedra, negative for an inverted one; 1 where there is none.
    pub fn min_volume_ratio(&self) -> f64 {
        self.tets.iter().map(|tet| tet.deformation(&self.x).determinant()).fold(1.0, f64::min)
    }
}

/// The rotation R nearest to F, also to an inverted one, from that of the visit before, which is mostly a small turn away: Newton steps on
/// |F − R|² (as Kugelstadt et al. 2018, "Fast Corotated FEM using Operator Splitting"), of which one is enough but for a rest that is cubic
/// in the turn.
fn nearest_rotation(f: &Matrix3<f64>, before: &UnitQuaternion<f64>) -> UnitQuaternion<f64> {
    let mut rotation = *before;
    for _ in 0..3 {
        let stretch = rotation.to_rotation_matrix().matrix().tr_mul(f);
        let skew = stretch - stretch.transpose();
        let torque = V3::new(skew[(2, 1)], skew[(0, 2)], skew[(1, 0)]);
        let symmetric = (stretch + stretch.transpose()) * 0.5;
        let hessian = Matrix3::identity() * symmetric.trace() - symmetric;
        let turn = match hessian.cholesky() {
            Some(hessian) => hessian.solve(&torque),
            // Of an inverted F: along the gradient (Müller et al. 2016, "A Robust Method to Extract the Rotational Part of Deformations").
            None => torque / (symmetric.trace().abs() + f64::EPSILON),
        };
        let squared = turn.norm_squared();
        // NaN of a F that is not finite.
        if squared.is_nan() || squared > 1e12 {
            break;
        }
        rotation *= UnitQuaternion::new_normalize(Quaternion::from_parts(1.0, turn * 0.5));
        if squared < 1e-6 {
            break;
        }
    }
    UnitQuaternion::new_normalize(rotation.into_inner())
}
