//! One tetrahedron's affine map as a placement of the whole world (Macklin et al. 2020, §5.3): what a search with [`CageMap::Frozen`]
//! takes, and what any minimizer can be run on.
//!
//! [`CageMap::Frozen`]: super::CageMap::Frozen

use nalgebra::{Matrix3, Vector3};

use super::{Cage, TetStatus};
use crate::Aabb;
use crate::number::Real;
use crate::placed::affine::spectral_norm;
use crate::placed::{LocalPoint, Placement};
use crate::vector::{from_f64, largest_component, times};

/// The map of one tetrahedron of a cage, taken for all of the world: what §5.3 of the paper searches a face with, frozen at its
/// centroid. The placed field is φ_d(x) = φ_m(G (x − v₀) + v₀ₘ), not scaled, with ‖G‖ in its slope bound.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrozenMap {
    /// The tetrahedron.
    tet: u32,
    jacobian: Matrix3<f64>,
    /// G⁻¹.
    inverse: Matrix3<f64>,
    world_origin: [f64; 3],
    material_origin: [f64; 3],
    slope_factor: f64,
}

impl FrozenMap {
    /// The tetrahedron whose map it is.
    pub fn tet(&self) -> u32 {
        self.tet
    }
}

impl Cage<'_> {
    /// The map of the tetrahedron that holds a point; `None` outside of the cage.
    pub fn frozen_at(&self, point: Vector3<f64>) -> Option<FrozenMap> {
        let tet = self.now().locate_where(point, |tet| self.status(tet) == TetStatus::Good)?.tet;
        let jacobian = self.jacobian(tet)?;
        let ([world, ..], [material, ..]) = (self.now().corners(tet)?, self.rest().corners(tet)?);
        let inverse = crate::placed::affine::inverse(&jacobian)?;
        let slope_factor = spectral_norm(&jacobian);
        Some(FrozenMap {
            tet,
            jacobian,
            inverse,
            world_origin: world.into(),
            material_origin: material.into(),
            slope_factor,
        })
    }
}

/// The box around the image of a box by x ↦ `to` + `linear` · (x − `from`) (Arvo 1990).
fn map_bounds(bounds: Aabb, linear: &Matrix3<f64>, from: [f64; 3], to: [f64; 3]) -> Aabb {
    let [min, max] = [bounds.min, bounds.max].map(Vector3::from);
    let centre = Vector3::from(to) + linear * ((min + max) * 0.5 - Vector3::from(from));
    let half = linear.abs() * ((max - min) * 0.5);
    let mapped = Aabb { min: (centre - half).into(), max: (centre + half).into() };
    let is_bounded = mapped.min.iter().chain(&mapped.max).all(|x| x.is_finite());
    if is_bounded { mapped } else { Aabb::EVERYWHERE }
}

impl Placement for FrozenMap {
    #[inline]
    fn pull<R: Real>(&self, world_point: Vector3<R>) -> LocalPoint<R> {
        let jacobian = self.jacobian.map(R::from_f64);
        let local = times(&jacobian, world_point - from_f64(self.world_origin));
        LocalPoint { point: local + from_f64(self.material_origin), jacobian, scale: R::one() }
    }

    fn push_bounds(&self, local: Aabb) -> Aabb {
        map_bounds(local, &self.inverse, self.material_origin, self.world_origin)
    }

    fn pull_bounds(&self, world: Aabb) -> Aabb {
        map_bounds(world, &self.jacobian, self.world_origin, self.material_origin)
    }

    fn slope_factor(&self) -> f64 {
        self.slope_factor
    }

    fn scale(&self) -> f64 {
        1.0
    }

    /// 1: the field and its errors are in lengths of the body at rest.
    fn largest_scale(&self) -> f64 {
        1.0
    }

    /// v₀, and v₀ₘ as a length of the world: ‖G‖ is the slope factor.
    #[inline]
    fn magnitude<R: Real>(&self) -> R {
        let material = largest_component::<R>(from_f64(self.material_origin)) * R::from_f64(1.0 / self.slope_factor);
        largest_component::<R>(from_f64(self.world_origin)) + material
    }
}
