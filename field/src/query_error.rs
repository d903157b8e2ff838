//! Why may a field not answer a query for contacts?

use sdf_core::contact::MAX_REDUCED;

use crate::mesh_view::VertexOutOfRange;

/// Why a query cannot be answered.
#[derive(Clone, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum QueryError {
    /// The mesh names a vertex that it does not have.
    VertexOutOfRange(VertexOutOfRange),
    /// Golden-section search is for edges alone.
    GoldenSectionNeedsEdges,
    /// Only the certified methods find every minimum of an element.
    AllMinimaNeedCertified,
    /// A complete search needs a bound of the field's error, and this field has none.
    ErrorBoundUnknown,
    /// A complete search of a combination, such as a shell or a difference, knows no error bound outside of a grid's box, and the mesh
    /// reaches there.
    OutsideGridInCombination,
    /// An exact search needs the mesh that the grid was baked from.
    MeshNotKept,
    /// An exact search needs a grid, and not shapes, or grids that were moved or combined.
    ExactNeedsGrid,
    /// The mesh that came with the grid cannot be searched: why.
    MeshUnusable(String),
    /// An exact search has its own method, and finds one minimum of each element.
    ExactHasItsOwnMethod,
    /// An exact search has no clusters, no margins of single faces and no pose of the mesh.
    ExactNotInMotion,
    /// A lean contact has no error bound, and only the lowest minimum of an element is one.
    LeanLeavesOut,
    /// Clusters or margins are not those of the mesh: they have another number of faces.
    FaceCountDiffers,
    /// The margin is NaN.
    MarginIsNan,
    /// The tolerance is not a positive finite number.
    ToleranceOutOfRange,
    /// The margin of this face is NaN or infinite.
    MarginNotFinite(usize),
    /// A mesh that moves has another number of vertices at the end than at the start.
    VertexCountDiffers,
    /// The thickness is NaN or infinite.
    ThicknessOutOfRange,
    /// A reduction keeps 1 to 64 contacts, not so many.
    CountOutOfRange(usize),
    /// A reduction needs to know how far the body moves: a positive length, not too small for the contacts' own.
    MovementOutOfRange,
    /// This contact, counted from 0 as it was given, has no finite point, normal or distance.
    ContactNotFinite(usize),
    /// The flag of [`Field::first_touches_cancellable`](crate::Field::first_touches_cancellable) was set.
    Cancelled,
}

impl std::fmt::Display for QueryError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::VertexOutOfRange(error) => error.fmt(f),
            Self::GoldenSectionNeedsEdges => f.write_str("golden-section search works on edges only"),
            Self::ErrorBoundUnknown => {
                f.write_str(
                    "a complete or exact search needs a field whose error bound is known: a baked grid, with the sign by winding where \
                     pseudo-normals do not fit the mesh, of an open mesh one with a larger padding where its inside reaches the box, in a \
                     combination one with a wider band, or dense, where the margin lies beyond the band; or a closed form",
                )
            }
            Self::OutsideGridInCombination => f.write_str(
                "a complete search knows no error bound outside of a grid's box in a combination, and the mesh reaches there: bake the grid with \
                 a larger padding, or leave out what lies there",
            ),
            Self::MeshNotKept => f.write_str(
                "an exact search needs the mesh in the field: bake it again with BakeOptions::keep_mesh, or `bake --keep-mesh`",
            ),
            Self::ExactNeedsGrid => f.write_str(
                "an exact search needs a grid that keeps its mesh: of one that was moved or combined ask the grid itself, with a pose; \
                 shapes in closed form are exact already",
            ),
            Self::MeshUnusable(why) => write!(f, "the mesh in the field cannot be searched: {why}; bake it again"),
            Self::ExactHasItsOwnMethod => {
                f.write_str("an exact search has its own method and finds one minimum of each element: leave out the others")
            }
            Self::ExactNotInMotion => f.write_str(
                "an exact search has no clusters, no margins of single faces and no pose of the mesh: move its points, or give the field a pose",
            ),
            Self::LeanLeavesOut => f.write_str(
                "lean contacts have no error bounds and stand for one minimum of each element: leave out all minima, complete and exact",
            ),
            Self::FaceCountDiffers => {
                f.write_str("clusters and margins must be those of the mesh: they have another number of faces")
            }
            Self::MarginIsNan => f.write_str("the margin is NaN: give a length"),
            Self::ToleranceOutOfRange => f.write_str("the tolerance must be a positive finite number, such as 1e-3"),
            Self::MarginNotFinite(face) => write!(f, "the margin of face {face} must be a finite length"),
            Self::VertexCountDiffers => {
                f.write_str("a mesh that moves must have as many vertices at the end as at the start")
            }
            Self::ThicknessOutOfRange => f.write_str("the thickness must be a finite length"),
            Self::CountOutOfRange(count) => write!(f, "{count} contacts cannot be kept: 1 to {MAX_REDUCED} can"),
            Self::MovementOutOfRange => f.write_str(
                "how far the body moves must be a positive length, and gaps over it must be finite: give the way of a time step",
            ),
            Self::ContactNotFinite(contact) => {
                write!(f, "contact {contact}: its point, normal and distance must be finite")
            }
            Self::Cancelled => f.write_str("the search was cancelled"),
            Self::AllMinimaNeedCertified => f.write_str("all minima are found by the methods auto and certified only"),
        }
    }
}

impl std::error::Error for QueryError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        match self {
            Self::VertexOutOfRange(error) => Some(error),
            _ => None,
        }
    }
}
