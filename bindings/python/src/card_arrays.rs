//! How do arrays that are on a card come in and go out? By the CUDA array interface, versions 2 and 3: a dictionary with an address, a
//! shape, strides and a stream, under `__cuda_array_interface__`.
//!
//! Arrays are checked here by what the dictionary says, and by the driver ([`Gpu::lend`](sdf_field::cuda::Gpu::lend)): no address
//! of the host, and none beyond the array, reaches a kernel.

use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};
use sdf_field::ContactRow;
use sdf_field::cuda::{CardContacts, Cuda, CudaError, CudaFaces, CudaPoints, LentRows, Ready};

use crate::arrays::{self, CUDA_ARRAY_INTERFACE, Rows};
use crate::errors::{cuda_error, type_error, value_error};

/// Points for a card.
pub enum CardPoints<'py> {
    Host(Rows<'py, f64>),
    Lent(LentRows, Bound<'py, PyAny>),
}

impl<'py> CardPoints<'py> {
    pub fn new(cuda: &Cuda, given: &Bound<'py, PyAny>, what: &str) -> PyResult<Self> {
        match lend(cuda, given, what, &["<f4"], "float32")? {
            Some(rows) => Ok(Self::Lent(rows, given.clone())),
            None => Ok(Self::Host(arrays::points(given, what)?)),
        }
    }

    pub fn count(&self) -> usize {
        match self {
            Self::Host(rows) => rows.as_slice().len(),
            Self::Lent(rows, _) => rows.count(),
        }
    }

    pub fn view(&self) -> CudaPoints<'_> {
        match self {
            Self::Host(rows) => CudaPoints::Slice(rows.as_slice()),
            Self::Lent(rows, _) => CudaPoints::Lent(*rows),
        }
    }

    /// The object that must outlive every query of the points.
    pub fn owner(&self) -> Option<Py<PyAny>> {
        match self {
            Self::Host(_) => None,
            Self::Lent(_, owner) => Some(owner.clone().unbind()),
        }
    }
}

/// Faces for a card.
pub enum CardFaces<'py> {
    Host(Rows<'py, u32>),
    Lent(LentRows),
}

impl<'py> CardFaces<'py> {
    /// Indices of faces on the card are checked where they are copied, when the query is made.
    pub fn new(cuda: &Cuda, given: &Bound<'py, PyAny>, vertex_count: usize) -> PyResult<Self> {
        match lend(cuda, given, "faces", &["<u4", "<i4"], "uint32 or int32")? {
            Some(rows) => Ok(Self::Lent(rows)),
            None => Ok(Self::Host(arrays::faces(given, vertex_count)?)),
        }
    }

    pub fn view(&self) -> CudaFaces<'_> {
        match self {
            Self::Host(rows) => CudaFaces::Slice(rows.as_slice()),
            Self::Lent(rows) => CudaFaces::Lent(*rows),
        }
    }
}

/// Rows of an array on the card; `None` of any other object.
fn lend(cuda: &Cuda, given: &Bound<PyAny>, what: &str, types: &[&str], wanted: &str) -> PyResult<Option<LentRows>> {
    let Some(interface) = given.getattr_opt(CUDA_ARRAY_INTERFACE)? else { return Ok(None) };
    let interface = interface
        .cast_into::<PyDict>()
        .map_err(|_| type_error(format!("{what}: {CUDA_ARRAY_INTERFACE} is no dictionary")))?;
    let Interface { address, rows, ready } = Interface::read(&interface, what, types, wanted)?;
    // SAFETY: the caller keeps the object as long as a query has its rows, and with it by the rules of the interface its memory. Nobody
    // writes during a query, as its documentation asks. The stream is one that the object names.
    let lent = given.py().detach(|| unsafe { cuda.gpu().lend(address, rows, ready) });
    lent.map(Some).map_err(|error| match error {
        sdf_field::cuda::GpuError::Lent(_) => value_error(format!("{what}: {error}")),
        _ => cuda_error(CudaError::Card(error)),
    })
}

/// Content of the dictionary of an array of rows of three.
struct Interface {
    address: u64,
    rows: usize,
    ready: Ready,
}

