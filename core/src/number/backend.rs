//! Square roots and truncation of `f32` and `f64`: the only functions that depend on the build.
//!
//! | features | file | square root | truncation |
//! |---|---|---|---|
//! | `std` | `std` | inlined instruction | additions, which vector units have |
//! | `core-math` without `std` | `core_math` | inlined instruction (unstable `core_float_math`) | conversion to `u32` |
//! | neither | `libm` | in software on some targets | conversion to `u32` |
//!
//! All square roots are correctly rounded (IEEE 754), so answers have the same bits in every build.

#[cfg(all(feature = "core-math", not(feature = "std")))]
mod core_math;
#[cfg(not(any(feature = "core-math", feature = "std")))]
mod libm;
#[cfg(feature = "std")]
mod std;

#[cfg(all(feature = "core-math", not(feature = "std")))]
pub use self::core_math::{sqrt, sqrtf};
#[cfg(not(any(feature = "core-math", feature = "std")))]
pub use self::libm::{sqrt, sqrtf};
#[cfg(feature = "std")]
pub use self::std::{sqrt, sqrtf, trunc, truncf};
#[cfg(not(feature = "std"))]
pub use convert::{trunc, truncf};

/// Smallest f64 from which on neighbouring numbers are 1 apart: 2⁵². Adding it rounds a smaller number to an integer,
/// which then stands in the low bits.
pub const UNIT_ULP: f64 = 4_503_599_627_370_496.0;

/// Truncation by conversion: one instruction on scalar processors. It saturates, which vector units do not, so that a
/// loop over it does not become one over vectors.
#[cfg(not(feature = "std"))]
mod convert {
    /// Toward zero; 0 below zero.
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
