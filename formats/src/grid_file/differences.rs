//! Samples of bricks as the file has them: codes as differences, which pack into a half to three quarters.
//!
//! A code is replaced by what it differs from the one before it, along x, then y, then z, in its brick and modulo 2^16 or
//! 2^8. Of a field that is nearly linear in a brick, little but noise is left. Undone by sums along the axes.

use std::borrow::Cow;

use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES};

use super::element::Element;

pub(super) trait Differences: Element {
    fn differences(samples: &[Self]) -> Cow<'_, [Self]>;
    fn sum(brick: &mut [Self]);
}

/// Stored as they are: their bits do not add up.
impl Differences for f32 {
    fn differences(samples: &[Self]) -> Cow<'_, [Self]> {
        Cow::Borrowed(samples)
    }
    fn sum(_brick: &mut [Self]) {}
}

const SIDE: usize = BRICK as usize;
const STEPS: [usize; 3] = [1, SIDE, SIDE * SIDE];

macro_rules! differences {
    ($code:ident) => {
        impl Differences for $code {
            fn differences(samples: &[Self]) -> Cow<'_, [Self]> {
                let mut samples = samples.to_vec();
                for brick in samples.chunks_exact_mut(BRICK_SAMPLES) {
                    for step in STEPS {
                        for at in (0..BRICK_SAMPLES).rev().filter(|at| at / step % SIDE > 0) {
                            brick[at] = brick[at].wrapping_sub(brick[at - step]);
                        }
                    }
                }
                Cow::Owned(samples)
            }
            fn sum(brick: &mut [Self]) {
                for step in STEPS {
                    for at in (0..brick.len()).filter(|at| at / step % SIDE > 0) {
                        brick[at] = brick[at].wrapping_add(brick[at - step]);
                    }
                }
            }
        }
    };
}

differences!(u16);
differences!(u8);
