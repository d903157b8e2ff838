use std::f64::consts::PI;

use sdf_core::nalgebra::Vector3;

use super::Estimate;
use super::sum::angle;
use crate::rounding::{CONE_FACTOR_ROUNDING, MIN_CONE_FACTOR_SQ};
use crate::simd::{LANES, Lanes, VectorX8, cross, dot, lane_of, sub};

/// Triangles from one point to each edge of a rim: a surface with the same rim.
pub(super) struct BoundaryCone {
    /// Where all triangles meet.
    apex: Vector3<f64>,
    edges: Vec<Edges>,
}

/// Edges side by side.
struct Edges {
    from: VectorX8<f64>,
    to: VectorX8<f64>,
    /// Zero where there is no edge.
    orientations: Lanes<f64>,
}

/// After so many products of numbers from [`MIN_CONE_FACTOR_SQ`] to 16, squared, there is still room for more.
const PRODUCTS: usize = 8;

impl BoundaryCone {
    /// An edge counts as many times as its multiplicity says, a whole number.
    pub fn new(apex: Vector3<f64>, edges: &[([Vector3<f64>; 2], f64)]) -> Self {
        let times = |(ends, times): &([Vector3<f64>; 2], f64)| {
            std::iter::repeat_n((*ends, times.signum()), times.abs() as usize)
        };
        let edges: Vec<([Vector3<f64>; 2], f64)> = edges.iter().flat_map(times).collect();
        Self { apex, edges: edges.chunks(LANES).map(Edges::new).collect() }
    }

    pub fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    /// The winding number but for a whole number, to the last digits. `None` where the point may be on an edge of a triangle.
    pub fn winding_fraction(&self, point: Vector3<f64>) -> Option<Estimate> {
        pulp::Arch::new().dispatch(Fraction { boundary_cone: self, point })
    }
}

impl Edges {
    fn new(edges: &[([Vector3<f64>; 2], f64)]) -> Self {
        let end =
            |which: usize, axis: usize| std::array::from_fn(|lane| edges.get(lane).unwrap_or(&edges[0]).0[which][axis]);
        Self {
            from: std::array::from_fn(|axis| end(0, axis)),
            to: std::array::from_fn(|axis| end(1, axis)),
            orientations: std::array::from_fn(|lane| edges.get(lane).map_or(0.0, |(_, orientation)| *orientation)),
        }
    }
}

/// In each lane.
struct Product {
    real: Lanes<f64>,
    imaginary: Lanes<f64>,
    /// Of the squared lengths of all factors.
    least: Lanes<f64>,
}

impl Product {
    /// To a length of one.
    #[inline(always)]
    fn shorten(&mut self) {
        for lane in 0..LANES {
            let length_sq = self.real[lane] * self.real[lane] + self.imaginary[lane] * self.imaginary[lane];
            let inv_length = 1.0 / length_sq.sqrt();
            self.real[lane] *= inv_length;
            self.imaginary[lane] *= inv_length;
        }
    }
}

struct Fraction<'a> {
    boundary_cone: &'a BoundaryCone,
    point: Vector3<f64>,
}

impl pulp::WithSimd for Fraction<'_> {
    type Output = Option<Estimate>;

    /// Half of the angle that a triangle fills is that of a complex number (as in [`super::solid_angle`]), and the sum of
    /// angles but for whole turns is that of the product.
    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Option<Estimate> {
        let Self { boundary_cone, point } = self;
        let apex: [f64; 3] = (boundary_cone.apex - point).into();
        let point: [f64; 3] = point.into();
        let mut product = Product { real: [1.0; LANES], imaginary: [0.0; LANES], least: [1.0; LANES] };
        for edges in boundary_cone.edges.chunks(PRODUCTS) {
            for edges in edges {
                edges.turn(apex, point, &mut product);
            }
            product.shorten();
        }
        let is_clear = product.least.iter().all(|clearness| *clearness > MIN_CONE_FACTOR_SQ);
        let least = product.least.iter().copied().fold(1.0, f64::min);
        let error = CONE_FACTOR_ROUNDING * (boundary_cone.edges.len() * LANES) as f64 / least.sqrt();
        let mut angles = 0.0;
        for lane in 0..LANES {
            angles += angle(product.imaginary[lane], product.real[lane]);
        }
        is_clear.then_some(Estimate { value: angles / (2.0 * PI), error })
    }
}

impl Edges {
    /// Multiplies by the complex number of each triangle, of a length from zero to four. Their
    /// squares are what [`MIN_CONE_FACTOR_SQ`] is of.
    #[inline(always)]
    fn turn(&self, apex: [f64; 3], point: [f64; 3], product: &mut Product) {
        let height = dot(apex, apex).sqrt();
        for lane in 0..LANES {
            let b = sub(lane_of(&self.from, lane), point);
            let c = sub(lane_of(&self.to, lane), point);
            let across = cross(b, c);
            let (to_b, to_c) = (dot(b, b).sqrt(), dot(c, c).sqrt());
            let all = height * to_b * to_c;
            let along = all + dot(apex, b) * to_c + dot(b, c) * height + dot(c, apex) * to_b;
            let per_all = 1.0 / all;
            let (x, y) = (along * per_all, self.orientations[lane] * dot(apex, across) * per_all);
            // At a corner it is no number.
            let clear = if all > 0.0 { x * x + y * y } else { 0.0 };
            let is_edge = self.orientations[lane] != 0.0;
            let clear = if is_edge { clear } else { 1.0 };
            let (x, y) = (if is_edge { x } else { 1.0 }, if is_edge { y } else { 0.0 });
            let (real, imaginary) = (product.real[lane], product.imaginary[lane]);
            product.least[lane] = if clear < product.least[lane] { clear } else { product.least[lane] };
            product.real[lane] = real * x - imaginary * y;
            product.imaginary[lane] = real * y + imaginary * x;
        }
    }
}
