//! How far are points from a mesh, without a grid? Exactly: [`Field::mesh_distances`].

use std::sync::atomic::{AtomicBool, Ordering};

use sdf_bake::{InvalidMesh, MeshDistance, TriangleMesh};

use crate::not_finite::is_valid;
use crate::{Field, MeshView, SignMethod, Threads};

/// Points that one thread measures at a time.
const CHUNK: usize = 256;

impl Field {
    /// Signed distances of points from a mesh, in their order: exact up to the rounding of f64, negative inside. NaN at points
    /// that are not finite or too large. `sign`: `None` lets the mesh decide. Near faces thinner than a millionth of their length
    /// distances are off by up to 5e-8 of that length.
    ///
    /// The search tree is built anew in each call; a grid answers many points about a hundred times faster, within its error
    /// bound. Faces inside of the solid count, too.
    ///
    /// ```
    /// use sdf_field::{Field, MeshView, Threads};
    /// let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    /// let faces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
    /// let mesh = MeshView { points: &points, faces: &faces };
    /// let distances = Field::mesh_distances(mesh, &[[0.25, 0.25, -2.0], [0.125, 0.25, 0.25]], None, Threads::ONE);
    /// assert_eq!(distances.unwrap(), [2.0, -0.125]);
    /// ```
    pub fn mesh_distances(
        mesh: MeshView,
        points: &[[f64; 3]],
        sign: Option<SignMethod>,
        threads: Threads,
    ) -> Result<Vec<f64>, InvalidMesh> {
        Self::mesh_distances_cancellable(mesh, points, sign, threads, &AtomicBool::new(false))
    }

    /// [`mesh_distances`](Self::mesh_distances), until another thread sets `cancel`. Distances that are left are NaN then.
    pub fn mesh_distances_cancellable(
        mesh: MeshView,
        points: &[[f64; 3]],
        sign: Option<SignMethod>,
        threads: Threads,
        cancel: &AtomicBool,
    ) -> Result<Vec<f64>, InvalidMesh> {
        threads.install(|| {
            let mesh = TriangleMesh::new(mesh.points, mesh.faces)?;
            let distance = MeshDistance::new(&mesh, sign.and_then(SignMethod::for_mesh));
            let measure = |point: &[f64; 3]| {
                let is_asked = is_valid(point) && !cancel.load(Ordering::Relaxed);
                if is_asked { distance.signed_distance(*point) } else { f64::NAN }
            };
            let measure_all = |_, points: &[[f64; 3]]| points.iter().map(measure).collect::<Vec<_>>();
            Ok(Threads::ALL.map_chunks(points, CHUNK, measure_all).concat())
        })
    }
}
