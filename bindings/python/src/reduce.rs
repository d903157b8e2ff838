//! Few contacts of a rigid body in place of many.

use numpy::{IntoPyArray, PyArray1, PyReadonlyArray1, PyUntypedArray, PyUntypedArrayMethods};
use pyo3::prelude::*;
use sdf_field::Contacts;
use sdf_field::core::contact::{MAX_REDUCED, Reduction};

use crate::arrays;
use crate::contacts::{self, Record, records};
use crate::errors::{type_error, value_error};
use crate::integers;

/// Few contacts of a rigid body in place of many: (kept, shortfall), the at most count contacts that hold it as all of them do, in the order
/// of elements, and how far the others can sink while those are held at thickness from the surface, a length.
///
/// contacts: an array (n,) of contact_dtype, of one body with one field; several are joined by numpy.concatenate. count: 1 to 64. movement: how far the body moves until its
/// contacts are found again, a positive length: the sum of the way of the middle of the box around the contacts' points, and of the turn in
/// radians times half of that box's diagonal. Contacts without a normal hold nothing and are not kept.
#[pyfunction]
#[pyo3(signature = (contacts, count, *, movement, thickness=0.0))]
pub fn reduce<'py>(
    py: Python<'py>,
    contacts: &Bound<'py, PyAny>,
    #[pyo3(from_py_with = integers::clamped)] count: i64,
    #[pyo3(from_py_with = arrays::number)] movement: f64,
    #[pyo3(from_py_with = arrays::number)] thickness: f64,
) -> PyResult<(Bound<'py, PyArray1<Record>>, f64)> {
    let wanted = || type_error("contacts: give an array (n,) of contact_dtype, such as Sdf.contacts gives");
    let array = contacts.cast::<PyUntypedArray>().map_err(|_| wanted())?;
    arrays::check_mask(array, "contacts")?;
    if array.ndim() != 1 {
        return Err(wanted());
    }
    let contacts = match contacts.extract::<PyReadonlyArray1<Record>>() {
        Ok(contacts) => contacts,
        // The same columns in another order or with gaps, as numpy's functions make them.
        Err(_) => contacts::converted(contacts).map_err(|_| wanted())?,
    };
    let read = contacts.as_array().iter().map(|record| record.contact()).collect::<Option<Vec<_>>>();
    let contacts =
        read.ok_or_else(|| value_error("contacts: codes that mean nothing; give records of Sdf.contacts"))?;
    let mut contacts = Contacts { contacts, ..Contacts::default() };
    let count = integers::within("count", count, 1..=MAX_REDUCED as u32, "")? as usize;
    let reduction = Reduction { count, movement, thickness };
    let reduced = py.detach(|| contacts.reduce(&reduction)).map_err(value_error)?;
    Ok((records(&contacts.contacts).into_pyarray(py), reduced.shortfall))
}
