//! Angle-weighted pseudo-normals (Bærentzen and Aanæs 2005, "Signed distance computation using the angle weighted
//! pseudonormal"): whichever feature of a closed surface is nearest to a point, its pseudo-normal tells the side.

use rayon::prelude::*;
use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::mesh::topology::{Oriented, same_edge};
use crate::triangle::area_vector;
use crate::triangle::{TriangleFeature, is_sliver};

/// Outward, of any length; zero where a triangle without a normal of its own has a share in it: a sliver, or one that does
/// not count. By triangles of the mesh.
pub(crate) struct PseudoNormals {
    inside: Vec<Vector3<f64>>,
    edges: Vec<[Vector3<f64>; 3]>,
    points: Vec<Vector3<f64>>,
}

impl PseudoNormals {
    pub fn new(mesh: &TriangleMesh, oriented: &Oriented) -> Self {
        let unit = |(corners, orientation): (&[u32; 3], &f64)| {
            let corners = mesh.corner_points(*corners);
            let normal = area_vector(corners).try_normalize(0.0).filter(|_| !is_sliver(corners));
            normal.unwrap_or_default() * *orientation
        };
        let inside: Vec<_> = mesh.triangles.par_iter().zip(&oriented.orientations).map(unit).collect();

        let mut edges = vec![[Vector3::zeros(); 3]; inside.len()];
        for edge in oriented.half_edges.chunk_by(same_edge) {
            let normals = || edge.iter().map(|half| inside[half.triangle as usize]);
            let is_known = normals().all(|normal| normal != Vector3::zeros());
            let sum = if is_known { normals().sum() } else { Vector3::zeros() };
            edge.iter().for_each(|half| edges[half.triangle as usize][usize::from(half.corner)] = sum);
        }

        let weighted = |(corners, normal): (&[u32; 3], &Vector3<f64>)| {
            let places = mesh.corner_points(*corners);
            [0, 1, 2].map(|corner| {
                let [here, next, last] = [0, 1, 2].map(|step| places[(corner + step) % 3]);
                *normal * (next - here).angle(&(last - here))
            })
        };
        let shares: Vec<_> = mesh.triangles.par_iter().zip(&inside).map(weighted).collect();
        let mut points = vec![Vector3::zeros(); mesh.points.len()];
        for (corners, shares) in mesh.triangles.iter().zip(&shares) {
            corners.iter().zip(shares).for_each(|(point, share)| points[*point as usize] += share);
        }
        let slivers: Vec<_> =
            mesh.triangles.par_iter().filter(|corners| is_sliver(mesh.corner_points(**corners))).collect();
        slivers.into_iter().flatten().for_each(|point| points[*point as usize] = Vector3::zeros());
        Self { inside, edges, points }
    }

    /// A triangle's own, of length one; zero where it has none.
    pub fn inside(&self, triangle: u32) -> Vector3<f64> {
        self.inside[triangle as usize]
    }

    /// Zero where the side is not known by the normal.
    pub fn of(&self, mesh: &TriangleMesh, triangle: u32, feature: TriangleFeature) -> Vector3<f64> {
        let triangle = triangle as usize;
        match feature {
            TriangleFeature::Inside => self.inside[triangle],
            TriangleFeature::Edge(edge) => self.edges[triangle][edge],
            TriangleFeature::Corner(corner) => self.points[mesh.triangles[triangle][corner] as usize],
        }
    }
}
