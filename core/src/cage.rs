//! A field in a deformed cage of tetrahedra (Macklin et al. 2020, §5.3; McAdams et al. 2011).
//!
//! The field φ_m stays in material space, where the cage is at rest. Each tetrahedron maps a point of the world there by its own
//! affine map, eq. (13) to (15) of the paper, with D and M the edges of the deformed tetrahedron and of that at rest:
//!
//! ```text
//! x_m = G (x − v₀) + v₀ₘ,  G = M D⁻¹,     φ_d(x) = φ_m(x_m),     ∇φ_d = Gᵀ ∇φ_m,     |∇φ_d| ≤ ‖G‖ |∇φ_m|
//! ```
//!
//! | question | file |
//! |---|---|
//! | Which tetrahedra are near a box? | `tree` |
//! | Which tetrahedron holds a point, and with which weights? Is it inverted, or too flat for an inverse? | `locate` |
//! | What is a placement that is frozen at a point, as the paper has it at a face's centroid? | `frozen` |
//! | Which part of an element lies in a tetrahedron? | `clip` |
//! | Where does an element touch, exactly, piece by piece? | `touch` |
//!
//! Distances are those of material space: a point at the distance d from the surface in the world has φ_d ≤ slope bound · d, with
//! [`Cage::slope_factor`] in the slope bound, if the straight way between is inside of the cage. Across a gap, as between the arms of a U,
//! φ_d can be more. Outside of the cage the field is not defined: answers say if an element reaches there.

mod clip;
mod frozen;
mod locate;
mod touch;
mod tree;

use nalgebra::{Matrix3, Vector3};

pub use frozen::FrozenMap;
pub use locate::{TetFrame, TetLocator, TetStatus};
pub use touch::{CageContact, CageMap, CageOutcome, CageSearch};
pub use tree::{sort_tets, tet_tree_size};

use crate::contact::TetPoint;
use crate::number::Real;
use crate::placed::affine::spectral_norm;
use crate::{Aabb, EnclosedSdf};

/// A mesh of tetrahedra at rest and deformed.
#[derive(Clone, Copy, Debug)]
pub struct Cage<'a> {
    rest: TetLocator<'a>,
    now: TetLocator<'a>,
}

impl<'a> Cage<'a> {
    /// `rest` and `now` have the same tetrahedra; `None` if not.
    pub fn new(rest: TetLocator<'a>, now: TetLocator<'a>) -> Option<Self> {
        (rest.tets() == now.tets()).then_some(Self { rest, now })
    }

    /// The tetrahedra at rest, in material space.
    pub fn rest(&self) -> &TetLocator<'a> {
        &self.rest
    }

    /// The tetrahedra as they are in the world.
    pub fn now(&self) -> &TetLocator<'a> {
        &self.now
    }

    /// Status of a tetrahedron: can it map the world to material space?
    pub fn status(&self, tet: u32) -> TetStatus {
        let [Some(rest), Some(now)] = [self.rest.frame(tet), self.now.frame(tet)] else {
            return TetStatus::IllConditioned;
        };
        match () {
            () if rest.determinant == 0.0 || now.determinant == 0.0 => TetStatus::IllConditioned,
            () if (rest.determinant < 0.0) != (now.determinant < 0.0) => TetStatus::Inverted,
            () => TetStatus::Good,
        }
    }

    /// G of a tetrahedron; `None` unless its status is good.
    pub fn jacobian(&self, tet: u32) -> Option<Matrix3<f64>> {
        if self.status(tet) != TetStatus::Good {
            return None;
        }
        let [v0, v1, v2, v3] = self.rest.corners(tet)?;
        let edges = Matrix3::from_columns(&[v1 - v0, v2 - v0, v3 - v0]);
        Some(edges * self.now.frame(tet)?.inverse)
    }

    /// Upper bound of ‖G‖ over all good tetrahedra: by how much φ_d can be steeper than φ_m. Costs some hundred operations for each.
    pub fn slope_factor(&self) -> f64 {
        let tets = 0..self.now.tets().len() as u32;
        tets.filter_map(|tet| self.jacobian(tet)).fold(0.0, |largest, jacobian| largest.max(spectral_norm(&jacobian)))
    }

    /// The point of the world where material space has `point`, and who carries it; `None` outside of the cage at rest.
    pub fn push(&self, point: Vector3<f64>) -> Option<(Vector3<f64>, TetPoint<f64>)> {
        let at = self.rest.locate(point)?;
        Some((self.now.point(&at)?, at))
    }

    /// The point of material space where the world has `point`, and who carries it; `None` outside of the cage, and in tetrahedra
    /// that are not good alone.
    pub fn pull(&self, point: Vector3<f64>) -> Option<(Vector3<f64>, TetPoint<f64>)> {
        let at = self.now.locate_where(point, |tet| self.status(tet) == TetStatus::Good)?;
        Some((self.rest.point(&at)?, at))
    }
}

/// Writes a lower bound of φ_m in each tetrahedron at rest: what a search then skips. Once for a field and a cage, as none of it
/// changes. `false` if `lower_bounds` has another length than `rest` has tetrahedra.
pub fn bound_tets<F: EnclosedSdf>(field: &F, rest: &TetLocator, lower_bounds: &mut [f64]) -> bool {
    for (bound, tet) in lower_bounds.iter_mut().zip(0..) {
        let corners = rest.corners(tet);
        *bound = corners.map_or(f64::NEG_INFINITY, |corners| touch::lower_bound(field, &corners));
    }
    lower_bounds.len() == rest.tets().len()
}

/// Positions of corners; `None` where one is not finite, or not there.
fn tet_corners(points: &[[f64; 3]], corners: &[u32; 4]) -> Option<[Vector3<f64>; 4]> {
    let mut found = [Vector3::zeros(); 4];
    for (corner, index) in found.iter_mut().zip(corners) {
        *corner = Vector3::from(*points.get(*index as usize)?);
    }
    let is_representable = found.iter().flatten().all(|x| x.is_representable());
    is_representable.then_some(found)
}

/// The box around a tetrahedron's corners.
fn tet_bounds(corners: &[Vector3<f64>; 4]) -> Aabb {
    Aabb::from_corners(corners)
}
