//! Lines in the plane of a face: on which side of one do two others meet? Exactly.
//!
//! Each line is the intersection of the face's plane A with another plane through three points of f64. With normals n,
//! x·n = d, all points relative to a corner of the face, and u = n_A × n the line's direction, lines P and Q meet at
//!
//! ```text
//! x = (d_Q u_P − d_P u_Q) / D_PQ,   D_XY = n_Y·u_X,   so   n_R·x − d_R = (d_Q D_PR − d_P D_QR − d_R D_PQ) / D_PQ.
//! ```
//!
//! Signs are taken in intervals of f64, and where those contain zero, in whole numbers of any length: all coordinates are
//! multiples of one power of two (an implicit point as in Attene 2020, "Indirect predicates for geometric constructions").

use std::array::from_fn;
use std::cell::OnceCell;
use std::ops::{Add, Mul, Neg, Sub};

use num_bigint::BigInt;
use sdf_core::nalgebra::Vector3;

/// Sides: −1, 0 or 1.
pub(super) type Side = i32;

/// Bits of a quotient after the point of the smallest coordinate's last bit.
const QUOTIENT_BITS: i32 = 80;

/// Width of an interval that is narrow enough to be rounded to its middle, relative to the largest coordinate.
const NARROW: f64 = 2.0 * f64::EPSILON;

/// All lines of one face.
pub(super) struct Lines {
    /// Three points of the plane of each line.
    pub planes: Vec<[Vector3<f64>; 3]>,
    pub face: [Vector3<f64>; 3],
    near: Vec<Line<Enclosed>>,
    exact: Vec<OnceCell<Line<BigInt>>>,
    exact_normal: OnceCell<[BigInt; 3]>,
    /// All coordinates are multiples of 2 to this power.
    unit: i32,
    /// Largest coordinate of the face.
    max_coordinate: f64,
}

/// A line by a plane through it, relative to the face's first corner.
struct Line<T> {
    normal: [T; 3],
    offset: T,
    direction: [T; 3],
}

trait Number: Clone + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}

impl<T: Clone + Add<Output = T> + Sub<Output = T> + Mul<Output = T>> Number for T {}

impl Lines {
    pub fn new(face: [Vector3<f64>; 3], planes: Vec<[Vector3<f64>; 3]>) -> Self {
        let near_normal = normal(&face.map(|corner| relative(corner, face[0])));
        let near = planes.iter().map(|plane| Line::new(&near_normal, plane.map(|point| relative(point, face[0]))));
        let near = near.collect();
        let points = planes.iter().chain([&face]).flatten();
        let unit = points.flat_map(|point| point.iter()).map(|x| last_bit(*x)).min().unwrap_or(0);
        let exact = planes.iter().map(|_| OnceCell::new()).collect();
        let max_coordinate = face.iter().map(|corner| corner.amax()).fold(0.0, f64::max);
        Self { planes, face, near, exact, exact_normal: OnceCell::new(), unit, max_coordinate }
    }

    /// Side of line `r` on which `p` and `q` meet, positive where its plane's normal points. The two are not parallel.
    pub fn side(&self, p: usize, q: usize, r: usize) -> Side {
        if r == p || r == q {
            return 0;
        }
        let [numerator, denominator] = fraction(&self.near[p], &self.near[q], &self.near[r]);
        match (numerator.sign(), denominator.sign()) {
            (Some(above), Some(below)) => above * below,
            _ => {
                let [numerator, denominator] = fraction(self.exact(p), self.exact(q), self.exact(r));
                sign(&numerator) * sign(&denominator)
            }
        }
    }

    /// Point where two lines meet, each coordinate off by at most 4 ε of the face's largest.
    pub fn meeting_point(&self, p: usize, q: usize) -> Vector3<f64> {
        let [low, high] =
            [Vector3::inf, Vector3::sup].map(|pick| pick(&pick(&self.face[0], &self.face[1]), &self.face[2]));
        let [first, second] = [&self.near[p], &self.near[q]];
        let divisor = determinant(first, second);
        let near: [Enclosed; 3] = from_fn(|axis| meeting_numerator(first, second, axis).over(divisor));
        let is_narrow = |x: &Enclosed| x.upper - x.lower <= NARROW * self.max_coordinate;
        let offset = if near.iter().all(is_narrow) {
            Vector3::from(near.map(|x| 0.5 * x.lower + 0.5 * x.upper))
        } else {
            let [first, second] = [self.exact(p), self.exact(q)];
            let divisor = determinant(first, second);
            Vector3::from_fn(|axis, _| {
                let quotient = (meeting_numerator(first, second, axis) << QUOTIENT_BITS) / &divisor;
                to_f64(&quotient, self.unit - QUOTIENT_BITS)
            })
        };
        // The point lies in the face's box, and so it shall.
        (self.face[0] + offset).sup(&low).inf(&high)
    }

    fn exact(&self, line: usize) -> &Line<BigInt> {
        self.exact[line].get_or_init(|| {
            let normal_of_face = self.exact_normal.get_or_init(|| normal(&self.face.map(|corner| self.whole(corner))));
            Line::new(normal_of_face, self.planes[line].map(|point| self.whole(point)))
        })
    }

    /// A point relative to the face's first corner, in units.
    fn whole(&self, point: Vector3<f64>) -> [BigInt; 3] {
        from_fn(|axis| in_units(point[axis], self.unit) - in_units(self.face[0][axis], self.unit))
    }
}

impl<T: Number> Line<T> {
    fn new(normal_of_face: &[T; 3], points: [[T; 3]; 3]) -> Self {
        let normal = normal(&points);
        Self { offset: dot(&normal, &points[0]), direction: cross(normal_of_face, &normal), normal }
    }
}

