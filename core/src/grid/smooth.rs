//! Which way does the sampled function rise, without the jumps of its trilinear interpolant? The gradient of a cubic B-spline.
//!
//! The interpolant's own gradient jumps at the faces between cells, and the exact minimum on a triangle mostly lies on one. The
//! spline S is twice continuously differentiable. Its coefficients come from the samples f by a local filter (quasi-interpolation;
//! de Boor and Fix 1973, "Spline approximation by quasi-interpolants"), so that it reproduces cubic polynomials:
//!
//! ```text
//! S(x) = Σ_j c_j β³(x/h − j),    c_j = (8 f_j − f_{j−1} − f_{j+1}) / 6         along each axis
//!      = Σ_j f_j w(x/h − j),     w(t) = (8 β³(t) − β³(t − 1) − β³(t + 1)) / 6  six nodes along each axis
//! ```
//!
//! With h the spacing, L the slope bound, M_k a bound of the sampled function's k-th derivatives:
//!
//! - |∇S − ∇f| = O(M₄ h³). Differences of the interpolant over ± half a cell are off by up to M₃ h² / 8 per axis: 0.11° on a torus
//!   whose tube is 8 cells thick, where the spline is off by 0.008°.
//! - |∂S/∂x_k (x) − ∂S/∂x_k (y)| ≤ 2 (5/3)³ L |x − y| / h: the derivative of a spline is a mean of slopes along the grid's edges,
//!   with weights whose absolute sum is at most (5/3)³, as 5/3 is that of the filter.
//! - Near an edge of the body S is rounded over three cells, where differences over ± half a cell see one.
//!
//! Beyond the lattice the samples are continued along straight lines, so that the normal at the border is as good as inside:
//! f_{−i} = f_0 + i (f_0 − f_1). Outside, with P the nearest point of the box and d the distance to it, the gradient turns from
//! that at P to the way out of the box:
//!
//! ```text
//! g(x) = (|φ(P)| ∇S(P) + x − P) / √(d² + φ(P)²)
//! ```
//!
//! Away from the border the samples of a sparse grid are copied before they are summed, so that each brick is found once.

use nalgebra::Vector3;

use super::node_box::SPILL;
use super::{Lattice, Storage};
use crate::number::Float;
use crate::vector::norm;

/// Nodes along each axis that a point's value depends on.
const TAPS: usize = 6;

/// Rows of nodes along x that a point's value depends on.
const ROWS: usize = TAPS * TAPS;

/// ∇S at the point, continued outside the grid; `value_at_box` returns φ at the nearest point of the box.
pub(super) fn smooth_gradient<R: Float, S: Storage>(
    lattice: &Lattice,
    storage: &S,
    point: Vector3<R>,
    value_at_box: impl FnOnce(Vector3<R>) -> R,
) -> Vector3<R> {
    let ((origin, spacing, inv_spacing), cells) = (lattice.in_numbers::<R>(), lattice.cells());
    let axes: [AxisTaps<R>; 3] =
        core::array::from_fn(|axis| AxisTaps::new(cells[axis], (point[axis] - origin[axis]) * inv_spacing));
    // Small processors have less room for code.
    let is_copied = S::IS_COPIED && cfg!(feature = "std") && axes.iter().all(AxisTaps::is_in_row);
    let inside = if is_copied { contract_rows(&axes, storage) } else { contract(&axes, storage) } * inv_spacing;
    if axes.iter().all(|taps| taps.is_inside) {
        return inside;
    }
    let on_box = Vector3::from(origin) + Vector3::from(core::array::from_fn(|axis| axes[axis].steps)) * spacing;
    let from_box = point
        - Vector3::from(core::array::from_fn(|axis| if axes[axis].is_inside { point[axis] } else { on_box[axis] }));
    let value = value_at_box(on_box).abs();
    let distance = norm(from_box);
    let length = norm(Vector3::new(distance, value, R::zero()));
    if length.is_negligible() { inside } else { from_box / length + inside * (value / length) }
}

/// The nodes along one axis, and their weights in S and in its derivative.
struct AxisTaps<R> {
    /// The clamped point, in cells from the first node.
    steps: R,
    is_inside: bool,
    /// First corners of three cells, which hold all six nodes; of a shorter lattice, all nodes.
    cells: [u32; TAPS / 2],
    /// For both corners of each cell: the weight in S, and in its derivative.
    weights: [R; TAPS],
    slopes: [R; TAPS],
}

