//! Which kinds of elements are searched?

/// Kinds of elements that are searched.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Elements {
    /// Triangles.
    pub faces: bool,
    /// Edges.
    pub edges: bool,
    /// Vertices.
    pub vertices: bool,
}

impl Elements {
    /// Triangles alone: they find everything that touches.
    pub const FACES: Self = Self { faces: true, edges: false, vertices: false };
    /// Edges alone: for strings.
    pub const EDGES: Self = Self { faces: false, edges: true, vertices: false };
    /// Vertices alone: as most simulators do.
    pub const VERTICES: Self = Self { faces: false, edges: false, vertices: true };
}
