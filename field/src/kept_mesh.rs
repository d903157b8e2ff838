//! The mesh that a grid was baked from, kept beside it: [`KeptMesh`].

#[cfg(feature = "bake")]
use std::sync::{Arc, OnceLock};

use crate::MeshView;
#[cfg(feature = "bake")]
use crate::{GridInfo, QueryError, SignMethod, Threads};

/// The mesh that a grid was baked from: without the shells that the baker dropped, but with whole faces where it cut some.
#[derive(Clone)]
pub struct KeptMesh {
    points: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    is_sign_continuous: bool,
    /// Its tree and normals, made when they are first needed.
    #[cfg(feature = "bake")]
    surface: OnceLock<Arc<sdf_bake::MeshSurface>>,
}

impl KeptMesh {
    /// `is_sign_continuous`: does the sign of the distance change at triangles alone? Not so at the holes of an open mesh.
    pub fn new(points: Vec<[f64; 3]>, faces: Vec<[u32; 3]>, is_sign_continuous: bool) -> Self {
        Self {
            points,
            faces,
            is_sign_continuous,
            #[cfg(feature = "bake")]
            surface: OnceLock::new(),
        }
    }

    /// Vertices and triangles, in an order of the baker's.
    pub fn view(&self) -> MeshView<'_> {
        MeshView { points: &self.points, faces: &self.faces }
    }

    /// Does the sign of the distance change at triangles alone?
    pub fn is_sign_continuous(&self) -> bool {
        self.is_sign_continuous
    }

    /// The mesh as the grid of these facts was measured from it, ready to be searched.
    #[cfg(feature = "bake")]
    pub(crate) fn surface(&self, info: &GridInfo, threads: Threads) -> Result<Arc<sdf_bake::MeshSurface>, QueryError> {
        if let Some(surface) = self.surface.get() {
            return Ok(surface.clone());
        }
        let surface = threads.install(|| self.new_surface(info))?;
        // Two threads may both make it. Waiting for one in a thread pool, whose threads help each other out, could wait forever.
        Ok(self.surface.get_or_init(|| Arc::new(surface)).clone())
    }

    #[cfg(feature = "bake")]
    fn new_surface(&self, info: &GridInfo) -> Result<sdf_bake::MeshSurface, QueryError> {
        let mesh = sdf_bake::TriangleMesh::new(&self.points, &self.faces);
        let mesh = mesh.map_err(|error| QueryError::MeshUnusable(error.to_string()))?;
        let has_inner_faces = info.options.contains("--inner-faces keep") || info.sign_method != SignMethod::Winding;
        let mesh = if has_inner_faces { mesh } else { mesh.without_inner_faces() };
        // Winding numbers sign any mesh.
        let sign = info.sign_method.for_mesh().unwrap_or(sdf_bake::SignMethod::Winding);
        Ok(sdf_bake::MeshSurface::new(mesh, sign, self.is_sign_continuous))
    }
}

impl PartialEq for KeptMesh {
    fn eq(&self, other: &Self) -> bool {
        (&self.points, &self.faces, self.is_sign_continuous) == (&other.points, &other.faces, other.is_sign_continuous)
    }
}

impl std::fmt::Debug for KeptMesh {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "KeptMesh({} points, {} faces)", self.points.len(), self.faces.len())
    }
}
