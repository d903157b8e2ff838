//! Exact minima of a trilinear grid on segments and triangles, without iteration over the whole element.

mod polynomial;
pub(super) mod segment;
pub(super) mod triangle;
