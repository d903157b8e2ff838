//! How does Ctrl-C end a bake? It runs on a thread of its own, and the caller's looks for signals while it waits.
//!
//! The thread owns the mesh: after Ctrl-C the caller goes on at once, and the bake ends at its next step.

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use sdf_field::core::grid::owned::{Layout, Precision};
use sdf_field::{BakeError, BakeOptions, Baked, Field, GridSize, InnerFaces, MaxError, MeshView, Progress, Threads};

use crate::arrays;
use crate::errors::{choice, type_error, value_error, warn};
use crate::integers;
use crate::mesh::{Mesh, sign_method};
use crate::pools;
use crate::sdf::Sdf;

/// Time between two looks for signals, and between two calls of `progress`.
pub const POLL: Duration = Duration::from_millis(50);

/// Bakes a mesh into a grid of signed distances, negative inside: bake(mesh, res=128) or bake(vertices, faces, res=128).
///
/// (trimesh and pysdf are positive inside.) Ctrl-C ends it. A UserWarning tells of a solid that no node is inside of.
///
/// mesh: an object with .vertices and .faces (trimesh) or .triangles (Open3D), or vertices (n, 3) and faces (m, 3).
/// res: cells along the longest side of the mesh's box [default: 64]. voxel_size: side of a cell, in the unit of the mesh.
/// max_error: the largest voxels that certify this error, a length or text such as "0.1%" of the diagonal; the grid is sparse.
/// layout: "dense", or "sparse": bricks near the surface.
/// sign: "auto", "pseudo-normal" (closed surfaces) or "winding" (also open ones).
/// band: half width of a sparse grid's band, in cells. padding: cells around the mesh's box.
/// precision: of samples, "f32", "u16" or "u8" [default: f32 of a dense grid, u16 of a sparse one].
/// inner_faces: "drop" or "keep" faces inside of the solid, as where parts cross. keep_mesh: keep the mesh for contacts(..., exact=True).
/// threads: 1 or more; None for all cores. The result does not depend on it.
/// progress: called as progress(done, total), in steps of no fixed length, at last with all done; an exception in it ends the bake.
#[pyfunction]
#[pyo3(signature = (mesh, faces=None, *, res=None, voxel_size=None, max_error=None, layout=None, sign="auto", band=3,
    padding=4, precision=None, inner_faces="drop", keep_mesh=false, threads=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords of Python")]
pub fn bake(
    py: Python,
    mesh: &Bound<PyAny>,
    faces: Option<&Bound<PyAny>>,
    #[pyo3(from_py_with = integers::optional)] res: Option<i64>,
    #[pyo3(from_py_with = arrays::optional_number)] voxel_size: Option<f64>,
    max_error: Option<&Bound<PyAny>>,
    layout: Option<&str>,
    sign: &str,
    #[pyo3(from_py_with = integers::clamped)] band: i64,
    #[pyo3(from_py_with = integers::clamped)] padding: i64,
    precision: Option<&str>,
    inner_faces: &str,
    keep_mesh: bool,
    #[pyo3(from_py_with = integers::optional)] threads: Option<i64>,
    progress: Option<Bound<PyAny>>,
) -> PyResult<Sdf> {
    let mesh = Mesh::new(mesh, faces)?;
    let max_error = max_error.map(max_error_of).transpose()?;
    let layouts = Layout::ALL.map(|layout| (layout.name(), layout));
    let layout = layout.map(|name| choice("layout", name, &layouts)).transpose()?;
    let precisions = Precision::ALL.map(|precision| (precision.name(), precision));
    let precision = precision.map(|name| choice("precision", name, &precisions)).transpose()?;
    let options = BakeOptions {
        size: size(res.map(integers::res).transpose()?, voxel_size, max_error)?,
        layout: layout.unwrap_or(if max_error.is_some() { Layout::Sparse } else { Layout::Dense }),
        precision,
        band: integers::band(band)?,
        padding: integers::within("padding", padding, 0..=u32::MAX, " cells")?,
        sign: sign_method(sign)?,
        inner_faces: choice("inner_faces", inner_faces, &[("drop", InnerFaces::Drop), ("keep", InnerFaces::Keep)])?,
        keep_mesh,
        threads: Threads::ALL,
        ..BakeOptions::default()
    };
    if max_error.is_some() && (layout == Some(Layout::Dense) || precision.is_some()) {
        return Err(value_error("max_error: layout and precision are chosen by the error; leave them out"));
    }
    let view = mesh.view();
    let baked = bake_interruptible(py, view.points.to_vec(), view.faces.to_vec(), options, threads, progress)?;
    let baked = baked.map_err(value_error)?;
    if let Some(voxel) = baked.thin_voxel() {
        let thin = "no node is inside the solid: it is thinner than a voxel of";
        warn(py, &format!("{thin} {voxel:.2e}: bake with smaller voxels"))?;
    }
    Ok(Sdf(baked.field))
}