/// D_PQ.
fn determinant<T: Number>(p: &Line<T>, q: &Line<T>) -> T {
    dot(&q.normal, &p.direction)
}

fn fraction<T: Number>(p: &Line<T>, q: &Line<T>, r: &Line<T>) -> [T; 2] {
    let between = determinant(p, q);
    let numerator = q.offset.clone() * determinant(p, r)
        - p.offset.clone() * determinant(q, r)
        - r.offset.clone() * between.clone();
    [numerator, between]
}

fn meeting_numerator<T: Number>(p: &Line<T>, q: &Line<T>, axis: usize) -> T {
    q.offset.clone() * p.direction[axis].clone() - p.offset.clone() * q.direction[axis].clone()
}

fn normal<T: Number>([a, b, c]: &[[T; 3]; 3]) -> [T; 3] {
    let [u, v] = [b, c].map(|corner| from_fn(|axis| corner[axis].clone() - a[axis].clone()));
    cross(&u, &v)
}

fn cross<T: Number>(a: &[T; 3], b: &[T; 3]) -> [T; 3] {
    from_fn(|axis| {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        a[next].clone() * b[last].clone() - a[last].clone() * b[next].clone()
    })
}

fn dot<T: Number>(a: &[T; 3], b: &[T; 3]) -> T {
    let product = |axis: usize| a[axis].clone() * b[axis].clone();
    product(0) + product(1) + product(2)
}

/// An interval that holds the exact value.
#[derive(Clone, Copy)]
struct Enclosed {
    lower: f64,
    upper: f64,
}

impl Enclosed {
    /// Around a result that was rounded to nearest.
    fn rounded(lower: f64, upper: f64) -> Self {
        Self { lower: lower.next_down(), upper: upper.next_up() }
    }

    fn is_zero(self) -> bool {
        self.lower == 0.0 && self.upper == 0.0
    }

    fn sign(self) -> Option<Side> {
        match self {
            Self { lower, .. } if lower > 0.0 => Some(1),
            Self { upper, .. } if upper < 0.0 => Some(-1),
            zero if zero.is_zero() => Some(0),
            _ => None,
        }
    }

    /// The quotient; everything if the divisor may be zero.
    fn over(self, divisor: Self) -> Self {
        match divisor.sign() {
            Some(side) if side != 0 => self * Self::rounded(1.0 / divisor.upper, 1.0 / divisor.lower),
            _ => Self { lower: f64::NEG_INFINITY, upper: f64::INFINITY },
        }
    }
}

impl Neg for Enclosed {
    type Output = Self;

    fn neg(self) -> Self {
        Self { lower: -self.upper, upper: -self.lower }
    }
}

impl Add for Enclosed {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        match (self.is_zero(), other.is_zero()) {
            (true, _) => other,
            (_, true) => self,
            _ => Self::rounded(self.lower + other.lower, self.upper + other.upper),
        }
    }
}

impl Sub for Enclosed {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Enclosed {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        if self.is_zero() || other.is_zero() {
            return Self { lower: 0.0, upper: 0.0 };
        }
        let products =
            [self.lower * other.lower, self.lower * other.upper, self.upper * other.lower, self.upper * other.upper];
        let lower = products.into_iter().fold(f64::INFINITY, f64::min);
        Self::rounded(lower, products.into_iter().fold(f64::NEG_INFINITY, f64::max))
    }
}

/// A point relative to another; a difference of zero is exact.
fn relative(point: Vector3<f64>, origin: Vector3<f64>) -> [Enclosed; 3] {
    from_fn(|axis| match point[axis] - origin[axis] {
        0.0 => Enclosed { lower: 0.0, upper: 0.0 },
        x => Enclosed::rounded(x, x),
    })
}

/// Exponent of the lowest bit that is set; large for zero.
fn last_bit(x: f64) -> i32 {
    let (significand, exponent) = parts(x);
    if significand == 0 { i32::MAX } else { exponent + significand.trailing_zeros() as i32 }
}

/// A number as significand times a power of two.
fn parts(x: f64) -> (i64, i32) {
    let bits = x.to_bits();
    let (fraction, exponent) = ((bits & ((1 << 52) - 1)) as i64, (bits >> 52 & 0x7ff) as i32);
    let (magnitude, exponent) = if exponent == 0 { (fraction, -1074) } else { (fraction | 1 << 52, exponent - 1075) };
    (if x < 0.0 { -magnitude } else { magnitude }, exponent)
}

fn in_units(x: f64, unit: i32) -> BigInt {
    let (significand, exponent) = parts(x);
    if significand == 0 {
        return BigInt::ZERO;
    }
    // The unit can stand above the significand's last bits only if those are zero.
    let shift = exponent - unit;
    if shift >= 0 { BigInt::from(significand) << shift } else { BigInt::from(significand >> -shift) }
}

fn sign(x: &BigInt) -> Side {
    match x.sign() {
        num_bigint::Sign::Minus => -1,
        num_bigint::Sign::NoSign => 0,
        num_bigint::Sign::Plus => 1,
    }
}

/// A whole number times a power of two, of its first 64 bits.
fn to_f64(x: &BigInt, exponent: i32) -> f64 {
    let excess = x.bits().saturating_sub(64);
    let leading = (x.magnitude() >> excess).iter_u64_digits().next().unwrap_or(0) as f64;
    let exponent = exponent + excess as i32;
    // In two steps: one power alone may be out of range though the product is not.
    let [half, rest] = [exponent / 2, exponent - exponent / 2].map(|power| 2.0_f64.powi(power));
    f64::from(sign(x)) * leading * half * rest
}

#[cfg(test)]
mod tests;
