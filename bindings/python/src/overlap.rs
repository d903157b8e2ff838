//! Where do two fields touch? The result of `Sdf.overlap`.

use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::prelude::*;
use sdf_field::core::overlap::OverlapPoint;
use sdf_field::{Field, OverlapOptions, OverlapVerdict};

use crate::errors::value_error;
use crate::pose;

/// Where two fields touch; distances are negative inside. Normals point out of the other field and into the first.
///
/// Points are the minima of max(a, b), the deepest first; patch_points lie on the surface a = b between the fields, with an area
/// each.
#[pyclass(frozen, module = "sdftool")]
pub struct Overlap(sdf_field::Overlap);

#[pymethods]
impl Overlap {
    /// "contact", "separated" (proven) or "undecided".
    #[getter]
    fn verdict(&self) -> &'static str {
        match self.0.verdict {
            OverlapVerdict::Contact => "contact",
            OverlapVerdict::Separated => "separated",
            OverlapVerdict::Undecided => "undecided",
        }
    }

    /// Proven lower bound of max(a, b), a length; None where bounds without a search separate the fields.
    #[getter]
    fn lower_bound(&self) -> Option<f64> {
        self.0.deepest.map(|deepest| deepest.lower_bound)
    }

    /// The minima: float64 (k, 3), in the world.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        vectors(py, self.0.points.iter().map(|point| point.point.into()))
    }

    /// Unit normals at the minima: float64 (k, 3); zero where the gradients are equal.
    #[getter]
    fn normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        vectors(py, self.0.points.iter().map(|point| point.normal.into()))
    }

    /// Both fields at the minima, negative inside: float64 (k, 2).
    #[getter]
    fn distances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        distances(py, self.0.points.iter())
    }

    /// Area of the patch between the fields, a unit squared; 0 where they do not touch. What `unknown` counts is not in it.
    #[getter]
    fn area(&self) -> f64 {
        self.0.patch.map_or(0.0, |patch| patch.area)
    }

    /// Cubes of the patch in which the fields have no number, or the same slope: they cannot be cut, and are not in the area. So two equal
    /// fields in one place touch, and have area 0.
    #[getter]
    fn unknown(&self) -> u32 {
        self.0.patch.map_or(0, |patch| patch.undefined_count)
    }

    /// Is lower_bound within the tolerance of the deepest point? Not where the search ran out of evaluations: the bound holds all
    /// the same.
    #[getter]
    fn converged(&self) -> bool {
        self.0.deepest.is_none_or(|deepest| deepest.converged)
    }

    /// Was the whole patch looked at? Else the budget ran out, and there may be more.
    #[getter]
    fn complete(&self) -> bool {
        self.0.patch.is_none_or(|patch| patch.is_complete)
    }

    /// Points of the patch: float64 (p, 3).
    #[getter]
    fn patch_points<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        vectors(py, self.0.pieces.iter().map(|piece| piece.point.point.into()))
    }

    /// Unit normals of the patch: float64 (p, 3).
    #[getter]
    fn patch_normals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        vectors(py, self.0.pieces.iter().map(|piece| piece.point.normal.into()))
    }

    /// Both fields at the points of the patch, negative inside: float64 (p, 2).
    #[getter]
    fn patch_distances<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        distances(py, self.0.pieces.iter().map(|piece| &piece.point))
    }

    /// Area of each piece of the patch: float64 (p,).
    #[getter]
    fn patch_areas<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.pieces.iter().map(|piece| piece.area).collect::<Vec<_>>().into_pyarray(py)
    }

    fn __repr__(&self) -> String {
        format!("<sdftool.Overlap: {}, {} minima, area {}>", self.verdict(), self.0.points.len(), self.area())
    }
}

pub fn find(
    py: Python,
    [a, b]: [&Field; 2],
    poses: [Option<&Bound<PyAny>>; 2],
    margin: f64,
    tolerance: f64,
    resolution: Option<f64>,
) -> PyResult<Overlap> {
    let is_length = |x: f64| x > 0.0 && x.is_finite();
    if !margin.is_finite() || !is_length(tolerance) || !resolution.is_none_or(is_length) {
        return Err(value_error("overlap: margin must be finite, tolerance and resolution positive and finite"));
    }
    [a, b].into_iter().try_for_each(|field| field.check_margin(margin)).map_err(value_error)?;
    let [pose_a, pose_b] = poses;
    let poses = [pose::optional(pose_a, "pose")?, pose::optional(pose_b, "other_pose")?];
    let options = OverlapOptions { poses, margin, tolerance, resolution, ..OverlapOptions::default() };
    py.detach(|| a.overlap(b, &options)).map(Overlap).map_err(value_error)
}

fn vectors<'py>(py: Python<'py>, rows: impl Iterator<Item = [f64; 3]>) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers: Vec<f64> = rows.flatten().collect();
    Ok(Array2::from_shape_vec((numbers.len() / 3, 3), numbers).map_err(value_error)?.into_pyarray(py))
}

fn distances<'py, 'a>(
    py: Python<'py>,
    points: impl Iterator<Item = &'a OverlapPoint<f64>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let numbers: Vec<f64> = points.flat_map(|point| [point.a.value, point.b.value]).collect();
    Ok(Array2::from_shape_vec((numbers.len() / 2, 2), numbers).map_err(value_error)?.into_pyarray(py))
}
