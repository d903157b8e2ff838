//! Which elements did a search skip? [`Contacts::require_finite`] and [`FirstTouches::require_finite`], for doors that show no counts.

use sdf_core::Real;

use crate::{Contacts, Elements, FirstTouches, MeshPath, MeshView};

/// Elements that a search skipped: a coordinate is NaN, infinite or too large, or the field has no number there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotFinite {
    /// How many.
    pub count: usize,
    /// Kind of the elements.
    pub elements: Elements,
    /// The first with such a coordinate; `None` where it is not known.
    pub first: Option<usize>,
}

impl std::fmt::Display for NotFinite {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { count, elements, first } = self;
        let (one, many) = match elements {
            Elements::Faces => ("face", "faces"),
            Elements::Edges => ("edge", "edges"),
            Elements::Vertices => ("vertex", "vertices"),
        };
        let subject = if *count == 1 { format!("1 {one} has") } else { format!("{count} {many} have") };
        write!(f, "{subject} coordinates that are not finite or too large")?;
        first.map_or(Ok(()), |first| write!(f, ", {one} {first} the first"))
    }
}

impl std::error::Error for NotFinite {}

impl Contacts {
    /// Refuses contacts for which elements of the mesh were skipped.
    pub fn require_finite(&self, mesh: MeshView, elements: Elements) -> Result<(), NotFinite> {
        require_finite(self.not_finite_count, mesh, elements, |vertex| is_valid(&mesh.points[vertex]))
    }
}

impl FirstTouches {
    /// Refuses first touches for which elements of the mesh were skipped.
    pub fn require_finite(&self, path: &MeshPath, elements: Elements) -> Result<(), NotFinite> {
        let MeshPath { start, end } = *path;
        let is_valid = |vertex: usize| is_valid(&start.points[vertex]) && is_valid(&end[vertex]);
        require_finite(self.not_finite_count, start, elements, is_valid)
    }
}

/// Can a search take a point with these coordinates?
pub(crate) fn is_valid(point: &[f64; 3]) -> bool {
    point.iter().all(|x| x.abs() <= f64::MAX_COORDINATE)
}

fn require_finite(
    count: usize,
    mesh: MeshView,
    elements: Elements,
    is_valid: impl Fn(usize) -> bool,
) -> Result<(), NotFinite> {
    if count == 0 {
        return Ok(());
    }
    let is_valid = |vertex: &u32| is_valid(*vertex as usize);
    let first = match elements {
        Elements::Faces => mesh.faces.iter().position(|face| !face.iter().all(is_valid)),
        Elements::Edges => mesh.edges().iter().position(|edge| !edge.iter().all(is_valid)),
        Elements::Vertices => mesh.vertices().iter().position(|vertex| !vertex.iter().all(is_valid)),
    };
    Err(NotFinite { count, elements, first })
}
