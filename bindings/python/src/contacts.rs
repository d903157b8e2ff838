//! Which query do arguments ask for, and how do contacts become a structured array? As rows of [`ContactRow`], whose memory numpy takes over.

use numpy::npyffi::PY_ARRAY_API;
use numpy::{Element, IntoPyArray, PyArrayDescr, PyArrayDescrMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::{PyDict, PyList};
use sdf_field::core::contact::Contact;
use sdf_field::{
    ContactOptions, ContactRow, Contacts, Elements, Field, MarginOutOfReach, MeshView, Method, QueryError, Threads,
};

use crate::errors::{choice, value_error};
use crate::{integers, pose};

/// Names of the kinds of elements.
pub const ELEMENTS: [(&str, Elements); 3] =
    [("faces", Elements::Faces), ("edges", Elements::Edges), ("vertices", Elements::Vertices)];

/// The method with this name, which is not a baseline.
fn method(name: &str) -> PyResult<Method> {
    let methods: Vec<_> = Method::ALL.into_iter().filter(|method| !method.is_baseline()).collect();
    let names: Vec<_> = methods.iter().map(Method::to_string).collect();
    let choices: Vec<_> = names.iter().map(String::as_str).zip(methods).collect();
    choice("method", name, &choices)
}

/// Keywords of a query as they are given.
pub struct Keywords<'a, 'py> {
    pub margin: f64,
    pub method: &'a str,
    pub elements: &'a str,
    pub pose: Option<&'a Bound<'py, PyAny>>,
    pub all_minima: bool,
    pub complete: bool,
    pub exact: bool,
    pub one_per_feature: bool,
    pub lean: bool,
    pub budget: Option<i64>,
    pub tolerance: f64,
}

impl Keywords<'_, '_> {
    /// Options that they ask for, on all threads. The margin is one for this field, unless each face has its own.
    pub fn options(self, field: Option<&Field>) -> PyResult<ContactOptions> {
        let Self { margin, tolerance, budget, all_minima, complete, exact, one_per_feature, lean, .. } = self;
        if !margin.is_finite() {
            return Err(value_error(format!("margin={margin}: give a finite length")));
        }
        if !(tolerance > 0.0 && tolerance.is_finite()) {
            return Err(value_error(format!("tolerance={tolerance}: give a positive number")));
        }
        let options = ContactOptions {
            elements: choice("elements", self.elements, &ELEMENTS)?,
            method: method(self.method)?,
            margin,
            pose: pose::optional(self.pose, "pose")?,
            budget: budget.map(|budget| integers::within("budget", budget, 0..=u32::MAX, "")).transpose()?,
            tolerance,
            all_minima,
            complete,
            exact,
            one_per_feature,
            lean,
            threads: Threads::ALL,
        };
        if let Some(field) = field {
            options.check_margin(field).map_err(|error| value_error(margin_advice(error)))?;
        }
        Ok(options)
    }
}

/// Why contacts of this margin are refused, and what to do.
pub fn margin_advice(error: MarginOutOfReach) -> String {
    let advice = if error.is_too_deep() { ", or give complete=True" } else { "" };
    let (margin, told) = (error.margin, format!("{error}{advice}"));
    // In f64 a large number has up to 309 digits.
    if margin.abs() < 1e16 { told } else { told.replace(&margin.to_string(), &format!("{margin:e}")) }
}

/// A record of a structured array.
#[derive(Clone, Copy)]
#[repr(transparent)]
pub struct Record(ContactRow);

impl Record {
    /// The contact; `None` of codes that mean nothing.
    pub fn contact(&self) -> Option<Contact<f64>> {
        self.0.to_contact()
    }
}

pub fn records(contacts: &[Contact<f64>]) -> Vec<Record> {
    contacts.iter().map(|contact| Record(ContactRow::from(contact))).collect()
}

/// Records of an array that has their columns in another order or with gaps.
pub fn converted<'py>(given: &Bound<'py, PyAny>) -> PyResult<PyReadonlyArray1<'py, Record>> {
    let py = given.py();
    let records = py.import("numpy")?.call_method1("zeros", (given.len()?, contact_dtype(py)?))?;
    for name in contact_dtype(py)?.getattr("names")?.try_iter()? {
        let name = name?;
        records.set_item(&name, given.get_item(&name)?)?;
    }
    records.extract()
}

/// Contacts as records, and how many elements there were.
pub struct Found {
    pub records: Vec<Record>,
    /// The search without its contacts.
    counts: Contacts,
}

