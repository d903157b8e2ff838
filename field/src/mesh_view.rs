//! How is a mesh given? As slices: [`MeshView`], with its edges and vertices as elements, each index checked.

use std::collections::HashSet;

use sdf_core::Simplex;
use sdf_core::contact::Element;
use sdf_core::nalgebra::Vector3;

/// A triangle mesh in borrowed slices. It may be open, or no more than loose triangles.
#[derive(Clone, Copy, Debug)]
pub struct MeshView<'a> {
    /// Coordinates of the vertices.
    pub points: &'a [[f64; 3]],
    /// For each face the indices of its three vertices.
    pub faces: &'a [[u32; 3]],
}

/// A face refers to a vertex that is not there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VertexOutOfRange {
    /// The index of the face, edge or vertex.
    pub element: usize,
    /// The vertex that it names.
    pub vertex: u32,
    /// How many vertices there are.
    pub vertex_count: usize,
}

impl std::fmt::Display for VertexOutOfRange {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { element, vertex, vertex_count } = self;
        write!(f, "element {element} refers to vertex {vertex}, but there are {vertex_count} vertices")
    }
}

impl std::error::Error for VertexOutOfRange {}

impl<'a> MeshView<'a> {
    /// The edges of the faces, each once, in the order and the direction in which they appear first: those that the program
    /// finds in a mesh file, with the same indices.
    pub fn edges(&self) -> Vec<[u32; 2]> {
        let mut known = HashSet::with_capacity(2 * self.faces.len());
        let sides = self.faces.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
        sides.filter(|[from, to]| known.insert([*from.min(to), *from.max(to)])).collect()
    }

    /// Every vertex as an element.
    pub fn vertices(&self) -> Vec<[u32; 1]> {
        (0..self.points.len() as u32).map(|vertex| [vertex]).collect()
    }
}

/// Checks that all vertices of the elements are there.
pub(crate) fn check<const N: usize>(points: &[[f64; 3]], elements: &[[u32; N]]) -> Result<(), VertexOutOfRange> {
    elements.iter().enumerate().try_for_each(|(element, vertices)| check_one(points, element, vertices))
}

/// Checks that all vertices of one element are there.
pub(crate) fn check_one(points: &[[f64; 3]], element: usize, vertices: &[u32]) -> Result<(), VertexOutOfRange> {
    let vertex_count = points.len();
    match vertices.iter().find(|vertex| **vertex as usize >= vertex_count) {
        Some(vertex) => Err(VertexOutOfRange { element, vertex: *vertex, vertex_count }),
        None => Ok(()),
    }
}

/// The element of these vertices, which are there.
pub(crate) fn element<const N: usize>(points: &[[f64; 3]], id: usize, vertices: [u32; N]) -> Element<f64, N> {
    let corners = vertices.map(|vertex| Vector3::from(points[vertex as usize]));
    Element { id: id as u32, vertices, simplex: Simplex { corners } }
}
