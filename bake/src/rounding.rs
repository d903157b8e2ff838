//! Rounding: the error model, and every allowance for rounding that this crate makes.
//!
//! An operation rounds to the nearest number: fl(x ∘ y) = (x ∘ y)(1 + δ) with |δ| ≤ u = ε/2. After n operations, a sum
//! of products with terms up to M is off by at most γₙ M, γₙ = n u / (1 − n u) (Higham 2002, "Accuracy and Stability
//! of Numerical Algorithms", §3.1). So k ε covers 2k − 1 operations:
//!
//! | multiple | operations | names |
//! |---|---|---|
//! | ε | 1 | `SAMPLE` |
//! | 2 ε … 4 ε | 3 … 7 | `ESTIMATE`, `COARSE_DISTANCE`, `DEQUANTIZED`, `BOUND` |
//! | 8 ε | 15 | `DETERMINANT`, `CONE_FACTOR`, `NODE_STEP`, `PIECE`, `SLOPE` |
//! | 16 ε | 31 | `NODE_POSITION`, `COARSE_DIFFERENCE`, `BRICK_DISTANCE`, `PLANE_HEIGHT` |
//! | 32 ε | 63 | `POINT_ON_MESH`, `PAIR` |
//! | 64 ε | 127 | `APPROX_DISTANCE` |
//! | 128 ε | 255 | `BACK_TO_BACK` |
//!
//! A `*_SLACK` is wider than any such error by orders of magnitude, where width costs nothing: a few candidates more
//! that an exact test rejects. A `MIN_*` is where cancellation or underflow has taken the digits of a quantity.

use sdf_core::Aabb;
use sdf_core::grid::Lattice;

const EPSILON_F32: f64 = f32::EPSILON as f64;

// Multiples of ε of f64.

/// Determinant of three differences: products and their sum have at most 9 roundings.
pub(crate) const DETERMINANT_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Complex number of one triangle of a boundary cone, relative to its length.
pub(crate) const CONE_FACTOR_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Excess of the distance of neighbouring nodes over the spacing, relative to their largest coordinate.
pub(crate) const NODE_STEP_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Height over the plane of a triangle within its edges, relative to the longest edge over the sine of its first angle: a normal
/// takes 4 ε, 8 ε the products that decide on which side of an edge a point is.
pub(crate) const PLANE_HEIGHT_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Position of a node, relative to its largest coordinate, in a bound of three coordinates.
pub(crate) const NODE_POSITION_ROUNDING: f64 = 16.0 * f64::EPSILON;

/// Largest distance of a node from where the lattice has it, and with it of a point as large.
pub(crate) fn node_position_rounding(lattice: &Lattice) -> f64 {
    NODE_POSITION_ROUNDING * max_coordinate(&lattice.bounds())
}

/// Largest magnitude of a coordinate in a box.
pub(crate) fn max_coordinate(bounds: &Aabb) -> f64 {
    bounds.min.iter().chain(&bounds.max).fold(0.0, |max, coordinate| max.max(coordinate.abs()))
}

/// Squared distance to a point of the mesh, relative to the distance times the largest coordinate:
/// |x + δ|² − |x|² ≈ 2 |x| |δ|.
pub(crate) const POINT_ON_MESH_ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Distance between two points of an element and a triangle, relative to their largest coordinate: some forty operations.
pub(crate) const PAIR_ROUNDING: f64 = 32.0 * f64::EPSILON;

/// Corner of a piece of a triangle, relative to the mesh's largest coordinate: 4 ε along each axis, and one more where
/// the piece would have no area.
pub(crate) const PIECE_ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Distance between two faces that rounding may swap, relative to the mesh's largest coordinate and its diagonal: four times that of
/// [`POINT_ON_MESH_ROUNDING`].
pub(crate) const BACK_TO_BACK_ROUNDING: f64 = 128.0 * f64::EPSILON;

// Multiples of ε of f32.

/// One stored sample, relative to its value.
pub(crate) const SAMPLE_ROUNDING: f32 = f32::EPSILON;

/// Error of a winding number, kept in f32: its conversion and one product.
pub(crate) const ESTIMATE_ROUNDING: f32 = 2.0 * f32::EPSILON;

/// Distance at a node of the coarse grid, rounded twice.
pub(crate) const COARSE_DISTANCE_ROUNDING: f64 = 4.0 * EPSILON_F32;

/// Sample restored from its code: the sample, scale and offset and their product and sum are each rounded.
pub(crate) const DEQUANTIZED_ROUNDING: f64 = 4.0 * EPSILON_F32;

/// Error bound of a grid, raised to the next f32.
pub(crate) const BOUND_ROUNDING: f64 = 4.0 * EPSILON_F32;

/// Difference of two values interpolated in the coarse grid: seven interpolations, each a product and two sums, at
/// both ends.
pub(crate) const COARSE_DIFFERENCE_ROUNDING: f64 = 16.0 * EPSILON_F32;

/// Squared slope of a cell in f32, relative to it: differences, quotients, squares and sums.
pub(crate) const SLOPE_ROUNDING: f64 = 8.0 * EPSILON_F32;

