//! The number a query is asked in.
//!
//! A field stores plain floats and is written once, over [`Real`]. Asked in `f32` or `f64` it answers one point, in
//! [`Lanes`](crate::Lanes) several side by side, in a dual number its derivative. So that lanes can take both sides of a
//! condition, generic code chooses with [`Real::select`] and not with `if`.

pub mod interval;
pub mod kernel;
pub mod lanes;

use core::ops::{BitAnd, BitOr, Neg, Not};

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, Scalar};
use num_traits::{One, Zero};

/// What a comparison of two [`Real`]s answers: `bool`, or one for each lane.
pub trait Mask:
    Copy + core::fmt::Debug + PartialEq + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> + 'static
{
    const NONE: Self;
    fn any(self) -> bool;
    /// `lane` counts those of the number.
    fn lane(&self, lane: usize) -> bool;
    /// `lane` counts those of the number.
    fn set_lane(&mut self, lane: usize, yes: bool);
}

impl Mask for bool {
    const NONE: Self = false;
    #[inline(always)]
    fn any(self) -> bool {
        self
    }
    #[inline(always)]
    fn lane(&self, _lane: usize) -> bool {
        *self
    }
    #[inline(always)]
    fn set_lane(&mut self, _lane: usize, yes: bool) {
        *self = yes;
    }
}

/// A number: `f32`, `f64`, several lanes of one, or a dual number.
pub trait Real:
    Scalar + Copy + Zero + One + ClosedAddAssign + ClosedSubAssign + ClosedMulAssign + ClosedDivAssign + Neg<Output = Self>
{
    type Mask: Mask;

    /// What stands in one lane: the number itself where it has but one.
    type Lane: Float;

    const LANES: usize;

    /// The distance from 1 to the next larger number.
    const EPSILON: f64;

    /// The largest coordinate that a field is asked at: sums of its squares stay finite. Lengths below its reciprocal
    /// count as zero where a direction is wanted: their squares have lost digits.
    const MAX_COORDINATE: f64;

    /// The nearest number to a constant or a parameter of a field.
    fn from_f64(x: f64) -> Self;

    fn sqrt(self) -> Self;

    /// Towards zero, for self < 2³¹; zero below zero.
    fn trunc(self) -> Self;

    fn lt(self, other: Self) -> Self::Mask;

    fn le(self, other: Self) -> Self::Mask;

    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// `lane` is below [`Self::LANES`].
    fn lane(&self, lane: usize) -> Self::Lane;

    fn set_lane(&mut self, lane: usize, value: Self::Lane);

    /// The eight numbers that `table` holds for each lane's cell, three whole numbers in 0 ≤ cell < 2³¹.
    fn gather<G: Gather>(cell: [Self; 3], table: &G) -> [Self; 8];

    #[inline(always)]
    fn abs(self) -> Self {
        Self::select(self.lt(Self::zero()), -self, self)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(other.lt(self), other, self)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.lt(other), other, self)
    }

    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    /// −1 below zero, else 1.
    #[inline(always)]
    fn sign(self) -> Self {
        Self::select(self.lt(Self::zero()), -Self::one(), Self::one())
    }

    #[inline(always)]
    fn is_zero(self) -> Self::Mask {
        self.le(Self::zero()) & Self::zero().le(self)
    }

    /// A length below the reciprocal of [`Self::MAX_COORDINATE`].
    #[inline(always)]
    fn is_negligible(self) -> Self::Mask {
        self.lt(Self::from_f64(1.0 / Self::MAX_COORDINATE))
    }

    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        Real::is_zero(self * Self::zero())
    }

    /// Within ±[`Self::MAX_COORDINATE`], which NaN and the infinities are not.
    #[inline(always)]
    fn is_representable(self) -> Self::Mask {
        self.abs().le(Self::from_f64(Self::MAX_COORDINATE))
    }
}

/// A number with one lane, which can branch and leave the query.
pub trait Float: Real<Mask = bool, Lane = Self> + PartialOrd {
    fn to_f64(self) -> f64;

