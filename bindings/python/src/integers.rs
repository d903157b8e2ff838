//! Which integers are taken? Any comes in, clamped; one beyond the range of its argument is a ValueError that names both.

use std::ops::RangeInclusive;

use pyo3::exceptions::PyOverflowError;
use pyo3::prelude::*;

use crate::errors::value_error;

/// An integer, or the nearest of i64. What is no integer keeps its TypeError.
pub fn clamped(given: &Bound<PyAny>) -> PyResult<i64> {
    match given.extract::<i64>() {
        Err(error) if error.is_instance_of::<PyOverflowError>(given.py()) => {
            Ok(if given.lt(0)? { i64::MIN } else { i64::MAX })
        }
        extracted => extracted,
    }
}

/// The same, or None.
pub fn optional(given: &Bound<PyAny>) -> PyResult<Option<i64>> {
    if given.is_none() { Ok(None) } else { clamped(given).map(Some) }
}

/// The integer, if it is of this range.
pub fn within(name: &str, given: i64, range: RangeInclusive<u32>, unit: &str) -> PyResult<u32> {
    let number = u32::try_from(given).ok().filter(|number| range.contains(number));
    number.ok_or_else(|| {
        let shown = if [i64::MIN, i64::MAX].contains(&given) { String::new() } else { format!("={given}") };
        value_error(format!("{name}{shown}: give {} to {}{unit}", range.start(), range.end()))
    })
}

/// Cells along the longest side.
pub fn res(given: i64) -> PyResult<u32> {
    within("res", given, 1..=u32::MAX, " cells")
}

/// Half width of a band: what the program takes.
pub fn band(given: i64) -> PyResult<u32> {
    within("band", given, 1..=1000, " cells")
}
