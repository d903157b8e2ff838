//! Corners and edges of the triangle on which a minimum can lie.
//!
//! A direction is *feasible* at a point if a step along it stays in the triangle. If φ falls along a feasible
//! direction in every cell, the point is not a minimum (Clarke 1983, prop. 2.3.2).
//!
//! | part | feasible directions besides the edge's own two |
//! |---|---|
//! | corner a, b, c | u and v, −u and w, −v and −w |
//! | edge ab, ac, bc | v and w, u and −w, −u and −v |

use super::LowestPoint;
use super::directions::{DirectionalBounds, U, V, W};
use crate::number::Float;
use crate::simplex::corner_weights;

/// For each corner: does φ fall along a feasible edge direction?
#[inline(always)]
fn has_descent<R: Float>(bounds: &DirectionalBounds<R>) -> [bool; 3] {
    let (rising, falling) = (|d| bounds.is_rising(d), |d| bounds.is_falling(d));
    [falling(U) | falling(V), rising(U) | falling(W), rising(V) | rising(W)]
}

/// Lowers `lowest` to the corners that can be minima.
#[inline(always)]
pub(super) fn minimize_on_corners<R: Float>(
    bounds: &DirectionalBounds<R>,
    corner_values: [R; 3],
    lowest: &mut LowestPoint<R>,
) {
    let has_descent = has_descent(bounds);
    for k in 0..3 {
        if !has_descent[k] {
            lowest.evaluations = lowest.evaluations.saturating_add(1);
            if corner_values[k] < lowest.value {
                (lowest.weights, lowest.value) = (corner_weights(k), corner_values[k]);
            }
        }
    }
}

/// Parts of cells in which a minimum can lie, by the bounds of their slopes.
pub(super) struct MinimumPlaces {
    /// For each edge ab, ac and bc the directions that are feasible on it: bit k for direction k, bit 4 + k for its opposite. None
    /// for an edge that cannot hold a minimum.
    pub feasible: [u8; 3],
    /// Interiors and creases: φ does not fall along one direction everywhere.
    pub has_interior: bool,
}

impl MinimumPlaces {
    /// Places in all cells of the triangle, for a minimum below `lowest`.
    #[inline(always)]
    pub fn on_triangle<R: Float>(bounds: &DirectionalBounds<R>, corner_values: [R; 3], lowest: R) -> Self {
        let mut places = Self::in_cells(bounds);
        for (edge, (direction, [start, end])) in [(U, [0, 1]), (V, [0, 2]), (W, [1, 2])].into_iter().enumerate() {
            let bound = bounds.edge_lower_bound(direction, [corner_values[start % 3], corner_values[end % 3]]);
            if lowest <= bound {
                places.feasible[edge % 3] = 0;
            }
        }
        places
    }

    /// Places in some cells of it.
    #[inline(always)]
    pub fn in_cells<R: Float>(bounds: &DirectionalBounds<R>) -> Self {
        const ALONG: [u8; 3] = [1, 2, 4];
        const AGAINST: [u8; 3] = [16, 32, 64];
        let mut falling = 0;
        for k in [U, V, W] {
            falling |= if bounds.is_falling(k) { ALONG[k % 3] } else { 0 };
            falling |= if bounds.is_rising(k) { AGAINST[k % 3] } else { 0 };
        }
        let edge = |feasible: u8| if falling & feasible == 0 { feasible } else { 0 };
        let feasible = [
            edge(ALONG[U] | AGAINST[U] | ALONG[V] | ALONG[W]),
            edge(ALONG[V] | AGAINST[V] | ALONG[U] | AGAINST[W]),
            edge(ALONG[W] | AGAINST[W] | AGAINST[U] | AGAINST[V]),
        ];
        Self { feasible, has_interior: !bounds.is_monotonic() }
    }
}
