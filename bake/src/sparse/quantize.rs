use sdf_core::grid::sparse::{Code, Scale};

/// The codes of some bricks, to be written. What computes bricks does not depend on the type of a code, and is compiled once.
pub enum CodesMut<'a> {
    F32(&'a mut [f32]),
    U16(&'a mut [u16]),
    U8(&'a mut [u8]),
}

impl CodesMut<'_> {
    /// The codes from `start` to before `end`.
    pub fn range(&mut self, start: usize, end: usize) -> CodesMut<'_> {
        match self {
            Self::F32(codes) => CodesMut::F32(&mut codes[start..end]),
            Self::U16(codes) => CodesMut::U16(&mut codes[start..end]),
            Self::U8(codes) => CodesMut::U8(&mut codes[start..end]),
        }
    }
}

/// The codes of some bricks.
#[derive(Clone, Copy)]
pub enum CodesRef<'a> {
    F32(&'a [f32]),
    U16(&'a [u16]),
    U8(&'a [u8]),
}

/// Type of a stored sample.
pub trait Quantize: Code + Default + Send + Sync {
    /// Codes whose type is known at run time.
    #[doc(hidden)]
    fn codes(codes: &[Self]) -> CodesRef<'_>;
    /// As [`Self::codes`], to be written.
    #[doc(hidden)]
    fn codes_mut(codes: &mut [Self]) -> CodesMut<'_>;
    /// Scale of a brick whose samples range from `lower` to `upper`.
    fn scale(lower: f32, upper: f32) -> Scale;
    /// Code that decodes nearest to a sample.
    fn encode(sample: f32, scale: Scale) -> Self;
    /// As [`Self::encode`], in SIMD lanes, for `inv_step` = 1 / step and a sample in the scale's range.
    fn encode_by(sample: f32, base: f32, inv_step: f32) -> Self;
}

impl Quantize for f32 {
    fn codes(codes: &[Self]) -> CodesRef<'_> {
        CodesRef::F32(codes)
    }
    fn codes_mut(codes: &mut [Self]) -> CodesMut<'_> {
        CodesMut::F32(codes)
    }
    fn scale(_lower: f32, _upper: f32) -> Scale {
        Scale { base: 0.0, step: 1.0 }
    }
    fn encode(sample: f32, _scale: Scale) -> Self {
        sample
    }
    #[inline(always)]
    fn encode_by(sample: f32, _base: f32, _inv_step: f32) -> Self {
        sample
    }
}

/// 2²³: a number below it, added to it, is rounded to a whole one that stands in its lowest bits.
const TO_LOWEST_BITS: f32 = 8_388_608.0;

macro_rules! quantize {
    ($code:ident, $variant:ident) => {
        impl Quantize for $code {
            fn codes(codes: &[Self]) -> CodesRef<'_> {
                CodesRef::$variant(codes)
            }
            fn codes_mut(codes: &mut [Self]) -> CodesMut<'_> {
                CodesMut::$variant(codes)
            }
            fn scale(lower: f32, upper: f32) -> Scale {
                Scale { base: lower, step: (upper - lower) / f32::from($code::MAX) }
            }
            fn encode(sample: f32, scale: Scale) -> Self {
                if scale.step > 0.0 { ((sample - scale.base) / scale.step).round() as $code } else { 0 }
            }
            #[inline(always)]
            fn encode_by(sample: f32, base: f32, inv_step: f32) -> Self {
                let code = (sample - base) * inv_step;
                let code = if code < f32::from($code::MAX) { code } else { f32::from($code::MAX) };
                (code + TO_LOWEST_BITS).to_bits() as $code
            }
        }
    };
}

quantize!(u16, U16);
quantize!(u8, U8);
