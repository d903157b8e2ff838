//! Which point of a mesh is nearest to a point, to a triangle, and on which side? A mesh that owns its tree, for queries at any place.
//!
//! [`MeshDistance`](crate::MeshDistance) decides how the sign is found and bakes; this answers with the same signs later, without the
//! costly part of that decision.
//!
//! | question | file |
//! |---|---|
//! | Nearest point, signed distance, normal | this file |
//! | Nearest point to a vertex, an edge or a triangle | `closest`, with the pairs of `element` |
//! | How near are a corner, edge or face of an element and a triangle? | `element` |
//! | Deepest point of an edge or a triangle | `deepest`, with the bounds of `game` and the lists of `nearby` |
//! | In which order is a mesh kept? | `packed` |

mod closest;
mod deepest;
mod element;
mod game;
mod nearby;
mod packed;

pub use closest::ClosestPoints;
pub use deepest::{Deepest, DepthLimits, Probe};
pub(crate) use element::nearest_pair;

use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use crate::bvh::Bvh;
use crate::mesh::topology::orient;
use crate::mesh_distance::moved_within;
use crate::rounding::{MIN_OFFSET, PAIR_ROUNDING, PARTING_SLACK, max_coordinate};
use crate::sign::flood_fill::CLEARANCE;
use crate::sign::pseudo_normals::PseudoNormals;
use crate::sign::winding::WindingNumbers;
use crate::triangle::{NearestOnTriangle, TriangleFeature, area_vector, nearest_on_triangle, thinness_error};
use crate::{SignMethod, TriangleMesh};

/// A mesh that answers with exact signed distances.
pub struct MeshSurface {
    mesh: TriangleMesh,
    tree: Bvh,
    /// Tree of the mesh whose winding numbers give the signs, where `mesh` is only the surface of its solid.
    solid: Option<Bvh>,
    /// Orientation of each triangle, in the tree's order.
    orientations: Vec<f64>,
    pseudo_normals: Option<PseudoNormals>,
    winding: Option<WindingNumbers>,
    is_continuous: bool,
    /// Bound of the error of a distance to a point at the origin, by the largest coordinate and the thinnest triangle.
    rounding: f64,
}

/// The point of a mesh nearest to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePoint {
    /// The query point.
    pub query: Vector3<f64>,
    /// The nearest point of the mesh.
    pub point: Vector3<f64>,
    /// The distance between both, negative inside: see [`MeshSurface::error_bound`].
    pub distance: f64,
    /// The triangle that holds the nearest point, in the tree's order.
    pub slot: usize,
    feature: TriangleFeature,
}

impl SurfacePoint {
    /// Without a sign.
    fn new(query: Vector3<f64>, slot: usize, nearest: NearestOnTriangle) -> Self {
        let NearestOnTriangle { point, distance_sq, feature } = nearest;
        Self { query, point, distance: distance_sq.sqrt(), slot, feature }
    }
}

impl MeshSurface {
    /// A mesh whose sign method is known. `is_continuous`: see [`MeshDistance::is_continuous`](crate::MeshDistance::is_continuous).
    pub fn new(mesh: TriangleMesh, sign: SignMethod, is_continuous: bool) -> Self {
        let tree = Bvh::for_points(&mesh);
        let solid = mesh.solid.as_deref().map(Bvh::for_points);
        let (mesh_of_signs, tree_of_signs) = (mesh.mesh_of_signs(), solid.as_ref().unwrap_or(&tree));
        let oriented = orient(mesh_of_signs);
        let orientations: Vec<f64> =
            tree_of_signs.triangles.iter().map(|triangle| oriented.orientations[*triangle as usize]).collect();
        let has_normals = sign == SignMethod::PseudoNormal && solid.is_none();
        let pseudo_normals = has_normals.then(|| PseudoNormals::new(&mesh, &oriented));
        let is_complete = pseudo_normals.as_ref().is_some_and(PseudoNormals::are_known);
        let windings = || WindingNumbers::of_mesh(mesh_of_signs, &oriented, orientations.clone());
        let winding = (!is_complete).then(windings);
        // The surface of a solid is wound outward.
        let orientations = if solid.is_some() { vec![1.0; tree.triangles.len()] } else { orientations };
        let thinnest = tree.corners.iter().map(|corners| thinness_error(*corners)).fold(0.0, f64::max);
        let rounding = PAIR_ROUNDING * max_coordinate(&mesh.bounds()) + thinnest + mesh.rounding;
        Self { mesh, tree, solid, orientations, pseudo_normals, winding, is_continuous, rounding }
    }

    /// Does the sign change at triangles alone? Then the signed distance has slope 1 everywhere.
    pub fn is_continuous(&self) -> bool {
        self.is_continuous
    }

