//! Several numbers side by side, computed by vector instructions.
//!
//! Every operator is a loop over an array, which compilers vectorize. No intrinsics are used, so that the same source
//! serves all processors and `unsafe` is not needed.

use core::array::from_fn;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign};

use num_traits::{One, Zero};

use crate::number::{Float, Gather, Mask, Real};

/// `N` numbers side by side. Each lane has the same bits as the scalar computation.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(align(64))]
pub struct Lanes<T, const N: usize>(pub [T; N]);

/// One `bool` per lane: the result of comparing [`Lanes`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneMask<const N: usize>(pub [bool; N]);

impl<const N: usize> Mask for LaneMask<N> {
    const NONE: Self = Self([false; N]);
    #[inline(always)]
    fn any(self) -> bool {
        self.0.into_iter().fold(false, |any, lane| any | lane)
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> bool {
        self.0.get(lane).copied().unwrap_or(false)
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, yes: bool) {
        if let Some(slot) = self.0.get_mut(lane) {
            *slot = yes;
        }
    }
}

impl<const N: usize> BitAnd for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i] & other.0[i]))
    }
}

impl<const N: usize> BitOr for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i] | other.0[i]))
    }
}

impl<const N: usize> Not for LaneMask<N> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(from_fn(|i| !self.0[i]))
    }
}

macro_rules! operator {
    ($operator:ident, $method:ident, $assign:ident, $assign_method:ident) => {
        impl<T: Float, const N: usize> $operator for Lanes<T, N> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|i| self.0[i].$method(other.0[i])))
            }
        }

        impl<T: Float, const N: usize> $assign for Lanes<T, N> {
            #[inline(always)]
            fn $assign_method(&mut self, other: Self) {
                *self = $operator::$method(*self, other);
            }
        }
    };
}

operator!(Add, add, AddAssign, add_assign);
operator!(Sub, sub, SubAssign, sub_assign);
operator!(Mul, mul, MulAssign, mul_assign);
operator!(Div, div, DivAssign, div_assign);

impl<T: Float, const N: usize> Neg for Lanes<T, N> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(from_fn(|i| -self.0[i]))
    }
}

impl<T: Float, const N: usize> Zero for Lanes<T, N> {
    #[inline(always)]
    fn zero() -> Self {
        Self([T::zero(); N])
    }
    #[inline(always)]
    fn is_zero(&self) -> bool {
        self.0.iter().all(|lane| *lane == T::zero())
    }
}

impl<T: Float, const N: usize> One for Lanes<T, N> {
    #[inline(always)]
    fn one() -> Self {
        Self([T::one(); N])
    }
}

impl<T: Float, const N: usize> Real for Lanes<T, N> {
    type Mask = LaneMask<N>;
    type Lane = T;
    const LANES: usize = N;
    const EPSILON: f64 = T::EPSILON;
    const MAX_COORDINATE: f64 = T::MAX_COORDINATE;
    const LOST_LENGTH: f64 = T::LOST_LENGTH;

    #[inline(always)]
    fn from_f64(x: f64) -> Self {
        Self([T::from_f64(x); N])
    }
    #[inline(always)]
    fn from_parameter(parameter: crate::Parameter) -> Self {
        Self([T::from_parameter(parameter); N])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Self(from_fn(|i| Real::sqrt(self.0[i])))
    }
    #[inline(always)]
    fn trunc(self) -> Self {
        Self(from_fn(|i| Real::trunc(self.0[i])))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> LaneMask<N> {
        LaneMask(from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline(always)]
    fn le(self, other: Self) -> LaneMask<N> {
        LaneMask(from_fn(|i| self.0[i] <= other.0[i]))
    }
    #[inline(always)]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        Self(from_fn(|i| if mask.0[i] { yes.0[i] } else { no.0[i] }))
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> T {
        self.0.get(lane).copied().unwrap_or_else(T::zero)
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, value: T) {
        if let Some(slot) = self.0.get_mut(lane) {
            *slot = value;
        }
    }
    #[inline(always)]
    fn gather<G: Gather>(cell: [Self; 3], table: &G) -> [Self; 8] {
        table.gather_lanes(cell.map(|axis| axis.0)).map(Self)
    }
}
