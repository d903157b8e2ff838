//! Exact minima of a trilinear grid on segments and triangles, without a search over the element.
//!
//! # Setting
//!
//! Positions are in *cell coordinates*: (x − origin) / spacing, so that node (i, j, k) lies at (i, j, k) and every
//! cell is a unit cube. In a cell φ is one polynomial, linear along each axis (`polynomial`):
//!
//! ```text
//! φ = c + l·x + c_xy xy + c_yz yz + c_zx zx + c_xyz xyz,      ∂²φ/∂x² = ∂²φ/∂y² = ∂²φ/∂z² = 0
//! ```
//!
//! - **On a line** φ is a cubic in each cell. Its minimum is at an end of the piece or at a root of a quadratic:
//!   `segment`.
//! - **On a triangle** φ is a polynomial on each of the polygons into which the cell faces cut it. Its minimum is at
//!   a corner, on an edge or a cut (lines again), or at a stationary point inside a polygon: `triangle`.
//!
//! # Letters
//!
//! | | | in the code |
//! |---|---|---|
//! | a, b, c | corners of the triangle | `corners` |
//! | u, v, w | edges b − a, c − a, c − b | `Directions` |
//! | m, h | centre and half extents of a cell clipped to the triangle's box | `center`, `half_extents` |
//! | H | second derivatives of φ; the diagonal is zero | `MixedDerivatives` |
//! | c_xyz | the only third derivative of φ; constant in a cell | `third_derivative` |
//! | \[L_d, U_d\] | interval that holds ∇φ·d in all cells | `DirectionalBounds` |
//!
//! # Bounds
//!
//! | bound | holds because | used in |
//! |---|---|---|
//! | φ ≥ lowest corner sample of the cell | the weights of a trilinear mean are ≥ 0 | `segment` |
//! | ∇φ·d ∈ ∇φ(m)·d ± (Σ_i h_i \|(Hd)_i\| + \|c_xyz\| Σ_i \|d_i\| h_j h_k) | mean value form (Moore 1966, "Interval Analysis", ch. 6) | `triangle/cell` |
//! | no minimum where U_d < 0, in all cells around, for a feasible d | 0 ∈ ∂φ at a minimum (Clarke 1983, "Optimization and Nonsmooth Analysis", prop. 2.3.2) | `triangle/corners_and_edges`, `triangle/descent_table` |
//! | φ(x) ≥ φ(centroid) + min_k (lower bound of ∇φ·(corner_k − centroid)) | x − centroid is a mean of the corner_k − centroid | `triangle/directions` |
//! | min over a polygon ≥ min over its boundary − κ l² / 8 | linear interpolation error on a chord of length l with curvature ≤ κ | `triangle/interior_minimum` |
//! | φ(s) ≥ φ(x) − ½ max‖H‖ \|x − s\|² at a stationary s | Taylor's theorem | `triangle/stationary` |
//!
//! The *deficit* is an upper bound of (lowest value found − true minimum). The certified lower bound returned is
//! value − deficit − rounding.

mod polynomial;
pub(super) mod segment;
pub(super) mod triangle;

use super::Storage;
use super::storage::TEAM_LANES;
use crate::number::Float;

/// Number of pieces, cells or cuts computed side by side: the f64 in the widest vectors.
const LANES: usize = TEAM_LANES;

/// [`Storage::corners_in_lanes`] of the lanes that this thread computes.
#[inline(always)]
fn corners_of_thread<S: Storage, R: Float>(storage: &S, cells: [[R; LANES]; 3]) -> [[R; LANES]; 8] {
    if S::LANES_OF_THREAD == LANES {
        return storage.corners_in_lanes(cells);
    }
    let mut samples = [[R::zero(); LANES]; 8];
    for lane in 0..S::LANES_OF_THREAD {
        let corners = storage.corners(cells.map(|axis| axis[lane].to_index()));
        for corner in 0..8 {
            samples[corner][lane] = R::from_stored(corners[corner]);
        }
    }
    samples
}

/// Values that all lanes have computed, in order.
#[inline(always)]
fn of_all_lanes<S: Storage, T: Copy>(storage: &S, computed: &[T; LANES]) -> [T; LANES] {
    core::array::from_fn(|lane| storage.of_lane(computed, lane))
}