impl Found {
    pub fn new(mut found: Contacts) -> Self {
        let records = records(&std::mem::take(&mut found.contacts));
        Self { records, counts: found }
    }

    /// What a search found that skipped no element; else why not.
    pub fn checked(found: Result<Contacts, QueryError>, mesh: MeshView, elements: Elements) -> Result<Self, String> {
        let found = found.map_err(|error| match error {
            QueryError::MeshNotKept => {
                "an exact search needs the mesh in the field: bake it again by bake(..., keep_mesh=True)".to_owned()
            }
            error => error.to_string(),
        })?;
        found.require_finite(mesh, elements).map_err(|error| error.to_string())?;
        Ok(Self::new(found))
    }

    /// The records, and with `counts` a dict of counts.
    pub fn into_python<'py>(self, py: Python<'py>, with_counts: bool) -> PyResult<Bound<'py, PyAny>> {
        if !with_counts {
            return Ok(self.records.into_pyarray(py).into_any());
        }
        let Contacts { element_count, searched_count, possible_count, undecided_count, .. } = self.counts;
        let counts = PyDict::new(py);
        // A card does not count what its lean kernel searches.
        let searched = (searched_count > 0 || self.records.is_empty()).then_some(searched_count);
        counts.set_item("elements", element_count)?;
        counts.set_item("searched", searched)?;
        counts.set_item("possible", possible_count)?;
        counts.set_item("undecided", undecided_count)?;
        Ok((self.records.into_pyarray(py), counts).into_pyobject(py)?.into_any())
    }
}

/// Name, type and offset of each column of a record.
macro_rules! columns {
    ($($name:ident: $format:literal),+ $(,)?) => {
        [$((stringify!($name), $format, std::mem::offset_of!(ContactRow, $name))),+]
    };
}

/// The type of contacts: see docs/contacts.md for the columns, of which this has all but the polygon. They are in the order of memory and
/// leave no gap, so that numpy saves them, and joins arrays without another type. Made once: numpy runs code of Python for it, which a
/// signal may end.
pub fn contact_dtype(py: Python<'_>) -> PyResult<&Bound<'_, PyArrayDescr>> {
    static DTYPE: PyOnceLock<Py<PyArrayDescr>> = PyOnceLock::new();
    let columns = columns!(
        weights: "(3,)f8", point: "(3,)f8", surface_point: "(3,)f8", normal: "(3,)f8", distance: "f8", lower_bound: "f8", slope: "f8",
        error_bound: "f8", shape_lower_bound: "f8", key: "u8", id: "u4", evaluations: "u4", vertices: "(3,)u4", feature_id: "(2,)u4",
        element: "u1", feature: "u1", status: "u1", padding: "u1",
    );
    let describe = || -> PyResult<Py<PyArrayDescr>> {
        let fields = PyDict::new(py);
        fields.set_item("names", PyList::new(py, columns.map(|(name, ..)| name))?)?;
        fields.set_item("formats", PyList::new(py, columns.map(|(_, format, _)| format))?)?;
        fields.set_item("offsets", PyList::new(py, columns.map(|(.., offset)| offset))?)?;
        fields.set_item("itemsize", size_of::<ContactRow>())?;
        Ok(py.import("numpy")?.call_method1("dtype", (fields,))?.cast_into::<PyArrayDescr>()?.unbind())
    };
    Ok(DTYPE.get_or_try_init(py, describe)?.bind(py))
}

/// A type of its own, as numpy lets anybody rename the columns of one in place.
pub fn own_dtype<'py>(dtype: &Bound<'py, PyArrayDescr>) -> Bound<'py, PyArrayDescr> {
    let py = dtype.py();
    // SAFETY: numpy makes a new object of a type that lives, or sets an error; no code of Python runs.
    let own = unsafe {
        let new = PY_ARRAY_API.PyArray_DescrNew(py, dtype.as_dtype_ptr());
        Bound::from_owned_ptr_or_err(py, new.cast())
    };
    own.ok().and_then(|own| own.cast_into().ok()).unwrap_or_else(|| dtype.clone())
}

// SAFETY: the type says where each column lies in a `ContactRow`, by `offset_of`, and how large it is. Every pattern of bits is a
// value of each column, and no column is an object of Python.
unsafe impl Element for Record {
    const IS_COPY: bool = true;

    fn get_dtype(py: Python<'_>) -> Bound<'_, PyArrayDescr> {
        own_dtype(contact_dtype(py).expect("made when the module was"))
    }

    fn clone_ref(&self, _py: Python<'_>) -> Self {
        *self
    }
}