impl<R: Float> AxisTaps<R> {
    /// Are the nodes six in a row?
    fn is_in_row(&self) -> bool {
        let [first, second, third] = self.cells;
        second == first.wrapping_add(2) && third == first.wrapping_add(4)
    }

    /// For each cell: its index, and the weights of its two corners.
    fn corner_pairs(&self) -> impl Iterator<Item = (u32, [R; 2], [R; 2])> {
        (0..TAPS / 2).map(|k| {
            let pair = |all: &[R; TAPS]| [all[2 * k], all[2 * k + 1]];
            (self.cells[k], pair(&self.weights), pair(&self.slopes))
        })
    }
}

impl<R: Float> AxisTaps<R> {
    /// For a point so many cells from the first node, of a lattice with so many of them.
    fn new(cells: u32, unclamped: R) -> Self {
        let last_cell = cells.wrapping_sub(1);
        let steps = unclamped.clamp(R::zero(), R::from_f64(f64::from(cells)));
        let cell = steps.to_count().min(last_cell);
        let (weights, slopes) = spline_weights(steps - R::from_f64(f64::from(cell)));
        let is_inside = steps <= unclamped && unclamped <= steps;
        // The common case: all six nodes are in the lattice.
        if cell >= 2 && cell.wrapping_add(2) <= last_cell {
            let cells = [cell.wrapping_sub(2), cell, cell.wrapping_add(2)];
            return Self { steps, is_inside, cells, weights, slopes };
        }
        let (cells, [weights, slopes]) = fit_to_border(cell, last_cell, [weights, slopes]);
        Self { steps, is_inside, cells, weights, slopes }
    }
}

/// First corners of three cells, and the weights of their corners, for a cell with fewer than two nodes beyond it on one side.
#[inline(never)]
fn fit_to_border<R: Float>(cell: u32, last_cell: u32, taps: [[R; TAPS]; 2]) -> ([u32; TAPS / 2], [[R; TAPS]; 2]) {
    // Two nodes before the cell and two after; as many as there are, from the first on.
    let first = cell.saturating_sub(2).min(last_cell.wrapping_add(2).saturating_sub(TAPS as u32));
    let shift = (cell as i32).wrapping_sub(2).wrapping_sub(first as i32);
    let last = last_cell.wrapping_add(1).wrapping_sub(first) as i32;
    let cells = core::array::from_fn(|k| first.wrapping_add(2 * k as u32).min(last_cell));
    (cells, taps.map(|taps| by_cell(fold_into_lattice(taps, shift, last), first, cells)))
}

/// w and its derivative at the nodes −2 to 3 about a cell, at the fraction `u` of it.
fn spline_weights<R: Float>(u: R) -> ([R; TAPS], [R; TAPS]) {
    let number = R::from_f64;
    let (v, u2, u3) = (R::one() - u, u * u, u * u * u);
    // β³ and (β³)′ at the nodes −1 to 2, over 6 times a factor that `filter` divides by.
    let spline =
        [v * v * v, number(3.0) * u3 - number(6.0) * u2 + number(4.0), number(3.0) * (u + u2 - u3) + R::one(), u3];
    let slope = [-(v * v), (number(3.0) * u - number(4.0)) * u, (number(2.0) - number(3.0) * u) * u + R::one(), u2];
    let filter = |[a, b, c, d]: [R; 4], factor: R| {
        let eight = number(8.0);
        let taps = [-a, eight * a - b, eight * b - a - c, eight * c - b - d, eight * d - c, -d];
        taps.map(|tap| tap * factor)
    };
    (filter(spline, number(1.0 / 36.0)), filter(slope, number(1.0 / 12.0)))
}

