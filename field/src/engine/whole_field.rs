//! The stand-in for `near_field` in WebAssembly: all of the field counts on each element. A module for browsers has no room for more.

use sdf_core::AnyField;
use sdf_core::contact::{Contact, Element};
use sdf_core::minimize::Minimum;
use sdf_core::nalgebra::Vector3;
use sdf_core::placed::Posed;

pub(crate) type NearField<'a> = &'a AnyField;

/// All of a field.
pub(super) fn all_of(field: &AnyField) -> NearField<'_> {
    field
}

/// Visits each element.
pub(super) fn visit_near<'a, const N: usize>(
    field: &Posed<NearField<'a>>,
    elements: &[Element<f64, N>],
    _margin: impl Fn(usize) -> f64,
    mut visit: impl FnMut(usize, &Posed<NearField<'a>>),
) {
    (0..elements.len()).for_each(|index| visit(index, field));
}

/// The result of each point, in their order.
pub(crate) fn map_points<T>(
    field: &AnyField,
    points: &[[f64; 3]],
    map: impl Fn(&NearField, Vector3<f64>) -> T,
) -> Vec<T> {
    points.iter().map(|point| map(&field, Vector3::from(*point))).collect()
}

/// The contact as it is: it has the error of all of the field.
pub(super) fn with_error_of_all<const N: usize>(
    _all: &Posed<&AnyField>,
    _near: &Posed<NearField>,
    _element: &Element<f64, N>,
    _minimum: &Minimum<f64, N>,
    contact: Contact<f64>,
) -> Contact<f64> {
    contact
}