/// Approximate distance to a triangle in a unit frame: a few dozen operations in f32 come to a third of it. 2⁻¹⁷.
pub(crate) const APPROX_DISTANCE_ROUNDING: f32 = 64.0 * f32::EPSILON;

/// Distance to a triangle in f32, relative to the coordinates of the point in the triangle's frame and to its offset from
/// the middle of its block, whose coordinates are computed in f64. Coordinates take 5 roundings each, the edges 8 more,
/// the root 3: 32 roundings in all, √3 of the first.
pub(crate) const BRICK_DISTANCE_ROUNDING: f32 = 16.0 * f32::EPSILON;

// Slacks, as fractions of the quantity that they widen.

/// Between two computations of one f64 distance: 4,500 ε.
pub(crate) const PRUNE_SLACK: f64 = 1e-12;

/// Sums in f64 over all triangles or edges, and few operations on them: 4.5 million ε.
pub(crate) const SUM_SLACK: f64 = 1e-9;

/// Few operations in f32: 8 ε of f32. Also where positions and distances in f64 are widened at no cost.
pub(crate) const SINGLE_SLACK: f64 = 1e-6;

/// Center and radius of a bounding sphere in f32: 33 ε of f32.
pub(crate) const SPHERE_SLACK: f64 = 4e-6;

/// A few dozen operations in f32: 84 ε of f32.
pub(crate) const CHAIN_SLACK: f64 = 1e-5;

/// [`CHAIN_SLACK`] for f32 code.
pub(crate) const CHAIN_SLACK_F32: f32 = 1e-5;

/// Unit normal of a triangle that is not a sliver: ε over its smallest sine, √[`SLIVER_SINE_SQ`], is 2e-9. A quotient
/// by a cosine of at least 0.1 is off by ten times that.
pub(crate) const NORMAL_SLACK: f64 = 1e-7;

/// Squared difference of two directions that count as one, relative to their squared length.
pub(crate) const DIRECTION_SLACK_SQ: f64 = 1e-13;

/// Largest angle by which rounded corners may turn the plane of a piece of a triangle, a rounding of f32: corners off by ρ turn it by
/// 2 ρ over its least height, ρ times its longest edge over its area.
pub(crate) const PIECE_TURN: f64 = 0.5 * EPSILON_F32;

// Magnitudes below which a quantity has lost its digits.

/// Squared sine of a triangle's angle below which its inside has no reliable normal: cross products lose half of the
/// digits. Such a sliver is 1e7 times as long as wide, and its edges stand for it.
pub(crate) const SLIVER_SINE_SQ: f64 = 1e-14;

/// Sine of the angle between two triangles that share a corner below which they count as folded onto each other, and by which planes
/// tell triangles around a corner apart.
pub(crate) const FOLD_SINE: f64 = 1e-6;

/// Squared length of a pseudo-normal n up to which its edge or corner counts as folded. A point x that is nearest to it, at q, has
/// |n·(x − q)| ≥ |n|² |x − q| / (8 π): of an edge it is half of |n|²; of a corner twice the integral of |s·d| over the directions s into the
/// solid, d that to x, which is at least A²/(2 π) of a solid angle A ≥ |n|/2. That is 4e-9, where [`SLIVER_SINE_SQ`] leaves normals an
/// error of 2e-9 times the angles; and rounding of q decides nearer than 2e-11 of the coordinates.
pub(crate) const FOLD_NORMAL_SQ: f64 = 1e-7;

/// Largest coordinate of a mesh, as a multiple of its diagonal, up to which pseudo-normals tell the side: there rounding decides nearer
/// than a millionth of the diagonal to what is as sharp as [`FOLD_NORMAL_SQ`] allows.
const MAX_OFFSET: f64 = 1e4;

/// Do the coordinates of a mesh in this box leave pseudo-normals too few digits?
pub(crate) fn is_far_from_origin(bounds: &Aabb) -> bool {
    max_coordinate(bounds) > MAX_OFFSET * bounds.diagonal()
}

/// Squared length of a triangle's complex number: 2 (1 + cos α) (1 + cos β) (1 + cos γ), with the angles between the
/// directions to its corners. It vanishes on the edges; a millionth of an edge away, angles have ten digits.
pub(crate) const MIN_CONE_FACTOR_SQ: f64 = 1e-12;

/// Squared length or area in a unit frame of f32, whose smallest normal number is 1.2e-38.
pub(crate) const MIN_SQ_F32: f32 = 1e-36;

/// Determinant of coordinates up to 1e30: more than underflow takes from it.
pub(crate) const MIN_VOLUME: f64 = 1e-280;

/// Area in a unit frame whose vector can still be normalized in f64: its square is a normal number.
pub(crate) const MIN_AREA: f64 = 1e-100;

/// Fraction of the distance of a pair by which another may be nearer and yet go unseen: a coplanar neighbour is not measured.
pub(crate) const PARTING_SLACK: f64 = 1e-12;

/// Below this fraction of the mesh's size, rounding decides the direction from a point to the surface.
pub(crate) const MIN_OFFSET: f64 = 1e-12;
