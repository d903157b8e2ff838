//! Contacts of a mesh with a field: the methods of the class `Sdf` for one query, and for a query a frame on a card.

use std::path::PathBuf;

use pyo3::prelude::*;
use sdf_field::ContactOptions;

use crate::contacts::{Found, Keywords};
use crate::cuda::CudaQuery;
use crate::errors::{choice, value_error};
use crate::motion::{MeshClusters, Motion};
use crate::pools::on_threads;
use crate::{arrays, files, integers, mesh::Mesh, sdf::Sdf};

#[pymethods]
impl Sdf {
    /// Contacts of a mesh: a structured array (k,) of contact_dtype, one record for each element with a distance of at most
    /// margin somewhere, at the point where it is lowest. Negative distances are inside. Ctrl-C takes effect when the search is done.
    ///
    /// mesh: an object with .vertices and .faces or .triangles, or vertices (n, 3) and faces (m, 3). Elements with coordinates that are
    /// not finite or too large are a ValueError, which counts them.
    /// margin: a length; negative: only contacts at least so deep, refused below the band of a sparse grid, also of one that was moved
    /// or combined. elements: "faces", "edges" or "vertices"; of points without a mesh "vertices" with faces=[].
    /// method: "auto", "certified", "fw", "pgd", "newton", or "gss" (edges only).
    /// pose: where the field stands in the frame of the mesh: a matrix (4, 4), or a translation (3,) and a quaternion (x, y, z, w).
    /// all_minima: every isolated minimum of an element. one_per_feature: one contact for each vertex, edge or face touched.
    /// complete: leave out no element that the baked mesh has within the margin; what the grid's error leaves open has the
    /// status "possible". exact: contacts by the triangles of the mesh, which bake(..., keep_mesh=True) keeps; with pose, not
    /// of a field that was moved or combined.
    /// lean: leave out smooth normals and error bounds, in less time; points and distances are the same.
    /// budget: evaluations of auto (256) and certified (1024), iterations of other methods (32). tolerance: auto and certified end within
    /// this fraction of slope_bound · longest edge of the minimum, or of slope_bound · longest side of the field's box if that is shorter;
    /// neither counts where exact. threads: None for all cores.
    /// For a mesh that moves, faces alone: clusters, a MeshClusters of it, leaves out what is far from the field, with the same contacts
    /// (where complete, elements that are "possible" by their own bounds alone may be left out); vertices that moved against each other need
    /// refitted clusters, which nothing checks.
    /// mesh_pose: where the frame of a rigid mesh stands; contacts are those of the mesh moved there. margins: one for each face (m,), in
    /// place of margin.
    /// device: "cpu", or "cuda" for an NVIDIA GPU, in f32: docs/gpu.md. There vertices (n, 3) of float32 and faces (m, 3) of uint32 or
    /// int32 may be arrays on the card, of CuPy, PyTorch, Warp or Numba, which are read where they are. kernels: the file that
    /// .ci/gpu.sh --out FOLDER made, or that folder.
    /// counts: True gives (contacts, counts), a dict of counts: "elements" in all, those "searched" and not culled (None on a card where
    /// lean), contacts that are "possible", and elements "undecided": without a contact, and auto and certified did not prove in their
    /// budget that there is none. A larger budget decides most of them, a smaller tolerance those whose minimum is within it of the margin;
    /// complete lists them.
    #[pyo3(signature = (mesh, faces=None, *, margin=0.0, method="auto", elements="faces", pose=None, all_minima=false,
        complete=false, exact=false, one_per_feature=false, lean=false, budget=None, tolerance=1e-3, threads=None,
        clusters=None, mesh_pose=None, margins=None, device="cpu", kernels=None, counts=false))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn contacts<'py>(
        &self,
        py: Python<'py>,
        mesh: &Bound<'py, PyAny>,
        faces: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = arrays::number)] margin: f64,
        method: &str,
        elements: &str,
        pose: Option<&Bound<'py, PyAny>>,
        all_minima: bool,
        complete: bool,
        exact: bool,
        one_per_feature: bool,
        lean: bool,
        #[pyo3(from_py_with = integers::optional)] budget: Option<i64>,
        #[pyo3(from_py_with = arrays::number)] tolerance: f64,
        #[pyo3(from_py_with = integers::optional)] threads: Option<i64>,
        clusters: Option<&Bound<'py, MeshClusters>>,
        mesh_pose: Option<&Bound<'py, PyAny>>,
        margins: Option<&Bound<'py, PyAny>>,
        device: &str,
        #[pyo3(from_py_with = files::optional_path)] kernels: Option<PathBuf>,
        counts: bool,
    ) -> PyResult<Bound<'py, PyAny>> {
        let keywords = Keywords {
            margin: if margins.is_none() { margin } else { 0.0 },
            method,
            elements,
            pose,
            all_minima,
            complete,
            exact,
            one_per_feature,
            lean,
            budget,
            tolerance,
        };
        let is_on_card = choice("device", device, &[("cpu", false), ("cuda", true)])?;
        let checked = margins.is_none().then_some(&self.0);
        let (options, motion) = (keywords.options(checked)?, Motion::new(clusters, mesh_pose, margins)?);
        motion.check(&options, is_on_card)?;
        let found = match (is_on_card, kernels) {
            (true, kernels) => CudaQuery::new(py, &self.0, mesh, faces, options, kernels, threads)?.find(py)?,
            (false, Some(_)) => return Err(value_error("kernels: only with device=\"cuda\"")),
            (false, None) => {
                let mesh = Mesh::new(mesh, faces)?;
                let view = mesh.view();
                motion.check_mesh(&self.0, view, &options)?;
                let found = on_threads(py, threads, mesh.count(options.elements), |threads| {
                    let found = motion.find(&self.0, view, &ContactOptions { threads, ..options });
                    Found::checked(found, view, options.elements)
                })?;
                found.map_err(value_error)?
            }
        };
        found.into_python(py, counts)
    }

    /// A query that keeps this field and a mesh on an NVIDIA GPU, for contacts frame after frame: a CudaQuery.
    ///
    /// Arguments are those of contacts with device="cuda". Points on the card are read where they are in each query, and kept
    /// from being freed; faces are copied once.
    #[pyo3(signature = (mesh, faces=None, *, margin=0.0, method="auto", elements="faces", pose=None, one_per_feature=false,
        lean=false, budget=None, tolerance=1e-3, threads=None, kernels=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn cuda_query(
        &self,
        py: Python,
        mesh: &Bound<PyAny>,
        faces: Option<&Bound<PyAny>>,
        #[pyo3(from_py_with = arrays::number)] margin: f64,
        method: &str,
        elements: &str,
        pose: Option<&Bound<PyAny>>,
        one_per_feature: bool,
        lean: bool,
        #[pyo3(from_py_with = integers::optional)] budget: Option<i64>,
        #[pyo3(from_py_with = arrays::number)] tolerance: f64,
        #[pyo3(from_py_with = integers::optional)] threads: Option<i64>,
        #[pyo3(from_py_with = files::optional_path)] kernels: Option<PathBuf>,
    ) -> PyResult<CudaQuery> {
        let keywords = Keywords {
            margin,
            method,
            elements,
            pose,
            all_minima: false,
            complete: false,
            exact: false,
            one_per_feature,
            lean,
            budget,
            tolerance,
        };
        CudaQuery::new(py, &self.0, mesh, faces, keywords.options(Some(&self.0))?, kernels, threads)
    }
}
