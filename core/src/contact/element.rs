//! Which part of an [`Element`] of a mesh does a point lie on? Its [`Feature`], by the weights that are at least
//! [`FEATURE_WEIGHT`].

use crate::Simplex;
use crate::number::{Float, Real};

/// The kind of an element of a mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ElementKind {
    /// One corner.
    Vertex,
    /// Two corners.
    Edge,
    /// Three corners.
    Face,
}

impl ElementKind {
    /// The kind of an element with so many corners; `None` of a tetrahedron.
    pub(super) fn from_corner_count(corners: usize) -> Option<Self> {
        [Self::Vertex, Self::Edge, Self::Face].get(corners.wrapping_sub(1)).copied()
    }
}

/// A vertex, edge or face of a mesh: a simplex of `N` corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element<R: Real, const N: usize> {
    /// The index among the elements of this kind.
    pub id: u32,
    /// The mesh's vertices at the corners.
    pub vertices: [u32; N],
    /// The corners themselves.
    pub simplex: Simplex<R, N>,
}

/// The part of an element that a point lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Feature {
    /// A vertex of the mesh.
    Vertex(u32),
    /// An edge, by its vertices, the lower first.
    Edge([u32; 2]),
    /// The inside of a face, by the face's id.
    Face(u32),
}

/// A point whose weight of a corner is below this counts as lying on the opposite side. Frank-Wolfe never brings a
/// weight to zero, so that a smaller limit would call its edges faces; a larger one calls a point near an edge one on it.
pub const FEATURE_WEIGHT: f64 = 1e-3;

/// For each corner: is its weight above [`FEATURE_WEIGHT`]?
pub(super) fn spanned_corners<R: Float, const N: usize>(weights: [R; N]) -> [bool; N] {
    weights.map(|weight| R::from_f64(FEATURE_WEIGHT) < weight)
}

impl<R: Float, const N: usize> Element<R, N> {
    /// The vertex, edge or face that the point of these weights lies on.
    pub fn feature(&self, weights: [R; N]) -> Feature {
        let spanned = spanned_corners(weights);
        let mut vertices = self.vertices.iter().zip(spanned).filter(|(_, spanned)| *spanned).map(|(vertex, _)| *vertex);
        match (vertices.next(), vertices.next(), vertices.next()) {
            (Some(vertex), None, _) => Feature::Vertex(vertex),
            (Some(a), Some(b), None) => Feature::Edge([a.min(b), a.max(b)]),
            _ => Feature::Face(self.id),
        }
    }
}
