pub use ::libm::{sqrt, sqrtf};
