pub mod approx;
pub mod nearest;

use sdf_core::nalgebra::Vector3;

use crate::rounding::{PAIR_ROUNDING, PLANE_HEIGHT_ROUNDING, SLIVER_SINE_SQ};
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

/// Bound of the error of a distance to the triangle, but for that of coordinates and of the distance: large where it is thin.
pub(crate) fn thinness_error(corners @ [a, b, c]: [Vector3<f64>; 3]) -> f64 {
    let [ab, ac, bc] = [b - a, c - a, c - b].map(|edge| edge.norm());
    let (doubled_area, longest) = (2.0 * area_vector(corners).norm(), ab.max(ac).max(bc));
    if is_sliver(corners) {
        // No point inside is farther from the edges than the radius of the circle that touches them. Zero where all corners are one.
        return (doubled_area / (ab + ac + bc) + PAIR_ROUNDING * longest).max(0.0);
    }
    PLANE_HEIGHT_ROUNDING * longest * (ab * ac / doubled_area)
}

/// Half the cross product of two edges: normal to the triangle, as long as its area.
pub(crate) fn area_vector([a, b, c]: [Vector3<f64>; 3]) -> Vector3<f64> {
    (b - a).cross(&(c - a)) * 0.5
}
