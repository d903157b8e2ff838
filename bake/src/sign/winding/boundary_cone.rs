use std::f64::consts::PI;

use sdf_core::nalgebra::Vector3;

use super::Estimate;
use super::sum::angle;
use crate::triangle::nearest_x8::{dot, minus};

/// Triangles from one point to each edge of a rim: a surface with the same rim.
pub(super) struct BoundaryCone {
    /// Where all triangles meet.
    apex: Vector3<f64>,
    edges: Vec<Edges>,
}

/// Edges side by side.
const LANES: usize = 8;

type Lanes = [f64; LANES];

struct Edges {
    from: [Lanes; 3],
    to: [Lanes; 3],
    /// Zero where there is no edge.
    orientations: Lanes,
}

/// How far a point is at least from being on an edge of a triangle. With α, β, γ the angles between the ways to its corners it
/// is 2 (1 + cos α) (1 + cos β) (1 + cos γ), which is zero where two corners lie opposite. At least a millionth of an edge away,
/// the angles have ten digits.
const MIN_CLEARNESS: f64 = 1e-12;

/// More than the rounding of a triangle's complex number, of length one at least where the point is not near an edge.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// After so many products of numbers from [`MIN_CLEARNESS`] to 16, squared, there is still room for more.
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
    real: Lanes,
    imaginary: Lanes,
    /// Of the squared lengths of all factors.
    least: Lanes,
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
        let is_clear = product.least.iter().all(|clearness| *clearness > MIN_CLEARNESS);
        let least = product.least.iter().copied().fold(1.0, f64::min);
        let error = ROUNDING * (boundary_cone.edges.len() * LANES) as f64 / least.sqrt();
        let mut angles = 0.0;
        for lane in 0..LANES {
            angles += angle(product.imaginary[lane], product.real[lane]);
        }
        is_clear.then_some(Estimate { value: angles / (2.0 * PI), error })
    }
}

impl Edges {
    /// Multiplies by the complex number of each triangle, of a length from zero to four. Their
    /// squares are what [`MIN_CLEARNESS`] is of.
    #[inline(always)]
    fn turn(&self, apex: [f64; 3], point: [f64; 3], product: &mut Product) {
        let height = dot(apex, apex).sqrt();
        for lane in 0..LANES {
            let b = minus([self.from[0][lane], self.from[1][lane], self.from[2][lane]], point);
            let c = minus([self.to[0][lane], self.to[1][lane], self.to[2][lane]], point);
            let across = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
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
