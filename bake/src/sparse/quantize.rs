use sdf_core::grid::sparse::{Code, Scale};

/// How samples are kept.
pub trait Quantize: Code + Send + Sync {
    /// The scale for a brick's samples.
    fn scale(least: f32, greatest: f32) -> Scale;
    /// The code that decodes nearest to the sample.
    fn encode(sample: f32, scale: Scale) -> Self;
}

impl Quantize for f32 {
    fn scale(_least: f32, _greatest: f32) -> Scale {
        Scale { base: 0.0, step: 1.0 }
    }
    fn encode(sample: f32, _scale: Scale) -> Self {
        sample
    }
}

macro_rules! quantize {
    ($code:ident) => {
        impl Quantize for $code {
            fn scale(least: f32, greatest: f32) -> Scale {
                Scale { base: least, step: (greatest - least) / f32::from($code::MAX) }
            }
            fn encode(sample: f32, scale: Scale) -> Self {
                if scale.step > 0.0 { ((sample - scale.base) / scale.step).round() as $code } else { 0 }
            }
        }
    };
}

quantize!(u16);
quantize!(u8);
