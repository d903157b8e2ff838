use sdf_core::grid::sparse::{Code, Scale};

/// Type of a stored sample.
pub trait Quantize: Code + Default + Send + Sync {
    /// Scale of a brick whose samples range from `lower` to `upper`.
    fn scale(lower: f32, upper: f32) -> Scale;
    /// Code that decodes nearest to a sample.
    fn encode(sample: f32, scale: Scale) -> Self;
    /// As [`Self::encode`], in SIMD lanes, for `inv_step` = 1 / step and a sample in the scale's range.
    fn encode_by(sample: f32, base: f32, inv_step: f32) -> Self;
}

impl Quantize for f32 {
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
    ($code:ident) => {
        impl Quantize for $code {
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

quantize!(u16);
quantize!(u8);
