//! Delta coding of a brick's codes, so that they deflate to between a half and three quarters.
//!
//! Along x, then y, then z, each code is replaced by its difference from the one before, modulo 2¹⁶ or 2⁸. If the field
//! is nearly linear in the brick, little but noise is left. Decoding is a sum along each axis.

use sdf_core::grid::sparse::BRICK;

use crate::hdf5::Element;

/// Sample types with a reversible delta coding of bricks.
pub(super) trait DeltaCoding: Element {
    fn delta_encode(brick: &mut [Self]);
    fn delta_decode(brick: &mut [Self]);
}

/// The identity: differences of floats would round.
impl DeltaCoding for f32 {
    fn delta_encode(_brick: &mut [Self]) {}
    fn delta_decode(_brick: &mut [Self]) {}
}

const SIDE: usize = BRICK as usize;
const STRIDES: [usize; 3] = [1, SIDE, SIDE * SIDE];

macro_rules! delta_coding {
    ($code:ident) => {
        impl DeltaCoding for $code {
            fn delta_encode(brick: &mut [Self]) {
                for stride in STRIDES {
                    for node in (0..brick.len()).rev().filter(|node| node / stride % SIDE > 0) {
                        brick[node] = brick[node].wrapping_sub(brick[node - stride]);
                    }
                }
            }
            fn delta_decode(brick: &mut [Self]) {
                for stride in STRIDES {
                    for node in (0..brick.len()).filter(|node| node / stride % SIDE > 0) {
                        brick[node] = brick[node].wrapping_add(brick[node - stride]);
                    }
                }
            }
        }
    };
}

delta_coding!(u16);
delta_coding!(u8);
