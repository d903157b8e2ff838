//! From distances and sides to stored samples, sixteen nodes at a time.

use sdf_core::grid::sparse::Scale;

use super::frame::{greater, lesser, mix};
use super::packed::{WIDTH, Wide};
use super::sides::{NODES, NodeBits};
use crate::sparse::{CodesMut, Quantize};

/// One brick, measured and signed. Lengths are in voxels.
pub(super) struct SignedBrick<'a> {
    pub distances: &'a [f32; NODES],
    pub inside: &'a NodeBits,
    /// Magnitudes of the coarse grid at the corners of the slot. `None`: the brick holds distances throughout.
    pub coarse: Option<[f32; 8]>,
    /// W: nodes nearer than this hold distances.
    pub exact_within: f32,
    pub spacing: f32,
}

impl SignedBrick<'_> {
    /// Writes the codes. Returns how to decode them, and the largest difference of a decoded sample from the value.
    pub fn encode(&self, arch: pulp::Arch, codes: CodesMut) -> (Scale, f32) {
        match codes {
            CodesMut::F32(codes) => arch.dispatch(Encode { brick: self, codes }),
            CodesMut::U16(codes) => arch.dispatch(Encode { brick: self, codes }),
            CodesMut::U8(codes) => arch.dispatch(Encode { brick: self, codes }),
        }
    }

    /// Magnitudes of two rows, from the coarse grid: no less than W.
    #[inline(always)]
    fn coarse_rows(&self, coarse: &[f32; 8], pair: usize) -> Wide {
        let mut values = [self.exact_within; WIDTH];
        for half in 0..2 {
            let row = 2 * pair + half;
            let (y, z) = ((row % 8) as f32 / 8.0, (row / 8) as f32 / 8.0);
            let mut ends = [0.0; 2];
            for (end, value) in ends.iter_mut().enumerate() {
                let near = mix(coarse[end], coarse[end + 2], y);
                let far = mix(coarse[end + 4], coarse[end + 6], y);
                *value = mix(near, far, z);
            }
            for x in 0..8 {
                values[8 * half + x] = greater(mix(ends[0], ends[1], x as f32 / 8.0), self.exact_within);
            }
        }
        values
    }
}

struct Encode<'a, 'b, C> {
    brick: &'a SignedBrick<'b>,
    codes: &'a mut [C],
}

impl<C: Quantize> pulp::NullaryFnOnce for Encode<'_, '_, C> {
    type Output = (Scale, f32);

    #[inline(always)]
    fn call(self) -> (Scale, f32) {
        let Self { brick, codes } = self;
        let mut values = [0.0_f32; NODES];
        let (mut least, mut greatest) = ([f32::INFINITY; WIDTH], [f32::NEG_INFINITY; WIDTH]);
        let coarse = brick.coarse.filter(|coarse| coarse.iter().any(|value| *value > brick.exact_within));
        let limit = if brick.coarse.is_some() { brick.exact_within } else { f32::INFINITY };
        for pair in 0..NODES / WIDTH {
            let sides = (brick.inside[pair / 4] >> (WIDTH * (pair % 4))) as u32;
            let most = match &coarse {
                Some(coarse) => brick.coarse_rows(coarse, pair),
                None => [limit; WIDTH],
            };
            let mut now = [0.0_f32; WIDTH];
            for lane in 0..WIDTH {
                let magnitude = lesser(brick.distances[WIDTH * pair + lane], most[lane]) * brick.spacing;
                now[lane] = f32::from_bits(magnitude.to_bits() | (sides >> lane & 1) << 31);
            }
            values[WIDTH * pair..WIDTH * (pair + 1)].copy_from_slice(&now);
            let (before, after) = (least, greatest);
            for lane in 0..WIDTH {
                least[lane] = lesser(now[lane], before[lane]);
                greatest[lane] = greater(now[lane], after[lane]);
            }
        }
        let lower = least.into_iter().fold(f32::INFINITY, lesser);
        let upper = greatest.into_iter().fold(f32::NEG_INFINITY, greater);
        let scale = C::scale(lower, upper);
        let inv_step = if scale.step > 0.0 { 1.0 / scale.step } else { 0.0 };
        let mut errors = [0.0_f32; WIDTH];
        for (codes, values) in codes.chunks_exact_mut(WIDTH).zip(values.chunks_exact(WIDTH)) {
            let before = errors;
            for lane in 0..WIDTH {
                let code = C::encode_by(values[lane], scale.base, inv_step);
                codes[lane] = code;
                errors[lane] = greater((code.decode(scale) - values[lane]).abs(), before[lane]);
            }
        }
        (scale, errors.into_iter().fold(0.0, greater))
    }
}