    /// Box around the mesh.
    pub fn bounds(&self) -> Aabb {
        self.mesh.bounds()
    }

    /// Bound of the error of a distance that was found between an element of one to three corners and the mesh. Near rounding, but
    /// where a face of either is so thin that it is measured by its edges alone, or that its normal has lost digits.
    pub fn error_bound(&self, element: &[Vector3<f64>], distance: f64) -> f64 {
        let largest = element.iter().map(|corner| corner.amax()).fold(0.0, f64::max);
        let thinness = if let [a, b, c] = *element { thinness_error([a, b, c]) } else { 0.0 };
        self.rounding + PAIR_ROUNDING * largest + thinness + PARTING_SLACK * distance.abs()
    }

    /// Signed distance and nearest point. `guess` is any slot: a near one saves time. A point whose answer is known, `neighbour`, can
    /// save the search for the sign. Neither changes the answer.
    pub fn nearest(&self, query: Vector3<f64>, guess: usize, neighbour: Option<&SurfacePoint>) -> SurfacePoint {
        let slot = self.tree.nearest(query, guess.min(self.tree.corners.len() - 1)).slot;
        self.nearest_on(query, slot, neighbour)
    }

    /// [`nearest`](Self::nearest), where the nearest triangle is known.
    fn nearest_on(&self, query: Vector3<f64>, slot: usize, neighbour: Option<&SurfacePoint>) -> SurfacePoint {
        let found = SurfacePoint::new(query, slot, nearest_on_triangle(query, self.tree.corners[slot]));
        let is_inside = self.is_inside(&found, neighbour);
        SurfacePoint { distance: if is_inside { -found.distance } else { found.distance }, ..found }
    }

    /// Distance to one triangle, which is convex as a function of the point.
    ///
    /// # Panics
    ///
    /// If there is no such slot: ask for one that a [`SurfacePoint`] has.
    pub fn distance_to_triangle(&self, query: Vector3<f64>, slot: usize) -> f64 {
        nearest_on_triangle(query, self.tree.corners[slot]).distance_sq.sqrt()
    }

    /// Unit vector from the surface to its outside at a nearest point: along the way to the query, or where that is too short the
    /// normal of the face, edge or corner that holds the point. Zero only at slivers.
    pub fn normal(&self, at: &SurfacePoint) -> Vector3<f64> {
        let shortest = MIN_OFFSET * self.bounds().diagonal().max(at.query.amax());
        let outward = (at.query - at.point) * at.distance.signum();
        if let Some(outward) = outward.try_normalize(0.0).filter(|_| at.distance.abs() > shortest) {
            return outward;
        }
        let feature = self
            .pseudo_normals
            .as_ref()
            .map_or(Vector3::zeros(), |normals| normals.feature(&self.mesh, self.tree.triangles[at.slot], at.feature));
        let face = area_vector(self.tree.corners[at.slot]) * self.orientations[at.slot];
        feature.try_normalize(0.0).or_else(|| face.try_normalize(0.0)).unwrap_or_default()
    }

    /// Outward unit normal of a triangle of a surface of one solid; zero where it is unknown.
    fn outward(&self, slot: usize) -> Vector3<f64> {
        let normal = |normals: &PseudoNormals| normals.face(self.tree.triangles[slot]);
        self.pseudo_normals.as_ref().filter(|_| self.is_continuous).map_or(Vector3::zeros(), normal)
    }

    fn is_inside(&self, found: &SurfacePoint, neighbour: Option<&SurfacePoint>) -> bool {
        if let Some(normals) = &self.pseudo_normals {
            // Far away the side of a face is below rounding.
            let query = found.query.into();
            if !self.bounds().encloses(&Aabb { min: query, max: query }) {
                return false;
            }
            let normal = normals.feature(&self.mesh, self.tree.triangles[found.slot], found.feature);
            if normal != Vector3::zeros() {
                return normal.dot(&(found.query - found.point)) < 0.0;
            }
        }
        // D(p) + D(q) > |p − q|: the surface does not cross the segment.
        let is_clear = |other: &&SurfacePoint| {
            let between = (found.query - other.query).norm() * CLEARANCE;
            self.is_continuous && found.distance + other.distance.abs() > between
        };
        if let Some(other) = neighbour.filter(is_clear) {
            return other.distance < 0.0;
        }
        let number = |winding: &WindingNumbers| match &self.solid {
            // Off faces that were dropped, in whose planes it is the mean of what it is on either side.
            Some(solid) => winding.evaluate(solid, moved_within(found.query, found.distance), f64::INFINITY).value,
            None => winding.evaluate(&self.tree, found.query, f64::INFINITY).value,
        };
        self.winding.as_ref().map_or(0.0, number).abs() >= 0.5
    }
}
