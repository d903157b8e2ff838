//! A number type of a user's own, [`OwnNumber`]: generic code must take more types than `f32`, `f64` and lanes of them.

use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};

use num_traits::{One, Zero};
use sdf_core::{Float, Gather, Real};

/// An `f64` in all but its type.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub struct OwnNumber(pub f64);

macro_rules! operator {
    ($operator:ident, $method:ident, $assign:ident, $assign_method:ident) => {
        impl $operator for OwnNumber {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }

        impl $assign for OwnNumber {
            fn $assign_method(&mut self, other: Self) {
                self.0.$assign_method(other.0);
            }
        }
    };
}

operator!(Add, add, AddAssign, add_assign);
operator!(Sub, sub, SubAssign, sub_assign);
operator!(Mul, mul, MulAssign, mul_assign);
operator!(Div, div, DivAssign, div_assign);

impl Neg for OwnNumber {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Zero for OwnNumber {
    fn zero() -> Self {
        Self(0.0)
    }
    fn is_zero(&self) -> bool {
        self.0 == 0.0
    }
}

impl One for OwnNumber {
    fn one() -> Self {
        Self(1.0)
    }
}

impl Real for OwnNumber {
    type Mask = bool;
    type Lane = Self;
    const LANES: usize = 1;
    const EPSILON: f64 = f64::EPSILON;
    const MAX_COORDINATE: f64 = f64::MAX_COORDINATE;
    const LOST_LENGTH: f64 = f64::LOST_LENGTH;

    fn from_f64(x: f64) -> Self {
        Self(x)
    }
    fn sqrt(self) -> Self {
        Self(Real::sqrt(self.0))
    }
    fn trunc(self) -> Self {
        Self(Real::trunc(self.0))
    }
    fn lt(self, other: Self) -> bool {
        self < other
    }
    fn le(self, other: Self) -> bool {
        self <= other
    }
    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }
    fn lane(&self, _lane: usize) -> Self {
        *self
    }
    fn set_lane(&mut self, _lane: usize, value: Self) {
        *self = value;
    }
    fn gather<G: Gather>(cell: [Self; 3], table: &G) -> [Self; 8] {
        f64::gather(cell.map(|along| along.0), table).map(Self)
    }
}

impl Float for OwnNumber {
    fn to_f64(self) -> f64 {
        self.0
    }
    fn to_single(self) -> f32 {
        self.0.to_single()
    }
    fn to_index(self) -> u32 {
        self.0.to_index()
    }
    fn to_count(self) -> u32 {
        self.0.to_count()
    }
    fn from_stored(stored: f32) -> Self {
        Self(f64::from_stored(stored))
    }
}
