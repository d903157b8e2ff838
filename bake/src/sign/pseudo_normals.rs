//! Angle-weighted pseudo-normals (Bærentzen and Aanæs 2005, "Signed distance computation using the angle weighted
//! pseudonormal").
//!
//! Let q be the point of a closed surface nearest to x, on a face, an edge or a corner. With α_f the angle of face f at
//! that feature (π for both faces of an edge), n = Σ α_f n_f satisfies: x is inside if and only if n·(x − q) < 0.

use sdf_core::Aabb;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::mesh::topology::{HalfEdge, OrientedMesh, same_edge};
use crate::rounding::{FOLD_NORMAL_SQ, is_far_from_origin};
use crate::triangle::{TriangleFeature, area_vector, is_sliver};

/// Outward normals of all features of a mesh. Those of edges and corners have any length.
///
/// A normal is zero if it is unknown: a triangle of the feature is a sliver or does not count.
pub(crate) struct PseudoNormals {
    faces: Vec<Vector3<f64>>,
    /// For each triangle, whose edge i runs from corner i to the next: the other triangle of an edge of two, or else the number of
    /// triangles and an index into [`Self::other_edges`].
    edges: Vec<[u32; 3]>,
    /// Normals of the edges that have not two triangles with a normal. The first one is zero.
    other_edges: Vec<Vector3<f64>>,
    points: Vec<Vector3<f64>>,
}

impl PseudoNormals {
    pub fn new(mesh: &TriangleMesh, oriented: &OrientedMesh) -> Self {
        let unit_normal = |triangle: usize| {
            let corners = mesh.corner_points(mesh.triangles[triangle]);
            let normal = area_vector(corners).try_normalize(0.0).filter(|_| !is_sliver(corners));
            normal.unwrap_or_default() * oriented.orientations[triangle]
        };
        let faces: Vec<Vector3<f64>> = sdf_parallel::map_plain(mesh.triangles.len(), unit_normal);

        let mut edges = vec![[faces.len() as u32; 3]; faces.len()];
        let mut other_edges = vec![Vector3::zeros()];
        for edge in oriented.half_edges.chunk_by(same_edge) {
            // A collinear triangle has no normal.
            let normals = || edge.iter().map(|half| faces.get(half.triangle as usize).copied().unwrap_or_default());
            if normals().any(|normal| normal == Vector3::zeros()) {
                continue;
            }
            let mut set = |half: &HalfEdge, number| edges[half.triangle as usize][usize::from(half.corner)] = number;
            if let [a, b] = edge {
                set(a, b.triangle);
                set(b, a.triangle);
            } else if let Ok(number) = u32::try_from(faces.len() + other_edges.len()) {
                edge.iter().for_each(|half| set(half, number));
                other_edges.push(normals().sum());
            }
        }

        let angles = |triangle: usize| {
            let positions = mesh.corner_points(mesh.triangles[triangle]);
            [0, 1, 2].map(|corner| {
                let [here, next, last] = [0, 1, 2].map(|step| positions[(corner + step) % 3]);
                (next - here).angle(&(last - here))
            })
        };
        let angles: Vec<[f64; 3]> = sdf_parallel::map_plain(mesh.triangles.len(), angles);
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
        Self { faces, edges, other_edges, points }
    }

    /// Has every feature a normal?
    pub fn are_known(&self) -> bool {
        let edges = (0..self.faces.len()).flat_map(|triangle| [0, 1, 2].map(|edge| self.edge(triangle, edge)));
        let mut normals = self.faces.iter().chain(&self.points).copied().chain(edges);
        normals.all(|normal| normal != Vector3::zeros())
    }

    /// Why rounding may hide on which side of a solid a point is; `None` if it does not.
    pub fn doubt(&self, bounds: &Aabb) -> Option<&'static str> {
        if self.has_folds() {
            Some("folded shut at an edge or a corner")
        } else if is_far_from_origin(bounds) {
            Some("far from the origin")
        } else {
            None
        }
    }

    /// Is an edge or a corner folded so far that rounding can hide on which side of it a point is?
    fn has_folds(&self) -> bool {
        let is_folded = |normal: &Vector3<f64>| normal.norm_squared() <= FOLD_NORMAL_SQ;
        // Both of its triangles have a normal.
        let is_known = |triangle: usize, edge: usize| (self.edges[triangle][edge] as usize) < self.faces.len();
        let has_folded_edge =
            |triangle: usize| (0..3).any(|edge| is_known(triangle, edge) && is_folded(&self.edge(triangle, edge)));
        let mut corners = self.points.iter().filter(|normal| **normal != Vector3::zeros());
        corners.any(is_folded) || (0..self.faces.len()).any(has_folded_edge)
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
            TriangleFeature::Edge(edge) => self.edge(triangle, edge),
            TriangleFeature::Corner(corner) => self.points[mesh.triangles[triangle][corner] as usize],
        }
    }

    fn edge(&self, triangle: usize, edge: usize) -> Vector3<f64> {
        let number = self.edges[triangle][edge] as usize;
        match self.faces.get(number) {
            Some(other) => [self.faces[triangle], *other].into_iter().sum(),
            None => self.other_edges[number - self.faces.len()],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::topology::orient;

    /// Edges of one, two or three triangles; the sum is zero where one of them is a sliver, whose normal is not known.
    #[test]
    fn the_normal_of_an_edge_is_the_sum_of_those_of_its_triangles() {
        let sliver = [0.5, 1.0, 0.25 + 1e-14];
        let points =
            [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.3], [0.0, 0.2, 1.0], [1.0, 1.0, 0.5], sliver];
        let mesh = TriangleMesh::new(&points, &[[0, 1, 2], [1, 0, 3], [0, 1, 4], [1, 5, 2], [2, 5, 6]]).unwrap();
        let oriented = orient(&mesh);
        let normals = PseudoNormals::new(&mesh, &oriented);
        let (mut counts, mut unknown) = ([0; 4], 0);
        for edge in oriented.half_edges.chunk_by(same_edge) {
            let faces = || edge.iter().map(|half| normals.face(half.triangle));
            let is_known = faces().all(|normal| normal != Vector3::zeros());
            let sum = if is_known { faces().sum() } else { Vector3::zeros() };
            counts[edge.len()] += 1;
            unknown += usize::from(!is_known);
            for half in edge {
                let feature = TriangleFeature::Edge(half.corner.into());
                assert_eq!(normals.feature(&mesh, half.triangle, feature), sum, "{half:?}");
            }
        }
        assert_eq!((counts, unknown), ([0, 8, 2, 1], 3));
    }
}
