//! How is a query asked on a card? [`CudaQuery`] keeps the field, the mesh and the objects whose memory is read there.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process;
use std::sync::{Mutex, MutexGuard, PoisonError};

use pyo3::prelude::*;
use sdf_field::cuda::{Cuda, CudaMesh};
use sdf_field::{ContactOptions, Elements, Field, NotFinite, Threads};

use crate::card_arrays::{CardFaces, CardPoints, CudaContacts};
use crate::contacts::Found;
use crate::errors::{cuda_error, value_error};
use crate::{mesh, pools, pose};

/// A field and a mesh that stay on an NVIDIA GPU, for contacts frame after frame: made by Sdf.cuda_query. Negative inside.
#[pyclass(frozen, module = "sdftool")]
pub struct CudaQuery {
    state: Mutex<State>,
    cuda: Cuda,
    elements: Elements,
    threads: Option<i64>,
}

struct State {
    query: sdf_field::cuda::CudaQuery,
    /// The object whose points the query reads on the card: dropped after it.
    owner: Option<Py<PyAny>>,
}

impl CudaQuery {
    pub fn new(
        py: Python,
        field: &Field,
        mesh: &Bound<PyAny>,
        faces: Option<&Bound<PyAny>>,
        options: ContactOptions,
        kernels: Option<PathBuf>,
        threads: Option<i64>,
    ) -> PyResult<Self> {
        let cuda = card(py, kernels)?;
        let (points, faces) = match faces {
            Some(faces) => (mesh.clone(), faces.clone()),
            None => mesh::parts(mesh)?,
        };
        let points = CardPoints::new(&cuda, &points, "vertices")?;
        let faces = CardFaces::new(&cuda, &faces, points.count())?;
        let threads_of_search = if threads == Some(1) { Threads::ONE } else { Threads::ALL };
        let options = ContactOptions { threads: threads_of_search, ..options };
        let on_card = CudaMesh { points: points.view(), faces: faces.view() };
        let query = py.detach(|| field.query_on(&cuda, on_card, &options)).map_err(cuda_error)?;
        Ok(Self {
            state: Mutex::new(State { query, owner: points.owner() }),
            cuda,
            elements: options.elements,
            threads,
        })
    }

    /// The contacts of this frame.
    pub fn find(&self, py: Python) -> PyResult<Found> {
        let pool = if self.threads == Some(1) { None } else { Some(pools::pool(py, self.threads)?) };
        let found = py.detach(|| {
            // Locked before the pool is entered: a thread of the pool that waits may begin other work, but must not wait for itself.
            let mut state = self.state();
            let query = &mut state.query;
            match &pool {
                None => query.contacts(),
                Some(pool) => pool.install(|| query.contacts()),
            }
        });
        let found = found.map_err(cuda_error)?;
        if found.not_finite_count > 0 {
            let (count, elements) = (found.not_finite_count, self.elements);
            return Err(value_error(NotFinite { count, elements, first: None }));
        }
        Ok(Found::new(found))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[pymethods]
impl CudaQuery {
    /// The contacts of this frame: a structured array (k,) of contact_dtype, as of Sdf.contacts.
    ///
    /// Points that are on the card must not be written during the call. What a stream writes to them later counts once it is
    /// waited for: by set_points with the same array, or by the caller.
    ///
    /// counts: True gives (contacts, counts), as of Sdf.contacts.
    #[pyo3(signature = (*, counts=false))]
    fn contacts<'py>(&self, py: Python<'py>, counts: bool) -> PyResult<Bound<'py, PyAny>> {
        self.find(py)?.into_python(py, counts)
    }

    /// The contacts of this frame, left on the card: a CudaContacts, in no particular order.
    ///
    /// Elements with coordinates that are not finite have none. Not with one_per_feature, nor where method="auto" or "certified" leaves
    /// elements to the CPU: contacts has those.
    fn contacts_on_card(&self, py: Python) -> PyResult<CudaContacts> {
        py.detach(|| self.state().query.contacts_on_card()).map(CudaContacts::new).map_err(cuda_error)
    }

    /// Replaces the points of the mesh, (n, 3): an array of numpy, or one of float32 on the card, which is read where it is in
    /// each query, kept from being freed, and whose stream is waited for. Give an array that was written anew again.
    fn set_points(&self, py: Python, points: &Bound<PyAny>) -> PyResult<()> {
        let points = CardPoints::new(&self.cuda, points, "points")?;
        let (view, owner) = (points.view(), points.owner());
        let before = py.detach(|| {
            let mut state = self.state();
            state.query.set_points(view)?;
            Ok(std::mem::replace(&mut state.owner, owner))
        });
        // Dropped with the interpreter's lock held.
        before.map(drop).map_err(cuda_error)
    }

    /// Moves the field: pose as of Sdf.contacts; None puts it back into its own frame.
    #[pyo3(signature = (pose))]
    fn set_pose(&self, py: Python, pose: Option<&Bound<PyAny>>) -> PyResult<()> {
        let pose = pose::optional(pose, "pose")?;
        py.detach(|| self.state().query.set_pose(pose)).map_err(cuda_error)
    }

    /// The card's name.
    #[getter]
    fn card(&self) -> PyResult<String> {
        self.cuda.name().map_err(cuda_error)
    }
}

/// Cards with kernels loaded, by process and file. A process that was forked cannot use the card of its parent.
static CARDS: Mutex<BTreeMap<(u32, PathBuf), Cuda>> = Mutex::new(BTreeMap::new());

/// The card with the kernels in this file or folder, by default the folder of the package. They are loaded once.
fn card(py: Python, kernels: Option<PathBuf>) -> PyResult<Cuda> {
    let kernels = match kernels {
        Some(path) => path,
        None => {
            let file: PathBuf = py.import("sdftool")?.getattr("__file__")?.extract()?;
            file.parent().map(Path::to_owned).ok_or_else(|| value_error("kernels: name the file"))?
        }
    };
    py.detach(|| {
        let key = (process::id(), kernels.canonicalize().unwrap_or_else(|_| kernels.clone()));
        let mut cards = CARDS.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(cuda) = cards.get(&key) {
            return Ok(cuda.clone());
        }
        let cuda = if kernels.is_dir() { Cuda::open_in(&kernels) } else { Cuda::open(&kernels) }?;
        cards.insert(key, cuda.clone());
        Ok(cuda)
    })
    .map_err(cuda_error)
}
