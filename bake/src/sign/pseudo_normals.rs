//! Angle-weighted pseudo-normals (Bærentzen and Aanæs 2005, "Signed distance computation using the angle weighted
//! pseudonormal").
//!
//! Let q be the point of a closed surface nearest to x, on a face, an edge or a corner. With α_f the angle of face f at
//! that feature (π for both faces of an edge), n = Σ α_f n_f satisfies: x is inside if and only if n·(x − q) < 0.

use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::mesh::topology::{OrientedMesh, same_edge};
use crate::triangle::{TriangleFeature, area_vector, is_sliver};

/// Outward normals of all features of a mesh. Those of edges and corners have any length.
///
/// A normal is zero if it is unknown: a triangle of the feature is a sliver or does not count.
pub(crate) struct PseudoNormals {
    faces: Vec<Vector3<f64>>,
    /// For each triangle, edge i runs from corner i to the next.
    edges: Vec<[Vector3<f64>; 3]>,
    points: Vec<Vector3<f64>>,
}

impl PseudoNormals {
    pub fn new(mesh: &TriangleMesh, oriented: &OrientedMesh) -> Self {
        let unit_normal = |triangle: usize| {
            let corners = mesh.corner_points(mesh.triangles[triangle]);
            let normal = area_vector(corners).try_normalize(0.0).filter(|_| !is_sliver(corners));
            normal.unwrap_or_default() * oriented.orientations[triangle]
        };
        let faces: Vec<Vector3<f64>> = sdf_parallel::map(mesh.triangles.len(), unit_normal);

        let mut edges = vec![[Vector3::zeros(); 3]; faces.len()];
        for edge in oriented.half_edges.chunk_by(same_edge) {
            // A collinear triangle has no normal.
            let normals = || edge.iter().map(|half| faces.get(half.triangle as usize).copied().unwrap_or_default());
            let is_known = normals().all(|normal| normal != Vector3::zeros());
            let sum = if is_known { normals().sum() } else { Vector3::zeros() };
            for half in edge {
                if let Some(edges) = edges.get_mut(half.triangle as usize) {
                    edges[usize::from(half.corner)] = sum;
                }
            }
        }

        let angles = |triangle: usize| {
            let positions = mesh.corner_points(mesh.triangles[triangle]);
            [0, 1, 2].map(|corner| {
                let [here, next, last] = [0, 1, 2].map(|step| positions[(corner + step) % 3]);
                (next - here).angle(&(last - here))
            })
        };
        let angles: Vec<[f64; 3]> = sdf_parallel::map(mesh.triangles.len(), angles);
        let mut points = vec![Vector3::zeros(); mesh.points.len()];
        for (corners, (normal, angles)) in mesh.triangles.iter().zip(faces.iter().zip(&angles)) {
            corners.iter().zip(angles).for_each(|(point, angle)| points[*point as usize] += normal * *angle);
        }
        let is_triangle_sliver = |triangle: usize| is_sliver(mesh.corner_points(mesh.triangles[triangle]));
        let slivers = sdf_parallel::filter(mesh.triangles.len(), is_triangle_sliver);
        let slivers = slivers.into_iter().map(|triangle| &mesh.triangles[triangle]);
        let stitches = mesh.stitches.iter().zip(&oriented.orientations[mesh.triangles.len()..]);
        let counted = stitches.filter(|(_, orientation)| **orientation != 0.0).map(|(corners, _)| corners);
        slivers.chain(counted).flatten().for_each(|point| points[*point as usize] = Vector3::zeros());
        Self { faces, edges, points }
    }

    /// Has every feature a normal?
    pub fn are_known(&self) -> bool {
        let mut normals = self.faces.iter().chain(self.edges.as_flattened()).chain(&self.points);
        normals.all(|normal| *normal != Vector3::zeros())
    }

    /// Unit normal of a face, or zero.
    pub fn face(&self, triangle: u32) -> Vector3<f64> {
        self.faces[triangle as usize]
    }

    /// Pseudo-normal of a feature of a triangle, or zero.
    pub fn feature(&self, mesh: &TriangleMesh, triangle: u32, feature: TriangleFeature) -> Vector3<f64> {
        let triangle = triangle as usize;
        match feature {
            TriangleFeature::Inside => self.faces[triangle],
            TriangleFeature::Edge(edge) => self.edges[triangle][edge],
            TriangleFeature::Corner(corner) => self.points[mesh.triangles[triangle][corner] as usize],
        }
    }
}
