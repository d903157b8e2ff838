//! Eight numbers side by side, one per SIMD lane.
//!
//! Lanes are plain arrays. A loop `for lane in 0..LANES` without branches compiles to the vector instructions that
//! `pulp` dispatches at run time; `#[inline(always)]` lets each helper take the instruction set of its caller.

use std::ops::{Add, BitOr, Mul, Sub};

/// Numbers per register: eight `f64` fill 512 bits, the widest registers.
pub(crate) const LANES: usize = 8;

/// One number per lane.
pub(crate) type Lanes<T> = [T; LANES];

/// One vector per lane, as a structure of arrays.
pub(crate) type VectorX8<T> = [Lanes<T>; 3];

/// The vector in one lane.
#[inline(always)]
pub(crate) fn lane_of<T: Copy, const L: usize>(vectors: &[[T; L]; 3], lane: usize) -> [T; 3] {
    [vectors[0][lane], vectors[1][lane], vectors[2][lane]]
}

#[inline(always)]
pub(crate) fn dot<T: Copy + Add<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3]) -> T {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// [`dot`] with fused products. Only for what is inlined into dispatched code: elsewhere each is a call of a library.
#[inline(always)]
pub(crate) fn fused_dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

#[inline(always)]
pub(crate) fn sub<T: Copy + Sub<Output = T>>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
pub(crate) fn cross<T: Copy + Sub<Output = T> + Mul<Output = T>>(a: [T; 3], b: [T; 3]) -> [T; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// One instruction, unlike `f64::max`: returns `b` if either is NaN or both are equal.
#[inline(always)]
pub(crate) fn max<T: Copy + PartialOrd>(a: T, b: T) -> T {
    if a > b { a } else { b }
}

/// One instruction, unlike `f64::min`: returns `b` if either is NaN or both are equal.
#[inline(always)]
pub(crate) fn min<T: Copy + PartialOrd>(a: T, b: T) -> T {
    if a < b { a } else { b }
}

/// Lesser of two numbers that are not negative, by their bits; NaN is greater than all.
///
/// To be taken where the result replaces `a` or `b` in memory. There a comparison becomes a store of those lanes alone that change,
/// which takes AMD's processors a hundred cycles with AVX2.
#[inline(always)]
pub(crate) fn lesser_magnitude(a: f32, b: f32) -> f32 {
    f32::from_bits(a.to_bits().min(b.to_bits()))
}

/// Greater of two numbers that are not negative: see [`lesser_magnitude`].
#[inline(always)]
pub(crate) fn greater_magnitude(a: f32, b: f32) -> f32 {
    f32::from_bits(a.to_bits().max(b.to_bits()))
}

/// Bitwise or of all lanes. Fast where the lanes are read from memory: of lanes that were just compared, each is looked at by itself.
#[inline(always)]
pub(crate) fn or_lanes<T: Copy + Default + BitOr<Output = T>>(lanes: &Lanes<T>) -> T {
    lanes.iter().fold(T::default(), |any, lane| any | *lane)
}

/// One bit for each lane.
#[inline(always)]
pub(crate) fn bits_of(lanes: &Lanes<bool>) -> u32 {
    bits_of_bytes(&lanes.map(u8::from)) as u32
}

/// Bits of some bytes, up to 64, that are 0 or 1: eight at a time by a product, in which no two bits meet.
#[inline(always)]
pub(crate) fn bits_of_bytes<const N: usize>(bytes: &[u8; N]) -> u64 {
    let mut bits = 0;
    for eight in 0..N / 8 {
        let word = u64::from_le_bytes(std::array::from_fn(|byte| bytes[8 * eight + byte]));
        bits |= (word.wrapping_mul(0x0102_0408_1020_4080) >> 56) << (8 * eight);
    }
    bits
}

/// One list of indices per lane, filled without branches.
pub(crate) struct LaneLists {
    lists: Lanes<Vec<u32>>,
    counts: Lanes<usize>,
}

impl LaneLists {
    pub fn new() -> Self {
        Self { lists: Default::default(), counts: [0; LANES] }
    }

    /// Empties all lists and makes room for `capacity` indices in each.
    #[inline(always)]
    pub fn clear(&mut self, capacity: usize) {
        self.counts = [0; LANES];
        for list in &mut self.lists {
            if list.len() < capacity {
                list.resize(capacity, 0);
            }
        }
    }

    /// Appends an index to the lists whose lane of `is_member` is 1, not 0. Branch-free: the lanes are unpredictable.
    #[inline(always)]
    pub fn push(&mut self, index: u32, is_member: &Lanes<u32>) {
        for lane in 0..LANES {
            self.lists[lane][self.counts[lane]] = index;
            self.counts[lane] += is_member[lane] as usize;
        }
    }

    pub fn clear_lane(&mut self, lane: usize) {
        self.counts[lane] = 0;
    }

    pub fn lane(&self, lane: usize) -> &[u32] {
        &self.lists[lane][..self.counts[lane]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_are_those_of_the_bytes() {
        for bits in [0, 1, 0x80, 0x8100, u64::MAX, 0x0123_4567_89ab_cdef, 0xfefe_0000_0000_0001] {
            let bytes: [u8; 64] = std::array::from_fn(|bit| (bits >> bit & 1) as u8);
            assert_eq!(bits_of_bytes(&bytes), bits);
            assert_eq!(bits_of(&std::array::from_fn(|lane| bytes[lane] == 1)), bits as u32 & 0xff);
        }
    }

    #[test]
    fn magnitudes_are_compared_as_numbers() {
        let numbers = [0.0, 1e-45, 1e-38, 0.5, 1.0, 1.0_f32.next_up(), 3e38, f32::INFINITY];
        for (i, a) in numbers.into_iter().enumerate() {
            assert_eq!((lesser_magnitude(a, f32::NAN), lesser_magnitude(f32::NAN, a)), (a, a));
            for (j, b) in numbers.into_iter().enumerate() {
                assert_eq!(lesser_magnitude(a, b), numbers[i.min(j)]);
                assert_eq!(greater_magnitude(a, b), numbers[i.max(j)]);
            }
        }
    }
}
