//! Corners and edges of the triangle on which a minimum can lie.
//!
//! A direction is *feasible* at a point if a step along it stays in the triangle. If φ falls along a feasible
//! direction in every cell, the point is not a minimum (Clarke 1983, prop. 2.3.2).
//!
//! | part | feasible directions besides the edge's own two |
//! |---|---|
//! | corner a, b, c | u and v, −u and w, −v and −w |
//! | edge ab, ac, bc | v and w, u and −w, −u and −v |

use super::directions::{DirectionalBounds, U, V, W};
use super::grid_triangle::GridTriangle;
use crate::grid::exact::segment::{Line, LowestPoint};
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

/// The three edges with lower bounds. An edge that cannot hold a minimum below `lowest` has an infinite one.
#[inline(always)]
pub(super) fn edges<R: Float>(
    triangle: &GridTriangle<R>,
    bounds: &DirectionalBounds<R>,
    corner_values: [R; 3],
    lowest: R,
) -> [Line<R>; 3] {
    let infinity = R::from_f64(f64::INFINITY);
    let (rising, falling) = (|d| bounds.is_rising(d), |d| bounds.is_falling(d));
    let edge = |direction: usize, [start, end]: [usize; 2], has_descent: bool| {
        let bound = bounds.edge_lower_bound(direction, [corner_values[start % 3], corner_values[end % 3]]);
        Line {
            start: triangle.corners[start % 3],
            direction: triangle.corners[end % 3] - triangle.corners[start % 3],
            end_weights: [corner_weights(start), corner_weights(end)],
            lower_bound: if !has_descent && bound < lowest { bound } else { infinity },
        }
    };
    [
        edge(U, [0, 1], rising(U) | falling(U) | falling(V) | falling(W)),
        edge(V, [0, 2], rising(V) | falling(V) | falling(U) | rising(W)),
        edge(W, [1, 2], rising(W) | falling(W) | rising(U) | rising(V)),
    ]
}
