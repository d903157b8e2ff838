//! Angle-weighted pseudo-normals (Bærentzen and Aanæs 2005, "Signed distance computation using the angle weighted
//! pseudonormal"): whichever feature of a closed surface is nearest to a point, its pseudo-normal tells the side.

use sdf_core::nalgebra::Vector3;

use crate::TriangleMesh;
use crate::topology::{Oriented, same_edge};
use crate::triangle::TriangleFeature;

/// Outward, of any length. By triangles of the mesh.
pub(crate) struct PseudoNormals {
    inside: Vec<Vector3<f64>>,
    edges: Vec<[Vector3<f64>; 3]>,
    points: Vec<Vector3<f64>>,
}

impl PseudoNormals {
    pub fn new(mesh: &TriangleMesh, oriented: &Oriented) -> Self {
        let unit = |(corners, sense): (&[u32; 3], &f64)| {
            let [a, b, c] = mesh.corner_points(*corners);
            (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default() * *sense
        };
        let inside: Vec<_> = mesh.triangles.iter().zip(&oriented.senses).map(unit).collect();

        let mut edges = vec![[Vector3::zeros(); 3]; inside.len()];
        for edge in oriented.half_edges.chunk_by(same_edge) {
            let sum = edge.iter().map(|half| inside[half.triangle as usize]).sum();
            edge.iter().for_each(|half| edges[half.triangle as usize][usize::from(half.corner)] = sum);
        }

        let mut points = vec![Vector3::zeros(); mesh.points.len()];
        for (corners, normal) in mesh.triangles.iter().zip(&inside) {
            let places = mesh.corner_points(*corners);
            for corner in 0..3 {
                let [here, next, last] = [0, 1, 2].map(|step| places[(corner + step) % 3]);
                points[corners[corner] as usize] += *normal * (next - here).angle(&(last - here));
            }
        }
        Self { inside, edges, points }
    }

    pub fn of(&self, mesh: &TriangleMesh, triangle: u32, feature: TriangleFeature) -> Vector3<f64> {
        let triangle = triangle as usize;
        match feature {
            TriangleFeature::Inside => self.inside[triangle],
            TriangleFeature::Edge(edge) => self.edges[triangle][edge],
            TriangleFeature::Corner(corner) => self.points[mesh.triangles[triangle][corner] as usize],
        }
    }
}
