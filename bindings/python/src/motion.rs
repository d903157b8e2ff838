//! Meshes and fields that move: clusters of faces that are queried frame after frame, and first touches on the way to the next frame.

use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use sdf_field::core::placed::Rigid;
use sdf_field::{
    ContactOptions, Contacts, Elements, Field, FirstTouchOptions, MeshInMotion, MeshPath, MeshView, NotFinite,
    QueryError, Threads,
};

use crate::contacts::{ELEMENTS, Record, margin_advice, records};
use crate::errors::{choice, type_error, value_error};
use crate::mesh::Mesh;
use crate::pools::interruptible;
use crate::{arrays, integers, pose, sdf::Sdf};

/// The faces of a mesh in clusters of neighbours, for contacts(..., clusters=...) frame after frame: clusters that are far from the field
/// are not looked at. Contacts are the same; where complete, elements that are "possible" by their own bounds alone may be left out.
///
/// Made once, of an object with .vertices and .faces or .triangles, or of vertices (n, 3) and faces (m, 3); it takes as long as some ten
/// queries.
#[pyclass(frozen, module = "sdftool")]
pub struct MeshClusters {
    clusters: sdf_field::MeshClusters,
    faces: Vec<[u32; 3]>,
}

#[pymethods]
impl MeshClusters {
    #[new]
    #[pyo3(signature = (mesh, faces=None))]
    fn new(py: Python, mesh: &Bound<PyAny>, faces: Option<&Bound<PyAny>>) -> PyResult<Self> {
        let mesh = Mesh::new(mesh, faces)?;
        let view = mesh.view();
        let clusters = py.detach(|| sdf_field::MeshClusters::new(view)).map_err(value_error)?;
        Ok(Self { clusters, faces: view.faces.to_vec() })
    }

    /// Clusters of the same faces around vertices (n, 3) that have moved against each other. Those of a rigid body need none: give
    /// contacts its mesh_pose. Faces with vertices that are not finite raise ValueError. Contacts are missing where clusters of vertices
    /// that moved otherwise are given: nothing checks that.
    fn refitted(&self, py: Python, vertices: &Bound<PyAny>) -> PyResult<Self> {
        let points = arrays::points(vertices, "vertices")?;
        let mesh = MeshView { points: points.as_slice(), faces: &self.faces };
        // An index that is too high is told by the refit.
        let is_finite =
            |vertex: &u32| mesh.points.get(*vertex as usize).is_none_or(|x| x.iter().all(|x| x.is_finite()));
        let is_wrong = |face: &[u32; 3]| !face.iter().all(is_finite);
        if let Some(first) = self.faces.iter().position(is_wrong) {
            let count = self.faces.iter().filter(|face| is_wrong(face)).count();
            return Err(value_error(NotFinite { count, elements: Elements::Faces, first: Some(first) }));
        }
        let mut clusters = self.clusters.clone();
        py.detach(|| clusters.refit(mesh)).map_err(value_error)?;
        Ok(Self { clusters, faces: self.faces.clone() })
    }

    /// Faces of the mesh.
    fn __len__(&self) -> usize {
        self.faces.len()
    }
}

/// What is known of a mesh that moves, beside its points.
pub struct Motion<'a> {
    clusters: Option<&'a MeshClusters>,
    pose: Option<Rigid>,
    margins: Option<Vec<f64>>,
}

impl<'a> Motion<'a> {
    /// The keywords `clusters`, `mesh_pose` and `margins` of contacts.
    pub fn new(
        clusters: Option<&'a Bound<MeshClusters>>,
        mesh_pose: Option<&Bound<PyAny>>,
        margins: Option<&Bound<PyAny>>,
    ) -> PyResult<Self> {
        Ok(Self {
            clusters: clusters.map(Bound::get),
            pose: pose::optional(mesh_pose, "mesh_pose")?,
            margins: margins.map(|given| arrays::lengths(given, "margins")).transpose()?,
        })
    }

    fn is_still(&self) -> bool {
        self.clusters.is_none() && self.pose.is_none() && self.margins.is_none()
    }

    /// Refuses options that a mesh in motion does not have.
    pub fn check(&self, options: &ContactOptions, is_on_card: bool) -> PyResult<()> {
        match options.elements {
            _ if self.is_still() => Ok(()),
            _ if is_on_card => Err(value_error("clusters, mesh_pose, margins: only with device=\"cpu\"")),
            Elements::Faces => Ok(()),
            _ => Err(value_error("clusters, mesh_pose, margins: only with elements=\"faces\"")),
        }
    }

