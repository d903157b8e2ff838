//! How is a mesh given? As vertices and faces, or as one object of trimesh, Open3D or a package alike.

use numpy::{IntoPyArray, PyArray1};
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};
use sdf_field::{Elements, Field, MeshView, SignMethod};

use crate::arrays::{self, Rows};
use crate::errors::{choice, type_error, value_error};
use crate::{integers, pools};

/// A mesh whose indices are checked.
pub struct Mesh<'py> {
    points: Rows<'py, f64>,
    faces: Rows<'py, u32>,
}

impl<'py> Mesh<'py> {
    /// Vertices and faces, or an object that has both.
    pub fn new(mesh: &Bound<'py, PyAny>, faces: Option<&Bound<'py, PyAny>>) -> PyResult<Self> {
        let (vertices, faces) = match faces {
            Some(_) if !is_array(mesh) && parts(mesh).is_ok() => {
                return Err(type_error("a mesh has faces of its own: give other arguments by name, such as res=64"));
            }
            Some(faces) => (mesh.clone(), faces.clone()),
            None => parts(mesh)?,
        };
        let points = arrays::points(&vertices, "vertices")?;
        let faces = arrays::faces(&faces, points.as_slice().len())?;
        Ok(Self { points, faces })
    }

    /// How many elements a search looks at, to know whether they are few: the edges count as the faces.
    pub fn count(&self, elements: Elements) -> usize {
        let MeshView { points, faces } = self.view();
        if elements == Elements::Vertices { points.len() } else { faces.len() }
    }

    pub fn view(&self) -> MeshView<'_> {
        MeshView { points: self.points.as_slice(), faces: self.faces.as_slice() }
    }
}

/// Vertices and faces of one object: trimesh has `.vertices` and `.faces`, Open3D `.vertices` and `.triangles`, a tensor mesh of
/// Open3D `.vertex.positions` and `.triangle.indices`.
pub fn parts<'py>(mesh: &Bound<'py, PyAny>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    // An attribute that is there and fails raises what it raises.
    if let Some(vertices) = mesh.getattr_opt("vertices")? {
        let faces = mesh.getattr_opt("faces")?;
        if let Some(faces) = faces.map_or_else(|| mesh.getattr_opt("triangles"), |faces| Ok(Some(faces)))? {
            return Ok((vertices, faces));
        }
    }
    if let (Some(vertex), Some(triangle)) = (mesh.getattr_opt("vertex")?, mesh.getattr_opt("triangle")?) {
        let numbers = |of: Bound<'py, PyAny>, name: &str| of.getattr(name)?.call_method0("numpy");
        return Ok((numbers(vertex, "positions")?, numbers(triangle, "indices")?));
    }
    let advice = if mesh.hasattr("geometry")? { "; of a trimesh.Scene give scene.to_mesh()" } else { "" };
    Err(type_error(format!(
        "a {} is not a mesh: give vertices and faces, or an object with .vertices and .faces, such as a trimesh.Trimesh{advice}",
        mesh.get_type().name()?
    )))
}

fn is_array(given: &Bound<PyAny>) -> bool {
    given.hasattr("__array__").unwrap_or(false) || given.is_instance_of::<PyList>() || given.is_instance_of::<PyTuple>()
}

/// The sign method of a name.
pub fn sign_method(name: &str) -> PyResult<Option<SignMethod>> {
    let names =
        [("auto", None), ("pseudo-normal", Some(SignMethod::PseudoNormal)), ("winding", Some(SignMethod::Winding))];
    choice("sign", name, &names)
}

/// Exact signed distances of points from a mesh, negative inside: signed_distance(mesh, points) or
/// signed_distance(vertices, faces, points).
///
/// (trimesh.proximity.signed_distance and pysdf are positive inside.) No grid is made; the search tree is built anew in each call. Faces inside
/// of the solid, as where parts cross, count as surface: bake drops them, but for inner_faces="keep". Near faces thinner than a millionth of
/// their length distances are off by up to 5e-8 of that length, elsewhere by rounding.
///
/// mesh: an object with .vertices and .faces or .triangles, or vertices (n, 3) and faces (m, 3).
/// points: (k, 3), in the unit of the mesh.
/// sign: "auto", "pseudo-normal" or "winding".
/// Returns float64 (k,), in the unit of the mesh; NaN at points that are not finite or beyond 1e150. Ctrl-C ends it.
#[pyfunction]
#[pyo3(signature = (mesh, faces=None, points=None, *, sign="auto", threads=None))]
pub fn signed_distance<'py>(
    py: Python<'py>,
    mesh: &Bound<'py, PyAny>,
    faces: Option<&Bound<'py, PyAny>>,
    points: Option<&Bound<'py, PyAny>>,
    sign: &str,
    #[pyo3(from_py_with = integers::optional)] threads: Option<i64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (mesh, points) = match (faces, points) {
        (faces, Some(points)) => (Mesh::new(mesh, faces)?, points),
        // Of a mesh that is one object, the points come second.
        (Some(points), None) if !is_array(mesh) => (Mesh::new(mesh, None)?, points),
        _ => return Err(type_error("points: an array of shape (n, 3) is needed")),
    };
    let points = arrays::points(points, "points")?;
    let sign = sign_method(sign)?;
    let (view, rows) = (mesh.view(), points.as_slice());
    let distances = pools::interruptible(py, threads, |threads, cancel| {
        Field::mesh_distances_cancellable(view, rows, sign, threads, cancel)
    });
    Ok(distances?.map_err(value_error)?.into_pyarray(py))
}
