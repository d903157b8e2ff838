//! The stand-in for `near_field` in WebAssembly: all of the field counts on each element. A module for browsers has no room for more.

use sdf_core::AnyField;
use sdf_core::contact::{Contact, Element};
use sdf_core::minimize::Minimum;
use sdf_core::placed::Posed;

pub(super) type NearField<'a> = &'a AnyField;

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