    /// Refuses clusters of other faces, margins that are not one for each face, and those that contacts of the field do not have.
    pub fn check_mesh(&self, field: &Field, mesh: MeshView, options: &ContactOptions) -> PyResult<()> {
        if self.clusters.is_some_and(|clusters| clusters.faces != mesh.faces) {
            return Err(value_error(
                "clusters: made of other faces than the mesh's, or of these in another order: make MeshClusters of this mesh",
            ));
        }
        let Some(margins) = self.margins.as_deref() else { return Ok(()) };
        let (count, faces) = (margins.len(), mesh.faces.len());
        if count != faces {
            return Err(value_error(format!(
                "margins: {count} lengths, where the mesh has {faces} faces: give one for each"
            )));
        }
        let checked = MeshInMotion { margins: Some(margins), ..MeshInMotion::new(mesh) }.check_margins(field, options);
        checked.map_err(|error| value_error(format!("margins: {}", margin_advice(error))))
    }

    /// Contacts of the mesh.
    pub fn find(&self, field: &Field, mesh: MeshView, options: &ContactOptions) -> Result<Contacts, QueryError> {
        if self.is_still() {
            return field.contacts(mesh, options);
        }
        let clusters = self.clusters.map(|clusters| &clusters.clusters);
        let margins = self.margins.as_deref();
        field.contacts_in_motion(&MeshInMotion { mesh, pose: self.pose, clusters, margins }, options)
    }
}

/// Times, and the contact at each.
type TimedRecords<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<Record>>);

#[pymethods]
impl Sdf {
    /// When elements of a mesh on its way to the next frame first touch this field: (times, contacts), float64 (k,) and a structured array
    /// (k,) of contact_dtype, one for each element that gets within thickness, in the order of elements. Each contact is that of its time.
    ///
    /// Vertices move in straight lines from the mesh's, at time 0, to end (n, 3), at time 1. No time is late: before it the element is
    /// farther than thickness. It is early only in that the distance is at most thickness + tolerance then, or what 600 roundings of the
    /// largest coordinate are, if that is more. A contact farther than that, of status "budget_spent", is of an element that is left open: nothing touches up to its time.
    ///
    /// mesh, faces, elements: as of contacts. thickness: a length.
    /// pose, end_pose: where the field stands at the times 0 and 1, in the mesh's frame; it moves at constant velocity and spin, by the
    /// shorter way around. pose alone: it stands still.
    /// tolerance: a length [default: 1e-4 of the longest side of the box around its elements in both frames].
    /// budget: evaluations of the field an element. threads: None for all cores. Ctrl-C ends it.
    #[pyo3(signature = (mesh, faces=None, *, end, thickness=0.0, elements="faces", pose=None, end_pose=None, tolerance=None,
        budget=65536, threads=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn first_touches<'py>(
        &self,
        py: Python<'py>,
        mesh: &Bound<'py, PyAny>,
        faces: Option<&Bound<'py, PyAny>>,
        end: &Bound<'py, PyAny>,
        #[pyo3(from_py_with = arrays::number)] thickness: f64,
        elements: &str,
        pose: Option<&Bound<'py, PyAny>>,
        end_pose: Option<&Bound<'py, PyAny>>,
        #[pyo3(from_py_with = arrays::optional_number)] tolerance: Option<f64>,
        #[pyo3(from_py_with = integers::clamped)] budget: i64,
        #[pyo3(from_py_with = integers::optional)] threads: Option<i64>,
    ) -> PyResult<TimedRecords<'py>> {
        let mesh = Mesh::new(mesh, faces)?;
        let end = arrays::points(end, "end")?;
        let (start, end) = (mesh.view(), end.as_slice());
        if end.len() != start.points.len() {
            return Err(type_error(format!(
                "end: {} vertices, where the mesh has {}: give those of the same mesh a frame later",
                end.len(),
                start.points.len()
            )));
        }
        let options = FirstTouchOptions {
            elements: choice("elements", elements, &ELEMENTS)?,
            thickness,
            pose: pose::optional(pose, "pose")?,
            end_pose: pose::optional(end_pose, "end_pose")?,
            tolerance,
            budget: integers::within("budget", budget, 0..=u32::MAX, "")?,
            threads: Threads::ALL,
        };
        if !thickness.is_finite() {
            return Err(value_error(format!("thickness={thickness}: give a finite length")));
        }
        self.0.check_margin(thickness).map_err(|error| value_error(format!("thickness: {error}")))?;
        let found = interruptible(py, threads, |threads, cancel| {
            let options = FirstTouchOptions { threads, ..options };
            self.0.first_touches_cancellable(&MeshPath { start, end }, &options, cancel)
        })?;
        let found = found.map_err(value_error)?;
        found.require_finite(&MeshPath { start, end }, options.elements).map_err(value_error)?;
        let times: Vec<f64> = found.touches.iter().map(|touch| touch.time).collect();
        let contacts: Vec<_> = found.touches.iter().map(|touch| touch.contact).collect();
        Ok((times.into_pyarray(py), records(&contacts).into_pyarray(py)))
    }
}
