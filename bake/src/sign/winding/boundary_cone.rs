//! Winding number modulo 1, from the boundary edges alone.
//!
//! Join an apex to every boundary edge: the fan of triangles, turned around, closes the mesh. A closed mesh has a whole
//! winding number, so w of the mesh and w of the fan differ by a whole number.
//!
//! For a triangle with corners a, b, c seen from the point, and angles α, β, γ between them,
//!
//! ```text
//! z = |a||b||c| + (a·b)|c| + (b·c)|a| + (c·a)|b| + i a·(b × c)     has arg z = Ω/2   (Van Oosterom and Strackee 1983, eq. 8)
//! |z|²/(|a||b||c|)² = 2 (1 + cos α)(1 + cos β)(1 + cos γ),     zero if the point is on an edge: two directions are opposite.
//! ```
//!
//! A product of complex numbers adds their arguments modulo 2π. So w = Σ Ω/4π = arg(Π z)/2π modulo 1, with one arc
//! tangent for all triangles of a lane.

use std::f64::consts::PI;

use sdf_core::nalgebra::Vector3;

use super::Estimate;
use super::sum::atan2;
use crate::rounding::{CONE_FACTOR_ROUNDING, MIN_CONE_FACTOR_SQ};
use crate::simd::{LANES, Lanes, VectorX8, cross, dot, lane_of, min, sub};

/// Fan of triangles from an apex to each boundary edge.
pub(super) struct BoundaryCone {
    apex: Vector3<f64>,
    edges: Vec<EdgesX8>,
}

/// Edges side by side. Lanes after the last repeat the first.
struct EdgesX8 {
    from: VectorX8<f64>,
    to: VectorX8<f64>,
    is_used: [bool; LANES],
}

/// Products between two normalizations. Squared lengths from [`MIN_CONE_FACTOR_SQ`] to 16 stay in range.
const PRODUCTS: usize = 8;

impl BoundaryCone {
    /// Builds the fan. Edges run as the mesh's triangles have them.
    pub fn new(apex: Vector3<f64>, edges: &[[Vector3<f64>; 2]]) -> Self {
        Self { apex, edges: edges.chunks(LANES).map(EdgesX8::new).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// Winding number modulo 1, to the last digits. `None` if the point may be on an edge of a triangle.
    pub fn winding_fraction(&self, point: Vector3<f64>) -> Option<Estimate> {
        pulp::Arch::new().dispatch(Fraction { cone: self, point })
    }
}

impl EdgesX8 {
    fn new(edges: &[[Vector3<f64>; 2]]) -> Self {
        let end =
            |which: usize, axis: usize| std::array::from_fn(|lane| edges.get(lane).unwrap_or(&edges[0])[which][axis]);
        Self {
            from: std::array::from_fn(|axis| end(0, axis)),
            to: std::array::from_fn(|axis| end(1, axis)),
            is_used: std::array::from_fn(|lane| lane < edges.len()),
        }
    }
}

/// Product of complex numbers in each lane.
struct Product {
    real: Lanes<f64>,
    imaginary: Lanes<f64>,
    /// Smallest |z|² of all factors.
    min_length_sq: Lanes<f64>,
}

impl Product {
    /// Scales each product to length one.
    #[inline(always)]
    fn normalize(&mut self) {
        for lane in 0..LANES {
            let length_sq = self.real[lane] * self.real[lane] + self.imaginary[lane] * self.imaginary[lane];
            let inv_length = 1.0 / length_sq.sqrt();
            self.real[lane] *= inv_length;
            self.imaginary[lane] *= inv_length;
        }
    }
}

struct Fraction<'a> {
    cone: &'a BoundaryCone,
    point: Vector3<f64>,
}

impl pulp::WithSimd for Fraction<'_> {
    type Output = Option<Estimate>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Option<Estimate> {
        let Self { cone, point } = self;
        let apex: [f64; 3] = (cone.apex - point).into();
        let point: [f64; 3] = point.into();
        let mut product = Product { real: [1.0; LANES], imaginary: [0.0; LANES], min_length_sq: [1.0; LANES] };
        for edges in cone.edges.chunks(PRODUCTS) {
            for edges in edges {
                edges.multiply(apex, point, &mut product);
            }
            product.normalize();
        }
        let is_off_edges = product.min_length_sq.iter().all(|length_sq| *length_sq > MIN_CONE_FACTOR_SQ);
        let min_length_sq = product.min_length_sq.iter().copied().fold(1.0, f64::min);
        let error = CONE_FACTOR_ROUNDING * (cone.edges.len() * LANES) as f64 / min_length_sq.sqrt();
        let mut angles = 0.0;
        for lane in 0..LANES {
            angles += atan2(product.imaginary[lane], product.real[lane]);
        }
        is_off_edges.then_some(Estimate { value: angles / (2.0 * PI), error })
    }
}

impl EdgesX8 {
    /// Multiplies by z/(|a||b||c|) of each triangle, and by 1 for an unused lane.
    #[inline(always)]
    fn multiply(&self, apex: [f64; 3], point: [f64; 3], product: &mut Product) {
        let to_apex = dot(apex, apex).sqrt();
        for lane in 0..LANES {
            let b = sub(lane_of(&self.from, lane), point);
            let c = sub(lane_of(&self.to, lane), point);
            let (to_b, to_c) = (dot(b, b).sqrt(), dot(c, c).sqrt());
            let lengths = to_apex * to_b * to_c;
            let denominator = lengths + dot(apex, b) * to_c + dot(b, c) * to_apex + dot(c, apex) * to_b;
            let inv_lengths = 1.0 / lengths;
            let (x, y) = (denominator * inv_lengths, dot(apex, cross(b, c)) * inv_lengths);
            // At a corner x and y are NaN.
            let length_sq = if lengths > 0.0 { x * x + y * y } else { 0.0 };
            let is_edge = self.is_used[lane];
            let length_sq = if is_edge { length_sq } else { 1.0 };
            let (x, y) = (if is_edge { x } else { 1.0 }, if is_edge { y } else { 0.0 });
            let (real, imaginary) = (product.real[lane], product.imaginary[lane]);
            product.min_length_sq[lane] = min(length_sq, product.min_length_sq[lane]);
            product.real[lane] = real * x - imaginary * y;
            product.imaginary[lane] = real * y + imaginary * x;
        }
    }
}
