//! The mesh that a grid was baked from, stored beside the samples: vertices and triangles, two datasets of /sdf.

use super::digests::{DatasetList, Digests, open_dataset};
use super::header::Header;
use super::{GridFault, MeshInfo, StoredMesh};
use crate::hdf5::{Dataset, Hdf5Reader, Object};

pub(super) const VERTICES: &str = "mesh_vertices";
pub(super) const TRIANGLES: &str = "mesh_triangles";

/// Largest coordinate that is read and written. Larger ones could not be baked.
const MAX_COORDINATE: f64 = 1e30;

/// A stored mesh that is not read yet.
pub(super) struct MeshReader {
    info: MeshInfo,
    vertices: (Dataset<f64>, usize),
    triangles: (Dataset<u32>, usize),
}

impl MeshReader {
    /// `None` where the file keeps no mesh.
    pub(super) fn open(
        file: &Hdf5Reader,
        sdf: &Object,
        header: &Header,
        datasets: &mut DatasetList,
    ) -> Result<Option<Self>, GridFault> {
        let Some(info) = header.mesh else { return Ok(None) };
        let vertices = open_dataset::<f64>(file, sdf, VERTICES, &[info.vertices, 3])?;
        let triangles = open_dataset::<u32>(file, sdf, TRIANGLES, &[info.triangles, 3])?;
        let first_digests = (datasets.add(&vertices), datasets.add(&triangles));
        Ok(Some(Self { info, vertices: (vertices, first_digests.0), triangles: (triangles, first_digests.1) }))
    }

    pub(super) fn read(&self, file: &Hdf5Reader, digests: &Digests) -> Result<StoredMesh, GridFault> {
        let vertices = digests.elements(file, &self.vertices.0, self.vertices.1)?;
        let triangles = digests.elements(file, &self.triangles.0, self.triangles.1)?;
        let mesh = StoredMesh {
            vertices: vertices.chunks_exact(3).map(|at| [at[0], at[1], at[2]]).collect(),
            triangles: triangles.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect(),
            is_sign_continuous: self.info.is_sign_continuous,
        };
        match violation(&mesh) {
            Some(violation) => Err(GridFault::damaged(violation)),
            None => Ok(mesh),
        }
    }
}

/// The first thing that no stored mesh may have, in words.
pub(super) fn violation(mesh: &StoredMesh) -> Option<String> {
    let count = mesh.vertices.len();
    if count == 0 || mesh.triangles.is_empty() || u32::try_from(count.max(mesh.triangles.len())).is_err() {
        return Some(format!("a mesh of {count} vertices and {} triangles", mesh.triangles.len()));
    }
    let is_bad = |vertex: &[f64; 3]| vertex.iter().any(|x| x.is_nan() || x.abs() > MAX_COORDINATE);
    if let Some(vertex) = mesh.vertices.iter().position(is_bad) {
        return Some(format!("vertex {vertex} of the mesh is {:?}", mesh.vertices[vertex]));
    }
    let is_beyond = |corners: &[u32; 3]| corners.iter().any(|corner| *corner as usize >= count);
    let triangle = mesh.triangles.iter().position(is_beyond)?;
    Some(format!("triangle {triangle} of the mesh is {:?}, of {count} vertices", mesh.triangles[triangle]))
}
