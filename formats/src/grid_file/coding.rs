//! Coding of a brick's codes: as they are, or as differences, which deflate to between a half and three quarters.
//!
//! Along x, then y, then z, each code is replaced by its difference from the one before, modulo 2¹⁶ or 2⁸. If the field
//! is nearly linear in the brick, little but noise is left. Decoding is a sum along each axis: of rows and layers as vectors, and
//! within a row of eight in three steps (Hillis and Steele 1986).

use sdf_core::grid::sparse::{BRICK, BRICK_SAMPLES};

use crate::hdf5::{Compression, Element};

/// How a file stores the codes of its bricks, or of the blocks of a dense grid. Samples in f32 are stored as they are in either.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coding {
    /// Differences along x, y and z: before version 4.
    Differences,
    /// Differences d as 2 d, or -2 d - 1 of negative ones: small numbers have a high byte of zero, of either sign.
    Zigzag,
    /// As they are.
    Plain,
}

impl Coding {
    pub(super) const ALL: [Self; 3] = [Self::Differences, Self::Zigzag, Self::Plain];

    /// `differences`, `zigzag` or `plain`, as files have it.
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Differences => "differences",
            Self::Zigzag => "zigzag",
            Self::Plain => "plain",
        }
    }

    /// The coding that is written: differences only help what is deflated.
    pub(super) fn of(compression: Compression) -> Self {
        match compression {
            Compression::Deflate => Self::Zigzag,
            Compression::None => Self::Plain,
        }
    }
}

/// Sample types with reversible codings of bricks.
pub(super) trait BrickCoding: Element {
    fn encode_brick(brick: &mut [Self], coding: Coding);
    fn decode_brick(brick: &mut [Self], coding: Coding);
}

/// The identity: differences of floats would round.
impl BrickCoding for f32 {
    fn encode_brick(_brick: &mut [Self], _coding: Coding) {}
    fn decode_brick(_brick: &mut [Self], _coding: Coding) {}
}

const SIDE: usize = BRICK as usize;
/// Rows in a layer, and layers in a brick.
type Rows<C> = [[[C; SIDE]; SIDE]; SIDE];

macro_rules! brick_coding {
    ($code:ident) => {
        impl BrickCoding for $code {
            fn encode_brick(brick: &mut [Self], coding: Coding) {
                if coding == Coding::Plain {
                    return;
                }
                let Some(rows) = rows(brick) else { return };
                for row in (0..SIDE * SIDE).rev() {
                    let (z, y) = (row / SIDE, row % SIDE);
                    let at = |z: usize, y: usize| rows[z][y];
                    let mut differences = at(z, y);
                    if z > 0 {
                        subtract(&mut differences, at(z - 1, y));
                    }
                    if y > 0 {
                        subtract(&mut differences, at(z, y - 1));
                    }
                    if y > 0 && z > 0 {
                        add(&mut differences, at(z - 1, y - 1));
                    }
                    let before = differences;
                    for x in 1..SIDE {
                        differences[x] = differences[x].wrapping_sub(before[x - 1]);
                    }
                    if coding == Coding::Zigzag {
                        // All bits are those of the sign.
                        differences.iter_mut().for_each(|d| *d = *d << 1 ^ (*d >> ($code::BITS - 1)).wrapping_neg());
                    }
                    rows[z][y] = differences;
                }
                fn add(to: &mut [$code; SIDE], row: [$code; SIDE]) {
                    to.iter_mut().zip(row).for_each(|(to, code)| *to = to.wrapping_add(code));
                }
                fn subtract(from: &mut [$code; SIDE], row: [$code; SIDE]) {
                    from.iter_mut().zip(row).for_each(|(from, code)| *from = from.wrapping_sub(code));
                }
            }

            fn decode_brick(brick: &mut [Self], coding: Coding) {
                if coding == Coding::Plain {
                    return;
                }
                let Some(rows) = rows(brick) else { return };
                let mut below = [[0 as $code; SIDE]; SIDE];
                for layer in rows {
                    let mut before = [0 as $code; SIDE];
                    for (row, below) in layer.iter_mut().zip(&mut below) {
                        let mut sums = *row;
                        if coding == Coding::Zigzag {
                            sums.iter_mut().for_each(|d| *d = *d >> 1 ^ (*d & 1).wrapping_neg());
                        }
                        for shift in [1, 2, 4] {
                            let shifted = sums;
                            for x in shift..SIDE {
                                sums[x] = sums[x].wrapping_add(shifted[x - shift]);
                            }
                        }
                        for x in 0..SIDE {
                            before[x] = before[x].wrapping_add(sums[x]);
                            below[x] = below[x].wrapping_add(before[x]);
                        }
                        *row = *below;
                    }
                }
            }
        }
    };
}

fn rows<C>(brick: &mut [C]) -> Option<&mut Rows<C>> {
    debug_assert_eq!(brick.len(), BRICK_SAMPLES);
    let (rows, _) = brick.as_chunks_mut::<SIDE>();
    let (layers, _) = rows.as_chunks_mut::<SIDE>();
    layers.as_chunks_mut::<SIDE>().0.first_mut()
}

brick_coding!(u16);
brick_coding!(u8);
