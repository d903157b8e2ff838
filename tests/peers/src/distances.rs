//! The signed distance at every node, from a mesh in memory. Each run builds the crate's own tree again.

use std::path::Path;

use anyhow::Result;
use mesh_to_sdf::{Grid, SignMethod, Topology, generate_grid_sdf};
use parry3d::math::Vector;
use parry3d::query::PointQuery;
use parry3d::shape::{TriMesh, TriMeshFlags};
use sdf_formats::mesh::read;
use serde_json::json;

use crate::{Answer, Nodes, Work};

/// Projection onto a triangle mesh, with signs by pseudo-normals.
pub fn parry3d(mesh: &Path, nodes: Nodes) -> Result<Work> {
    let mesh = read(mesh)?;
    Ok(Box::new(move || {
        let points = mesh.points.iter().map(|p| Vector::from_array(p.map(|x| x as f32))).collect();
        let body = TriMesh::with_flags(points, mesh.triangles.clone(), TriMeshFlags::ORIENTED)?;
        let mut distances = Vec::with_capacity(nodes.counts.iter().product());
        for z in 0..nodes.counts[2] {
            for y in 0..nodes.counts[1] {
                for x in 0..nodes.counts[0] {
                    let point = Vector::from_array(nodes.at([x, y, z]).map(|x| x as f32));
                    let nearest = body.project_local_point(point, false);
                    let distance = (nearest.point - point).length();
                    distances.push(if nearest.is_inside { -distance } else { distance });
                }
            }
        }
        Ok(Answer { distances, facts: json!({}) })
    }))
}

/// Distances with signs by ray casting, the crate's default, which needs a closed mesh.
pub fn mesh_to_sdf(mesh: &Path, nodes: Nodes) -> Result<Work> {
    let mesh = read(mesh)?;
    let points: Vec<[f32; 3]> = mesh.points.iter().map(|p| p.map(|x| x as f32)).collect();
    let corners: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    let grid = Grid::new(nodes.origin.map(|x| x as f32), [nodes.spacing as f32; 3], nodes.counts);
    Ok(Box::new(move || {
        let topology = Topology::TriangleList(Some(&corners));
        let z_fastest = generate_grid_sdf(&points, topology, &grid, SignMethod::Raycast);
        let [along_x, along_y, along_z] = nodes.counts;
        let mut distances = Vec::with_capacity(z_fastest.len());
        for z in 0..along_z {
            for y in 0..along_y {
                distances.extend((0..along_x).map(|x| z_fastest[grid.get_cell_idx(&[x, y, z])]));
            }
        }
        Ok(Answer { distances, facts: json!({}) })
    }))
}
