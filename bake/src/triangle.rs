pub mod approx;
pub mod nearest;

use sdf_core::nalgebra::Vector3;

use crate::rounding::SLIVER_SINE_SQ;
pub(crate) use nearest::{NearestOnTriangle, nearest_on_triangle};

/// Part of a triangle that a point lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum TriangleFeature {
    Corner(usize),
    /// From corner i to the next.
    Edge(usize),
    Inside,
}

/// Is the triangle so thin that its normal is meaningless? Then its edges stand for it.
#[inline(always)]
pub(crate) fn is_sliver([a, b, c]: [Vector3<f64>; 3]) -> bool {
    let (ab, ac) = (b - a, c - a);
    ab.cross(&ac).norm_squared() <= SLIVER_SINE_SQ * ab.norm_squared() * ac.norm_squared()
}

/// Half the cross product of two edges: normal to the triangle, as long as its area.
pub(crate) fn area_vector([a, b, c]: [Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a)) * 0.5
}
