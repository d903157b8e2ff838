//! The number types that fields are written over.
//!
//! A field is written once, over [`Real`]. In `f32` or `f64` it evaluates one point, in [`Lanes`](crate::Lanes)
//! several side by side, in a dual number it also yields derivatives.
//!
//! - Lanes may need both sides of a condition. Generic code therefore chooses with [`Real::select`] and not with `if`.
//! - [`Float`] is a number with one lane. Searches use it: they branch on values.
//! - A formula of many operators is a [`LaneKernel`](crate::LaneKernel), so that lanes run it in one loop: see
//!   `kernel`.

mod backend;
pub mod interval;
pub mod kernel;
pub mod lanes;

use core::ops::{BitAnd, BitOr, Neg, Not};

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, Scalar};
use num_traits::{One, Zero};

/// Result of a comparison of two [`Real`]s: `bool`, or one `bool` per lane.
pub trait Mask:
    Copy + core::fmt::Debug + PartialEq + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> + 'static
{
    /// `false` in every lane.
    const NONE: Self;
    /// Is it `true` in some lane?
    fn any(self) -> bool;
    /// The value in a lane. `lane` is below [`Real::LANES`].
    fn lane(&self, lane: usize) -> bool;
    /// Sets the value in a lane. `lane` is below [`Real::LANES`].
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
    /// Result of a comparison.
    type Mask: Mask;

    /// Number in one lane: the type itself if it has only one.
    type Lane: Float;

    /// Number of lanes.
    const LANES: usize;

    /// Distance from 1 to the next larger number.
    const EPSILON: f64;

    /// Largest coordinate at which a field is evaluated: sums of squares stay finite. Lengths below its reciprocal
    /// count as zero where a direction is needed, because their squares have lost digits.
    const MAX_COORDINATE: f64;

    /// Most that a length is above the root of the sum of its squares, as computed: each square loses up to half of the smallest number.
    const LOST_LENGTH: f64;

    /// Nearest number to a constant or a parameter of a field.
    fn from_f64(x: f64) -> Self;

    /// The same for a number that is known in both precisions: no conversion.
    #[inline(always)]
    fn from_parameter(parameter: Parameter) -> Self {
        Self::from_f64(parameter.double)
    }

    /// √self; NaN below zero.
    fn sqrt(self) -> Self;

    /// Integer part, for self < 2³¹; 0 below zero.
    fn trunc(self) -> Self;

    /// self < other.
    fn lt(self, other: Self) -> Self::Mask;

    /// self ≤ other.
    fn le(self, other: Self) -> Self::Mask;

    /// `yes` where the mask is true, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// The number in a lane. `lane` is below [`Self::LANES`].
    fn lane(&self, lane: usize) -> Self::Lane;

    /// Sets the number in a lane. `lane` is below [`Self::LANES`].
    fn set_lane(&mut self, lane: usize, value: Self::Lane);

    /// The eight numbers of each lane's cell. Cells are three integers in 0 ≤ cell < 2³¹.
    fn gather<G: Gather>(cell: [Self; 3], table: &G) -> [Self; 8];

    /// |self|.
    #[inline(always)]
    fn abs(self) -> Self {
        Self::select(self.lt(Self::zero()), -self, self)
    }

    /// The smaller number; self if one is NaN.
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(other.lt(self), other, self)
    }

    /// The larger number; self if one is NaN.
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.lt(other), other, self)
    }

    /// The nearest number in \[low, high\].
    #[inline(always)]
    fn clamp(self, low: Self, high: Self) -> Self {
        self.max(low).min(high)
    }

    /// The smaller of two numbers. If one is NaN, either: some processors then have one instruction for it.
    #[inline(always)]
    fn min_number(self, other: Self) -> Self {
        self.min(other)
    }

    /// The larger of two numbers; as [`min_number`](Self::min_number).
    #[inline(always)]
    fn max_number(self, other: Self) -> Self {
        self.max(other)
    }

    /// −1 below zero, else 1.
    #[inline(always)]
    fn sign(self) -> Self {
        Self::select(self.lt(Self::zero()), -Self::one(), Self::one())
    }

    /// Is it 0 or −0?
    #[inline(always)]
    fn is_zero(self) -> Self::Mask {
        self.le(Self::zero()) & Self::zero().le(self)
    }

    /// Is this length below the reciprocal of [`Self::MAX_COORDINATE`]?
    #[inline(always)]
    fn is_negligible(self) -> Self::Mask {
        self.lt(Self::from_f64(1.0 / Self::MAX_COORDINATE))
    }

    /// Is it neither NaN nor infinite?
    #[inline(always)]
    fn is_finite(self) -> Self::Mask {
        Real::is_zero(self * Self::zero())
    }

    /// Is it within ±[`Self::MAX_COORDINATE`]? NaN and infinities are not.
    #[inline(always)]
    fn is_representable(self) -> Self::Mask {
        self.abs().le(Self::from_f64(Self::MAX_COORDINATE))
    }
}

