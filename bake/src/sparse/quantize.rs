use sdf_core::grid::sparse::{Code, Scale};

/// Type of a stored sample.
pub trait Quantize: Code + Send + Sync {
    /// Scale of a brick whose samples range from `lower` to `upper`.
    fn scale(lower: f32, upper: f32) -> Scale;
    /// Code that decodes nearest to a sample.
    fn encode(sample: f32, scale: Scale) -> Self;
}

impl Quantize for f32 {
    fn scale(_lower: f32, _upper: f32) -> Scale {
        Scale { base: 0.0, step: 1.0 }
    }
    fn encode(sample: f32, _scale: Scale) -> Self {
        sample
    }
}

macro_rules! quantize {
    ($code:ident) => {
        impl Quantize for $code {
            fn scale(lower: f32, upper: f32) -> Scale {
                Scale { base: lower, step: (upper - lower) / f32::from($code::MAX) }
            }
            fn encode(sample: f32, scale: Scale) -> Self {
                if scale.step > 0.0 { ((sample - scale.base) / scale.step).round() as $code } else { 0 }
            }
        }
    };
}

quantize!(u16);
quantize!(u8);
