//! Square roots, truncation, conversion to an index, minimum and maximum of `f32` and `f64`: the only functions that depend on the build.
//!
//! | features | file | square root | truncation |
//! |---|---|---|---|
//! | `std` | `std` | inlined instruction | additions, which vector units have |
//! | `core-math` without `std` | `core_math` | inlined instruction (unstable `core_float_math`) | conversion to `u32` |
//! | the same, on nvptx64 | `core_math`, `nvptx` | inlined instruction | rounding down |
//! | neither | `libm` | in software on some targets | conversion to `u32` |
//!
//! All square roots are correctly rounded (IEEE 754), so answers have the same bits in every build.

#[cfg(all(feature = "core-math", not(feature = "std")))]
mod core_math;
#[cfg(not(any(feature = "core-math", feature = "std")))]
mod libm;
#[cfg(target_arch = "nvptx64")]
mod nvptx;
#[cfg(feature = "std")]
mod std;

#[cfg(all(feature = "core-math", not(feature = "std")))]
pub use self::core_math::{sqrt, sqrtf};
#[cfg(not(any(feature = "core-math", feature = "std")))]
pub use self::libm::{sqrt, sqrtf};
#[cfg(target_arch = "nvptx64")]
pub use self::nvptx::{indexf, maxf, minf, truncf};
#[cfg(feature = "std")]
pub use self::std::{sqrt, sqrtf, trunc, truncf};
#[cfg(not(feature = "std"))]
pub use convert::trunc;
#[cfg(not(any(feature = "std", target_arch = "nvptx64")))]
pub use convert::truncf;
pub use scalar::{index, max, min};
#[cfg(not(target_arch = "nvptx64"))]
pub use scalar::{indexf, maxf, minf};

/// Smallest f64 from which on neighbouring numbers are 1 apart: 2⁵². Adding it rounds a smaller number to an integer,
/// which then stands in the low bits.
pub const UNIT_ULP: f64 = 4_503_599_627_370_496.0;

/// Conversion to an index, minimum and maximum by the language's own means.
mod scalar {
    macro_rules! scalar {
        ($float:ident, $index:ident, $min:ident, $max:ident) => {
            /// An integer in 0 ≤ x < 2³¹.
            #[inline(always)]
            pub fn $index(x: $float) -> u32 {
                x as u32
            }
            /// The smaller number; the first if one is NaN.
            #[inline(always)]
            pub fn $min(a: $float, b: $float) -> $float {
                if b < a { b } else { a }
            }
            /// The larger number; the first if one is NaN.
            #[inline(always)]
            pub fn $max(a: $float, b: $float) -> $float {
                if a < b { b } else { a }
            }
        };
    }
    scalar!(f64, index, min, max);
    #[cfg(not(target_arch = "nvptx64"))]
    scalar!(f32, indexf, minf, maxf);
}

/// Truncation by conversion: one instruction on scalar processors. It saturates, which vector units do not, so that a
/// loop over it does not become one over vectors.
#[cfg(not(feature = "std"))]
mod convert {
    /// Toward zero; 0 below zero.
    #[cfg(not(target_arch = "nvptx64"))]
    #[inline(always)]
    pub fn truncf(x: f32) -> f32 {
        x as u32 as f32
    }
    /// Toward zero; 0 below zero.
    #[inline(always)]
    pub fn trunc(x: f64) -> f64 {
        x as u32 as f64
    }
}