/// A number that a field is made of, in both precisions. A processor without doubles would convert it in software at every point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameter {
    /// The number.
    pub double: f64,
    /// The nearest f32.
    pub single: f32,
}

impl From<f64> for Parameter {
    #[inline(always)]
    fn from(x: f64) -> Self {
        Self { double: x, single: x as f32 }
    }
}

/// A number with one lane: comparisons are `bool`, so code can branch on them.
pub trait Float: Real<Mask = bool, Lane = Self> + PartialOrd {
    /// The same number as f64.
    fn to_f64(self) -> f64;

    /// The nearest f32.
    fn to_single(self) -> f32;

    /// Conversion of an integer in 0 ≤ self < 2³¹.
    fn to_index(self) -> u32;

    /// Integer part as an integer: 0 below zero, at most `u32::MAX`.
    fn to_count(self) -> u32;

    /// Nearest number to a stored sample.
    fn from_stored(stored: f32) -> Self;
}

/// A table of eight stored numbers per cell of a lattice.
pub trait Gather {
    /// The numbers of one cell.
    fn gather_one(&self, cell: [u32; 3]) -> [f32; 8];

    /// The numbers of `N` cells, whose indices are given axis by axis as integers.
    fn gather_lanes<T: Float, const N: usize>(&self, cells: [[T; N]; 3]) -> [[T; N]; 8];
}

macro_rules! float {
    ($float:ident, $precision:ident, $sqrt:ident, $trunc:ident, $index:ident, $min:ident, $max:ident, $max_coordinate:literal, $lost_length:literal) => {
        impl Real for $float {
            type Mask = bool;
            type Lane = Self;
            const LANES: usize = 1;
            const EPSILON: f64 = $float::EPSILON as f64;
            const MAX_COORDINATE: f64 = $max_coordinate;
            const LOST_LENGTH: f64 = $lost_length;

            #[inline(always)]
            fn from_f64(x: f64) -> Self {
                x as $float
            }
            #[inline(always)]
            fn from_parameter(parameter: Parameter) -> Self {
                parameter.$precision
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                backend::$sqrt(self)
            }
            #[inline(always)]
            fn trunc(self) -> Self {
                backend::$trunc(self)
            }
            #[inline(always)]
            fn min_number(self, other: Self) -> Self {
                backend::$min(self, other)
            }
            #[inline(always)]
            fn max_number(self, other: Self) -> Self {
                backend::$max(self, other)
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
                table.gather_one([x, y, z].map(backend::$index)).map(Self::from_stored)
            }
        }

        impl Float for $float {
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self as f64
            }
            #[inline(always)]
            fn to_single(self) -> f32 {
                self as f32
            }
            #[inline(always)]
            fn to_index(self) -> u32 {
                (f64::from(self) + backend::UNIT_ULP).to_bits() as u32
            }
            #[inline(always)]
            fn to_count(self) -> u32 {
                self as u32
            }
            #[inline(always)]
            fn from_stored(stored: f32) -> Self {
                stored as $float
            }
        }
    };
}

float!(f32, single, sqrtf, truncf, indexf, minf, maxf, 1e18, 5e-23);
float!(f64, double, sqrt, trunc, index, min, max, 1e150, 3e-162);