fn size(res: Option<u32>, voxel_size: Option<f64>, max_error: Option<MaxError>) -> PyResult<GridSize> {
    Ok(match (res, voxel_size, max_error) {
        (Some(cells), None, None) => GridSize::Cells(cells),
        (None, Some(size), None) if size > 0.0 && size.is_finite() => GridSize::VoxelSize(size),
        (None, Some(size), None) => return Err(value_error(format!("voxel_size={size}: give a positive length"))),
        (None, None, Some(error)) => GridSize::MaxError(error),
        (None, None, None) => BakeOptions::default().size,
        _ => return Err(type_error("res, voxel_size and max_error: give one of them")),
    })
}

/// A length, or text in percent of the diagonal.
fn max_error_of(given: &Bound<PyAny>) -> PyResult<MaxError> {
    let wanted =
        || value_error("max_error: give a positive length, or text such as \"0.1%\" of the diagonal of the mesh's box");
    let (number, is_fraction) = match arrays::number(given) {
        Ok(length) => (length, false),
        Err(_) => {
            let text: String =
                given.extract().map_err(|_| type_error("max_error: give a number or text such as \"0.1%\""))?;
            let percent = text.strip_suffix('%').and_then(|text| text.trim().parse::<f64>().ok());
            (percent.ok_or_else(wanted)? / 100.0, true)
        }
    };
    if !(number > 0.0 && number.is_finite()) {
        return Err(wanted());
    }
    Ok(if is_fraction { MaxError::Fraction(number) } else { MaxError::Length(number) })
}

/// Steps of a bake, counted by any thread.
#[derive(Default)]
struct Steps {
    done: AtomicU64,
    total: AtomicU64,
}

fn bake_interruptible(
    py: Python,
    points: Vec<[f64; 3]>,
    faces: Vec<[u32; 3]>,
    options: BakeOptions,
    threads: Option<i64>,
    progress: Option<Bound<PyAny>>,
) -> PyResult<Result<Baked, BakeError>> {
    let (cancel, steps) = (Arc::new(AtomicBool::new(false)), Arc::new(Steps::default()));
    let (send, receive) = mpsc::channel();
    let pool = pools::pool(py, threads)?;
    let work = {
        let (cancel, steps) = (cancel.clone(), steps.clone());
        move || {
            let count = |progress| match progress {
                Progress::Total(count) => steps.total.fetch_add(count, Ordering::Relaxed),
                Progress::Done(count) => steps.done.fetch_add(count, Ordering::Relaxed),
            };
            let on_progress = |progress| {
                count(progress);
            };
            let mesh = MeshView { points: &points, faces: &faces };
            pool.install(|| Field::bake_cancellable(mesh, &options, &on_progress, &cancel))
        }
    };
    // Nobody receives after a cancel.
    std::thread::Builder::new().name("sdftool-bake".to_owned()).spawn(move || drop(send.send(work())))?;
    // A receiver alone must not be lent to the closure below.
    let receive = Mutex::new(receive);
    loop {
        let received = py.detach(|| receive.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(POLL));
        match received {
            Ok(baked) => {
                let total = steps.total.load(Ordering::Relaxed);
                if let (Some(progress), Ok(_)) = (&progress, &baked) {
                    progress.call1((total, total))?;
                }
                return Ok(baked);
            }
            Err(RecvTimeoutError::Timeout) => {
                let counts = (steps.done.load(Ordering::Relaxed), steps.total.load(Ordering::Relaxed));
                // Nothing is told before the total is known.
                let listener = progress.as_ref().filter(|_| counts.1 > 0);
                let told = listener.map_or(Ok(()), |progress| progress.call1(counts).map(drop));
                if let Err(error) = told.and_then(|()| py.check_signals()) {
                    cancel.store(true, Ordering::Relaxed);
                    return Err(error);
                }
            }
            Err(RecvTimeoutError::Disconnected) => {
                return Err(PyRuntimeError::new_err("the bake ended in a panic: please report this"));
            }
        }
    }
}
