use core::array::from_fn;
use core::ops::{Add, AddAssign, BitAnd, BitOr, Div, DivAssign, Mul, MulAssign, Neg, Not, Sub, SubAssign};

use num_traits::{One, Zero};

use crate::real::{Float, Mask, Real};

/// `N` numbers side by side, each as if alone: lane for lane the same bits as the scalar.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lanes<T, const N: usize>(pub [T; N]);

/// One answer for each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneMask<const N: usize>(pub [bool; N]);

impl<const N: usize> Mask for LaneMask<N> {
    const NONE: Self = Self([false; N]);
    #[inline]
    fn any(self) -> bool {
        self.0.into_iter().any(|lane| lane)
    }
    #[inline]
    fn set_lane(&mut self, lane: usize, yes: bool) {
        if let Some(slot) = self.0.get_mut(lane) {
            *slot = yes;
        }
    }
}

impl<const N: usize> BitAnd for LaneMask<N> {
    type Output = Self;
    #[inline]
    fn bitand(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i] & other.0[i]))
    }
}

impl<const N: usize> BitOr for LaneMask<N> {
    type Output = Self;
    #[inline]
    fn bitor(self, other: Self) -> Self {
        Self(from_fn(|i| self.0[i] | other.0[i]))
    }
}

impl<const N: usize> Not for LaneMask<N> {
    type Output = Self;
    #[inline]
    fn not(self) -> Self {
        Self(self.0.map(|lane| !lane))
    }
}

macro_rules! operator {
    ($operator:ident, $method:ident, $assign:ident, $assign_method:ident) => {
        impl<T: Float, const N: usize> $operator for Lanes<T, N> {
            type Output = Self;
            #[inline]
            fn $method(self, other: Self) -> Self {
                Self(from_fn(|i| self.0[i].$method(other.0[i])))
            }
        }

        impl<T: Float, const N: usize> $assign for Lanes<T, N> {
            #[inline]
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
    #[inline]
    fn neg(self) -> Self {
        Self(self.0.map(|lane| -lane))
    }
}

impl<T: Float, const N: usize> Zero for Lanes<T, N> {
    #[inline]
    fn zero() -> Self {
        Self([T::zero(); N])
    }
    #[inline]
    fn is_zero(&self) -> bool {
        self.0.iter().all(|lane| *lane == T::zero())
    }
}

impl<T: Float, const N: usize> One for Lanes<T, N> {
    #[inline]
    fn one() -> Self {
        Self([T::one(); N])
    }
}

impl<T: Float, const N: usize> Real for Lanes<T, N> {
    type Mask = LaneMask<N>;
    type Lane = T;
    const LANES: usize = N;
    const EPSILON: f64 = T::EPSILON;
    const REACH: f64 = T::REACH;

    #[inline]
    fn lift(x: f64) -> Self {
        Self([T::lift(x); N])
    }
    #[inline]
    fn sqrt(self) -> Self {
        Self(self.0.map(Real::sqrt))
    }
    #[inline]
    fn trunc(self) -> Self {
        Self(self.0.map(Real::trunc))
    }
    #[inline]
    fn lt(self, other: Self) -> LaneMask<N> {
        LaneMask(from_fn(|i| self.0[i] < other.0[i]))
    }
    #[inline]
    fn le(self, other: Self) -> LaneMask<N> {
        LaneMask(from_fn(|i| self.0[i] <= other.0[i]))
    }
    #[inline]
    fn select(mask: LaneMask<N>, yes: Self, no: Self) -> Self {
        Self(from_fn(|i| if mask.0[i] { yes.0[i] } else { no.0[i] }))
    }
    #[inline]
    fn lane(self, lane: usize) -> T {
        self.0.get(lane).copied().unwrap_or_else(T::zero)
    }
    #[inline]
    fn set_lane(&mut self, lane: usize, value: T) {
        if let Some(slot) = self.0.get_mut(lane) {
            *slot = value;
        }
    }
    #[inline]
    fn gather<const K: usize>(at: [Self; 3], mut fetch: impl FnMut([u32; 3]) -> [f32; K]) -> [Self; K] {
        let mut gathered = [Self::zero(); K];
        for lane in 0..N {
            let values = T::gather(at.map(|axis| axis.0[lane]), &mut fetch);
            for (slot, value) in gathered.iter_mut().zip(values) {
                slot.0[lane] = value;
            }
        }
        gathered
    }
}
