//! Which questions does a field answer? The methods of the class `Sdf`; those about a mesh are in `queries` and `motion`.

use std::path::PathBuf;

use numpy::ndarray::{Array2, ArrayView3};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use sdf_field::core::Sample;
use sdf_field::core::grid::owned::OwnedStorage;
use sdf_field::core::placed::Similarity;
use sdf_field::file::SaveError;
use sdf_field::{CombineError, Field, status_bits};

use crate::errors::{file_error, grid_error, type_error, value_error};
use crate::export::Export;
use crate::overlap::{self, Overlap};
use crate::pools::{self, on_threads};
use crate::{arrays, files, integers};

/// A signed distance field, negative inside and positive outside: a baked grid or a closed form.
///
/// (trimesh and pysdf are positive inside.) Lengths are in the unit of the mesh. A field never changes: any number of threads may
/// ask it. It pickles, but for combinations and movements of grids, and shares its samples with its copies and with combinations made of it.
/// Arrays are read where they are if their type allows: nobody writes to them during a call.
#[pyclass(frozen, module = "sdftool")]
pub struct Sdf(pub Field);

#[pymethods]
impl Sdf {
    /// Values at points, negative inside: float64 (n,) of points (n, 3). NaN at points that are not finite or beyond 1e150, and
    /// where the value is not finite.
    ///
    /// Outside of a grid's box, and outside beyond a sparse grid's band, values are lower bounds of the distance, but for the grid's error:
    /// see sample. Points beyond 1e150 count as not finite.
    #[pyo3(signature = (points, *, threads=None))]
    fn __call__<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        #[pyo3(from_py_with = integers::optional)] threads: Option<i64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let points = arrays::points(points, "points")?;
        let rows = points.as_slice();
        // Twice while those of all threads are joined.
        arrays::require_memory::<[f64; 2]>(rows.len(), "points: values")?;
        let values = on_threads(py, threads, rows.len(), |threads| self.0.values(rows, threads))?;
        Ok(values.into_pyarray(py))
    }

    /// Values and gradients at points, negative inside: (float64 (n,), float64 (n, 3)) of points (n, 3).
    ///
    /// A gradient is the derivative of the value, points outward and is not normalized. status=True adds uint8 (n,), a sum of 1: no
    /// derivative here, 2: outside of the grid, the value is a lower bound but for the grid's error, 4: beyond the band, 8: not finite, with NaN for value.
    #[pyo3(signature = (points, *, status=false, threads=None))]
    fn sample<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        status: bool,
        #[pyo3(from_py_with = integers::optional)] threads: Option<i64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let points = arrays::points(points, "points")?;
        let rows = points.as_slice();
        // Twice while those of all threads are joined.
        arrays::require_memory::<[Sample<f64>; 2]>(rows.len(), "points: samples")?;
        let (values, gradients, flags) = on_threads(py, threads, rows.len(), |threads| {
            let samples = self.0.sample(rows, threads);
            let values: Vec<f64> = samples.iter().map(value_or_nan).collect();
            let gradients: Vec<f64> = samples.iter().flat_map(|sample| <[f64; 3]>::from(sample.gradient)).collect();
            let bits = samples.iter().map(|sample| status_bits(sample.status));
            let flags: Vec<u8> = if status { bits.collect() } else { vec![] };
            (values, gradients, flags)
        })?;
        let gradients = Array2::from_shape_vec((rows.len(), 3), gradients).map_err(value_error)?;
        let gradients: Bound<PyArray2<f64>> = gradients.into_pyarray(py);
        let values = values.into_pyarray(py);
        if status {
            return Ok((values, gradients, flags.into_pyarray(py)).into_pyobject(py)?.into_any());
        }
        Ok((values, gradients).into_pyobject(py)?.into_any())
    }

    /// Where this field and another touch, negative distances inside, without a mesh: an Overlap.
    ///
    /// pose, other_pose: where either stands in the world. margin: both fields are at most so far.
    /// tolerance: of the proven deepest point, as a fraction of the box in which they may touch.
    /// resolution: edge of the cubes into which the contact patch is cut.
    #[pyo3(signature = (other, *, pose=None, other_pose=None, margin=0.0, tolerance=1e-3, resolution=None))]
    #[expect(clippy::too_many_arguments, reason = "keywords of Python")]
    fn overlap(
        &self,
        py: Python,
        other: &Bound<Self>,
        pose: Option<&Bound<PyAny>>,
        other_pose: Option<&Bound<PyAny>>,
        #[pyo3(from_py_with = arrays::number)] margin: f64,
        #[pyo3(from_py_with = arrays::number)] tolerance: f64,
        #[pyo3(from_py_with = arrays::optional_number)] resolution: Option<f64>,
    ) -> PyResult<Overlap> {
        overlap::find(py, [&self.0, &other.get().0], [pose, other_pose], margin, tolerance, resolution)
    }

    /// The points of either field: min(a, b), negative inside.
    fn __or__(&self, other: &Bound<Self>) -> PyResult<Self> {
        Field::union(&[self.0.clone(), other.get().0.clone()]).map(Self).map_err(value_error)
    }

    /// The points of both fields: max(a, b), negative inside.
    fn __and__(&self, other: &Bound<Self>) -> PyResult<Self> {
        self.0.intersection(&other.get().0).map(Self).map_err(value_error)
    }

    /// The points of this field that are not of the other: max(a, -b), negative inside.
    fn __sub__(&self, other: &Bound<Self>) -> PyResult<Self> {
        self.0.difference(&other.get().0).map(Self).map_err(value_error)
    }

    /// The union with its seam filled over a width of blend, a length.
    fn smooth_union(&self, other: &Bound<Self>, #[pyo3(from_py_with = arrays::number)] blend: f64) -> PyResult<Self> {
        self.0.smooth_union(&other.get().0, blend).map(Self).map_err(|error| named("blend", error))
    }

    /// The body grown by a length, shrunk where that is negative.
    fn offset(&self, #[pyo3(from_py_with = arrays::number)] distance: f64) -> PyResult<Self> {
        self.0.offset(distance).map(Self).map_err(|error| named("distance", error))
    }

    /// The points about the surface, in a layer of this thickness.
    fn shell(&self, #[pyo3(from_py_with = arrays::number)] thickness: f64) -> PyResult<Self> {
        self.0.shell(thickness).map(Self).map_err(|error| named("thickness", error))
    }

    /// The field scaled, then turned by a quaternion (x, y, z, w), then moved.
    #[pyo3(signature = (translation=[0.0; 3], rotation=[0.0, 0.0, 0.0, 1.0], scale=1.0))]
    fn moved(
        &self,
        #[pyo3(from_py_with = arrays::vector)] translation: [f64; 3],
        #[pyo3(from_py_with = arrays::vector)] rotation: [f64; 4],
        #[pyo3(from_py_with = arrays::number)] scale: f64,
    ) -> PyResult<Self> {
        let placement = Similarity::new(translation, rotation, scale);
        let placement = placement
            .ok_or_else(|| value_error("moved: rotation must not be zero, scale positive, and all numbers finite"))?;
        self.0.placed(placement).map(Self).map_err(value_error)
    }

    /// Writes a grid as .sdf.h5, a closed form as .sdf.toml: whole, or not at all. load reads the same field, bit for bit.
    fn save(&self, py: Python, #[pyo3(from_py_with = files::path)] path: PathBuf) -> PyResult<()> {
        pools::run(py, None, || self.0.save(path))?.map_err(|error| match &error {
            SaveError::ClosedForm(cause) => file_error(cause),
            SaveError::Grid(cause) => grid_error(cause),
            _ => value_error(&error),
        })
    }

    /// Writes a file of another program, whole or not at all, and gives the paths of what was written: docs/exports.md.
    ///
    /// format: "nvdb", "raw", "npy", "nrrd", "vtkhdf", "glb", "blob", "c" or "rust"; by default that of the path's ending. Values are
    /// negative inside. A UserWarning tells of a shape that is thinner than the cells, and is lost.
    /// res: cells along the longest side [default: a grid's own nodes, 128 of a closed form].
    /// band: half width of a NanoVDB level set, in cells.
    #[pyo3(signature = (path, format=None, *, res=None, band=None, threads=None))]
    fn export(
        &self,
        py: Python,
        #[pyo3(from_py_with = files::path)] path: PathBuf,
        format: Option<&str>,
        #[pyo3(from_py_with = integers::optional)] res: Option<i64>,
        #[pyo3(from_py_with = integers::optional)] band: Option<i64>,
        #[pyo3(from_py_with = integers::optional)] threads: Option<i64>,
    ) -> PyResult<Vec<PathBuf>> {
        Export::new(&path, format, res, band)?.write(py, &self.0, &path, threads)
    }

    /// The bytes that save writes; from_bytes reads them.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        let bytes = pools::run(py, None, || self.0.to_bytes())?.map_err(value_error)?;
        Ok(PyBytes::new(py, &bytes))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let bytes = self.to_bytes(py).map_err(|error| type_error(format!("this field cannot be pickled: {error}")))?;
        Ok((py.import("sdftool")?.getattr("from_bytes")?, (bytes,)))
    }

    fn __copy__(&self) -> Self {
        Self(self.0.clone())
    }

    fn __deepcopy__(&self, _memo: &Bound<PyAny>) -> Self {
        Self(self.0.clone())
    }

    /// "dense", "sparse" or "closed form".
    #[getter]
    fn layout(&self) -> &'static str {
        self.0.grid().map_or("closed form", |grid| grid.storage().layout().name())
    }

    /// Type of a grid's samples: "f32", "u16" or "u8"; None of a closed form.
    #[getter]
    fn precision(&self) -> Option<&'static str> {
        self.0.grid().map(|grid| grid.storage().precision().name())
    }

    /// Side of a grid's cells, in the unit of the mesh; None of a closed form.
    #[getter]
    fn spacing(&self) -> Option<f64> {
        self.0.grid().map(|grid| grid.lattice().spacing())
    }

    /// Nodes of a grid along z, y and x, as the shape of values; None of a closed form.
    #[getter]
    fn shape(&self) -> Option<(u32, u32, u32)> {
        self.0.grid().map(|grid| {
            let [x, y, z] = grid.lattice().nodes();
            (z, y, x)
        })
    }

    /// A grid's box, or a box around the inside of a closed form: ((x, y, z), (x, y, z)), lowest corner first.
    #[getter]
    fn bounds(&self) -> ([f64; 3], [f64; 3]) {
        let bounds = self.0.domain();
        (bounds.min, bounds.max)
    }

    /// Certified bound on |value - true distance|, a length: in the box of a dense grid, in the band of a sparse one; else None.
    #[getter]
    fn error_bound(&self) -> Option<f64> {
        self.0.info().map(|info| info.error_bound)
    }

    /// Lipschitz constant: values of two points differ by at most so many times their distance.
    #[getter]
    fn slope_bound(&self) -> f64 {
        self.0.slope_bound()
    }

    /// Half width of a sparse grid's band, a length; else None.
    #[getter]
    fn band(&self) -> Option<f64> {
        self.0.info().and_then(|info| info.band)
    }

    /// Largest margin of contacts that is answered, a length. None where there is no largest: of closed forms, and of grids that were moved
    /// or combined so that contacts beyond the box or the band have the status "outside_grid" or "beyond_band". A sparse grid answers
    /// none below its band, also within an offset: contacts say so.
    #[getter]
    fn max_margin(&self) -> Option<f64> {
        self.0.max_margin()
    }

    /// Sign method of the bake: "pseudo-normal" or "winding"; "given" of an imported grid, None of a closed form.
    #[getter]
    fn sign_method(&self) -> Option<&'static str> {
        self.0.info().map(|info| info.sign_method.name())
    }

    /// Why that method, in words; None of a closed form.
    #[getter]
    fn sign_reason(&self) -> Option<&str> {
        self.0.info().map(|info| info.sign_reason.as_str())
    }

    /// Samples of a dense grid, float32 [z, y, x], read-only and without a copy: node [k, j, i] is bounds[0] + spacing * (i, j, k).
    /// None of a sparse grid, a dense one of u16 or u8, or a closed form.
    #[getter]
    fn values<'py>(slf: &Bound<'py, Self>) -> PyResult<Option<Bound<'py, PyArray3<f32>>>> {
        let Some(grid) = slf.get().0.grid() else { return Ok(None) };
        let OwnedStorage::Dense(dense) = grid.storage() else { return Ok(None) };
        let [x, y, z] = grid.lattice().nodes().map(|count| count as usize);
        let view = ArrayView3::from_shape((z, y, x), dense.storage().samples()).map_err(value_error)?;
        // SAFETY: the samples live as long as this object, which the array keeps alive. They never move, for the class is frozen
        // and the grid shared. Nobody writes: the flag is cleared before Python sees the array.
        let array = unsafe { PyArray3::borrow_from_array(&view, slf.clone().into_any()) };
        array.call_method1("setflags", (false,))?;
        Ok(Some(array))
    }

    fn __repr__(&self) -> String {
        match (self.0.grid(), self.error_bound()) {
            (Some(grid), Some(error)) => {
                let [x, y, z] = grid.lattice().nodes();
                let (layout, spacing) = (self.layout(), grid.lattice().spacing());
                format!(
                    "<sdftool.Sdf: {layout} grid of {x} x {y} x {z} nodes, spacing {spacing}, error at most {error}>"
                )
            }
            (Some(_), None) => format!("<sdftool.Sdf: {} grid>", self.layout()),
            _ => "<sdftool.Sdf: closed form>".to_owned(),
        }
    }
}

/// The error of a combination. If a length is wrong, the message begins with the argument's name.
fn named(argument: &str, error: CombineError) -> PyErr {
    match error {
        CombineError::NotFinite(_) | CombineError::NotPositive(_) => value_error(format!("{argument}: {error}")),
        _ => value_error(error),
    }
}

fn value_or_nan(sample: &Sample<f64>) -> f64 {
    if sample.status.not_finite { f64::NAN } else { sample.value }
}
