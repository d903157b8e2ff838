pub use core::f32::math::sqrt as sqrtf;
pub use core::f64::math::sqrt;
