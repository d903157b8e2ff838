use super::UNIT_ULP;

/// 2²³, the [`UNIT_ULP`] of f32.
const UNIT_ULP_F32: f32 = 8_388_608.0;

#[inline(always)]
pub fn sqrtf(x: f32) -> f32 {
    x.sqrt()
}

#[inline(always)]
pub fn sqrt(x: f64) -> f64 {
    x.sqrt()
}

/// Toward zero; 0 below zero. Rounds to nearest by an addition and corrects downwards: no conversion and no branch.
#[inline(always)]
pub fn truncf(x: f32) -> f32 {
    let nearest = (x + UNIT_ULP_F32) - UNIT_ULP_F32;
    let whole = nearest - if x < nearest { 1.0 } else { 0.0 };
    // From 2²³ on every f32 is an integer.
    let whole = if x < UNIT_ULP_F32 { whole } else { x };
    if 0.0 < whole { whole } else { 0.0 }
}

/// Toward zero, for x < 2³¹; 0 below zero. As [`truncf`].
#[inline(always)]
pub fn trunc(x: f64) -> f64 {
    let nearest = (x + UNIT_ULP) - UNIT_ULP;
    let whole = nearest - if x < nearest { 1.0 } else { 0.0 };
    if 0.0 < whole { whole } else { 0.0 }
}
