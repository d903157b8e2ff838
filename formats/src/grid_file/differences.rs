//! Samples of bricks as the file has them: codes as differences, which pack into a half to three quarters.
//!
//! A code is replaced by what it differs from the one before it, along x, then y, then z, in its brick and modulo 2^16 or
//! 2^8. Of a field that is nearly linear in a brick, little but noise is left. Undone by sums along the axes.

use sdf_core::grid::sparse::BRICK;

use super::element::Element;

pub(super) trait Differences: Element {
    fn differ(brick: &mut [Self]);
    /// Undoes it.
    fn sum(brick: &mut [Self]);
}

/// Stored as they are: their bits do not add up.
impl Differences for f32 {
    fn differ(_brick: &mut [Self]) {}
    fn sum(_brick: &mut [Self]) {}
}

const SIDE: usize = BRICK as usize;
const STEPS: [usize; 3] = [1, SIDE, SIDE * SIDE];

macro_rules! differences {
    ($code:ident) => {
        impl Differences for $code {
            fn differ(brick: &mut [Self]) {
                for step in STEPS {
                    for at in (0..brick.len()).rev().filter(|at| at / step % SIDE > 0) {
                        brick[at] = brick[at].wrapping_sub(brick[at - step]);
                    }
                }
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