    /// The whole number that it is, for 0 ≤ self < 2³¹.
    fn to_index(self) -> u32;

    /// The nearest number to a stored one.
    fn from_stored(stored: f32) -> Self;
}

/// A table with eight stored numbers for each cell of a lattice.
pub trait Gather {
    fn gather_one(&self, cell: [u32; 3]) -> [f32; 8];

    /// The same for `N` cells, whose indices are given axis by axis as whole numbers.
    fn gather_lanes<T: Float, const N: usize>(&self, cells: [[T; N]; 3]) -> [[T; N]; 8];
}

macro_rules! float {
    ($float:ident, $sqrt:path, $trunc:ident, $reach:literal) => {
        impl Real for $float {
            type Mask = bool;
            type Lane = Self;
            const LANES: usize = 1;
            const EPSILON: f64 = $float::EPSILON as f64;
            const MAX_COORDINATE: f64 = $reach;

            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $float
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $sqrt(self)
            }
            #[inline(always)]
            fn trunc(self) -> Self {
                whole::$trunc(self)
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn le(self, other: Self) -> bool {
                self <= other
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
            #[inline(always)]
            fn lane(&self, _lane: usize) -> Self {
                *self
            }
            #[inline(always)]
            fn set_lane(&mut self, _lane: usize, value: Self) {
                *self = value;
            }
            #[inline(always)]
            fn gather<G: Gather>([x, y, z]: [Self; 3], table: &G) -> [Self; 8] {
                table.gather_one([x as u32, y as u32, z as u32]).map(Self::from_stored)
            }
        }

        impl Float for $float {
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn to_index(self) -> u32 {
                (f64::from(self) + AT_ONES).to_bits() as u32
            }
            #[inline(always)]
            fn from_stored(stored: f32) -> Self {
                stored as $float
            }
        }
    };
}

float!(f32, roots::sqrtf, truncf, 1e18);
float!(f64, roots::sqrt, trunc, 1e150);

#[cfg(feature = "std")]
mod roots {
    #[inline(always)]
    pub fn sqrtf(x: f32) -> f32 {
        x.sqrt()
    }
    #[inline(always)]
    pub fn sqrt(x: f64) -> f64 {
        x.sqrt()
    }
}

#[cfg(all(feature = "core-math", not(feature = "std")))]
mod roots {
    pub use core::f32::math::sqrt as sqrtf;
    pub use core::f64::math::sqrt;
}

#[cfg(not(any(feature = "core-math", feature = "std")))]
use libm as roots;

/// By conversions, which are instructions everywhere, but saturate, and no vector unit does that.
#[cfg(not(feature = "std"))]
mod whole {
    #[inline(always)]
    pub fn truncf(x: f32) -> f32 {
        x as u32 as f32
    }
    #[inline(always)]
    pub fn trunc(x: f64) -> f64 {
        x as u32 as f64
    }
}

/// By sums alone, which vector units have, and without a choice that could become a branch.
#[cfg(feature = "std")]
mod whole {
    #[inline(always)]
    pub fn truncf(x: f32) -> f32 {
        let nearest = (x + AT_ONES_F32) - AT_ONES_F32;
        let whole = nearest - if x < nearest { 1.0 } else { 0.0 };
        // Beyond 2 to the number of digits a float is a whole number.
        let whole = if x < AT_ONES_F32 { whole } else { x };
        if 0.0 < whole { whole } else { 0.0 }
    }
    #[inline(always)]
    pub fn trunc(x: f64) -> f64 {
        let nearest = (x + super::AT_ONES) - super::AT_ONES;
        let whole = nearest - if x < nearest { 1.0 } else { 0.0 };
        if 0.0 < whole { whole } else { 0.0 }
    }

    const AT_ONES_F32: f32 = 8_388_608.0;
}

/// 2⁵²: added to a smaller number, it leaves the last digit that of ones.
const AT_ONES: f64 = 4_503_599_627_370_496.0;
