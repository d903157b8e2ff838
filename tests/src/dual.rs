//! Forward-mode dual numbers (Griewank and Walther 2008, ch. 3): the oracle for gradients written by hand.
//!
//! `a + b·ε` with ε² = 0: every operation carries the derivatives of its result by the chain rule.

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use nalgebra::Vector3;
use num_traits::{One, Zero};
use sdf_core::{Float, Gather, Real};

/// A number and its derivatives by x, y and z. Comparisons use the value alone, so the derivative belongs to the branch
/// that was taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dual<T> {
    pub value: T,
    pub gradient: [T; 3],
}

impl<T: Float> Dual<T> {
    pub fn constant(value: T) -> Self {
        Self { value, gradient: [T::zero(); 3] }
    }

    /// A point whose coordinates are the variables: ∂x/∂x = 1, ∂x/∂y = 0, …
    pub fn variables(point: Vector3<T>) -> Vector3<Self> {
        Vector3::from_fn(|axis, _| Self {
            value: point[axis],
            gradient: std::array::from_fn(|k| if k == axis { T::one() } else { T::zero() }),
        })
    }

    /// Chain rule for a function f(a, b): f′ = ∂f/∂a · a′ + ∂f/∂b · b′.
    fn chain(value: T, [df_da, df_db]: [T; 2], a: Self, b: Self) -> Self {
        Self { value, gradient: std::array::from_fn(|k| df_da * a.gradient[k] + df_db * b.gradient[k]) }
    }
}

macro_rules! operator {
    ($operator:ident, $method:ident, $assign:ident, $assign_method:ident, |$a:ident, $b:ident| $derivatives:expr) => {
        impl<T: Float> $operator for Dual<T> {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                let ($a, $b) = (self.value, other.value);
                Self::chain($a.$method($b), $derivatives, self, other)
            }
        }

        impl<T: Float> $assign for Dual<T> {
            fn $assign_method(&mut self, other: Self) {
                *self = $operator::$method(*self, other);
            }
        }
    };
}

operator!(Add, add, AddAssign, add_assign, |_a, _b| [T::one(), T::one()]);
operator!(Sub, sub, SubAssign, sub_assign, |_a, _b| [T::one(), -T::one()]);
operator!(Mul, mul, MulAssign, mul_assign, |a, b| [b, a]);
operator!(Div, div, DivAssign, div_assign, |a, b| [T::one() / b, -a / (b * b)]);

impl<T: Float> Neg for Dual<T> {
    type Output = Self;
    fn neg(self) -> Self {
        Self { value: -self.value, gradient: self.gradient.map(|slope| -slope) }
    }
}

impl<T: Float> Zero for Dual<T> {
    fn zero() -> Self {
        Self::constant(T::zero())
    }
    fn is_zero(&self) -> bool {
        self.value == T::zero()
    }
}

impl<T: Float> One for Dual<T> {
    fn one() -> Self {
        Self::constant(T::one())
    }
}

impl<T: Float> Real for Dual<T> {
    type Mask = bool;
    type Lane = T;
    const LANES: usize = 1;
    const EPSILON: f64 = T::EPSILON;
    const MAX_COORDINATE: f64 = T::MAX_COORDINATE;
    const LOST_LENGTH: f64 = T::LOST_LENGTH;

    fn from_f64(x: f64) -> Self {
        Self::constant(T::from_f64(x))
    }
    fn sqrt(self) -> Self {
        let root = Real::sqrt(self.value);
        Self { value: root, gradient: self.gradient.map(|slope| slope / (root + root)) }
    }
    fn trunc(self) -> Self {
        Self::constant(Real::trunc(self.value))
    }
    fn lt(self, other: Self) -> bool {
        self.value < other.value
    }
    fn le(self, other: Self) -> bool {
        self.value <= other.value
    }
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    fn lane(&self, _lane: usize) -> T {
        self.value
    }
    fn set_lane(&mut self, _lane: usize, value: T) {
        *self = Self::constant(value);
    }
    fn gather<G: Gather>(cell: [Self; 3], table: &G) -> [Self; 8] {
        T::gather(cell.map(|along| along.value), table).map(Self::constant)
    }
}