impl Interface {
    fn read(interface: &Bound<PyDict>, what: &str, types: &[&str], wanted: &str) -> PyResult<Self> {
        let item = |key: &str| -> PyResult<Option<Bound<PyAny>>> {
            Ok(interface.get_item(key)?.filter(|value| !value.is_none()))
        };
        let needed =
            |key: &str| item(key)?.ok_or_else(|| type_error(format!("{what}: {CUDA_ARRAY_INTERFACE} has no {key:?}")));
        let wrong = |key: &str| {
            type_error(format!("{what}: {key:?} of {CUDA_ARRAY_INTERFACE} is not what CUDA's array interface says"))
        };
        let shape: Vec<usize> = needed("shape")?.extract().map_err(|_| wrong("shape"))?;
        let [rows, 3] = shape[..] else {
            return Err(type_error(format!("{what}: an array of shape {} on the card, not (n, 3)", needed("shape")?)));
        };
        let kind: String = needed("typestr")?.extract().map_err(|_| wrong("typestr"))?;
        if !types.contains(&kind.as_str()) {
            return Err(type_error(format!(
                "{what}: an array of {kind} on the card, not of {wanted}: convert it there"
            )));
        }
        if let Some(strides) = item("strides")? {
            let steps: Vec<i64> = strides.extract().map_err(|_| wrong("strides"))?;
            let [row, number] = steps[..] else { return Err(wrong("strides")) };
            if rows > 0 && (number != 4 || rows > 1 && row != 12) {
                return Err(type_error(format!(
                    "{what}: an array of strides {strides} on the card, not contiguous: make it so there"
                )));
            }
        }
        if item("mask")?.is_some() {
            return Err(type_error(format!("{what}: an array with a mask")));
        }
        // A flag beside the address says whether others may write: nobody does here.
        let (address, _): (Option<u64>, bool) = needed("data")?.extract().map_err(|_| wrong("data"))?;
        let version: u32 = needed("version")?.extract().map_err(|_| wrong("version"))?;
        let ready = match (version, item("stream")?) {
            (0 | 1, _) => {
                return Err(type_error(format!(
                    "{what}: version {version} of {CUDA_ARRAY_INTERFACE}; 2 or 3 is needed"
                )));
            }
            // It names no stream: PyTorch has this version.
            (2, _) => Ready::AfterAll,
            (_, None) => Ready::Now,
            (_, Some(stream)) => match stream.extract().map_err(|_| wrong("stream"))? {
                0 => return Err(wrong("stream")),
                stream => Ready::AfterStream(stream),
            },
        };
        Ok(Self { address: address.unwrap_or(0), rows, ready })
    }
}

/// Contacts that stay on the card, in no particular order: found["point"] and found["distance"] are arrays there, of the columns that
/// contact_dtype has, but key. Numbers are float32 and uint32.
///
/// CuPy, PyTorch, Warp and Numba take the columns as they are. Each keeps the contacts on the card. The last that goes waits until the
/// card has done all its work, as a stream may still read them.
#[pyclass(frozen, module = "sdftool")]
pub struct CudaContacts {
    /// `None` while it is dropped.
    contacts: Option<CardContacts>,
}

impl CudaContacts {
    pub fn new(contacts: CardContacts) -> Self {
        Self { contacts: Some(contacts) }
    }

    fn address(&self) -> u64 {
        self.contacts.as_ref().map_or(0, CardContacts::address)
    }
}

impl Drop for CudaContacts {
    /// Waits without the interpreter's lock, which work of the card may wait for.
    fn drop(&mut self) {
        let contacts = self.contacts.take();
        Python::attach(|py| py.detach(|| drop(contacts)));
    }
}

#[pymethods]
impl CudaContacts {
    /// Names of the codes in the column status, which here are not those of sdftool.STATUS_NAMES.
    #[classattr]
    #[pyo3(name = "STATUS_NAMES")]
    fn status_names() -> Vec<&'static str> {
        CardContacts::STATUSES.map(ContactRow::status_name).to_vec()
    }

    fn __len__(&self) -> usize {
        self.contacts.as_ref().map_or(0, CardContacts::len)
    }

    fn __getitem__(slf: &Bound<Self>, name: &str) -> PyResult<CudaColumn> {
        let index = CardContacts::COLUMNS.iter().position(|column| column.name == name);
        let index = index.ok_or_else(|| {
            let names: Vec<_> = CardContacts::COLUMNS.iter().map(|column| column.name).collect();
            PyKeyError::new_err(format!("{name:?}: give one of {}", names.join(", ")))
        })?;
        Ok(CudaColumn { contacts: slf.clone().unbind(), index })
    }

    /// Names of the columns.
    fn keys(&self) -> Vec<&'static str> {
        CardContacts::COLUMNS.iter().map(|column| column.name).collect()
    }
}

/// A column of CudaContacts, an array on the card with __cuda_array_interface__: (k,), or (k, 3) of vectors.
#[pyclass(frozen, module = "sdftool")]
pub struct CudaColumn {
    contacts: Py<CudaContacts>,
    index: usize,
}

#[pymethods]
impl CudaColumn {
    /// Address, shape, strides and type, by version 3. Nothing has to be waited for.
    #[getter]
    fn __cuda_array_interface__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let contacts = self.contacts.get();
        let column = &CardContacts::COLUMNS[self.index];
        let (rows, numbers) = (contacts.__len__(), column.numbers);
        let address = if rows == 0 { 0 } else { contacts.address() + column.offset as u64 };
        let pair = |first: usize, second: usize| {
            PyTuple::new(py, if numbers == 1 { vec![first] } else { vec![first, second] })
        };
        let interface = PyDict::new(py);
        interface.set_item("shape", pair(rows, numbers)?)?;
        interface.set_item("strides", pair(CardContacts::STRIDE, 4)?)?;
        interface.set_item("typestr", if column.is_float { "<f4" } else { "<u4" })?;
        interface.set_item("data", (address, false))?;
        interface.set_item("version", 3)?;
        interface.set_item("stream", py.None())?;
        Ok(interface)
    }
}
