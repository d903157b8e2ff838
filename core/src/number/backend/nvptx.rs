//! Functions of NVIDIA's processors, whose conversions between floats and integers, and choices by a comparison, take longer than
//! additions.

/// 2²³: added to a smaller f32, it leaves an integer in the low bits.
const UNIT_ULP_F32: f32 = 8_388_608.0;

/// Toward zero; 0 below zero.
#[inline(always)]
pub fn truncf(x: f32) -> f32 {
    core::f32::math::floor(x).max(0.0)
}

/// An integer in 0 ≤ x < 2²³: no axis of a grid on a card has as many cells.
#[inline(always)]
pub fn indexf(x: f32) -> u32 {
    (x + UNIT_ULP_F32).to_bits().wrapping_sub(UNIT_ULP_F32.to_bits())
}

/// The smaller number; the other of NaN.
#[inline(always)]
pub fn minf(a: f32, b: f32) -> f32 {
    a.min(b)
}

/// The larger number; the other of NaN.
#[inline(always)]
pub fn maxf(a: f32, b: f32) -> f32 {
    a.max(b)
}