/// Weights of six nodes in a row, from `shift` on, as weights of the nodes 0 to 5. A node before 0 or beyond `last` is a continuation
/// along a straight line: f_{−i} = (1 + i) f_0 − i f_1.
fn fold_into_lattice<R: Float>(weights: [R; TAPS], shift: i32, last: i32) -> [R; TAPS] {
    let mut folded = [R::zero(); TAPS];
    let mut add = |node: i32, weight: R| {
        if let Some(sum) = folded.get_mut(node as usize) {
            *sum += weight;
        }
    };
    for (tap, weight) in weights.into_iter().enumerate() {
        let node = shift.wrapping_add(tap as i32);
        let nearest = node.max(0).min(last);
        let beyond = node.wrapping_sub(nearest);
        let excess = weight * R::from_f64(f64::from(beyond.wrapping_abs()));
        add(nearest, weight + excess);
        add(nearest.wrapping_sub(beyond.signum()), if beyond == 0 { R::zero() } else { -excess });
    }
    folded
}

/// The weights of nodes from `first` on as those of the corners of cells. A node that two cells share counts for the first.
fn by_cell<R: Float>(weights: [R; TAPS], first: u32, cells: [u32; TAPS / 2]) -> [R; TAPS] {
    core::array::from_fn(|corner| {
        let wanted = corner as u32 & !1;
        let node = cells[corner / 2].wrapping_add(corner as u32 & 1).wrapping_sub(first);
        if node < wanted { R::zero() } else { weights.get(node as usize).copied().unwrap_or_else(R::zero) }
    })
}

/// [`contract`] of nodes that are six in a row along each axis: the same sums in the same order, and so the same bits.
fn contract_rows<R: Float, S: Storage>([x, y, z]: &[AxisTaps<R>; 3], storage: &S) -> Vector3<R> {
    let mut samples = [0.0_f32; ROWS * TAPS + SPILL];
    storage.copy_box([x.cells[0], y.cells[0], z.cells[0]], [TAPS as u32; 3], &mut samples);
    // Along each row, the sums of S and of its slope.
    let mut sums = [[R::zero(); 2]; ROWS];
    for (sum, row) in sums.iter_mut().zip(samples.chunks_exact(TAPS)) {
        for pair in 0..TAPS / 2 {
            let (low, high) = (R::from_stored(row[2 * pair]), R::from_stored(row[2 * pair + 1]));
            sum[0] += low * x.weights[2 * pair] + high * x.weights[2 * pair + 1];
            sum[1] += low * x.slopes[2 * pair] + high * x.slopes[2 * pair + 1];
        }
    }
    let mut gradient = Vector3::zeros();
    for k in (0..TAPS).step_by(2) {
        for j in (0..TAPS).step_by(2) {
            for layer in k..k + 2 {
                let [low, high] = [sums[layer * TAPS + j], sums[layer * TAPS + j + 1]];
                gradient.x += (low[1] * y.weights[j] + high[1] * y.weights[j + 1]) * z.weights[layer];
                gradient.y += (low[0] * y.slopes[j] + high[0] * y.slopes[j + 1]) * z.weights[layer];
                gradient.z += (low[0] * y.weights[j] + high[0] * y.weights[j + 1]) * z.slopes[layer];
            }
        }
    }
    gradient
}

/// The three derivatives of the spline: sums over six nodes along x, then y, then z, cell by cell.
fn contract<R: Float, S: Storage>([x, y, z]: &[AxisTaps<R>; 3], storage: &S) -> Vector3<R> {
    let mut gradient = Vector3::zeros();
    for (z_cell, z_weights, z_slopes) in z.corner_pairs() {
        for (y_cell, y_weights, y_slopes) in y.corner_pairs() {
            // Sums along the four edges of the cells in x: of S, and of its slope.
            let (mut value, mut slope) = ([R::zero(); 4], [R::zero(); 4]);
            for (x_cell, [w0, w1], [s0, s1]) in x.corner_pairs() {
                let corners = storage.corners([x_cell, y_cell, z_cell]).map(R::from_stored);
                for edge in 0..4 {
                    let (low, high) = (corners[2 * edge], corners[2 * edge + 1]);
                    value[edge] += low * w0 + high * w1;
                    slope[edge] += low * s0 + high * s1;
                }
            }
            for k in 0..2 {
                let along_y = |edges: &[R; 4], [low, high]: [R; 2]| edges[2 * k] * low + edges[2 * k + 1] * high;
                gradient.x += along_y(&slope, y_weights) * z_weights[k];
                gradient.y += along_y(&value, y_slopes) * z_weights[k];
                gradient.z += along_y(&value, y_weights) * z_slopes[k];
            }
        }
    }
    gradient
}
